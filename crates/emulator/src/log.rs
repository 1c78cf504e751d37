//! The log on stderr: one line for each event of the controller, as text with control codes by name or as one JSON
//! object. `<` marks what a host sent, `>` what the controller sent.
//!
//! This module decides the wording and the level of a line, and joins a finding with the refusal it explains. Which
//! events exist is decided by the controller. How lines reach stderr is in `log::writer`; how repeated lines are
//! folded is in `log::fold`.
//!
//! The JSON lines do not have the serde form of the events. Their keys are published too and are others: `t` is a string,
//! `row` is `command` there, a text has its frame and no `hex`. Moreover `tracing` wants the names of fields when it is
//! compiled.

mod fold;
mod writer;

use crate::config::args::LogFormat;
use std::fmt::{self, Display, Formatter};
use tracing::level_filters::LevelFilter;
use tracing::{debug, info, warn};
use tracing_subscriber::fmt::format::debug_fn;
use ts3100_controller::Controller;
use ts3100_controller::faults::FaultCause;
use ts3100_controller::findings::{Finding, Rule, Severity};
use ts3100_controller::input::Input;
use ts3100_controller::output::{Event, Output, Verdict};
use ts3100_controller::port::Port;
use ts3100_controller::time::Time;
use ts3100_driver::seat::{Side, Subscriber};
use ts3100_proto::escape::Escaped;
use ts3100_proto::text::{Framing, Terminator};

/// The rule of a command that is refused although it is valid in this mode.
const REFUSED_BY_STATE: &str = ts3100_controller::findings::rules::REFUSED_BY_STATE.id;
/// The rule of an operation at the panel that had no effect.
const REFUSED_AT_PANEL: &str = ts3100_controller::findings::rules::PANEL_REFUSED.id;

/// Starts logging to stderr for the whole process; the second and later calls change nothing.
/// `verbose` 0 shows connections, states and refusals, 1 also every text, 2 also every byte.
pub fn start(verbose: u8, format: LogFormat) {
    start_quiet(verbose.saturating_add(1), format);
}

/// Starts logging for `exec`, where people read the output of the command: `verbose` 0 shows only warnings and errors,
/// each further step shows as much as one step less of [`start`].
pub fn start_quiet(verbose: u8, format: LogFormat) {
    let level = match verbose {
        0 => LevelFilter::WARN,
        1 => LevelFilter::INFO,
        2 => LevelFilter::DEBUG,
        _ => LevelFilter::TRACE,
    };
    let builder = tracing_subscriber::fmt()
        .with_max_level(level)
        .with_writer(writer::LogWriter::start(format))
        .with_target(false)
        .with_ansi(false);
    // Fails when the process has a logger already; that one is used then.
    let _ = match format {
        LogFormat::Json => builder.json().flatten_event(true).try_init(),
        LogFormat::Text => {
            // The fields repeat the message for programs, so the text form omits them.
            let message_only = debug_fn(|writer, field, value| match field.name() {
                // `robot` is of a span: whose line it is.
                "message" | "robot" => write!(writer, "{value:?}"),
                _ => Ok(()),
            });
            builder.fmt_fields(message_only).try_init()
        }
    };
}

pub(crate) use writer::{flush, print_error, print_note, print_warning};

/// Displays a text (framed message) as on the wire, with `<STX>` and `<ETX>`, without a checksum. It is formatted only
/// when a line is written.
struct EscapedText<'a>(Framing, &'a [u8], Terminator);

impl Display for EscapedText<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let stx = match self.0 {
            Framing::Stx => "<STX>",
            Framing::Bare => "",
        };
        let etx = match self.2 {
            Terminator::Etx => "<ETX>",
            Terminator::Cr => "",
        };
        write!(f, "{stx}{}{etx}", Escaped::for_reading(self.1))
    }
}

/// Logs the same line as a warning or not.
macro_rules! warn_or_info {
    ($is_warning:expr, $($line:tt)*) => {
        if $is_warning {
            warn!($($line)*);
        } else {
            info!($($line)*);
        }
    };
}

/// The port at the beginning of a line, where there is one.
struct Place<'a>(Option<&'a str>);

impl Display for Place<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        self.0.map_or(Ok(()), |port| write!(f, "{port}: "))
    }
}

