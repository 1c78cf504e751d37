//! `/key-switch`, `/control-right`, `/servo` and the other switches and buttons of the operating panel.
//!
//! Each call sends one panel action to the controller, which decides whether it is allowed.

use super::api_names::{KeyPosition, RightHolder, StatusName};
use super::body::{JsonBody, NoBody};
use super::handle::DriverHandle;
use super::problem::Problem;
use super::route_table::RouteTable;
use crate::driver::request::View;
use axum::Json;
use axum::extract::State;
use serde::{Deserialize, Serialize};
use ts3100_controller::action::Action;
use ts3100_controller::input::{self, PanelAction};
use utoipa::ToSchema;
use utoipa_axum::routes;

type Answer<T> = Result<Json<T>, Problem>;

/// Position of the key switch.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct KeySwitch {
    /// Where it stands.
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

/// A button that stays pressed.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Button {
    /// It is pressed.
    pressed: bool,
}

/// The safety switch (fence).
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = Fence)]
pub struct SafetySwitch {
    /// It is open: the robot stops as by the emergency stop.
    open: bool,
}

/// Something that is on or off.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Switch {
    /// It is on.
    on: bool,
}

/// The battery of the RAM drive.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Battery {
    /// It is low.
    low: bool,
}

/// Where the selected program stands.
#[derive(Debug, Clone, Serialize, ToSchema)]
#[schema(as = Program)]
pub struct ProgramStatus {
    /// The selected file; empty when none is.
    file: String,
    /// Execution status.
    status: StatusName,
    /// File line at which the program stands; 0 when no file is selected.
    line: u32,
}

impl ProgramStatus {
    /// As it is now.
    pub fn new(view: &View<'_>) -> ProgramStatus {
        let controller = view.controller;
        ProgramStatus {
            file: controller.selected().to_owned(),
            status: controller.status().into(),
            line: controller.line(),
        }
    }
}

/// Adds the calls of this file.
pub fn add(table: RouteTable) -> RouteTable {
    table
        .group(
            "panel",
            "Key switch, control right, switches and buttons of the operating panel.",
        )
        .routes(routes!(get_key_switch))
        .routes(routes!(put_key_switch))
        .routes(routes!(get_control_right))
        .routes(routes!(put_control_right))
        .routes(routes!(get_emergency_stop))
        .routes(routes!(put_emergency_stop))
        .routes(routes!(get_safety_switch))
        .routes(routes!(put_safety_switch))
        .routes(routes!(get_servo))
        .routes(routes!(put_servo))
        .routes(routes!(get_feed_hold))
        .routes(routes!(put_feed_hold))
        .routes(routes!(get_machine_lock))
        .routes(routes!(put_machine_lock))
        .routes(routes!(get_battery))
        .routes(routes!(put_battery))
        .routes(routes!(get_program))
        .routes(routes!(start))
        .routes(routes!(stop))
}

/// Position of the key switch
#[utoipa::path(get, path = "/key-switch", responses((status = 200, body = KeySwitch)))]
async fn get_key_switch(State(handle): State<DriverHandle>) -> Answer<KeySwitch> {
    let look = |view: &View<'_>| view.controller.state().key;
    let position = handle.query(look).await?;
    Ok(Json(KeySwitch { position }))
}

/// Turn the key switch
///
/// A program that runs stops behind its present step.
#[utoipa::path(put, path = "/key-switch", request_body = KeySwitch, responses((status = 200, body = KeySwitch)))]
async fn put_key_switch(
    state: State<DriverHandle>,
    JsonBody(body): JsonBody<KeySwitch>,
) -> Answer<KeySwitch> {
    let panel = PanelAction::Key(body.position);
    state.action(Action::Panel(panel)).await?;
    get_key_switch(state).await
}

/// Who commands the robot in EXT
#[utoipa::path(get, path = "/control-right", responses((status = 200, body = ControlRight)))]
async fn get_control_right(State(handle): State<DriverHandle>) -> Answer<ControlRight> {
    let look = |view: &View<'_>| view.controller.state().control_right;
    let holder = handle.query(look).await?;
    Ok(Json(ControlRight { holder }))
}

/// Set the parameter EXTERNAL mode control right
#[utoipa::path(put, path = "/control-right", request_body = ControlRight,
    responses((status = 200, body = ControlRight)))]
async fn put_control_right(
    state: State<DriverHandle>,
    JsonBody(body): JsonBody<ControlRight>,
) -> Answer<ControlRight> {
    let panel = PanelAction::ControlRight(body.holder);
    state.action(Action::Panel(panel)).await?;
    get_control_right(state).await
}

/// Whether the emergency stop is pressed
#[utoipa::path(get, path = "/emergency-stop", responses((status = 200, body = Button)))]
async fn get_emergency_stop(State(handle): State<DriverHandle>) -> Answer<Button> {
    let look = |view: &View<'_>| view.controller.state().emergency_stop;
    let pressed = handle.query(look).await?;
    Ok(Json(Button { pressed }))
}

/// Press or release the emergency stop
///
/// Pressing it raises alarm 8-027: motion stops at once, servo power goes off.
#[utoipa::path(put, path = "/emergency-stop", request_body = Button, responses((status = 200, body = Button)))]
async fn put_emergency_stop(state: State<DriverHandle>, JsonBody(body): JsonBody<Button>) -> Answer<Button> {
    let panel = PanelAction::EmergencyStop(body.pressed);
    state.action(Action::Panel(panel)).await?;
    get_emergency_stop(state).await
}

