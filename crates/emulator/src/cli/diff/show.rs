//! The output of `ts3100 diff`: each difference with its place in the recording, as text or JSON.
//!
//! The differences themselves are found in [`ts3100_recording::diff`].

use super::super::output;
use super::suggest::Suggestion;
use serde_json::{Value, json};
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
pub(super) fn show(path: &Path, report: &Report, closer: &[Suggestion], as_json: bool) -> anyhow::Result<()> {
    output::print(if as_json {
        format!("{:#}\n", report_json(path, report, closer))
    } else {
        report_text(path, report) + &suggestion_lines(closer)
    })
}

/// Number of differences of each kind, in the order of the summary.
fn counts(report: &Report) -> [usize; 5] {
    let differences = || report.differences.iter();
    let count = |is: fn(&DifferenceKind) -> bool| differences().filter(|other| is(&other.kind)).count();
    [
        count(|kind| matches!(kind, DifferenceKind::Bytes { .. })),
        count(|kind| matches!(kind, DifferenceKind::Time { .. })),
        count(|kind| matches!(kind, DifferenceKind::Missing { .. })),
        count(|kind| matches!(kind, DifferenceKind::Surplus { .. })),
        count(|kind| matches!(kind, DifferenceKind::Ended { .. })),
    ]
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
        first,
        end,
        recorded,
        emulated,
    } = part;
    let bytes = match end - first {
        0 => format!("at byte {first}"),
        1 => format!("byte {first}"),
        _ => format!("bytes {first}-{}", end - 1),
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
        "differences": report.differences,
    })
}