/// Logs the events of one controller.
#[derive(Debug, Default)]
pub struct EventLog {
    /// Rules already logged in full, by port. A host that breaks a rule usually does so in every text, so later findings
    /// are logged at level debug.
    /// One that a fault has caused is not the host's: the first of the host is still logged in full.
    reported: Vec<(Option<Port>, &'static Rule, bool, String)>,
    /// Numbers of the alarms already logged with the command that explains them.
    explained: Vec<String>,
    /// The last finding, held back: if the next event refuses the same text, both become one line.
    pending: Option<PendingFinding>,
}

/// A finding that is not logged yet.
#[derive(Debug)]
struct PendingFinding {
    t: Time,
    finding: Finding,
}

impl EventLog {
    /// Logs one event. `now` is virtual time; JSON lines have it as `t` in seconds.
    fn write(&mut self, now: Time, event: &Event) {
        if let Event::Finding(finding) = event {
            self.flush();
            let finding = finding.clone();
            self.pending = Some(PendingFinding { t: now, finding });
            return;
        }
        if let Event::Refused {
            port,
            command,
            reason,
        } = event
        {
            let about = self.pending.take_if(|held| held.finding.port == Some(*port));
            self.flush();
            let about = about.map(|held| held.finding);
            self.log_refusal(now, *port, (command, reason), about.as_ref());
            return;
        }
        // An answer comes between a finding and the refusal it explains, so the finding stays held back.
        if !matches!(event, Event::Answered { .. }) {
            self.flush();
        }
        if let Event::Alarm { number, text } = event {
            self.log_alarm(now, number, text);
        } else {
            log_event(now, event);
        }
    }

    /// Logs an alarm, the first of its number with the command that explains it.
    fn log_alarm(&mut self, t: Time, number: &str, text: &str) {
        let mut see = String::new();
        if !self.explained.iter().any(|known| known == number) {
            self.explained.push(number.to_owned());
            see = format!(". See `{}`", ts3100_book::explain_command(number));
        }
        warn!(event = "alarm", %t, number, text, "alarm {number} {text}{see}");
    }

    /// Logs a finding that is held back.
    fn flush(&mut self) {
        if let Some(held) = self.pending.take() {
            self.log_finding(&held);
        }
    }

    /// Whether this is the first finding of a rule on a port, which is noted. At the panel each refusal is another one.
    fn is_first(&mut self, finding: &Finding) -> bool {
        let message = match finding.rule.id {
            REFUSED_AT_PANEL => finding.message.to_string(),
            _ => String::new(),
        };
        let key = (finding.port, finding.rule, finding.caused_by.is_some(), message);
        let is_new = !self.reported.contains(&key);
        if is_new {
            self.reported.push(key);
        }
        is_new
    }

    /// Logs a text that was answered NG, with the finding about it. The rule is explained once for each host.
    fn log_refusal(
        &mut self,
        t: Time,
        port: Port,
        (command, reason): (&str, &str),
        finding: Option<&Finding>,
    ) {
        let known = finding.map(|finding| finding.rule);
        let first = finding.filter(|finding| self.is_first(finding));
        let severity = finding.map(|finding| finding.severity().as_str());
        let cause = finding.and_then(|finding| finding.caused_by);
        let caused_by = cause.map(|cause| cause.to_string());
        let (port, rule) = (port.name(), known.map(|rule| rule.id));
        let about = finding.map_or_else(String::new, |finding| refusal_rule(finding, reason));
        let Some(found) = first else {
            info!(
                event = "refused",
                %t, port, command, reason, rule, severity, "caused-by" = caused_by,
                "{port}: {command} refused: {reason}{about}"
            );
            return;
        };
        let (level, remedy) = (found.severity(), found.rule.remedy);
        let advice = match rule {
            // The host has nothing to change.
            _ if cause.is_some() => String::new(),
            // The state of the robot is the reason; the command's section lists what it needs.
            Some(REFUSED_BY_STATE) => format!(". See `{}`", ts3100_book::explain_command(command)),
            _ => format!(". {}", advice(found.rule)),
        };
        warn_or_info!(
            level > Severity::Note,
            event = "refused",
            %t, port, command, reason, rule, severity, remedy, "caused-by" = caused_by,
            "{port}: {command} refused: {reason}{about}{advice}"
        );
    }

