//! Asks a controller, question by question.

use crate::catalogue;
use crate::forms;
use crate::peer::{Connection, Peer, PeerError};
use crate::probe::{Ask, Class, Probe, Verdict};
use crate::report::{Answer, Report};
use crate::session::{FILE, PATIENCE, ProbeError, QUIET, Reply, Session};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use ts3100_proto::command::RunMode;
use ts3100_proto::escape::parse;
use ts3100_proto::status::ca::decode_directory;
use ts3100_proto::status::sf::SystemStatus;
use ts3100_proto::status::{ExecutionStatus, MasterMode};
use ts3100_proto::text::{Checksum, ETX, STX};

#[derive(Debug, Clone, Default)]
pub struct Plan {
    /// Only questions of these classes.
    pub classes: Vec<Class>,
    /// Only the questions with these names; empty: all.
    pub only: Vec<String>,
    /// Set by others: the survey asks nothing more and restores its changes.
    pub stop: Arc<AtomicBool>,
}

impl Plan {
    /// The questions, in their order.
    pub fn probes(&self) -> impl Iterator<Item = &'static Probe> {
        catalogue::probes().filter(|probe| {
            self.classes.contains(&probe.class)
                && (self.only.is_empty() || self.only.iter().any(|id| id == probe.id))
        })
    }
}

/// State from before the run, to be restored.
#[derive(Debug, Default)]
struct Before {
    /// The selected file, where the survey may select another one; empty for none.
    selected: Option<String>,
    /// Servo power and the angles of the arm, where the survey may change them.
    arm: Option<SystemStatus>,
}

/// Asks a controller; `watch` sees each answer. The survey restores all its changes, also when it has to stop; the
/// report lists what it could not restore.
///
/// # Errors
/// No controller answers.
pub fn survey(peer: &mut dyn Peer, plan: &Plan, watch: &mut dyn FnMut(&Answer)) -> Result<Report, PeerError> {
    let is_serial = peer.is_serial();
    let mut session = Session::new(peer, Arc::clone(&plan.stop));
    let mut report = Report::default();
    if let Err(error) = greet(&mut session, &mut report) {
        return Err(PeerError::Unreachable(error.to_string()));
    }
    let mut before = Before::default();
    let mut class = None;
    let mut is_surprised = false;
    for probe in plan.probes() {
        let allowed = match &report.stopped {
            Some(_) => Err(ProbeError::Refused("the survey had stopped".to_owned())),
            None if class == Some(probe.class) => Ok(()),
            None => {
                let prepared = prepare(&mut session, probe.class, &mut before);
                if prepared.is_ok() {
                    class = Some(probe.class);
                }
                prepared
            }
        };
        // What was sent before is no answer: SF has positions, and CA names.
        session.traffic().take();
        let mut answer = match allowed.and_then(|()| ask(&mut session, probe)) {
            Ok(heard) => Answer::heard(probe, heard),
            Err(ProbeError::Refused(reason)) => Answer::without(probe, Verdict::Refused, reason),
            Err(ProbeError::Unexpected(reason) | ProbeError::Timeout(reason)) => {
                report.stopped = Some(format!("{}: {reason}", probe.id));
                Answer::without(probe, Verdict::Unknown, reason)
            }
        };
        answer.traffic = session.traffic().take();
        if !probe.is_public {
            answer.traffic.clear();
        }
        watch(&answer);
        report.answers.push(answer);
        // What was not prepared was not asked: the file of that name may be the user's.
        if report.stopped.is_none()
            && class == Some(probe.class)
            && probe.class >= Class::Files
            && let Err(error) = tidy(&mut session, probe.class)
            && !error.is_refusal()
        {
            report.stopped = Some(format!("after {}: {error}", probe.id));
        }
        is_surprised |= report.stopped.is_some() && !plan.stop.load(Ordering::Relaxed);
    }
    if is_surprised {
        distrust_silence(&mut report);
    }
    session.ignore_interruptions();
    if class >= Some(Class::Files) || before.arm.is_some() {
        report.left = put_back(&mut session, &before, report.stopped.is_some());
    }
    if !is_serial {
        // There the line takes most of the time.
        report.answer_times = session.delays().quartiles();
    }
    redact(&mut report, &mut session);
    Ok(report)
}

/// Reasons may tell what a controller has sent.
fn redact(report: &mut Report, session: &mut Session<'_>) {
    let answers = report.answers.iter_mut();
    let texts = answers.flat_map(|answer| [&mut answer.heard, &mut answer.note]);
    for text in texts.chain(&mut report.stopped).chain(&mut report.left) {
        *text = String::from_utf8_lossy(&session.traffic().redacted(text.as_bytes())).into_owned();
    }
}

