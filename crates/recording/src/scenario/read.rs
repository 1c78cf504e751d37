//! Reads a scenario file (TOML): unknown keys are errors, and every message names the line. Actions are read by
//! `action`, conditions by the controller.

use super::action::{ScenarioAction, ScenarioActionError};
use super::keys::{TABLES, Table};
use super::{Expectation, ExpectationKind, MAX_BYTES, MAX_ENTRIES, Scenario, Start, Step, StepTrigger};
use crate::table_error::{TableError, line_of};
use std::fmt::Display;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Duration;
use toml::Spanned;
use toml::de::{DeTable, DeValue};
use ts3100_controller::time::{DurationError, parse_duration};
use ts3100_controller::{Condition, ConditionParseError, PanelAction};
use ts3100_driver::files::{self, PathError, cannot};
use ts3100_proto::words::{Word, did_you_mean_or};

/// Words that a SCOL program begins with.
const SCOL_WORDS: [&str; 4] = ["PROGRAM", "GLOBAL", "REMARK", "DATA"];
/// Longest time a scenario can name.
const MAX_DURATION: Duration = Duration::from_secs(365 * 86_400);

/// Why a scenario cannot be played.
#[derive(Debug, thiserror::Error)]
pub enum ScenarioError {
    /// The file.
    #[error(transparent)]
    Io(#[from] PathError),
    #[error("{}, line {line}: {reason}", path.display())]
    Content {
        path: PathBuf,
        /// Its line, from 1.
        line: usize,
        reason: String,
    },
}

/// Why words are not a step at a time.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum StepParseError {
    #[error("expected a time, a colon and an action, as in `1.5 s: input 8 on`")]
    NoColon,
    #[error(transparent)]
    Time(#[from] DurationError),
    #[error("expected a time of at most 365 days")]
    TooLate,
    #[error(transparent)]
    Action(#[from] ScenarioActionError),
}

pub(crate) type ReadResult<T> = Result<T, TableError>;
pub(crate) type Value<'a> = Spanned<DeValue<'a>>;

impl Scenario {
    /// Reads a file; paths in it are relative to it.
    ///
    /// # Errors
    /// [`ScenarioError`], with the line.
    pub fn read(path: &Path) -> Result<Scenario, ScenarioError> {
        let text = files::read_text(path, MAX_BYTES).map_err(cannot("read the scenario", path))?;
        Scenario::parse(path, &text)
    }

    /// Reads a scenario; `origin` is its file, and paths are relative to the directory of that file.
    ///
    /// # Errors
    /// [`ScenarioError`], with the line.
    pub fn parse(origin: &Path, text: &str) -> Result<Scenario, ScenarioError> {
        let read = DeTable::parse(text)
            .map_err(|error| syntax_error(text, error))
            .and_then(|table| scenario(origin, text, table.get_ref()));
        read.map_err(|TableError(span, reason)| ScenarioError::Content {
            path: origin.to_path_buf(),
            line: line_of(text, span.start),
            reason,
        })
    }
}

impl Step {
    /// Reads a step at a time, as a command line has it: `1.5 s: input 8 on`.
    ///
    /// # Errors
    pub fn parse(words: &str) -> Result<Step, StepParseError> {
        let (time, action) = words.split_once(':').ok_or(StepParseError::NoColon)?;
        let time = parse_duration(time.trim())?;
        if time > MAX_DURATION {
            return Err(StepParseError::TooLate);
        }
        Ok(Step {
            line: 0,
            trigger: StepTrigger::At(time),
            times: 1,
            actions: vec![ScenarioAction::parse(action.trim())?],
        })
    }
}

/// Whether a text that is not TOML is a SCOL program.
pub fn is_program(text: &str) -> bool {
    let first = text.lines().map(str::trim).find(|line| !line.is_empty());
    let word = first.and_then(|line| line.split_whitespace().next());
    word.is_some_and(|word| SCOL_WORDS.iter().any(|known| known.eq_ignore_ascii_case(word)))
}

/// The error of the TOML parser, or that the file is a program.
fn syntax_error(text: &str, error: toml::de::Error) -> TableError {
    if is_program(text) {
        let reason = "this is a SCOL program, not a scenario: load it with `--load`";
        return TableError(0..0, reason.to_owned());
    }
    error.into()
}

fn scenario(origin: &Path, text: &str, table: &DeTable<'_>) -> ReadResult<Scenario> {
    check_keys(&TABLES, "", table)?;
    let stem = origin.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let mut scenario = Scenario {
        file: origin.to_path_buf(),
        name: table.get("name").map_or(Ok(stem.unwrap_or_default()), string)?,
        start: Start::default(),
        steps: Vec::new(),
        expectations: Vec::new(),
    };
    if let Some(start) = table.get("start") {
        let folder = origin.parent().unwrap_or(Path::new(""));
        scenario.start = parse_start(text, folder, sub_table(&TABLES, "start", start)?)?;
    }
    entries_of(text, table, &mut scenario)?;
    Ok(scenario)
}

/// Reads what happens and what is expected: the entries `[[do]]`, `[[expect]]` and `[[never]]` of a table.
pub(crate) fn entries_of(text: &str, table: &DeTable<'_>, scenario: &mut Scenario) -> ReadResult<()> {
    for entry in entries(&TABLES, "do", table)? {
        scenario.steps.push(step(text, entry)?);
    }
    for kind in ["expect", "never"] {
        for entry in entries(&TABLES, kind, table)? {
            scenario.expectations.push(expectation(kind, text, entry)?);
        }
    }
    scenario.expectations.sort_by_key(|expectation| expectation.line);
    let count = scenario.steps.len() + scenario.expectations.len();
    if count > MAX_ENTRIES {
        return Err(TableError(
            0..0,
            format!("expected at most {MAX_ENTRIES} entries, found {count}"),
        ));
    }
    Ok(())
}

/// The entries `[[name]]`, each with its place.
pub(crate) fn entries<'a>(
    tables: &[Table],
    name: &str,
    table: &'a DeTable<'a>,
) -> ReadResult<Vec<(Range<usize>, &'a DeTable<'a>)>> {
    let Some(value) = table.get(name) else {
        return Ok(Vec::new());
    };
    let DeValue::Array(array) = value.get_ref() else {
        return Err(expected(value, &format!("tables [[{name}]]")));
    };
    let entry = |value: &'a Value<'a>| Ok((value.span(), sub_table(tables, name, value)?));
    array.iter().map(entry).collect()
}

fn parse_start(text: &str, folder: &Path, table: &DeTable<'_>) -> ReadResult<Start> {
    let path = |value: &Value<'_>| string(value).map(|path| folder.join(path));
    let at_panel = |value: &Value<'_>, panel| {
        let line = line_of(text, value.span().start);
        ScenarioAction::at_panel(panel).at_line(line)
    };
    let mut actions = Vec::new();
    if let Some(value) = table.get("key-switch") {
        actions.push(at_panel(value, PanelAction::Key(word(value)?)));
    }
    if let Some(value) = table.get("control-right") {
        actions.push(at_panel(value, PanelAction::ControlRight(word(value)?)));
    }
    if let Some(value) = table.get("inputs") {
        for value in array(value)? {
            actions.push(action(text, value, &format!("input {} on", whole(value)?))?);
        }
    }
    if let Some(value) = table.get("servo-on") {
        let DeValue::Boolean(on) = value.get_ref() else {
            return Err(expected(value, "true or false"));
        };
        actions.push(at_panel(value, PanelAction::Servo(*on)));
    }
    let load = table.get("load").map(array).transpose()?;
    Ok(Start {
        restore: table.get("restore").map(path).transpose()?,
        load: load.into_iter().flatten().map(path).collect::<ReadResult<_>>()?,
        select: table.get("select").map(string).transpose()?,
        actions,
    })
}

