//! `/power` and `/reset`: power off, on and cycle; reset to the state at the start.
//!
//! Power is an action of the controller. A reset is done by the driver, which also closes the connections.

use super::clock::time_mode;
use super::resource::{Answer, Deserialize, Handle, Json, NoBody, Serialize, View, call};
use ts3100_controller::{Action, PanelAction};
use ts3100_driver::driver::request::{LinkAction, Request};

/// The power, and the ports that are open.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Power))]
pub struct PowerStatus {
    /// Whether the power is on.
    on: bool,
    /// The server channels and the TCP port each accepts on.
    ports: Vec<OpenPort>,
}

/// Settings that a reset can change.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Reset))]
#[serde(deny_unknown_fields)]
pub struct ResetRequest {
    /// The mode of the clock, as for `/clock`; by default it stays.
    #[serde(default)]
    #[cfg_attr(
        test,
        schema(
            example = "stepped",
            pattern = "^(real|stepped|auto|x([1-9][0-9]{0,4}([.][0-9]{1,9})?|100000|0[.][0-9]{0,9}[1-9]))$"
        )
    )]
    mode: Option<String>,
}

/// A server channel.
#[derive(Debug, Clone, Copy, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct OpenPort {
    /// The channel.
    port: &'static str,
    /// The TCP port it accepts on.
    accepts: u16,
}

impl PowerStatus {
    pub fn new(view: &View<'_>) -> PowerStatus {
        let ports = view.ports.iter();
        let ports = ports.map(|(port, accepts)| OpenPort {
            port: port.name(),
            accepts: *accepts,
        });
        PowerStatus {
            on: view.controller.state().powered,
            ports: ports.collect(),
        }
    }
}

call! {
    /// Turn the power off
    ///
    /// Closes every connection and every port.
    power_off = post("/power/off", responses((status = 200, body = PowerStatus)))
}
pub async fn power_off(handle: Handle, _: NoBody) -> Answer<PowerStatus> {
    handle.act(Action::PowerOff, PowerStatus::new).await.map(Json)
}

call! {
    /// Turn the power on
    ///
    /// The controller starts up. Files, posture and selection are kept.
    power_on = post("/power/on", responses((status = 200, body = PowerStatus)))
}
pub async fn power_on(handle: Handle, _: NoBody) -> Answer<PowerStatus> {
    handle.act(Action::PowerOn, PowerStatus::new).await.map(Json)
}

call! {
    /// Turn the power off and on again
    power_cycle = post("/power/cycle", responses((status = 200, body = PowerStatus)))
}
pub async fn power_cycle(handle: Handle, _: NoBody) -> Answer<PowerStatus> {
    handle.press(PanelAction::PowerCycle, PowerStatus::new).await
}

call! {
    /// Reset everything to the state at the start
    ///
    /// For use between tests: files, variables, lines, alarms, forced lines and findings are as at the start, and time
    /// restarts at 0. Connections are closed. TCP ports and the mode of the clock stay, unless `mode` names another; events
    /// and counters continue.
    reset = post("/reset",
        operation_id = "reset_emulator",
        request_body = Option<ResetRequest>,
        responses((status = 200, body = PowerStatus)))
}
pub async fn reset(handle: Handle, Json(body): Json<ResetRequest>) -> Answer<PowerStatus> {
    // Before the reset, after which a stopped clock stands at 0.
    if let Some(mode) = body.mode {
        let action = LinkAction::TimeMode(time_mode(mode)?);
        handle.change(Request::LinkAction, action, |_| ()).await?;
    }
    let reset = handle.change(Request::LinkAction, LinkAction::Reset, PowerStatus::new);
    reset.await.map(Json)
}
