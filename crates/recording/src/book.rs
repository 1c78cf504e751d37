//! Links into the documentation that messages and reports print.
//!
//! A page is a file of the repository, or of a published book if the variable `TS3100_DOCS_URL` named one when the program was
//! built.

use scol_mini::DiagnosticKind;
use ts3100_controller::alarm::AlarmCode;
use ts3100_controller::findings::Rule;

/// Where the book begins.
pub const DOCS: &str = match option_env!("TS3100_DOCS_URL") {
    Some(url) => url,
    None => "docs/",
};
/// How a page ends: as a file, or as mdBook publishes it.
const ENDING: &str = match option_env!("TS3100_DOCS_URL") {
    Some(_) => "html",
    None => "md",
};

/// The section of a page of the reference.
pub fn section(page: &str, anchor: &str) -> String {
    format!("{DOCS}reference/{page}.{ENDING}#{anchor}")
}

/// The section of a rule of findings.
pub fn finding(rule: &Rule) -> String {
    section("findings", rule.id)
}

/// The section of a kind of diagnostic.
pub fn diagnostic(kind: &DiagnosticKind) -> String {
    section("diagnostics", kind.name)
}

/// The section of an alarm.
pub fn alarm(code: &AlarmCode) -> String {
    section("alarms", &format!("alarm-{}", code.number()))
}
