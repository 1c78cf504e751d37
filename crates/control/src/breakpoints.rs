//! `/breakpoints`, `/program/step` and `/program/run-to`: stop the selected program at chosen lines.

use super::body::whole;
use super::panel::ProgramStatus;
use super::resource::{Answer, Deserialize, Handle, Json, Problem, Serialize, View, call};
use ts3100_controller::action::Action;

/// The breakpoints of the selected file.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct Breakpoints {
    /// Lines of the file, each 1 or more; the program stops before each.
    #[cfg_attr(test, schema(inline))]
    lines: Vec<FileLine>,
}

/// A line of a file.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(minimum = 1))]
#[serde(transparent)]
struct FileLine(#[serde(deserialize_with = "whole")] u32);

/// A line of the selected file.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct RunToRequest {
    /// From 1.
    #[serde(deserialize_with = "whole")]
    #[cfg_attr(test, schema(minimum = 1))]
    line: u32,
}

impl Breakpoints {
    /// As they are now.
    pub fn new(view: &View<'_>) -> Breakpoints {
        Breakpoints {
            lines: view.controller.breakpoints().map(FileLine).collect(),
        }
    }
}

call! {
    /// Set the breakpoints of the selected file
    ///
    /// The program stops before each of these lines, as after STOP. A line without a statement is replaced by the next line
    /// with one; the response has the lines that were set. POST /program/start continues. Selecting another file removes
    /// them. The robot has no such function; an emulator has.
    put_breakpoints = put("/breakpoints", request_body = Breakpoints, responses((status = 200, body = Breakpoints)))
}
pub async fn put_breakpoints(handle: Handle, Json(body): Json<Breakpoints>) -> Answer<Breakpoints> {
    let lines = body.lines.into_iter().map(|FileLine(line)| line);
    if lines.clone().any(|line| line == 0) {
        return Err(Problem::invalid("lines", "1 or more", 0));
    }
    let set = handle.act(Action::Breakpoints(lines.collect()), Breakpoints::new);
    set.await.map(Json)
}

call! {
    /// Run the program to a line
    ///
    /// It starts or continues and stops before the line, or before the next one with a statement.
    run_to = post("/program/run-to",
        operation_id = "run_program_to",
        request_body = RunToRequest,
        responses((status = 200, body = ProgramStatus)))
}
pub async fn run_to(handle: Handle, Json(body): Json<RunToRequest>) -> Answer<ProgramStatus> {
    if body.line == 0 {
        return Err(Problem::invalid("line", "1 or more", body.line));
    }
    let action = Action::RunTo(body.line);
    handle.act(action, ProgramStatus::new).await.map(Json)
}
