//! Several robots in one process: `--robots N` and the tables `[[robot]]` and `[[wire]]` of the file. Each robot has the
//! configuration of the process, with a name, addresses and files of its own.
//!
//! Every error in any of them is found before the first port opens.

use super::args::{ControlArgs, NetworkArgs, PortSource, RobotTable, WireTable};
use super::flag_group::Mark;
use super::{ConfigError, ServeArgs, Settings};
use std::collections::{BTreeMap, BTreeSet};
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use tracing::{Span, error_span};
use ts3100_control::{ControlChoice, ControlSettings};
use ts3100_controller::action::IoKind;
use ts3100_controller::signals::{LINE_NUMBERS, Signals};
use ts3100_driver::world::{Wire, WireEnd};
use ts3100_proto::words::{UnexpectedWord, did_you_mean};

/// Placeholder for the name of the robot in a path.
const PLACEHOLDER: &str = "{robot}";
/// Most characters of a name.
const MAX_NAME: usize = 32;
/// Name of the world outside of the robots, in a wire.
const OUTSIDE: &str = "outside";

/// The robots of a process.
#[derive(Debug, Clone)]
pub struct FleetConfig {
    /// Arguments that all robots of a list share.
    common: ServeArgs,
    /// Name and arguments of each; empty if they are only numbered.
    tables: Vec<RobotTable>,
    /// Whether they are a list. The name of a robot that is not one of a list is not written, and its settings are those
    /// of the arguments.
    is_list: bool,
    /// The settings of each robot, made when they are first asked for.
    settings: Vec<OnceLock<Box<Settings>>>,
    /// The wires between them.
    pub wires: Vec<Wire>,
    /// The control interface of the process, if there is one.
    pub control: Option<ControlSettings>,
}

fn refused(reason: impl Into<String>) -> ConfigError {
    ConfigError::Fleet(reason.into())
}

impl FleetConfig {
    /// The robots that the arguments ask for; without a list of them a single one.
    ///
    /// # Errors
    /// Names, addresses, files or wires that do not go together, or what is wrong with a robot of a table or the control
    /// interface.
    pub fn from_args(args: &ServeArgs) -> Result<FleetConfig, ConfigError> {
        if args.robot.robots.is_none() && args.robot_tables.is_empty() && args.wires.is_empty() {
            let settings = Settings::from_args(args)?;
            return Ok(FleetConfig {
                // It has nothing in common with others, and a copy would cost each start.
                common: ServeArgs::default(),
                tables: Vec::new(),
                is_list: false,
                wires: Vec::new(),
                control: settings.control.clone(),
                settings: vec![OnceLock::from(Box::new(settings))],
            });
        }
        let mut common = args.clone();
        let tables = std::mem::take(&mut common.robot_tables);
        let wires = std::mem::take(&mut common.wires);
        let count = match (args.robot.robots, tables.len()) {
            (None, 0) => return Err(refused("[[wire]] joins robots: add tables [[robot]]")),
            (None, count) => count,
            (Some(_), 1..) => {
                return Err(refused(
                    "cannot use --robots together with [[robot]]: each table is a robot; remove --robots",
                ));
            }
            (Some(count), 0) => count as usize,
        };
        common.robot.robots = None;
        check_names(&tables)?;
        let mut fleet = FleetConfig {
            common,
            tables,
            is_list: true,
            settings: std::iter::repeat_with(OnceLock::new).take(count).collect(),
            wires: Vec::new(),
            control: None,
        };
        fleet.check_network()?;
        fleet.check_files()?;
        fleet.control = super::control_settings(&fleet.common)?;
        // Those that are only numbered differ in nothing that can be wrong.
        let checked = if fleet.tables.is_empty() { 1 } else { count };
        for index in 0..checked {
            let settings = fleet.settings(index);
            settings.map_err(|error| refused(format!("{}: {error}", fleet.name(index))))?;
        }
        for table in &wires {
            let wire = fleet.wire(table)?;
            // Two levels at one line would be no level.
            let is_driven = |other: &Wire| match &wire.to {
                WireEnd::Line { .. } => other.to == wire.to,
                WireEnd::Outside(_) => other.to == wire.to || other.from == wire.to,
            };
            if fleet.wires.iter().any(is_driven) {
                let reason = format!("to: another wire leads to `{}` or begins there", table.to);
                return Err(ConfigError::invalid(&table.origin, reason));
            }
            let is_outside = matches!(wire.from, WireEnd::Outside(_));
            if is_outside && fleet.wires.iter().any(|other| other.to == wire.from) {
                let reason = format!("from: another wire leads to `{}`", table.from);
                return Err(ConfigError::invalid(&table.origin, reason));
            }
            fleet.wires.push(wire);
        }
        fleet.check_times()?;
        Ok(fleet)
    }

