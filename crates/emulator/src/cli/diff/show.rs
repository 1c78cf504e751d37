//! The output of `ts3100 diff`: each difference with its place in the recording, as text or JSON.
//!
//! The differences themselves are found in [`ts3100_recording::diff`].

use super::suggest::Suggestion;
use serde_json::{Value, json};
use std::io::{self, Write};
use std::path::Path;
use std::time::Duration;
use ts3100_proto::escape::Escaped;
use ts3100_recording::diff::{Difference, DifferenceKind, PartDifference, Report};
use ts3100_recording::transcript::EndReason;

/// Longest answer that is shown whole, in bytes.
const MAX_SHOWN: usize = 200;

/// Prints a report.
///
/// # Errors
/// stdout.
pub(super) fn show(path: &Path, report: &Report, closer: &[Suggestion], as_json: bool) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    let written = if as_json {
        writeln!(stdout, "{:#}", report_json(path, report, closer))
    } else {
        stdout.write_all((report_text(path, report) + &suggestion_lines(closer)).as_bytes())
    };
    match written.and_then(|()| stdout.flush()) {
        // Whoever reads has seen enough.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        written => written,
    }
}

/// The kinds of differences, in the order of the summary.
const KINDS: [&str; 5] = ["bytes", "time", "missing", "surplus", "ended"];

fn kind_of(difference: &Difference) -> &'static str {
    match difference.kind {
        DifferenceKind::Bytes { .. } => "bytes",
        DifferenceKind::Time { .. } => "time",
        DifferenceKind::Missing { .. } => "missing",
        DifferenceKind::Surplus { .. } => "surplus",
        DifferenceKind::Ended { .. } => "ended",
    }
}

/// How many differences there are of each of [`KINDS`].
fn counts(report: &Report) -> [usize; 5] {
    let kinds = || report.differences.iter().map(kind_of);
    KINDS.map(|kind| kinds().filter(|other| *other == kind).count())
}

fn report_text(path: &Path, report: &Report) -> String {
    let mut out = String::new();
    for difference in &report.differences {
        out += &format!(
            "{}:{}: {}\n",
            path.display(),
            difference.file_line,
            describe(difference)
        );
    }
    let [bytes, time, missing, surplus, ended] = counts(report);
    out += &format!(
        "{} inputs played, {} answers compared: {bytes} differ in bytes, {time} in time, {missing} missing, {surplus} \
         surplus, {ended} connections end otherwise",
        report.inputs, report.answers
    );
    if report.shifted > 0 {
        out += &format!("; {} equal a moment earlier or later", report.shifted);
    }
    if report.ignored > 0 {
        out += &format!("; {} differences ignored", report.ignored);
    }
    if report.more > 0 {
        out += &format!("; {} further differences not shown", report.more);
    }
    out.push('\n');
    out
}

/// A line for each option that brings the two closer.
fn suggestion_lines(closer: &[Suggestion]) -> String {
    let line =
        |Suggestion { set, left }: &Suggestion| format!("closer with --set {set}: {left} parts left\n");
    closer.iter().map(line).collect()
}

fn describe(difference: &Difference) -> String {
    let Difference {
        at, line, question, ..
    } = difference;
    let after_question = if question.is_empty() {
        String::new()
    } else {
        format!(", {}", quoted(question))
    };
    let place = format!("{line} at {at} s{after_question}");
    match &difference.kind {
        DifferenceKind::Bytes { parts, reason, .. } => {
            let count = if parts.len() == 1 {
                "1 part differs".to_owned()
            } else {
                format!("{} parts differ", parts.len())
            };
            let mut out = format!("{place}: {count}");
            for part in parts {
                out += &format!("\n    {}", part_line(part));
            }
            out + &reason_line(reason.as_deref())
        }
        DifferenceKind::Time {
            recorded,
            recorded_after,
            emulated_after,
        } => format!(
            "{place}: {} came after {}, the emulator's after {}",
            shortened(recorded),
            millis(*recorded_after),
            millis(*emulated_after)
        ),
        DifferenceKind::Missing { recorded, reason } => format!(
            "{place}: the emulator does not send {}{}",
            shortened(recorded),
            reason_line(reason.as_deref())
        ),
        DifferenceKind::Surplus { emulated, reason } => {
            format!(
                "{place}: the emulator sends {} besides{}",
                shortened(emulated),
                reason_line(reason.as_deref())
            )
        }
        DifferenceKind::Ended { recorded, emulated } => {
            let how = |ending: &Option<EndReason>| match ending {
                None => "keeps the connection",
                Some(EndReason::Closed) => "closes the connection",
                Some(EndReason::Reset) => "resets the connection",
                Some(EndReason::Refused) => "refuses the connection",
            };
            format!(
                "{place}: the controller recorded {}, the emulator {}",
                how(recorded),
                how(emulated)
            )
        }
    }
}

