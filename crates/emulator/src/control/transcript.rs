//! `/transcript`: what went over the ports and what was done at the controller, as `--transcript` writes it to files.

use super::body::InQuery;
use super::handle::Handle;
use super::problem::Problem;
use super::table::Table;
use crate::transcript::Format;
use axum::extract::State;
use axum::http::header::CONTENT_TYPE;
use axum::response::IntoResponse;
use serde::Deserialize;
use utoipa::{IntoParams, ToSchema};

/// The form of a transcript.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum FormatWord {
    #[default]
    Text,
    Jsonl,
    Pcapng,
}

/// How it is wanted.
#[derive(Debug, Clone, Copy, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct Wanted {
    /// `text` as people read it and `ts3100 diff` plays it, `jsonl` for programs, `pcapng` for Wireshark.
    #[serde(default)]
    #[param(inline, default = "text")]
    format: FormatWord,
}

impl FormatWord {
    fn format(self) -> (Format, &'static str) {
        match self {
            FormatWord::Text => (Format::Text, "text/plain; charset=utf-8"),
            FormatWord::Jsonl => (Format::Json, "application/x-ndjson"),
            FormatWord::Pcapng => (Format::Pcapng, "application/octet-stream"),
        }
    }
}

/// Adds the calls of this file.
pub fn add(table: Table) -> Table {
    table
        .group(
            "transcript",
            "What went over the ports and what was done at the controller.",
        )
        .call::<__path_get_transcript, _, _>(get_transcript)
}

/// The transcript since the start or the last reset, the last 16384 records of it
///
/// What `--transcript FILE` writes to a file: docs/EVIDENCE.md. What is no longer kept is a remark at the beginning.
#[utoipa::path(get, path = "/transcript", params(Wanted), responses((status = 200, content(
    (String = "text/plain"), (String = "application/x-ndjson"), (Vec<u8> = "application/octet-stream")))))]
async fn get_transcript(
    State(hub): State<Handle>,
    InQuery(wanted): InQuery<Wanted>,
) -> Result<impl IntoResponse, Problem> {
    // A look, so that what came before has been served.
    hub.look(|_| ()).await?;
    let (format, media_type) = wanted.format.format();
    Ok(([(CONTENT_TYPE, media_type)], hub.journal.transcript(format)))
}
