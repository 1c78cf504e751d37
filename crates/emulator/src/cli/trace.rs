//! The run of a robot as `exec` keeps it when it has failed: as a page for a browser, or as a transcript for `ts3100 view`.
//!
//! It is made from what the control interface keeps of the run, after its end. Nothing is recorded for it.

use crate::log;
use crate::recorded;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use ts3100_control::journal::Journal;
use ts3100_controller::Time;
use ts3100_driver::files;
use ts3100_proto::words::UnexpectedWord;
use ts3100_recording::transcript::{Format, Recording};
use ts3100_view::html;
use ts3100_view::kind::went_wrong;
use ts3100_view::run::Run;

/// A file for the run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct TraceFile {
    path: PathBuf,
    form: Form,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    Page,
    Transcript(Format),
}

impl FromStr for TraceFile {
    type Err = UnexpectedWord;

    fn from_str(word: &str) -> Result<TraceFile, UnexpectedWord> {
        let path = PathBuf::from(word);
        let form = match files::extension(&path).as_str() {
            "html" => Form::Page,
            "txt" => Form::Transcript(Format::Text),
            "jsonl" => Form::Transcript(Format::Json),
            _ => {
                let expected = "a name that ends in .html, .txt or .jsonl";
                return Err(UnexpectedWord::new(expected, word));
            }
        };
        Ok(TraceFile { path, form })
    }
}

/// Checks that the files could be written, before the run.
///
/// # Errors
/// The first that could not be.
pub(super) fn check(traces: &[TraceFile]) -> anyhow::Result<()> {
    for TraceFile { path, .. } in traces {
        files::check_target(path).map_err(files::cannot("write the trace", path))?;
    }
    Ok(())
}

/// Writes the files, and says how to watch the run, which has ended at `now`. The run has failed for a reason of its own, so
/// an error here is a warning.
pub(super) fn keep(traces: &[TraceFile], journal: &Journal, now: Time) {
    let Some(first) = traces.first() else { return };
    let is_kept = |trace: &&TraceFile| matches!(trace.form, Form::Transcript(_));
    let named = traces.iter().find(is_kept).unwrap_or(first);
    let run = open(&named.path, journal, now).map_err(|error| {
        log::print_warning(format_args!("cannot open the run for its trace: {error:#}"));
    });
    let event = run.as_ref().ok().and_then(|run| went_wrong(run));
    for TraceFile { path, form } in traces {
        let content = match (form, &run) {
            (Form::Transcript(format), _) => Ok(journal.transcript(*format, now)),
            (Form::Page, Ok(run)) => html::page(run).map(String::into_bytes),
            (Form::Page, Err(())) => continue,
        };
        let content = content.map_err(io::Error::other);
        let written = content.and_then(|content| files::replace(path, &content));
        match written.map_err(files::cannot("write the trace", path)) {
            Err(error) => log::print_warning(error),
            Ok(()) if *form == Form::Page => {
                log::print_note(format_args!(
                    "watch the failed run in a browser: {}",
                    path.display()
                ));
            }
            Ok(()) => log::print_note(format_args!("watch the failed run: {}", Command { path, event })),
        }
    }
}

fn open(path: &Path, journal: &Journal, now: Time) -> anyhow::Result<std::sync::Arc<Run>> {
    let content = String::from_utf8(journal.transcript(Format::Json, now))?;
    let recording = Recording::parse(path, Format::Json, &content)?;
    recording.has_beginning(path)?;
    let candidate = recorded::candidate(&recording.header)?;
    let (run, opening) = Run::open(&path.to_string_lossy(), recording, candidate);
    opening.finish();
    Ok(run)
}

/// The command that shows a moment of a run.
struct Command<'a> {
    path: &'a Path,
    event: Option<u64>,
}

impl fmt::Display for Command<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ts3100 view {}", quoted(&self.path.to_string_lossy()))?;
        match self.event {
            Some(event) => write!(f, " --event {event}"),
            None => Ok(()),
        }
    }
}

/// A word as a shell reads it back: bare, or in single quotes.
fn quoted(word: &str) -> String {
    let is_bare = |letter: char| letter.is_alphanumeric() || "/\\._-+:=@%,".contains(letter);
    if !word.is_empty() && word.chars().all(is_bare) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trace_is_a_page_or_a_transcript() {
        let form = |word: &str| word.parse::<TraceFile>().map(|trace| trace.form);
        assert_eq!(form("a.html"), Ok(Form::Page));
        assert_eq!(form("a.TXT"), Ok(Form::Transcript(Format::Text)));
        assert_eq!(form("a.jsonl"), Ok(Form::Transcript(Format::Json)));
        for word in ["a.pcapng", "a", ""] {
            assert_eq!(
                form(word).unwrap_err().to_string(),
                format!("expected a name that ends in .html, .txt or .jsonl, found `{word}`")
            );
        }
    }

    #[test]
    fn a_command_can_be_pasted_into_a_shell() {
        let command = |path: &str, event| {
            let path = Path::new(path);
            Command { path, event }.to_string()
        };
        assert_eq!(
            command("a/b-1.txt", Some(118)),
            "ts3100 view a/b-1.txt --event 118"
        );
        assert_eq!(command("it's a.txt", None), r"ts3100 view 'it'\''s a.txt'");
        assert_eq!(command("a;b.txt", None), "ts3100 view 'a;b.txt'");
    }
}
