//! Points that are taught on the controller and are not in the DATA of a file (scol.md 13.14), and the table in which the
//! maker's tool keeps them.
//!
//! The caller supplies the table; a compilation takes the points as a list.

use crate::prelude::*;
use alloc::collections::BTreeSet;

use crate::builtin;
use crate::options::Arm;
use crate::value::{Configuration, Position, ValueKind};
use crate::{MAX_DATA_NAME, MAX_POINTS};

/// A position that every program of a file finds under its name, unless the file has data of that name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TaughtPoint {
    /// In upper case, at most [`MAX_DATA_NAME`] characters.
    pub name: String,
    pub position: Position,
}

impl TaughtPoint {
    /// Whether a table of points can hold it: a name that a file could give it, numbers in range, no WORK.
    pub fn is_valid(&self, arm: Arm) -> bool {
        let Position { coords, config, work } = &self.position;
        let mut numbers = coords.iter().map(|number| libm::fabs(*number));
        let numbers = numbers.all(|number| number <= f64::from(f32::MAX));
        let name = is_name(&self.name) && !builtin::is_reserved(&self.name, arm);
        name && numbers && config.is_valid() && work.is_none()
    }
}

/// Whether a name of DATA can be spelt so, in upper case.
fn is_name(name: &str) -> bool {
    let is_letter = |b: u8| b.is_ascii_uppercase() || b.is_ascii_digit() || b == b'_';
    name.starts_with(|c: char| c.is_ascii_uppercase())
        && name.bytes().all(is_letter)
        && name.len() <= MAX_DATA_NAME
}

/// Error in a table of points, with its place.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{line}:{column}: expected {expected}, found {found}")]
pub struct PointsError {
    /// Line, from 1.
    pub line: usize,
    /// Character of the line, from 1.
    pub column: usize,
    pub expected: String,
    pub found: String,
}

/// Reads a table of points: `NAME,X,Y,Z,C,T,CONFIG` a line, with eight coordinates on a six-axis arm.
///
/// A first line with these words is a heading. Coordinates left out are 0; CONFIG is a word, a number, or empty for
/// undefined.
///
/// # Errors
/// [`PointsError`] of the first line that is not a point.
pub fn parse_points(table: &str, arm: Arm) -> Result<Vec<TaughtPoint>, PointsError> {
    let table = table.strip_prefix('\u{FEFF}').unwrap_or(table);
    let mut points = Vec::new();
    let mut names = BTreeSet::new();
    let lines = table.lines().enumerate();
    let lines = lines.filter(|(_, text)| !text.trim().is_empty());
    let mut rows = lines.map(|(at, text)| Row::new(text, at + 1)).peekable();
    if let Some(heading) = rows.next_if(|row| row.field(0).eq_ignore_ascii_case("NAME")) {
        heading.heading(arm)?;
    }
    for row in rows {
        if points.len() >= MAX_POINTS {
            return Err(row.wrong(0, format!("at most {MAX_POINTS} points")));
        }
        let point = row.point(arm)?;
        if !names.insert(point.name.clone()) {
            return Err(row.wrong(0, "a name that did not occur before"));
        }
        points.push(point);
    }
    Ok(points)
}

/// The words of the heading.
fn columns(arm: Arm) -> Vec<&'static str> {
    let letters = arm.coordinates().split("").filter(|letter| !letter.is_empty());
    ["NAME"].into_iter().chain(letters).chain(["CONFIG"]).collect()
}

/// A line, cut at its commas.
struct Row<'a> {
    line: usize,
    /// Fields without blanks and double quotes around them, each with the character it begins at.
    fields: Vec<(usize, &'a str)>,
}

impl<'a> Row<'a> {
    fn new(text: &'a str, line: usize) -> Row<'a> {
        let mut column = 1;
        let fields = text.split(',').map(|field| {
            let blanks = field.chars().take_while(|c| c.is_whitespace()).count();
            // Spreadsheets put fields between quotes.
            let text = field.trim();
            let quoted = text.strip_prefix('"').and_then(|text| text.strip_suffix('"'));
            let place = match quoted.filter(|text| !text.contains('"')) {
                Some(text) => (column + blanks + 1, text.trim()),
                None => (column + blanks, text),
            };
            column += field.chars().count() + 1;
            place
        });
        Row {
            line,
            fields: fields.collect(),
        }
    }

    fn field(&self, at: usize) -> &'a str {
        self.fields.get(at).map_or("", |(_, text)| text)
    }

