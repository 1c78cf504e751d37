//! `/wires`: the wires between the robots of this process, and the lines that lead to them from outside.
//!
//! [`ts3100_driver::world`] defines the behaviour of a wire.

use super::resource::{Answer, Deserialize, Json, Path, Problem, Serialize, View, call};
use super::robots::{Fleet, Robots, WireInfo};
use axum::Extension;

/// The wires.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Wires))]
pub struct WireList {
    /// Wires in the order of the configuration.
    wires: Vec<WireInfo>,
}

/// The new level of an outside line.
#[derive(Debug, Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct SetOutside {
    /// Whether the line is on.
    on: bool,
}

fn levels(view: &View<'_>) -> Vec<bool> {
    view.wire_levels()
}

async fn list(robots: &dyn Robots) -> Answer<WireList> {
    let mut wires = Vec::new();
    if let Some(known) = robots.wires() {
        let levels = known.handle.query(levels).await?;
        let ends = known.ends.into_iter().zip(levels);
        wires.extend(ends.map(|((from, to), on)| WireInfo { from, to, on }));
    }
    Ok(Json(WireList { wires }))
}

call! {
    /// List the wires
    get_wires = get("/wires", responses((status = 200, body = WireList)))
}
pub async fn get_wires(Extension(robots): Fleet) -> Answer<WireList> {
    list(robots.as_ref()).await
}

call! {
    /// Set an outside line
    ///
    /// A line at which a wire begins. All immediate consequences have happened when the call returns.
    put_outside = put("/wires/outside/{name}",
        params(("name" = String, Path, description = "Name of the line")),
        request_body = SetOutside,
        responses((status = 200, body = WireList)))
}
pub async fn put_outside(
    Extension(robots): Fleet,
    Path(name): Path<String>,
    Json(body): Json<SetOutside>,
) -> Answer<WireList> {
    let wires = robots.wires();
    if let Some(wires) = &wires
        && wires.handle.set_outside(name.clone(), body.on).await?
    {
        return list(robots.as_ref()).await;
    }
    let begins = wires.iter().flat_map(|wires| &wires.ends);
    let names: Vec<&str> = begins
        .filter_map(|(from, _)| from.strip_prefix("outside."))
        .collect();
    let expected = match names.is_empty() {
        true => "one at which a wire begins (there is none)".to_owned(),
        false => names.join(", "),
    };
    Err(Problem::not_found("outside line", expected, name))
}
