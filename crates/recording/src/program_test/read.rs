//! Reads a file of tests (TOML): unknown keys are errors, and every message names line and column.

use super::keys::{ENDINGS, TABLES};
use super::{ENDING, MAX_BYTES, MAX_TESTS, Place, Placed, ProgramTest, TestFile, TestPosition, Then};
use crate::scenario::read::{
    ReadResult, Value, action, array, check_keys, duration, entries, entries_of, expected, missing, string,
    sub_table, whole, wrong_words,
};
use crate::scenario::{Scenario, Start, Step};
use crate::table_error::{TableError, column_of, line_of};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, DeValue};
use ts3100_driver::files::{self, PathError, cannot};
use ts3100_proto::words::UnexpectedWord;

/// Why a file of tests cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum ProgramTestError {
    /// The file.
    #[error(transparent)]
    Io(#[from] PathError),
    #[error("{}:{}:{}: {reason}", path.display(), place.line, place.column)]
    Content {
        path: PathBuf,
        place: Place,
        reason: String,
    },
}

impl TestFile {
    /// Reads a file; paths in it are relative to it.
    ///
    /// # Errors
    /// [`ProgramTestError`], with line and column.
    pub fn read(path: &Path) -> Result<TestFile, ProgramTestError> {
        let text = files::read_text(path, MAX_BYTES).map_err(cannot("read the tests", path))?;
        TestFile::parse(path, &text)
    }

    /// Reads the tests of a text; `path` is its file.
    ///
    /// # Errors
    /// [`ProgramTestError`], with line and column.
    pub fn parse(path: &Path, text: &str) -> Result<TestFile, ProgramTestError> {
        let read = DeTable::parse(text).map_err(TableError::from);
        let read = read.and_then(|table| Reader { path, text }.file(table.get_ref()));
        read.map_err(|TableError(span, reason)| ProgramTestError::Content {
            path: path.to_path_buf(),
            place: place(text, span.start),
            reason,
        })
    }
}

fn place(text: &str, at: usize) -> Place {
    Place {
        line: line_of(text, at),
        column: column_of(text, at),
    }
}

/// The state before the start.
#[derive(Default)]
struct Given {
    start: Start,
    records: BTreeMap<String, Placed<Vec<String>>>,
    position: Option<Placed<TestPosition>>,
}

/// The file that is read.
struct Reader<'a> {
    path: &'a Path,
    text: &'a str,
}

