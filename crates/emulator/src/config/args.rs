//! The flags of `serve`. The same definition reads the environment variables and the keys of the TOML file (see
//! [`super::read`]), so each setting has one name and one set of values.
//!
//! Every field is optional: which layer wins is decided by `with_fallback`, and defaults are applied afterwards in
//! [`super::Settings::from_args`]. The doc comments are the help texts.

use super::device::serial_device;
use super::flag_group::{self, Flag, FlagGroup, Mark, flag_group};
use super::model::ModelChoice;
use super::report_args::ReportArgs;
use super::seed::Seed;
use clap::builder::{
    EnumValueParser, PathBufValueParser, PossibleValue, PossibleValuesParser, TypedValueParser,
};
use clap::error::ErrorKind;
use clap::{Arg, Args, Command, ValueEnum};
use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::fmt;
use std::net::{IpAddr, SocketAddr, TcpListener, ToSocketAddrs as _};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;
use ts3100_control::ControlChoice;
use ts3100_controller::signals::LINE_NUMBERS;
use ts3100_controller::time::{DurationError, duration_in_words, parse_duration, parse_duration_in};
use ts3100_controller::{ControlRight, ControllerType, Dialect, KeySwitch};
use ts3100_driver::clock::{TimeGap, TimeMode};
use ts3100_driver::tcp::Ports;
use ts3100_proto::words::{UnexpectedWord, Word};
use ts3100_recording::program_test::ENDING;

/// Start an emulated controller and serve its ports until Ctrl-C.
///
/// Every flag is also an environment variable and a key of the TOML file given by --config: --port-offset 10000,
/// TS3100_PORT_OFFSET=10000 and `port-offset = 10000` are the same. Flags override the environment, which overrides
/// the file. SIGTERM and SIGQUIT end it as Ctrl-C does.
///
/// Exit codes: 0 ended by a signal; 2 cannot start or cannot write a report; 3 a denied finding or fault; 4 coverage
/// below --min-coverage; 5 the scenario failed.
#[derive(Debug, Clone, Default, Args)]
pub struct ServeArgs {
    /// Where the robot listens.
    #[command(flatten)]
    pub network: NetworkArgs,
    /// The control interface.
    #[command(flatten)]
    pub control_interface: ControlArgs,
    /// The serial ports.
    #[command(flatten)]
    pub serial: SerialArgs,
    /// The robot itself.
    #[command(flatten)]
    pub robot: RobotArgs,
    /// What is on its drive, and where its state comes from.
    #[command(flatten)]
    pub files: FileArgs,
    /// How time passes.
    #[command(flatten)]
    pub clock: ClockArgs,
    /// What goes wrong or differs on purpose.
    #[command(flatten)]
    pub variation: FaultArgs,
    /// The scenario that is played.
    #[command(flatten)]
    pub scenario: ScenarioArgs,
    /// Reports of the run.
    #[command(flatten)]
    pub reports: ReportArgs,
    /// The log.
    #[command(flatten)]
    pub log: LogArgs,
    /// The tables `[[robot]]` of the file.
    #[arg(skip)]
    pub robot_tables: Vec<RobotTable>,
    /// The tables `[[wire]]` of the file.
    #[arg(skip)]
    pub wires: Vec<WireTable>,
    /// Where the file has values that are refused only when they are used.
    #[arg(skip)]
    pub places: Places,
}

/// Places in a configuration file by their keys.
pub type Places = BTreeMap<&'static str, String>;

flag_group! {
    /// Where the robot listens.
    #[command(next_help_heading = "Network")]
    pub struct NetworkArgs {
        /// Listen on this address or host name of this computer, for example localhost [default: 127.0.0.1]
        #[arg(long, value_name = "ADDR", value_parser = listen_address)]
        pub listen: Option<IpAddr>,
        /// Add N to the port numbers: 10000 makes 1000-1003 into 11000-11003 [default: 0]
        #[arg(long, value_name = "N", value_parser = whole(0, u16::MAX))]
        pub port_offset: Option<u16>,
        /// Take the port numbers from ETHERNET.PAR, or let the system choose free ones [default: parameter]
        #[arg(long, value_name = "WORD", value_parser = PortSourceParser)]
        pub ports: Option<PortSource>,
        /// With --robots: put all robots at one address, each N ports above the previous one [default: one address per robot]
        #[arg(long, value_name = "N", value_parser = whole(0, u16::MAX))]
        pub port_step: Option<u16> [Process],
        /// Print one line of JSON on stdout when every port accepts connections
        #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true",
            value_parser = switch())]
        pub ready_json: Option<bool> [Process],
    }
}