fn part_line(part: &PartDifference) -> String {
    let PartDifference {
        key,
        name,
        range,
        recorded,
        emulated,
    } = part;
    let bytes = match range.len() {
        0 => format!("at byte {}", range.start),
        1 => format!("byte {}", range.start),
        _ => format!("bytes {}-{}", range.start, range.end - 1),
    };
    let value = |value: &Option<String>| value.clone().unwrap_or_else(|| "absent".to_owned());
    format!(
        "{name} [{key}], {bytes}: recorded {}, emulator {}",
        value(recorded),
        value(emulated)
    )
}

fn reason_line(reason: Option<&str>) -> String {
    reason
        .map(|reason| format!("\n    the emulator says: {reason}"))
        .unwrap_or_default()
}

fn quoted(question: &str) -> String {
    let short: String = question.chars().take(MAX_SHOWN).collect();
    format!("after `{short}`")
}

fn shortened(bytes: &[u8]) -> String {
    let cut = bytes.get(..MAX_SHOWN).unwrap_or(bytes);
    let more = if cut.len() < bytes.len() { "..." } else { "" };
    format!("{}{more}", Escaped::for_reading(cut))
}

fn millis(duration: Duration) -> String {
    format!("{}.{:03} ms", duration.as_millis(), duration.as_micros() % 1_000)
}

fn report_json(path: &Path, report: &Report, closer: &[Suggestion]) -> Value {
    let closer = closer
        .iter()
        .map(|Suggestion { set, left }| json!({ "set": set, "left": left }));
    let [bytes, time, missing, surplus, ended] = counts(report);
    json!({
        "transcript": path.display().to_string(),
        "equal": report.differences.is_empty(),
        "inputs": report.inputs,
        "answers": report.answers,
        "bytes": bytes,
        "time": time,
        "missing": missing,
        "surplus": surplus,
        "ended": ended,
        "moments": report.shifted,
        "ignored": report.ignored,
        "not_shown": report.more,
        "closer": closer.collect::<Vec<_>>(),
        "differences": report.differences.iter().map(difference_json).collect::<Vec<_>>(),
    })
}

fn difference_json(difference: &Difference) -> Value {
    let shown = |bytes: &[u8]| Escaped::for_reading(bytes).to_string();
    let mut value = match &difference.kind {
        DifferenceKind::Bytes {
            recorded,
            emulated,
            parts,
            reason,
        } => json!({
            "kind": "bytes",
            "recorded": shown(recorded),
            "emulated": shown(emulated),
            "reason": reason,
            "parts": parts.iter().map(part_json).collect::<Vec<_>>(),
        }),
        DifferenceKind::Time {
            recorded,
            recorded_after,
            emulated_after,
        } => json!({
            "kind": "time",
            "recorded": shown(recorded),
            "recorded_after_us": u64::try_from(recorded_after.as_micros()).unwrap_or(u64::MAX),
            "emulated_after_us": u64::try_from(emulated_after.as_micros()).unwrap_or(u64::MAX),
        }),
        DifferenceKind::Missing { recorded, reason } => {
            json!({"kind": "missing", "recorded": shown(recorded), "reason": reason})
        }
        DifferenceKind::Surplus { emulated, reason } => {
            json!({"kind": "surplus", "emulated": shown(emulated), "reason": reason})
        }
        DifferenceKind::Ended { recorded, emulated } => {
            json!({"kind": "ended", "recorded": recorded, "emulated": emulated})
        }
    };
    value["file_line"] = Value::from(difference.file_line);
    value["t_us"] = Value::from(difference.at.as_micros());
    value["line"] = Value::from(difference.line.to_string());
    value["question"] = Value::from(difference.question.as_str());
    value
}

fn part_json(part: &PartDifference) -> Value {
    json!({
        "key": part.key,
        "name": part.name,
        "first": part.range.start,
        "end": part.range.end,
        "recorded": part.recorded,
        "emulated": part.emulated,
    })
}
