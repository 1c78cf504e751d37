//! `/wires`: the wires between the robots of this process, and the lines that lead to them from outside.
//!
//! What a wire does is [`ts3100_driver::driver::wired`].

use super::resource::{Answer, Deserialize, Json, Path, Problem, Serialize, ToSchema};
use super::robots::{Fleet, Robots, WireInfo};
use axum::Extension;

/// The wires.
#[derive(Debug, Clone, Serialize, ToSchema)]
#[schema(as = Wires)]
pub struct WireList {
    /// In the order of the configuration.
    wires: Vec<WireInfo>,
}

/// The new level of an outside line.
#[derive(Debug, Clone, Copy, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SetOutside {
    /// Whether it is on.
    on: bool,
}

fn list(robots: &dyn Robots) -> WireList {
    let wires = robots.wires().unwrap_or_default();
    WireList { wires }
}

/// List the wires
#[utoipa::path(get, path = "/wires", responses((status = 200, body = WireList)))]
pub async fn get_wires(Extension(robots): Fleet) -> Json<WireList> {
    Json(list(robots.as_ref()))
}

/// Set an outside line
///
/// A line at which a wire begins. Everything that follows from it at once has happened when the call returns.
#[utoipa::path(put, path = "/wires/outside/{name}", params(("name" = String, Path, description = "Name of the line")),
    request_body = SetOutside, responses((status = 200, body = WireList)))]
pub async fn put_outside(
    Extension(robots): Fleet,
    Path(name): Path<String>,
    Json(body): Json<SetOutside>,
) -> Answer<WireList> {
    let Some(wires) = robots.wire_handle().filter(|wires| wires.can_set(&name)) else {
        let wires = robots.wires().unwrap_or_default().into_iter();
        let names: Vec<String> = wires
            .filter_map(|wire| Some(wire.from.strip_prefix("outside.")?.to_owned()))
            .collect();
        let expected = match names.is_empty() {
            true => "one at which a wire begins (there is none)".to_owned(),
            false => names.join(", "),
        };
        return Err(Problem::not_found("outside line", expected, name));
    };
    if !wires.set(&name, body.on).await {
        return Err(Problem::shutting_down());
    }
    Ok(Json(list(robots.as_ref())))
}
