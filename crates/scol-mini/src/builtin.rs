//! The words of the language: functions, constants, system variables and reserved words.
//!
//! Each word has one row here, with its arguments. What functions compute is left to `machine::functions`, the values
//! of system variables to `machine::evaluate`, and the place of a word to `parser`.

use crate::options::Arm;
use crate::value::ValueKind;

/// Derives an enum and its words from rows, each a value and its word.
macro_rules! words {
    (
        $(#[$attribute:meta])*
        $name:ident $(, $more:ident($of:ty))? {
            $( $value:ident = $word:literal, )*
        }
    ) => {
        $(#[$attribute])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub(crate) enum $name {
            $( $value, )*
            $( $more($of), )?
        }

        impl $name {
            const WORDS: &'static [(&'static str, $name)] = &[$( ($word, $name::$value) ),*];
        }
    };
}

words! {
    /// A function, or a constructor of a vector value.
    Builtin, Numeric(Numeric) {
        Max = "MAX",
        Min = "MIN",
        Point = "POINT",
        Trans = "TRANS",
        Payload = "PAYLOAD",
        Din = "DIN",
        Dout = "DOUT",
        Bcdin = "BCDIN",
        Gain = "GAIN",
        Torque = "TORQUE",
    }
}

words! {
    /// A function of one or two numbers.
    Numeric {
        Int = "INT",
        Sin = "SIN",
        Cos = "COS",
        Tan = "TAN",
        Asin = "ASIN",
        Acos = "ACOS",
        Atan = "ATAN",
        Atan2 = "ATAN2",
        Sqrt = "SQRT",
        Abs = "ABS",
        Sgn = "SGN",
        Real = "REAL",
        Exp = "EXP",
        Ln = "LN",
        Log10 = "LOG10",
        Mod = "MOD",
    }
}

words! {
    /// A system variable that is read.
    System, Condition(Condition) {
        Motion = "MOTION",
        Here = "HERE",
        Mode = "MODE",
        Timer = "TIMER",
        MotionTime = "MOTIONT",
        Remain = "REMAIN",
        RemainTime = "REMAINT",
        Dest = "DEST",
        TaskId = "TID",
        MaxTask = "MAXTASK",
    }
}

words! {
    /// A motion condition that can be assigned.
    Condition {
        Speed = "SPEED",
        Accel = "ACCEL",
        Decel = "DECEL",
        Config = "CONFIG",
        Payload = "PAYLOAD",
        Work = "WORK",
        Tool = "TOOL",
        Base = "BASE",
        Pass = "PASS",
        Accur = "ACCUR",
    }
}

/// Most arguments of `MAX`, `MIN`, `DIN` and `DOUT`.
pub(crate) const MAX_ARGUMENTS: usize = 32;

/// Looks a word up in a table.
fn lookup<T: Copy>(table: &[(&str, T)], word: &str) -> Option<T> {
    let row = table.iter().find(|(spelling, _)| *spelling == word);
    row.map(|(_, meaning)| *meaning)
}

