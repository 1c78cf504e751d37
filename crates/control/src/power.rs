//! `/power` and `/reset`: power off, on and cycle; reset to the state at the start.
//!
//! Power is an action of the controller. A reset is done by the driver, which also closes the connections.

use super::body::NoBody;
use super::handle::DriverHandle;
use super::problem::Problem;
use super::route_table::RouteTable;
use axum::Json;
use axum::extract::State;
use serde::Serialize;
use ts3100_controller::action::Action;
use ts3100_controller::input::PanelAction;
use ts3100_driver::driver::request::{LinkAction, View};
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

type Answer = Result<Json<PowerStatus>, Problem>;

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
async fn get_power(State(handle): State<DriverHandle>) -> Answer {
    let look = |view: &View<'_>| PowerStatus {
        on: view.controller.state().powered,
        ports: view
            .ports
            .iter()
            .map(|(port, accepts)| OpenPort {
                port: port.name(),
                accepts: *accepts,
            })
            .collect(),
    };
    Ok(Json(handle.query(look).await?))
}

/// Turn the power off: every connection ends, no port is open
#[utoipa::path(post, path = "/power/off", responses((status = 200, body = PowerStatus)))]
async fn power_off(state: State<DriverHandle>, _: NoBody) -> Answer {
    state.action(Action::PowerOff).await?;
    get_power(state).await
}

/// Turn the power on: as at power-on; the RAM drive, the posture and the selection are as they were
#[utoipa::path(post, path = "/power/on", responses((status = 200, body = PowerStatus)))]
async fn power_on(state: State<DriverHandle>, _: NoBody) -> Answer {
    state.action(Action::PowerOn).await?;
    get_power(state).await
}

/// Turn the power off and on
#[utoipa::path(post, path = "/power/cycle", responses((status = 200, body = PowerStatus)))]
async fn power_cycle(state: State<DriverHandle>, _: NoBody) -> Answer {
    state.action(Action::Panel(PanelAction::PowerCycle)).await?;
    get_power(state).await
}

/// Everything as when the emulator was started, for between tests
///
/// Files, variables, lines, alarms, forces and findings; time begins at 0 again; connections are closed; the TCP ports
/// and the way time passes stay. Events and counters go on.
#[utoipa::path(post, path = "/reset", responses((status = 200, body = PowerStatus)))]
async fn reset(state: State<DriverHandle>, _: NoBody) -> Answer {
    state.link_action(LinkAction::Reset).await?;
    get_power(state).await
}