flag_group! {
    /// The control interface.
    #[command(next_help_heading = "Control interface")]
    pub struct ControlArgs {
        /// Serve the HTTP control interface at ADDRESS:PORT or at this port of 127.0.0.1, or `off` [default: 3100 plus
        /// the offset; a free port with --ports auto; with a token or --control-open at the address of --listen]
        #[arg(long, value_name = "WHERE")]
        pub control: Option<ControlChoice> [Process],
        /// Require this bearer token; required unless it listens on loopback. Visible in the process list: prefer
        /// TS3100_CONTROL_TOKEN or --control-token-file
        #[arg(long, value_name = "TOKEN")]
        pub control_token: Option<String> [Process],
        /// Read the token from the first line of FILE
        #[arg(long, value_name = "FILE")]
        pub control_token_file: Option<PathBuf> [Process],
        /// Accept every call without a token, for throw-away networks only: anyone who can reach the interface controls
        /// the robot
        #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true",
            value_parser = switch())]
        pub control_open: Option<bool> [Process],
        /// Also accept calls addressed to this host name, besides localhost and the listening address
        #[arg(long, value_name = "NAME", num_args = 1..)]
        pub control_host: Vec<String> [Process],
        /// Let pages of this origin show the page in a frame, for example vscode-webview: for an editor; without it, no
        /// page may
        #[arg(long, value_name = "ORIGIN", num_args = 1..)]
        pub control_frame_ancestor: Vec<String> [Process],
    }
}

flag_group! {
    /// The serial ports.
    #[command(next_help_heading = "Serial")]
    pub struct SerialArgs {
        /// Create the serial ports as pseudo terminals: the links `host` and `com1` in DIR
        #[arg(long, value_name = "DIR")]
        pub serial_dir: Option<PathBuf>,
        /// Serve HOST on this serial port of the computer, for example /dev/ttyUSB0 or COM3
        #[arg(long, value_name = "PORT", value_parser = serial_device())]
        pub serial_host: Option<PathBuf> [Device],
        /// Serve HOST by RFC 2217 at ADDRESS:PORT or at this port; 0 chooses a free one
        #[arg(long, value_name = "ADDR")]
        pub serial_host_rfc2217: Option<ListenAt>,
        /// Serve HOST as raw TCP at ADDRESS:PORT or at this port; 0 chooses a free one
        #[arg(long, value_name = "ADDR")]
        pub serial_host_tcp: Option<ListenAt>,
        /// Serve COM1 on this serial port of the computer
        #[arg(long, value_name = "PORT", value_parser = serial_device())]
        pub serial_com1: Option<PathBuf> [Device],
        /// Serve COM1 by RFC 2217 at ADDRESS:PORT or at this port
        #[arg(long, value_name = "ADDR")]
        pub serial_com1_rfc2217: Option<ListenAt>,
        /// Serve COM1 as raw TCP at ADDRESS:PORT or at this port
        #[arg(long, value_name = "ADDR")]
        pub serial_com1_tcp: Option<ListenAt>,
    }
}

flag_group! {
    /// The robot itself.
    #[command(next_help_heading = "Robot")]
    pub struct RobotArgs {
        /// Run this many robots in this process: robot-1, robot-2, ... at the address of --listen and the
        /// addresses after it; `{robot}` in a path becomes the robot's name
        #[arg(long, value_name = "N", value_parser = whole(1, MAX_ROBOTS))]
        pub robots: Option<u32> [Process],
        /// Arm: ts3100-tv800, tsl3000-thl400, tsl3000-thl400-4, tsl3000-thl300, scara-600, or the .toml file of a model
        /// of your own [default: ts3100-tv800]
        #[arg(long, value_name = "MODEL")]
        pub model: Option<ModelChoice> [Shared],
        /// Controller type [default: ts3100]
        #[arg(long, value_name = "TYPE", value_parser = described(CONTROLLERS))]
        pub controller: Option<ControllerType>,
        /// Position of the key switch [default: ext]
        #[arg(long, value_name = "POSITION", value_parser = word::<KeySwitch>())]
        pub key_switch: Option<KeySwitch>,
        /// Who commands the robot in EXT [default: ether]
        #[arg(long, value_name = "WHO", value_parser = word::<ControlRight>())]
        pub control_right: Option<ControlRight>,
        /// Start with servo power on
        #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true",
            value_parser = switch())]
        pub servo_on: Option<bool>,
        /// Preset of the named options [default: field]
        #[arg(long, value_name = "DIALECT", value_parser = described(DIALECTS))]
        pub dialect: Option<Dialect>,
        /// Override a named option, for example text.stx=required; `--set help` lists them (repeatable)
        #[arg(long, value_name = "KEY=VALUE")]
        pub set: Vec<String> [NotInFile],
        /// Answer like the controller that this file of `ts3100 survey` describes: options, arm and answer times
        #[arg(long, value_name = "FILE")]
        pub like: Option<PathBuf> [Shared],
        /// Use these permission tables instead of those of the manual
        #[arg(long, value_name = "FILE")]
        pub permissions: Option<PathBuf> [Shared],
    }
}

