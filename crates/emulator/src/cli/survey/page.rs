//! A file of a survey for people, as text and as a page of HTML.

use super::{line, question, said, summary};
use ts3100_book::escaped;
use ts3100_survey::{Report, ledger};

/// Before what the answers do not settle.
const REMAINING: &str = "Of the emulator remains assumed, with this controller too:";

/// Formats the report as text.
pub(super) fn text(report: &Report) -> String {
    let mut out = format!("Survey of {} ({})\n", of(report), report.made_by);
    for row in facts(report) {
        out += &format!("{row}\n");
    }
    out += "\n";
    for answer in &report.answers {
        out += &format!("{}\n{:<32} {}\n", line(answer), "", question(answer));
    }
    out += &format!("\n{}\n\n{REMAINING}\n", summary(report));
    for row in ledger::remaining(report) {
        out += &format!("{:<10} {}\n", row.id, row.behaviour);
    }
    out
}

/// Formats the report as a page of HTML.
pub(super) fn html(report: &Report) -> String {
    let rows = report.answers.iter().map(|answer| {
        let sets = answer.sets.as_ref();
        let sets = sets.map_or_else(String::new, |(option, value)| format!("{option} = {value}"));
        let verdict = ts3100_proto::words::Word::word(answer.verdict);
        let traffic = match answer.traffic.is_empty() {
            true => String::new(),
            false => format!(
                "<details><summary>bytes</summary><pre>{}</pre></details>",
                escaped(&answer.traffic.join("\n"))
            ),
        };
        format!(
            "<tr class={verdict}><td>{}</td><td>{}</td><td>{verdict}</td><td>{}{traffic}</td><td><code>{}</code></td></tr>\n",
            escaped(&answer.probe),
            escaped(question(answer)),
            escaped(said(answer)),
            escaped(&sets)
        )
    });
    let remaining = ledger::remaining(report).map(|row| {
        let (id, behaviour) = (escaped(row.id), escaped(row.behaviour));
        format!("<dt>{id}<dd>{behaviour}\n")
    });
    let facts: Vec<String> = facts(report)
        .iter()
        .map(|fact| format!("<li>{}</li>", escaped(fact)))
        .collect();
    format!(
        "<!doctype html><html lang=en><meta charset=utf-8><meta name=viewport content=\"width=device-width\">\
         <title>Survey of {of}</title><style>{STYLE}</style><h1>Survey of {of}</h1><p>{}</p><ul>{}</ul>\n\
         <table><thead><tr><th>Name<th>Question<th>Verdict<th>Answer<th>Option</tr></thead><tbody>\n{}</tbody></table>\n\
         <h2>{REMAINING}</h2><dl>\n{}</dl></html>\n",
        summary(report),
        facts.concat(),
        rows.collect::<String>(),
        remaining.collect::<String>(),
        of = escaped(&of(report)),
    )
}

const STYLE: &str = "\
:root{color-scheme:light dark}body{font:16px/1.4 system-ui,sans-serif;max-width:75rem;margin:2rem auto;padding:0 1rem}\
table{border-collapse:collapse;width:100%}th,td{text-align:left;vertical-align:top;padding:.35rem .6rem;border-bottom:1px solid #8886}\
tr.variation td:nth-child(3){font-weight:600}tr.unknown td:nth-child(3){font-weight:600;text-decoration:underline}\
pre{white-space:pre-wrap;overflow-wrap:anywhere}";

fn of(report: &Report) -> String {
    match report.versions.first() {
        Some(version) => format!("{version}, {}", report.arm),
        None => "a recorded controller".to_owned(),
    }
}

fn facts(report: &Report) -> Vec<String> {
    let mut facts = Vec::new();
    if let Some(reason) = &report.stopped {
        facts.push(format!("Stopped at an unexpected reply: {reason}"));
    }
    facts.extend(report.left.iter().map(|left| format!("Not restored: {left}")));
    if let [least, _, middle, _, greatest] = report.answer_times.as_slice() {
        facts.push(format!(
            "Answers take {least} to {greatest} ms, half of them at most {middle} ms"
        ));
    }
    facts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_survey_met_besides_its_answers_is_said_in_both_forms() {
        let report = Report {
            made_by: "a test".to_owned(),
            share: false,
            versions: Vec::new(),
            arm: "six axes".to_owned(),
            answers: Vec::new(),
            stopped: Some("<STX>NG<CR><ETX>".to_owned()),
            left: vec!["the servo is on".to_owned()],
            answer_times: vec![1.5, 2.0, 3.0, 4.0, 9.0],
        };
        let text = text(&report);
        let lines: Vec<&str> = text.lines().skip(1).take(3).collect();
        let facts = [
            "Stopped at an unexpected reply: <STX>NG<CR><ETX>",
            "Not restored: the servo is on",
            "Answers take 1.5 to 9 ms, half of them at most 3 ms",
        ];
        assert_eq!(lines, facts);
        let items = facts.map(|fact| format!("<li>{}</li>", escaped(fact))).concat();
        assert!(html(&report).contains(&format!("<ul>{items}</ul>")));
    }
}
