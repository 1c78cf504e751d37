//! `/breakpoints`, `/program/step` and `/program/run-to`: stop the selected program at chosen lines.
//!
//! The rules of a breakpoint are the controller's `inspection`; steps of one task are in [`super::stack`].

use super::body::whole;
use super::panel::ProgramStatus;
use super::resource::{Answer, Deserialize, Handle, Json, Problem, Serialize, View, call};
use ts3100_controller::action::Action;
use ts3100_controller::inspection::{Breakpoint, HitRule};

/// The breakpoints of the selected file.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct Breakpoints {
    /// Lines of the file, each 1 or more; the program stops before each.
    #[cfg_attr(test, schema(inline))]
    lines: Vec<FileLine>,
    /// Rules of breakpoints that do not stop at every hit; absent if there are none. A line of a rule need not be among the lines.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    rules: Vec<BreakpointRule>,
}

/// When a breakpoint counts, and what it says.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct BreakpointRule {
    /// Its line, from 1.
    #[serde(deserialize_with = "whole")]
    #[cfg_attr(test, schema(minimum = 1))]
    line: u32,
    /// An expression that has to be true, such as `COUNT > 3`. The program also stops if it has no value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    condition: Option<String>,
    /// Which of the hits count: `3` the third, `>=3` the third and all after it, `%3` each third.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schema(pattern = "^(>=|>|%)?[1-9][0-9]{0,8}$"))]
    hits: Option<String>,
    /// An event with this text is sent and the program does not stop. An expression in braces becomes its value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    message: Option<String>,
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
        let set = view.controller.breakpoints().iter();
        Breakpoints {
            lines: view.controller.breakpoint_lines().map(FileLine).collect(),
            rules: set
                .filter(|set| !set.is_plain())
                .map(BreakpointRule::new)
                .collect(),
        }
    }

    /// The same in the terms of the controller.
    fn read(self) -> Result<Vec<Breakpoint>, Problem> {
        let has_rule = |line: u32| self.rules.iter().any(|rule| rule.line == line);
        let lines = self.lines.iter().map(|FileLine(line)| *line);
        let plain = lines.filter(|line| !has_rule(*line)).map(Breakpoint::at);
        let mut set: Vec<Breakpoint> = plain.collect();
        for rule in self.rules {
            set.push(rule.read()?);
        }
        Ok(set)
    }
}

impl BreakpointRule {
    fn new(set: &Breakpoint) -> BreakpointRule {
        BreakpointRule {
            line: set.line,
            condition: set.condition.clone(),
            hits: set.hits.map(|rule| rule.to_string()),
            message: set.message.clone(),
        }
    }

    fn read(self) -> Result<Breakpoint, Problem> {
        let given = |text: Option<String>| text.filter(|text| !text.trim().is_empty());
        let hits = given(self.hits).map(|text| {
            let rule = text.parse::<HitRule>();
            rule.map_err(|error| Problem::invalid("hits", "3, >=3 or %3", text).told(error))
        });
        Ok(Breakpoint {
            line: self.line,
            condition: given(self.condition),
            hits: hits.transpose()?,
            message: given(self.message),
            hit: 0,
        })
    }
}

call! {
    /// Set the breakpoints of the selected file
    ///
    /// The program stops before each of these lines, as after STOP. A line without a statement is replaced by the next line
    /// with one; the response has the lines that were set. A rule gives a line a condition, a count of hits, or a message.
    /// One with an expression that does not compile in its line is refused, and nothing changes.
    /// POST /program/start continues. Selecting another file removes them. The robot has no such function; an emulator has.
    put_breakpoints = put("/breakpoints", request_body = Breakpoints, responses((status = 200, body = Breakpoints)))
}
pub async fn put_breakpoints(handle: Handle, Json(body): Json<Breakpoints>) -> Answer<Breakpoints> {
    let set = body.read()?;
    if set.iter().any(|set| set.line == 0) {
        return Err(Problem::invalid("lines", "1 or more", 0));
    }
    let set = handle.act(Action::Breakpoints(set), Breakpoints::new);
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
