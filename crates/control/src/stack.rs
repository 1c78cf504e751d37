//! `/program/stack`, `/program/evaluate`, `/program/assign` and `/program/step-task`: the program as a debugger sees it.
//!
//! What an expression means is `scol_mini`'s, and when an assignment is refused the controller's. Breakpoints are in
//! [`super::breakpoints`].

use super::api_names::StatusName;
use super::body::{optional_whole, whole};
use super::panel::ProgramStatus;
use super::resource::{Answer, Deserialize, Handle, Json, Problem, Serialize, View, call};
use super::variables::VariableInfo;
use axum::http::StatusCode;
use ts3100_controller::action::Action;
use ts3100_controller::inspection::{Assignment, StepKind};
use ts3100_controller::queries::{CallView, TaskStack};
use ts3100_proto::status::ExecutionStatus;

/// The tasks of the selected program with their open calls.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct ProgramStack {
    /// The selected file; empty if none.
    file: String,
    /// Execution status.
    #[serde(with = "StatusName")]
    #[cfg_attr(test, schema(value_type = StatusName))]
    status: ExecutionStatus,
    /// The last stop; absent while the program runs, and after a reset.
    #[serde(skip_serializing_if = "Option::is_none")]
    stopped: Option<ProgramStop>,
    /// The main program and its tasks.
    tasks: Vec<StackTask>,
    /// File lines on which a statement begins, in ascending order: the lines that can have a breakpoint.
    statement_lines: Vec<u32>,
}

/// A stop of the program.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct ProgramStop {
    /// `breakpoint`, `step` at the end of a step or at the line to which the program ran, `alarm`, `stop` after STOP, BREAK
    /// and the like, `end` at the end of the program.
    reason: &'static str,
    /// The task that it concerns, 1 the main program.
    task: u16,
    /// File line of that task; after `alarm`, that of the statement at fault.
    line: u32,
    /// Why the condition of the breakpoint has no value; absent if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    fault: Option<String>,
}

/// A task with its open calls.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct StackTask {
    /// 1 the main program.
    id: u16,
    /// State of the task, as in the state of the robot.
    doing: &'static str,
    /// Its open calls, outermost first, then those of the action of its monitor.
    calls: Vec<StackCall>,
    /// How many of them the action of a monitor interrupts; absent while none acts.
    #[serde(skip_serializing_if = "Option::is_none")]
    interrupted: Option<usize>,
}

/// An open call.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct StackCall {
    /// Name of the program.
    program: String,
    /// File line that it is at.
    line: u32,
    /// Its parameters and local variables.
    locals: Vec<VariableInfo>,
}

/// An expression, and the call that sees its variables.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct EvaluateRequest {
    /// As a program would write it, such as `COUNT + 1`.
    expression: String,
    /// The task.
    #[serde(default = "main_task", deserialize_with = "whole")]
    #[cfg_attr(test, schema(default = 1, minimum = 1, maximum = 65535))]
    task: u16,
    /// Number of the call, 0 the outermost; without one, the innermost.
    #[serde(default, deserialize_with = "optional_whole")]
    call: Option<u32>,
}

/// An assignment, and the call that sees its variables.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct AssignRequest {
    /// As a program would write it: `COUNT = 5`.
    assignment: String,
    /// The task.
    #[serde(default = "main_task", deserialize_with = "whole")]
    #[cfg_attr(test, schema(default = 1, minimum = 1, maximum = 65535))]
    task: u16,
    /// Number of the call, 0 the outermost; without one, the innermost.
    #[serde(default, deserialize_with = "optional_whole")]
    call: Option<u32>,
}

/// A step of one task.
#[derive(Debug, Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct StepTaskRequest {
    /// How far it goes.
    #[serde(with = "StepName")]
    #[cfg_attr(test, schema(value_type = StepName))]
    kind: StepKind,
    /// The task.
    #[serde(default = "main_task", deserialize_with = "whole")]
    #[cfg_attr(test, schema(default = 1, minimum = 1, maximum = 65535))]
    task: u16,
}

/// `into` ends at the next statement of the task, `over` at the next one that is not in a program called from here, `out` after
/// the program has returned, `motion` after the next motion.
#[derive(Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = StepKind))]
#[serde(remote = "StepKind", rename_all = "lowercase")]
enum StepName {
    Into,
    Over,
    Out,
    Motion,
}

fn main_task() -> u16 {
    1
}

