//! The arguments of `ts3100 ctl`, as clap reads them. The doc comments are the help texts.
//!
//! Each command becomes one HTTP call in [`super::call`].

use super::target::TargetArgs;
use crate::cli::controls::{
    AlarmButtons, ButtonCommand, JogButtons, ProgramButtons, QueryCommand, SwitchCommand,
};
use crate::config::args::{line_number, seconds, whole, word};
use clap::{ArgAction, Args, Subcommand};
use std::path::PathBuf;
use std::time::Duration;
use ts3100_controller::CONDITION_FORMS;
use ts3100_controller::inspection::StepKind;
use ts3100_controller::model::AXES;
use ts3100_driver::clock::TimeMode;
use ts3100_proto::words::UnexpectedWord;
use ts3100_recording::transcript::TranscriptFile;

/// Longest duration that is sent; the control interface has smaller limits of its own.
const MAX_TIME: &str = "3155760000s";
/// The methods of calls.
pub const METHODS: [&str; 4] = ["GET", "PUT", "POST", "DELETE"];

/// `list`, which every list has. Its noun alone does the same, and help shows that.
fn list() -> clap::Command {
    clap::Command::new("list")
        .about("List them, as without `list`")
        .hide(true)
}

/// Reads a name. An empty one would be another call.
fn name(word: &str) -> Result<String, UnexpectedWord> {
    let found = Some(word.to_owned()).filter(|name| !name.is_empty());
    found.ok_or_else(|| UnexpectedWord::new("a name", word))
}

/// Reads the number of an axis.
fn axis(word: &str) -> Result<u8, UnexpectedWord> {
    let number = word.parse().ok();
    let number = number.filter(|axis: &u8| (1..=AXES).contains(&usize::from(*axis)));
    number.ok_or_else(|| UnexpectedWord::new(format!("an axis from 1 to {AXES}"), word))
}

/// Inspect and control a running emulator, including its clock.
///
/// A duration has its unit, as in 5s, 500ms or 1.5s; a number alone is seconds. It is virtual time unless a flag says
/// otherwise.
///
/// Exit codes: 0 done; 1 refused; 2 wrong usage; 3 no answer; 4 the condition was not met in time.
#[derive(Debug, Args)]
pub struct CtlArgs {
    /// The robot that is called.
    #[command(flatten)]
    pub target: TargetArgs,
    /// Longest wait for an answer, plus --wall for commands that wait; `events` ends after this time [default: 10]
    #[arg(long, value_name = "TIME", global = true, value_parser = seconds("1us", "1440min"))]
    pub timeout: Option<Duration>,
    /// Print the answer as one line of JSON
    #[arg(long, global = true)]
    pub json: bool,
    #[command(subcommand)]
    pub command: Command,
}

