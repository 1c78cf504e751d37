//! The configuration of `serve`: flags over environment variables (`TS3100_*`) over a TOML file over defaults.
//!
//! All three are read through the definition of the flags in [`args`], so a key has the same name, values and error
//! message everywhere. The result is [`Settings`], which [`ts3100_driver::driver`] opens. [`crate::embed`] builds the same
//! settings without a command line.

pub mod args;
mod device;
mod error;
pub mod exported;
mod flag_group;
pub mod fleet;
mod layers;
pub mod model;
mod of_run;
mod options;
mod report_args;
pub mod schema;
mod seed;
mod serial;

pub use args::{FileArgs, ListenAt, Places, ServeArgs};
pub use error::ConfigError;
pub use flag_group::{Flag, Mark};
pub use layers::{Environment, environment, read, read_points};
pub use of_run::{of_run, reason};
pub use options::{OPTIONS, OptionError, OptionRow, Values, set_option};
pub use report_args::{ReportArgs, parse_percent};
pub use seed::Seed;
pub use ts3100_driver::tcp::{LinkOptions, Ports, SecondConnection};

use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv4Addr};
use std::path::PathBuf;
use tracing::info;
use ts3100_control::{ControlChoice, ControlError, ControlSettings, DEFAULT_PORT};
use ts3100_controller::faults::Fault;
use ts3100_controller::{Config, ControllerType, Dialect, KeySwitch, Permissions, Port};
use ts3100_driver::clock::{self, TimeGap, TimeMode};
use ts3100_driver::serial::SerialEndpoint;
use ts3100_proto::permission::PermissionTable;
use ts3100_proto::words::Word as _;
use ts3100_recording::scenario::Scenario;
use ts3100_survey::{Report, ledger};

/// The complete configuration of an emulator, ready to be opened.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Address the servers listen on.
    pub listen: IpAddr,
    /// TCP ports of the servers.
    pub ports: Ports,
    /// Endpoints of the serial ports HOST and COM1; a port without an entry is not reachable.
    pub serial: BTreeMap<Port, SerialEndpoint>,
    /// Options, arm model, key switch and permissions of the controller.
    pub controller: Config,
    /// Options of the TCP links and of the backing directory.
    pub links: LinkOptions,
    /// Time mode.
    pub time: TimeMode,
    /// Whether wall-clock time during a stop of the process (SIGSTOP) is skipped or caught up with.
    pub time_gap: TimeGap,
    /// Files of the drive at the start, and the files for the state.
    pub files: FileArgs,
    /// Files of the drive given by name and content, loaded after those of [`Settings::files`].
    pub contents: Vec<(String, Vec<u8>)>,
    /// Where the configuration file names the files and the selection, if it does.
    pub places: Places,
    /// Servo power on at the start.
    pub servo_on: bool,
    /// Faults that are armed from the start.
    pub faults: Vec<Fault>,
    /// The name of this robot, if the snapshot is that of a cell.
    pub restored_as: Option<String>,
    /// Scenario: actions during the run, and what the hosts are expected to do.
    pub scenario: Option<Scenario>,
    /// File for the results of the scenario.
    pub junit: Option<PathBuf>,
    /// The control interface, if there is one.
    pub control: Option<ControlSettings>,
    /// Flags that made [`Settings::controller`], as `key=value`, for the header of a transcript.
    pub flags: Vec<String>,
    /// Record the executed lines of user files; programs run slower.
    pub record_lines: bool,
    /// Transcripts to write during the run, and reports at the end.
    pub reports: ReportArgs,
}

impl Settings {
    /// The address of the servers, unless another is chosen.
    pub const LISTEN: IpAddr = IpAddr::V4(Ipv4Addr::LOCALHOST);

    /// The defaults around a controller: loopback, the ports of ETHERNET.PAR, real time, memory only.
    pub fn new(controller: Config) -> Settings {
        Settings {
            listen: Settings::LISTEN,
            ports: Ports::Offset(0),
            serial: BTreeMap::new(),
            controller,
            links: LinkOptions::default(),
            time: TimeMode::default(),
            time_gap: TimeGap::default(),
            files: FileArgs::default(),
            contents: Vec::new(),
            places: Places::new(),
            servo_on: false,
            faults: Vec::new(),
            restored_as: None,
            scenario: None,
            junit: None,
            control: None,
            flags: Vec::new(),
            record_lines: false,
            reports: ReportArgs::default(),
        }
    }

