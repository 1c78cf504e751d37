//! The flags of `serve`. The same definition reads the environment variables and the keys of the TOML file (see
//! [`super::read`]), so each setting has one name and one set of values.
//!
//! Every field is optional: which layer wins is decided by `with_fallback`, and defaults are applied afterwards in
//! [`super::Settings::from_args`]. The doc comments are the help texts.

use super::device::serial_device;
use super::model::ModelChoice;
use super::report_args::{ReportArgs, first_non_empty};
use super::seed::Seed;
use clap::builder::{EnumValueParser, PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::error::ErrorKind;
use clap::{Arg, Args, Command, ValueEnum};
use std::ffi::OsStr;
use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;
use std::str::FromStr;
use ts3100_control::ControlChoice;
use ts3100_controller::options::{ControllerType, Dialect};
use ts3100_controller::{ControlRight, KeySwitch};
use ts3100_driver::clock::{TimeGap, TimeMode};
use ts3100_driver::tcp::Ports;
use ts3100_proto::words::{UnexpectedWord, Word};
use ts3100_recording::transcript::TranscriptFile;

/// Starts the controller and serves its ports until Ctrl-C or SIGTERM.
///
/// Every flag is also an environment variable (--port-offset is TS3100_PORT_OFFSET) and a key of the TOML
/// file given by --config (port-offset = 10000). Flags win over environment, environment over file, file
/// over defaults. Exit code: 0 ended by a signal, 2 could not start or write a report, 3 a denied finding (or fault), 4
/// the coverage is below --min-coverage, 5 an expectation of the scenario was not met.
#[derive(Debug, Clone, Default, Args)]
pub struct ServeArgs {
    /// Address to listen on [default: 127.0.0.1]
    #[arg(long, value_name = "ADDR")]
    pub listen: Option<IpAddr>,
    /// Added to the ports of ETHERNET.PAR (1000-1003 on a fresh drive) [default: 0]
    #[arg(long, value_name = "N", value_parser = port_offset)]
    pub port_offset: Option<u16>,
    /// Where port numbers come from: ETHERNET.PAR, or free ones chosen by the system [default: parameter]
    #[arg(long, value_name = "WORD", value_parser = PortSourceParser)]
    pub ports: Option<PortSource>,
    /// Control interface over HTTP: ADDRESS:PORT, a port of 127.0.0.1, or off [default: 3100 and the offset; a free
    /// port with --ports auto]
    #[arg(long, value_name = "WHERE")]
    pub control: Option<ControlChoice>,
    /// Bearer token of the control interface; needed when others than this machine can reach it. Others on this machine
    /// see it in the list of processes: rather TS3100_CONTROL_TOKEN, or a file
    #[arg(long, value_name = "TOKEN")]
    pub control_token: Option<String>,
    /// File with the token in its first line
    #[arg(long, value_name = "FILE")]
    pub control_token_file: Option<PathBuf>,
    /// No token needed: whoever reaches the control interface may use it. For throw-away networks only
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true",
        value_parser = switch())]
    pub control_open: Option<bool>,
    /// Names by which the control interface is called, besides localhost and the address dialled
    #[arg(long, value_name = "NAME", num_args = 1..)]
    pub control_host: Vec<String>,
    /// Directory for the serial ports as pseudo terminals: links `host` and `com1`
    #[arg(long, value_name = "DIR")]
    pub serial_dir: Option<PathBuf>,
    /// HOST is this real port, for example /dev/ttyUSB0 or COM3
    #[arg(long, value_name = "PORT", value_parser = serial_device())]
    pub serial_host: Option<PathBuf>,
    /// HOST is served by RFC 2217 here: ADDRESS:PORT, or a port (0: a free one)
    #[arg(long, value_name = "ADDR")]
    pub serial_host_rfc2217: Option<ListenAt>,
    /// HOST is served as bare bytes over TCP here
    #[arg(long, value_name = "ADDR")]
    pub serial_host_tcp: Option<ListenAt>,
    /// COM1 is this real port
    #[arg(long, value_name = "PORT", value_parser = serial_device())]
    pub serial_com1: Option<PathBuf>,
    /// COM1 is served by RFC 2217 here
    #[arg(long, value_name = "ADDR")]
    pub serial_com1_rfc2217: Option<ListenAt>,
    /// COM1 is served as bare bytes over TCP here
    #[arg(long, value_name = "ADDR")]
    pub serial_com1_tcp: Option<ListenAt>,
    /// Print one line of JSON on stdout once every port accepts
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true",
        value_parser = switch())]
    pub ready_json: Option<bool>,
    /// Directory that keeps the files of the RAM drive [default: memory only]
    #[arg(long, value_name = "DIR")]
    pub drive: Option<PathBuf>,
    /// Files to put on the RAM drive; pick.scol becomes PICK
    #[arg(long, value_name = "FILE", num_args = 1..)]
    pub load: Vec<PathBuf>,
    /// File of the RAM drive to select
    #[arg(long, value_name = "NAME")]
    pub select: Option<String>,
    /// Begin with this snapshot: options, arm, files, selection and everything else are its own
    #[arg(long, value_name = "FILE")]
    pub restore: Option<PathBuf>,
    /// Write a snapshot when the emulator ends
    #[arg(long, value_name = "FILE")]
    pub snapshot_on_exit: Option<PathBuf>,
    /// Play this scenario; exit code 5 if it fails
    #[arg(long, value_name = "FILE")]
    pub scenario: Option<PathBuf>,
    /// Write the results of the scenario as JUnit XML
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
    /// Servo power on at the start
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true",
        value_parser = switch())]
    pub servo_on: Option<bool>,
    /// Key switch [default: ext]
    #[arg(long, value_name = "POSITION", value_parser = word::<KeySwitch>())]
    pub key_switch: Option<KeySwitch>,
    /// Who commands the robot in EXT [default: ether]
    #[arg(long, value_name = "WHO", value_parser = word::<ControlRight>())]
    pub control_right: Option<ControlRight>,
    /// Preset of the named options [default: field]
    #[arg(long, value_name = "DIALECT", value_parser = described(DIALECTS))]
    pub dialect: Option<Dialect>,
    /// Arm: ts3100-tv800, tsl3000-thl400, tsl3000-thl400-4, or a model of your own, a .toml file [default: ts3100-tv800]
    #[arg(long, value_name = "MODEL")]
    pub model: Option<ModelChoice>,
    /// Points taught on the controller, a CSV file of NAME,X,Y,Z,C,T,CONFIG (six axes: NAME,X,Y,Z,A,B,C,U,V,CONFIG)
    #[arg(long, value_name = "FILE")]
    pub points: Option<PathBuf>,
    /// Controller type [default: ts3100]
    #[arg(long, value_name = "TYPE", value_parser = described(CONTROLLERS))]
    pub controller: Option<ControllerType>,
    /// How time passes: real, xN, stepped, auto [default: real]
    #[arg(long, value_name = "MODE")]
    pub time: Option<TimeMode>,
    /// Wall-clock time in which the emulator was stopped (SIGSTOP): skip it, or catch up with it [default: catch-up]
    #[arg(long, value_name = "WORD", value_parser = described(TIME_GAPS))]
    pub time_gap: Option<TimeGap>,
    /// Overrides one named option, for example text.stx=required
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Breaks something on purpose: KIND:key=value,... (repeatable; `ts3100 faults list` names the kinds)
    #[arg(long, value_name = "SPEC")]
    pub fault: Vec<String>,
    /// TOML file of faults, a table `[[fault]]` each
    #[arg(long, value_name = "FILE")]
    pub faults: Option<PathBuf>,
    /// Seed of what the faults draw [default: 0]
    #[arg(long, value_name = "N")]
    pub fault_seed: Option<u64>,
    /// Varies what the manual leaves open, from this seed: a number, random (drawn and printed), or off [default: off]
    #[arg(long, value_name = "SEED")]
    pub vary: Option<Seed>,
    /// File for the report of the faults at the end, what each did and which never fired: .xml JUnit, otherwise JSON
    #[arg(long, value_name = "FILE")]
    pub report: Vec<PathBuf>,
    /// Permission tables to use in place of the printed ones
    #[arg(long, value_name = "FILE")]
    pub permissions: Option<PathBuf>,
    /// TOML file with the same keys; named options are in its table `options`
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// File for a transcript of every port: .txt, .jsonl or .pcapng (Wireshark); may be given several times
    #[arg(long, value_name = "FILE", action = clap::ArgAction::Append)]
    pub transcript: Vec<TranscriptFile>,
    /// Log every text; twice: every byte
    #[arg(long, short, action = clap::ArgAction::Count)]
    pub verbose: u8,
    /// Form of the log on stderr [default: text]
    #[arg(long, value_name = "FORMAT")]
    pub log_format: Option<LogFormat>,
    /// Reports of the run.
    #[command(flatten)]
    pub reports: ReportArgs,
}

