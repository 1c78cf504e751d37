//! What matters of a run in a few lines: what went wrong first, the mistakes of the host with their remedies, the last exchange.
//! For a terminal, and for a page whose scripts are blocked.

use crate::key::short_seconds;
use crate::run::Run;
use std::fmt::Write as _;
use ts3100_book::escaped;
use ts3100_control::event::{JournalEvent, NumberedEvent};
use ts3100_controller::findings::{Rule, Severity};
use ts3100_controller::{Event, Port, Time};
use ts3100_proto::escape::Escaped;
use ts3100_proto::words::shortened;

/// Most rules that are listed; the rest is counted.
const MAX_RULES: usize = 20;
/// Most texts of the last exchange.
const MAX_TEXTS: usize = 6;
/// Most characters of a text.
const MAX_TEXT: usize = 120;

/// A rule that the host broke.
#[derive(Debug, Clone)]
pub struct Broken {
    pub rule: &'static Rule,
    pub severity: Severity,
    /// How often.
    pub count: u64,
    /// The first time.
    pub event: u64,
    pub at: Time,
    pub message: String,
}

/// A refused command.
#[derive(Debug, Clone)]
pub struct Refusal {
    pub event: u64,
    pub at: Time,
    pub port: Port,
    pub command: String,
    pub reason: String,
}

/// A text, or data of a channel.
#[derive(Debug, Clone)]
pub struct Text {
    pub event: u64,
    pub at: Time,
    pub port: Port,
    pub from_host: bool,
    pub text: String,
}

/// The summary of a run.
#[derive(Debug, Clone, Default)]
pub struct Summary {
    name: String,
    origin: String,
    departure: Option<String>,
    end: Time,
    events: u64,
    commands: u64,
    refused: u64,
    alarms: Vec<(u64, Time, String)>,
    first_refusal: Option<Refusal>,
    /// In the order of severity, then of time.
    broken: Vec<Broken>,
    last: Vec<Text>,
}

impl Summary {
    /// The summary of a run that is whole.
    pub fn new(run: &Run) -> Summary {
        let mut summary = Summary {
            name: run.name().to_owned(),
            origin: run.header().origin.clone(),
            departure: run.departure().map(|departure| departure.to_string()),
            end: run.end().at,
            ..Summary::default()
        };
        for found in run.events() {
            summary.take(&found);
        }
        summary
            .broken
            .sort_by_key(|broken| (std::cmp::Reverse(broken.severity), broken.event));
        summary
    }

    fn take(&mut self, found: &NumberedEvent) {
        self.events += 1;
        let (seq, at) = (found.seq, found.t);
        if let JournalEvent::Received { port, data } = &found.event {
            self.text(seq, at, *port, true, data);
        } else if let JournalEvent::Sent { port, data } = &found.event {
            self.text(seq, at, *port, false, data);
        }
        let JournalEvent::Controller(event) = &found.event else {
            return;
        };
        if let Event::Answered { .. } = event {
            self.commands += 1;
        } else if let Event::Refused {
            port,
            command,
            reason,
        } = event
        {
            self.refused += 1;
            self.first_refusal.get_or_insert_with(|| Refusal {
                event: seq,
                at,
                port: *port,
                command: command.clone(),
                reason: reason.clone(),
            });
        } else if let Event::Alarm { number, text } = event {
            self.alarms.push((seq, at, format!("{number} {text}")));
        } else if let Event::Finding(finding) = event
            && finding.caused_by.is_none()
        {
            let mut known = self.broken.iter_mut();
            match known.find(|broken| broken.rule.id == finding.rule.id) {
                Some(broken) => broken.count += 1,
                None => self.broken.push(Broken {
                    rule: finding.rule,
                    severity: finding.severity(),
                    count: 1,
                    event: seq,
                    at,
                    message: finding.message.to_string(),
                }),
            }
        }
    }

