//! `/inputs`, `/outputs` and `/lines`: the digital lines: read, drive, set, force, release, pulse.
//!
//! Line numbers and forcing are the controller's `signals` module, names its `line_names`.

use super::body::Seconds;
use super::resource::{Answer, Deserialize, Handle, Json, NoBody, Path, Problem, Serialize, View, call};
use serde::Deserializer;
use serde::de::Error as _;
use ts3100_controller::signals::{LINE_NUMBERS, Signals};
use ts3100_controller::{Action, IoKind, PanelAction, line_name};

/// The inputs or outputs that are on or forced.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Lines))]
pub struct LineList {
    /// Numbers of the lines that are on.
    on: Vec<u16>,
    /// Lines that are forced.
    forced: Vec<ForcedLine>,
}

/// A line that is forced.
#[derive(Debug, Clone, Copy, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct ForcedLine {
    /// Number of the line.
    line: u16,
    /// State that it shows.
    on: bool,
}

/// The state of a digital line.
#[derive(Debug, Clone, Copy, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Line))]
pub struct LineStatus {
    /// Number of the line: 1-64, 101-164, 201-264, 301-364, 401-464.
    line: u16,
    /// Name of a system signal or an output of a hand, for example `STROBE`.
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<&'static str>,
    /// State that it shows.
    on: bool,
    /// Whether it is forced.
    forced: bool,
}

/// All digital lines.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = AllLines))]
pub struct LineTable {
    /// Din, in the order of their numbers.
    inputs: Vec<LineStatus>,
    /// Dout, in the order of their numbers.
    outputs: Vec<LineStatus>,
}

/// The new state of a line.
#[derive(Debug, Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct SetLine {
    /// Whether it is on.
    on: bool,
}

/// A pulse.
#[derive(Debug, Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Pulse))]
#[serde(deny_unknown_fields)]
pub struct PulseRequest {
    /// Length in seconds of virtual time.
    #[cfg_attr(test, schema(value_type = f64, minimum = 0, maximum = 100_000_000))]
    seconds: Seconds,
    /// The state during the pulse. An output can only pulse to on.
    #[serde(default = "default_on")]
    #[cfg_attr(test, schema(default = true))]
    on: bool,
}

fn default_on() -> bool {
    true
}

/// An input that a call names.
#[derive(Deserialize)]
#[cfg_attr(test, derive(utoipa::IntoParams), into_params(parameter_in = Path))]
#[serde(transparent)]
pub struct Din {
    /// Din number
    #[serde(deserialize_with = "line_number")]
    #[cfg_attr(test, param(minimum = 1, maximum = 464))]
    line: u16,
}

/// An output that a call names.
#[derive(Deserialize)]
#[cfg_attr(test, derive(utoipa::IntoParams), into_params(parameter_in = Path))]
#[serde(transparent)]
pub struct Dout {
    /// Dout number
    #[serde(deserialize_with = "line_number")]
    #[cfg_attr(test, param(minimum = 1, maximum = 464))]
    line: u16,
}

/// Reads the number of a line out of a path. Whether the line exists is checked when it is used.
fn line_number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u16, D::Error> {
    let word = String::deserialize(deserializer)?;
    let expected = || D::Error::custom(format!("expected a line, {LINE_NUMBERS}, found `{word}`"));
    word.parse().map_err(|_| expected())
}

impl LineList {
    /// The inputs as they are now.
    pub fn inputs(view: &View<'_>) -> LineList {
        LineList::new(view, IoKind::Input)
    }

    /// The outputs as they are now.
    pub fn outputs(view: &View<'_>) -> LineList {
        LineList::new(view, IoKind::Output)
    }

