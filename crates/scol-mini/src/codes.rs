//! The table of diagnostics: code, name, severity and title of each. The code is in messages, the name is its section in
//! docs/reference/diagnostics.md.

use crate::diagnostic::Severity;

/// One kind of diagnostic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DiagnosticKind {
    /// Stable code, `E` or `W` and four digits.
    pub code: &'static str,
    /// Stable name, in lower case with hyphens.
    pub name: &'static str,
    /// Error or warning.
    pub severity: Severity,
    /// Its meaning in one sentence.
    pub title: &'static str,
}

impl DiagnosticKind {
    /// The kind with this code.
    pub fn by_code(code: &str) -> Option<&'static DiagnosticKind> {
        DIAGNOSTICS.iter().find(|kind| kind.code == code)
    }
}

/// Makes a row of each line.
macro_rules! diagnostics {
    ($($code:literal $name:literal $severity:ident $title:literal)*) => {
        /// Every diagnostic, errors first, by its code.
        pub const DIAGNOSTICS: &[DiagnosticKind] = &[$(DiagnosticKind {
            code: $code,
            name: $name,
            severity: Severity::$severity,
            title: $title,
        }),*];
    };
}

diagnostics! {
    "E0001" "file-too-long" Error "The file is too long."
    "E0002" "unknown-character" Error "A character has no meaning here."
    "E0003" "tab-character" Error "The line contains a TAB."
    "E0004" "non-ascii-character" Error "A character is not ASCII."
    "E0005" "line-too-long" Error "The line is too long."
    "E0006" "unclosed-string" Error "A string has no closing quote."
    "E0007" "number-too-large" Error "A number is too large for its type."
    "E0009" "too-many-errors" Error "There are more than 100 diagnostics."
    "E0101" "unexpected-token" Error "Something else was expected here."
    "E0102" "item-after-cr" Error "An item follows CR in a PRINT."
    "E0103" "not-a-statement" Error "A word does not begin a statement."
    "E0104" "nesting-too-deep" Error "Something is nested too deep."
    "E0106" "cre-item" Error "CRE is not an item of PRINT."
    "E0107" "string-variable" Error "There are no string variables."
    "E0201" "undefined-name" Error "A variable never gets a value."
    "E0202" "undefined-label" Error "The program does not have this label."
    "E0203" "unknown-statement" Error "A word is neither a statement nor a program of this file."
    "E0205" "duplicate-name" Error "A name appears twice."
    "E0206" "wrong-argument-count" Error "The number of arguments or parameters is wrong."
    "E0207" "wrong-type" Error "A value has the wrong type."
    "E0208" "reserved-word" Error "A reserved word is used as a name."
    "E0210" "initial-value-not-constant" Error "An initial value is not constant."
    "E0212" "array-mismatch" Error "A variable is not an array, or an array has no subscript."
    "E0213" "wrong-subscripts" Error "The number of subscripts is wrong, or the element does not exist."
    "E0214" "arrays-too-large" Error "The arrays have too many elements."
    "E0215" "for-without-next" Error "A FOR has no NEXT."
    "E0216" "next-without-for" Error "A NEXT has no FOR."
    "E0217" "next-mismatch" Error "A NEXT names another loop."
    "E0218" "parameter-in-monitor" Error "A monitor uses a parameter."
    "E0301" "wrong-file-layout" Error "A block or a line is in the wrong place."
    "E0302" "missing-end" Error "A block has no END."
    "E0303" "end-without-block" Error "An END does not close anything."
    "E0304" "no-program" Error "The file has no PROGRAM."
    "E0401" "too-many-numbers" Error "A datum has too many numbers."
    "E0402" "invalid-configuration" Error "A configuration is not valid."
    "E0403" "data-name-too-long" Error "A name of DATA is too long."
    "E0404" "unknown-coordinate-system" Error "WORK names something that is not a TRANS."
    "E0501" "not-by-do" Error "The command DO cannot execute this statement."
    "W0209" "global-name-too-long" Warning "Hosts cannot reach a name of GLOBAL."
    "W0404" "work-without-point" Warning "A WORK is not followed by a POINT."
    "W0601" "print-after-motion" Warning "A PRINT follows a motion without waiting for its end."
    "W0602" "input-without-type" Warning "INPUT reads into a variable without a type."
    "W0603" "unreachable-statement" Warning "A statement is never reached."
    "W0604" "unused-label" Warning "Nothing jumps to a label."
    "W0605" "unused-variable" Warning "A variable gets a value that nothing reads."
    "W0606" "unused-data" Warning "No program uses a name of DATA."
    "W0607" "unused-global" Warning "No program uses a name of GLOBAL."
    "W0608" "loop-variable-changed" Warning "The variable of a FOR changes inside its loop."
    "W0609" "jump-into-loop" Warning "A jump enters a FOR loop."
    "W0610" "real-to-integer" Warning "A real with a fraction is assigned to an integer variable."
    "W0611" "unused-program" Warning "Nothing calls or starts a program."
    "W0612" "integer-division" Warning "A division of integers loses its fraction."
    "W0613" "division-by-zero" Warning "A division by zero."
    "W0614" "percent-out-of-range" Warning "A percentage is out of range."
    "W0615" "no-such-line" Warning "The robot does not have this line."
    "W0616" "no-such-axis" Warning "The arm does not have this axis."
    "W0617" "outside-domain" Warning "A function is not defined for this value."
    "W0618" "negative-time" Warning "A time is below zero."
    "W0619" "wrong-digits" Warning "A value does not fit the digits of BCDOUT, or their number is wrong."
    "W0620" "step-zero" Warning "A FOR counts in steps of 0."
    "W0621" "result-too-large" Warning "A constant result does not fit its type."
    "W0622" "outside-array" Warning "An array does not have this element."
    "W0623" "invalid-setting" Warning "A setting does not take this value."
    "W0624" "out-of-reach" Warning "The arm cannot reach a position."
    "W0625" "constant-wait" Warning "A WAIT has a constant condition."
    "W0626" "truth-compared" Warning "A comparison is always the same."
    "W0627" "long-delay" Warning "A DELAY looks like milliseconds."
    "W0628" "single-label" Warning "A computed GOTO has one label."
    "W0629" "print-too-long" Warning "A PRINT has too many characters."
}
