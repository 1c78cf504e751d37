//! Errors of a configuration, and the reading of the text files that it names.

use super::options::OptionError;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use ts3100_control::ControlError;
use ts3100_controller::faults::FaultError;
use ts3100_driver::files::{self, PathError, cannot};
use ts3100_proto::words::plain_message;

/// Largest configuration file in bytes.
const MAX_FILE: u64 = 1024 * 1024;

/// Why the configuration cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error(transparent)]
    File(#[from] PathError),
    /// A file or a value is not valid.
    #[error("{origin}: {reason}")]
    Invalid {
        /// The file or variable.
        origin: String,
        /// Expected and found value, with the place in the file.
        reason: String,
    },
    /// A table of permissions is not valid.
    #[error("{}, {reason}", path.display())]
    Permissions {
        path: PathBuf,
        /// Line, what was expected and found.
        reason: ts3100_proto::permission::PermissionError,
    },
    /// A named option is unknown or its value does not fit.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// The table of points is not valid.
    #[error("{}:{reason}", path.display())]
    Points {
        /// Path of the file.
        path: PathBuf,
        /// Line, column, what was expected and found.
        reason: scol_mini::PointsError,
    },
    /// The settings of the control interface are not valid.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// Two ways to one serial port.
    #[error("{port} can have one transport only: choose {first} or {second}")]
    SerialTwice {
        /// HOST or COM1.
        port: ts3100_controller::Port,
        /// The first flag given for the port.
        first: String,
        /// The second flag given for the port.
        second: String,
    },
    /// A fault on the command line is not valid.
    #[error("--fault: {0}")]
    Fault(FaultError),
    /// The controller cannot do what a fault does to it.
    #[error(transparent)]
    ImpossibleFault(FaultError),
    /// Two faults have the same number.
    #[error("cannot arm the faults: two have the number id={0}; give each its own")]
    FaultTwice(u32),
    /// A file of faults is not valid.
    #[error(transparent)]
    FaultFile(#[from] ts3100_recording::faults::FaultFileError),
    /// `--restore` together with flags that configure the controller.
    #[error("cannot use {0} with --restore: the snapshot contains it; remove {0}")]
    Restore(String),
    /// The scenario is not valid.
    #[error(transparent)]
    Scenario(#[from] ts3100_recording::scenario::ScenarioError),
    /// `--junit` without a scenario.
    #[error("cannot write --junit: it reports the results of a scenario; add --scenario FILE")]
    JunitAlone,
    /// The robots of a fleet do not go together.
    #[error("{0}")]
    Fleet(String),
    /// Key position INTERNAL on a controller that does not have it (GEN-05).
    #[error(
        "the {0} has no key position INTERNAL (GEN-05): choose --key-switch teaching or --key-switch ext"
    )]
    NoInternal(&'static str),
}

impl ConfigError {
    /// Creates the error for a text that is not TOML, or not the table that is expected.
    pub(super) fn toml(path: &Path, text: &str, error: &toml::de::Error) -> ConfigError {
        let before = error.span().and_then(|span| text.get(..span.start));
        let reason = plain_message(error.message());
        match before {
            Some(before) => ConfigError::invalid(line_after(path, before), reason),
            None => ConfigError::invalid(path.display(), reason),
        }
    }

    /// Creates the error for a file or variable whose content is not valid.
    pub(super) fn invalid(origin: impl Display, reason: impl Display) -> ConfigError {
        let (origin, reason) = (origin.to_string(), reason.to_string());
        ConfigError::Invalid { origin, reason }
    }
}

/// A file and its line that follows this part of its text.
pub(super) fn line_after(path: &Path, before: &str) -> String {
    format!("{}, line {}", path.display(), 1 + before.matches('\n').count())
}

/// Reads a text file of at most [`MAX_FILE`] bytes.
pub(super) fn read_text(path: &Path) -> Result<String, ConfigError> {
    Ok(files::read_text(path, MAX_FILE).map_err(cannot("read", path))?)
}