/// Finds out whether texts have a checksum, and what kind of controller it is.
fn greet(session: &mut Session<'_>, report: &mut Report) -> Result<(), ProbeError> {
    session.reopen()?;
    let text = session.text("SU\r");
    session.send_at_once(&text)?;
    let mut heard = session.receive()?;
    let is_no_text = session.is_partial();
    if heard.is_none() {
        // With checksums the controller still waits for that of the text; without, one byte between texts is nothing.
        session.set_checksum(Checksum::Sum);
        let sum = session.text("SU\r").last().copied();
        session.send_at_once(&Vec::from_iter(sum))?;
        heard = session.receive()?;
    }
    let heard = heard.ok_or_else(|| match is_no_text {
        true => ProbeError::Unexpected("the reply to SU is not a TS3100 message".to_owned()),
        false => ProbeError::Timeout("no reply to SU".to_owned()),
    })?;
    if !heard.data.starts_with(b"FL,") {
        return Err(ProbeError::Unexpected(
            "the reply to SU is not a status".to_owned(),
        ));
    }
    session.rest_of_content("SU", heard)?;
    let status = session.status()?;
    session.traffic().hide(&status.file);
    if let Some(content) = session.content("VR")? {
        report.versions = forms::version_records(&content);
    }
    if let Some(content) = session.content("CA")? {
        for entry in decode_directory(&content).unwrap_or_default() {
            session.traffic().hide(&entry.name);
        }
    }
    let (form, _) = session.total_status()?;
    report.arm = forms::arm(form);
    Ok(())
}

/// Whether the controller is in a state in which questions of this class can be asked.
fn prepare(session: &mut Session<'_>, class: Class, before: &mut Before) -> Result<(), ProbeError> {
    if class == Class::Look {
        return Ok(());
    }
    let refused = |reason: &str| Err(ProbeError::Refused(reason.to_owned()));
    let status = session.status()?;
    if !matches!(status.execution, ExecutionStatus::Reset) {
        return refused("a program runs or has stopped midway; let it end, or reset it");
    }
    if before.selected.is_none() && catalogue::files_size(session)?.is_some() {
        return refused("a file TSSURVEY is on the RAM drive; rename or erase it");
    }
    if class == Class::Files {
        return Ok(());
    }
    let usual = match session.is_serial() {
        true => MasterMode::ExtRs232c,
        false => MasterMode::ExtEther,
    };
    // Behind a gateway a connection is the serial line: the controller decides. It has nothing to reset.
    if status.master_mode != usual && !session.is_accepted("RS,PRG")? {
        return refused(&format!(
            "this host may not start programs in {}; turn the key and give the control right for {}",
            status.master_mode.as_str(),
            usual.as_str()
        ));
    }
    if status.run_mode != RunMode::Cycle {
        return refused("the operation mode is not cycle");
    }
    before.selected.get_or_insert(status.file);
    if class < Class::Motion {
        return Ok(());
    }
    let status = catalogue::arm_status(session)?.1;
    if status.feed_hold {
        return refused("feed hold is on; end it");
    }
    let is_on = status.servo;
    before.arm.get_or_insert(status);
    if !is_on {
        session.command("SO")?;
        session.wait(QUIET)?;
    }
    Ok(())
}

/// The answer, if it was the same each time.
fn ask(session: &mut Session<'_>, probe: &Probe) -> Result<Reply, ProbeError> {
    let mut first: Option<Reply> = None;
    for _ in 0..probe.repeats() {
        let heard = ask_once(session, probe)?;
        // Once is enough to see what was done.
        session.traffic().keep();
        // The same command in the usual form is answered: silence and NG meant the form.
        match probe.class {
            // Also for its time: few answers come in this class.
            Class::Look => session.status()?.execution,
            Class::Files | Class::Program | Class::Motion => session.execution()?,
        };
        match &first {
            Some(first) if *first != heard => return Ok(format!("{first}, then {heard}")),
            Some(_) => {}
            None => first = Some(heard),
        }
    }
    Ok(first.unwrap_or_default())
}

fn ask_once(session: &mut Session<'_>, probe: &Probe) -> Result<Reply, ProbeError> {
    match probe.ask {
        Ask::Bytes(text) => {
            let bytes = parse(text).unwrap_or_default();
            let bytes = with_checksum(bytes, session.checksum());
            session.reply_kind(&bytes)
        }
        Ask::Value(source) => {
            session.run(source)?;
            Ok(catalogue::plain(&session.variable("R", 1)?))
        }
        Ask::Stops(source) => match session.try_run(source)? {
            true => Ok(catalogue::plain(&session.variable("R", 1)?)),
            false => Ok("stopped".to_owned()),
        },
        Ask::Selects(source) => {
            session.store(source)?;
            if session.is_accepted(&format!("SL,{FILE}"))? {
                return Ok("accepted".to_owned());
            }
            // One that is certainly right: SL is not refused for another reason.
            session.select("PROGRAM SURVEY\r\nEND\r\n")?;
            Ok("refused".to_owned())
        }
        Ask::Form(command, form) => Ok(form(&session.file(command)?).to_owned()),
        Ask::Word(steps) => steps(session).map(str::to_owned),
        Ask::Steps(steps) => steps(session),
    }
}