/// Spelling of a value in a table.
pub(crate) fn spelling<T: Copy + PartialEq>(table: &[(&'static str, T)], value: T) -> &'static str {
    let row = table.iter().find(|(_, known)| *known == value);
    row.map_or("", |(spelling, _)| spelling)
}

impl Builtin {
    pub fn from_word(word: &str) -> Option<Self> {
        let numeric = || lookup(Numeric::WORDS, word).map(Builtin::Numeric);
        lookup(Self::WORDS, word).or_else(numeric)
    }

    pub fn keyword(self) -> &'static str {
        if let Builtin::Numeric(numeric) = self {
            return spelling(Numeric::WORDS, numeric);
        }
        spelling(Self::WORDS, self)
    }

    /// Whether it makes a vector value; omitted arguments are 0.
    pub fn is_vector(self) -> bool {
        matches!(self, Builtin::Point | Builtin::Trans | Builtin::Payload)
    }

    /// Fewest and most arguments.
    pub fn arity(self, arm: Arm) -> (usize, usize) {
        match self {
            Builtin::Numeric(Numeric::Atan2 | Numeric::Mod) | Builtin::Bcdin => (2, 2),
            Builtin::Max | Builtin::Min => (2, MAX_ARGUMENTS),
            Builtin::Din | Builtin::Dout => (1, MAX_ARGUMENTS),
            Builtin::Point => (0, ValueKind::Position.width(arm) + 1),
            Builtin::Trans => (0, ValueKind::Coordinate.width(arm)),
            Builtin::Payload => (0, ValueKind::Load.width(arm)),
            Builtin::Numeric(_) | Builtin::Gain | Builtin::Torque => (1, 1),
        }
    }
}

impl System {
    pub fn from_word(word: &str) -> Option<Self> {
        // PAYLOAD in an expression is the constructor.
        let condition = || condition(word).filter(|condition| *condition != Condition::Payload);
        lookup(Self::WORDS, word).or_else(|| condition().map(System::Condition))
    }
}

/// The motion condition of this name.
pub(crate) fn condition(word: &str) -> Option<Condition> {
    lookup(Condition::WORDS, word)
}

/// Constants that are the same for every arm.
const COMMON: &[(&str, i32)] = &[
    ("ON", 1),
    ("OFF", 0),
    ("TRUE", 1),
    ("FALSE", 0),
    ("FREE", 0),
    ("FINE", 1),
    ("COARSE", 0),
];
/// Constants for the digits of a configuration, as a six-axis arm has them.
const DIGITS: &[(&str, i32)] = &[
    ("LEFTY", 10_000),
    ("RIGHTY", 20_000),
    ("ABOVE", 1_000),
    ("BELOW", 2_000),
    ("NFLIP", 100),
    ("FLIP", 200),
    ("SINGLE4", 10),
    ("DOUBLE4", 20),
    ("SINGLE6", 1),
    ("DOUBLE6", 2),
];

/// The value of a constant word.
///
/// On a SCARA `LEFTY` is 1 and `RIGHTY` 2. On a six-axis arm each word is the number of its own digit
/// (`LEFTY` 10000, `BELOW` 2000 ...), so that words add up to a configuration, and words of five letters such as
/// `LAFSS` name a whole one.
pub(crate) fn constant(word: &str, arm: Arm) -> Option<i32> {
    if let Some(value) = lookup(COMMON, word) {
        return Some(value);
    }
    let digits = lookup(DIGITS, word).or_else(|| letters(word).filter(|_| !word.contains('X')))?;
    match arm {
        Arm::SixAxis => Some(digits),
        Arm::Scara => (digits % 10_000 == 0).then_some(digits / 10_000),
    }
}

/// The configuration a word names where a configuration is wanted: a constant, or on a six-axis arm five letters of
/// which some may be `X`, undefined, as the vendor's library writes them (hosts 8.5). `XXXXX` and similar words are
/// names everywhere else.
pub(crate) fn configuration(word: &str, arm: Arm) -> Option<i32> {
    constant(word, arm)
        .filter(|_| word == "FREE" || lookup(COMMON, word).is_none())
        .or_else(|| letters(word).filter(|_| arm == Arm::SixAxis))
}

/// Five letters like `LAFSS`: shoulder L/R, elbow A/B, wrist N/F, axis 4 S/D, axis 6 S/D, each or X for undefined.
fn letters(word: &str) -> Option<i32> {
    const LETTERS: [[u8; 3]; 5] = [*b"XLR", *b"XAB", *b"XNF", *b"XSD", *b"XSD"];
    if word.len() != LETTERS.len() {
        return None;
    }
    word.bytes().zip(LETTERS).try_fold(0, |number, (letter, known)| {
        let digit = known.iter().position(|known| *known == letter)?;
        Some(number * 10 + i32::try_from(digit).ok()?)
    })
}

/// Words that begin or join statements.
const STATEMENTS: &[&str] = &[
    "AND", "AS", "BCDOUT", "BREAK", "CLOSE1", "CLOSE2", "CLOSEI1", "CLOSEI2", "COM1", "CR", "CRE", "DATA",
    "DELAY", "DIM", "DISABLE", "DO", "ELSE", "ENABLE", "END", "FOR", "FREELOAD", "GLOBAL", "GOTO", "IF",
    "IGNORE", "INPUT", "IP1", "IP2", "KILL", "MOVE", "MOVEA", "MOVEC", "MOVEI", "MOVEJ", "MOVES", "NEXT",
    "NOT", "NOWAIT", "OPEN1", "OPEN2", "OPENI1", "OPENI2", "OR", "PAUSE", "PRINT", "PROGRAM", "PULOUT",
    "READY", "REMARK", "RESTORE", "RESUME", "RETURN", "SETGAIN", "STEP", "STOP", "SWITCH", "TASK", "THEN",
    "TO", "TP", "WAIT", "WITH",
];

/// `true` when the word cannot be the name of a variable, label or program.
pub(crate) fn is_reserved(word: &str, arm: Arm) -> bool {
    STATEMENTS.contains(&word)
        || Builtin::from_word(word).is_some()
        || System::from_word(word).is_some()
        || constant(word, arm).is_some()
}

/// All words with a fixed spelling: candidates for suggestions, and the words that the test programs have to cover.
pub fn words<'a>() -> impl Iterator<Item = &'a str> {
    fn of<'a, T>(table: &'a [(&'a str, T)]) -> impl Iterator<Item = &'a str> {
        table.iter().map(|(word, _)| *word)
    }
    let functions = of(Builtin::WORDS).chain(of(Numeric::WORDS));
    let variables = of(System::WORDS).chain(of(Condition::WORDS));
    let words = functions.chain(variables).chain(of(COMMON)).chain(of(DIGITS));
    let words = words.chain(STATEMENTS.iter().copied());
    words.filter(|word| *word != "CRE")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_suggested_is_a_word_of_the_language() {
        for word in words() {
            assert!(is_reserved(word, Arm::SixAxis), "{word}");
        }
    }

    // clause: DATA-04
    #[test]
    fn configuration_words() {
        assert_eq!(constant("LAFSS", Arm::SixAxis), Some(11_211));
        assert_eq!(constant("RBNDD", Arm::SixAxis), Some(22_122));
        assert_eq!(constant("LAFSX", Arm::SixAxis), None);
        assert_eq!(constant("RIGHTY", Arm::Scara), Some(2));
        assert_eq!(constant("FLIP", Arm::Scara), None);
        assert_eq!(constant("LAFSS", Arm::Scara), None);
        for (word, number) in [("XXXXX", 0), ("LAXXX", 11_000), ("XXNXX", 100), ("RBFDD", 22_222)] {
            assert_eq!(configuration(word, Arm::SixAxis), Some(number), "{word}");
            assert_eq!(configuration(word, Arm::Scara), None, "{word}");
        }
        assert_eq!(configuration("FREE", Arm::Scara), Some(0));
        assert_eq!(configuration("COARSE", Arm::SixAxis), None);
        assert_eq!(configuration("XAXSX", Arm::SixAxis), Some(1_010));
        assert_eq!(configuration("AXLSX", Arm::SixAxis), None);
    }
}