/// The subcommand.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Show the whole state of the robot
    State,
    /// List the robots of the process
    #[command(subcommands = [list()], disable_help_subcommand = true)]
    Robots,
    /// List the wires between the robots, or set an outside line
    #[command(subcommands = [list()], disable_help_subcommand = true)]
    Wires {
        /// Name of an outside line
        #[arg(requires = "state", value_parser = name)]
        outside: Option<String>,
        /// Its new state
        #[arg(value_parser = word::<bool>())]
        state: Option<bool>,
    },
    #[command(flatten)]
    Switch(SwitchCommand),
    /// Show, start, stop or step the selected program, or run it to a line
    Program {
        #[command(subcommand)]
        action: Option<ProgramCommand>,
    },
    /// Show or set the breakpoints of the selected program
    #[command(subcommands = [list()], disable_help_subcommand = true)]
    Breakpoints {
        /// Lines of the file, from 1
        #[arg(value_parser = whole(1, u32::MAX))]
        lines: Vec<u32>,
        /// Expression that has to be true, such as 'COUNT > 3'
        #[arg(long = "if", value_name = "CONDITION", requires = "lines")]
        condition: Option<String>,
        /// Hits that count: 3, '>=3' or %3
        #[arg(long, value_name = "RULE", requires = "lines")]
        hits: Option<String>,
        /// Text of an event instead of a stop; {COUNT} becomes a value
        #[arg(long, value_name = "TEXT", requires = "lines")]
        say: Option<String>,
        /// Remove all
        #[arg(long, conflicts_with = "lines")]
        none: bool,
    },
    /// Move the arm as with the keys of the teach pendant, in TEACHING
    Jog {
        #[command(subcommand)]
        key: JogCommand,
    },
    /// Show the teach pendant, or type on it
    Pendant {
        #[command(subcommand)]
        action: Option<PendantCommand>,
    },
    /// List, raise or reset alarms; show causes and remedies
    #[command(subcommands = [list()])]
    Alarms {
        #[command(subcommand)]
        action: Option<AlarmsCommand>,
    },
    /// Show input lines, drive or force one, wait for one
    #[command(subcommands = [list()])]
    Inputs(LineArgs),
    /// Show output lines, drive or force one, wait for one
    #[command(subcommands = [list()])]
    Outputs(LineArgs),
    /// List, show or set the variables of the selected file
    #[command(subcommands = [list()], disable_help_subcommand = true)]
    Variables {
        /// Name; an element of an array with its subscripts, A(1,2)
        #[arg(value_parser = name)]
        name: Option<String>,
        /// New value: as many numbers as the type has
        #[arg(allow_negative_numbers = true)]
        value: Vec<String>,
        /// Also write the value into the file
        #[arg(long)]
        restore: bool,
    },
    /// List, show, set or teach the positions of the selected file
    #[command(subcommands = [list()], disable_help_subcommand = true)]
    Positions {
        /// Name of the position
        #[arg(value_parser = name)]
        name: Option<String>,
        /// New position: as many numbers as a position has on this arm, the configuration last; or `teach` for the present position
        #[arg(allow_negative_numbers = true)]
        value: Vec<String>,
        /// Also write the value into the file
        #[arg(long)]
        restore: bool,
    },
    /// List, get, put, erase, select or check files of the RAM drive
    #[command(subcommands = [list()])]
    Files {
        #[command(subcommand)]
        action: Option<FileCommand>,
    },
    /// Split a text of the protocol into its fields
    Decode(DecodeArgs),
    /// Show the communication ports; inject bytes, close a connection
    #[command(subcommands = [list()])]
    Channels {
        /// Name of the port
        #[arg(value_parser = ["host", "com1", "ip0", "ip1", "ip2", "ip3"], ignore_case = true)]
        port: Option<String>,
        #[command(subcommand)]
        action: Option<ChannelCommand>,
    },
    /// Show the clock, set how time passes, or advance it
    Clock {
        #[command(subcommand)]
        action: Option<ClockCommand>,
    },
    /// Wait for a condition while time passes by itself
    Wait(WaitArgs),
    /// Show power, or turn it off, on, or off and on again
    Power {
        /// New state, or `cycle` for off and on again
        #[arg(value_parser = ["off", "on", "cycle"])]
        action: Option<String>,
    },
    /// Return to the state in which the emulator started
    Reset,
    /// List, arm, disarm or clear faults; list the kinds
    #[command(subcommands = [list()])]
    Faults {
        #[command(subcommand)]
        action: Option<FaultsCommand>,
    },
    /// List, take, restore, delete, show or load snapshots
    #[command(subcommands = [list()])]
    Snapshots {
        #[command(subcommand)]
        action: Option<SnapshotCommand>,
    },
    /// Follow the events
    Events(EventsArgs),
    /// Print the transcript of all ports, or write it to a file
    Transcript {
        /// File to write: .txt, .jsonl, or .pcapng for Wireshark
        file: Option<TranscriptFile>,
    },
    /// List the protocol mistakes of hosts
    #[command(subcommands = [list()], disable_help_subcommand = true)]
    Findings,
    /// Show the coverage of the permission tables by hosts
    Coverage,
    /// Show the progress of the scenario
    Scenario,
    /// Print counters in the text format of Prometheus; with --json as an object
    Metrics,
    /// Check that the emulator answers
    Health,
    /// Show the version of the emulator
    Version,
    #[command(flatten)]
    Query(QueryCommand),
    /// Make any call of the OpenAPI document
    Call {
        /// Method
        #[arg(value_parser = METHODS, ignore_case = true)]
        method: String,
        /// Path, for example /state
        path: String,
        /// Body, in JSON
        body: Option<String>,
    },
}

