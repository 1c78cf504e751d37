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

impl Condition {
    pub fn keyword(self) -> &'static str {
        spelling(Self::WORDS, self)
    }
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

/// The sort of a word with a fixed spelling.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum WordKind {
    /// Word of the layout of a file or of a declaration: `PROGRAM`, `GLOBAL`, `DATA`, `END`, `DIM`, `AS`.
    Declaration,
    /// Word of a statement that decides when something runs: `IF`, `THEN`, `GOTO`, `WAIT`, `TASK` and others.
    Flow,
    /// Word of any other statement: `MOVE`, `WITH`, `PRINT`, `ENABLE` and others.
    Statement,
    /// Operator: `AND`, `OR`, `NOT`. `MOD` is a function too, and counts as one.
    Operator,
    /// `REMARK`, which begins a comment.
    Remark,
    /// Channel of `PRINT` and `INPUT`: `TP`, `COM1`, `IP1`, `IP2`.
    Channel,
    /// Function with its arguments in parentheses: `DIN`, `SQRT`, `POINT`. `PAYLOAD` counts here, not as a condition.
    Function,
    /// System variable: `HERE`, `REMAIN`. Only `TIMER` can be assigned.
    Variable,
    /// Motion condition, which is assigned, given after `WITH`, or read: `SPEED`, `TOOL`, `PASS`.
    Condition,
    /// Constant: `ON`, `CR`, and the configurations of the arm, such as `LEFTY` or `LAFSS`.
    Constant,
}

/// Words of statements. Functions and conditions that begin one have their rows above.
const STATEMENTS: &[(&str, WordKind)] = {
    use WordKind::*;
    &[
        ("AND", Operator),
        ("AS", Declaration),
        ("BCDOUT", Statement),
        ("BREAK", Flow),
        ("CLOSE1", Statement),
        ("CLOSE2", Statement),
        ("CLOSEI1", Statement),
        ("CLOSEI2", Statement),
        ("COM1", Channel),
        ("CR", Constant),
        ("CRE", Constant),
        ("DATA", Declaration),
        ("DELAY", Flow),
        ("DIM", Declaration),
        ("DISABLE", Statement),
        ("DO", Flow),
        ("ELSE", Flow),
        ("ENABLE", Statement),
        ("END", Declaration),
        ("FOR", Flow),
        ("FREELOAD", Statement),
        ("GLOBAL", Declaration),
        ("GOTO", Flow),
        ("IF", Flow),
        ("IGNORE", Flow),
        ("INPUT", Statement),
        ("IP1", Channel),
        ("IP2", Channel),
        ("KILL", Flow),
        ("MOVE", Statement),
        ("MOVEA", Statement),
        ("MOVEC", Statement),
        ("MOVEI", Statement),
        ("MOVEJ", Statement),
        ("MOVES", Statement),
        ("NEXT", Flow),
        ("NOT", Operator),
        ("NOWAIT", Statement),
        ("OPEN1", Statement),
        ("OPEN2", Statement),
        ("OPENI1", Statement),
        ("OPENI2", Statement),
        ("OR", Operator),
        ("PAUSE", Flow),
        ("PRINT", Statement),
        ("PROGRAM", Declaration),
        ("PULOUT", Statement),
        ("READY", Statement),
        ("REMARK", Remark),
        ("RESTORE", Statement),
        ("RESUME", Flow),
        ("RETURN", Flow),
        ("SETGAIN", Statement),
        ("STEP", Flow),
        ("STOP", Flow),
        ("SWITCH", Flow),
        ("TASK", Flow),
        ("THEN", Flow),
        ("TO", Flow),
        ("TP", Channel),
        ("WAIT", Flow),
        ("WITH", Statement),
    ]
};

/// Words of motions, which may have conditions.
pub(crate) const MOTIONS: &[&str] = &["MOVE", "MOVES", "MOVEC", "MOVEA", "MOVEI", "MOVEJ", "READY"];

/// Types of an array, after AS.
pub(crate) const TYPES: &[&str] = &["INTEGER", "REAL", "POINT", "TRANS", "PAYLOAD"];

/// Whether a word in upper case is a channel of PRINT and INPUT.
pub(crate) fn is_channel(word: &str) -> bool {
    lookup(STATEMENTS, word) == Some(WordKind::Channel)
}

/// Words that name a digit of a configuration of this arm, and FREE, which leaves all open.
pub(crate) fn configurations(arm: Arm) -> impl Iterator<Item = &'static str> {
    let digits = DIGITS.iter().map(|(word, _)| *word);
    core::iter::once("FREE").chain(digits.filter(move |word| constant(word, arm).is_some()))
}

/// The sort of a word in upper case; `None` for a word that the program may use as a name.
///
/// A word that can be more than one thing has the sort of its row: `ON` is a constant, though a monitor begins with it.
#[must_use]
pub fn word_kind(word: &str, arm: Arm) -> Option<WordKind> {
    lookup(STATEMENTS, word)
        .or_else(|| Builtin::from_word(word).map(|_| WordKind::Function))
        .or_else(|| condition(word).map(|_| WordKind::Condition))
        .or_else(|| System::from_word(word).map(|_| WordKind::Variable))
        .or_else(|| constant(word, arm).map(|_| WordKind::Constant))
}

/// `true` when the word cannot be the name of a variable, label or program.
pub(crate) fn is_reserved(word: &str, arm: Arm) -> bool {
    word_kind(word, arm).is_some()
}

/// All words with a fixed spelling: candidates for suggestions, and the words that the test programs have to cover.
pub fn words<'a>() -> impl Iterator<Item = &'a str> {
    fn of<'a, T>(table: &'a [(&'a str, T)]) -> impl Iterator<Item = &'a str> {
        table.iter().map(|(word, _)| *word)
    }
    let functions = of(Builtin::WORDS).chain(of(Numeric::WORDS));
    let variables = of(System::WORDS).chain(of(Condition::WORDS));
    let words = functions.chain(variables).chain(of(COMMON)).chain(of(DIGITS));
    let words = words.chain(of(STATEMENTS));
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

    #[test]
    fn a_word_of_two_sorts_has_one() {
        let cases = [
            ("PAYLOAD", Some(WordKind::Function)),
            ("TIMER", Some(WordKind::Variable)),
            ("PASS", Some(WordKind::Condition)),
            ("ON", Some(WordKind::Constant)),
            ("DOUT", Some(WordKind::Function)),
            ("MOVES", Some(WordKind::Statement)),
            ("LAFSS", Some(WordKind::Constant)),
            ("INTEGER", None),
        ];
        for (word, kind) in cases {
            assert_eq!(word_kind(word, Arm::SixAxis), kind, "{word}");
        }
        assert_eq!(word_kind("LAFSS", Arm::Scara), None);
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
