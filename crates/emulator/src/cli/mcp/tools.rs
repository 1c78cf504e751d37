//! The tools of an assistant, one row each: what it is told about them, and the calls they make.

use super::Robot;
use crate::cli::{controls, docs};
use serde_json::{Value, json};
use std::fmt;
use std::time::Duration;
use ts3100_book::book;
use ts3100_control::MAX_SECONDS;
use ts3100_controller::Condition;
use ts3100_controller::controls::{BUTTONS, SWITCHES, Switch};
use ts3100_proto::words::{did_you_mean, did_you_mean_or};
use ts3100_recording::uri::percent_encoded;

/// Longest time that a call may take: a wait, and what it takes to answer.
pub(super) const LONGEST_CALL: Duration = Duration::from_secs(70);
/// Longest wait of a tool in seconds of wall-clock time.
const LONGEST_WAIT: f64 = 60.0;

/// Why a tool did nothing.
#[derive(Debug, thiserror::Error)]
pub(super) enum ToolError {
    /// No emulator answers.
    #[error("{0}")]
    Unreachable(String),
    /// The emulator refused it.
    #[error("refused: {0}")]
    Refused(String),
    /// An argument is missing, unknown or of another type.
    #[error("argument `{name}`: {problem}")]
    Argument {
        /// Its name.
        name: String,
        problem: String,
    },
    /// The program has errors.
    #[error("the program has errors and was not stored:\n{0:#}")]
    Program(Value),
}

/// Types of arguments.
#[derive(Clone, Copy)]
enum ArgumentType {
    Text,
    /// Seconds, from 0 to this.
    Seconds(f64),
    /// A whole number, from 0 to this.
    Whole(u32),
    Switch,
}

impl ArgumentType {
    /// The name in schemas.
    fn schema(self) -> &'static str {
        match self {
            ArgumentType::Text => "string",
            ArgumentType::Seconds(_) => "number",
            ArgumentType::Whole(_) => "integer",
            ArgumentType::Switch => "boolean",
        }
    }

    fn fits(self, value: &Value) -> bool {
        match self {
            ArgumentType::Text => value.is_string(),
            ArgumentType::Seconds(most) => value
                .as_f64()
                .is_some_and(|number| (0.0..=most).contains(&number)),
            // JSON does not distinguish 5 and 5.0.
            ArgumentType::Whole(most) => {
                let number = value.as_f64();
                number
                    .is_some_and(|number| number.fract() == 0.0 && (0.0..=f64::from(most)).contains(&number))
            }
            ArgumentType::Switch => value.is_boolean(),
        }
    }
}

impl fmt::Display for ArgumentType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ArgumentType::Text => f.write_str("a string"),
            ArgumentType::Seconds(most) => write!(f, "a number of seconds from 0 to {most}"),
            ArgumentType::Whole(most) => write!(f, "a whole number from 0 to {most}"),
            ArgumentType::Switch => f.write_str("true or false"),
        }
    }
}

/// An argument.
pub(super) struct Argument {
    name: &'static str,
    kind: ArgumentType,
    is_required: bool,
    about: &'static str,
    /// The end of `about`, where a table has it.
    more: Option<fn() -> String>,
}

