//! The JUnit report of a run that could not start. Without it CI would find a missing or empty file and show no
//! error at all.
//!
//! The report of a run that did start is written by [`ts3100_recording::scenario`]. The path is found even on a command line
//! that clap rejects, by looking for `--junit` directly.

use crate::config::fleet::is_of_all;
use crate::log::print_error;
use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;
use ts3100_driver::files;
use ts3100_recording::reports::junit;

/// Message of the report until the run has ended.
pub(super) const NOT_FINISHED: &str = "the run did not end in order";
/// The environment variable of `--junit`.
const VARIABLE: &str = "TS3100_JUNIT";

/// The report: one test case with an error, which is why.
pub(super) fn document(why: &str) -> String {
    let why = why.trim_end();
    let status = junit::error(why.lines().next().unwrap_or_default(), why);
    let case = junit::case("ts3100", "start", Duration::ZERO, status);
    junit::report("ts3100", Duration::ZERO, [case])
}

/// Writes the report into these files, and says on stderr where that fails.
pub(super) fn write<'a>(paths: impl IntoIterator<Item = &'a PathBuf>, why: &str) {
    for path in paths {
        let shown = path.display().to_string();
        if !is_of_all(path) {
            print_error(format_args!(
                "cannot write {shown}: the names of the robots are not known"
            ));
            continue;
        }
        match files::replace(path, document(why).as_bytes()) {
            // That it cannot be written may be why the run did not start.
            Err(error) if !why.contains(&shown) => print_error(format_args!("cannot write {shown}: {error}")),
            _ => {}
        }
    }
}

/// The file of `--junit`, or of its variable, on a command line that cannot be understood otherwise.
pub(super) fn path_from_arguments(words: impl Iterator<Item = OsString>) -> Option<PathBuf> {
    let mut words = words.take_while(|word| word != "--");
    while let Some(word) = words.next() {
        if word == "--junit" {
            return words.next().map(PathBuf::from);
        }
        if let Some(path) = word.to_str().and_then(|word| word.strip_prefix("--junit=")) {
            return Some(PathBuf::from(path));
        }
    }
    path_from_environment()
}

/// The file of the variable.
pub(super) fn path_from_environment() -> Option<PathBuf> {
    std::env::var_os(VARIABLE).map(PathBuf::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_is_found_on_a_broken_command_line() {
        let found = |line: &str| path_from_arguments(line.split(' ').map(OsString::from));
        assert_eq!(found("exec --nonsense --junit a.xml -- x"), Some("a.xml".into()));
        assert_eq!(found("exec --junit=b.xml --nonsense"), Some("b.xml".into()));
        assert_eq!(found("exec -- x --junit a.xml"), None);
        assert_eq!(found("exec --junit"), None);
    }

    #[test]
    fn what_is_said_is_escaped() {
        let report = document("no <command> & \"none\"\nUsage: a\n");
        assert!(
            report.contains("message=\"no &lt;command&gt; &amp; &quot;none&quot;\">no &lt;command&gt;"),
            "{report}"
        );
    }
}
