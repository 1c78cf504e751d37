//! `/power` and `/reset`: power off, on and cycle; reset to the state at the start.
//!
//! Power is an action of the controller. A reset is done by the driver, which also closes the connections.

use super::body::{Json, NoBody};
use super::handle::{Answer, Handle};
use super::route_table::RouteTable;
use serde::Serialize;
use ts3100_controller::action::Action;
use ts3100_controller::input::PanelAction;
use ts3100_driver::driver::request::{LinkAction, Request, View};
use utoipa::ToSchema;
use utoipa_axum::routes;

/// The power, and the ports it keeps open.
#[derive(Debug, Clone, Serialize, ToSchema)]
#[schema(as = PowerDoc)]
pub struct PowerStatus {
    /// It is on.
    on: bool,
    /// The server channels and the TCP port each accepts on.
    ports: Vec<OpenPort>,
}

/// A server channel.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
pub struct OpenPort {
    /// The channel.
    port: &'static str,
    /// The TCP port it accepts on.
    accepts: u16,
}

impl PowerStatus {
    fn new(view: &View<'_>) -> PowerStatus {
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

/// Adds the calls of this file.
pub fn add(table: RouteTable) -> RouteTable {
    table
        .group("power", "Power off, on, cycle; reset between tests.")
        .routes(routes!(get_power))
        .routes(routes!(power_off))
        .routes(routes!(power_on))
        .routes(routes!(power_cycle))
        .routes(routes!(reset))
}

/// Whether the power is on
#[utoipa::path(get, path = "/power", responses((status = 200, body = PowerStatus)))]
async fn get_power(handle: Handle) -> Answer<PowerStatus> {
    handle.query(PowerStatus::new).await.map(Json)
}

/// Turn the power off: every connection ends, no port is open
#[utoipa::path(post, path = "/power/off", responses((status = 200, body = PowerStatus)))]
async fn power_off(handle: Handle, _: NoBody) -> Answer<PowerStatus> {
    handle.act(Action::PowerOff, PowerStatus::new).await.map(Json)
}

/// Turn the power on: as at power-on; the RAM drive, the posture and the selection are as they were
#[utoipa::path(post, path = "/power/on", responses((status = 200, body = PowerStatus)))]
async fn power_on(handle: Handle, _: NoBody) -> Answer<PowerStatus> {
    handle.act(Action::PowerOn, PowerStatus::new).await.map(Json)
}

/// Turn the power off and on
#[utoipa::path(post, path = "/power/cycle", responses((status = 200, body = PowerStatus)))]
async fn power_cycle(handle: Handle, _: NoBody) -> Answer<PowerStatus> {
    let panel = PanelAction::PowerCycle;
    handle.act(Action::Panel(panel), PowerStatus::new).await.map(Json)
}

/// Everything as when the emulator was started, for between tests
///
/// Files, variables, lines, alarms, forces and findings; time begins at 0 again; connections are closed; the TCP ports
/// and the way time passes stay. Events and counters go on.
#[utoipa::path(post, path = "/reset", responses((status = 200, body = PowerStatus)))]
async fn reset(handle: Handle, _: NoBody) -> Answer<PowerStatus> {
    let reset = handle.change(Request::LinkAction, LinkAction::Reset, PowerStatus::new);
    reset.await.map(Json)
}
