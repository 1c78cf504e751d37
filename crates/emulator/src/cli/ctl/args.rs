//! The arguments of `ts3100 ctl`, as clap reads them. The doc comments are the help texts.
//!
//! Each command becomes one HTTP call in [`super::call`].

use crate::config::args::word;
use clap::{ArgAction, Args, Subcommand, ValueEnum};
use std::path::PathBuf;
use std::time::Duration;
use ts3100_controller::{CONDITION_FORMS, ControlRight, KeySwitch};
use ts3100_recording::transcript::TranscriptFile;

/// Looks at a running emulator, changes anything of it, moves its time.
///
/// Exit code: 0 done, 1 refused, 2 wrong usage, 3 no answer, 4 what was waited for did not happen in its time. Durations
/// are seconds of virtual time.
#[derive(Debug, Args)]
pub struct CtlArgs {
    /// URL of the control interface, as the ready line gives it [env: TS3100_CONTROL_URL] [default: http://127.0.0.1:3100]
    #[arg(long, value_name = "URL", global = true)]
    pub url: Option<String>,
    /// Its token [env: TS3100_CONTROL_TOKEN]
    #[arg(long, value_name = "TOKEN", global = true)]
    pub token: Option<String>,
    /// Longest wait for the answer in seconds; a call that waits has its --wall in addition; `events` shows events for so long [default: 10]
    #[arg(long, value_name = "SECONDS", global = true, value_parser = crate::cli::host::seconds)]
    pub timeout: Option<Duration>,
    /// The answer as JSON on one line
    #[arg(long, global = true)]
    pub json: bool,
    #[command(subcommand)]
    pub command: Command,
}

/// What is asked for.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Everything at one moment
    State,
    /// Key switch: show, or turn
    KeySwitch {
        #[arg(value_parser = word::<KeySwitch>())]
        position: Option<KeySwitch>,
    },
    /// Control right in EXT: show, or set
    ControlRight {
        #[arg(value_parser = word::<ControlRight>())]
        holder: Option<ControlRight>,
    },
    /// Emergency stop: show, press, release
    EmergencyStop {
        #[arg(value_parser = ["press", "release"])]
        action: Option<String>,
    },
    /// Safety switch (fence): show, open, close
    SafetySwitch {
        #[arg(value_parser = ["open", "close"])]
        action: Option<String>,
    },
    /// Servo power
    Servo {
        #[arg(value_parser = word::<bool>())]
        state: Option<bool>,
    },
    /// Feed hold: show, set; press is the button at the panel, which switches it
    FeedHold {
        #[arg(value_parser = ["on", "off", "press"])]
        state: Option<String>,
    },
    /// Machine lock
    MachineLock {
        #[arg(value_parser = word::<bool>())]
        state: Option<bool>,
    },
    /// Battery of the RAM drive
    Battery {
        #[arg(value_parser = ["low", "ok"])]
        state: Option<String>,
    },
    /// The selected program: show, start, stop
    Program {
        #[arg(value_parser = ["start", "stop"])]
        action: Option<String>,
    },
    /// Teach pendant: show, or type at it
    Pendant {
        #[command(subcommand)]
        action: Option<PendantCommand>,
    },
    /// Alarms: list, raise, reset, the table with cause and remedy
    Alarms {
        #[command(subcommand)]
        action: Option<AlarmsCommand>,
    },
    /// Inputs: those that are on, or one of them
    Input {
        line: Option<u16>,
        #[command(subcommand)]
        action: Option<LineCommand>,
    },
    /// Outputs: those that are on, or one of them
    Output {
        line: Option<u16>,
        #[command(subcommand)]
        action: Option<LineCommand>,
    },
    /// Variables of the selected file: list, show one, set it
    Variable {
        /// For an element of an array with subscripts: A(1,2)
        name: Option<String>,
        /// As many numbers as the kind takes
        #[arg(allow_negative_numbers = true)]
        value: Vec<String>,
        /// Write it into the file too
        #[arg(long)]
        restore: bool,
    },
    /// Positions of the selected file: list, show one, set it, teach it
    Position {
        name: Option<String>,
        /// As many numbers as positions have on this arm, the configuration last; or teach: the present position of the arm
        #[arg(allow_negative_numbers = true)]
        value: Vec<String>,
        /// Write it into the file too
        #[arg(long)]
        restore: bool,
    },
    /// RAM drive: list, get, put, erase, select
    File {
        #[command(subcommand)]
        action: Option<FileCommand>,
    },
    /// Communication ports: all, or one: inject bytes, drop its peer
    Channel {
        #[arg(value_parser = ["host", "com1", "ip0", "ip1", "ip2", "ip3"])]
        port: Option<String>,
        #[command(subcommand)]
        action: Option<ChannelCommand>,
    },
    /// Parameters in effect
    Parameters,
    /// Clock: show, set how time passes, move it
    Clock {
        #[command(subcommand)]
        action: Option<ClockCommand>,
    },
    /// Wait until something happens, without moving time
    Wait(WaitArgs),
    /// Power: show, off, on, cycle
    Power {
        #[arg(value_parser = ["off", "on", "cycle"])]
        action: Option<String>,
    },
    /// Everything as when the emulator was started
    Reset,
    /// Faults on purpose: list, arm, disarm, clear, the kinds there are
    Faults {
        #[command(subcommand)]
        action: Option<FaultsCommand>,
    },
    /// Snapshots: list, take, restore, delete, show, load
    Snapshot {
        #[command(subcommand)]
        action: Option<SnapshotCommand>,
    },
    /// What happens, as it happens
    Events(EventsArgs),
    /// What went over the ports: print it, or write it to a file
    Transcript {
        /// Text, JSON lines or a capture for Wireshark, by its ending: .txt, .jsonl, .pcapng
        file: Option<TranscriptFile>,
    },
    /// What hosts did that the manual advises against
    Findings,
    /// Counters in the text format of Prometheus
    Metrics,
    /// Whether the emulator answers
    Health,
    /// What runs there
    Version,
    /// Any call of the OpenAPI document
    Call {
        /// GET, PUT, POST, DELETE
        method: HttpMethod,
        /// For example /state
        path: String,
        /// JSON
        body: Option<String>,
    },
}