/// A tool.
pub(super) struct Tool {
    pub(super) name: &'static str,
    about: &'static str,
    arguments: &'static [Argument],
    pub(super) run: fn(&Robot<'_>, &Value) -> Result<Value, ToolError>,
}

const fn required(name: &'static str, kind: ArgumentType, about: &'static str) -> Argument {
    Argument {
        name,
        kind,
        is_required: true,
        about,
        more: None,
    }
}

const fn optional(name: &'static str, kind: ArgumentType, about: &'static str) -> Argument {
    Argument {
        is_required: false,
        ..required(name, kind, about)
    }
}

const SOURCE: Argument = required(
    "source",
    ArgumentType::Text,
    "The program in SCOL, with line ends",
);
const SECONDS: Argument = optional(
    "seconds",
    ArgumentType::Seconds(LONGEST_WAIT),
    "Longest wait in seconds, at most 60; virtual seconds with a stepped clock; default 10",
);

pub(super) const TOOLS: &[Tool] = &[
    Tool {
        name: "state",
        about: "The whole state of the robot: modes, servo power, emergency stop, selected program with its line and status, \
                alarms, position, clock",
        arguments: &[],
        run: |robot, _| robot.call("GET", "/state", None),
    },
    Tool {
        name: "check_program",
        about: "Errors and warnings of a SCOL program, with line, column, message and help. Nothing is stored",
        arguments: &[SOURCE],
        run: |robot, arguments| {
            robot.call(
                "POST",
                "/check",
                Some(json!({ "text": text(arguments, "source") })),
            )
        },
    },
    Tool {
        name: "load_program",
        about: "Store a SCOL program on the RAM drive and select it. If it has errors, it is not stored, and the answer lists them",
        arguments: &[
            required(
                "name",
                ArgumentType::Text,
                "Name of the file, for example PICK: a letter, then letters and digits, at most 8",
            ),
            SOURCE,
        ],
        run: load_program,
    },
    Tool {
        name: "read_file",
        about: "The content of a file of the RAM drive; without a name the list of files",
        arguments: &[optional("name", ArgumentType::Text, "Name of the file")],
        run: |robot, arguments| match arguments.get("name").and_then(Value::as_str) {
            Some(name) => robot.call("GET", &format!("/files/{}", percent_encoded(name)), None),
            None => robot.call("GET", "/files", None),
        },
    },
    Tool {
        name: "run_program",
        about: "Start the selected program and wait for a condition, by default until it has stopped. Servo power has to be on. \
                The answer says whether the condition was met, and has the state",
        arguments: &[
            optional(
                "condition",
                ArgumentType::Text,
                "Condition to wait for: idle, status stop (reset), output 5 on, input 3 off, alarm 2-046, line 12 ...; default idle",
            ),
            SECONDS,
        ],
        run: run_program,
    },
    Tool {
        name: "stop_program",
        about: "Press STOP: the program stops after the present statement",
        arguments: &[],
        run: |robot, _| robot.call("POST", "/program/stop", Some(json!({}))),
    },
    Tool {
        name: "advance_clock",
        about: "Advance virtual time. With --time stepped nothing happens without it",
        arguments: &[required(
            "seconds",
            ArgumentType::Seconds(MAX_SECONDS),
            "Virtual seconds",
        )],
        run: |robot, arguments| {
            let body = json!({ "seconds": arguments["seconds"] });
            robot.call("POST", "/clock/advance", Some(body))
        },
    },
    Tool {
        name: "panel",
        about: "Set a switch of the panel, or press a button",
        arguments: &[
            Argument {
                more: Some(controls_and_values),
                ..required("control", ArgumentType::Text, "Its name; each with its values: ")
            },
            optional(
                "value",
                ArgumentType::Text,
                "The value; for a button its second word",
            ),
        ],
        run: panel,
    },
    Tool {
        name: "set_input",
        about: "Drive a digital input of the robot",
        arguments: &[
            required("line", ArgumentType::Whole(65_535), "Number of the input"),
            required("on", ArgumentType::Switch, "On or off"),
        ],
        run: |robot, arguments| {
            let line = arguments["line"].as_f64().unwrap_or_default();
            let path = format!("/inputs/{line}");
            robot.call("PUT", &path, Some(json!({ "on": arguments["on"] })))
        },
    },
    Tool {
        name: "lines",
        about: "All inputs and outputs by number and name",
        arguments: &[],
        run: |robot, _| robot.call("GET", "/lines", None),
    },
    Tool {
        name: "variables",
        about: "The variables of the selected program",
        arguments: &[],
        run: |robot, _| robot.call("GET", "/variables", None),
    },
    Tool {
        name: "alarms",
        about: "Active alarms and the history, each with cause and remedy",
        arguments: &[],
        run: |robot, _| robot.call("GET", "/alarms", None),
    },
    Tool {
        name: "position",
        about: "The posture of the arm: joints, and the tool point in the world",
        arguments: &[],
        run: |robot, _| robot.call("GET", "/arm/pose", None),
    },
    Tool {
        name: "findings",
        about: "Protocol mistakes of a host program: rule, message, bytes, remedy. A finding with caused-by comes from an armed fault",
        arguments: &[],
        run: |robot, _| robot.call("GET", "/findings", None),
    },
    Tool {
        name: "explain",
        about: "Explain a code or a word: a finding, a diagnostic, an alarm, an option, a command of the protocol, a statement",
        arguments: &[required(
            "code",
            ArgumentType::Text,
            "Code, for example answer-early, E0101, 2-046, text.end, RN or MOVEJ",
        )],
        run: |_, arguments| explain(text(arguments, "code")),
    },
    Tool {
        name: "documentation",
        about: "Read the documentation of the emulator: a page or a section of it in Markdown, or the sections that have certain \
                words. Without arguments it lists the pages",
        arguments: &[
            optional(
                "topic",
                ArgumentType::Text,
                "Page or section, for example reference/scol/motion or alarms#reset",
            ),
            optional("search", ArgumentType::Text, "Words to search for"),
        ],
        run: |_, arguments| documentation(text(arguments, "topic"), text(arguments, "search")),
    },
    Tool {
        name: "traffic",
        about: "The transcript: every text of every port with its time, newest last",
        arguments: &[optional(
            "lines",
            ArgumentType::Whole(u32::MAX),
            "Maximum number of lines, from the end; default 60",
        )],
        run: traffic,
    },
];

impl Tool {
    /// Description of the tool for `tools/list`.
    pub(super) fn description(&self) -> Value {
        let properties = self.arguments.iter().map(|argument| {
            let more = argument.more.map(|more| more()).unwrap_or_default();
            let about = format!("{}{more}", argument.about);
            let schema = json!({ "type": argument.kind.schema(), "description": about });
            (argument.name.to_owned(), schema)
        });
        let required = self.arguments.iter().filter(|argument| argument.is_required);
        json!({
            "name": self.name,
            "description": self.about,
            "inputSchema": {
                "type": "object",
                "properties": properties.collect::<serde_json::Map<_, _>>(),
                "required": required.map(|argument| argument.name).collect::<Vec<_>>(),
                "additionalProperties": false,
            },
        })
    }

