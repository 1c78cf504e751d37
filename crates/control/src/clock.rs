//! `/clock` and `/wait`: how time passes, moving it by an amount or until a condition holds, and waiting without
//! moving it.
//!
//! The clock is [`ts3100_driver::clock`]. Conditions are those of the controller ([`Condition`]); some have a JSON form
//! besides.

use super::api_names::{NamedPort, NamedStatus};
use super::body::{Seconds, number_that, object_only, seconds_up_to, whole_number};
use super::lines::require_line;
use super::resource::{Answer, Deserialize, Handle, Json, Problem, Serialize, View, call};
use axum::http::StatusCode;
use serde::Deserializer;
use serde::de::Error as _;
use std::time::Duration;
use ts3100_controller::alarm::AlarmCode;
use ts3100_controller::{Condition, IoKind, Time};
use ts3100_driver::clock::{MAX_SCALE, TimeMode};
use ts3100_driver::driver::request::{LinkAction, Request, WaitResult};
use ts3100_driver::driver::wait::Wait;

/// Longest wall-clock time a call may wait.
pub const MAX_WALL: Duration = Duration::from_secs(600);
/// Longest wall-clock time a call waits by default.
pub const DEFAULT_WALL: Duration = Duration::from_secs(30);
/// Longest printed text that can be waited for.
const MAX_PRINTED_TEXT: usize = 256;

/// The clock.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Clock))]
pub struct ClockStatus {
    /// How time passes: `real`, `xN`, `stepped`, `auto`.
    mode: String,
    /// Virtual time in seconds since the emulator was started or reset.
    now: f64,
    /// Date and time as the error history writes them.
    calendar: String,
    /// Lag of the clock in seconds, because the machine could not keep up.
    behind: f64,
    /// Seconds of wall-clock time that were skipped while the process was stopped (`--time-gap skip`).
    skipped: f64,
    /// Virtual time of the next scheduled event; absent if none is scheduled.
    #[serde(skip_serializing_if = "Option::is_none")]
    next: Option<f64>,
}

/// The new mode of the clock.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = SetClock))]
#[serde(deny_unknown_fields)]
pub struct SetModeRequest {
    /// `real`, `x` and a factor up to 100000, `stepped`, `auto`.
    #[cfg_attr(
        test,
        schema(
            example = "stepped",
            pattern = "^(real|stepped|auto|x([1-9][0-9]{0,4}([.][0-9]{1,9})?|100000|0[.][0-9]{0,9}[1-9]))$"
        )
    )]
    mode: String,
}

/// An amount of time.
#[derive(Debug, Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Advance))]
#[serde(deny_unknown_fields)]
pub struct AdvanceRequest {
    /// Virtual time to advance, in seconds.
    #[cfg_attr(test, schema(value_type = f64, minimum = 0, maximum = 100_000_000))]
    seconds: Seconds,
    /// Longest wall-clock time the call may take, in seconds; default 30.
    #[serde(default)]
    #[cfg_attr(test, schema(value_type = Option<f64>, minimum = 0, maximum = 600))]
    wall: Option<WallSeconds>,
}