/// A text with its checksum, if there is one: the low 8 bits of the sum of all bytes after the last STX.
fn with_checksum(mut bytes: Vec<u8>, checksum: Checksum) -> Vec<u8> {
    if checksum == Checksum::Sum && bytes.last() == Some(&ETX) {
        let begin = bytes.iter().rposition(|byte| *byte == STX).map_or(0, |at| at + 1);
        let summed = bytes.get(begin..).unwrap_or_default();
        let sum = summed.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
        bytes.push(sum);
    }
    bytes
}

/// After a surprise what looked like silence or a refusal may have been another loss.
fn distrust_silence(report: &mut Report) {
    for answer in &mut report.answers {
        let is_negative = [
            "silence", "NG", "never", "lost", "none", "dropped", "refused", "stop", "alarm", "found",
        ]
        .iter()
        .any(|word| answer.heard.contains(word));
        if is_negative && matches!(answer.verdict, Verdict::Manual | Verdict::Variation) {
            answer.verdict = Verdict::Unknown;
            answer.sets = None;
            "the survey stopped later; silence may have been a loss".clone_into(&mut answer.note);
        }
    }
}

/// Makes the controller ready for the next question: no alarm, no program midway, and to a question about files no file of
/// the survey; a program is stored over the one before.
fn tidy(session: &mut Session<'_>, class: Class) -> Result<(), ProbeError> {
    if session.execution()? == ExecutionStatus::Running {
        session.is_accepted("EC,BREAK")?;
        session.until_stopped(PATIENCE)?;
    }
    if class >= Class::Program {
        session.is_accepted("RS,PRG")?;
        session.is_accepted("RS,SEL")?;
    } else {
        erase(session)?;
    }
    Ok(())
}

/// Erases the file of the survey.
fn erase(session: &mut Session<'_>) -> Result<(), ProbeError> {
    session.is_accepted(&format!("ER,{FILE}")).map(drop)
}

/// Puts servo power back. Returns what is left: power is not turned on and no axis is turned after a surprise, and feed hold
/// is not ended.
fn arm_back(
    session: &mut Session<'_>,
    before: &SystemStatus,
    is_surprised: bool,
) -> Result<Vec<String>, ProbeError> {
    let status = catalogue::arm_status(session)?.1;
    let mut left = Vec::new();
    match (before.servo, status.servo) {
        (true, false) if is_surprised => left.push("servo power was on and is off".to_owned()),
        (true, false) => session.command("SO")?,
        (false, true) => session.command("BR")?,
        (true, true) | (false, false) => {}
    }
    if status.feed_hold {
        left.push("feed hold is on".to_owned());
    }
    if let Some((axis, by)) = catalogue::moved_axis(&before.joint, &status.joint) {
        left.push(format!("axis {axis} is {by:.2} degrees or mm from where it was"));
    }
    Ok(left)
}

/// Restores the previous state. Returns what could not be restored.
fn put_back(session: &mut Session<'_>, before: &Before, is_surprised: bool) -> Vec<String> {
    let mut left = Vec::new();
    if session.reopen().is_err() {
        return vec!["everything: the controller is out of reach".to_owned()];
    }
    // Something that came late must not keep the rest from being put back.
    let quiet = Duration::from_secs(1);
    let _late = session
        .receive_bytes(Connection::Commands, PATIENCE)
        .map(|_| session.wait(quiet));
    let class = match before.selected {
        Some(_) => Class::Program,
        None => Class::Files,
    };
    if tidy(session, class).and_then(|()| erase(session)).is_err() {
        left.push(format!("the file {FILE} may still be on the RAM drive"));
    }
    if let Some(selected) = before.selected.as_ref().filter(|name| !name.is_empty())
        && session.command(&format!("SL,{selected}")).is_err()
    {
        left.push("the program that was selected before is not selected".to_owned());
    }
    if let Some(arm) = &before.arm {
        match arm_back(session, arm, is_surprised) {
            Ok(rest) => left.extend(rest),
            Err(_) => left.push("servo power, feed hold and the last axis may have changed".to_owned()),
        }
    }
    left
}