/// Whether the safety switch is open
#[utoipa::path(get, path = "/safety-switch", responses((status = 200, body = SafetySwitch)))]
async fn get_safety_switch(State(handle): State<DriverHandle>) -> Answer<SafetySwitch> {
    let look = |view: &View<'_>| view.controller.state().safety_open;
    let open = handle.query(look).await?;
    Ok(Json(SafetySwitch { open }))
}

/// Open or close the safety switch
#[utoipa::path(put, path = "/safety-switch", request_body = SafetySwitch, responses((status = 200, body = SafetySwitch)))]
async fn put_safety_switch(
    state: State<DriverHandle>,
    JsonBody(body): JsonBody<SafetySwitch>,
) -> Answer<SafetySwitch> {
    let panel = PanelAction::SafetySwitch(body.open);
    state.action(Action::Panel(panel)).await?;
    get_safety_switch(state).await
}

/// Whether servo power is on
#[utoipa::path(get, path = "/servo", responses((status = 200, body = Switch)))]
async fn get_servo(State(handle): State<DriverHandle>) -> Answer<Switch> {
    let look = |view: &View<'_>| view.controller.state().servo;
    let on = handle.query(look).await?;
    Ok(Json(Switch { on }))
}

/// Turn servo power on or off
///
/// On is refused as the command SO is: while the emergency stop is pressed, the safety switch is open, or an alarm of
/// level 8 is active.
#[utoipa::path(put, path = "/servo", request_body = Switch, responses((status = 200, body = Switch)))]
async fn put_servo(state: State<DriverHandle>, JsonBody(body): JsonBody<Switch>) -> Answer<Switch> {
    let panel = PanelAction::Servo(body.on);
    state.action(Action::Panel(panel)).await?;
    get_servo(state).await
}

/// Whether feed hold is on
#[utoipa::path(get, path = "/feed-hold", responses((status = 200, body = Switch)))]
async fn get_feed_hold(State(handle): State<DriverHandle>) -> Answer<Switch> {
    let look = |view: &View<'_>| view.controller.state().feed_hold;
    let on = handle.query(look).await?;
    Ok(Json(Switch { on }))
}

/// Turn feed hold on or off
#[utoipa::path(put, path = "/feed-hold", request_body = Switch, responses((status = 200, body = Switch)))]
async fn put_feed_hold(state: State<DriverHandle>, JsonBody(body): JsonBody<Switch>) -> Answer<Switch> {
    state.action(Action::FeedHold(body.on)).await?;
    get_feed_hold(state).await
}

/// Whether the machine lock is on
#[utoipa::path(get, path = "/machine-lock", responses((status = 200, body = Switch)))]
async fn get_machine_lock(State(handle): State<DriverHandle>) -> Answer<Switch> {
    let look = |view: &View<'_>| view.controller.state().machine_lock;
    let on = handle.query(look).await?;
    Ok(Json(Switch { on }))
}

/// Turn the machine lock on or off: programs run without the arm moving
#[utoipa::path(put, path = "/machine-lock", request_body = Switch, responses((status = 200, body = Switch)))]
async fn put_machine_lock(state: State<DriverHandle>, JsonBody(body): JsonBody<Switch>) -> Answer<Switch> {
    let panel = PanelAction::MachineLock(body.on);
    state.action(Action::Panel(panel)).await?;
    get_machine_lock(state).await
}

/// Whether the battery of the RAM drive is low
#[utoipa::path(get, path = "/battery", responses((status = 200, body = Battery)))]
async fn get_battery(State(handle): State<DriverHandle>) -> Answer<Battery> {
    let look = |view: &View<'_>| view.controller.state().battery_low;
    let low = handle.query(look).await?;
    Ok(Json(Battery { low }))
}

/// Make the battery low or good
#[utoipa::path(put, path = "/battery", request_body = Battery, responses((status = 200, body = Battery)))]
async fn put_battery(state: State<DriverHandle>, JsonBody(body): JsonBody<Battery>) -> Answer<Battery> {
    let panel = PanelAction::Battery(body.low);
    state.action(Action::Panel(panel)).await?;
    get_battery(state).await
}

/// Where the selected program stands
#[utoipa::path(get, path = "/program", responses((status = 200, body = ProgramStatus)))]
async fn get_program(State(handle): State<DriverHandle>) -> Answer<ProgramStatus> {
    Ok(Json(handle.query(ProgramStatus::new).await?))
}

/// Press START: the selected program starts or goes on, whatever the control right
#[utoipa::path(post, path = "/program/start", responses((status = 200, body = ProgramStatus)))]
async fn start(state: State<DriverHandle>, _: NoBody) -> Answer<ProgramStatus> {
    state.action(Action::Panel(PanelAction::Start)).await?;
    get_program(state).await
}

/// Press STOP: the program stops behind its present step
#[utoipa::path(post, path = "/program/stop", responses((status = 200, body = ProgramStatus)))]
async fn stop(state: State<DriverHandle>, _: NoBody) -> Answer<ProgramStatus> {
    state.action(Action::Panel(PanelAction::Stop)).await?;
    get_program(state).await
}
