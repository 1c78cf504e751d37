//! `/inputs` and `/outputs`: the digital lines: read, drive, set, force, release, pulse.

use super::body::{Body, InPath, NoBody, Seconds};
use super::handle::Handle;
use super::problem::Problem;
use super::table::Table;
use crate::driver::request::View;
use axum::Json;
use axum::extract::State;
use serde::{Deserialize, Serialize};
use ts3100_controller::action::{Action, IoKind};
use ts3100_controller::input::PanelAction;
use ts3100_controller::signals::Signals;
use utoipa::ToSchema;

/// The lines of one direction.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct LinesDoc {
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
pub struct LineDoc {
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
pub struct LineState {
    /// On or off.
    on: bool,
}

/// A pulse.
#[derive(Debug, Clone, Copy, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Pulse {
    /// How long, in seconds of virtual time.
    #[schema(value_type = f64, minimum = 0, maximum = 100_000_000)]
    seconds: Seconds,
    /// The state meanwhile; on if not said. An output pulses to on only.
    #[serde(default = "on")]
    #[schema(default = true)]
    on: bool,
}

fn on() -> bool {
    true
}

impl LinesDoc {
    /// As they are now.
    pub fn of(sight: &View<'_>, side: IoKind) -> LinesDoc {
        let signals = sight.controller.signals();
        let forced = Signals::numbers().filter_map(|line| {
            let on = signals.forced(side, line)?;
            Some(ForcedLine { line, on })
        });
        LinesDoc {
            on: Signals::numbers()
                .filter(|line| shows(signals, side, *line))
                .collect(),
            forced: forced.collect(),
        }
    }
}

fn shows(signals: &Signals, side: IoKind, line: u16) -> bool {
    match side {
        IoKind::Input => signals.input(line),
        IoKind::Output => signals.output(line),
    }
}

async fn line_of(hub: &Handle, side: IoKind, line: u16) -> Result<Json<LineDoc>, Problem> {
    if !Signals::exists(line) {
        return Err(Problem::missing(
            "line",
            "1-64, 101-164 or 201-264",
            line.to_string(),
        ));
    }
    let look = move |sight: &View<'_>| {
        let signals = sight.controller.signals();
        LineDoc {
            line,
            on: shows(signals, side, line),
            forced: signals.forced(side, line).is_some(),
        }
    };
    Ok(Json(hub.look(look).await?))
}

async fn action(hub: &Handle, side: IoKind, line: u16, action: Action) -> Result<Json<LineDoc>, Problem> {
    hub.action(action).await?;
    line_of(hub, side, line).await
}

/// Adds the calls of this file.
pub fn add(table: Table) -> Table {
    table
        .group(
            "lines",
            "Digital inputs and outputs, by the numbers of the manual: 1-64, 101-164, 201-264.",
        )
        .call::<__path_get_inputs, _, _>(get_inputs)
        .call::<__path_get_input, _, _>(get_input)
        .call::<__path_put_input, _, _>(put_input)
        .call::<__path_pulse_input, _, _>(pulse_input)
        .call::<__path_force_input, _, _>(force_input)
        .call::<__path_release_input, _, _>(release_input)
        .call::<__path_get_outputs, _, _>(get_outputs)
        .call::<__path_get_output, _, _>(get_output)
        .call::<__path_put_output, _, _>(put_output)
        .call::<__path_pulse_output, _, _>(pulse_output)
        .call::<__path_force_output, _, _>(force_output)
        .call::<__path_release_output, _, _>(release_output)
}

/// All inputs
#[utoipa::path(get, path = "/inputs", responses((status = 200, body = LinesDoc)))]
async fn get_inputs(State(hub): State<Handle>) -> Result<Json<LinesDoc>, Problem> {
    Ok(Json(hub.look(|sight| LinesDoc::of(sight, IoKind::Input)).await?))
}

/// One input
#[utoipa::path(get, path = "/inputs/{line}", params(("line" = u16, Path, description = "Din number",
    minimum = 1, maximum = 264)),
    responses((status = 200, body = LineDoc)))]
async fn get_input(State(hub): State<Handle>, InPath(line): InPath<u16>) -> Result<Json<LineDoc>, Problem> {
    line_of(&hub, IoKind::Input, line).await
}

/// Drive an input from outside
///
/// It stays so until it is driven again.
#[utoipa::path(put, path = "/inputs/{line}", params(("line" = u16, Path, description = "Din number",
    minimum = 1, maximum = 264)),
    request_body = LineState, responses((status = 200, body = LineDoc)))]
async fn put_input(
    State(hub): State<Handle>,
    InPath(line): InPath<u16>,
    Body(body): Body<LineState>,
) -> Result<Json<LineDoc>, Problem> {
    let panel = PanelAction::InputLine { line, on: body.on };
    action(&hub, IoKind::Input, line, Action::Panel(panel)).await
}

