//! The arguments of the requests, as an editor or a launch file writes them.

use super::Refusal;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::PathBuf;
use ts3100_proto::words::did_you_mean;

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

/// Attributes that editors have in every configuration, besides those that begin with two underscores.
const OF_EDITORS: &[&str] = &[
    "adapter",
    "build",
    "console",
    "debugServer",
    "internalConsoleOptions",
    "label",
    "lifecycleManagedByParent",
    "linux",
    "name",
    "noDebug",
    "order",
    "osx",
    "postDebugTask",
    "preLaunchTask",
    "presentation",
    "request",
    "serverReadyAction",
    "suppressDebugStatusbar",
    "suppressDebugToolbar",
    "suppressDebugView",
    "suppressMultipleSessionWarning",
    "suppressSaveBeforeStart",
    "timeout",
    "type",
    "windows",
];

/// Attributes of `launch` or `attach`.
pub(super) trait Attributes: DeserializeOwned {
    /// The name of each, with what it is.
    const KNOWN: &'static [(&'static str, &'static str)];

    /// Reads them. `warn` takes a warning about each unknown one, which has no effect.
    ///
    /// # Errors
    /// The first one whose value is something else.
    fn read(arguments: Value, request: &str, mut warn: impl FnMut(String)) -> Result<Self, Refusal> {
        let given = match &arguments {
            Value::Null => Map::new(),
            Value::Object(given) => given.clone(),
            Value::Bool(_) | Value::Number(_) | Value::String(_) | Value::Array(_) => {
                let place = format!("the arguments of `{request}`");
                return Err(not(&place, "an object", &arguments));
            }
        };
        let mut known = Map::new();
        for (name, value) in given {
            if let Some((_, expected)) = Self::KNOWN.iter().find(|(known, _)| *known == name) {
                // An editor may write down that an attribute has no value.
                if !value.is_null() {
                    let alone = serde_json::from_value::<Self>(json!({ name.as_str(): value }));
                    alone.map_err(|_| not(&format!("`{name}`"), expected, &value))?;
                    known.insert(name, value);
                }
            } else if !OF_EDITORS.contains(&name.as_str()) && !name.starts_with("__") {
                let hint = did_you_mean(&name, Self::KNOWN.iter().map(|(known, _)| *known));
                warn(format!(
                    "ignoring unknown attribute `{name}` of `{request}`{hint}"
                ));
            }
        }
        serde_json::from_value(Value::Object(known)).map_err(Refusal::new)
    }
}

/// Another value than the one that was expected.
fn not(place: &str, expected: &str, found: &Value) -> Refusal {
    const MOST: usize = 60;
    let mut found = found.to_string();
    if let Some((end, _)) = found.char_indices().nth(MOST) {
        found.truncate(end);
        found.push_str("...");
    }
    Refusal::new(format!("{place}: expected {expected}, found {found}"))
}

impl Attributes for LaunchArguments {
    const KNOWN: &'static [(&'static str, &'static str)] = &[
        ("program", "the path of a file"),
        ("recording", "the path of a transcript or a trace"),
        ("points", "the path of a table of points"),
        ("model", "the name of an arm, or the path of its file"),
        ("set", "a list of options such as [\"KEY=VALUE\"]"),
        ("input", "an object such as {\"ip1\": \"records.txt\"}"),
        ("din", "a list of input lines such as [8, 12]"),
        ("at", "a list such as [\"1.5 s: input 8 on\"]"),
        ("scenario", "the path of a scenario"),
        ("maxTime", "a duration such as \"3600s\""),
        ("stopOnEntry", "true or false"),
    ];
}

impl Attributes for AttachArguments {
    const KNOWN: &'static [(&'static str, &'static str)] = &[
        (
            "address",
            "an address such as \"127.0.0.1:3100\", or a port such as \"3100\"",
        ),
        ("robot", "the name of a robot"),
        ("token", "a text"),
        ("program", "the path of a file"),
    ];
}

/// A program to run in virtual time, or a recording to look at.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
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
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
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
    /// As the editor counts. Another value than a line leaves the other breakpoints alone.
    #[serde(default)]
    pub line: Value,
    pub condition: Option<String>,
    pub hit_condition: Option<String>,
    pub log_message: Option<String>,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The names of all attributes, as they are read.
    fn names(attributes: &impl Serialize) -> Vec<String> {
        let document = serde_json::to_value(attributes).unwrap();
        document.as_object().unwrap().keys().cloned().collect()
    }

    fn read<T: Attributes>(arguments: Value) -> (Result<T, String>, Vec<String>) {
        let mut told = Vec::new();
        let read = T::read(arguments, "launch", |warning| told.push(warning));
        (read.map_err(|refusal| refusal.to_string()), told)
    }

    #[test]
    fn every_attribute_is_known() {
        let known = |known: &[(&str, &str)]| {
            known
                .iter()
                .map(|(name, _)| (*name).to_owned())
                .collect::<Vec<_>>()
        };
        assert_eq!(names(&LaunchArguments::default()), known(LaunchArguments::KNOWN));
        assert_eq!(names(&AttachArguments::default()), known(AttachArguments::KNOWN));
    }

    #[test]
    fn a_value_of_another_type_is_told_with_its_attribute() {
        for (arguments, told) in [
            (
                json!({ "din": 8 }),
                "`din`: expected a list of input lines such as [8, 12], found 8",
            ),
            (
                json!({ "din": [-1] }),
                "`din`: expected a list of input lines such as [8, 12], found [-1]",
            ),
            (
                json!({ "program": true }),
                "`program`: expected the path of a file, found true",
            ),
            (
                json!({ "maxTime": 20 }),
                "`maxTime`: expected a duration such as \"3600s\", found 20",
            ),
            (
                json!([]),
                "the arguments of `launch`: expected an object, found []",
            ),
        ] {
            assert_eq!(read::<LaunchArguments>(arguments).0.unwrap_err(), told);
        }
        let long = json!({ "at": "é".repeat(100) });
        let told = read::<LaunchArguments>(long).0.unwrap_err();
        assert!(told.ends_with("..."), "{told}");
    }

    #[test]
    fn a_misspelt_attribute_is_told_and_those_of_editors_are_not() {
        let (read, told) = read::<LaunchArguments>(json!({
            "program": "pick.scol", "stopOnEntri": true, "request": "launch", "type": "scol", "name": "x", "points": null,
            "preLaunchTask": "build", "__sessionId": "7", "internalConsoleOptions": "neverOpen", "presentation": {}, "cwd": "/",
        }));
        assert_eq!(read.unwrap().program, Some(PathBuf::from("pick.scol")));
        assert_eq!(
            told,
            [
                "ignoring unknown attribute `stopOnEntri` of `launch`; did you mean `stopOnEntry`?",
                "ignoring unknown attribute `cwd` of `launch`",
            ]
        );
    }
}
