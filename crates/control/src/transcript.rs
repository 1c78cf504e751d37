//! `/transcript`: the traffic of all ports and the actions at the controller, in the formats of `--transcript`.
//!
//! Recording and formats are in [`ts3100_recording::transcript`].

use super::body::Query;
use super::resource::{Deserialize, Handle, Problem, call};
use axum::http::header::CONTENT_TYPE;
use axum::response::IntoResponse;
use ts3100_recording::transcript::Format;

/// The form of a transcript.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FormatName {
    #[default]
    Text,
    Jsonl,
    Pcapng,
}

/// The format of the transcript.
#[derive(Debug, Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(utoipa::IntoParams), into_params(parameter_in = Query))]
#[serde(deny_unknown_fields)]
pub struct TranscriptQuery {
    /// `text` for people and for `ts3100 diff`, `jsonl` for programs, `pcapng` for Wireshark.
    #[serde(default)]
    #[cfg_attr(test, param(schema_with = format_schema, required = false))]
    format: FormatName,
}

#[cfg(test)]
fn format_schema() -> utoipa::openapi::schema::Object {
    use utoipa::openapi::schema::{ObjectBuilder, Type};

    ObjectBuilder::new()
        .schema_type(Type::String)
        .enum_values(Some(["text", "jsonl", "pcapng"]))
        .default(Some("text".into()))
        .build()
}

impl FormatName {
    fn format(self) -> (Format, &'static str) {
        match self {
            FormatName::Text => (Format::Text, "text/plain; charset=utf-8"),
            FormatName::Jsonl => (Format::Json, "application/x-ndjson"),
            FormatName::Pcapng => (Format::Pcapng, "application/octet-stream"),
        }
    }
}

call! {
    /// Get the transcript
    ///
    /// Everything since the start or the last reset, at most the last 16,384 records. If older ones are missing, a remark at
    /// the beginning tells how many, and the controller as it was then follows it. `--transcript FILE` writes the same to a file.
    get_transcript = get("/transcript",
        params(TranscriptQuery),
        responses((status = 200, description = "The transcript in the format asked for.", content(
            (String = "text/plain"), (String = "application/x-ndjson"), (Vec<u8> = "application/octet-stream")))))
}
pub async fn get_transcript(
    handle: Handle,
    Query(query): Query<TranscriptQuery>,
) -> Result<impl IntoResponse, Problem> {
    // A look, so that what came before has been served.
    let now = handle.query(|view| view.controller.now()).await?;
    let (format, media_type) = query.format.format();
    Ok((
        [(CONTENT_TYPE, media_type)],
        handle.journal.transcript(format, now),
    ))
}
