//! The OpenAPI document that the binary carries is that of its calls.

mod document;

use super::{calls, open_api_text};
use document::document;

fn written(needs_token: bool) -> String {
    let document = document(calls(), needs_token);
    serde_json::to_string_pretty(&serde_json::to_value(document).unwrap()).unwrap() + "\n"
}

#[test]
fn the_binary_carries_the_document_of_its_calls() {
    for needs_token in [false, true] {
        let stale = "assets/openapi.json is stale; write it with -- --ignored bless_openapi";
        assert!(
            open_api_text(needs_token, None) == written(needs_token),
            "{stale}"
        );
    }
}

#[test]
#[ignore = "writes assets/openapi.json"]
fn bless_openapi() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/openapi.json");
    std::fs::write(path, written(false)).unwrap();
}
