//! `docs/reference/controls.json` and the page beside it: every operation of the OpenAPI document with its control and with the
//! commands of `ctl` that make it. Both are made from the table of controls, the document and the commands themselves:
//!
//! ```sh
//! cargo test -p ts3100-emulator -- --ignored bless_controls
//! ```

use super::args::{Command as CtlCommand, CtlArgs};
use super::call::Call;
use crate::cli::mcp::tests::{self as assistants, MadeCall};
use clap::{Arg, Args as _, Command, FromArgMatches as _};
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;
use ts3100_controller::controls::{BUTTONS, SWITCHES, ValueType};

const JSON: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/reference/controls.json");
const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/reference/controls.md");
const OPEN_API: &str = include_str!("../../../../control/assets/openapi.json");

/// An operation of the OpenAPI document.
struct Operation {
    id: String,
    method: String,
    path: String,
    summary: String,
}

impl Operation {
    /// Whether a call is of this operation.
    fn is_of(&self, method: &str, path: &str) -> bool {
        let path = path.split('?').next().unwrap_or_default();
        let mut segments = path.split('/');
        let fits = self.path.split('/').all(|part| {
            let segment = segments.next();
            part.starts_with('{') && segment.is_some() || segment == Some(part)
        });
        self.method == method && fits && segments.next().is_none()
    }
}

fn operations() -> Vec<Operation> {
    let document: Value = serde_json::from_str(OPEN_API).unwrap();
    let mut operations = Vec::new();
    for (path, item) in document["paths"].as_object().unwrap() {
        for (method, operation) in item.as_object().unwrap() {
            operations.push(Operation {
                id: operation["operationId"].as_str().unwrap().to_owned(),
                method: method.to_ascii_uppercase(),
                path: path.clone(),
                summary: operation["summary"].as_str().unwrap().to_owned(),
            });
        }
    }
    operations
}

/// A word that the argument accepts.
fn sample(argument: &Arg) -> Vec<String> {
    let words: Vec<String> = argument
        .get_possible_values()
        .iter()
        .map(|value| value.get_name().to_owned())
        .collect();
    if !words.is_empty() {
        return words;
    }
    let word = match argument.get_id().as_str() {
        "axis" | "line" | "lines" | "number" | "value" | "count" | "seconds" | "percent" => "5",
        "time" => "5 s",
        "hex" => "02",
        "condition" => "idle",
        "spec" => "ng:command=SU",
        "file" => "x.txt",
        "mode" => "auto",
        "path" => "../../docs/reference/config.schema.json",
        _ => "A",
    };
    let mut words = vec![word.to_owned()];
    if argument.get_id() == "value" {
        // Of a position.
        words.push("teach".to_owned());
    }
    words
}

/// The words of a command line with those that are shown for it.
type Line = Vec<(String, String)>;

/// The commands below one, without `list`: the noun alone does the same.
fn shown_below(command: &Command) -> impl Iterator<Item = &Command> {
    command.get_subcommands().filter(|below| !below.is_hide_set())
}

/// Command lines below a command, each with the fewest and with the most positional arguments.
fn lines(command: &Command, before: &Line, found: &mut Vec<Line>) {
    let mut prefixes = vec![before.clone()];
    let arguments: Vec<&Arg> = command.get_positionals().collect();
    for argument in &arguments {
        if !argument.is_required_set() && (!command.is_subcommand_required_set()) {
            found.extend(prefixes.iter().cloned());
        }
        let name = argument.get_value_names().and_then(|names| names.first());
        let shown = name.map_or_else(
            || argument.get_id().as_str().to_ascii_uppercase(),
            ToString::to_string,
        );
        let is_choice = !argument.get_possible_values().is_empty();
        let add = |prefix: &Line| {
            let words = sample(argument).into_iter();
            let shown = shown.clone();
            let line = words.map(move |word| {
                let mut line = prefix.clone();
                let is_word = is_choice || word == "teach";
                line.push((word.clone(), if is_word { word } else { shown.clone() }));
                line
            });
            line.collect::<Vec<_>>()
        };
        prefixes = prefixes.iter().flat_map(add).collect();
    }
    for prefix in &prefixes {
        if !command.is_subcommand_required_set() {
            found.push(prefix.clone());
        }
        for below in shown_below(command) {
            let mut line = prefix.clone();
            line.push((below.get_name().to_owned(), below.get_name().to_owned()));
            lines(below, &line, found);
        }
    }
    if !arguments.is_empty() {
        for below in shown_below(command) {
            let mut line = before.clone();
            line.push((below.get_name().to_owned(), below.get_name().to_owned()));
            lines(below, &line, found);
        }
    }
}