impl Reader<'_> {
    fn file(&self, table: &DeTable<'_>) -> ReadResult<TestFile> {
        check_keys(&TABLES, "", table)?;
        let beside = |value: &Value<'_>| {
            let name = named(value, "the name of a file")?;
            self.placed(value, self.path.with_file_name(name))
        };
        let program = table.get("program").map(beside).transpose()?;
        let mut tests = Vec::new();
        let mut names = BTreeSet::new();
        let entries = entries(&TABLES, "test", table)?;
        if let Some((span, _)) = entries.get(MAX_TESTS) {
            let reason = format!("expected at most {MAX_TESTS} tests, found {}", entries.len());
            return Err(TableError(span.clone(), reason));
        }
        for (span, entry) in entries {
            let test = self.test(span.clone(), entry)?;
            if !names.insert(test.name.clone()) {
                let span = entry.get("name").map_or(span, Spanned::span);
                let reason = format!("the test `{}` appears twice; give it another name", test.name);
                return Err(TableError(span, reason));
            }
            tests.push(test);
        }
        if tests.is_empty() {
            return Err(TableError(
                0..0,
                "expected entries [[test]], found none".to_owned(),
            ));
        }
        let text = |value| self.placed(value, string(value)?);
        let options = table.get("options").map(array).transpose()?.unwrap_or_default();
        Ok(TestFile {
            path: self.path.to_path_buf(),
            program: program.unwrap_or_else(|| self.program()),
            model: table.get("model").map(text).transpose()?,
            points: table.get("points").map(beside).transpose()?,
            options: options.iter().map(text).collect::<ReadResult<_>>()?,
            tests,
        })
    }

    /// The program of the same name.
    fn program(&self) -> Placed<PathBuf> {
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        let stem = name
            .strip_suffix(ENDING)
            .or(name.strip_suffix(".toml"))
            .unwrap_or(&name);
        Placed {
            place: Place::default(),
            value: self.path.with_file_name(format!("{stem}.scol")),
        }
    }

    fn test(&self, span: Range<usize>, table: &DeTable<'_>) -> ReadResult<ProgramTest> {
        let Some(name) = table.get("name") else {
            return Err(missing(span, "`name`", "test", "none"));
        };
        let name = named(name, "what the test shows, in words")?;
        let mut scenario = Scenario {
            file: self.path.to_path_buf(),
            name: name.clone(),
            ..Scenario::default()
        };
        let given = table.get("given");
        let given = given.map(|given| self.given(sub_table(&TABLES, "test.given", given)?));
        let given = given.transpose()?.unwrap_or_default();
        scenario.start = given.start;
        if let Some(list) = table.get("at") {
            for value in array(list)? {
                let step = Step::parse(&string(value)?).map_err(|error| wrong_words(value, error))?;
                let line = line_of(self.text, value.span().start);
                let actions = step.actions.into_iter();
                let actions = actions.map(|action| action.at_line(line)).collect();
                scenario.steps.push(Step {
                    line,
                    actions,
                    ..step
                });
            }
        }
        entries_of(self.text, table, &mut scenario)?;
        let then = table.get("then");
        let then = then.map(|then| self.then(sub_table(&TABLES, "test.then", then)?));
        let call = table.get("call").map(|value| self.placed(value, string(value)?));
        let limit = table
            .get("limit")
            .map(|value| self.placed(value, duration(value)?));
        Ok(ProgramTest {
            name,
            place: place(self.text, span.start),
            call: call.transpose()?,
            records: given.records,
            position: given.position,
            scenario,
            limit: limit.transpose()?,
            then: then.transpose()?.unwrap_or_default(),
        })
    }

    fn given(&self, table: &DeTable<'_>) -> ReadResult<Given> {
        let mut start = Start::default();
        let mut add = |value, words: &str| -> ReadResult<()> {
            start.actions.push(action(self.text, value, words)?);
            Ok(())
        };
        let mut inputs = BTreeSet::new();
        for value in table.get("inputs").map(array).transpose()?.unwrap_or_default() {
            let line = whole(value)?;
            if !inputs.insert(line) {
                let reason = format!("expected each input once, found {line} again");
                return Err(TableError(value.span(), reason));
            }
            add(value, &format!("input {line} on"))?;
        }
        if let Some(value) = table.get("variables") {
            for (name, value) in variables(value)? {
                add(value, &format!("variable {name} {}", numbers(value)?.join(" ")))?;
            }
        }
        let records = table.get("records");
        let records = records.map(|value| self.channels("test.given.records", value));
        let place = table.get("position");
        let place = place.map(|value| self.placed(value, position(value)?));
        Ok(Given {
            start,
            records: records.transpose()?.unwrap_or_default(),
            position: place.transpose()?,
        })
    }

    fn then(&self, table: &DeTable<'_>) -> ReadResult<Then> {
        let mut then = Then::default();
        if let Some(value) = table.get("printed") {
            then.printed = self.channels("test.then.printed", value)?;
        }
        for (key, on) in [("outputs-on", true), ("outputs-off", false)] {
            for value in table.get(key).map(array).transpose()?.unwrap_or_default() {
                let line = whole(value)?;
                // What is no line is said as in an action.
                action(self.text, value, &format!("output {line} on"))?;
                let line = u16::try_from(line).map_err(|error| wrong_words(value, error))?;
                then.outputs.push(self.placed(value, (line, on))?);
            }
        }
        if let Some(value) = table.get("variables") {
            for (name, value) in variables(value)? {
                let numbers = reals(value)?;
                then.variables.push(self.placed(value, (name, numbers))?);
            }
        }
        if let Some(value) = table.get("position") {
            then.position = Some(self.placed(value, position(value)?)?);
        }
        if let Some(value) = table.get("tolerance") {
            let tolerance = number(value)?.parse().ok();
            let tolerance = tolerance.filter(|tolerance: &f64| *tolerance >= 0.0);
            let tolerance =
                tolerance.ok_or_else(|| expected(value, "a number of mm and degrees, 0 or more"))?;
            if then.position.is_none() {
                let reason = "expected `position` with `tolerance`, found `tolerance` alone".to_owned();
                return Err(TableError(value.span(), reason));
            }
            then.tolerance = Some(tolerance);
        }
        if let Some(value) = table.get("alarm") {
            let alarm = string(value)?;
            action(self.text, value, &format!("alarms raise {alarm}"))?;
            then.alarm = Some(self.placed(value, alarm)?);
        }
        if let Some(value) = table.get("within") {
            then.within = Some(self.placed(value, duration(value)?)?);
        }
        if let Some(value) = table.get("ending") {
            let ending = string(value)?;
            if !ENDINGS.contains(&ending.as_str()) {
                let wanted = format!("one of {}", ENDINGS.join(", "));
                return Err(wrong_words(value, UnexpectedWord::new(wanted, &ending)));
            }
            if then.alarm.is_some() && ending != "alarm" {
                let reason = format!("expected `ending = \"alarm\"` with `alarm`, found `{ending}`");
                return Err(TableError(value.span(), reason));
            }
            then.ending = Some(self.placed(value, ending)?);
        }
        Ok(then)
    }

    /// Lists of texts by channel.
    fn channels(&self, name: &str, value: &Value<'_>) -> ReadResult<BTreeMap<String, Placed<Vec<String>>>> {
        let table = sub_table(&TABLES, name, value)?.iter();
        let lists = table.map(|(channel, value)| {
            let lines = self.placed(value, texts(value)?)?;
            Ok((channel.get_ref().to_ascii_uppercase(), lines))
        });
        lists.collect()
    }

    fn placed<T>(&self, value: &Value<'_>, content: T) -> ReadResult<Placed<T>> {
        Ok(Placed {
            place: place(self.text, value.span().start),
            value: content,
        })
    }
}

