//! `/decode`: a text of the protocol split into its fields, for people who read traffic.
//!
//! The fields are [`ts3100_proto::dissect`]'s and [`ts3100_proto::dissect_command`]'s. No robot is asked: a text of a
//! recording can be decoded too.

use super::body::parse_hex;
use super::resource::{Answer, Deserialize, Json, Problem, Serialize, call};
use ts3100_proto::dissect::{DissectedField, dissect};
use ts3100_proto::dissect_command::dissect_command;
use ts3100_proto::text::STX;

/// Most bytes of a text: a file that a peer sends as one text fits several times.
const MAX_TEXT: usize = 4_096;

/// Sender of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = TextSender))]
#[serde(rename_all = "lowercase")]
enum Sender {
    /// The host.
    Host,
    /// The controller.
    Controller,
}

/// A text to decode.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Decode))]
#[serde(deny_unknown_fields)]
pub struct DecodeRequest {
    /// Sender of the text.
    direction: Sender,
    /// The command to which the text belongs, as events name it; its first two letters count. A text of the controller
    /// answers it; without it, a file is split into lines. With `DL`, a text of a host that does not begin with `DL,`
    /// is part of the file.
    #[serde(default)]
    command: Option<String>,
    /// The text as it was on the wire, framing included, as hexadecimal digits, two a byte, blanks between them allowed;
    /// at most 4096 bytes.
    #[cfg_attr(test, schema(pattern = "^ *([0-9a-fA-F] *[0-9a-fA-F] *)*$"))]
    hex: String,
}

/// A text split into fields.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = DecodedText))]
pub struct DecodedText {
    /// Fields in the order of their bytes. An error is a field too, with the key `error`.
    fields: Vec<TextField>,
}

/// A field of a text.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct TextField {
    /// Stable name, with dots, beginning with the command: `sf.servo`, `iw.line.1`; for the framing with `text`.
    key: String,
    /// Name for display.
    name: String,
    /// Value in words, or the bytes in backquotes.
    value: String,
    /// First byte in the text, from 0.
    start: usize,
    /// Byte after the last one; equal to `start` for a missing field.
    end: usize,
}

impl From<DissectedField> for TextField {
    fn from(field: DissectedField) -> TextField {
        TextField {
            key: field.key,
            name: field.name,
            value: field.value,
            start: field.range.start,
            end: field.range.end,
        }
    }
}

impl DecodeRequest {
    fn decode(&self) -> Result<DecodedText, Problem> {
        let wire = parse_hex(&self.hex)?;
        if wire.len() > MAX_TEXT {
            let expected = format!("at most {MAX_TEXT} bytes");
            return Err(Problem::invalid("hex", expected, wire.len()));
        }
        let command = self.command.as_deref().unwrap_or_default();
        let letters = command.get(..2).unwrap_or_default().to_ascii_uppercase();
        let fields = match self.direction {
            Sender::Host => dissect_command(&wire, letters == "DL" && !opens_download(&wire)),
            Sender::Controller => dissect(&letters, &wire),
        };
        let fields = fields.into_iter().map(TextField::from).collect();
        Ok(DecodedText { fields })
    }
}

/// Whether it is the text that opens a download.
fn opens_download(wire: &[u8]) -> bool {
    let data = wire.strip_prefix(&[STX]).unwrap_or(wire);
    data.get(..3)
        .is_some_and(|begin| begin.eq_ignore_ascii_case(b"DL,"))
}

call! {
    /// Split a text into its fields
    ///
    /// A text of a host: framing, command, each operand with its name, and errors. A text of the controller: the fields of
    /// SF, the items of SU, the records of a list, the lines of a file.
    decode = post("/decode",
        operation_id = "decode_text",
        request_body = DecodeRequest,
        responses((status = 200, body = DecodedText)))
}
pub async fn decode(Json(body): Json<DecodeRequest>) -> Answer<DecodedText> {
    body.decode().map(Json)
}