/// The commands of `ctl` by the operation that each makes.
fn commands(operations: &[Operation]) -> BTreeMap<String, Vec<String>> {
    let command = CtlArgs::augment_args(Command::new("ctl")).disable_help_subcommand(true);
    let mut all = Vec::new();
    lines(&command, &Line::new(), &mut all);
    let mut found: BTreeMap<String, Vec<Vec<String>>> = BTreeMap::new();
    for line in all {
        let words = line.iter().map(|(word, _)| word.as_str());
        let Ok(matches) = command
            .clone()
            .try_get_matches_from(["ctl"].into_iter().chain(words))
        else {
            continue;
        };
        let args = CtlArgs::from_arg_matches(&matches).unwrap();
        if matches!(args.command, CtlCommand::Call { .. }) {
            continue;
        }
        let Ok(call) = Call::from_command(&args.command, false) else {
            continue;
        };
        let Some(operation) = operations
            .iter()
            .find(|operation| operation.is_of(call.method, &call.path))
        else {
            panic!(
                "ctl {line:?} makes {} {}, which no operation is",
                call.method, call.path
            );
        };
        let shown = line.into_iter().map(|(_, shown)| shown).collect();
        add(found.entry(operation.id.clone()).or_default(), shown);
    }
    let joined = |lines: Vec<Vec<String>>| lines.iter().map(|words| words.join(" ")).collect();
    found.into_iter().map(|(id, lines)| (id, joined(lines))).collect()
}

/// Adds a command line; one that differs from another in one word alone becomes a choice there: `servo on|off`.
fn add(lines: &mut Vec<Vec<String>>, line: Vec<String>) {
    for known in &mut *lines {
        let differ = |at: &usize| known.get(*at) != line.get(*at);
        let at: Vec<usize> = (0..known.len().max(line.len())).filter(differ).collect();
        if let [at] = at[..]
            && let Some(word) = line.get(at)
            && let Some(choice) = known.get_mut(at)
        {
            if !choice.split('|').any(|known| known == word) {
                *choice = format!("{choice}|{word}");
            }
            return;
        }
        if at.is_empty() {
            return;
        }
    }
    lines.push(line);
}

/// The control of an operation: its name, and its text form where the operation does something.
fn control_of(operation: &Operation) -> Option<(&'static str, Option<&'static str>)> {
    let switch = SWITCHES.iter().find(|switch| switch.path == operation.path);
    let button = BUTTONS.iter().find(|button| button.path == operation.path);
    let of_switch = switch.map(|switch| (switch.name(), (operation.method != "GET").then_some(switch.form)));
    of_switch.or_else(|| button.map(|button| (button.form, Some(button.form))))
}

fn document() -> String {
    let operations = operations();
    let mut commands = commands(&operations);
    let tools = assistants::calls();
    let mut rows = Vec::new();
    for operation in &operations {
        let mut row = Map::new();
        row.insert("operation".into(), json!(operation.id));
        row.insert("method".into(), json!(operation.method));
        row.insert("path".into(), json!(operation.path));
        row.insert("summary".into(), json!(operation.summary));
        if let Some((control, form)) = control_of(operation) {
            row.insert("control".into(), json!(control));
            if let Some(form) = form {
                row.insert("form".into(), json!(form));
            }
        }
        row.insert(
            "ctl".into(),
            json!(commands.remove(&operation.id).unwrap_or_default()),
        );
        let of_operation = |(_, method, path): &&MadeCall| operation.is_of(method, path);
        let tools: BTreeSet<&str> = tools
            .iter()
            .filter(of_operation)
            .map(|(tool, ..)| *tool)
            .collect();
        row.insert("assistants".into(), json!(tools));
        rows.push(Value::Object(row));
    }
    serde_json::to_string_pretty(&rows).unwrap() + "\n"
}

