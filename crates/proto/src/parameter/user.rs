//! USER.PAR, sections \[U06\], the serial ports (manual 2.3), and \[U25\], what a string does in INPUT (STE 80722 p. 30):
//! values, reader and writer.
//!
//! The real file has further sections that other manuals describe; they are ignored and kept. Configuring real ports is
//! left to the emulator. The syntax of the file is in `reader.rs`.

use super::{
    FileValues, LineEnd, ParameterFile, ParameterProblem, SectionValues, split_words, with_line_end,
};
use crate::codes::codes;
use crate::prelude::*;
use crate::words::{Word, number, one_of};

codes! {
    /// Parity of a serial line.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
    pub enum Parity {
        /// 0: no parity bit.
        None = 0,
        /// 1: odd parity.
        Odd = 1,
        /// 2: even parity.
        Even = 2,
    }
    /// The number in the file.
    fn number -> u8;
    /// The parity of this number.
    fn from_number;
}

codes! {
    /// Effect of a string that INPUT finds instead of a number: function 1 of \[U25\] (S90).
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
    pub enum StringRule {
        /// 0: nothing; an alarm comes.
        #[default]
        Alarm = 0,
        /// 1: it becomes 0.
        Zero = 1,
        /// 2: it becomes its number in STRING.PAR.
        LookUp = 2,
    }
    /// The number in the file.
    fn number -> u8;
    /// The rule of this number.
    fn from_number;
}

impl StringRule {}

/// Which edition of the communication manual describes the controller: HOST has other speeds in the two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Edition {
    /// That of the six-axis robots (PAR-U06-04).
    SixAxis,
    /// That of the SCARA robots (S2).
    Scara,
}

impl Edition {
    /// The speeds that only HOST has, in bit/s.
    pub const fn host_speeds(self) -> &'static [u32] {
        match self {
            Edition::SixAxis => &[115_200],
            Edition::Scara => &[300, 600, 115_200],
        }
    }
}

/// The settings of one serial port.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SerialSettings {
    /// Speed in bit/s: 1200, 2400, 4800, 9600, 19200, 38400; on HOST also those of [`Edition::host_speeds`].
    #[serde(deserialize_with = "within::<1, { u32::MAX }, _, _>")]
    pub speed: u32,
    /// Character length in bits, 7 or 8.
    #[serde(deserialize_with = "within::<5, 8, _, _>")]
    pub length: u8,
    /// Parity bit, if any.
    pub parity: Parity,
    /// Number of stop bits, 1 or 2.
    #[serde(deserialize_with = "within::<1, 2, _, _>")]
    pub stop: u8,
}

impl SerialSettings {
    /// Reads the four numbers of a line of \[U06\]: speed, length, parity, stop bits. Any speed from 300 to 115200 that a
    /// port of some edition has.
    pub fn parse(text: &str) -> Option<SerialSettings> {
        const ALL_SPEEDS: [u32; 9] = [300, 600, 1_200, 2_400, 4_800, 9_600, 19_200, 38_400, 115_200];
        serial_line(text, &ALL_SPEEDS)
    }
}

/// A deserialized setting within its bounds. It may be the far end's, so they are those of any serial port, not of USER.PAR.
fn within<'de, const LOW: u32, const HIGH: u32, T, D>(from: D) -> Result<T, D::Error>
where
    T: Deserialize<'de> + Copy + Into<u32> + core::fmt::Display,
    D: serde::Deserializer<'de>,
{
    let found = T::deserialize(from)?;
    if (LOW..=HIGH).contains(&found.into()) {
        return Ok(found);
    }
    let message = format!("expected {LOW} to {HIGH}, found {found}");
    Err(serde::de::Error::custom(message))
}

/// The values that the controller reads from USER.PAR.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UserParameters {
    /// `{COM1}`, the port for programs.
    pub com1: SerialSettings,
    /// `{HOST}`, the port for the simple protocol.
    pub host: SerialSettings,
    /// The first number of \[U25\].
    pub input_string: StringRule,
}

impl UserParameters {
    /// The values the manual lists: 9600 8 0 1 for both (PAR-U06-02).
    pub fn factory() -> UserParameters {
        let line = SerialSettings {
            speed: 9600,
            length: 8,
            parity: Parity::None,
            stop: 1,
        };
        UserParameters {
            com1: line,
            host: line,
            input_string: StringRule::Alarm,
        }
    }

    /// The file of a fresh RAM drive.
    pub fn factory_file(line_end: LineEnd, edition: Edition) -> Vec<u8> {
        UserParameters::factory().encode(line_end, edition)
    }

