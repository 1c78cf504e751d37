//! Asks a controller, question by question.

use crate::catalogue;
use crate::forms;
use crate::peer::{Line, Peer, PeerError};
use crate::probe::{Ask, Class, Probe, Verdict};
use crate::report::{Answer, Report};
use crate::talk::{FILE, Heard, PATIENCE, QUIET, Talk, Trouble};
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
    /// Set by others: nothing more is asked, and what was changed is put back.
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

/// State from before the run, which is put back.
#[derive(Debug, Default)]
struct Before {
    /// The selected file, where the survey may select another one; empty for none.
    selected: Option<String>,
    /// Servo power and the angles of the arm, where the survey may change them.
    arm: Option<SystemStatus>,
}

/// Asks a controller; `watch` sees each answer. What the survey changes it puts back, also when it has to stop; what it could
/// not put back is in the report.
///
/// # Errors
/// Nobody answers.
pub fn survey(peer: &mut dyn Peer, plan: &Plan, watch: &mut dyn FnMut(&Answer)) -> Result<Report, PeerError> {
    let is_serial = peer.is_serial();
    let mut talk = Talk::new(peer, Arc::clone(&plan.stop));
    let mut report = Report::default();
    if let Err(Trouble::Refused(reason) | Trouble::Surprise(reason)) = greet(&mut talk, &mut report) {
        return Err(PeerError::Unreachable(reason));
    }
    let mut before = Before::default();
    let mut class = None;
    let mut is_surprised = false;
    for probe in plan.probes() {
        let allowed = match &report.stopped {
            Some(_) => Err(Trouble::Refused("the survey had stopped".to_owned())),
            None if class == Some(probe.class) => Ok(()),
            None => {
                let prepared = prepare(&mut talk, probe.class, &mut before);
                if prepared.is_ok() {
                    class = Some(probe.class);
                }
                prepared
            }
        };
        // What was sent before is no answer: SF has positions, and CA names.
        talk.written().take();
        let mut answer = match allowed.and_then(|()| ask(&mut talk, probe)) {
            Ok(heard) => Answer::heard(probe, heard),
            Err(Trouble::Refused(reason)) => Answer::without(probe, Verdict::Refused, reason),
            Err(Trouble::Surprise(reason)) => {
                report.stopped = Some(format!("{}: {reason}", probe.id));
                Answer::without(probe, Verdict::Unknown, reason)
            }
        };
        answer.traffic = talk.written().take();
        if !probe.is_public {
            answer.traffic.clear();
        }
        watch(&answer);
        report.answers.push(answer);
        // What was not prepared was not asked: the file of that name may be the user's.
        if report.stopped.is_none()
            && class == Some(probe.class)
            && probe.class >= Class::Files
            && let Err(Trouble::Surprise(reason)) = tidy(&mut talk, probe.class)
        {
            report.stopped = Some(format!("after {}: {reason}", probe.id));
        }
        is_surprised |= report.stopped.is_some() && !plan.stop.load(Ordering::Relaxed);
    }
    if is_surprised {
        distrust_silence(&mut report);
    }
    talk.ignore_interruptions();
    if class >= Some(Class::Files) || before.arm.is_some() {
        report.left = put_back(&mut talk, &before, report.stopped.is_some());
    }
    if !is_serial {
        // There the line takes most of the time.
        report.answer_times = talk.delays().quartiles();
    }
    redact(&mut report, &mut talk);
    Ok(report)
}

/// Reasons may tell what a controller has sent.
fn redact(report: &mut Report, talk: &mut Talk<'_>) {
    let answers = report.answers.iter_mut();
    let texts = answers.flat_map(|answer| [&mut answer.heard, &mut answer.note]);
    for text in texts.chain(&mut report.stopped).chain(&mut report.left) {
        *text = String::from_utf8_lossy(&talk.written().redacted(text.as_bytes())).into_owned();
    }
}

/// Finds out whether texts have a checksum, and what kind of controller it is.
fn greet(talk: &mut Talk<'_>, report: &mut Report) -> Result<(), Trouble> {
    talk.reopen()?;
    let text = talk.text("SU\r");
    talk.send_at_once(&text)?;
    let mut heard = talk.hear(PATIENCE)?;
    let is_no_text = talk.is_midway();
    if heard.is_none() {
        // With checksums the controller still waits for that of the text; without, one byte between texts is nothing.
        talk.set_checksum(Checksum::Sum);
        let sum = talk.text("SU\r").last().copied();
        talk.send_at_once(&Vec::from_iter(sum))?;
        heard = talk.hear(PATIENCE)?;
    }
    let heard = heard.ok_or_else(|| {
        let what = match is_no_text {
            true => "what answers SU is not a text of a controller",
            false => "no answer to SU",
        };
        Trouble::Surprise(what.to_owned())
    })?;
    if !heard.data.starts_with(b"FL,") {
        return Err(Trouble::Surprise(
            "SU is answered, but not by a status".to_owned(),
        ));
    }
    talk.rest_of_content("SU", heard.data.to_vec())?;
    let status = talk.status()?;
    talk.written().hide(&status.file);
    if let Some(content) = talk.content("VR")? {
        report.versions = forms::version_records(&content);
    }
    if let Some(content) = talk.content("CA")? {
        for entry in decode_directory(&content).unwrap_or_default() {
            talk.written().hide(&entry.name);
        }
    }
    let (form, _) = talk.total_status()?;
    report.arm = forms::arm(form);
    Ok(())
}