fn page() -> String {
    let mut page = String::from(
        "# Controls\n\nEvery switch and button of the robot has one name: on the [command line](ctl.md), in [scenarios](scenarios.md) and \
         transcripts, over\n[HTTP](control-interface.md), and in each client. `ts3100 ctl servo` shows a switch, `ts3100 ctl servo on` sets it; \
         over HTTP these are\n`GET /servo` and `PUT /servo` with `{\"on\": true}`. This page is made from the table of controls.\n\n\
         ## Switches\n\n\
         | Switch | Values | HTTP | JSON | Without power | What it does |\n|---|---|---|---|---|---|\n",
    );
    let more = |doc: &[&str]| {
        doc.iter()
            .map(|line| line.trim())
            .collect::<Vec<_>>()
            .join(" ")
            .replace("  ", ". ")
    };
    for switch in SWITCHES {
        let values = match &switch.value {
            ValueType::State | ValueType::Choice => {
                let words = switch.all_words().map(|word| format!("`{word}`"));
                words.collect::<Vec<_>>().join(", ")
            }
            ValueType::Number(range) => format!("{} to {}", range.start(), range.end()),
        };
        let json = match switch.value {
            ValueType::State => format!("`{}`: the first is `true`", switch.field),
            ValueType::Choice => format!("`{}`: the word", switch.field),
            ValueType::Number(_) => format!("`{}`: the number", switch.field),
        };
        let power = if switch.needs_power { "refused" } else { "works" };
        let (name, path, doc) = (switch.name(), switch.path, more(switch.doc));
        let _ = writeln!(
            page,
            "| `{name}` | {values} | `{path}` | {json} | {power} | {doc} |"
        );
    }
    page += "\n## Buttons\n\n| Button | HTTP | Without power | What it does |\n|---|---|---|---|\n";
    for button in BUTTONS {
        let power = if button.needs_power { "refused" } else { "works" };
        let (form, path, doc) = (button.form, button.path, more(button.doc));
        let _ = writeln!(page, "| `{form}` | `POST {path}` | {power} | {doc} |");
    }
    page += "\n## Every operation\n\nLines, variables, files, faults, snapshots and the clock have calls of their own. The same list for programs: \
             [controls.json](controls.json).\n\n| Call | `ts3100 ctl` | What it does |\n|---|---|---|\n";
    let rows: Vec<Map<String, Value>> = serde_json::from_str(&document()).unwrap();
    for row in rows {
        let text = |key: &str| row[key].as_str().unwrap_or_default().to_owned();
        let commands = row["ctl"].as_array().unwrap().iter();
        let commands =
            commands.map(|line| format!("`{}`", line.as_str().unwrap_or_default().replace('|', "\\|")));
        let commands = commands.collect::<Vec<_>>().join("<br>");
        let _ = writeln!(
            page,
            "| `{} {}` | {commands} | {} |",
            text("method"),
            text("path"),
            text("summary")
        );
    }
    page
}

fn is_current(path: &str, made: &str) {
    let kept = fs::read_to_string(path).unwrap_or_default();
    assert!(
        kept == made,
        "{path} is not what the table says; cargo test -p ts3100-emulator -- --ignored bless_controls"
    );
}

#[test]
fn the_list_and_the_page_of_controls_are_those_of_the_table() {
    is_current(JSON, &document());
    is_current(PAGE, &page());
}

#[test]
#[ignore = "writes docs/reference/controls.json and controls.md"]
fn bless_controls() {
    fs::write(JSON, document()).unwrap();
    fs::write(PAGE, page()).unwrap();
}

#[test]
fn each_row_of_the_table_is_an_operation_and_a_command() {
    let operations = operations();
    let commands = commands(&operations);
    let made = |id: &str, line: &str| {
        let lines = commands
            .get(id)
            .unwrap_or_else(|| panic!("no command makes {id}"));
        assert!(
            lines.iter().any(|known| known == line),
            "{id}: {line} is not among {lines:?}"
        );
    };
    for switch in SWITCHES {
        made(&format!("get_{}", switch.operation), switch.name());
        let lines = &commands[&format!("put_{}", switch.operation)];
        assert_eq!(lines.len(), 1, "{lines:?}");
        assert!(lines[0].starts_with(switch.name()), "{lines:?}");
    }
    for button in BUTTONS {
        made(button.operation, button.form);
    }
}