fn step(text: &str, (span, table): (Range<usize>, &DeTable<'_>)) -> ReadResult<Step> {
    let after = table.get("after").map(duration).transpose()?;
    let times = table.get("times").map(whole).transpose()?;
    let on = match (table.get("at"), table.get("when")) {
        (Some(at), None) => {
            if let Some(surplus) = table.get("after").or(table.get("times")) {
                let reason = "expected `at` alone, found `after` or `times`; use them with `when`";
                return Err(TableError(surplus.span(), reason.to_owned()));
            }
            StepTrigger::At(duration(at)?)
        }
        (None, Some(when)) => StepTrigger::When(condition(when)?, after.unwrap_or_default()),
        (at, _) => {
            let found = if at.is_some() { "both" } else { "neither" };
            return Err(missing(span, "`at` or `when`", "do", found));
        }
    };
    let Some(actions) = table.get("actions") else {
        return Err(missing(span, "`actions`", "do", "none"));
    };
    let one = |value| action(text, value, &string(value)?);
    Ok(Step {
        line: line_of(text, span.start),
        trigger: on,
        times: times.unwrap_or(1),
        actions: array(actions)?.iter().map(one).collect::<ReadResult<_>>()?,
    })
}

fn expectation(
    kind: &str,
    text: &str,
    (span, table): (Range<usize>, &DeTable<'_>),
) -> ReadResult<Expectation> {
    let Some(what) = table.get("what") else {
        return Err(missing(span, "`what`", kind, "none"));
    };
    let what = condition(what)?;
    let after = table.get("after").map(condition).transpose()?;
    let expected = if kind == "never" {
        ExpectationKind::Never {
            until: table.get("until").map(condition).transpose()?,
        }
    } else {
        let times = table.get("times").map_or(Ok(1), whole)?;
        if times == 0 {
            let reason =
                "expected 1 or more times, found 0; write [[never]] for a condition that must not happen";
            return Err(TableError(span, reason.to_owned()));
        }
        ExpectationKind::Occurs {
            times,
            within: table.get("within").map(duration).transpose()?,
        }
    };
    let name = table.get("name");
    Ok(Expectation {
        line: line_of(text, span.start),
        name: name.map_or_else(|| Ok(format!("{kind} {what}")), string)?,
        condition: what,
        after,
        kind: expected,
    })
}

pub(crate) fn sub_table<'a>(
    tables: &[Table],
    name: &str,
    value: &'a Value<'a>,
) -> ReadResult<&'a DeTable<'a>> {
    let DeValue::Table(table) = value.get_ref() else {
        return Err(expected(value, &format!("a table [{name}]")));
    };
    check_keys(tables, name, table)?;
    Ok(table)
}

/// Every key of the table is one of those of its name.
pub(crate) fn check_keys(tables: &[Table], name: &str, table: &DeTable<'_>) -> ReadResult<()> {
    let rows = tables.iter().filter(|row| row.name == name);
    let keys: Vec<&str> = rows.flat_map(|row| row.keys).map(|key| key.name).collect();
    for (key, _) in table {
        let found = key.get_ref();
        if keys.contains(&found.as_ref()) {
            continue;
        }
        let place = match name {
            "" => "the file".to_owned(),
            name => format!("[{name}]"),
        };
        let otherwise = format!("; expected {}", keys.join(", "));
        let hint = did_you_mean_or(found, keys.iter().copied(), otherwise);
        let reason = format!("unknown key `{found}` in {place}{hint}");
        return Err(TableError(key.span(), reason));
    }
    Ok(())
}

pub(crate) fn missing(span: Range<usize>, keys: &str, table: &str, found: &str) -> TableError {
    TableError(span, format!("expected {keys} in [[{table}]], found {found}"))
}

pub(crate) fn expected(value: &Value<'_>, what: &str) -> TableError {
    let found = match value.get_ref() {
        DeValue::String(text) => format!("`{text}`"),
        DeValue::Integer(number) => number.to_string(),
        DeValue::Float(number) => number.to_string(),
        DeValue::Boolean(is) => is.to_string(),
        DeValue::Datetime(_) => "a date".to_owned(),
        DeValue::Array(_) => "an array".to_owned(),
        DeValue::Table(_) => "a table".to_owned(),
    };
    TableError(value.span(), format!("expected {what}, found {found}"))
}

pub(crate) fn wrong_words(value: &Value<'_>, error: impl Display) -> TableError {
    TableError(value.span(), error.to_string())
}

/// An action in the words of a value of the text.
pub(crate) fn action(text: &str, value: &Value<'_>, words: &str) -> ReadResult<ScenarioAction> {
    let action = ScenarioAction::parse(words).map_err(|error| wrong_words(value, error))?;
    Ok(action.at_line(line_of(text, value.span().start)))
}

fn word<T: Word>(value: &Value<'_>) -> ReadResult<T> {
    T::read(&string(value)?).map_err(|error| wrong_words(value, error))
}

pub(crate) fn string(value: &Value<'_>) -> ReadResult<String> {
    let DeValue::String(text) = value.get_ref() else {
        return Err(expected(value, "text"));
    };
    Ok(text.as_ref().to_owned())
}

pub(crate) fn array<'a>(value: &'a Value<'a>) -> ReadResult<&'a [Value<'a>]> {
    let DeValue::Array(array) = value.get_ref() else {
        return Err(expected(value, "an array"));
    };
    Ok(array)
}

pub(crate) fn whole(value: &Value<'_>) -> ReadResult<u32> {
    if let DeValue::Integer(number) = value.get_ref()
        && let Ok(number) = u32::from_str_radix(number.as_str(), number.radix())
    {
        return Ok(number);
    }
    Err(expected(value, "a whole number"))
}

fn condition(value: &Value<'_>) -> ReadResult<Condition> {
    let condition = string(value)?.parse();
    condition.map_err(|error: ConditionParseError| wrong_words(value, error))
}

pub(crate) fn duration(value: &Value<'_>) -> ReadResult<Duration> {
    if let DeValue::Integer(number) = value.get_ref() {
        let reason = format!("expected a time with its unit, found {number}; write \"{number} s\"");
        return Err(TableError(value.span(), reason));
    }
    let text = string(value)?;
    let time = parse_duration(&text).map_err(|error| wrong_words(value, error))?;
    if time > MAX_DURATION {
        return Err(expected(value, "a time of at most 365 days"));
    }
    Ok(time)
}
