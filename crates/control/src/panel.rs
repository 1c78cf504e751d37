//! `/key-switch`, `/control-right`, `/servo` and the other switches and buttons of the operating panel.
//!
//! Each call sends one panel action to the controller, which decides whether it is allowed.

use super::api_names::{KeyPosition, RightHolder, RunModeName, StatusName};
use super::body::{Json, NoBody, whole};
use super::handle::{Answer, Handle};
use super::problem::Problem;
use super::route_table::{RouteTable, routes};
use serde::{Deserialize, Serialize};
use ts3100_controller::action::Action;
use ts3100_controller::input::{self, PanelAction};
use ts3100_driver::driver::request::View;
use ts3100_proto::command::RunMode;
use ts3100_proto::status::ExecutionStatus;
use utoipa::ToSchema;

/// The key switch.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct KeySwitch {
    /// Its position.
    #[serde(with = "KeyPosition")]
    #[schema(value_type = KeyPosition)]
    position: input::KeySwitch,
}

/// The parameter EXTERNAL mode control right.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ControlRight {
    /// Who commands the robot in EXT.
    #[serde(with = "RightHolder")]
    #[schema(value_type = RightHolder)]
    holder: input::ControlRight,
}

/// The state of a button that latches.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Button {
    /// Whether it is pressed.
    pressed: bool,
}

/// The safety switch (fence).
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SafetySwitch {
    /// Whether it is open.
    open: bool,
}

/// The state of a switch.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Switch {
    /// Whether it is on.
    on: bool,
}

/// The battery of the RAM drive.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Battery {
    /// Whether it is low.
    low: bool,
}

/// The speed override.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Override {
    /// In percent.
    #[serde(deserialize_with = "whole")]
    #[schema(minimum = 1, maximum = 100)]
    percent: u8,
}

/// The operation mode.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct OperationMode {
    /// Which.
    #[serde(with = "RunModeName")]
    #[schema(value_type = RunModeName)]
    mode: RunMode,
}

/// The selected program and its status.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct ProgramStatus {
    /// The selected file; empty when none is.
    file: String,
    /// Execution status.
    #[serde(with = "StatusName")]
    #[schema(value_type = StatusName)]
    status: ExecutionStatus,
    /// Current line of the file; 0 when no file is selected.
    line: u32,
}

impl ProgramStatus {
    /// As it is now.
    pub fn new(view: &View<'_>) -> ProgramStatus {
        let controller = view.controller;
        ProgramStatus {
            file: controller.selected().to_owned(),
            status: controller.status(),
            line: controller.line(),
        }
    }
}

/// Adds the calls of this file.
pub fn add(table: RouteTable) -> RouteTable {
    table
        .group(
            "panel",
            "Operating panel: key switch, control right, switches, START and STOP.",
        )
        .routes(routes!(get_key_switch, put_key_switch))
        .routes(routes!(get_control_right, put_control_right))
        .routes(routes!(get_emergency_stop, put_emergency_stop))
        .routes(routes!(get_safety_switch, put_safety_switch))
        .routes(routes!(get_servo, put_servo))
        .routes(routes!(get_feed_hold, put_feed_hold))
        .routes(routes!(press_feed_hold))
        .routes(routes!(get_machine_lock, put_machine_lock))
        .routes(routes!(get_battery, put_battery))
        .routes(routes!(get_override, put_override))
        .routes(routes!(get_run_mode, put_run_mode))
        .routes(routes!(get_program))
        .routes(routes!(start))
        .routes(routes!(stop))
}

/// Get the key switch position
#[utoipa::path(get, path = "/key-switch", responses((status = 200, body = KeySwitch)))]
async fn get_key_switch(handle: Handle) -> Answer<KeySwitch> {
    handle.query(key_switch).await.map(Json)
}

fn key_switch(view: &View<'_>) -> KeySwitch {
    let position = view.controller.state().key;
    KeySwitch { position }
}

/// Turn the key switch
///
/// A running program stops after its current step.
#[utoipa::path(put, path = "/key-switch", request_body = KeySwitch, responses((status = 200, body = KeySwitch)))]
async fn put_key_switch(handle: Handle, Json(body): Json<KeySwitch>) -> Answer<KeySwitch> {
    let panel = PanelAction::Key(body.position);
    handle.act(Action::Panel(panel), key_switch).await.map(Json)
}

/// Get the control right
#[utoipa::path(get, path = "/control-right", responses((status = 200, body = ControlRight)))]
async fn get_control_right(handle: Handle) -> Answer<ControlRight> {
    handle.query(control_right).await.map(Json)
}