    /// The settings of a robot that is not one of a list.
    pub fn only(&self) -> Option<&Settings> {
        self.settings(0).ok().filter(|_| !self.is_list)
    }

    /// Whether the robots are a list, even if it is one of a single robot.
    pub fn is_list(&self) -> bool {
        self.is_list
    }

    /// Names the robot in the lines of the log, if it is one of a list.
    pub fn span(&self, index: usize) -> Span {
        if !self.is_list {
            return Span::none();
        }
        error_span!("robot", robot = %self.name(index))
    }

    /// Number of robots.
    pub fn count(&self) -> usize {
        self.settings.len()
    }

    /// The name of a robot.
    pub fn name(&self, index: usize) -> String {
        let table = self.tables.get(index);
        table.map_or_else(|| numbered(index), |table| table.name.clone())
    }

    /// The robot of this name.
    pub fn index(&self, name: &str) -> Option<usize> {
        if !self.tables.is_empty() {
            return self.tables.iter().position(|table| table.name == name);
        }
        let number: usize = name.strip_prefix("robot-")?.parse().ok()?;
        let index = number.checked_sub(1).filter(|index| *index < self.count())?;
        (self.name(index) == name).then_some(index)
    }

    /// Where a robot of a list listens: at a place of its own, which its table names or its number decides.
    pub fn network(&self, index: usize) -> NetworkArgs {
        let table = self.tables.get(index);
        let table = table.map(|table| table.args.network.clone()).unwrap_or_default();
        let has_place = table.listen.is_some() || table.port_offset.is_some() || table.ports.is_some();
        let mut network = table.or_below(self.common.network.clone());
        if has_place {
            return network;
        }
        let number = u32::try_from(index).unwrap_or(u32::MAX);
        if let Some(step) = network.port_step {
            let offset = u32::from(network.port_offset.unwrap_or(0)) + u32::from(step) * number;
            network.port_offset = Some(u16::try_from(offset).unwrap_or(u16::MAX));
        } else if network.ports != Some(PortSource::Auto) {
            let first = network.listen.unwrap_or(Settings::LISTEN);
            network.listen = Some(address_after(first, number));
        }
        network
    }

    /// The arguments of one robot of a list.
    fn args(&self, index: usize) -> ServeArgs {
        let table = self.tables.get(index);
        let table = table.map(|table| table.args.clone()).unwrap_or_default();
        let mut args = table.with_fallback(self.common.clone());
        args.network = self.network(index);
        if self.tables.is_empty() && args.files.restore.is_none() {
            // Otherwise all robots would have the same luck.
            let number = index as u64;
            args.variation.fault_seed = Some(args.variation.fault_seed.unwrap_or(0).wrapping_add(number));
            args.variation.vary = args.variation.vary.map(|seed| seed.after(number));
        }
        // The process has it.
        args.control_interface = ControlArgs {
            control: Some(ControlChoice::Off),
            ..ControlArgs::default()
        };
        let name = self.name(index);
        for (_, path) in args.paths() {
            *path = with_name(path, &name);
        }
        args
    }

    /// The settings of one robot, made at its first use.
    ///
    /// # Errors
    /// See [`Settings::from_args`].
    pub fn settings(&self, index: usize) -> Result<&Settings, ConfigError> {
        let slot = self.settings.get(index);
        let slot = slot.ok_or_else(|| refused(format!("there is no {}", self.name(index))))?;
        if let Some(settings) = slot.get() {
            return Ok(settings);
        }
        let _named = self.span(index).entered();
        let args = self.args(index);
        let mut settings = Settings::from_args(&args)?;
        settings.control.clone_from(&self.control);
        let restored = self.restored_for_all();
        if restored.is_some() && args.files.restore.as_deref() == restored {
            settings.restored_as = Some(self.name(index));
        }
        // One file for all is written when the last has ended.
        if self.snapshot_of_all().is_some() {
            settings.files.snapshot_on_exit = None;
        }
        Ok(slot.get_or_init(|| Box::new(settings)))
    }

    /// The file for the last state of all robots, if one is asked for.
    pub fn snapshot_of_all(&self) -> Option<&Path> {
        let path = self.common.files.snapshot_on_exit.as_deref();
        path.filter(|path| self.is_list && is_of_all(path))
    }

    /// The file with the initial state of all robots, if there is one.
    pub fn restored_for_all(&self) -> Option<&Path> {
        let path = self.common.files.restore.as_deref();
        path.filter(|path| self.is_list && is_of_all(path))
    }