#[derive(Debug, Clone, Subcommand)]
pub enum SnapshotCommand {
    /// Take a snapshot under a name
    Take {
        /// Name of the snapshot
        #[arg(value_parser = name)]
        name: String,
    },
    /// Return to a snapshot
    Restore {
        /// Name of the snapshot
        #[arg(value_parser = name)]
        name: String,
    },
    /// Delete a snapshot
    Delete {
        /// Name of the snapshot
        #[arg(value_parser = name)]
        name: String,
    },
    /// Print the present state, or a snapshot, as a snapshot file
    Show {
        /// Name of the snapshot; none for the present state
        #[arg(value_parser = name)]
        name: Option<String>,
    },
    /// Continue from a snapshot file; - is stdin
    Load {
        /// File of this computer
        path: PathBuf,
    },
}

#[derive(Debug, Subcommand)]
pub enum PendantCommand {
    /// Type text; <CR> or `\r` is the Enter key
    Keys {
        /// The keys
        text: String,
    },
}

#[derive(Debug, Subcommand)]
pub enum ProgramCommand {
    #[command(flatten)]
    Button(ButtonCommand<ProgramButtons>),
    /// Run to a line and stop before it
    RunTo {
        /// Line of the file, from 1
        #[arg(value_parser = whole(1, u32::MAX))]
        line: u32,
    },
    /// Show the tasks with their open calls and local variables
    Stack,
    /// Evaluate an expression in an open call
    Evaluate {
        /// As a program would write it, such as 'COUNT + 1'
        #[arg(allow_hyphen_values = true)]
        expression: String,
        #[command(flatten)]
        place: CallArgs,
    },
    /// Give a variable of an open call a value while the program is stopped
    Assign {
        /// As a program would write it: 'COUNT = 5'
        assignment: String,
        #[command(flatten)]
        place: CallArgs,
    },
    /// Run one step of a task
    StepTask {
        /// How far: into, over, out or motion
        #[arg(value_parser = word::<StepKind>())]
        kind: StepKind,
        /// Number of the task
        #[arg(long, default_value_t = 1)]
        task: u16,
    },
}

/// An open call.
#[derive(Debug, Args)]
pub struct CallArgs {
    /// Number of the task
    #[arg(long, default_value_t = 1)]
    pub task: u16,
    /// Number of the call, 0 the outermost [default: the innermost]
    #[arg(long)]
    pub call: Option<u32>,
}

#[derive(Debug, Subcommand)]
pub enum JogCommand {
    /// Towards larger values, until `ctl jog stop`
    Plus(JogKey),
    /// Towards smaller values, until `ctl jog stop`
    Minus(JogKey),
    #[command(flatten)]
    Button(ButtonCommand<JogButtons>),
}

#[derive(Debug, Args)]
pub struct JogKey {
    /// Axis from 1; in a coordinate system 1 to 3 go along X Y Z, 4 to 6 turn about them
    #[arg(value_parser = axis)]
    pub axis: u8,
    /// Coordinate system
    #[arg(long, value_parser = ["joint", "tool", "work", "world"], default_value = "joint")]
    pub coordinates: String,
    /// Speed
    #[arg(long, value_parser = ["slow", "mid", "fast"], default_value = "slow")]
    pub speed: String,
    /// Move one step
    #[arg(long)]
    pub inching: bool,
}

#[derive(Debug, Subcommand)]
pub enum AlarmsCommand {
    /// Raise an alarm
    Raise {
        /// Level and code, for example 2-046
        number: String,
        /// Detail to append to the text of the alarm
        detail: Option<String>,
    },
    #[command(flatten)]
    Button(ButtonCommand<AlarmButtons>),
    /// Show all alarms, or one, with cause and remedy
    Table {
        /// Level and code, for example 2-046
        number: Option<String>,
    },
}

#[derive(Debug, Subcommand)]
pub enum FaultsCommand {
    /// Arm a fault
    Arm {
        /// KIND:key=value,... as for serve --fault
        #[arg(value_parser = clap::value_parser!(ts3100_controller::faults::Fault))]
        spec: ts3100_controller::faults::Fault,
    },
    /// Disarm a fault; it stays in the report
    Disarm {
        /// Number of the fault
        #[arg(value_parser = whole(0, u32::MAX))]
        number: u32,
    },
    /// Remove all faults
    Clear,
    /// List the kinds of faults with their parameters
    Kinds,
}

#[derive(Debug, Args)]
pub struct LineArgs {
    /// Number of the line
    #[arg(value_parser = line_number)]
    pub line: Option<u16>,
    #[command(subcommand)]
    pub action: Option<LineCommand>,
}