    fn text(&mut self, event: u64, at: Time, port: Port, from_host: bool, data: &[u8]) {
        let text = Escaped::for_reading(data).to_string();
        let text = shortened(&text, MAX_TEXT).into_owned();
        self.last.push(Text {
            event,
            at,
            port,
            from_host,
            text,
        });
        if self.last.len() > MAX_TEXTS {
            self.last.remove(0);
        }
    }

    /// What the run says in one line.
    fn verdict(&self) -> String {
        let worst = self.broken.first();
        let findings: u64 = self.broken.iter().map(|broken| broken.count).sum();
        let mut parts = vec![counted(self.commands, "command"), counted(self.refused, "NG")];
        parts.push(match worst {
            None => "no findings".to_owned(),
            Some(worst) => format!(
                "{} (worst: {})",
                counted(findings, "finding"),
                worst.severity.as_str()
            ),
        });
        parts.push(counted(self.alarms.len() as u64, "alarm"));
        format!("{} in {} s", parts.join(", "), short_seconds(self.end))
    }

    /// The lines of the summary, by their titles.
    fn lines(&self) -> Vec<(&'static str, Vec<String>)> {
        let mut parts = vec![(
            "Run",
            vec![format!("{} ({})", self.name, self.origin), self.verdict()],
        )];
        if let Some(departure) = &self.departure {
            let told = format!("It does not come out again as it was recorded: {departure}");
            parts.push(("Not exact", vec![told]));
        }
        if let Some(refusal) = &self.first_refusal {
            let Refusal {
                event,
                at,
                port,
                command,
                reason,
            } = refusal;
            parts.push((
                "First NG",
                vec![format!("{}: {port} {command}: {reason}", place(*event, *at))],
            ));
        }
        if !self.alarms.is_empty() {
            let listed = self.alarms.iter().take(MAX_RULES);
            parts.push((
                "Alarms",
                listed
                    .map(|(event, at, text)| format!("{}: {text}", place(*event, *at)))
                    .collect(),
            ));
        }
        if !self.broken.is_empty() {
            let mut listed = Vec::new();
            for broken in self.broken.iter().take(MAX_RULES) {
                let times = if broken.count > 1 {
                    format!(", {} times", broken.count)
                } else {
                    String::new()
                };
                let (rule, severity) = (broken.rule, broken.severity.as_str());
                listed.push(format!(
                    "{}: {severity} {}{times}: {}",
                    place(broken.event, broken.at),
                    rule.id,
                    broken.message
                ));
                listed.push(format!("  Remedy: {}", rule.remedy));
            }
            if self.broken.len() > MAX_RULES {
                listed.push(format!("and {} more rules", self.broken.len() - MAX_RULES));
            }
            parts.push(("Findings", listed));
        }
        let texts = self.last.iter().map(|text| {
            let sign = if text.from_host { '>' } else { '<' };
            format!(
                "{}: {sign} {} {}",
                place(text.event, text.at),
                text.port,
                text.text
            )
        });
        parts.push(("Last texts", texts.collect()));
        parts
    }

    /// For a terminal.
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        for (title, lines) in self.lines() {
            let _ = writeln!(text, "{title}");
            for line in lines {
                let _ = writeln!(text, "  {line}");
            }
        }
        text
    }

    /// As a part of a page, which a script may close.
    pub fn to_html(&self) -> String {
        let mut html = String::from("<details id=\"summary\" open><summary>Summary of the run</summary>\n");
        for (title, lines) in self.lines() {
            let _ = writeln!(html, "<h2>{title}</h2><ul>");
            for line in lines {
                let _ = writeln!(html, "<li>{}</li>", escaped(line.trim_start()));
            }
            html += "</ul>\n";
        }
        html + "</details>\n"
    }
}

/// `1 command`, `2 commands`.
fn counted(count: u64, what: &str) -> String {
    match count {
        1 => format!("1 {what}"),
        count => format!("{count} {what}{}", if what == "NG" { "" } else { "s" }),
    }
}

/// The words for a moment. The page makes links of them.
fn place(event: u64, at: Time) -> String {
    format!("{} s, event {event}", short_seconds(at))
}
