//! `/health`, `/version`, `/metrics` and `/findings`: for monitoring the emulator and the hosts that use it.
//!
//! Counters come from [`super::metrics`], findings from [`super::journal`].

use super::event::NumberedEvent;
use super::metrics::{self, Gauge, Sample};
use super::resource::{Answer, Handle, Json, Problem, Serialize, View, call};
use super::robots::{Robots, Scope};
use axum::http::header::CONTENT_TYPE;
use axum::response::IntoResponse;
use ts3100_controller::Port;
use ts3100_driver::store::backing::BackingStatus;
use ts3100_proto::status::ExecutionStatus;

/// Media type of the text format of Prometheus.
const PROMETHEUS: &str = "text/plain; version=0.0.4; charset=utf-8";

/// The health of the emulator.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct Health {
    /// `ok`: the loop that serves the hosts responds.
    status: &'static str,
    /// Whether the power of the controller is on; of a single robot.
    #[serde(skip_serializing_if = "Option::is_none")]
    power: Option<bool>,
    /// Virtual time in seconds; of a single robot.
    #[serde(skip_serializing_if = "Option::is_none")]
    t: Option<f64>,
    /// Number of robots in this process, if there are several.
    #[serde(skip_serializing_if = "Option::is_none")]
    robots: Option<usize>,
    /// The directory of the RAM drive (`--drive`), if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    drive: Option<DriveHealth>,
}

/// The health of the directory of the RAM drive.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct DriveHealth {
    /// `ok`, or `failing`: it did not accept the last change, or lacks files.
    status: &'static str,
    /// Changes that it did not accept since the start.
    failures: u64,
    /// Reason for which it did not accept the last one.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
    /// Files that are missing in the directory; a restart would lose them.
    unkept: Vec<String>,
}

impl DriveHealth {
    fn new(condition: &BackingStatus) -> DriveHealth {
        let good = condition.error.is_none() && condition.unsaved.is_empty();
        DriveHealth {
            status: if good { "ok" } else { "failing" },
            failures: condition.failures,
            error: condition.error.clone(),
            unkept: condition.unsaved.iter().cloned().collect(),
        }
    }
}

/// Version of the emulator and its robot.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct Version {
    /// `ts3100`.
    name: &'static str,
    /// Version of the emulator.
    version: &'static str,
    /// The controller that it emulates; of a single robot.
    #[serde(skip_serializing_if = "Option::is_none")]
    controller: Option<&'static str>,
    /// The arm model; of a single robot.
    #[serde(skip_serializing_if = "Option::is_none")]
    model: Option<String>,
}

call! {
    /// Check that the emulator answers
    get_health = get("/health", responses((status = 200, body = Health)))
}
pub async fn get_health(scope: Scope) -> Answer<Health> {
    let look = |view: &View<'_>| Health {
        status: "ok",
        power: Some(view.controller.state().powered),
        t: Some(view.controller.now().as_seconds()),
        robots: None,
        drive: view.backing.map(DriveHealth::new),
    };
    let robots = match scope {
        Scope::One(handle) => return handle.query(look).await.map(Json),
        Scope::All(robots) => robots,
    };
    let mut health = Health {
        status: "ok",
        power: None,
        t: None,
        robots: Some(robots.names().len()),
        drive: None,
    };
    for (_, handle) in running(robots.as_ref()) {
        let drive = handle.query(look).await?.drive;
        // The first that fails tells enough.
        if drive.as_ref().is_some_and(|drive| drive.status != "ok") {
            health.drive = health.drive.or(drive);
        }
    }
    Ok(Json(health))
}

/// The robots that have started.
fn running(robots: &dyn Robots) -> impl Iterator<Item = (String, Handle)> {
    let names = robots.names().into_iter();
    names.filter_map(|name| robots.running(&name).map(|handle| (name, handle)))
}