    /// Whether these are its arguments.
    ///
    /// # Errors
    /// One is missing, unknown or of another type.
    pub(super) fn check(&self, arguments: &Value) -> Result<(), ToolError> {
        if !arguments.is_null() && !arguments.is_object() {
            return Err(wrong(
                "arguments",
                format!("expected an object, found {arguments}"),
            ));
        }
        for (name, value) in arguments.as_object().into_iter().flatten() {
            match self.arguments.iter().find(|argument| argument.name == name) {
                Some(argument) if argument.kind.fits(value) => {}
                Some(argument) => {
                    let expected = argument.kind;
                    return Err(wrong(name, format!("expected {expected}, found {value}")));
                }
                None => {
                    let known: Vec<&str> = self.arguments.iter().map(|argument| argument.name).collect();
                    let listed = match known.is_empty() {
                        true => format!("; {} has no arguments", self.name),
                        false => format!("; {} has {}", self.name, known.join(", ")),
                    };
                    let hint = did_you_mean_or(name, known, listed);
                    return Err(wrong(name, format!("unknown{hint}")));
                }
            }
        }
        let is_missing =
            |argument: &&Argument| argument.is_required && arguments.get(argument.name).is_none();
        match self.arguments.iter().find(is_missing) {
            Some(argument) => Err(wrong(argument.name, format!("missing: {}", argument.about))),
            None => Ok(()),
        }
    }
}

fn wrong(name: &str, problem: String) -> ToolError {
    let name = name.to_owned();
    ToolError::Argument { name, problem }
}

fn text<'a>(arguments: &'a Value, name: &str) -> &'a str {
    arguments.get(name).and_then(Value::as_str).unwrap_or_default()
}