    /// These values as a file, comments and `[END]` included, EOF not.
    pub fn encode(&self, line_end: LineEnd, edition: Edition) -> Vec<u8> {
        let values = |line: SerialSettings| {
            let parity = line.parity.number();
            format!("{} {} {parity} {}", line.speed, line.length, line.stop)
        };
        let functions = match (edition, self.input_string) {
            (Edition::SixAxis, StringRule::Alarm) => String::new(),
            (Edition::SixAxis | Edition::Scara, rule) => format!(
                "[U25] Function select switch\n\
                 {{1, a string in INPUT: 0 alarm, 1 the value 0, 2 its number in STRING.PAR}}\n\
                 = {} 0 0 0 0 0\n\
                 = 0 0 0 0 0 0\n\
                 = 0 0 0 0 0 0\n\
                 = 0 0 0 0 0 0\n",
                rule.number()
            ),
        };
        let text = format!(
            "[U06] Serial ports\n\
             {{Speed: {}; HOST also {}}}\n\
             {{Character length: 7, 8}}\n\
             {{Parity: 0 none, 1 odd, 2 even}}\n\
             {{Stop bits: 1, 2}}\n\
             {{{COM1}}} = {}\n\
             {{{HOST}}} = {}\n\
             {functions}[END]\n",
            words(&SPEEDS).join(", "),
            words(edition.host_speeds()).join(", "),
            values(self.com1),
            values(self.host)
        );
        with_line_end(&text, line_end)
    }

    /// Reads a file. A line whose values are bad or missing stays as in `previous` (PAR-U06-06); each is a
    /// problem, and so are keys unknown or twice in \[U06\].
    pub fn parse(
        content: &[u8],
        previous: &UserParameters,
        edition: Edition,
    ) -> (UserParameters, Vec<ParameterProblem>) {
        let file = ParameterFile::parse(content);
        let mut values = FileValues::new(&file);
        let mut next = *previous;
        let mut section = values.section("U06");
        let mut host: Vec<u32> = SPEEDS.iter().chain(edition.host_speeds()).copied().collect();
        host.sort_unstable();
        for (key, line, speeds) in [
            (COM1, &mut next.com1, SPEEDS.as_slice()),
            (HOST, &mut next.host, host.as_slice()),
        ] {
            let one_of = one_of(&words(speeds));
            let expected = format!("speed {one_of}, length 7 or 8, parity 0 to 2, stop bits 1 or 2");
            section.read(Some(key), line, &expected, |value| serial_line(value, speeds));
        }
        section.refuse_other_keys(&[COM1, HOST]);
        values.section("U25").read_functions(&mut next.input_string);
        (next, values.problems.0)
    }
}

/// Rows of \[U25\], and numbers of a row (S90).
const FUNCTION_ROWS: usize = 4;
const FUNCTIONS: usize = 6;

impl SectionValues<'_> {
    /// Reads the rows of \[U25\]. A file without it, and a row that is missing, mean 0; numbers but the first have no
    /// effect (T13).
    fn read_functions(&mut self, rule: &mut StringRule) {
        const FIRST: &str = "0, 1 or 2 as the first of six numbers";
        let mut read = Some(StringRule::Alarm);
        for (row, assignment) in self.assignments().iter().enumerate() {
            let value = assignment.value.as_str();
            let numbers = split_words::<FUNCTIONS>(value)
                .and_then(|words| words.into_iter().map(number).collect::<Option<Vec<u32>>>());
            let expected = match (row, numbers) {
                (FUNCTION_ROWS.., _) => "four rows",
                (0, numbers) => {
                    let first = numbers.and_then(|numbers| u8::try_from(*numbers.first()?).ok());
                    read = first.and_then(StringRule::from_number);
                    if read.is_some() {
                        continue;
                    }
                    FIRST
                }
                (_, Some(_)) => continue,
                (_, None) => "six numbers",
            };
            self.problems.add(self.name, "", expected, value, assignment.line);
        }
        // A bad one keeps what was.
        *rule = read.unwrap_or(*rule);
    }
}

impl Word for Parity {
    const ALL: &'static [Parity] = &Parity::ALL;

    fn word(self) -> &'static str {
        match self {
            Parity::None => "none",
            Parity::Odd => "odd",
            Parity::Even => "even",
        }
    }
}

const COM1: &str = "COM1";
const HOST: &str = "HOST";

