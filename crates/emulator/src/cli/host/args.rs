//! The arguments of `ts3100 host`. A command and its operands are turned into a protocol message, which
//! `ts3100-proto` parses again, so operands obey the same grammar as on the wire.
//!
//! The help of a command is in its row of the table of commands; the doc comments of operands are theirs. Commands beyond the manual are in [`super::extensions`]; the exchange
//! itself is in [`super::session`].

use super::extensions::Extension;
use super::session::HostError;
use super::table::{TableCommand, help};
use super::variable_type::VariableType;
use clap::{Args, Subcommand};
use std::path::PathBuf;
use std::time::Duration;
use ts3100_driver::pc_file;
use ts3100_proto::command::Command;

/// Sends one command to a controller or an emulator and shows its answer.
///
/// Exit code: 0 OK, 1 NG, 2 communication error.
#[derive(Debug, Args)]
pub(in crate::cli) struct HostArgs {
    /// IP0 of the controller, HOST:PORT
    #[arg(value_name = "ADDR")]
    pub(super) address: String,
    #[command(subcommand)]
    pub(super) command: HostSubcommand,
    /// Send texts without STX
    #[arg(long, global = true)]
    pub(super) no_stx: bool,
    /// Show decoded answers as JSON
    #[arg(long, global = true)]
    pub(super) json: bool,
    /// Longest wait for an answer in seconds
    #[arg(long, global = true, value_name = "SECONDS", default_value = "5", value_parser = seconds)]
    pub(super) timeout: Duration,
    /// Longest time for everything but the wait of `rn --wait`, in seconds
    #[arg(long, global = true, value_name = "SECONDS", default_value = "600", value_parser = seconds)]
    pub(super) total: Duration,
}

/// A word that is no number of seconds.
#[derive(Debug, thiserror::Error)]
#[error("expected a number of seconds above 0, at most 86400")]
pub(in crate::cli) struct SecondsError;

/// A number of seconds of a command line: more than 0, at most a day.
pub(in crate::cli) fn seconds(word: &str) -> Result<Duration, SecondsError> {
    const DAY: f64 = 86_400.0;
    word.parse::<f64>()
        .ok()
        .filter(|seconds| *seconds > 0.0 && *seconds <= DAY)
        .map(Duration::from_secs_f64)
        .ok_or(SecondsError)
}

/// Any command of the table.
#[derive(Debug, Subcommand)]
pub(super) enum HostSubcommand {
    #[command(flatten)]
    Known(HostCommand),
    #[command(flatten)]
    Other(TableCommand),
}

/// A command with arguments of its own.
#[derive(Debug, Subcommand)]
pub(super) enum HostCommand {
    #[command(about = help("SU"))]
    Su,
    #[command(about = help("SF"))]
    Sf,
    #[command(about = help("CA"))]
    Ca,
    #[command(about = help("VR"))]
    Vr,
    #[command(about = help("EU"))]
    Eu,
    #[command(about = help("UL"))]
    Ul {
        /// File of the RAM drive
        name: String,
        /// Where to write it
        #[arg(long, short, value_name = "FILE")]
        output: Option<PathBuf>,
    },
    #[command(about = help("DL"))]
    Dl {
        /// File of the PC
        file: PathBuf,
        /// Its name on the RAM drive
        name: Option<String>,
    },
    #[command(about = help("ER"))]
    Er {
        /// File of the RAM drive
        name: String,
    },
    #[command(about = help("SL"))]
    Sl {
        /// File of the RAM drive
        name: String,
    },
    #[command(about = help("RN"))]
    Rn {
        /// Wait for the SP by which the controller reports the stop; SECONDS at most
        #[arg(long, value_name = "SECONDS", num_args = 0..=1, value_parser = seconds)]
        wait: Option<Option<Duration>>,
    },
    #[command(about = help("SP"))]
    Sp,
    #[command(about = help("SO"))]
    So,
    #[command(about = help("BR"))]
    Br,
    #[command(about = help("RS"))]
    Rs {
        /// What
        what: String,
    },
    #[command(about = help("MR"))]
    Mr {
        /// Its name
        name: String,
        /// Its type: integer, real, load, coordinate, position, or the manual's code: 0-4 these, 5-9 elements
        /// of arrays of these, -1 whatever it is
        #[arg(value_name = "TYPE", allow_negative_numbers = true)]
        kind: Option<VariableType>,
        /// The same as TYPE
        #[arg(
            long = "type",
            value_name = "TYPE",
            allow_negative_numbers = true,
            conflicts_with = "kind"
        )]
        named_kind: Option<VariableType>,
    },
    #[command(about = help("MW"))]
    Mw {
        /// Its name
        name: String,
        /// Its type as for mr [default: -1, whatever it is]
        #[arg(long = "type", value_name = "TYPE", allow_negative_numbers = true)]
        kind: Option<VariableType>,
        /// Also write the value into the program file
        #[arg(long)]
        restore: bool,
        /// Its values
        #[arg(required = true, allow_negative_numbers = true)]
        values: Vec<String>,
    },
    #[command(about = help("IW"))]
    Iw {
        /// Line number and 0 or 1, in turn
        #[arg(required = true)]
        pairs: Vec<String>,
    },
    #[command(about = help("DO"))]
    Do {
        /// The statement; everything after it belongs to it
        #[arg(required = true, trailing_var_arg = true, allow_hyphen_values = true)]
        statement: Vec<String>,
    },
    #[command(about = help("EC"))]
    Ec {
        /// The command and its operand
        #[arg(required = true)]
        words: Vec<String>,
    },
    #[command(about = help("FD"))]
    Fd,
    #[command(flatten)]
    Extension(Extension),
}

