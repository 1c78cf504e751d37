//! Findings as JUnit XML: one test case a rule, so that a CI shows each rule that was kept, too.

use super::findings::line;
use super::settings::Deny;
use std::fmt::Write as _;
use ts3100_controller::findings::{Findings, RULES, Rule, Tally};

/// The document. A broken rule is a failure if it is denied; without any denial, if it is a warning or an error.
pub(super) fn document(findings: &Findings, fails: impl Fn(&Rule) -> bool) -> String {
    let broken: Vec<(&Rule, &Tally)> = findings.broken().collect();
    let failures = broken.iter().filter(|(rule, _)| fails(rule)).count();
    let counts = format!(
        "tests=\"{}\" failures=\"{failures}\" errors=\"0\" skipped=\"0\" time=\"0\"",
        RULES.len()
    );
    let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n");
    let _ = writeln!(xml, "  <testsuite name=\"ts3100 findings\" {counts}>");
    for rule in RULES {
        let tally = broken
            .iter()
            .find(|(other, _)| *other == rule)
            .map(|(_, tally)| *tally);
        case(&mut xml, rule, tally, fails(rule));
    }
    xml.push_str("  </testsuite>\n</testsuites>\n");
    xml
}

/// Whether a broken rule fails its test case when these are denied.
pub(super) fn fails(deny: &[Deny], rule: &Rule) -> bool {
    // What is denied of faults says nothing of rules.
    if deny.iter().all(|deny| *deny == Deny::NeverFired) {
        return Deny::WARNINGS.covers(rule);
    }
    deny.iter().any(|deny| deny.covers(rule))
}

fn case(xml: &mut String, rule: &Rule, tally: Option<&Tally>, fails: bool) {
    let severity = rule.severity.as_str();
    let head = format!(
        "    <testcase classname=\"ts3100.findings.{severity}\" name=\"{}\" time=\"0\"",
        rule.id
    );
    let Some(tally) = tally else {
        let _ = writeln!(xml, "{head}/>");
        return;
    };
    let mut text = format!("{}\nManual: {}\nDo: {}\n", rule.title, rule.source, rule.remedy);
    for finding in &tally.first {
        let _ = writeln!(text, "{}", line(finding));
    }
    let more = tally.count.saturating_sub(tally.first.len() as u64);
    if more > 0 {
        let _ = writeln!(text, "and {more} more");
    }
    let message = escape(&format!("{} ({} times)", rule.title, tally.count));
    let _ = writeln!(xml, "{head}>");
    let text = escape(&text);
    if fails {
        let _ = writeln!(
            xml,
            "      <failure message=\"{message}\" type=\"{severity}\">{text}</failure>"
        );
    } else {
        let _ = writeln!(xml, "      <system-out>{text}</system-out>");
    }
    xml.push_str("    </testcase>\n");
}

/// Text in XML; what XML 1.0 cannot hold becomes `?`.
pub(crate) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\n' | '\t' => escaped.push(letter),
            control if control.is_control() || matches!(control, '\u{FFFE}' | '\u{FFFF}') => {
                escaped.push('?');
            }
            plain => escaped.push(plain),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::escape;

    #[test]
    fn what_xml_cannot_hold_is_not_written() {
        assert_eq!(
            escape("<a & \"b\">\u{1}\u{FFFE}ä\n"),
            "&lt;a &amp; &quot;b&quot;&gt;??ä\n"
        );
    }
}
