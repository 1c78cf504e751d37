//! The arguments of the requests, as an editor or a launch file writes them.

use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A message of the editor.
#[derive(Debug, Deserialize)]
pub(super) struct Request {
    pub seq: u64,
    #[serde(rename = "type")]
    pub kind: String,
    #[serde(default)]
    pub command: String,
    #[serde(default)]
    pub arguments: Value,
}

/// A program to run in virtual time, or a recording to look at.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub struct LaunchArguments {
    /// The file of the program.
    pub program: Option<PathBuf>,
    /// A transcript or trace, instead of a program.
    pub recording: Option<PathBuf>,
    /// A table of taught points; without it points.csv beside the program.
    pub points: Option<PathBuf>,
    /// Arm, as for `ts3100 run`.
    pub model: Option<String>,
    /// Named options, each KEY=VALUE.
    pub set: Vec<String>,
    /// A file of records for each channel from which the program reads.
    pub input: BTreeMap<String, PathBuf>,
    /// Input lines that are on from the start.
    pub din: Vec<u16>,
    /// What happens during the run, each as `1.5 s: input 8 on`.
    pub at: Vec<String>,
    /// A file that says what happens during the run.
    pub scenario: Option<PathBuf>,
    /// Longest run in virtual time, such as `3600s`.
    pub max_time: Option<String>,
    /// It stops before the first statement; a recording does by itself.
    pub stop_on_entry: Option<bool>,
}

/// An emulator that is running.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub struct AttachArguments {
    /// Address of its control interface; without it the emulator of this machine.
    pub address: Option<String>,
    /// Name of one robot of a cell.
    pub robot: Option<String>,
    /// Token of its control interface.
    pub token: Option<String>,
    /// The file of the editor that is the selected one.
    pub program: Option<PathBuf>,
}

/// All breakpoints of a file.
#[derive(Debug, Deserialize)]
pub(super) struct BreakpointsArguments {
    pub source: Value,
    #[serde(default)]
    pub breakpoints: Vec<SourceBreakpoint>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SourceBreakpoint {
    pub line: u32,
    pub condition: Option<String>,
    pub hit_condition: Option<String>,
    pub log_message: Option<String>,
}