flag_group! {
    /// What is on its drive, and where its state comes from.
    #[command(next_help_heading = "Programs and files")]
    pub struct FileArgs {
        /// Keep the files of the RAM drive in this directory [default: memory only]
        #[arg(long, value_name = "DIR")]
        pub drive: Option<PathBuf>,
        /// Put files on the RAM drive; pick.scol becomes PICK, demo and dialog are the examples
        #[arg(long, value_name = "FILE", num_args = 1..)]
        pub load: Vec<PathBuf> [Shared],
        /// Select this file of the RAM drive
        #[arg(long, value_name = "NAME")]
        pub select: Option<String>,
        /// Points taught on the controller: a CSV file of NAME,X,Y,Z,C,T,CONFIG (six axes:
        /// NAME,X,Y,Z,A,B,C,U,V,CONFIG)
        #[arg(long, value_name = "FILE")]
        pub points: Option<PathBuf> [Shared],
        /// Start from this snapshot; options, arm, files and selection come from it
        #[arg(long, value_name = "FILE")]
        pub restore: Option<PathBuf> [Shared],
        /// Write a snapshot when the emulator ends
        #[arg(long, value_name = "FILE")]
        pub snapshot_on_exit: Option<PathBuf> [Process],
        /// Read these settings from a TOML file; named options go in its table `options`
        #[arg(long, value_name = "FILE")]
        pub config: Option<PathBuf> [Process, NotInFile],
    }
}

flag_group! {
    /// How time passes.
    #[command(next_help_heading = "Time")]
    pub struct ClockArgs {
        /// How time passes: real, x10 (any factor), stepped, auto [default: real]
        #[arg(long, value_name = "MODE")]
        pub time: Option<TimeMode>,
        /// After a stop of the process (SIGSTOP, a sleeping computer): catch up with the missed time, or skip it
        /// [default: catch-up]
        #[arg(long, value_name = "WORD", value_parser = described(TIME_GAPS))]
        pub time_gap: Option<TimeGap>,
    }
}

flag_group! {
    /// What goes wrong or differs on purpose.
    #[command(next_help_heading = "Faults and variation")]
    pub struct FaultArgs {
        /// Inject a fault, KIND:key=value,...; `ts3100 faults list` shows the kinds (repeatable)
        #[arg(long, value_name = "SPEC")]
        pub fault: Vec<String> [Semicolons],
        /// Inject the faults of a TOML file, one table `[[fault]]` each
        #[arg(long, value_name = "FILE")]
        pub faults: Option<PathBuf> [Shared],
        /// Seed of the random choices of faults [default: 0]
        #[arg(long, value_name = "N", value_parser = whole(0, u64::MAX))]
        pub fault_seed: Option<u64>,
        /// Vary what the manual leaves open: a seed, `random` (drawn and printed), or `off` [default: off]
        #[arg(long, value_name = "SEED")]
        pub vary: Option<Seed>,
    }
}

flag_group! {
    /// The scenario that is played.
    #[command(next_help_heading = "Scenario")]
    pub struct ScenarioArgs {
        /// Play this scenario; exit code 5 if it fails
        #[arg(long, value_name = "FILE")]
        pub scenario: Option<PathBuf> [Shared],
        /// Write the results of the scenario as JUnit XML
        #[arg(long, value_name = "FILE", value_parser = written_file())]
        pub junit: Option<PathBuf>,
    }
}

flag_group! {
    /// The log.
    #[command(next_help_heading = "Logging")]
    pub struct LogArgs {
        /// Log every text; twice: every byte
        #[arg(long, short, action = clap::ArgAction::Count)]
        pub verbose: u8 [Process],
        /// Format of the log on stderr [default: text]
        #[arg(long, value_name = "FORMAT")]
        pub log_format: Option<LogFormat> [Process],
    }
}

