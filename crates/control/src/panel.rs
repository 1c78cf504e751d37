//! `/key-switch`, `/control-right`, `/servo` and the other switches and buttons of the operating panel.
//!
//! Each call sends one panel action to the controller, which decides whether it is allowed.

use super::api_names::{KeyPosition, RightHolder, RunModeName, StatusName};
use super::body::whole;
use super::resource::{Answer, Deserialize, Handle, Json, NoBody, Problem, Serialize, ToSchema, View};
use ts3100_controller::action::Action;
use ts3100_controller::input::{self, PanelAction};
use ts3100_proto::command::RunMode;
use ts3100_proto::status::ExecutionStatus;

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

/// The two calls of each switch: one reads it, the other sets it. A row has the path, the document with the field of the
/// panel's state that it shows, and what sets it.
macro_rules! switches {
    ($($path:literal $document:ident { $field:ident: $state:ident } => $set:expr;
    $(#[$get_doc:meta])* $get:ident
    $(#[$put_doc:meta])* $put:ident)*) => {$(
        $(#[$get_doc])*
        #[utoipa::path(get, path = $path, responses((status = 200, body = $document)))]
        pub async fn $get(handle: Handle) -> Answer<$document> {
            let state = |view: &View<'_>| $document { $field: view.controller.state().$state };
            handle.query(state).await.map(Json)
        }

        $(#[$put_doc])*
        #[utoipa::path(put, path = $path, request_body = $document, responses((status = 200, body = $document)))]
        pub async fn $put(handle: Handle, Json($document { $field }): Json<$document>) -> Answer<$document> {
            let state = |view: &View<'_>| $document { $field: view.controller.state().$state };
            handle.act($set, state).await.map(Json)
        }
    )*};
}

switches! {
    "/key-switch" KeySwitch { position: key } => Action::Panel(PanelAction::Key(position));
    /// Get the key switch position
    get_key_switch
    /// Turn the key switch
    ///
    /// A running program stops after its current step.
    put_key_switch

    "/control-right" ControlRight { holder: control_right } => Action::Panel(PanelAction::ControlRight(holder));
    /// Get the control right
    get_control_right
    /// Set the control right
    ///
    /// The parameter EXTERNAL mode control right: who commands the robot while the key switch is at EXT.
    put_control_right

    "/emergency-stop" Button { pressed: emergency_stop } => Action::Panel(PanelAction::EmergencyStop(pressed));
    /// Get the emergency stop
    get_emergency_stop
    /// Press or release the emergency stop
    ///
    /// Pressing it raises alarm 8-014: motion stops at once and servo power goes off.
    put_emergency_stop

    "/safety-switch" SafetySwitch { open: safety_open } => Action::Panel(PanelAction::SafetySwitch(open));
    /// Get the safety switch
    get_safety_switch
    /// Open or close the safety switch
    ///
    /// Opening it stops the robot as the emergency stop does.
    put_safety_switch

    "/servo" Switch { on: servo } => Action::Panel(PanelAction::Servo(on));
    /// Get servo power
    get_servo
    /// Turn servo power on or off
    ///
    /// Servo power cannot be turned on while the emergency stop is pressed, the safety switch is open, or an alarm of
    /// level 8 is active. The command SO has the same rule.
    put_servo

    "/feed-hold" Switch { on: feed_hold } => Action::FeedHold(on);
    /// Get feed hold
    get_feed_hold
    /// Turn feed hold on or off
    ///
    /// Feed hold pauses the arm; the program stays running.
    put_feed_hold

    "/machine-lock" Switch { on: machine_lock } => Action::Panel(PanelAction::MachineLock(on));
    /// Get the machine lock
    get_machine_lock
    /// Turn the machine lock on or off
    ///
    /// With the machine lock on, programs run but the arm does not move.
    put_machine_lock

    "/battery" Battery { low: battery_low } => Action::Panel(PanelAction::Battery(low));
    /// Get the battery of the RAM drive
    get_battery
    /// Set the battery of the RAM drive to low or ok
    put_battery

    "/run-mode" OperationMode { mode: run_mode } => Action::Panel(PanelAction::RunMode(mode));
    /// Get the operation mode
    get_run_mode
    /// Set the operation mode
    ///
    /// Only while the robot is stopped, as the command `EC,MODE`.
    put_run_mode
}

/// Press the feed hold button
///
/// It turns feed hold on, or off if it is on.
#[utoipa::path(post, path = "/feed-hold/press", responses((status = 200, body = Switch)))]
pub async fn press_feed_hold(handle: Handle, _: NoBody) -> Answer<Switch> {
    let state = |view: &View<'_>| Switch {
        on: view.controller.state().feed_hold,
    };
    handle.press(PanelAction::FeedHold, state).await
}

/// Get the speed override
#[utoipa::path(get, path = "/override", responses((status = 200, body = Override)))]
pub async fn get_override(handle: Handle) -> Answer<Override> {
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
pub async fn put_override(handle: Handle, Json(body): Json<Override>) -> Answer<Override> {
    if !(1..=100).contains(&body.percent) {
        return Err(Problem::invalid("percent", "1 to 100", body.percent));
    }
    handle
        .press(PanelAction::Override(body.percent), speed_override)
        .await
}

/// Get the selected program and its status
#[utoipa::path(get, path = "/program", responses((status = 200, body = ProgramStatus)))]
pub async fn get_program(handle: Handle) -> Answer<ProgramStatus> {
    handle.query(ProgramStatus::new).await.map(Json)
}

/// Press START
///
/// The selected program starts or continues, whoever has the control right.
#[utoipa::path(post, path = "/program/start", operation_id = "start_program", responses((status = 200, body = ProgramStatus)))]
pub async fn start(handle: Handle, _: NoBody) -> Answer<ProgramStatus> {
    handle.press(PanelAction::Start, ProgramStatus::new).await
}

/// Press STOP
///
/// The program stops after its current step.
#[utoipa::path(post, path = "/program/stop", operation_id = "stop_program", responses((status = 200, body = ProgramStatus)))]
pub async fn stop(handle: Handle, _: NoBody) -> Answer<ProgramStatus> {
    handle.press(PanelAction::Stop, ProgramStatus::new).await
}