/// A limit of wall-clock time in seconds: 0 to [`MAX_WALL`].
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(transparent)]
struct WallSeconds(#[serde(deserialize_with = "wall_seconds")] Duration);

fn wall_seconds<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Duration, D::Error> {
    seconds_up_to(deserializer, MAX_WALL.as_secs_f64())
}

/// How long a call may take.
fn longest(requested: Option<WallSeconds>) -> Duration {
    requested.map_or(DEFAULT_WALL, |WallSeconds(wall)| wall)
}

/// A condition to wait for, and time limits.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = WaitFor))]
#[serde(deny_unknown_fields)]
pub struct WaitRequest {
    #[serde(deserialize_with = "text_or_object")]
    #[cfg_attr(test, schema(inline))]
    condition: ConditionBody,
    /// Longest virtual time to wait, in seconds.
    #[cfg_attr(test, schema(value_type = f64, minimum = 0, maximum = 100_000_000))]
    within: Seconds,
    /// Longest wall-clock time the call may take, in seconds; default 30.
    #[serde(default)]
    #[cfg_attr(test, schema(value_type = Option<f64>, minimum = 0, maximum = 600))]
    wall: Option<WallSeconds>,
}

/// The condition, as text (`output 5 on`; `/book/reference/conditions` lists all) or as an object.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(untagged)]
pub enum ConditionBody {
    /// In words.
    #[cfg_attr(test, schema(example = "output 5 on"))]
    Text(String),
    /// As an object, which some conditions have.
    Object(ConditionRequest),
}

/// Reads a condition. serde would not say what is wrong with an object that is none of its variants.
fn text_or_object<'de, D: Deserializer<'de>>(deserializer: D) -> Result<ConditionBody, D::Error> {
    let value = serde_json::Value::deserialize(deserializer)?;
    if let Some(words) = value.as_str() {
        return Ok(ConditionBody::Text(words.to_owned()));
    }
    let object = ConditionRequest::deserialize(value).map_err(D::Error::custom)?;
    Ok(ConditionBody::Object(object))
}

/// A condition as an object. "Since" means since the call.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Condition))]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum ConditionRequest {
    /// The execution status is this, or has been since.
    Status(NamedStatus),
    /// An input shows this state.
    Input(#[serde(deserialize_with = "object_only")] LineCondition),
    /// An output shows this state.
    Output(#[serde(deserialize_with = "object_only")] LineCondition),
    /// The statement in this line of the selected file has started since.
    Line(FileLine),
    /// This was printed since.
    Printed(#[serde(deserialize_with = "object_only")] PrintedCondition),
    /// The alarm of this number, or `any`, is active or was raised since.
    #[cfg_attr(test, schema(example = "2-046"))]
    Alarm(String),
    /// No program runs, the arm is at rest, and no exchange is open.
    Idle(#[serde(deserialize_with = "object_only")] EmptyObject),
}

/// An empty object.
#[derive(Debug, Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct EmptyObject {}

/// A line of a file, from 1.
#[derive(Debug, Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(minimum = 1, maximum = 99999))]
#[serde(transparent)]
pub struct FileLine(#[serde(deserialize_with = "file_line")] u32);

fn file_line<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    // A line has a byte at least, and a file has no more.
    let last = scol_mini::MAX_SOURCE;
    let fits = |line: &u32| usize::try_from(*line).is_ok_and(|line| (1..=last).contains(&line));
    let expected = format_args!("a line of a file, 1 to {last}");
    number_that(deserializer, expected, |number| whole_number(number).filter(fits))
}

fn line_number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u16, D::Error> {
    let fits = |number| u16::try_from(whole_number(number)?).ok();
    number_that(deserializer, "the number of a line", fits)
}

/// The state of a line.
#[derive(Debug, Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct LineCondition {
    /// Number of the line.
    #[serde(deserialize_with = "line_number")]
    #[cfg_attr(test, schema(minimum = 1, maximum = 464))]
    line: u16,
    /// Whether it is on.
    on: bool,
}

/// A printed text.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct PrintedCondition {
    /// The channel; default: the teach pendant.
    #[serde(default)]
    #[cfg_attr(test, schema(value_type = Option<super::api_names::PortName>))]
    channel: Option<NamedPort>,
    /// The text, anywhere in what is printed.
    #[cfg_attr(test, schema(min_length = 1, max_length = 256))]
    text: String,
}

/// How a wait ended.
#[derive(Debug, Clone, Copy, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = WaitResult))]
pub struct WaitResponse {
    /// Whether the condition holds or the time was advanced; otherwise the virtual time ran out.
    reached: bool,
    /// Virtual time at the end of the wait, in seconds.
    now: f64,
    /// Virtual time that passed during the wait, in seconds.
    passed: f64,
}

impl ClockStatus {
    pub fn new(view: &View<'_>) -> ClockStatus {
        ClockStatus {
            mode: view.time.to_string(),
            behind: view.lag.as_secs_f64(),
            skipped: view.skipped.as_secs_f64(),
            now: view.controller.now().as_seconds(),
            calendar: view.controller.calendar_now().to_string(),
            next: view.controller.poll_deadline().map(Time::as_seconds),
        }
    }
}

impl ConditionBody {
    fn into_condition(self) -> Result<Condition, Problem> {
        match self {
            ConditionBody::Text(words) => words
                .parse::<Condition>()
                .map_err(|error| Problem::new(StatusCode::CONFLICT, error).at("condition")),
            ConditionBody::Object(object) => object.into_condition(),
        }
    }
}

impl ConditionRequest {
    fn into_condition(self) -> Result<Condition, Problem> {
        let line_of = |side, LineCondition { line, on }| {
            require_line(line)?;
            Ok(Condition::Signal { side, line, on })
        };
        match self {
            ConditionRequest::Status(NamedStatus(status)) => Ok(Condition::Status(status)),
            ConditionRequest::Input(line) => line_of(IoKind::Input, line),
            ConditionRequest::Output(line) => line_of(IoKind::Output, line),
            ConditionRequest::Line(FileLine(line)) => Ok(Condition::Statement(line)),
            ConditionRequest::Printed(PrintedCondition { channel, text }) => {
                if text.is_empty() || text.len() > MAX_PRINTED_TEXT {
                    let expected = format!("1 to {MAX_PRINTED_TEXT} bytes");
                    let found = format!("{} bytes", text.len());
                    return Err(Problem::invalid("text", expected, found));
                }
                let (port, text) = (channel.map(|NamedPort(port)| port), text.into_bytes());
                Ok(Condition::Printed { port, text })
            }
            ConditionRequest::Alarm(number) if number == "any" => Ok(Condition::Alarm(None)),
            ConditionRequest::Alarm(number) if AlarmCode::from_number(&number).is_some() => {
                Ok(Condition::Alarm(Some(number)))
            }
            ConditionRequest::Alarm(number) => {
                let replaced = AlarmCode::replacement(&number).map(|_| AlarmCode::expected_number(&number));
                let expected = replaced.unwrap_or_else(|| String::from("`any` or a number of /alarms/table"));
                Err(Problem::not_found("alarm", expected, number))
            }
            ConditionRequest::Idle(EmptyObject {}) => Ok(Condition::Idle),
        }
    }
}

impl WaitRequest {
    fn into_wait(self, advance: bool) -> Result<(Wait, Duration), Problem> {
        let wall = longest(self.wall);
        let condition = self.condition.into_condition()?;
        Ok((Wait::new(Some(condition), self.within.0, advance), wall))
    }
}

impl From<WaitResult> for WaitResponse {
    fn from(waited: WaitResult) -> WaitResponse {
        WaitResponse {
            reached: waited.reached,
            now: waited.at.as_seconds(),
            passed: waited.passed.as_secs_f64(),
        }
    }
}

call! {
    /// Set how time passes
    ///
    /// `real`: as wall-clock time. `xN`: N times as fast. `stepped`: only by `advance` and `advance-until`. `auto`: jumps
    /// to the next event while every host is silent.
    put_clock = put("/clock", request_body = SetModeRequest, responses((status = 200, body = ClockStatus)))
}
pub async fn put_clock(handle: Handle, Json(body): Json<SetModeRequest>) -> Answer<ClockStatus> {
    let action = LinkAction::TimeMode(time_mode(body.mode)?);
    let changed = handle.change(Request::LinkAction, action, ClockStatus::new).await;
    // The clock is not part of the controller.
    handle.journal.touch();
    changed.map(Json)
}

/// Reads the mode of the clock in a body.
pub(super) fn time_mode(mode: String) -> Result<TimeMode, Problem> {
    mode.parse().map_err(|_| {
        let expected = format!("`real`, `stepped`, `auto`, or `x` and a factor up to {MAX_SCALE}");
        Problem::invalid("mode", expected, mode)
    })
}

call! {
    /// Advance time by an amount
    ///
    /// Works in every mode. Everything that is due in this time happens at its own moment, before the call returns.
    advance = post("/clock/advance",
        operation_id = "advance_time",
        request_body = AdvanceRequest,
        responses((status = 200, body = WaitResponse)))
}
pub async fn advance(handle: Handle, Json(body): Json<AdvanceRequest>) -> Answer<WaitResponse> {
    let wall = longest(body.wall);
    let wait = Wait::new(None, body.seconds.0, true);
    let waited = handle.wait(wait, wall).await?;
    // Nothing was waited for but the time itself.
    let ended = WaitResponse::from(WaitResult {
        reached: waited.passed >= body.seconds.0,
        ..waited
    });
    Ok(Json(ended))
}

call! {
    /// Advance time until a condition holds
    ///
    /// As `advance`; time stops at the moment at which the condition holds, or after `within`.
    advance_until = post("/clock/advance-until",
        operation_id = "advance_time_until",
        request_body = WaitRequest,
        responses((status = 200, body = WaitResponse)))
}
pub async fn advance_until(handle: Handle, Json(body): Json<WaitRequest>) -> Answer<WaitResponse> {
    let (wait, wall) = body.into_wait(true)?;
    Ok(Json(handle.wait(wait, wall).await?.into()))
}

call! {
    /// Wait until a condition holds
    ///
    /// Does not advance time. In `stepped` mode another client has to advance it.
    wait = post("/wait",
        operation_id = "wait_until",
        request_body = WaitRequest,
        responses((status = 200, body = WaitResponse)))
}
pub async fn wait(handle: Handle, Json(body): Json<WaitRequest>) -> Answer<WaitResponse> {
    let (wait, wall) = body.into_wait(false)?;
    Ok(Json(handle.wait(wait, wall).await?.into()))
}