/// A table `[[robot]]`: its name, and what it says of that robot.
#[derive(Debug, Clone, Default)]
pub struct RobotTable {
    /// Its name.
    pub name: String,
    /// What is not that of all robots.
    pub args: ServeArgs,
}

/// A table `[[wire]]`: its ends as written, and its place.
#[derive(Debug, Clone, Default)]
pub struct WireTable {
    /// File and number of the table.
    pub origin: String,
    /// Where its level comes from.
    pub from: String,
    /// What shows it.
    pub to: String,
}

impl NetworkArgs {
    /// Where the port numbers come from: ETHERNET.PAR and an offset, or the system.
    pub fn tcp_ports(&self) -> Ports {
        match self.ports {
            Some(PortSource::Auto) => Ports::Auto,
            Some(PortSource::Parameter) | None => Ports::Offset(self.port_offset.unwrap_or(0)),
        }
    }
}

impl ServeArgs {
    /// These arguments; those not given are taken from the layer below. Named options and faults of the layer below come
    /// first, so that a later option of the same name wins.
    #[must_use]
    pub fn with_fallback(mut self, mut below: ServeArgs) -> ServeArgs {
        below.robot.set.append(&mut self.robot.set);
        below.variation.fault.append(&mut self.variation.fault);
        below.robot_tables.append(&mut self.robot_tables);
        below.wires.append(&mut self.wires);
        for (key, is_given) in [
            ("load", !self.files.load.is_empty()),
            ("select", self.files.select.is_some()),
            ("model", self.robot.model.is_some()),
        ] {
            if is_given {
                below.places.remove(key);
            }
        }
        below.places.append(&mut self.places);
        ServeArgs {
            network: self.network.or_below(below.network),
            control_interface: self.control_interface.or_below(below.control_interface),
            serial: self.serial.or_below(below.serial),
            robot: self.robot.or_below(below.robot),
            files: self.files.or_below(below.files),
            clock: self.clock.or_below(below.clock),
            variation: self.variation.or_below(below.variation),
            scenario: self.scenario.or_below(below.scenario),
            reports: self.reports.or_below(below.reports),
            log: self.log.or_below(below.log),
            robot_tables: below.robot_tables,
            wires: below.wires,
            places: below.places,
        }
    }

    /// Reads a command line by the definitions of those groups whose flags it has.
    ///
    /// # Errors
    pub fn from_words(words: &[OsString]) -> Result<ServeArgs, clap::Error> {
        let mut args = ServeArgs::default();
        flag_group::read(words, args.groups())?;
        Ok(args)
    }

    /// Every flag, in the order of the help.
    pub fn flags() -> impl Iterator<Item = &'static Flag> {
        let mut args = ServeArgs::default();
        args.groups().map(|group| group.flags()).into_iter().flatten()
    }

    /// The flags that are keys of the file.
    pub fn keys_of_file() -> impl Iterator<Item = &'static Flag> {
        ServeArgs::flags().filter(|flag| !flag.is(Mark::NotInFile))
    }

    /// The flags that are keys of a table `[[robot]]`.
    pub fn keys_of_robot() -> impl Iterator<Item = &'static Flag> {
        ServeArgs::keys_of_file().filter(|flag| !flag.is(Mark::Process))
    }

    /// The flags that name files or devices, with each of them.
    pub fn paths(&mut self) -> impl Iterator<Item = (&'static Flag, &mut PathBuf)> {
        self.groups().into_iter().flat_map(FlagGroup::paths)
    }

    /// Makes files relative to the directory of the file that names them.
    pub fn resolve(&mut self, file: &Path) {
        for group in self.groups() {
            group.resolve(file);
        }
    }

    fn groups(&mut self) -> [&mut dyn FlagGroup; 10] {
        [
            &mut self.network,
            &mut self.control_interface,
            &mut self.serial,
            &mut self.robot,
            &mut self.files,
            &mut self.clock,
            &mut self.variation,
            &mut self.scenario,
            &mut self.reports,
            &mut self.log,
        ]
    }
}

/// Most robots of a process.
const MAX_ROBOTS: u32 = 65_536;

/// Largest bound that a message names; the end of a larger range is that of a type.
const LARGEST_BOUND: u64 = 1_000_000;