    fn log_finding(&mut self, PendingFinding { t, finding: found }: &PendingFinding) {
        let (known, port, message) = (found.rule, found.port, &found.message);
        let first = self.is_first(found);
        // A hasty host has a finding with each text.
        if !first && !tracing::enabled!(tracing::Level::DEBUG) {
            return;
        }
        let (port, rule) = (port.map(Port::name), known.id);
        let (place, severity, remedy) = (Place(port), found.severity().as_str(), known.remedy);
        let caused_by = found.caused_by.map(|cause| cause.to_string());
        let cause = cause_words(found.caused_by);
        if !first {
            debug!(
                event = "finding",
                %t, rule, severity, port, "caused-by" = caused_by, "{place}finding {rule}: {message}{cause}"
            );
            return;
        }
        // The host has nothing to change where a fault is the cause.
        let advice = match found.caused_by {
            Some(_) => String::new(),
            None => format!(". {}", advice(known)),
        };
        warn_or_info!(
            found.severity() > Severity::Note,
            event = "finding",
            %t, rule, severity, port, remedy, "caused-by" = caused_by,
            "{place}finding {rule}: {message}{cause}{advice}"
        );
    }
}

impl Subscriber for EventLog {
    fn input(&mut self, _at: Time, input: &Input, _by: Side) {
        if let Input::Connected { port, .. } = input {
            // Another host is told of its findings in full again.
            self.reported.retain(|(shown, ..)| *shown != Some(*port));
        }
    }

    fn output(&mut self, at: Time, output: &Output) {
        if let Output::Event(event) = output {
            self.write(at, event);
        } else if let Output::Pendant(text) = output {
            info!(event = "pendant", text, "teach pendant: {text}");
        }
    }

