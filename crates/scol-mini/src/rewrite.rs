//! Writes new initial values into the source of a file, for RESTORE and for MW with the flag that restores into the file.
//!
//! Only the value changes; the layout of the line stays. Storing the file is left to the caller. Start with
//! [`rewrite_value`].

use crate::prelude::*;

use crate::diagnostic::{Sink, Span};
use crate::lines::line_end;
use crate::memory::{AccessError, Memory, check_kind, shared};
use crate::options::Arm;
use crate::parser::{Datum, Declaration, File, parse_file};
use crate::program::{Owner, Program};
use crate::value::{Position, Value, ValueKind};

/// The source with the initial value of `name` in GLOBAL or DATA replaced; everything else stays byte for byte.
///
/// The source must be the one `program` was compiled from, or a result of this function. A name of GLOBAL without an
/// initial value gets one; an element of an array gets a line of its own after the declaration if it has none.
/// A `WORK` line before a position stays. A taught point that the file does not define gets a line in its DATA.
/// (CMD-MW-02, CMD-MW-05)
///
/// # Errors
/// As [`Memory::set_global`](crate::Memory::set_global); `NotInSource` when the source does not declare the name,
/// `TooLarge` when a number cannot be written down.
pub fn rewrite_value(
    source: &str,
    program: &Program,
    name: &str,
    subscripts: &[i32],
    value: &Value,
) -> Result<String, AccessError> {
    let rewriter = Rewriter::new(source, program);
    let edit = rewriter.edit(name, subscripts, value)?;
    rewriter.apply(Vec::from([edit]))
}

/// The source with the values that `memory` holds for these names, or for all if there are none: those of GLOBAL that
/// have an initial value, and DATA. A value that is the one of the source already leaves it as it is (scol.md 13.4).
///
/// # Errors
/// As [`rewrite_value`].
pub fn restore_values(
    source: &str,
    program: &Program,
    memory: &Memory,
    names: &[String],
) -> Result<String, AccessError> {
    let rewriter = Rewriter::new(source, program);
    let mut edits = Vec::new();
    for (name, slot) in program.symbols.by_name() {
        let named = names.iter().any(|known| known == name);
        if !named && !names.is_empty() {
            continue;
        }
        // A taught point is not in the file yet; naming it puts it there.
        let put = named && slot.owner == Owner::Data && rewriter.datum(name).is_none();
        for index in 0..slot.length() {
            let Some(value) = memory.value(slot.base + index) else {
                continue;
            };
            let selected = named || slot.initial.iter().any(|(known, _)| *known == index);
            let first = slot.first_value(index);
            let same = first.is_some_and(|first| rewriter.same(&first, &value));
            if put || (selected && !same) {
                edits.push(rewriter.edit(name, &slot.subscripts(index), &value)?);
            }
        }
    }
    rewriter.apply(edits)
}

/// A change of the source.
enum Edit {
    /// Replaces a place of the source by a text.
    At(Span, String),
    /// A new line of DATA.
    Taught(String),
}

struct Rewriter<'a> {
    source: &'a str,
    program: &'a Program,
    file: File,
    arm: Arm,
}