call! {
    /// Get the version of the emulator
    get_version = get("/version", responses((status = 200, body = Version)))
}
pub async fn get_version(scope: Scope) -> Answer<Version> {
    let look = |view: &View<'_>| {
        let config = view.controller.config();
        (config.controller.name(), config.model.name.clone())
    };
    let robot = match scope {
        Scope::One(handle) => Some(handle.query(look).await?),
        Scope::All(_) => None,
    };
    let (controller, model) = robot.unzip();
    Ok(Json(Version {
        name: "ts3100",
        version: env!("CARGO_PKG_VERSION"),
        controller,
        model,
    }))
}

call! {
    /// Get metrics for Prometheus
    ///
    /// Of several robots, each value has the label `robot`; those that have not started have none.
    get_metrics = get("/metrics",
        responses((status = 200, description = "Counters and gauges in the text format of Prometheus.",
            body = String, content_type = "text/plain")))
}
pub async fn get_metrics(scope: Scope) -> Result<impl IntoResponse, Problem> {
    let mut samples = Vec::new();
    match scope {
        Scope::One(handle) => samples.push(sample(None, &handle).await?),
        Scope::All(robots) => {
            for (name, handle) in running(robots.as_ref()) {
                samples.push(sample(Some(name), &handle).await?);
            }
        }
    }
    Ok(([(CONTENT_TYPE, PROMETHEUS)], metrics::to_prometheus(&samples)))
}

async fn sample(robot: Option<String>, handle: &Handle) -> Result<Sample, Problem> {
    let gauges = handle.query(gauges).await?;
    Ok(Sample {
        robot,
        counters: handle.journal.metrics(),
        gauges,
    })
}

fn gauges(view: &View<'_>) -> Vec<Gauge> {
    let controller = view.controller;
    let state = controller.state();
    let has_peer = |port: &Port| controller.peer(*port).is_some();
    let peers = Port::ALL.into_iter().filter(has_peer).count();
    #[expect(clippy::cast_precision_loss, reason = "there are six ports and 32 alarms")]
    let (peers, alarms) = (peers as f64, controller.alarms().active().len() as f64);
    let drive = view.backing.into_iter().flat_map(drive_gauges);
    let mut gauges = vec![
        gauge(
            "ts3100_virtual_seconds",
            "Virtual time since the start or the last reset.",
            controller.now().as_seconds(),
        ),
        gauge(
            "ts3100_power",
            "1 while the power of the controller is on.",
            state.powered,
        ),
        gauge("ts3100_servo", "1 while servo power is on.", state.servo),
        gauge(
            "ts3100_running",
            "1 while a program or the statement of DO runs.",
            controller.status() == ExecutionStatus::Running,
        ),
        gauge("ts3100_alarms_active", "Alarms that are active.", alarms),
        gauge("ts3100_peers", "Peers that are connected.", peers),
    ];
    gauges.extend(drive);
    gauges
}

/// One value of the metrics: what is on or off is 1 or 0.
fn gauge(name: &'static str, help: &'static str, value: impl Into<f64>) -> Gauge {
    let value = value.into();
    Gauge { name, help, value }
}

fn drive_gauges(condition: &BackingStatus) -> [Gauge; 3] {
    #[expect(clippy::cast_precision_loss, reason = "a chart shows no more")]
    let (failures, unkept) = (condition.failures as f64, condition.unsaved.len() as f64);
    [
        gauge(
            "ts3100_drive_failing",
            "1 if the directory of the RAM drive did not accept the last change.",
            condition.error.is_some(),
        ),
        gauge(
            "ts3100_drive_failures",
            "Changes that the directory of the RAM drive did not accept since the start.",
            failures,
        ),
        gauge(
            "ts3100_drive_unkept_files",
            "Files that are missing or old in the directory of the RAM drive.",
            unkept,
        ),
    ]
}

call! {
    /// List the protocol mistakes of hosts
    ///
    /// The last 1024, oldest first.
    get_findings = get("/findings",
        responses((status = 200, description = "The findings, oldest first.", body = Vec<crate::event::ApiEvent>)))
}
pub async fn get_findings(handle: Handle) -> Answer<Vec<NumberedEvent>> {
    // A look, so that what came before has been served.
    handle.query(|_| ()).await?;
    let findings = handle.journal.findings();
    Ok(Json(findings))
}
