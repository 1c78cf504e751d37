//! `/check`: the errors and warnings of `ts3100 check` for a program, for an editor in a page.
//!
//! The compiler and the lints are [`scol_mini`]'s; the arm, the options and the taught points are those of the robot, whose
//! `Config::check` it is. Nothing is stored.

use super::files::missing;
use super::resource::{Answer, Deserialize, Handle, Json, Problem, Serialize, View, call};
use scol_mini::{Diagnostic, DiagnosticKind};
use tokio::task::spawn_blocking;
use ts3100_book::explain_path;

/// The program to check.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Check))]
#[serde(rename_all = "lowercase", try_from = "CheckFields")]
pub enum CheckRequest {
    /// This text; the language accepts at most 99,999 bytes.
    Text(String),
    /// The file of this name on the RAM drive.
    File(String),
}

/// The fields of the request as received. An enum of serde does not say which field is missing.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CheckFields {
    text: Option<String>,
    file: Option<String>,
}

/// The program to check is named twice or not at all.
#[derive(Debug, thiserror::Error)]
#[error("expected either `text` or `file`, found {0}")]
struct OneProgram(&'static str);

impl TryFrom<CheckFields> for CheckRequest {
    type Error = OneProgram;

    fn try_from(fields: CheckFields) -> Result<CheckRequest, OneProgram> {
        match (fields.text, fields.file) {
            (Some(text), None) => Ok(CheckRequest::Text(text)),
            (None, Some(file)) => Ok(CheckRequest::File(file)),
            (Some(_), Some(_)) => Err(OneProgram("both")),
            (None, None) => Err(OneProgram("neither")),
        }
    }
}

/// An error or a warning about a program.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Diagnostic))]
pub struct ProgramDiagnostic {
    /// Line, from 1.
    line: u32,
    /// First column, from 1, in characters.
    column: usize,
    /// Length of the marked place in characters, up to the end of the line.
    length: usize,
    /// `error` or `warning`.
    severity: &'static str,
    /// Stable code, `E` or `W` and four digits.
    code: &'static str,
    /// Message: what was expected and what was found.
    message: String,
    /// Remedy.
    #[serde(skip_serializing_if = "Option::is_none")]
    help: Option<String>,
    /// Path of the page that explains the code.
    #[serde(skip_serializing_if = "Option::is_none")]
    docs: Option<String>,
}

/// The text of the program that a call asks for.
fn source(body: CheckRequest, view: &View<'_>) -> Result<String, Problem> {
    match body {
        CheckRequest::Text(text) => Ok(text),
        CheckRequest::File(name) => {
            let content = view.controller.drive().get(&name.to_ascii_uppercase());
            // Bytes that are no UTF-8 become a character that the compiler points at.
            let content = content.ok_or_else(|| missing("file", view, &name))?;
            Ok(String::from_utf8_lossy(content).into_owned())
        }
    }
}

impl ProgramDiagnostic {
    fn new(diagnostic: Diagnostic, source: &str) -> ProgramDiagnostic {
        let columns = diagnostic.columns(source);
        ProgramDiagnostic {
            line: diagnostic.line,
            column: columns.start,
            length: columns.len(),
            severity: diagnostic.severity.as_str(),
            code: diagnostic.code,
            docs: DiagnosticKind::by_code(diagnostic.code).map(|kind| explain_path(kind.code)),
            message: diagnostic.message,
            help: diagnostic.help,
        }
    }
}

call! {
    /// Check a program without storing it
    ///
    /// For the arm, the options and the taught points of this robot; otherwise as `ts3100 check` does.
    check = post("/check",
        operation_id = "check_program",
        request_body = CheckRequest,
        responses((status = 200, description = "Errors and warnings in the order of the source, at most 100; empty when there are none.",
            body = Vec<ProgramDiagnostic>)))
}
pub async fn check(handle: Handle, Json(body): Json<CheckRequest>) -> Answer<Vec<ProgramDiagnostic>> {
    let look = move |view: &View<'_>| {
        let config = view.controller.config().clone();
        source(body, view).map(|text| (text, config))
    };
    let (text, config) = handle.query(look).await??;
    // The largest program takes about 30 ms, in which the hosts are not to wait.
    let found = spawn_blocking(move || {
        let found = config.check(&text).diagnostics;
        let found = found.into_iter();
        found
            .map(|diagnostic| ProgramDiagnostic::new(diagnostic, &text))
            .collect()
    });
    found.await.map(Json).map_err(|_| Problem::shutting_down())
}