/// Text that is not empty, or blank.
fn named(value: &Value<'_>, what: &str) -> ReadResult<String> {
    let name = string(value)?;
    if name.trim().is_empty() {
        let reason = format!("expected {what}, found `{name}`");
        return Err(TableError(value.span(), reason));
    }
    Ok(name)
}

fn position(value: &Value<'_>) -> ReadResult<TestPosition> {
    const WANTED: &str = "the name of a point or a list of coordinates";
    match value.get_ref() {
        DeValue::String(_) => named(value, WANTED).map(TestPosition::Named),
        DeValue::Array(list) if list.is_empty() => Err(wrong_words(
            value,
            format_args!("expected {WANTED}, as in [400, 0, 200], found an empty list"),
        )),
        DeValue::Array(_) => reals(value).map(TestPosition::Coordinates),
        DeValue::Integer(_)
        | DeValue::Float(_)
        | DeValue::Boolean(_)
        | DeValue::Datetime(_)
        | DeValue::Table(_) => Err(expected(value, WANTED)),
    }
}

fn texts(value: &Value<'_>) -> ReadResult<Vec<String>> {
    array(value)?.iter().map(string).collect()
}

/// The variables of a table, whose keys are names.
fn variables<'a>(value: &'a Value<'a>) -> ReadResult<Vec<(String, &'a Value<'a>)>> {
    let DeValue::Table(table) = value.get_ref() else {
        return Err(expected(
            value,
            "variables with their values, as in { COUNT = 3 }",
        ));
    };
    let pairs = table
        .iter()
        .map(|(name, value)| (name.get_ref().to_string(), value));
    Ok(pairs.collect())
}

/// The words of one number or of a list.
fn numbers(value: &Value<'_>) -> ReadResult<Vec<String>> {
    if let DeValue::Array(list) = value.get_ref() {
        if list.is_empty() {
            let reason = "expected a number or a list of numbers, found an empty list";
            return Err(wrong_words(value, reason));
        }
        return list.iter().map(number).collect();
    }
    Ok(vec![number(value)?])
}

/// The same as numbers.
fn reals(value: &Value<'_>) -> ReadResult<Vec<f64>> {
    let numbers = numbers(value)?;
    let reals = numbers.iter().map(|number| number.parse());
    let reals: Result<Vec<f64>, _> = reals.collect();
    reals.map_err(|error| wrong_words(value, error))
}