/// Whether the controller is in a state in which questions of this class can be asked.
fn prepare(talk: &mut Talk<'_>, class: Class, before: &mut Before) -> Result<(), Trouble> {
    if class == Class::Look {
        return Ok(());
    }
    let refused = |reason: &str| Err(Trouble::Refused(reason.to_owned()));
    let status = talk.status()?;
    if !matches!(status.execution, ExecutionStatus::Reset) {
        return refused("a program runs or has stopped midway; let it end, or reset it");
    }
    if before.selected.is_none() && catalogue::files_size(talk)?.is_some() {
        return refused("a file TSSURVEY is on the RAM drive; rename or erase it");
    }
    if class == Class::Files {
        return Ok(());
    }
    let usual = match talk.is_serial() {
        true => MasterMode::ExtRs232c,
        false => MasterMode::ExtEther,
    };
    // Behind a gateway a connection is the serial line: the controller decides. It has nothing to reset.
    if status.master_mode != usual && !talk.asks("RS,PRG")? {
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
    let status = catalogue::arm_status(talk)?.1;
    if status.feed_hold {
        return refused("feed hold is on; end it");
    }
    let is_on = status.servo;
    before.arm.get_or_insert(status);
    if !is_on {
        talk.command("SO")?;
        talk.wait(QUIET)?;
    }
    Ok(())
}

/// The answer, if it was the same each time.
fn ask(talk: &mut Talk<'_>, probe: &Probe) -> Result<Heard, Trouble> {
    let mut first: Option<Heard> = None;
    for _ in 0..probe.repeats() {
        let heard = ask_once(talk, probe)?;
        // Once is enough to see what was done.
        talk.written().keep();
        // The same command in the usual form is answered: silence and NG meant the form.
        match probe.class {
            // Also for its time: few answers come in this class.
            Class::Look => talk.status()?.execution,
            Class::Files | Class::Program | Class::Motion => talk.execution()?,
        };
        match &first {
            Some(first) if *first != heard => return Ok(format!("{first}, and another time {heard}")),
            Some(_) => {}
            None => first = Some(heard),
        }
    }
    Ok(first.unwrap_or_default())
}

fn ask_once(talk: &mut Talk<'_>, probe: &Probe) -> Result<Heard, Trouble> {
    match probe.ask {
        Ask::Bytes(text) => {
            let bytes = parse(text).unwrap_or_default();
            let bytes = with_checksum(bytes, talk.checksum());
            talk.kind_of_answer(&bytes)
        }
        Ask::Value(source) => {
            talk.run(source)?;
            Ok(catalogue::plain(&talk.variable("R", 1)?))
        }
        Ask::Stops(source) => match talk.try_run(source)? {
            true => Ok(catalogue::plain(&talk.variable("R", 1)?)),
            false => Ok("stopped".to_owned()),
        },
        Ask::Selects(source) => {
            talk.store(source)?;
            if talk.asks(&format!("SL,{FILE}"))? {
                return Ok("accepted".to_owned());
            }
            // One that is certainly right: SL is not refused for another reason.
            talk.select("PROGRAM SURVEY\r\nEND\r\n")?;
            Ok("refused".to_owned())
        }
        Ask::Form(command, form) => Ok(form(&talk.file(command)?).to_owned()),
        Ask::Word(steps) => steps(talk).map(str::to_owned),
        Ask::Steps(steps) => steps(talk),
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
fn tidy(talk: &mut Talk<'_>, class: Class) -> Result<(), Trouble> {
    if talk.execution()? == ExecutionStatus::Running {
        talk.asks("EC,BREAK")?;
        talk.until_stopped(PATIENCE)?;
    }
    if class >= Class::Program {
        talk.asks("RS,PRG")?;
        talk.asks("RS,SEL")?;
    } else {
        erase(talk)?;
    }
    Ok(())
}

/// Erases the file of the survey.
fn erase(talk: &mut Talk<'_>) -> Result<(), Trouble> {
    talk.asks(&format!("ER,{FILE}")).map(drop)
}

/// Puts servo power back. Returns what is left: power is not turned on and no axis is turned after a surprise, and feed hold
/// is not ended.
fn arm_back(talk: &mut Talk<'_>, before: &SystemStatus, is_surprised: bool) -> Result<Vec<String>, Trouble> {
    let status = catalogue::arm_status(talk)?.1;
    let mut left = Vec::new();
    match (before.servo, status.servo) {
        (true, false) if is_surprised => left.push("servo power was on and is off".to_owned()),
        (true, false) => talk.command("SO")?,
        (false, true) => talk.command("BR")?,
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

/// Puts back what was there before. Returns what could not be put back.
fn put_back(talk: &mut Talk<'_>, before: &Before, is_surprised: bool) -> Vec<String> {
    let mut left = Vec::new();
    if talk.reopen().is_err() {
        return vec!["everything: the controller is out of reach".to_owned()];
    }
    // Something that came late must not keep the rest from being put back.
    let quiet = Duration::from_secs(1);
    let _late = talk.listen(Line::Commands, PATIENCE).map(|_| talk.wait(quiet));
    let class = match before.selected {
        Some(_) => Class::Program,
        None => Class::Files,
    };
    if tidy(talk, class).and_then(|()| erase(talk)).is_err() {
        left.push(format!("the file {FILE} may still be on the RAM drive"));
    }
    if let Some(selected) = before.selected.as_ref().filter(|name| !name.is_empty())
        && talk.command(&format!("SL,{selected}")).is_err()
    {
        left.push("the program that was selected before is not selected".to_owned());
    }
    if let Some(arm) = &before.arm {
        match arm_back(talk, arm, is_surprised) {
            Ok(rest) => left.extend(rest),
            Err(_) => left.push("servo power, feed hold and the last axis may have changed".to_owned()),
        }
    }
    left
}