fn load_program(robot: &Robot<'_>, arguments: &Value) -> Result<Value, ToolError> {
    let (name, source) = (text(arguments, "name"), text(arguments, "source"));
    let remarks = robot.call("POST", "/check", Some(json!({ "text": source })))?;
    let mut all = remarks.as_array().into_iter().flatten();
    if all.any(|remark| remark.get("severity").and_then(Value::as_str) == Some("error")) {
        return Err(ToolError::Program(remarks));
    }
    let path = format!("/files/{}", percent_encoded(name));
    robot.call("PUT", &path, Some(json!({ "text": source })))?;
    robot.call("POST", &format!("{path}/select"), Some(json!({})))?;
    Ok(json!({ "selected": name, "warnings": remarks }))
}

fn run_program(robot: &Robot<'_>, arguments: &Value) -> Result<Value, ToolError> {
    let condition = match text(arguments, "condition") {
        "" => "idle",
        condition => condition,
    };
    let seconds = arguments.get("seconds").and_then(Value::as_f64).unwrap_or(10.0);
    // Refused later, it would leave the program running.
    let known = condition.parse::<Condition>();
    known.map_err(|error| wrong("condition", error.to_string()))?;
    robot.call("POST", "/program/start", Some(json!({})))?;
    // A stepped clock stands still while somebody only waits.
    let clock = robot.call("GET", "/clock", None)?;
    let path = match clock.get("mode").and_then(Value::as_str) {
        Some("stepped") => "/clock/advance-until",
        _ => "/wait",
    };
    let body = json!({ "condition": condition, "within": seconds, "wall": LONGEST_WAIT });
    let waited = robot.call("POST", path, Some(body))?;
    let state = robot.call("GET", "/state", None)?;
    Ok(json!({ "waited": waited, "state": state }))
}

fn panel(robot: &Robot<'_>, arguments: &Value) -> Result<Value, ToolError> {
    let (control, value) = (text(arguments, "control"), text(arguments, "value"));
    let form = format!("{control} {value}");
    let form = form.trim_end();
    if let Some(button) = BUTTONS.iter().find(|button| button.form == form) {
        return robot.call("POST", button.path, Some(json!({})));
    }
    let Some(switch) = SWITCHES.iter().find(|switch| switch.name() == control) else {
        let known = BUTTONS.iter().map(|button| button.form);
        let known = known.chain(SWITCHES.iter().map(Switch::name));
        let hint = did_you_mean(form, known);
        return Err(wrong("control", format!("there is no control `{form}`{hint}")));
    };
    let body = controls::body(switch, value).map_err(|error| wrong("value", error.to_string()))?;
    robot.call("PUT", switch.path, Some(body))
}

/// The controls with their values, for the description of the tool.
fn controls_and_values() -> String {
    let switches = SWITCHES.iter().map(|switch| switch.form);
    let buttons = BUTTONS.iter().map(|button| button.form);
    switches.chain(buttons).collect::<Vec<_>>().join(", ")
}

fn explain(code: &str) -> Result<Value, ToolError> {
    let passages = book().explain(code);
    if passages.is_empty() {
        let hint = book().unknown_code_hint(code);
        return Err(wrong("code", format!("unknown code `{code}`{hint}")));
    }
    Ok(passages.iter().map(docs::passage_json).collect())
}

fn documentation(topic: &str, words: &str) -> Result<Value, ToolError> {
    if !words.is_empty() {
        return Ok(docs::search_json(words));
    }
    if topic.is_empty() {
        return Ok(docs::pages_json());
    }
    let passage = book().find(topic);
    let passage = passage.map_err(|error| wrong("topic", error.to_string()))?;
    Ok(Value::String(passage.text))
}

fn traffic(robot: &Robot<'_>, arguments: &Value) -> Result<Value, ToolError> {
    let most = arguments.get("lines").and_then(Value::as_f64).unwrap_or(60.0);
    let whole = robot.call("GET", "/transcript", None)?;
    let whole = whole.as_str().unwrap_or_default();
    let lines: Vec<&str> = whole.lines().collect();
    // Whole, and the cast saturates.
    let from = lines.len().saturating_sub(most as usize);
    Ok(Value::String(lines.get(from..).unwrap_or_default().join("\n")))
}