impl<'a> Rewriter<'a> {
    fn new(source: &'a str, program: &'a Program) -> Rewriter<'a> {
        Rewriter {
            source,
            program,
            file: parse_file(source, &program.options, &mut Sink::new(source)),
            arm: program.options.arm,
        }
    }

    fn datum(&self, name: &str) -> Option<&Datum> {
        self.file.data.iter().find(|datum| datum.name.text == name)
    }

    /// Whether both have the same spelling; a position is written without its WORK.
    fn same(&self, a: &Value, b: &Value) -> bool {
        match (a, b) {
            (Value::Position(a), Value::Position(b)) => a.listed(self.arm) == b.listed(self.arm),
            _ => a == b,
        }
    }

    fn edit(&self, name: &str, subscripts: &[i32], value: &Value) -> Result<Edit, AccessError> {
        let (source, arm) = (self.source, self.arm);
        let (_, slot, _) = shared(self.program, name, subscripts)?;
        check_kind(slot, slot.kind, value)?;
        let name = slot.name.clone();
        let too_large = || AccessError::TooLarge(name.clone());
        if let Some(datum) = self.datum(&name) {
            let text = datum_text(source, datum, value, arm).ok_or_else(too_large)?;
            return Ok(Edit::At(datum.value, text));
        }
        if slot.owner == Owner::Data {
            let text = taught_text(value, arm).ok_or_else(too_large)?;
            return Ok(Edit::Taught(format!("POINT {name}={text}")));
        }
        let text = global_text(value, arm).ok_or_else(too_large)?;
        let site = self.global_site(&name, subscripts, &text);
        site.ok_or(AccessError::NotInSource(name))
    }

    /// The source with all changes.
    fn apply(&self, edits: Vec<Edit>) -> Result<String, AccessError> {
        let (mut changes, mut taught) = (Vec::new(), Vec::new());
        for edit in edits {
            match edit {
                Edit::At(span, text) => changes.push((span, text)),
                Edit::Taught(line) => taught.push(line),
            }
        }
        if !taught.is_empty() {
            changes.push(self.taught_site(&taught));
        }
        // Stable: elements of one array go after one line, in their order.
        changes.sort_by_key(|(span, _)| span.start);
        let lost = || AccessError::NotInSource(String::new());
        let (mut text, mut done) = (String::new(), 0);
        for (span, change) in changes {
            text.push_str(self.source.get(done..span.start).ok_or_else(lost)?);
            text.push_str(&change);
            done = span.end;
        }
        text.push_str(self.source.get(done..).ok_or_else(lost)?);
        Ok(text)
    }

    /// Edit that sets a value in GLOBAL.
    fn global_site(&self, name: &str, subscripts: &[i32], text: &str) -> Option<Edit> {
        let file = &self.file;
        let mine: Vec<&Declaration> = file.globals.iter().filter(|d| d.name.text == name).collect();
        let same = |d: &&&Declaration| {
            let known = d.subscripts.iter().map(|subscript| i64::from(*subscript));
            !d.dim && known.eq(subscripts.iter().map(|subscript| i64::from(*subscript)))
        };
        // The last line wins, as it does in the compiler.
        if let Some(found) = mine.iter().rev().find(same) {
            return Some(match &found.value {
                Some(value) => Edit::At(value.span, text.to_string()),
                None => Edit::At(Span::at(found.name.span.end), format!(" = {text}")),
            });
        }
        let last = mine.last()?;
        if subscripts.is_empty() {
            // DIM X AS REAL: the plain assignment declares as much; a DIM of several names cannot be split.
            let alone = file.globals.iter().filter(|d| d.line == last.line).count() == 1;
            return alone.then(|| Edit::At(last.line, format!("{name} = {text}")));
        }
        let (at, end) = line_end(self.source, last.line.end);
        let list: Vec<String> = subscripts.iter().map(ToString::to_string).collect();
        let line = format!("{end}{name}({}) = {text}", list.join(","));
        Some(Edit::At(Span::at(at), line))
    }

    /// Place of new lines of DATA, and the text to insert: after the heading, so that no WORK precedes them; without
    /// DATA, a block at the end of the file.
    fn taught_site(&self, lines: &[String]) -> (Span, String) {
        let source = self.source;
        let at_heading = self
            .file
            .data_heading
            .map(|heading| line_end(source, heading.end));
        let (_, end) = at_heading.unwrap_or_else(|| line_end(source, 0));
        let lines = lines.join(end);
        if let Some((at, end)) = at_heading {
            return (Span::at(at), format!("{end}{lines}"));
        }
        let at = source.find('\u{1A}').unwrap_or(source.len());
        let open = !source.get(..at).is_some_and(|text| text.ends_with(['\r', '\n']));
        let begin = if open { end } else { "" };
        let block = format!("{begin}DATA{end}{lines}{end}END{end}");
        (Span::at(at), block)
    }
}