#[derive(Debug, Subcommand)]
pub enum LineCommand {
    /// Turn it on (an output: as IW does)
    On,
    /// Turn it off
    Off,
    /// Turn it on or off for a time, then back
    Pulse {
        /// State during the pulse
        #[arg(value_parser = word::<bool>(), action = ArgAction::Set)]
        state: bool,
        /// How long, for example 200ms or 0.5 s
        #[arg(required = true, num_args = 1..=2)]
        time: Vec<String>,
    },
    /// Force it to this state, whatever drives it
    Force {
        /// State that the line shows
        #[arg(value_parser = word::<bool>(), action = ArgAction::Set)]
        state: bool,
    },
    /// Release the force
    Release,
    /// Wait until it has this state
    Wait {
        /// State to wait for
        #[arg(value_parser = word::<bool>(), action = ArgAction::Set)]
        state: bool,
        #[command(flatten)]
        limits: WaitLimits,
    },
}

#[derive(Debug, Args)]
pub struct DecodeArgs {
    /// Who sent it
    #[arg(value_parser = ["host", "controller"])]
    pub direction: String,
    /// The text as it was on the wire, as hexadecimal digits
    #[arg(required = true)]
    pub hex: Vec<String>,
    /// The command that a text of the controller answers, for example SF
    #[arg(long)]
    pub command: Option<String>,
}

#[derive(Debug, Subcommand)]
pub enum FileCommand {
    /// Print a file
    Get {
        /// File of the RAM drive
        #[arg(value_parser = name)]
        name: String,
    },
    /// Put a file of this computer on the drive; - is stdin
    Put {
        /// Name on the RAM drive
        #[arg(value_parser = name)]
        name: String,
        /// File of this computer
        path: PathBuf,
    },
    /// Erase a file
    Erase {
        /// File of the RAM drive
        #[arg(value_parser = name)]
        name: String,
    },
    /// Select a file
    Select {
        /// File of the RAM drive
        #[arg(value_parser = name)]
        name: String,
    },
    /// Show the errors and warnings of a program on the drive
    Check {
        /// File of the RAM drive
        #[arg(value_parser = name)]
        name: String,
    },
}

#[derive(Debug, Subcommand)]
pub enum ChannelCommand {
    /// Handle bytes as if the peer had sent them
    Inject {
        /// Bytes as text; control codes are written as <CR> or `\r`
        #[arg(required_unless_present = "hex")]
        text: Option<String>,
        /// Bytes as hexadecimal digits
        #[arg(long, conflicts_with = "text")]
        hex: Option<String>,
    },
    /// Close the connection
    Drop,
}

#[derive(Debug, Subcommand)]
pub enum ClockCommand {
    /// Set how time passes: real, xN, stepped, auto
    Mode {
        /// The mode, for example x10
        mode: TimeMode,
    },
    /// Advance time by this amount
    Advance {
        /// How much, such as 5s or 500 ms
        #[arg(required = true, num_args = 1..=2, allow_negative_numbers = true)]
        time: Vec<String>,
        /// Longest wall-clock time [default: 30s]
        #[arg(long, value_name = "TIME", value_parser = seconds("0s", MAX_TIME))]
        wall: Option<Duration>,
    },
    /// Advance time until a condition is met
    AdvanceUntil(WaitArgs),
}

/// How long is waited.
#[derive(Debug, Clone, Copy, Args)]
pub struct WaitLimits {
    /// Longest wait in virtual time
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = seconds("0s", MAX_TIME))]
    pub within: Duration,
    /// Longest wall-clock time [default: 30s]
    #[arg(long, value_name = "TIME", value_parser = seconds("0s", MAX_TIME))]
    pub wall: Option<Duration>,
}

#[derive(Debug, Args)]
pub struct WaitArgs {
    /// A condition, for example output 5 on, printed IP1 DONE or command RN; the page Conditions lists all
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
    /// Number of the first event; 1 shows all that are still stored [default: new events only]
    #[arg(long, value_parser = whole(0, u64::MAX))]
    pub since: Option<u64>,
    /// End after this many events; with --timeout, exit code 4 if fewer came
    #[arg(long, value_parser = whole(0, u64::MAX))]
    pub count: Option<u64>,
}