    fn wrong(&self, at: usize, expected: impl Into<String>) -> PointsError {
        let (column, found) = self.fields.get(at).copied().unwrap_or((1, ""));
        PointsError {
            line: self.line,
            column,
            expected: expected.into(),
            found: match found {
                "" => "nothing".to_string(),
                text => format!("`{}`", escaped(text)),
            },
        }
    }

    fn width(&self, arm: Arm) -> Result<(), PointsError> {
        let (columns, found) = (columns(arm), self.fields.len());
        if found == columns.len() {
            return Ok(());
        }
        let at = found.min(columns.len()).saturating_sub(1);
        let found = match found {
            1 if self.field(0).contains(';') => "semicolons between them".to_string(),
            1 => "1 field".to_string(),
            _ => format!("{found} fields"),
        };
        Err(PointsError {
            found,
            ..self.wrong(
                at,
                format!(
                    "{} fields with commas between them, {}",
                    columns.len(),
                    columns.join(",")
                ),
            )
        })
    }

    fn heading(&self, arm: Arm) -> Result<(), PointsError> {
        self.width(arm)?;
        for (at, column) in columns(arm).into_iter().enumerate() {
            if !self.field(at).eq_ignore_ascii_case(column) {
                return Err(self.wrong(at, format!("the heading {column}")));
            }
        }
        Ok(())
    }

    fn point(&self, arm: Arm) -> Result<TaughtPoint, PointsError> {
        self.width(arm)?;
        let name = self.field(0).to_ascii_uppercase();
        if !is_name(&name) {
            let expected = format!("a name of at most {MAX_DATA_NAME} letters and digits");
            return Err(self.wrong(0, expected));
        }
        if builtin::is_reserved(&name, arm) {
            return Err(self.wrong(0, "a name other than a word of the language"));
        }
        let mut position = Position::default();
        let width = ValueKind::Position.width(arm);
        for (at, coordinate) in position.coords.iter_mut().take(width).enumerate() {
            *coordinate = match self.field(at + 1) {
                "" => 0.0,
                text => number(text).ok_or_else(|| self.wrong(at + 1, "a number"))?,
            };
        }
        position.config = configuration(self.field(width + 1), arm).ok_or_else(|| {
            let expected = match arm {
                Arm::SixAxis => {
                    "a configuration: five digits 0 to 2, five letters (for example LAFSS), or nothing"
                }
                Arm::Scara => "a configuration: LEFTY, RIGHTY, FREE, 0 to 2, or nothing",
            };
            self.wrong(width + 1, expected)
        })?;
        Ok(TaughtPoint { name, position })
    }
}

/// A field as a message shows it: control codes are written out, quotes stay.
fn escaped(text: &str) -> String {
    let parts = text.split_inclusive('"');
    let parts = parts.map(|part| match part.strip_suffix('"') {
        Some(part) => format!("{}\"", part.escape_debug()),
        None => part.escape_debug().to_string(),
    });
    parts.collect()
}

/// A number in the range of a real.
fn number(text: &str) -> Option<f64> {
    let number = text.parse::<f64>().ok();
    number.filter(|number| libm::fabs(*number) <= f64::from(f32::MAX))
}

