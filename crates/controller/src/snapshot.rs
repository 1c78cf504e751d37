//! Snapshots: the whole controller as one versioned value, taken between two inputs.
//!
//! A restored controller continues exactly like the one it was taken of. A snapshot is validated in full on restore: a
//! state that cannot occur is rejected with what was expected, what was found, and where. The emulator gives snapshots
//! names and files.
//!
//! Programs are stored as source and compiled again (`executor::relink`). Outputs that were not drained are not part of a
//! snapshot: drain them first, as [`Controller::feed`] does.

mod bounds;

use crate::Controller;
use crate::alarm::Alarms;
use crate::arm::{Arm, Guide};
use crate::context::Context;
use crate::drive::Drive;
use crate::endpoint::Endpoints;
use crate::endpoint::send_queue::SendQueue;
use crate::endpoint::session::Session;
use crate::executor::Executor;
use crate::faults::Faults;
use crate::faults::effects::FaultEffects;
use crate::io::channel::Channel;
use crate::io::channels::Channels;
use crate::io::signals::Signals;
use crate::maintenance::MaintenanceCounters;
use crate::network::NetworkConfig;
use crate::options::Config;
use crate::outputs::Outputs;
use crate::panel::Panel;
use crate::parameters::Parameters;
use crate::persistence::Persistence;
use crate::port::Port;
use crate::prelude::*;
use crate::robot::Robot;
use crate::serial_line::SerialLine;
use crate::snapshot_error::{SnapshotError, check};
use crate::time::Time;
use crate::variation::Variation;
use alloc::collections::BTreeMap;
use ts3100_proto::parameter::{EthernetParameters, StringRow, UserParameters};

/// Value of `format` in every snapshot.
pub const SNAPSHOT_FORMAT: &str = "ts3100-snapshot";
/// Version of the snapshots that this version writes and reads. A field more or less is another version.
pub const SNAPSHOT_VERSION: u32 = 1;

/// Head of every snapshot: the rest is parsed only if it says so.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct SnapshotHeader {
    /// [`SNAPSHOT_FORMAT`].
    pub format: String,
    /// [`SNAPSHOT_VERSION`].
    pub version: u32,
}

impl SnapshotHeader {
    /// Whether it is a snapshot, of this version.
    ///
    /// # Errors
    /// [`SnapshotError::Value`] of `format` or `version`.
    pub fn validate(&self) -> Result<(), SnapshotError> {
        let known = self.format == SNAPSHOT_FORMAT;
        check(known, "format", SNAPSHOT_FORMAT, &self.format)?;
        let (known, expected) = (self.version == SNAPSHOT_VERSION, SNAPSHOT_VERSION.to_string());
        check(known, "version", &expected, self.version)
    }
}

/// The whole controller as a value to be serialized.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Snapshot {
    format: String,
    version: u32,
    config: Config,
    now: Time,
    panel: Panel,
    drive: Drive,
    alarms: Alarms,
    signals: Signals,
    sessions: BTreeMap<Port, Session>,
    channels: BTreeMap<Port, Channel>,
    lines: BTreeMap<Port, SerialLine>,
    keys: Channel,
    pendant: String,
    executor: Executor,
    arm: Arm,
    jogging: Option<Guide>,
    ethernet: EthernetParameters,
    user: UserParameters,
    strings: Vec<StringRow>,
    network: NetworkConfig,
    traced: bool,
    maintenance: MaintenanceCounters,
    faults: Faults,
    fault_effects: FaultEffects,
    variation: Option<Variation>,
    send_queue: SendQueue,
}

impl Snapshot {
    /// The moment it was taken.
    pub fn now(&self) -> Time {
        self.now
    }
}

impl Controller {
    /// A snapshot of this controller. Take it while no change of a file waits for its storage: the form has no place for
    /// what is left to do then.
    pub fn snapshot(&self) -> Snapshot {
        debug_assert!(
            !self.robot.persistence.is_waiting() && self.deferred.is_none(),
            "a snapshot while a change of a file is being stored"
        );
        let (channels, keys, pendant) = self.robot.channels.saved();
        Snapshot {
            format: SNAPSHOT_FORMAT.to_string(),
            version: SNAPSHOT_VERSION,
            config: self.robot.context.config.clone(),
            now: self.robot.context.now,
            panel: self.robot.panel.clone(),
            drive: self.robot.drive.clone(),
            alarms: self.robot.alarms.clone(),
            signals: self.robot.signals.clone(),
            sessions: self.endpoints.sessions.clone(),
            channels: channels.clone(),
            lines: self.endpoints.lines.clone(),
            keys: keys.clone(),
            pendant: pendant.clone(),
            executor: self.robot.executor.clone(),
            arm: self.robot.arm.clone(),
            jogging: self.robot.arm.guide(),
            ethernet: self.robot.parameters.ethernet().clone(),
            user: *self.robot.parameters.user(),
            strings: self.robot.parameters.strings().to_vec(),
            network: *self.robot.parameters.network(),
            traced: self.robot.context.outputs.is_traced(),
            maintenance: self.robot.maintenance,
            faults: self.endpoints.faults.clone(),
            fault_effects: self.robot.context.fault_effects.clone(),
            variation: self.endpoints.variation.clone(),
            send_queue: self.endpoints.send_queue.clone(),
        }
    }

    /// The controller that `snapshot` was taken of.
    ///
    /// # Errors
    /// [`SnapshotError`]: it is of another version, or no run leads to it.
    pub fn restore(snapshot: Snapshot) -> Result<Controller, SnapshotError> {
        let header = SnapshotHeader {
            format: snapshot.format,
            version: snapshot.version,
        };
        header.validate()?;
        let (config, mut executor) = (snapshot.config, snapshot.executor);
        bounds::check_config(&config)?;
        executor.relink(&config)?;
        let context = Context {
            now: snapshot.now,
            outputs: Outputs::default(),
            fault_effects: snapshot.fault_effects,
            config,
        };
        let mut robot = Box::new(Robot {
            panel: snapshot.panel,
            drive: snapshot.drive,
            alarms: snapshot.alarms,
            signals: snapshot.signals,
            channels: Channels::restored(snapshot.channels, snapshot.keys, snapshot.pendant),
            executor,
            arm: snapshot
                .arm
                .with_model(context.config.model.clone(), snapshot.jogging),
            parameters: Parameters::restored(
                snapshot.ethernet,
                snapshot.user,
                snapshot.strings,
                snapshot.network,
            ),
            maintenance: snapshot.maintenance,
            persistence: Persistence::default(),
            notices: Vec::new(),
            context,
        });
        robot.context.outputs.trace(snapshot.traced);
        let endpoints = Endpoints {
            sessions: snapshot.sessions,
            lines: snapshot.lines,
            faults: snapshot.faults,
            variation: snapshot.variation,
            send_queue: snapshot.send_queue,
            settings: robot.parameters.serial_lines(),
            fired: Vec::new(),
        };
        let mut controller = Controller {
            robot,
            endpoints,
            due: None,
            deferred: None,
        };
        bounds::check_controller(&controller)?;
        controller.find_due();
        Ok(controller)
    }
}