    /// Builds the settings from the merged arguments.
    ///
    /// # Errors
    /// A value that no single flag can refuse by itself: a named option, the permission file, the model file, the points,
    /// INTERNAL on a controller without it, a fault, two ways to one serial port.
    pub fn from_args(args: &ServeArgs) -> Result<Settings, ConfigError> {
        let args = with_surveyed(args)?;
        let mut controller = Config::new(args.robot.dialect.unwrap_or_default())
            .with_controller(args.robot.controller.unwrap_or_default());
        let mut links = LinkOptions::default();
        for pair in &args.robot.set {
            options::set_pair(&mut controller.options, &mut links, pair)?;
        }
        if let Some(model) = &args.robot.model {
            controller.model = model.read().map_err(|reason| match args.places.get("model") {
                Some(place) => ConfigError::invalid(place, reason),
                None => reason,
            })?;
        }
        if let Some(path) = &args.files.points {
            controller.points = layers::read_points(path, controller.model.language())?;
        }
        controller.key = args.robot.key_switch.unwrap_or_default();
        controller.control_right = args.robot.control_right.unwrap_or_default();
        if !controller.controller.has_internal() && controller.key == KeySwitch::Internal {
            return Err(ConfigError::NoInternal(controller.controller.name()));
        }
        if let Some(path) = &args.robot.permissions {
            let text = error::read_text(path)?;
            let table = PermissionTable::parse(&text);
            let table = table.map_err(|reason| {
                let path = path.clone();
                ConfigError::Permissions { path, reason }
            })?;
            controller.permissions = Permissions::Given(Box::new(table));
        }
        controller.fault_seed = args.variation.fault_seed.unwrap_or(0);
        controller.vary = args.variation.vary.and_then(Seed::number);
        let time = args.clock.time.unwrap_or_default();
        // Only real time starts at today's date: other runs must repeat byte for byte, dates included.
        if matches!(time, TimeMode::Real | TimeMode::Scaled(_)) {
            controller.calendar = clock::system_calendar();
        }
        let ports = args.network.tcp_ports();
        let scenario = args.scenario.scenario.as_deref().map(Scenario::read);
        let scenario = scenario.transpose()?;
        let args = with_scenario_start(args, scenario.as_ref());
        if args.files.restore.is_some() {
            refuse_flags_beside_snapshot(&args, &controller)?;
        }
        if args.scenario.junit.is_some() && scenario.is_none() {
            return Err(ConfigError::JunitAlone);
        }
        let faults = initial_faults(&args, controller.controller)?;
        let defaults = Settings::new(controller);
        let listen = args.network.listen.unwrap_or(defaults.listen);
        Ok(Settings {
            listen,
            ports,
            serial: serial::serial_ends(&args.serial, listen)?,
            links,
            time,
            time_gap: args.clock.time_gap.unwrap_or_default(),
            servo_on: args.robot.servo_on.unwrap_or(false),
            faults,
            scenario,
            control: control_settings(&args)?,
            flags: controller_flags(&args),
            record_lines: args.reports.lcov.is_some(),
            files: args.files,
            places: args.places,
            junit: args.scenario.junit,
            reports: args.reports,
            ..defaults
        })
    }
}

/// The faults of the file, followed by those of the command line.
fn initial_faults(args: &ServeArgs, controller: ControllerType) -> Result<Vec<Fault>, ConfigError> {
    let mut faults = match &args.variation.faults {
        Some(path) => ts3100_recording::faults::read(path)?,
        None => Vec::new(),
    };
    for spec in &args.variation.fault {
        faults.push(spec.parse().map_err(ConfigError::Fault)?);
    }
    // While it runs a fault of the same number is replaced intentionally; here one would be lost silently.
    for (index, fault) in faults.iter().enumerate() {
        let before = faults.get(..index).unwrap_or_default();
        if fault.id != 0 && before.iter().any(|other| other.id == fault.id) {
            return Err(ConfigError::FaultTwice(fault.id));
        }
        // The controller of a snapshot is not known yet.
        if args.files.restore.is_none() {
            let possible = fault.check_possible_on(controller);
            possible.map_err(ConfigError::ImpossibleFault)?;
        }
    }
    Ok(faults)
}

/// Fills in what the file of `--like` decides. What is set besides wins.
fn with_surveyed(args: &ServeArgs) -> Result<ServeArgs, ConfigError> {
    let mut args = args.clone();
    let Some(path) = &args.robot.like else {
        return Ok(args);
    };
    let text = error::read_text(path)?;
    let report = Report::read(&text).map_err(|error| ConfigError::invalid(path.display(), error))?;
    let mut set: Vec<String> = report
        .options()
        .into_iter()
        .map(|(option, value)| format!("{option}={value}"))
        .collect();
    let times = &report.answer_times;
    if !times.is_empty() {
        let times: Vec<String> = times.iter().map(ToString::to_string).collect();
        set.push(format!("reply.delay={}", times.join(" ")));
    }
    let remaining: Vec<&str> = ledger::remaining(&report).map(|row| row.id).collect();
    info!(
        "like {}: {} options set; {} of {} behaviours remain assumed (`ts3100 survey show` explains them): {}",
        path.display(),
        set.len(),
        remaining.len(),
        ledger::assumed().count(),
        remaining.join(" ")
    );
    set.append(&mut args.robot.set);
    args.robot.set = set;
    let version = report.versions.first().map_or("", String::as_str);
    let kinds = args::CONTROLLERS.iter().map(|(_, kind, _)| *kind);
    let named = kinds.into_iter().find(|kind| version.starts_with(kind.name()));
    args.robot.controller = args.robot.controller.or(named);
    if args.robot.model.is_none() && report.arm == SCARA {
        args.robot.model = SCARA_MODEL.parse().ok();
    }
    Ok(args)
}