fn number(value: &Value<'_>) -> ReadResult<String> {
    if let DeValue::Integer(number) = value.get_ref()
        && number.radix() == 10
    {
        return Ok(number.as_str().to_owned());
    }
    if let DeValue::Float(number) = value.get_ref() {
        // TOML has nan and inf, and 1e999 is as large.
        let is_finite = number.as_str().parse().is_ok_and(f64::is_finite);
        return match is_finite {
            true => Ok(number.as_str().to_owned()),
            false => Err(expected(value, "a finite number")),
        };
    }
    Err(expected(value, "a number"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::keys::KeyValue;

    fn read(text: &str) -> Result<TestFile, String> {
        TestFile::parse(Path::new("cell/pick.test.toml"), text).map_err(|error| error.to_string())
    }

    /// A value that a key accepts, and some that it must refuse.
    fn examples(value: KeyValue) -> (&'static str, &'static [&'static str]) {
        match value {
            KeyValue::Text => ("\"2-046\"", &["3", "[\"A\"]"]),
            KeyValue::Texts => ("[\"1 s: servo on\"]", &["\"A\"", "[3]"]),
            KeyValue::Time => ("\"1.5 s\"", &["3", "\"3\""]),
            KeyValue::Lines => ("[5]", &["5", "[\"5\"]", "[65]", "[-1]"]),
            KeyValue::Words(_) => ("\"alarm\"", &["\"alarms\"", "3"]),
            KeyValue::Number => ("0.5", &["\"1\"", "-1", "nan", "inf"]),
            KeyValue::Variables => (
                "{ A = 1, \"B(2)\" = [1.5, 2] }",
                &[
                    "3",
                    "{ A = \"1\" }",
                    "{ A = true }",
                    "{ A = [] }",
                    "{ A = nan }",
                    "{ A = [1, -inf] }",
                ],
            ),
            KeyValue::Place => ("\"P1\"", &["3", "[\"A\"]", "[]", "\"\"", "[1, nan]", "[1e999]"]),
            KeyValue::Table | KeyValue::Tables => ("", &["3"]),
            KeyValue::Condition | KeyValue::Actions | KeyValue::Flag | KeyValue::Whole(_) => ("", &[]),
        }
    }

    /// What the rows say, which the schema is made from, holds for the reader.
    #[test]
    fn a_key_accepts_what_its_row_says() {
        for table in TABLES {
            for key in table.keys {
                let with = |value: &str| {
                    let name = if key.name == "name" { "" } else { "name = \"x\"\n" };
                    let place = if key.name == "tolerance" {
                        "position = \"P\"\n"
                    } else {
                        ""
                    };
                    let line = format!("{} = {value}\n", key.name);
                    read(&match table.name {
                        "" => format!("{line}[[test]]\n{name}"),
                        "test" => format!("[[test]]\n{name}{line}"),
                        inner => format!("[[test]]\n{name}[{inner}]\n{place}{line}"),
                    })
                };
                let (right, wrong) = examples(key.value);
                if !right.is_empty() {
                    let found = with(right);
                    assert!(
                        found.is_ok(),
                        "[{}] {} = {right}: {found:?}",
                        table.name,
                        key.name
                    );
                }
                for wrong in wrong {
                    assert!(with(wrong).is_err(), "[{}] {} = {wrong}", table.name, key.name);
                }
            }
        }
    }

    #[test]
    fn a_test_without_more_has_defaults() {
        let file = read("[[test]]\nname = \"x\"\n").unwrap();
        assert_eq!(file.program.value, Path::new("cell/pick.scol"));
        let test = &file.tests[0];
        assert_eq!(
            (&test.limit, &test.then, &test.call),
            (&None, &Then::default(), &None)
        );
        let named = read("program = \"a.scol\"\npoints = \"p.csv\"\n[[test]]\nname = \"x\"\n").unwrap();
        assert_eq!(named.program.value, Path::new("cell/a.scol"));
        let points = named.points.unwrap();
        assert_eq!(points.value, Path::new("cell/p.csv"));
        assert_eq!(points.place, Place { line: 2, column: 10 });
    }

    #[test]
    fn what_is_wrong_has_a_line_and_a_column() {
        for (text, message) in [
            ("", "1:1: expected entries [[test]], found none"),
            (
                "[[test]]\nnam = \"x\"",
                "2:1: unknown key `nam` in [test]; did you mean `name`?",
            ),
            (
                "[[test]]\ncall = \"A()\"",
                "1:1: expected `name` in [[test]], found none",
            ),
            (
                "[[test]]\nname = \"x\"\nthen.printd.tp = []",
                "3:6: unknown key `printd` in [test.then]; did you mean `printed`?",
            ),
            (
                "[[test]]\nname = \"x\"\nthen.tolerance = 1",
                "3:18: expected `position` with `tolerance`, found `tolerance` alone",
            ),
            (
                "[[test]]\nname = \"x\"\nthen = { alarm = \"2-046\", ending = \"end\" }",
                "3:36: expected `ending = \"alarm\"` with `alarm`, found `end`",
            ),
            (
                "[[test]]\nname = \"x\"\n[[test.do]]\nwhen = \"output 5 on\"",
                "3:1: expected `actions` in [[do]], found none",
            ),
            ("[[test]]\nname = ", "2:8: "),
            (
                "[[test]]\nname = \" \"",
                "2:8: expected what the test shows, in words, found ` `",
            ),
            (
                "points = \"\"\n[[test]]\nname = \"x\"",
                "1:10: expected the name of a file, found ``",
            ),
            (
                "[[test]]\nname = \"x\"\nthen.position = []",
                "3:17: expected the name of a point or a list of coordinates, as in [400, 0, 200], found an empty list",
            ),
            (
                "[[test]]\nname = \"x\"\ngiven.variables = { A = 1,\n B = +inf }",
                "4:6: expected a finite number, found +inf",
            ),
            (
                "[[test]]\nname = \"x\"\nthen.variables.A = 1e999",
                "3:20: expected a finite number, found 1e999",
            ),
            (
                "[[test]]\nname = \"x\"\nthen.variables.A = []",
                "3:20: expected a number or a list of numbers, found an empty list",
            ),
            (
                "[[test]]\nname = \"x\"\n[[test]]\nname = \"x\"",
                "4:8: the test `x` appears twice; give it another name",
            ),
        ] {
            let error = read(text).unwrap_err();
            assert!(
                error.starts_with(&format!("cell/pick.test.toml:{message}")),
                "{error}"
            );
        }
    }
}