impl ProgramStack {
    /// Reads the present state.
    pub fn new(view: &View<'_>) -> ProgramStack {
        let controller = view.controller;
        let tasks = controller.stacks();
        let stopped = controller.stopped().map(|stopped| {
            let task = tasks.iter().find(|task| task.id == stopped.task);
            let line = task.and_then(|task| task.calls.last()).map(|call| call.line);
            ProgramStop {
                reason: stopped.reason.as_str(),
                task: stopped.task,
                line: line.unwrap_or_default(),
                fault: stopped.fault.clone(),
            }
        });
        ProgramStack {
            file: controller.selected().to_owned(),
            status: controller.status(),
            stopped,
            tasks: tasks.into_iter().map(StackTask::new).collect(),
            statement_lines: controller.statement_lines(),
        }
    }
}

impl StackTask {
    fn new(stack: TaskStack) -> StackTask {
        let call = |CallView {
                        program,
                        line,
                        locals,
                    }| StackCall {
            program,
            line,
            locals: locals.into_iter().map(VariableInfo::new).collect(),
        };
        StackTask {
            id: stack.id,
            doing: stack.state,
            calls: stack.calls.into_iter().map(call).collect(),
            interrupted: stack.interrupted,
        }
    }
}

/// The call that is meant.
fn call_of(view: &View<'_>, task: u16, call: Option<u32>) -> Result<usize, Problem> {
    let tasks = view.controller.tasks();
    let found = tasks.iter().find(|found| found.id == task && task > 0);
    let found = found.ok_or_else(|| Problem::not_found("task", "a task of GET /program/stack", task))?;
    let open = found.calls.len();
    let Some(call) = call else {
        return Ok(open.saturating_sub(1));
    };
    let fits = usize::try_from(call).ok().filter(|call| *call < open);
    fits.ok_or_else(|| Problem::not_found("call", format!("0 to {}", open.saturating_sub(1)), call))
}

fn evaluated(view: &View<'_>, task: u16, call: usize, text: &str) -> Result<VariableInfo, Problem> {
    let found = view.controller.evaluate(task, call, text);
    found.map(VariableInfo::new).map_err(|reason| {
        // An expression with a value now may have none in another call.
        let told = format!("cannot evaluate `{text}`: {reason}");
        Problem::new(StatusCode::CONFLICT, told).at("expression")
    })
}

call! {
    /// Get the open calls of the program
    ///
    /// The tasks with their calls and local variables, and the reason for which the program stopped last.
    get_program_stack = get("/program/stack",
        operation_id = "get_program_stack",
        responses((status = 200, body = ProgramStack)))
}
pub async fn get_program_stack(handle: Handle) -> Answer<ProgramStack> {
    handle.query(ProgramStack::new).await.map(Json)
}

call! {
    /// Evaluate an expression
    ///
    /// As the program of an open call would. Nothing changes.
    evaluate = post("/program/evaluate",
        operation_id = "evaluate_expression",
        request_body = EvaluateRequest,
        responses((status = 200, body = VariableInfo)))
}
pub async fn evaluate(handle: Handle, Json(body): Json<EvaluateRequest>) -> Answer<VariableInfo> {
    let EvaluateRequest {
        expression,
        task,
        call,
    } = body;
    let read = move |view: &View<'_>| {
        let call = call_of(view, task, call)?;
        if scol_mini::split_assignment(&expression).is_some() {
            let told = format!("`{expression}` is an assignment; send it to POST /program/assign");
            return Err(Problem::new(StatusCode::CONFLICT, told).at("expression"));
        }
        evaluated(view, task, call, &expression)
    };
    handle.query(read).await?.map(Json)
}

call! {
    /// Give a variable a value that an expression has
    ///
    /// As an assignment of the program of an open call, while the program is stopped; `DIN(5) = 1` drives an input. The response has the value that the variable
    /// has then.
    assign = post("/program/assign",
        operation_id = "assign_variable",
        request_body = AssignRequest,
        responses((status = 200, body = VariableInfo)))
}
pub async fn assign(handle: Handle, Json(body): Json<AssignRequest>) -> Answer<VariableInfo> {
    let AssignRequest {
        assignment,
        task,
        call,
    } = body;
    let call = handle.query(move |view| call_of(view, task, call)).await??;
    let assignment = Assignment {
        task,
        call,
        text: assignment.trim().to_owned(),
    };
    let target = assignment.target();
    let read = move |view: &View<'_>| evaluated(view, task, call, &target);
    handle.act(Action::Assign(assignment), read).await?.map(Json)
}

call! {
    /// Run one step of a task
    ///
    /// The program starts or continues, and stops where the step ends, at a breakpoint, or as after STOP. Other tasks run meanwhile.
    step_task = post("/program/step-task",
        operation_id = "step_task",
        request_body = StepTaskRequest,
        responses((status = 200, body = ProgramStatus)))
}
pub async fn step_task(handle: Handle, Json(body): Json<StepTaskRequest>) -> Answer<ProgramStatus> {
    let StepTaskRequest { kind, task } = body;
    let action = Action::StepTask { kind, task };
    handle.act(action, ProgramStatus::new).await.map(Json)
}