    fn new(view: &View<'_>, side: IoKind) -> LineList {
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

impl LineStatus {
    fn new(view: &View<'_>, side: IoKind, line: u16) -> LineStatus {
        let signals = view.controller.signals();
        LineStatus {
            line,
            name: line_name(side, line),
            on: is_on(signals, side, line),
            forced: signals.forced(side, line).is_some(),
        }
    }
}

impl LineTable {
    pub fn new(view: &View<'_>) -> LineTable {
        let all = |side| {
            Signals::numbers()
                .map(|line| LineStatus::new(view, side, line))
                .collect()
        };
        LineTable {
            inputs: all(IoKind::Input),
            outputs: all(IoKind::Output),
        }
    }
}

fn is_on(signals: &Signals, side: IoKind, line: u16) -> bool {
    match side {
        IoKind::Input => signals.input(line),
        IoKind::Output => signals.output(line),
    }
}

/// Refuses a number that no line has.
pub fn require_line(line: u16) -> Result<(), Problem> {
    if Signals::exists(line) {
        return Ok(());
    }
    Err(Problem::not_found("line", LINE_NUMBERS, line))
}

async fn look(handle: &Handle, side: IoKind, line: u16) -> Answer<LineStatus> {
    require_line(line)?;
    let look = move |view: &View<'_>| LineStatus::new(view, side, line);
    handle.query(look).await.map(Json)
}

async fn act(handle: &Handle, side: IoKind, line: u16, action: Action) -> Answer<LineStatus> {
    let look = move |view: &View<'_>| LineStatus::new(view, side, line);
    handle.act(action, look).await.map(Json)
}

async fn pulse(handle: &Handle, side: IoKind, line: u16, body: PulseRequest) -> Answer<LineStatus> {
    let pulse = Action::Pulse {
        side,
        line,
        on: body.on,
        length: body.seconds.0,
    };
    act(handle, side, line, pulse).await
}

call! {
    /// Get an input
    get_input = get("/inputs/{line}", params(Din), responses((status = 200, body = LineStatus)))
}
pub async fn get_input(handle: Handle, Path(Din { line }): Path<Din>) -> Answer<LineStatus> {
    look(&handle, IoKind::Input, line).await
}

call! {
    /// Set an input
    ///
    /// Acts as a device wired to it would. The input keeps its state until it is set again.
    put_input = put("/inputs/{line}", params(Din), request_body = SetLine, responses((status = 200, body = LineStatus)))
}
pub async fn put_input(
    handle: Handle,
    Path(Din { line }): Path<Din>,
    Json(body): Json<SetLine>,
) -> Answer<LineStatus> {
    let panel = PanelAction::InputLine { line, on: body.on };
    act(&handle, IoKind::Input, line, Action::Panel(panel)).await
}

call! {
    /// Pulse an input
    ///
    /// Sets it for a time, then to the opposite state.
    pulse_input = post("/inputs/{line}/pulse",
        params(Din),
        request_body = PulseRequest,
        responses((status = 200, body = LineStatus)))
}
pub async fn pulse_input(
    handle: Handle,
    Path(Din { line }): Path<Din>,
    Json(body): Json<PulseRequest>,
) -> Answer<LineStatus> {
    pulse(&handle, IoKind::Input, line, body).await
}

call! {
    /// Force an input
    ///
    /// The input shows this state, whatever is wired to it, until it is released.
    force_input = put("/inputs/{line}/force",
        params(Din),
        request_body = SetLine,
        responses((status = 200, body = LineStatus)))
}
pub async fn force_input(
    handle: Handle,
    Path(Din { line }): Path<Din>,
    Json(body): Json<SetLine>,
) -> Answer<LineStatus> {
    let (side, on) = (IoKind::Input, body.on);
    act(&handle, side, line, Action::Force { side, line, on }).await
}

call! {
    /// Release a forced input
    release_input = delete("/inputs/{line}/force", params(Din), responses((status = 200, body = LineStatus)))
}
pub async fn release_input(handle: Handle, Path(Din { line }): Path<Din>, _: NoBody) -> Answer<LineStatus> {
    let side = IoKind::Input;
    act(&handle, side, line, Action::Release { side, line }).await
}

call! {
    /// Get an output
    get_output = get("/outputs/{line}", params(Dout), responses((status = 200, body = LineStatus)))
}
pub async fn get_output(handle: Handle, Path(Dout { line }): Path<Dout>) -> Answer<LineStatus> {
    look(&handle, IoKind::Output, line).await
}

call! {
    /// Set a user output
    ///
    /// As the command IW does. User outputs are 1-64, 101-164 and 201-208; with `io.field_bus = present` also 301-364 and 401-464.
    put_output = put("/outputs/{line}",
        params(Dout),
        request_body = SetLine,
        responses((status = 200, body = LineStatus)))
}
pub async fn put_output(
    handle: Handle,
    Path(Dout { line }): Path<Dout>,
    Json(body): Json<SetLine>,
) -> Answer<LineStatus> {
    let set = Action::SetOutput { line, on: body.on };
    act(&handle, IoKind::Output, line, set).await
}

call! {
    /// Pulse a user output
    ///
    /// Turns it on for a time, then off.
    pulse_output = post("/outputs/{line}/pulse",
        params(Dout),
        request_body = PulseRequest,
        responses((status = 200, body = LineStatus)))
}
pub async fn pulse_output(
    handle: Handle,
    Path(Dout { line }): Path<Dout>,
    Json(body): Json<PulseRequest>,
) -> Answer<LineStatus> {
    pulse(&handle, IoKind::Output, line, body).await
}

call! {
    /// Force an output
    ///
    /// The output shows this state, whatever the program does, until it is released or the power goes off.
    force_output = put("/outputs/{line}/force",
        params(Dout),
        request_body = SetLine,
        responses((status = 200, body = LineStatus)))
}
pub async fn force_output(
    handle: Handle,
    Path(Dout { line }): Path<Dout>,
    Json(body): Json<SetLine>,
) -> Answer<LineStatus> {
    let (side, on) = (IoKind::Output, body.on);
    act(&handle, side, line, Action::Force { side, line, on }).await
}

call! {
    /// Release a forced output
    release_output = delete("/outputs/{line}/force", params(Dout), responses((status = 200, body = LineStatus)))
}
pub async fn release_output(
    handle: Handle,
    Path(Dout { line }): Path<Dout>,
    _: NoBody,
) -> Answer<LineStatus> {
    let side = IoKind::Output;
    act(&handle, side, line, Action::Release { side, line }).await
}