    /// The robot at an address, if each has its own.
    pub fn index_at(&self, address: IpAddr) -> Option<usize> {
        let number = match (self.common.network.listen.unwrap_or(Settings::LISTEN), address) {
            (IpAddr::V4(first), IpAddr::V4(address)) => {
                u128::from(u32::from(address).checked_sub(u32::from(first))?)
            }
            (IpAddr::V6(first), IpAddr::V6(address)) => u128::from(address).checked_sub(u128::from(first))?,
            _ => return None,
        };
        usize::try_from(number).ok().filter(|index| *index < self.count())
    }

    /// Whether each robot is at an address of its own, with the same ports.
    pub fn has_own_addresses(&self) -> bool {
        self.tables.is_empty()
            && self.common.network.port_step.is_none()
            && self.common.network.ports != Some(PortSource::Auto)
            && self.count() > 1
    }

    fn check_network(&self) -> Result<(), ConfigError> {
        let args = &self.common;
        let last = u32::try_from(self.count().saturating_sub(1)).unwrap_or(u32::MAX);
        if let Some(step) = args.network.port_step {
            if args.network.ports == Some(PortSource::Auto) {
                return Err(refused(
                    "cannot use --port-step with --ports auto: free ports need no distance",
                ));
            }
            let highest = 1_003 + u32::from(args.network.port_offset.unwrap_or(0)) + u32::from(step) * last;
            if step < 4 || highest > u32::from(u16::MAX) {
                let reason = format!(
                    "--port-step {step}: a robot has 4 ports, and those of the last would go up to {highest}; \
                     use a step of 4 or more, or drop --port-step if the ports do not suffice"
                );
                return Err(refused(reason));
            }
        }
        let listen = args.network.listen.unwrap_or(Settings::LISTEN);
        if self.has_own_addresses() && listen.is_unspecified() {
            return Err(refused(format!(
                "cannot give each robot an address from {listen} on: give the first with --listen, for example 127.0.0.2, \
                 or use --port-step 10 or --ports auto"
            )));
        }
        Ok(())
    }

    /// Refuses wires between robots whose time passes differently.
    fn check_times(&self) -> Result<(), ConfigError> {
        let ends = self.wires.iter().flat_map(|wire| [&wire.from, &wire.to]);
        let mut robots = ends.filter_map(WireEnd::robot);
        let Some(first) = robots.next() else {
            return Ok(());
        };
        let (name, settings) = (self.name(first), self.settings(first)?);
        for index in robots {
            let (other, its) = (self.name(index), self.settings(index)?);
            if its.time != settings.time {
                return Err(refused(format!(
                    "robots joined by wires need the same time: {name} has `{}`, {other} has `{}`",
                    settings.time, its.time
                )));
            }
            if its.time_gap != settings.time_gap {
                return Err(refused(format!(
                    "robots joined by wires need the same time-gap: {name} and {other} have different ones"
                )));
            }
        }
        Ok(())
    }

    /// Refuses a file that two robots would write.
    fn check_files(&self) -> Result<(), ConfigError> {
        let mut owners: BTreeMap<(String, PathBuf), String> = BTreeMap::new();
        // Those that are only numbered are all alike: the first two tell enough.
        let compared = if self.tables.is_empty() { 2 } else { usize::MAX };
        for index in 0..self.count().min(compared) {
            let (name, mut args) = (self.name(index), self.args(index));
            let own = args
                .paths()
                .filter(|(flag, _)| !flag.is(Mark::Shared) && !flag.is(Mark::Process));
            for (flag, path) in own {
                let key = flag.key();
                if let Some(other) = owners.insert((key.clone(), path.clone()), name.clone()) {
                    return Err(refused(format!(
                        "--{key} {}: {other} and {name} cannot use the same; put `{PLACEHOLDER}` in the path, which \
                         becomes the name of the robot",
                        path.display()
                    )));
                }
            }
        }
        Ok(())
    }

    fn wire(&self, table: &WireTable) -> Result<Wire, ConfigError> {
        let read = |key: &str, text: &str, side: IoKind| {
            self.wire_end(text, side)
                .map_err(|reason| ConfigError::invalid(&table.origin, format!("{key}: {reason}")))
        };
        let from = read("from", &table.from, IoKind::Output)?;
        let to = read("to", &table.to, IoKind::Input)?;
        if matches!((&from, &to), (WireEnd::Outside(_), WireEnd::Outside(_))) {
            return Err(ConfigError::invalid(
                &table.origin,
                "both ends are outside: join at least one robot",
            ));
        }
        let name = format!("{} to {}", table.from, table.to);
        Ok(Wire { from, to, name })
    }

