//! `/pendant`: what the teach pendant shows, and figures typed at it.

use super::body::Body;
use super::handle::Handle;
use super::problem::Problem;
use super::state::{Page, ether_pages};
use super::table::Table;
use crate::driver::request::View;
use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use serde::{Deserialize, Serialize};
use ts3100_controller::action::Action;
use ts3100_controller::input::PanelAction;
use utoipa::ToSchema;

/// Most characters typed at once: the buffer holds 256 bytes.
const MAX_KEYS: usize = 256;

/// The teach pendant.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct PendantDoc {
    /// What PRINT has shown.
    text: String,
    /// The three pages [ETHER].
    ether_pages: Vec<Page>,
}

/// Keys to be pressed.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Keys {
    /// What is typed for INPUT without a channel; a comma or a carriage return (`\r`) ends a value.
    #[schema(min_length = 1, max_length = 256, pattern = "^[ -~\r]+$", example = "12\r")]
    keys: String,
}

/// Adds the calls of this file.
pub fn add(table: Table) -> Table {
    table
        .group("pendant", "What the teach pendant shows, and its keys.")
        .call::<__path_get_pendant, _, _>(get_pendant)
        .call::<__path_press_keys, _, _>(press_keys)
}

/// What the teach pendant shows
#[utoipa::path(get, path = "/pendant", responses((status = 200, body = PendantDoc)))]
async fn get_pendant(State(hub): State<Handle>) -> Result<Json<PendantDoc>, Problem> {
    let look = |sight: &View<'_>| PendantDoc {
        text: sight.controller.pendant().to_owned(),
        ether_pages: ether_pages(sight),
    };
    Ok(Json(hub.look(look).await?))
}

/// Type at the teach pendant, for INPUT without a channel
#[utoipa::path(post, path = "/pendant/keys", request_body = Keys, responses((status = 200, body = PendantDoc)))]
async fn press_keys(state: State<Handle>, Body(body): Body<Keys>) -> Result<Json<PendantDoc>, Problem> {
    let keys = body.keys;
    let typed = |letter: char| letter == '\r' || letter == ' ' || letter.is_ascii_graphic();
    if keys.is_empty() || keys.len() > MAX_KEYS || !keys.chars().all(typed) {
        let expected = format!("1 to {MAX_KEYS} characters of ASCII or \\r");
        return Err(Problem::at(
            StatusCode::UNPROCESSABLE_ENTITY,
            "keys",
            expected,
            format!("{keys:?}"),
        ));
    }
    state.action(Action::Panel(PanelAction::Keys(keys))).await?;
    get_pendant(state).await
}