impl ServeArgs {
    /// Where the port numbers come from: ETHERNET.PAR and an offset, or the system.
    #[must_use]
    pub fn tcp_ports(&self) -> Ports {
        match self.ports {
            Some(PortSource::Auto) => Ports::Auto,
            Some(PortSource::Parameter) | None => Ports::Offset(self.port_offset.unwrap_or(0)),
        }
    }

    /// These arguments; those not given are taken from the layer below. Named options and faults of the layer below come
    /// first, so that a later option of the same name wins.
    #[must_use]
    pub fn with_fallback(self, below: ServeArgs) -> ServeArgs {
        ServeArgs {
            listen: self.listen.or(below.listen),
            port_offset: self.port_offset.or(below.port_offset),
            ports: self.ports.or(below.ports),
            control: self.control.or(below.control),
            control_token: self.control_token.or(below.control_token),
            control_token_file: self.control_token_file.or(below.control_token_file),
            control_open: self.control_open.or(below.control_open),
            control_host: first_non_empty(self.control_host, below.control_host),
            serial_dir: self.serial_dir.or(below.serial_dir),
            serial_host: self.serial_host.or(below.serial_host),
            serial_host_rfc2217: self.serial_host_rfc2217.or(below.serial_host_rfc2217),
            serial_host_tcp: self.serial_host_tcp.or(below.serial_host_tcp),
            serial_com1: self.serial_com1.or(below.serial_com1),
            serial_com1_rfc2217: self.serial_com1_rfc2217.or(below.serial_com1_rfc2217),
            serial_com1_tcp: self.serial_com1_tcp.or(below.serial_com1_tcp),
            ready_json: self.ready_json.or(below.ready_json),
            drive: self.drive.or(below.drive),
            load: first_non_empty(self.load, below.load),
            select: self.select.or(below.select),
            restore: self.restore.or(below.restore),
            snapshot_on_exit: self.snapshot_on_exit.or(below.snapshot_on_exit),
            scenario: self.scenario.or(below.scenario),
            junit: self.junit.or(below.junit),
            servo_on: self.servo_on.or(below.servo_on),
            key_switch: self.key_switch.or(below.key_switch),
            control_right: self.control_right.or(below.control_right),
            dialect: self.dialect.or(below.dialect),
            model: self.model.or(below.model),
            points: self.points.or(below.points),
            controller: self.controller.or(below.controller),
            time: self.time.or(below.time),
            time_gap: self.time_gap.or(below.time_gap),
            set: below.set.into_iter().chain(self.set).collect(),
            fault: below.fault.into_iter().chain(self.fault).collect(),
            faults: self.faults.or(below.faults),
            fault_seed: self.fault_seed.or(below.fault_seed),
            vary: self.vary.or(below.vary),
            report: first_non_empty(self.report, below.report),
            permissions: self.permissions.or(below.permissions),
            config: self.config.or(below.config),
            transcript: first_non_empty(self.transcript, below.transcript),
            verbose: Some(self.verbose)
                .filter(|count| *count > 0)
                .unwrap_or(below.verbose),
            log_format: self.log_format.or(below.log_format),
            reports: self.reports.with_fallback(below.reports),
        }
    }
}