fn control_right(view: &View<'_>) -> ControlRight {
    let holder = view.controller.state().control_right;
    ControlRight { holder }
}

/// Set the control right
///
/// The parameter EXTERNAL mode control right: who commands the robot while the key switch is at EXT.
#[utoipa::path(put, path = "/control-right", request_body = ControlRight,
    responses((status = 200, body = ControlRight)))]
async fn put_control_right(handle: Handle, Json(body): Json<ControlRight>) -> Answer<ControlRight> {
    let panel = PanelAction::ControlRight(body.holder);
    handle.act(Action::Panel(panel), control_right).await.map(Json)
}

/// Get the emergency stop
#[utoipa::path(get, path = "/emergency-stop", responses((status = 200, body = Button)))]
async fn get_emergency_stop(handle: Handle) -> Answer<Button> {
    handle.query(emergency_stop).await.map(Json)
}

fn emergency_stop(view: &View<'_>) -> Button {
    let pressed = view.controller.state().emergency_stop;
    Button { pressed }
}

/// Press or release the emergency stop
///
/// Pressing it raises alarm 8-027: motion stops at once and servo power goes off.
#[utoipa::path(put, path = "/emergency-stop", request_body = Button, responses((status = 200, body = Button)))]
async fn put_emergency_stop(handle: Handle, Json(body): Json<Button>) -> Answer<Button> {
    let panel = PanelAction::EmergencyStop(body.pressed);
    handle.act(Action::Panel(panel), emergency_stop).await.map(Json)
}

/// Get the safety switch
#[utoipa::path(get, path = "/safety-switch", responses((status = 200, body = SafetySwitch)))]
async fn get_safety_switch(handle: Handle) -> Answer<SafetySwitch> {
    handle.query(safety_switch).await.map(Json)
}

fn safety_switch(view: &View<'_>) -> SafetySwitch {
    let open = view.controller.state().safety_open;
    SafetySwitch { open }
}

/// Open or close the safety switch
///
/// Opening it stops the robot as the emergency stop does.
#[utoipa::path(put, path = "/safety-switch", request_body = SafetySwitch, responses((status = 200, body = SafetySwitch)))]
async fn put_safety_switch(handle: Handle, Json(body): Json<SafetySwitch>) -> Answer<SafetySwitch> {
    let panel = PanelAction::SafetySwitch(body.open);
    handle.act(Action::Panel(panel), safety_switch).await.map(Json)
}

/// Get servo power
#[utoipa::path(get, path = "/servo", responses((status = 200, body = Switch)))]
async fn get_servo(handle: Handle) -> Answer<Switch> {
    handle.query(servo).await.map(Json)
}

fn servo(view: &View<'_>) -> Switch {
    let on = view.controller.state().servo;
    Switch { on }
}

/// Turn servo power on or off
///
/// Servo power cannot be turned on while the emergency stop is pressed, the safety switch is open, or an alarm of
/// level 8 is active. The command SO has the same rule.
#[utoipa::path(put, path = "/servo", request_body = Switch, responses((status = 200, body = Switch)))]
async fn put_servo(handle: Handle, Json(body): Json<Switch>) -> Answer<Switch> {
    let panel = PanelAction::Servo(body.on);
    handle.act(Action::Panel(panel), servo).await.map(Json)
}

/// Get feed hold
#[utoipa::path(get, path = "/feed-hold", responses((status = 200, body = Switch)))]
async fn get_feed_hold(handle: Handle) -> Answer<Switch> {
    handle.query(feed_hold).await.map(Json)
}

fn feed_hold(view: &View<'_>) -> Switch {
    let on = view.controller.state().feed_hold;
    Switch { on }
}

/// Turn feed hold on or off
///
/// Feed hold pauses the arm; the program stays running.
#[utoipa::path(put, path = "/feed-hold", request_body = Switch, responses((status = 200, body = Switch)))]
async fn put_feed_hold(handle: Handle, Json(body): Json<Switch>) -> Answer<Switch> {
    handle.act(Action::FeedHold(body.on), feed_hold).await.map(Json)
}

/// Press the feed hold button
///
/// It turns feed hold on, or off if it is on.
#[utoipa::path(post, path = "/feed-hold/press", responses((status = 200, body = Switch)))]
async fn press_feed_hold(handle: Handle, _: NoBody) -> Answer<Switch> {
    let panel = PanelAction::FeedHold;
    handle.act(Action::Panel(panel), feed_hold).await.map(Json)
}