/// A value as GLOBAL writes it.
fn global_text(value: &Value, arm: Arm) -> Option<String> {
    Some(match value {
        Value::Integer(value) => value.to_string(),
        Value::Real(value) if value.is_finite() => format!("{value:?}"),
        Value::Real(_) => return None,
        Value::Load(load) => format!("PAYLOAD({})", list(&load.listed(arm))?),
        Value::Coordinate(trans) => format!("TRANS({})", list(&trans.listed(arm))?),
        Value::Position(position) => {
            let numbers = coordinates(position, arm)?;
            let digits = if arm == Arm::SixAxis { 5 } else { 1 };
            format!("POINT({numbers},{:0digits$})", position.config.number_on(arm))
        }
    })
}

/// A value as DATA writes it; the braces of a load stay as they were.
fn datum_text(source: &str, datum: &Datum, value: &Value, arm: Arm) -> Option<String> {
    Some(match value {
        Value::Load(load) => {
            let numbers = list(&load.listed(arm))?;
            let braced = datum.value.text(source).starts_with('{');
            if braced { format!("{{{numbers}}}") } else { numbers }
        }
        Value::Coordinate(trans) => list(&trans.listed(arm))?,
        Value::Position(_) => taught_text(value, arm)?,
        Value::Integer(_) | Value::Real(_) => return None,
    })
}

/// A position as DATA writes it.
fn taught_text(value: &Value, arm: Arm) -> Option<String> {
    let Value::Position(position) = value else {
        return None;
    };
    let config = match (arm, position.config.number_on(arm)) {
        (_, 0) => String::new(),
        (Arm::SixAxis, number) => format!("{number:05}"),
        (Arm::Scara, 1) => "LEFTY".to_string(),
        (Arm::Scara, _) => "RIGHTY".to_string(),
    };
    Some(format!("{}/{config}", coordinates(position, arm)?))
}

/// The coordinates of a position, without its configuration.
fn coordinates(position: &Position, arm: Arm) -> Option<String> {
    list(position.coords.get(..ValueKind::Position.width(arm))?)
}

fn list(numbers: &[f64]) -> Option<String> {
    let numbers: Option<Vec<String>> = numbers.iter().map(|number| decimal(*number)).collect();
    Some(numbers?.join(","))
}