#[derive(Debug, Clone, Subcommand)]
pub enum SnapshotCommand {
    /// Keep the present state under a name
    Take { name: String },
    /// Go on from the state of a name
    Restore { name: String },
    /// Forget the state of a name
    Delete { name: String },
    /// Print the present state, or that of a name, as the file of a snapshot has it
    Show { name: Option<String> },
    /// Go on from the file of a snapshot; - is standard input
    Load { path: PathBuf },
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum HttpMethod {
    #[value(name = "GET", alias = "get")]
    Get,
    #[value(name = "PUT", alias = "put")]
    Put,
    #[value(name = "POST", alias = "post")]
    Post,
    #[value(name = "DELETE", alias = "delete")]
    Delete,
}

#[derive(Debug, Subcommand)]
pub enum PendantCommand {
    /// Type text; `\r` is the Enter key
    Keys { text: String },
}

#[derive(Debug, Subcommand)]
pub enum AlarmsCommand {
    /// Active ones and the history
    List,
    /// Raise one of the table
    Raise {
        /// level-code, for example 2-046
        number: String,
        /// Stands behind its text
        detail: Option<String>,
    },
    /// Press ALARM RESET
    Reset,
    /// Every alarm there can be, or one
    Table { number: Option<String> },
}

#[derive(Debug, Subcommand)]
pub enum FaultsCommand {
    /// Those that were armed, and what has become of them
    List,
    /// Arm one
    Arm {
        /// KIND:key=value,... as serve --fault takes it
        #[arg(value_parser = clap::value_parser!(ts3100_controller::faults::Fault))]
        spec: ts3100_controller::faults::Fault,
    },
    /// Disarm one; it stays in the report
    Disarm { number: u32 },
    /// Forget them all
    Clear,
    /// The kinds with their parameters
    Kinds,
}

#[derive(Debug, Subcommand)]
pub enum LineCommand {
    /// Drive it on (an output: as IW does)
    On,
    /// Drive it off
    Off,
    /// Drive it for a time, and then the other way
    Pulse {
        #[arg(value_parser = word::<bool>(), action = ArgAction::Set)]
        state: bool,
        /// For example 200ms, 200 ms or 0.5 s
        #[arg(required = true, num_args = 1..=2)]
        time: Vec<String>,
    },
    /// It shows this state whatever drives it
    Force {
        #[arg(value_parser = word::<bool>(), action = ArgAction::Set)]
        state: bool,
    },
    /// It shows again what drives it
    Release,
    /// Wait until it shows this state
    Wait {
        #[arg(value_parser = word::<bool>(), action = ArgAction::Set)]
        state: bool,
        #[command(flatten)]
        limits: WaitLimits,
    },
}

#[derive(Debug, Subcommand)]
pub enum FileCommand {
    /// All files
    List,
    /// Print a file
    Get { name: String },
    /// Put a file of this computer on the drive; - is standard input
    Put { name: String, path: PathBuf },
    /// Erase a file
    Erase { name: String },
    /// Select a file
    Select { name: String },
}

#[derive(Debug, Subcommand)]
pub enum ChannelCommand {
    /// Bytes as if they had come from the peer
    Inject {
        /// As text; `\r` and `\n` are control codes
        #[arg(required_unless_present = "hex")]
        text: Option<String>,
        /// As hexadecimal digits
        #[arg(long, conflicts_with = "text")]
        hex: Option<String>,
    },
    /// Close the connection
    Drop,
}

#[derive(Debug, Subcommand)]
pub enum ClockCommand {
    /// real, xN, stepped, auto
    Mode { mode: String },
    /// Move time by so many seconds
    Advance {
        seconds: f64,
        /// Longest time on the wall, in seconds
        #[arg(long)]
        wall: Option<f64>,
    },
    /// Move time until something happens
    AdvanceUntil(WaitArgs),
}

/// How long is waited.
#[derive(Debug, Clone, Copy, Args)]
pub struct WaitLimits {
    /// For so many seconds of virtual time at most
    #[arg(long, default_value_t = 60.0)]
    pub within: f64,
    /// Longest time on the wall, in seconds [default: 30]
    #[arg(long)]
    pub wall: Option<f64>,
}

#[derive(Debug, Args)]
pub struct WaitArgs {
    /// A condition, such as output 5 on, printed IP1 DONE or command RN; the page Conditions lists all
    #[arg(required = true, num_args = 1.., long_help = conditions())]
    pub condition: Vec<String>,
    #[command(flatten)]
    pub limits: WaitLimits,
}

/// The forms of conditions, for `--help`.
fn conditions() -> String {
    let forms = CONDITION_FORMS.iter().map(|row| format!("  {}", row.form));
    let forms: Vec<String> = forms.collect();
    format!(
        "One of these conditions; control codes are written as <CR>:\n{}",
        forms.join("\n")
    )
}

#[derive(Debug, Clone, Copy, Args)]
pub struct EventsArgs {
    /// Number of the first event; 1 for all that are kept [default: the next event]
    #[arg(long)]
    pub since: Option<u64>,
    /// End after this many events; with --timeout, exit code 4 if fewer came
    #[arg(long)]
    pub count: Option<u64>,
}