/// Reads a whole number between these two.
pub fn whole<T>(
    least: T,
    most: T,
) -> impl Fn(&str) -> Result<T, UnexpectedWord> + Clone + Send + Sync + 'static
where
    T: Copy + fmt::Display + FromStr + PartialOrd + Into<u64> + Send + Sync + 'static,
{
    move |word| {
        let number = word.parse().ok().filter(|number| (least..=most).contains(number));
        number.ok_or_else(|| {
            let expected = match most.into() > LARGEST_BOUND {
                true => format!("a whole number, at least {least}"),
                false => format!("a whole number from {least} to {most}"),
            };
            UnexpectedWord::new(expected, word)
        })
    }
}

/// Reads the name of a file to write. `-` would become a file of this name, where other programs mean stdout; a program and its
/// tests are what somebody has written.
pub(crate) fn written_file() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| {
        if path == Path::new("-") {
            return Err("this report has to be a file; ./- is a file of this name");
        }
        let name = path.to_string_lossy().to_ascii_lowercase();
        if name.ends_with(".scol") || name.ends_with(ENDING) {
            return Err("the report would replace a program or its tests; give it another ending");
        }
        Ok(path)
    })
}

/// Reads the number of an input or output.
pub(crate) fn line_number(word: &str) -> Result<u16, UnexpectedWord> {
    let expected = || UnexpectedWord::new(format!("a line, {LINE_NUMBERS}"), word);
    word.parse().map_err(|_| expected())
}

/// Reads a number.
pub fn number(word: &str) -> Result<f64, UnexpectedWord> {
    word.parse().map_err(|_| UnexpectedWord::new("a number", word))
}

/// Reads the value of `--listen`: an address, or a name that resolves to one of this computer. IPv4 is preferred, because
/// the default is 127.0.0.1 and hosts of that robot speak IPv4.
pub(crate) fn listen_address(word: &str) -> Result<IpAddr, UnexpectedWord> {
    const EXPECTED: &str = "an address of this computer, or a name that resolves to one";
    if let Ok(address) = word.parse() {
        return Ok(address);
    }
    let unexpected = || UnexpectedWord::new(EXPECTED, word);
    // A port would be taken for a part of the name.
    if word.is_empty() || word.contains(':') {
        return Err(unexpected());
    }
    let found = (word, 0).to_socket_addrs().map_err(|_| unexpected())?;
    let mut found: Vec<SocketAddr> = found.collect();
    found.sort_by_key(SocketAddr::is_ipv6);
    let own = |address: &SocketAddr| TcpListener::bind(address).is_ok();
    found
        .iter()
        .find(|address| own(address))
        .map(SocketAddr::ip)
        .ok_or_else(unexpected)
}

/// `ADDRESS:PORT`, or a port alone on the address of `--listen`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ListenAt {
    /// Address and port.
    Address(SocketAddr),
    /// The port on the address of `--listen`; 0 for a free one.
    Port(u16),
}

impl FromStr for ListenAt {
    type Err = UnexpectedWord;

    fn from_str(word: &str) -> Result<ListenAt, UnexpectedWord> {
        const EXPECTED: &str =
            "ADDRESS:PORT (for example 0.0.0.0:2217) or a port (2217, :2217; 0 for a free one)";
        let port = word.strip_prefix(':').unwrap_or(word);
        let address = word.parse().map(ListenAt::Address);
        let at = port.parse().map(ListenAt::Port).or(address);
        at.map_err(|_| UnexpectedWord::new(EXPECTED, word))
    }
}

/// Where port numbers come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PortSource {
    /// ETHERNET.PAR, plus the offset.
    Parameter,
    /// Free ports, chosen by the system.
    Auto,
}

/// Reads `true` or `false`; variables of containers often have 1 and 0 instead.
fn switch() -> impl TypedValueParser<Value = bool> {
    let words = [
        PossibleValue::new("true").alias("1"),
        PossibleValue::new("false").alias("0"),
    ];
    PossibleValuesParser::new(words).map(|word| ["true", "1"].contains(&word.as_str()))
}

/// Reads [`PortSource`]. A number is what users take for the first port; that is another flag.
#[derive(Debug, Clone, Copy)]
pub struct PortSourceParser;

impl TypedValueParser for PortSourceParser {
    type Value = PortSource;