    fn settled(&mut self, _at: Time, _controller: &Controller) {
        self.flush();
    }
}

/// Advice to the author of the host, with the command that explains more.
fn advice(rule: &Rule) -> String {
    format!("{} See `{}`", rule.remedy, ts3100_book::explain_command(rule.id))
}

/// The rule in the line of a refusal, with the message of the finding where the reason does not have it already.
fn refusal_rule(finding: &Finding, reason: &str) -> String {
    let (rule, message) = (finding.rule.id, finding.message.to_string());
    let cause = cause_words(finding.caused_by);
    if message.contains(reason) {
        format!(" ({rule}){cause}")
    } else {
        format!(" ({rule}: {message}){cause}")
    }
}

/// The fault at the end of a line about a finding that it has caused.
fn cause_words(cause: Option<FaultCause>) -> String {
    cause.map_or_else(String::new, |cause| format!(" (caused-by: {cause})"))
}

/// Logs an event that does not depend on others.
fn log_event(t: Time, event: &Event) {
    match event {
        // The line with the bytes shows the same.
        Event::TextIn { .. } | Event::TextOut { .. } if writer::shows_bytes() => {}
        Event::TextIn {
            port,
            framing,
            data,
            terminator,
        } => {
            let text = EscapedText(*framing, data, *terminator);
            debug!(event = "text-in", %t, port = port.name(), %text, "{port} < {text}");
        }
        Event::TextOut { port, framing, data } => {
            let text = EscapedText(*framing, data, Terminator::Etx);
            debug!(event = "text-out", %t, port = port.name(), %text, "{port} > {text}");
        }
        Event::Dropped { port, bytes, reason } => {
            info!(
                event = "dropped",
                %t,
                port = port.name(),
                bytes,
                "{port}: {bytes} bytes dropped: {reason}"
            );
        }
        Event::Fault {
            id,
            kind,
            port,
            message,
            fired,
        } => log_fault(t, (*id, kind), port.map(Port::name), message, *fired),
        // Logged by `EventLog::write`, which joins the first two.
        Event::Finding(_) | Event::Refused { .. } | Event::Alarm { .. } => {}
        Event::Answered {
            port,
            row,
            mode,
            verdict,
            ..
        } => log_answered(t, *port, (row, mode.as_str()), *verdict),
        Event::ActionRefused(error) => info!(event = "action-refused", "{error}"),
        Event::AlarmsReset => info!(event = "alarms-reset", %t, "alarms reset"),
        Event::Status { status, line } => {
            let status = status.as_str();
            info!(event = "status", %t, status, line, "status: {status}, line {line}");
        }
        Event::Statement { line, task, .. } => {
            debug!(event = "statement", %t, line, task, "task {task}: line {line}");
        }
        Event::Breakpoint { line, task, text } => {
            info!(event = "breakpoint", %t, line, task, "breakpoint, line {line}: {text}");
        }
        Event::Servo(on) => {
            let word = if *on { "on" } else { "off" };
            info!(event = "servo", %t, on, "servo {word}");
        }
        Event::ServoDelayed(until) => {
            let until = until.to_string();
            info!(
                event = "servo-delayed",
                %t, until, "servo on: delayed until {until}"
            );
        }
        Event::Selected(Some(file)) => info!(event = "selected", %t, file, "selected: {file}"),
        Event::Selected(None) => info!(event = "selected", %t, "selected: none"),
    }
}

fn log_answered(t: Time, port: Port, (row, mode): (&str, &str), verdict: Verdict) {
    let port = port.name();
    debug!(
        event = "answered",
        %t, port, row, mode, "{port}: {row} in {mode}: {verdict:?}"
    );
}

fn log_fault(t: Time, (id, kind): (u32, &str), port: Option<&str>, text: &str, fired: bool) {
    let place = Place(port);
    if fired {
        warn!(
            event = "fault",
            %t, id, kind, port, text, "{place}fault {id} {kind}: {text}"
        );
    } else {
        info!(
            event = "fault-armed",
            %t, id, kind, text, "fault {id} {kind}: {text}"
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::every_event::{bless, compare, moment, outputs};
    use ts3100_controller::findings::rules;
    use ts3100_proto::status::MasterMode;

    fn no_cr(port: Option<Port>) -> PendingFinding {
        PendingFinding {
            t: Time::ZERO,
            finding: Finding {
                rule: &rules::NO_CR,
                port,
                at: Time::ZERO,
                bytes: ts3100_controller::Bytes::new(),
                message: "".into(),
                caused_by: None,
            },
        }
    }

    #[test]
    fn a_rule_is_told_once_a_host_and_port() {
        let mut log = EventLog::default();
        log.log_finding(&no_cr(Some(Port::Ip0)));
        log.log_finding(&no_cr(Some(Port::Host)));
        log.log_finding(&no_cr(Some(Port::Host)));
        assert_eq!(log.reported.len(), 2);
        let (port, peer) = (Port::Host, String::new());
        log.input(Time::ZERO, &Input::Connected { port, peer }, Side::Host);
        let of_ip0 = (Some(Port::Ip0), &rules::NO_CR, false, String::new());
        assert_eq!(log.reported, [of_ip0]);
    }

    #[test]
    fn each_different_refusal_at_the_panel_is_told() {
        let refused = |message: &str| {
            let finding = Finding {
                rule: &rules::PANEL_REFUSED,
                message: message.to_owned().into(),
                ..no_cr(None).finding
            };
            Event::Finding(finding)
        };
        let [servo, start] = [
            refused("cannot turn the servo on"),
            refused("cannot start the program"),
        ];
        let told = lines(&[servo.clone(), start, servo, Event::AlarmsReset]);
        assert_eq!(told.len(), 3, "{told:?}");
    }

    /// The JSON lines logged for these events.
    fn lines(events: &[Event]) -> Vec<String> {
        written(LevelFilter::INFO, |log| {
            events.iter().for_each(|event| log.write(Time::ZERO, event));
        })
    }

    /// The JSON lines, but for their wall-clock time, that a log is made to write.
    fn written(most: LevelFilter, write: impl FnOnce(&mut EventLog)) -> Vec<String> {
        #[derive(Clone, Default)]
        struct SharedBuffer(std::sync::Arc<std::sync::Mutex<Vec<u8>>>);
        impl std::io::Write for SharedBuffer {
            fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
                self.0.lock().unwrap().extend(bytes);
                Ok(bytes.len())
            }
            fn flush(&mut self) -> std::io::Result<()> {
                Ok(())
            }
        }
        let kept = SharedBuffer::default();
        let writer = kept.clone();
        let subscriber = tracing_subscriber::fmt()
            .json()
            .flatten_event(true)
            .without_time();
        let subscriber = subscriber
            .with_max_level(most)
            .with_writer(move || writer.clone())
            .finish();
        tracing::subscriber::with_default(subscriber, || {
            let mut log = EventLog::default();
            write(&mut log);
            log.flush();
        });
        let text = String::from_utf8(kept.0.lock().unwrap().clone()).unwrap();
        text.lines().map(str::to_owned).collect()
    }

    const GOLDEN: &str = "log.jsonl";

    /// The lines of every event.
    fn of_every_event() -> String {
        let lines = written(LevelFilter::TRACE, |log| {
            for (place, output) in outputs().iter().enumerate() {
                log.output(moment(place), output);
            }
        });
        lines.join("\n") + "\n"
    }

    #[test]
    fn every_event_has_its_line() {
        compare(GOLDEN, &of_every_event());
    }

    #[test]
    #[ignore = "writes fixtures/golden/events anew; review the difference"]
    fn bless_log() {
        bless(GOLDEN, &of_every_event());
    }

    #[test]
    fn a_text_that_is_refused_is_one_line_with_what_is_wrong_with_it() {
        let finding = |rule, port, message: &str| {
            Event::Finding(Finding {
                rule,
                port: Some(port),
                at: Time::ZERO,
                bytes: ts3100_controller::Bytes::new(),
                message: message.into(),
                caused_by: None,
            })
        };
        let refused = Event::Refused {
            port: Port::Ip0,
            command: "XX".to_owned(),
            reason: "no command".to_owned(),
        };
        let answered = Event::Answered {
            port: Port::Ip0,
            row: "RS",
            mode: MasterMode::ExtEther,
            verdict: Verdict::Refused,
        };
        let bad = finding(&rules::UNKNOWN_COMMAND, Port::Ip0, "two letters expected");
        let logged = lines(&[
            finding(&rules::NO_CR, Port::Host, "no CR"),
            bad.clone(),
            answered,
            refused.clone(),
            bad.clone(),
            refused,
            bad,
        ]);
        assert_eq!(logged.len(), 3, "{logged:#?}");
        let read = |at: usize| serde_json::from_str::<serde_json::Value>(&logged[at]).unwrap();
        assert_eq!(read(0)["event"], "finding");
        for (at, level) in [(1, "WARN"), (2, "INFO")] {
            let line = read(at);
            for (key, value) in [
                ("event", "refused"),
                ("command", "XX"),
                ("reason", "no command"),
                ("rule", "unknown-command"),
                ("port", "IP0"),
                ("level", level),
            ] {
                assert_eq!(line[key], value, "{line}");
            }
        }
        let message = read(1)["message"].to_string();
        assert!(
            message.contains(
                "IP0: XX refused: no command (unknown-command: two letters expected). Use a command"
            ),
            "{message}"
        );
    }

    #[test]
    fn an_alarm_and_a_refused_command_name_what_explains_them_once() {
        let alarm = Event::Alarm {
            number: "2-046".into(),
            text: "Text".into(),
        };
        let refused = || {
            let finding = Finding {
                rule: &rules::REFUSED_BY_STATE,
                ..no_cr(Some(Port::Ip0)).finding
            };
            let refused = Event::Refused {
                port: Port::Ip0,
                command: "RN".to_owned(),
                reason: "servo power is off".to_owned(),
            };
            [Event::Finding(finding), refused]
        };
        let [[a, b], [c, d]] = [refused(), refused()];
        let logged = lines(&[alarm.clone(), alarm, a, b, c, d]);
        let counted = |words: &str| logged.iter().filter(|line| line.contains(words)).count();
        assert_eq!(logged.len(), 4, "{logged:#?}");
        for code in ["2-046", "RN"] {
            assert_eq!(
                counted(&format!(". See `ts3100 explain {code}`")),
                1,
                "{logged:#?}"
            );
        }
    }

    #[test]
    fn control_codes_are_named_and_other_bytes_are_hex() {
        let shown = |framing, data: &[u8], end| EscapedText(framing, data, end).to_string();
        assert_eq!(shown(Framing::Stx, b"SO\r", Terminator::Etx), "<STX>SO<CR><ETX>");
        assert_eq!(shown(Framing::Bare, b"SO\r", Terminator::Cr), "SO<CR>");
        assert_eq!(
            shown(Framing::Bare, b"FL,A\n\x1a", Terminator::Etx),
            "FL,A<LF><EOF><ETX>"
        );
        assert_eq!(
            Escaped::for_reading(&[0, 0x7F, 0xFF, b'~']).to_string(),
            "<00><7F><FF>~"
        );
    }
}
