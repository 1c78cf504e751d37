//! `/pendant`: the display of the teach pendant, and keys typed on it.
//!
//! The pages are made by the controller.

use super::resource::{Answer, Deserialize, Handle, Json, Problem, Serialize, View, call};
use super::state::{PendantPage, ether_pages};
use ts3100_controller::PanelAction;

/// Most characters typed at once: the buffer holds 256 bytes.
const MAX_KEYS: usize = 256;

/// The teach pendant.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Pendant))]
pub struct PendantStatus {
    /// Output of PRINT without a channel.
    text: String,
    /// The three pages [ETHER].
    ether_pages: Vec<PendantPage>,
}

/// Keys to type.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Keys))]
#[serde(deny_unknown_fields)]
pub struct KeysRequest {
    /// Characters for INPUT without a channel; a comma or a carriage return (`\r`) ends a value.
    #[cfg_attr(
        test,
        schema(min_length = 1, max_length = 256, pattern = "^[ -~\r]+$", example = "12\r")
    )]
    keys: String,
}

impl PendantStatus {
    pub fn new(view: &View<'_>) -> PendantStatus {
        PendantStatus {
            text: view.controller.pendant().to_owned(),
            ether_pages: ether_pages(view),
        }
    }
}

call! {
    /// Type keys on the teach pendant
    ///
    /// The statement INPUT without a channel reads them.
    press_keys = post("/pendant/keys", request_body = KeysRequest, responses((status = 200, body = PendantStatus)))
}
pub async fn press_keys(handle: Handle, Json(body): Json<KeysRequest>) -> Answer<PendantStatus> {
    let keys = body.keys;
    let typed = |letter: char| letter == '\r' || letter == ' ' || letter.is_ascii_graphic();
    if keys.is_empty() || keys.len() > MAX_KEYS || !keys.chars().all(typed) {
        let expected = format!("1 to {MAX_KEYS} characters of ASCII or \\r");
        return Err(Problem::invalid("keys", expected, format!("{keys:?}")));
    }
    handle.press(PanelAction::Keys(keys), PendantStatus::new).await
}