/// Drive an input for a time, then the other way
#[utoipa::path(post, path = "/inputs/{line}/pulse", params(("line" = u16, Path, description = "Din number",
    minimum = 1, maximum = 264)),
    request_body = Pulse, responses((status = 200, body = LineDoc)))]
async fn pulse_input(
    State(hub): State<Handle>,
    InPath(line): InPath<u16>,
    Body(body): Body<Pulse>,
) -> Result<Json<LineDoc>, Problem> {
    pulse(&hub, IoKind::Input, line, body).await
}

async fn pulse(hub: &Handle, side: IoKind, line: u16, body: Pulse) -> Result<Json<LineDoc>, Problem> {
    let pulse = Action::Pulse {
        side,
        line,
        on: body.on,
        length: body.seconds.0,
    };
    action(hub, side, line, pulse).await
}

/// Force an input: it shows this state whatever drives it, until it is released
#[utoipa::path(put, path = "/inputs/{line}/force", params(("line" = u16, Path, description = "Din number",
    minimum = 1, maximum = 264)),
    request_body = LineState, responses((status = 200, body = LineDoc)))]
async fn force_input(
    State(hub): State<Handle>,
    InPath(line): InPath<u16>,
    Body(body): Body<LineState>,
) -> Result<Json<LineDoc>, Problem> {
    let (side, on) = (IoKind::Input, body.on);
    action(&hub, side, line, Action::Force { side, line, on }).await
}

/// Release a forced input
#[utoipa::path(delete, path = "/inputs/{line}/force", params(("line" = u16, Path, description = "Din number",
    minimum = 1, maximum = 264)),
    responses((status = 200, body = LineDoc)))]
async fn release_input(
    State(hub): State<Handle>,
    InPath(line): InPath<u16>,
    _: NoBody,
) -> Result<Json<LineDoc>, Problem> {
    let side = IoKind::Input;
    action(&hub, side, line, Action::Release { side, line }).await
}

/// All outputs
#[utoipa::path(get, path = "/outputs", responses((status = 200, body = LinesDoc)))]
async fn get_outputs(State(hub): State<Handle>) -> Result<Json<LinesDoc>, Problem> {
    Ok(Json(hub.look(|sight| LinesDoc::of(sight, IoKind::Output)).await?))
}

/// One output
#[utoipa::path(get, path = "/outputs/{line}", params(("line" = u16, Path, description = "Dout number",
    minimum = 1, maximum = 264)),
    responses((status = 200, body = LineDoc)))]
async fn get_output(State(hub): State<Handle>, InPath(line): InPath<u16>) -> Result<Json<LineDoc>, Problem> {
    line_of(&hub, IoKind::Output, line).await
}

/// Set a user output, as the command IW does: 1-64, 101-164, 201-208
#[utoipa::path(put, path = "/outputs/{line}", params(("line" = u16, Path, description = "Dout number",
    minimum = 1, maximum = 264)),
    request_body = LineState, responses((status = 200, body = LineDoc)))]
async fn put_output(
    State(hub): State<Handle>,
    InPath(line): InPath<u16>,
    Body(body): Body<LineState>,
) -> Result<Json<LineDoc>, Problem> {
    let set = Action::SetOutput { line, on: body.on };
    action(&hub, IoKind::Output, line, set).await
}

/// Switch a user output on for a time
#[utoipa::path(post, path = "/outputs/{line}/pulse", params(("line" = u16, Path, description = "Dout number",
    minimum = 1, maximum = 264)),
    request_body = Pulse, responses((status = 200, body = LineDoc)))]
async fn pulse_output(
    State(hub): State<Handle>,
    InPath(line): InPath<u16>,
    Body(body): Body<Pulse>,
) -> Result<Json<LineDoc>, Problem> {
    pulse(&hub, IoKind::Output, line, body).await
}

/// Force an output: it shows this state whatever the program does, until it is released or the power goes off
#[utoipa::path(put, path = "/outputs/{line}/force", params(("line" = u16, Path, description = "Dout number",
    minimum = 1, maximum = 264)),
    request_body = LineState, responses((status = 200, body = LineDoc)))]
async fn force_output(
    State(hub): State<Handle>,
    InPath(line): InPath<u16>,
    Body(body): Body<LineState>,
) -> Result<Json<LineDoc>, Problem> {
    let (side, on) = (IoKind::Output, body.on);
    action(&hub, side, line, Action::Force { side, line, on }).await
}

/// Release a forced output
#[utoipa::path(delete, path = "/outputs/{line}/force", params(("line" = u16, Path, description = "Dout number",
    minimum = 1, maximum = 264)),
    responses((status = 200, body = LineDoc)))]
async fn release_output(
    State(hub): State<Handle>,
    InPath(line): InPath<u16>,
    _: NoBody,
) -> Result<Json<LineDoc>, Problem> {
    let side = IoKind::Output;
    action(&hub, side, line, Action::Release { side, line }).await
}