    /// Reads `ROBOT.dout.LINE`, `ROBOT.din.LINE` or `outside.NAME`.
    fn wire_end(&self, text: &str, side: IoKind) -> Result<WireEnd, WireEndError> {
        let word = match side {
            IoKind::Input => "din",
            IoKind::Output => "dout",
        };
        let expected = || UnexpectedWord::new(format!("ROBOT.{word}.LINE or {OUTSIDE}.NAME"), text);
        let (name, rest) = text.split_once('.').ok_or_else(expected)?;
        if name == OUTSIDE {
            check_name(rest)?;
            return Ok(WireEnd::Outside(rest.to_owned()));
        }
        let robot = self.index(name).ok_or_else(|| {
            let names: Vec<String> = (0..self.count()).map(|index| self.name(index)).collect();
            WireEndError::Robot(
                name.to_owned(),
                did_you_mean(name, names.iter().map(String::as_str)),
            )
        })?;
        let line = rest
            .strip_prefix(word)
            .and_then(|rest| rest.strip_prefix('.'))
            .ok_or_else(expected)?;
        let line: u16 = line.parse().map_err(|_| expected())?;
        if !Signals::exists(line) {
            return Err(WireEndError::Line(line));
        }
        Ok(WireEnd::Line { robot, line })
    }
}

/// The files of `--junit`, where the robots go together and where they do not.
pub fn junit_files(args: &ServeArgs) -> BTreeSet<PathBuf> {
    let common = args.scenario.junit.as_deref();
    let tables = args.robot_tables.iter().filter_map(|table| {
        let path = table.args.scenario.junit.as_deref().or(common)?;
        // Another name may lead to any directory.
        check_name(&table.name).ok()?;
        Some(with_name(path, &table.name))
    });
    match (common, args.robot.robots) {
        _ if !args.robot_tables.is_empty() => tables.collect(),
        (Some(path), Some(count)) => (0..count as usize)
            .map(|index| with_name(path, &numbered(index)))
            .collect(),
        (path, _) => path.map(Path::to_owned).into_iter().collect(),
    }
}

/// The name of a robot without a table.
fn numbered(index: usize) -> String {
    format!("robot-{}", index + 1)
}

fn with_name(path: &Path, name: &str) -> PathBuf {
    // A path that is no Unicode has no placeholder that could be meant.
    path.to_str()
        .map_or_else(|| path.to_owned(), |text| text.replace(PLACEHOLDER, name).into())
}

/// Whether a file is one for all robots: its path does not have the name of each.
pub fn is_of_all(path: &Path) -> bool {
    !path.to_string_lossy().contains(PLACEHOLDER)
}

fn check_names(tables: &[RobotTable]) -> Result<(), ConfigError> {
    for (index, RobotTable { name, .. }) in tables.iter().enumerate() {
        check_name(name).map_err(|reason| refused(format!("[[robot]] {}: name: {reason}", index + 1)))?;
        if name == OUTSIDE {
            return Err(refused(format!(
                "`{OUTSIDE}` is reserved for lines outside the robots; choose another name"
            )));
        }
        if tables.iter().take(index).any(|other| other.name == *name) {
            return Err(refused(format!("two [[robot]] have the name `{name}`")));
        }
    }
    Ok(())
}

/// Error in an end of a wire.
#[derive(Debug, thiserror::Error)]
enum WireEndError {
    #[error(transparent)]
    Form(#[from] UnexpectedWord),
    #[error("unknown robot `{0}`{1}")]
    Robot(String, String),
    #[error("unknown line `{0}`: expected {LINE_NUMBERS}")]
    Line(u16),
}

fn check_name(name: &str) -> Result<(), UnexpectedWord> {
    let is_fitting = |letter: u8| letter.is_ascii_alphanumeric() || b"-_".contains(&letter);
    if (1..=MAX_NAME).contains(&name.len()) && name.bytes().all(is_fitting) {
        return Ok(());
    }
    Err(UnexpectedWord::new(
        format!("1 to {MAX_NAME} letters, digits, `-` or `_`"),
        name,
    ))
}

/// The address at an offset from another.
fn address_after(first: IpAddr, number: u32) -> IpAddr {
    match first {
        IpAddr::V4(first) => IpAddr::V4(u32::from(first).wrapping_add(number).into()),
        IpAddr::V6(first) => IpAddr::V6(u128::from(first).wrapping_add(number.into()).into()),
    }
}