fn configuration(text: &str, arm: Arm) -> Option<Configuration> {
    if text.is_empty() {
        return Some(Configuration::default());
    }
    let digits = text.len() <= 5 && text.bytes().all(|b| b.is_ascii_digit());
    let number = match digits {
        true => text.parse().ok()?,
        false => i64::from(builtin::configuration(&text.to_ascii_uppercase(), arm)?),
    };
    Configuration::listed(arm, number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_has_a_point_a_line() {
        let table = "\u{FEFF}Name,X,Y,Z,C,T,Config\r\nP000,123.000,456.000,10.000,0.000,0.000,RIGHTY\r\n\r\n\
            p1, -1 ,,2e1,,,lefty\nP2,,,,,,\nP3,1,2,3,4,5,2";
        let points = parse_points(table, Arm::Scara).unwrap();
        let listed: Vec<(&str, Vec<f64>)> = points
            .iter()
            .map(|point| (point.name.as_str(), point.position.listed(Arm::Scara)))
            .collect();
        let expected = [
            ("P000", [123.0, 456.0, 10.0, 0.0, 0.0, 2.0]),
            ("P1", [-1.0, 0.0, 20.0, 0.0, 0.0, 1.0]),
            ("P2", [0.0; 6]),
            ("P3", [1.0, 2.0, 3.0, 4.0, 5.0, 2.0]),
        ];
        assert_eq!(listed, expected.map(|(name, numbers)| (name, numbers.to_vec())));
        for (config, number) in [
            ("12111", 12_111.0),
            ("LAxxx", 11_000.0),
            ("lanss", 11_111.0),
            ("", 0.0),
        ] {
            let points = parse_points(&format!("A,1,2,3,4,5,6,7,8,{config}\n"), Arm::SixAxis).unwrap();
            assert_eq!(points[0].position.listed(Arm::SixAxis)[8], number, "{config}");
        }
        assert_eq!(parse_points("", Arm::Scara), Ok(Vec::new()));
        let quoted = "\"NAME\",\"X\",\"Y\",\"Z\",\"C\",\"T\",\"CONFIG\"\n\"P000\", \"123.000\" ,456,10,\"\",0,\"RIGHTY\"\n";
        assert_eq!(parse_points(quoted, Arm::Scara).unwrap(), points[..1]);
    }

    #[test]
    fn what_is_no_point_is_told_with_its_place() {
        let row = "P0,1,2,3,4,5,RIGHTY\n";
        for (arm, table, message) in [
            (
                Arm::Scara,
                "P1,1,2,3,4,5",
                "1:12: expected 7 fields with commas between them, NAME,X,Y,Z,C,T,CONFIG, found 6 fields",
            ),
            (
                Arm::SixAxis,
                row,
                "1:14: expected 10 fields with commas between them, NAME,X,Y,Z,A,B,C,U,V,CONFIG, found 7 fields",
            ),
            (
                Arm::Scara,
                "NAME,X,Y,Z,A,B,C",
                "1:12: expected the heading C, found `A`",
            ),
            (
                Arm::Scara,
                &format!("{row}P1,1, zwei,3,4,5,"),
                "2:7: expected a number, found `zwei`",
            ),
            (
                Arm::Scara,
                "P1;1;2;3;4;5;",
                "1:1: expected 7 fields with commas between them, NAME,X,Y,Z,C,T,CONFIG, found semicolons between them",
            ),
            (
                Arm::Scara,
                "P1",
                "1:1: expected 7 fields with commas between them, NAME,X,Y,Z,C,T,CONFIG, found 1 field",
            ),
            (
                Arm::Scara,
                "P1,\"zwei\",,,,,",
                "1:5: expected a number, found `zwei`",
            ),
            (
                Arm::Scara,
                "P1,1\"\t2,,,,,",
                "1:4: expected a number, found `1\"\\t2`",
            ),
            (Arm::Scara, "P1,nan,,,,,", "1:4: expected a number, found `nan`"),
            (Arm::Scara, "P1,1e39,,,,,", "1:4: expected a number, found `1e39`"),
            (
                Arm::Scara,
                "P1,,,,,,FLIP",
                "1:9: expected a configuration: LEFTY, RIGHTY, FREE, 0 to 2, or nothing, found `FLIP`",
            ),
            (
                Arm::Scara,
                ",1,,,,,",
                "1:1: expected a name of at most 10 letters and digits, found nothing",
            ),
            (
                Arm::Scara,
                "MOVE,1,,,,,",
                "1:1: expected a name other than a word of the language, found `MOVE`",
            ),
            (
                Arm::Scara,
                &format!("{row}\np0,,,,,,"),
                "3:1: expected a name that did not occur before, found `p0`",
            ),
        ] {
            assert_eq!(parse_points(table, arm).unwrap_err().to_string(), message);
        }
        let many: String = (0..=MAX_POINTS).map(|at| format!("P{at},,,,,,\n")).collect();
        assert_eq!(parse_points(&many, Arm::Scara).unwrap_err().line, MAX_POINTS + 1);
    }
}