/// The arm that the file of a survey names, and the model used for it.
const SCARA: &str = "SCARA";
const SCARA_MODEL: &str = "tsl3000-thl400";

/// Fills in files, selection and snapshot from the start section of the scenario.
fn with_scenario_start(mut args: ServeArgs, scenario: Option<&Scenario>) -> ServeArgs {
    if let Some(Scenario { start, .. }) = scenario {
        if !start.load.is_empty() {
            args.places.remove("load");
        }
        args.files.load.extend(start.load.iter().cloned());
        args.files.select = args.files.select.or_else(|| start.select.clone());
        args.files.restore = args.files.restore.or_else(|| start.restore.clone());
    }
    args
}

/// Refuses flags that configure the controller beside a snapshot, which contains the whole controller. Ignoring them
/// would hide a mistake.
fn refuse_flags_beside_snapshot(args: &ServeArgs, controller: &Config) -> Result<(), ConfigError> {
    let mut conflicting: Vec<String> = controller_flags(args)
        .iter()
        .filter_map(|flag| Some(format!("--{}", flag.split_once('=')?.0)))
        .filter(|flag| flag != "--set")
        .collect();
    let preset = Config::new(Dialect::default()).with_controller(controller.controller);
    let others = [
        ("--load", !args.files.load.is_empty()),
        ("--select", args.files.select.is_some()),
        ("--servo-on", args.robot.servo_on == Some(true)),
        ("--set", controller.options != preset.options),
    ];
    let others = others.into_iter().filter(|(_, is_given)| *is_given);
    conflicting.extend(others.map(|(flag, _)| flag.to_owned()));
    if conflicting.is_empty() {
        return Ok(());
    }
    Err(ConfigError::Restore(conflicting.join(", ")))
}

/// The settings of the control interface; it is on by default.
///
/// # Errors
/// No port for it, a token file that cannot be read, or settings that exclude each other.
pub fn control_settings(args: &ServeArgs) -> Result<Option<ControlSettings>, ConfigError> {
    let given = &args.control_interface;
    let mut address = ControlSettings::free().address;
    // Who gives a token, or says that none is needed, wants to reach it from where the robot is reached.
    let is_guarded = given.control_token.is_some() || given.control_token_file.is_some();
    let is_for_others = is_guarded || given.control_open == Some(true);
    if let Some(listen) = args.network.listen.filter(|_| is_for_others) {
        address.set_ip(listen);
    }
    match (given.control, args.network.tcp_ports()) {
        (Some(ControlChoice::Off), _) => return Ok(None),
        (Some(ControlChoice::Address(chosen)), _) => address = chosen,
        (None, Ports::Auto) => {}
        (None, Ports::Offset(offset)) => {
            let port = DEFAULT_PORT
                .checked_add(offset)
                .ok_or(ControlError::Offset(offset))?;
            address.set_port(port);
        }
    }
    let token = match (&given.control_token, &given.control_token_file) {
        (Some(token), _) => Some(token.clone()),
        (None, Some(path)) => {
            let text = error::read_text(path)?;
            Some(text.lines().next().unwrap_or_default().trim().to_owned())
        }
        (None, None) => None,
    };
    let settings = ControlSettings {
        address,
        token,
        open: given.control_open.unwrap_or(false),
        hosts: given.control_host.clone(),
        frame_ancestors: given.control_frame_ancestor.clone(),
    };
    Ok(Some(settings.validate()?))
}

/// The flags that configure the controller, as `key=value`.
fn controller_flags(args: &ServeArgs) -> Vec<String> {
    fn word<T: Copy + PartialEq>(words: &[args::DescribedWord<T>], value: Option<T>) -> Option<String> {
        let value = value?;
        let found = words.iter().find(|(_, meaning, _)| *meaning == value);
        found.map(|(word, _, _)| (*word).to_owned())
    }
    let path = |path: &Option<PathBuf>| path.as_ref().map(|path| path.display().to_string());
    let ServeArgs { robot, variation, .. } = args;
    let flags = [
        ("dialect", word(args::DIALECTS, robot.dialect)),
        ("model", robot.model.as_ref().map(ToString::to_string)),
        ("controller", word(args::CONTROLLERS, robot.controller)),
        ("key-switch", robot.key_switch.map(|key| key.word().to_owned())),
        (
            "control-right",
            robot.control_right.map(|right| right.word().to_owned()),
        ),
        ("permissions", path(&robot.permissions)),
        ("points", path(&args.files.points)),
        ("vary", variation.vary.map(|seed| seed.to_string())),
        ("fault-seed", variation.fault_seed.map(|seed| seed.to_string())),
    ];
    let flags = flags.into_iter();
    let flags = flags.filter_map(|(key, value)| Some(format!("{key}={}", value?)));
    flags
        .chain(robot.set.iter().map(|pair| format!("set={pair}")))
        .collect()
}

#[cfg(test)]
mod tests;