/// Reads the value of `--port-offset`.
fn port_offset(word: &str) -> Result<u16, UnexpectedWord> {
    let number = word.parse();
    number.map_err(|_| UnexpectedWord::new("a whole number from 0 to 65535", word))
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
    /// ETHERNET.PAR and the offset.
    Parameter,
    /// The system.
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
const FIRST_PORT: u16 = 1_000;

/// Reads the word of a value, and names all words in the help.
pub fn word<T: Word + Send + Sync>() -> impl TypedValueParser<Value = T> {
    let words = PossibleValuesParser::new(T::ALL.iter().map(|value| value.word()));
    words.try_map(|word| T::from_word(&word).ok_or("a word of the list expected"))
}

/// A word, its meaning, and its line in the help.
pub type DescribedWord<T> = (&'static str, T, &'static str);

/// The presets of the named options.
pub const DIALECTS: &[DescribedWord<Dialect>] = &[
    (
        "field",
        Dialect::Field,
        "The manual, and what real host programs need besides",
    ),
    ("manual", Dialect::Manual, "The letter of the manual"),
];
/// The controller types.
pub const CONTROLLERS: &[DescribedWord<ControllerType>] = &[
    (
        "ts3100",
        ControllerType::Ts3100,
        "Key switch TEACHING, INTERNAL, EXT",
    ),
    (
        "tsl3100",
        ControllerType::Tsl3100,
        "Key switch TEACHING, EXT (GEN-05)",
    ),
    (
        "tsl3000e",
        ControllerType::Tsl3000e,
        "As tsl3100, and every third servo-on comes 7 s late (servo.interval)",
    ),
];
/// What becomes of wall-clock time in which the emulator was stopped.
const TIME_GAPS: &[DescribedWord<TimeGap>] = &[
    (
        "catch-up",
        TimeGap::CatchUp,
        "Virtual time has passed as well: what was due meanwhile happens at once, as far as a slice of work goes",
    ),
    ("skip", TimeGap::Skip, "Virtual time goes on from where it stood"),
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
            .ok_or("a word of the list expected")
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
