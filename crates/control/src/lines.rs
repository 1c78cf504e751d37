//! `/inputs` and `/outputs`: the digital lines: read, drive, set, force, release, pulse.
//!
//! Line numbers and forcing are the controller's `signals` module.

use super::body::{JsonBody, NoBody, PathParam, Seconds};
use super::handle::DriverHandle;
use super::problem::Problem;
use super::route_table::RouteTable;
use axum::Json;
use axum::extract::State;
use serde::{Deserialize, Serialize};
use ts3100_controller::action::{Action, IoKind};
use ts3100_controller::input::PanelAction;
use ts3100_controller::signals::Signals;
use ts3100_driver::driver::request::View;
use utoipa::ToSchema;
use utoipa_axum::routes;

/// The lines of one direction.
#[derive(Debug, Clone, Serialize, ToSchema)]
#[schema(as = LinesDoc)]
pub struct LineList {
    /// Numbers of those that are on.
    on: Vec<u16>,
    /// Those that are forced.
    forced: Vec<ForcedLine>,
}

/// A line that is forced.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
pub struct ForcedLine {
    /// Its number.
    line: u16,
    /// The state it shows.
    on: bool,
}

/// One line.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
#[schema(as = LineDoc)]
pub struct LineStatus {
    /// Its number: 1-64, 101-164, 201-264.
    line: u16,
    /// The state it shows.
    on: bool,
    /// It is forced.
    forced: bool,
}

/// The state a line is to have.
#[derive(Debug, Clone, Copy, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = LineState)]
pub struct SetLine {
    /// On or off.
    on: bool,
}

/// A pulse.
#[derive(Debug, Clone, Copy, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = Pulse)]
pub struct PulseRequest {
    /// How long, in seconds of virtual time.
    #[schema(value_type = f64, minimum = 0, maximum = 100_000_000)]
    seconds: Seconds,
    /// The state meanwhile; on if not said. An output pulses to on only.
    #[serde(default = "default_on")]
    #[schema(default = true)]
    on: bool,
}

fn default_on() -> bool {
    true
}

impl LineList {
    /// As they are now.
    pub fn new(view: &View<'_>, side: IoKind) -> LineList {
        let signals = view.controller.signals();
        let forced = Signals::numbers().filter_map(|line| {
            let on = signals.forced(side, line)?;
            Some(ForcedLine { line, on })
        });
        LineList {
            on: Signals::numbers()
                .filter(|line| is_on(signals, side, *line))
                .collect(),
            forced: forced.collect(),
        }
    }
}

fn is_on(signals: &Signals, side: IoKind, line: u16) -> bool {
    match side {
        IoKind::Input => signals.input(line),
        IoKind::Output => signals.output(line),
    }
}

async fn line_status(handle: &DriverHandle, side: IoKind, line: u16) -> Result<Json<LineStatus>, Problem> {
    if !Signals::exists(line) {
        return Err(Problem::not_found(
            "line",
            "1-64, 101-164 or 201-264",
            line.to_string(),
        ));
    }
    let look = move |view: &View<'_>| {
        let signals = view.controller.signals();
        LineStatus {
            line,
            on: is_on(signals, side, line),
            forced: signals.forced(side, line).is_some(),
        }
    };
    Ok(Json(handle.query(look).await?))
}

async fn apply(
    handle: &DriverHandle,
    side: IoKind,
    line: u16,
    action: Action,
) -> Result<Json<LineStatus>, Problem> {
    handle.action(action).await?;
    line_status(handle, side, line).await
}

/// Adds the calls of this file.
pub fn add(table: RouteTable) -> RouteTable {
    table
        .group(
            "lines",
            "Digital inputs and outputs, by the numbers of the manual: 1-64, 101-164, 201-264.",
        )
        .routes(routes!(get_inputs))
        .routes(routes!(get_input))
        .routes(routes!(put_input))
        .routes(routes!(pulse_input))
        .routes(routes!(force_input))
        .routes(routes!(release_input))
        .routes(routes!(get_outputs))
        .routes(routes!(get_output))
        .routes(routes!(put_output))
        .routes(routes!(pulse_output))
        .routes(routes!(force_output))
        .routes(routes!(release_output))
}

/// All inputs
#[utoipa::path(get, path = "/inputs", responses((status = 200, body = LineList)))]
async fn get_inputs(State(handle): State<DriverHandle>) -> Result<Json<LineList>, Problem> {
    Ok(Json(
        handle.query(|view| LineList::new(view, IoKind::Input)).await?,
    ))
}

/// One input
#[utoipa::path(get, path = "/inputs/{line}", params(("line" = u16, Path, description = "Din number",
    minimum = 1, maximum = 264)),
    responses((status = 200, body = LineStatus)))]
async fn get_input(
    State(handle): State<DriverHandle>,
    PathParam(line): PathParam<u16>,
) -> Result<Json<LineStatus>, Problem> {
    line_status(&handle, IoKind::Input, line).await
}

/// Drive an input from outside
///
/// It stays so until it is driven again.
#[utoipa::path(put, path = "/inputs/{line}", params(("line" = u16, Path, description = "Din number",
    minimum = 1, maximum = 264)),
    request_body = SetLine, responses((status = 200, body = LineStatus)))]