/// Which decoder an answer needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Decoder {
    /// SU.
    Status,
    /// CA.
    Directory,
    /// VR.
    Version,
    /// EU.
    History,
    /// MR and HI.
    Values,
    /// SM.
    QuickStatus,
    /// AC and AH.
    Alarms,
    /// PR and VL.
    Position,
    /// MN.
    Maintenance,
}

/// What an exchange consists of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum ExchangeKind {
    /// OK or NG.
    Plain,
    /// OK, then the controller's SP, within the limit if one is given.
    RunAndWait(Option<Duration>),
    /// OK, then the file's texts.
    Download { file: PathBuf },
    /// A file, kept.
    Upload { output: Option<PathBuf> },
    /// A file, decoded.
    Status(Decoder),
    /// SF: read by length.
    SystemStatus,
    /// IO: read by length.
    Lines,
}

impl HostSubcommand {
    /// The command as proto understands it.
    ///
    /// # Errors
    /// [`HostError::Command`] with what was expected and found.
    pub(super) fn parse(&self) -> Result<Command, HostError> {
        let message = self.message()?;
        Command::parse(message.as_bytes()).map_err(|error| HostError::Command {
            message,
            reason: error.to_string(),
        })
    }

    pub(super) fn exchange_kind(&self) -> ExchangeKind {
        match self {
            HostSubcommand::Known(command) => command.exchange_kind(),
            HostSubcommand::Other(command) => command.exchange_kind(),
        }
    }

    fn message(&self) -> Result<String, HostError> {
        match self {
            HostSubcommand::Known(command) => command.message(),
            HostSubcommand::Other(command) => Ok(command.message()),
        }
    }
}

impl HostCommand {
    /// What is to be done with it.
    fn exchange_kind(&self) -> ExchangeKind {
        match self {
            HostCommand::Su => ExchangeKind::Status(Decoder::Status),
            HostCommand::Sf => ExchangeKind::SystemStatus,
            HostCommand::Ca => ExchangeKind::Status(Decoder::Directory),
            HostCommand::Vr => ExchangeKind::Status(Decoder::Version),
            HostCommand::Eu => ExchangeKind::Status(Decoder::History),
            HostCommand::Mr { .. } => ExchangeKind::Status(Decoder::Values),
            HostCommand::Ul { output, .. } => ExchangeKind::Upload {
                output: output.clone(),
            },
            HostCommand::Dl { file, .. } => ExchangeKind::Download { file: file.clone() },
            HostCommand::Extension(extension) => extension.exchange_kind(),
            HostCommand::Rn { wait: Some(limit) } => ExchangeKind::RunAndWait(*limit),
            HostCommand::Rn { wait: None }
            | HostCommand::Er { .. }
            | HostCommand::Sl { .. }
            | HostCommand::Sp
            | HostCommand::So
            | HostCommand::Br
            | HostCommand::Rs { .. }
            | HostCommand::Mw { .. }
            | HostCommand::Iw { .. }
            | HostCommand::Do { .. }
            | HostCommand::Ec { .. }
            | HostCommand::Fd => ExchangeKind::Plain,
        }
    }

    fn message(&self) -> Result<String, HostError> {
        Ok(match self {
            HostCommand::Su => "SU".to_owned(),
            HostCommand::Sf => "SF".to_owned(),
            HostCommand::Ca => "CA".to_owned(),
            HostCommand::Vr => "VR".to_owned(),
            HostCommand::Eu => "EU".to_owned(),
            HostCommand::Ul { name, .. } => format!("UL,{name}"),
            HostCommand::Dl { file, name: None } => format!("DL,{}", pc_file::drive_name(file)?),
            HostCommand::Dl { name: Some(name), .. } => format!("DL,{name}"),
            HostCommand::Er { name } => format!("ER,{name}"),
            HostCommand::Sl { name } => format!("SL,{name}"),
            HostCommand::Rn { .. } => "RN".to_owned(),
            HostCommand::Sp => "SP".to_owned(),
            HostCommand::So => "SO".to_owned(),
            HostCommand::Br => "BR".to_owned(),
            HostCommand::Rs { what } => format!("RS,{what}"),
            HostCommand::Mr {
                name,
                kind,
                named_kind,
            } => {
                let kind = kind.or(*named_kind).unwrap_or_default();
                format!("MR,{name} {}", kind.code(name))
            }
            HostCommand::Mw {
                name,
                kind,
                restore,
                values,
            } => {
                let kind = kind.unwrap_or_default().code(name);
                format!("MW,{} {name} {kind} {}", u8::from(*restore), values.join(" "))
            }
            HostCommand::Iw { pairs } => format!("IW,{}", pairs.join(" ")),
            HostCommand::Do { statement } => format!("DO,{}", statement.join(" ")),
            HostCommand::Ec { words } => format!("EC,{}", words.join(" ")),
            HostCommand::Fd => "FD".to_owned(),
            HostCommand::Extension(extension) => extension.message(),
        })
    }
}