/// Speeds of both ports in bit/s.
const SPEEDS: [u32; 6] = [1_200, 2_400, 4_800, 9_600, 19_200, 38_400];

fn words(speeds: &[u32]) -> Vec<String> {
    speeds.iter().map(ToString::to_string).collect()
}

fn serial_line(value: &str, speeds: &[u32]) -> Option<SerialSettings> {
    let [speed, length, parity, stop] = split_words(value)?;
    Some(SerialSettings {
        speed: number(speed).filter(|speed| speeds.contains(speed))?,
        length: number(length).filter(|length| matches!(length, 7 | 8))?,
        parity: Parity::from_number(number(parity)?)?,
        stop: number(stop).filter(|stop| matches!(stop, 1 | 2))?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(com1: &str, host: &str) -> (UserParameters, Vec<ParameterProblem>) {
        let text = format!(
            "[U01] other = 5\n[U06] Serial {{Speed}}(9600, 1200)\n{{COM1}} = {com1}\n{{ host }}\n= {host}\n[END]"
        );
        UserParameters::parse(text.as_bytes(), &UserParameters::factory(), Edition::SixAxis)
    }

    // clause: PAR-U06-01 PAR-U06-02
    #[test]
    fn the_file_of_a_fresh_drive() {
        for line_end in [LineEnd::Lf, LineEnd::Cr] {
            let bytes = UserParameters::factory_file(line_end, Edition::SixAxis);
            let text = String::from_utf8(bytes.clone()).unwrap();
            assert!(text.starts_with("[U06]"));
            assert!(text.contains("{COM1} = 9600 8 0 1") && text.contains("{HOST} = 9600 8 0 1"));
            assert_eq!(bytes.last(), Some(&line_end.byte()));
            let other = SerialSettings {
                speed: 1_200,
                length: 7,
                parity: Parity::Even,
                stop: 2,
            };
            let previous = UserParameters {
                com1: other,
                host: other,
                input_string: StringRule::Zero,
            };
            assert_eq!(
                UserParameters::parse(&bytes, &previous, Edition::SixAxis),
                (UserParameters::factory(), Vec::new())
            );
            assert_eq!(
                UserParameters::parse(
                    &previous.encode(line_end, Edition::SixAxis),
                    &UserParameters::factory(),
                    Edition::SixAxis
                )
                .0,
                previous
            );
        }
    }

    // clause: PAR-U06-03 PAR-U06-05
    #[test]
    fn codes_of_the_values() {
        let line = |value| read("9600 8 0 1", value).0.host;
        assert_eq!(
            line("19200 7 1 2"),
            SerialSettings {
                speed: 19_200,
                length: 7,
                parity: Parity::Odd,
                stop: 2
            }
        );
        assert_eq!(line("19200 7 2 2").parity, Parity::Even);
        assert_eq!(line("38400 8 1 1").parity, Parity::Odd);
        for speed in SPEEDS {
            let value = format!("{speed} 8 0 1");
            let (read, problems) = read(&value, &value);
            assert_eq!(
                (read.com1.speed, read.host.speed, problems.len()),
                (speed, speed, 0)
            );
        }
    }

    // clause: PAR-U06-04
    #[test]
    fn the_highest_speed_is_for_host_only() {
        let (parameters, problems) = read("115200 8 0 1", "115200 8 0 1");
        assert_eq!((parameters.com1.speed, parameters.host.speed), (9_600, 115_200));
        assert_eq!(problems.len(), 1);
        assert_eq!(
            problems[0].to_string(),
            "[U06] {COM1} line 3: expected speed 1200, 2400, 4800, 9600, 19200 or 38400, length 7 or 8, parity 0 to 2, \
             stop bits 1 or 2, found `115200 8 0 1`"
        );
    }

    // clause: S2
    #[test]
    fn the_scara_edition_has_two_low_speeds_on_host() {
        let factory = UserParameters::factory();
        for speed in [300, 600, 115_200] {
            let text = format!("[U06] {{COM1}} = {speed} 8 0 1 {{HOST}} = {speed} 8 0 1");
            let (parameters, problems) = UserParameters::parse(text.as_bytes(), &factory, Edition::Scara);
            assert_eq!((parameters.com1.speed, parameters.host.speed), (9_600, speed));
            assert_eq!(problems.len(), 1, "COM1 has none of them");
            let (parameters, problems) = UserParameters::parse(text.as_bytes(), &factory, Edition::SixAxis);
            let known = speed == 115_200;
            assert_eq!(parameters.host.speed, if known { speed } else { 9_600 });
            assert_eq!(problems.len(), if known { 1 } else { 2 });
        }
        let text = String::from_utf8(UserParameters::factory_file(LineEnd::Lf, Edition::Scara)).unwrap();
        assert!(text.contains("HOST also 300, 600, 115200}"), "{text}");
        let bad = b"[U06] {COM1} = 9600 8 0 1 {HOST} = 1 8 0 1";
        let problem = UserParameters::parse(bad, &factory, Edition::Scara).1[0].to_string();
        assert!(problem.contains("speed 300, 600, 1200, 2400"), "{problem}");
    }

    // clause: S90 T13 T27
    #[test]
    fn the_first_number_of_u25_says_what_a_string_does() {
        let lines = "[U06] {COM1} = 9600 8 0 1 {HOST} = 9600 8 0 1 ";
        for previous in StringRule::ALL {
            let previous = UserParameters {
                input_string: previous,
                ..UserParameters::factory()
            };
            let read = |rows: &str| {
                let text = format!("{lines}{rows}[END]");
                let (found, problems) = UserParameters::parse(text.as_bytes(), &previous, Edition::SixAxis);
                (found.input_string, problems.len())
            };
            for (rows, rule) in [
                ("", StringRule::Alarm),
                ("[U25]", StringRule::Alarm),
                ("[U25] = 0 0 0 0 0 0", StringRule::Alarm),
                ("[U25] {1 2} = 1 0 0 0 0 0", StringRule::Zero),
                (
                    "[U25] = 2 9 9 9 9 99 = 1 1 1 1 1 1 = 5 5 5 5 5 5 = 7 7 7 7 7 7",
                    StringRule::LookUp,
                ),
            ] {
                assert_eq!(read(rows), (rule, 0), "{rows}");
            }
            for rows in [
                "= 3 0 0 0 0 0",
                "= X 0 0 0 0 0",
                "= 1 0 0 0 0 X",
                "= 1",
                "= 1 0 0 0 0 0 0",
                "= -1 0 0 0 0 0",
                "= 256 0 0 0 0 0",
            ] {
                assert_eq!(
                    read(&format!("[U25] {rows}")),
                    (previous.input_string, 1),
                    "{rows}"
                );
            }
            assert_eq!(read("[U25] = 1 0 0 0 0 0 = A 0 0 0 0 0"), (StringRule::Zero, 1));
            let rows = "= 1 0 0 0 0 0 ".repeat(5);
            assert_eq!(read(&format!("[U25] {rows}")), (StringRule::Zero, 1));
        }
    }

    // clause: S90 T13
    #[test]
    fn the_factory_file_of_a_scara_alone_has_u25() {
        for (edition, rows) in [(Edition::SixAxis, 0), (Edition::Scara, 4)] {
            let file = UserParameters::factory_file(LineEnd::Lf, edition);
            let text = String::from_utf8(file).unwrap();
            assert_eq!(text.matches("= 0 0 0 0 0 0\n").count(), rows);
            assert_eq!(text.contains("[U25]"), edition == Edition::Scara);
        }
    }

    // clause: PAR-U06-06
    #[test]
    fn bad_values_keep_the_whole_line() {
        for bad in [
            "12345 8 0 1",
            "1200 9 0 1",
            "1200 8 3 1",
            "1200 8 0 3",
            "1200 8 0",
            "1200 8 0 1 1",
            "",
            "-1 8 0 1",
        ] {
            let (parameters, problems) = read("4800 7 2 2", bad);
            assert_eq!(parameters.host, UserParameters::factory().host, "{bad}");
            assert_eq!((parameters.com1.speed, problems.len()), (4_800, 1), "{bad}");
            assert_eq!((problems[0].key.as_str(), problems[0].line), ("HOST", 5));
        }
    }

    #[test]
    fn missing_and_surplus_values_are_told() {
        let factory = UserParameters::factory();
        let (parameters, problems) = UserParameters::parse(b"", &factory, Edition::SixAxis);
        assert_eq!((parameters, problems.len()), (factory, 2));
        assert!(
            problems
                .iter()
                .all(|problem| problem.found == "nothing" && problem.line == 0)
        );
        let text =
            b"[U06] {COM1} = 1200 8 0 1 {COM1} = 2400 8 0 1 {HOST} = 9600 8 0 1 {COM2} = 9600 8 0 1 [U06]";
        let (parameters, problems) = UserParameters::parse(text, &factory, Edition::SixAxis);
        assert_eq!((parameters.com1.speed, problems.len()), (1_200, 3));
    }
}