async fn put_input(
    State(handle): State<DriverHandle>,
    PathParam(line): PathParam<u16>,
    JsonBody(body): JsonBody<SetLine>,
) -> Result<Json<LineStatus>, Problem> {
    let panel = PanelAction::InputLine { line, on: body.on };
    apply(&handle, IoKind::Input, line, Action::Panel(panel)).await
}

/// Drive an input for a time, then the other way
#[utoipa::path(post, path = "/inputs/{line}/pulse", params(("line" = u16, Path, description = "Din number",
    minimum = 1, maximum = 264)),
    request_body = PulseRequest, responses((status = 200, body = LineStatus)))]
async fn pulse_input(
    State(handle): State<DriverHandle>,
    PathParam(line): PathParam<u16>,
    JsonBody(body): JsonBody<PulseRequest>,
) -> Result<Json<LineStatus>, Problem> {
    pulse(&handle, IoKind::Input, line, body).await
}

async fn pulse(
    handle: &DriverHandle,
    side: IoKind,
    line: u16,
    body: PulseRequest,
) -> Result<Json<LineStatus>, Problem> {
    let pulse = Action::Pulse {
        side,
        line,
        on: body.on,
        length: body.seconds.0,
    };
    apply(handle, side, line, pulse).await
}

/// Force an input: it shows this state whatever drives it, until it is released
#[utoipa::path(put, path = "/inputs/{line}/force", params(("line" = u16, Path, description = "Din number",
    minimum = 1, maximum = 264)),
    request_body = SetLine, responses((status = 200, body = LineStatus)))]
async fn force_input(
    State(handle): State<DriverHandle>,
    PathParam(line): PathParam<u16>,
    JsonBody(body): JsonBody<SetLine>,
) -> Result<Json<LineStatus>, Problem> {
    let (side, on) = (IoKind::Input, body.on);
    apply(&handle, side, line, Action::Force { side, line, on }).await
}

/// Release a forced input
#[utoipa::path(delete, path = "/inputs/{line}/force", params(("line" = u16, Path, description = "Din number",
    minimum = 1, maximum = 264)),
    responses((status = 200, body = LineStatus)))]
async fn release_input(
    State(handle): State<DriverHandle>,
    PathParam(line): PathParam<u16>,
    _: NoBody,
) -> Result<Json<LineStatus>, Problem> {
    let side = IoKind::Input;
    apply(&handle, side, line, Action::Release { side, line }).await
}

/// All outputs
#[utoipa::path(get, path = "/outputs", responses((status = 200, body = LineList)))]
async fn get_outputs(State(handle): State<DriverHandle>) -> Result<Json<LineList>, Problem> {
    Ok(Json(
        handle.query(|view| LineList::new(view, IoKind::Output)).await?,
    ))
}

/// One output
#[utoipa::path(get, path = "/outputs/{line}", params(("line" = u16, Path, description = "Dout number",
    minimum = 1, maximum = 264)),
    responses((status = 200, body = LineStatus)))]
async fn get_output(
    State(handle): State<DriverHandle>,
    PathParam(line): PathParam<u16>,
) -> Result<Json<LineStatus>, Problem> {
    line_status(&handle, IoKind::Output, line).await
}

/// Set a user output, as the command IW does: 1-64, 101-164, 201-208
#[utoipa::path(put, path = "/outputs/{line}", params(("line" = u16, Path, description = "Dout number",
    minimum = 1, maximum = 264)),
    request_body = SetLine, responses((status = 200, body = LineStatus)))]
async fn put_output(
    State(handle): State<DriverHandle>,
    PathParam(line): PathParam<u16>,
    JsonBody(body): JsonBody<SetLine>,
) -> Result<Json<LineStatus>, Problem> {
    let set = Action::SetOutput { line, on: body.on };
    apply(&handle, IoKind::Output, line, set).await
}

/// Switch a user output on for a time
#[utoipa::path(post, path = "/outputs/{line}/pulse", params(("line" = u16, Path, description = "Dout number",
    minimum = 1, maximum = 264)),
    request_body = PulseRequest, responses((status = 200, body = LineStatus)))]
async fn pulse_output(
    State(handle): State<DriverHandle>,
    PathParam(line): PathParam<u16>,
    JsonBody(body): JsonBody<PulseRequest>,
) -> Result<Json<LineStatus>, Problem> {
    pulse(&handle, IoKind::Output, line, body).await
}

/// Force an output: it shows this state whatever the program does, until it is released or the power goes off
#[utoipa::path(put, path = "/outputs/{line}/force", params(("line" = u16, Path, description = "Dout number",
    minimum = 1, maximum = 264)),
    request_body = SetLine, responses((status = 200, body = LineStatus)))]
async fn force_output(
    State(handle): State<DriverHandle>,
    PathParam(line): PathParam<u16>,
    JsonBody(body): JsonBody<SetLine>,
) -> Result<Json<LineStatus>, Problem> {
    let (side, on) = (IoKind::Output, body.on);
    apply(&handle, side, line, Action::Force { side, line, on }).await
}

/// Release a forced output
#[utoipa::path(delete, path = "/outputs/{line}/force", params(("line" = u16, Path, description = "Dout number",
    minimum = 1, maximum = 264)),
    responses((status = 200, body = LineStatus)))]
async fn release_output(
    State(handle): State<DriverHandle>,
    PathParam(line): PathParam<u16>,
    _: NoBody,
) -> Result<Json<LineStatus>, Problem> {
    let side = IoKind::Output;
    apply(&handle, side, line, Action::Release { side, line }).await
}