/// Get the machine lock
#[utoipa::path(get, path = "/machine-lock", responses((status = 200, body = Switch)))]
async fn get_machine_lock(handle: Handle) -> Answer<Switch> {
    handle.query(machine_lock).await.map(Json)
}

fn machine_lock(view: &View<'_>) -> Switch {
    let on = view.controller.state().machine_lock;
    Switch { on }
}

/// Turn the machine lock on or off
///
/// With the machine lock on, programs run but the arm does not move.
#[utoipa::path(put, path = "/machine-lock", request_body = Switch, responses((status = 200, body = Switch)))]
async fn put_machine_lock(handle: Handle, Json(body): Json<Switch>) -> Answer<Switch> {
    let panel = PanelAction::MachineLock(body.on);
    handle.act(Action::Panel(panel), machine_lock).await.map(Json)
}

/// Get the battery of the RAM drive
#[utoipa::path(get, path = "/battery", responses((status = 200, body = Battery)))]
async fn get_battery(handle: Handle) -> Answer<Battery> {
    handle.query(battery).await.map(Json)
}

fn battery(view: &View<'_>) -> Battery {
    let low = view.controller.state().battery_low;
    Battery { low }
}

/// Set the battery of the RAM drive to low or ok
#[utoipa::path(put, path = "/battery", request_body = Battery, responses((status = 200, body = Battery)))]
async fn put_battery(handle: Handle, Json(body): Json<Battery>) -> Answer<Battery> {
    let panel = PanelAction::Battery(body.low);
    handle.act(Action::Panel(panel), battery).await.map(Json)
}

/// Get the speed override
#[utoipa::path(get, path = "/override", responses((status = 200, body = Override)))]
async fn get_override(handle: Handle) -> Answer<Override> {
    handle.query(speed_override).await.map(Json)
}

fn speed_override(view: &View<'_>) -> Override {
    let percent = view.controller.state().override_percent;
    Override { percent }
}

/// Set the speed override
///
/// The motion under way goes on with it. The command `EC,OVRD` does the same.
#[utoipa::path(put, path = "/override", request_body = Override, responses((status = 200, body = Override)))]
async fn put_override(handle: Handle, Json(body): Json<Override>) -> Answer<Override> {
    if !(1..=100).contains(&body.percent) {
        return Err(Problem::invalid("percent", "1 to 100", body.percent));
    }
    let panel = PanelAction::Override(body.percent);
    handle.act(Action::Panel(panel), speed_override).await.map(Json)
}

/// Get the operation mode
#[utoipa::path(get, path = "/run-mode", responses((status = 200, body = OperationMode)))]
async fn get_run_mode(handle: Handle) -> Answer<OperationMode> {
    handle.query(run_mode).await.map(Json)
}

fn run_mode(view: &View<'_>) -> OperationMode {
    let mode = view.controller.state().run_mode;
    OperationMode { mode }
}

/// Set the operation mode
///
/// Only while the robot is stopped, as the command `EC,MODE`.
#[utoipa::path(put, path = "/run-mode", request_body = OperationMode, responses((status = 200, body = OperationMode)))]
async fn put_run_mode(handle: Handle, Json(body): Json<OperationMode>) -> Answer<OperationMode> {
    let panel = PanelAction::RunMode(body.mode);
    handle.act(Action::Panel(panel), run_mode).await.map(Json)
}

/// Get the selected program and its status
#[utoipa::path(get, path = "/program", responses((status = 200, body = ProgramStatus)))]
async fn get_program(handle: Handle) -> Answer<ProgramStatus> {
    handle.query(ProgramStatus::new).await.map(Json)
}

/// Press START
///
/// The selected program starts or continues, whoever has the control right.
#[utoipa::path(post, path = "/program/start", operation_id = "start_program", responses((status = 200, body = ProgramStatus)))]
async fn start(handle: Handle, _: NoBody) -> Answer<ProgramStatus> {
    let panel = PanelAction::Start;
    handle
        .act(Action::Panel(panel), ProgramStatus::new)
        .await
        .map(Json)
}

/// Press STOP
///
/// The program stops after its current step.
#[utoipa::path(post, path = "/program/stop", operation_id = "stop_program", responses((status = 200, body = ProgramStatus)))]
async fn stop(handle: Handle, _: NoBody) -> Answer<ProgramStatus> {
    let panel = PanelAction::Stop;
    handle
        .act(Action::Panel(panel), ProgramStatus::new)
        .await
        .map(Json)
}