    fn parse_ref(
        &self,
        command: &Command,
        flag: Option<&Arg>,
        value: &OsStr,
    ) -> Result<PortSource, clap::Error> {
        let number = value.to_str().and_then(|word| word.parse::<u16>().ok());
        let Some(number) = number else {
            return EnumValueParser::<PortSource>::new().parse_ref(command, flag, value);
        };
        let offset = match number.checked_sub(FIRST_PORT) {
            Some(offset) => format!("--port-offset {offset} makes {number} the first port"),
            None => format!("--port-offset is added to {FIRST_PORT}-1003"),
        };
        let message = format!("--ports takes the word `parameter` or `auto`, not a number; {offset}\n");
        Err(clap::Error::raw(ErrorKind::ValueValidation, message).with_cmd(command))
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let words = PortSource::value_variants().iter();
        Some(Box::new(words.filter_map(ValueEnum::to_possible_value)))
    }
}

/// Port of IP0 of a controller as delivered (ETH-05).
pub(crate) const FIRST_PORT: u16 = 1_000;

/// Reads a duration with its unit, between these two.
pub fn duration(
    least: &'static str,
    most: &'static str,
) -> impl Fn(&str) -> Result<Duration, DurationArgError> + Clone + Send + Sync + 'static {
    move |text| within(parse_duration(text)?, least, most, text)
}

/// Reads a duration between these two; a number without a unit is seconds.
pub fn seconds(
    least: &'static str,
    most: &'static str,
) -> impl Fn(&str) -> Result<Duration, DurationArgError> + Clone + Send + Sync + 'static {
    move |text| within(parse_duration_in("s", text)?, least, most, text)
}

fn within(time: Duration, least: &str, most: &str, text: &str) -> Result<Duration, DurationArgError> {
    let (least, most) = (parse_duration(least)?, parse_duration(most)?);
    let outside = || {
        let (least, most) = (duration_in_words(least), duration_in_words(most));
        UnexpectedWord::new(format!("a duration from {least} to {most}"), text)
    };
    let inside = Some(time).filter(|time| (least..=most).contains(time));
    Ok(inside.ok_or_else(outside)?)
}

/// A duration of the command line that is not accepted.
#[derive(Debug, thiserror::Error)]
pub enum DurationArgError {
    /// It is not a duration.
    #[error(transparent)]
    Form(#[from] DurationError),
    /// It is too long or too short.
    #[error(transparent)]
    Range(#[from] UnexpectedWord),
}

/// Reads the word of a value, and names all words in the help.
pub fn word<T: Word + Send + Sync>() -> impl TypedValueParser<Value = T> {
    let words = PossibleValuesParser::new(T::ALL.iter().map(|value| value.word()));
    words.try_map(|word| T::from_word(&word).ok_or("expected a word of the list"))
}

/// A word, its meaning, and its line in the help.
pub type DescribedWord<T> = (&'static str, T, &'static str);

/// The presets of the named options.
pub const DIALECTS: &[DescribedWord<Dialect>] = &[
    (
        "field",
        Dialect::Field,
        "The manual, and what real host programs need in addition",
    ),
    ("manual", Dialect::Manual, "Strictly as the manual says"),
];
/// The controller types.
pub const CONTROLLERS: &[DescribedWord<ControllerType>] = &[
    (
        "ts3100",
        ControllerType::Ts3100,
        "Key switch TEACHING, INTERNAL, EXT",
    ),
    ("tsl3100", ControllerType::Tsl3100, "Key switch TEACHING, EXT"),
    (
        "tsl3000e",
        ControllerType::Tsl3000e,
        "Like tsl3100; every third servo-on comes 7 s late (option servo.interval)",
    ),
];
/// Treatment of wall-clock time in which the process was stopped.
const TIME_GAPS: &[DescribedWord<TimeGap>] = &[
    (
        "catch-up",
        TimeGap::CatchUp,
        "Virtual time includes the stop; everything that became due happens at once",
    ),
    ("skip", TimeGap::Skip, "Virtual time continues from where it was"),
];

/// Reads one of these words, and describes them in the help.
pub fn described<T: Copy + Send + Sync>(
    words: &'static [DescribedWord<T>],
) -> impl TypedValueParser<Value = T> {
    let shown = words
        .iter()
        .map(|(word, _, help)| PossibleValue::new(*word).help(*help));
    PossibleValuesParser::new(shown).try_map(|word| {
        let found = words.iter().find(|(known, _, _)| *known == word);
        found
            .map(|(_, meaning, _)| *meaning)
            .ok_or("expected a word of the list")
    })
}

/// Form of the log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum LogFormat {
    /// For people.
    #[default]
    Text,
    /// One JSON object a line.
    Json,
}