/// A number the lexer reads back; `None` beyond the range of a real.
fn decimal(number: f64) -> Option<String> {
    let size = libm::fabs(number);
    if size.is_nan() || size > f64::from(f32::MAX) {
        return None;
    }
    let plain = size == 0.0 || (1e-5..1e9).contains(&size);
    Some(if plain {
        format!("{number}")
    } else {
        format!("{number:e}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::value::{Configuration, Payload, Position, Trans};
    use crate::{LanguageOptions, Memory, compile};

    const SOURCE: &str = "global\r\n  a = 10   ' count\r\n  X=1.5\r\n B\r\n dim T(3) as real, U(1)\r\n\
        DIM S AS INTEGER\r\nEND\r\nPROGRAM P\r\nB=1\r\nEND\r\nDATA\r\nPOINT P1 = 1,,3/ ' taught\r\n\
        WORK W\r\nPOINT P2=1\r\nTRANS W=1,2\r\nPAYLOAD H={3,100}\r\nPAYLOAD G=5\r\nEND\r\n";

    fn rewrite(name: &str, subscripts: &[i32], value: &Value, from: &str, to: &str) {
        let options = LanguageOptions::default();
        let program = compile(SOURCE, &options).program.unwrap();
        let text = rewrite_value(SOURCE, &program, name, subscripts, value).unwrap();
        assert!(SOURCE.contains(from));
        assert_eq!(text, SOURCE.replacen(from, to, 1));
        let again = compile(&text, &options).program.unwrap();
        assert_eq!(
            Memory::new(&again).global(&again, name, subscripts).as_ref(),
            Ok(value),
            "{text}"
        );
        // A second rewrite works on the result of the first.
        assert_eq!(
            rewrite_value(&text, &program, name, subscripts, value).as_ref(),
            Ok(&text)
        );
    }

    // clause: CMD-MW-02 CMD-MW-05
    #[test]
    fn only_the_value_changes_and_reads_back() {
        rewrite("A", &[], &Value::Integer(-25), "a = 10 ", "a = -25 ");
        rewrite("x", &[], &Value::Real(1e20), "X=1.5", "X=1e20");
        rewrite("b", &[], &Value::Real(2.0), " B\r", " B = 2.0\r");
        rewrite("S", &[], &Value::Integer(4), "DIM S AS INTEGER", "S = 4");
        rewrite("t", &[2], &Value::Real(0.5), "U(1)\r\n", "U(1)\r\nT(2) = 0.5\r\n");
        let coords = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.5];
        let config = Configuration::from_number(12111).unwrap();
        let position = Value::from(Position {
            coords,
            config,
            work: None,
        });
        rewrite("P1", &[], &position, "1,,3/ ", "1,2,3,4,5,6,7,8.5/12111 ");
        let trans = Value::from(Trans {
            coords: [0.0, 1e9, -3.0, 0.0, 0.0, 1e-7],
        });
        rewrite("W", &[], &trans, "W=1,2", "W=0,1e9,-3,0,0,1e-7");
        let load = |mass| {
            Value::from(Payload {
                mass,
                ..Payload::default()
            })
        };
        rewrite("H", &[], &load(4.0), "{3,100}", "{4,0,0,0,0,0,0}");
        rewrite("G", &[], &load(4.0), "G=5", "G=4,0,0,0,0,0,0");
    }

    // clause: CMD-MW-06
    #[test]
    fn what_does_not_fit_is_refused() {
        let program = compile(SOURCE, &LanguageOptions::default()).program.unwrap();
        let at = |name: &str, subscripts: &[i32], value: Value| {
            rewrite_value(SOURCE, &program, name, subscripts, &value).unwrap_err()
        };
        assert!(matches!(
            at("NOPE", &[], Value::Integer(1)),
            AccessError::Unknown(_)
        ));
        assert!(matches!(
            at("A", &[], Value::Real(1.0)),
            AccessError::KindMismatch { .. }
        ));
        assert!(matches!(
            at("A", &[1], Value::Integer(1)),
            AccessError::NotArray(_)
        ));
        assert!(matches!(at("T", &[], Value::Real(1.0)), AccessError::IsArray(_)));
        assert!(matches!(
            at("T", &[4], Value::Real(1.0)),
            AccessError::Subscript(_)
        ));
        assert!(matches!(
            at("X", &[], Value::Real(f32::NAN)),
            AccessError::TooLarge(_)
        ));
        let other = rewrite_value("PROGRAM P\nEND\n", &program, "A", &[], &Value::Integer(1));
        assert!(matches!(other, Err(AccessError::NotInSource(_))));
        // One name of a DIM of several: an assignment instead of the line would lose the others.
        let source = "GLOBAL\nDIM A AS REAL, B AS REAL\nEND\nPROGRAM P\nEND\n";
        let program = compile(source, &LanguageOptions::default()).program.unwrap();
        for name in ["A", "B"] {
            let several = rewrite_value(source, &program, name, &[], &Value::Real(5.0));
            assert_eq!(several, Err(AccessError::NotInSource(name.to_string())));
        }
    }

    /// Source after a program has changed these data and RESTORE has written them.
    fn restored(statements: &str, names: &[&str]) -> String {
        let source = SOURCE.replace("B=1", &statements.replace('\n', "\r\n"));
        let points = crate::parse_points("Q,1,,,,,,,,\nR,2,,,,,,,,\n", Arm::SixAxis).unwrap();
        let options = LanguageOptions::default();
        let compilation = crate::compile_with_points(&source, &options, &points);
        let program = compilation.program.unwrap();
        let mut memory = Memory::new(&program);
        let mut machine = crate::Machine::main(program.clone());
        let end = machine.run(&mut memory, &crate::machine::NoInputs, &mut 100);
        assert_eq!(end, crate::Pause::Ended);
        let names: Vec<String> = names.iter().map(ToString::to_string).collect();
        let text = restore_values(&source, &program, &memory, &names).unwrap();
        // What was restored is what a start gives.
        let again = crate::compile_with_points(&text, &options, &points)
            .program
            .unwrap();
        let fresh = Memory::new(&again);
        for (name, info, _) in program.variables().filter(|(_, info, _)| !info.array) {
            if names.iter().any(|known| known == name) && info.kind != Some(crate::ValueKind::Position) {
                assert_eq!(
                    fresh.global(&again, name, &[]),
                    memory.global(&program, name, &[])
                );
            }
        }
        text.replace(&statements.replace('\n', "\r\n"), "B=1")
    }

    #[test]
    fn all_that_was_changed_goes_into_the_file_or_what_is_named() {
        let statements = "A = 25\nB = 2.5\nT(2) = 0.5\nT(1) = 7\nS = 4\nP1.X = 9\nR.X = 3\nW = TRANS(8)";
        let data = "DATA\r\nPOINT R=3,0,0,0,0,0,0,0/\r\nPOINT P1 = 9,0,3,0,0,0,0,0/ ' taught";
        // B, S and T have no initial value: only their names restore them.
        let expected = SOURCE
            .replace("a = 10 ", "a = 25 ")
            .replace("DATA\r\nPOINT P1 = 1,,3/ ' taught", data)
            .replace("W=1,2", "W=8,0,0,0,0,0");
        assert_eq!(restored(statements, &[]), expected);
        assert_eq!(restored("B = 1.5", &[]), SOURCE);
        let expected = SOURCE
            .replace(" B\r", " B = 2.5\r")
            .replace("U(1)\r\n", "U(1)\r\nT(1) = 7.0\r\nT(2) = 0.5\r\n")
            .replace("DIM S AS INTEGER", "S = 4");
        assert_eq!(restored(statements, &["B", "T", "S"]), expected);
        // A taught point that is named goes into the file as it is.
        let expected = SOURCE.replace("DATA\r\n", "DATA\r\nPOINT Q=1,0,0,0,0,0,0,0/\r\n");
        assert_eq!(restored(statements, &["Q"]), expected);
    }

    #[test]
    fn a_block_of_data_goes_before_the_end_of_the_file() {
        let points = crate::parse_points("Q,1,,,,,,,,\n", Arm::SixAxis).unwrap();
        let options = LanguageOptions::default();
        let block = "DATA\nPOINT Q=1,0,0,0,0,0,0,0/\nEND\n";
        for (code, line_end, end) in [
            ("PROGRAM P\nEND\n", "", ""),
            ("PROGRAM P\nEND\n", "", "\u{1A}"),
            ("PROGRAM P\nEND", "\n", "\u{1A}\n"),
        ] {
            let source = format!("{code}{end}");
            let program = crate::compile_with_points(&source, &options, &points).program;
            let program = program.unwrap();
            let text = restore_values(&source, &program, &Memory::new(&program), &["Q".to_string()]);
            let text = text.unwrap();
            assert_eq!(text, format!("{code}{line_end}{block}{end}"));
            // The compiler reads nothing after the end.
            let again = compile(&text, &options).program.unwrap();
            let point = Memory::new(&again).global(&again, "Q", &[]);
            assert_eq!(point, Memory::new(&program).global(&program, "Q", &[]));
        }
    }
}
