//! Pairs each recorded answer with the emulated one, or reports that there is none.
//!
//! The host's waits are relative to what came before: a host that sends 50 ms after an answer does so after the emulator's
//! answer, however long that took. So delays do not add up, and causes stay before effects. An answer that is earlier than
//! recorded by no more than the delay of a wire counts as in time; what follows keeps its recorded time.

use super::compare::compare;
use super::{Difference, DifferenceKind, MAX_DIFFERENCES, Report, Tolerance};
use crate::answers::{Answer, Event, RecordedEvent};
use crate::player::{Player, RobotEvent};
use crate::transcript::{EndReason, PeerId, RecordKind, Side};
use std::time::Duration;
use ts3100_controller::Time;

/// How much earlier than recorded an answer is because there is no wire between us.
const JITTER: Duration = Duration::from_millis(5);

/// Farthest moment at which a question is tried besides its own, in milliseconds.
const MAX_SHIFT: u64 = 1_000;

/// A moment of the recording and the corresponding moment of the replay.
#[derive(Debug, Clone, Copy, Default)]
struct TimeAnchor {
    recorded: Time,
    played: Time,
}

/// A comparison under way.
pub(super) struct Matching<'a> {
    player: Player,
    tolerance: &'a Tolerance,
    anchor: TimeAnchor,
    report: Report,
    /// Place in the recording to which differences belong.
    place: (Time, usize),
    /// The last thing played, while nothing else has been played or taken since, and the emulator before it.
    pending: Option<PendingQuestion>,
}

/// Requests of a host that the emulator has not been asked yet.
#[derive(Clone)]
struct PendingQuestion {
    before: Player,
    at: Time,
    line: PeerId,
    what: RecordKind,
}

impl PendingQuestion {
    /// The emulator that was asked at another moment, and what it answered; `None` where it was asked before that.
    fn ask_at(&self, moment: Time, patience: Duration) -> Option<(Player, Answer)> {
        if moment < self.before.now() {
            return None;
        }
        let mut player = self.before.clone();
        player.advance_to(moment);
        player.play(&self.what);
        while player.first(self.line).is_none() {
            let deadline = player.deadline();
            player.advance_to(deadline.filter(|deadline| *deadline <= moment + patience)?);
        }
        match player.take(self.line)? {
            RobotEvent::Answer(answer, _) => Some((player, answer)),
            RobotEvent::Ended(..) => None,
        }
    }
}

/// The moments that are tried: each millisecond near by, each fifth one farther away.
fn shifts(most: Duration) -> impl Iterator<Item = Duration> {
    let most = u64::try_from(most.as_millis()).unwrap_or(u64::MAX).min(MAX_SHIFT);
    (1..=most)
        .filter(|step| *step <= 10 || step % 5 == 0)
        .map(Duration::from_millis)
}

/// Whether the emulator sent it unasked after the end of the recording, where the other side is unknown.
fn is_after_recording(line: PeerId, robot_event: &RobotEvent, end: Time) -> bool {
    match robot_event {
        RobotEvent::Answer(answer, _) => {
            let unasked = line.port.protocol().is_none() || answer.is_sp();
            unasked && answer.at > end
        }
        RobotEvent::Ended(..) => false,
    }
}

/// Result of matching an answer of the emulator with a recorded one.
enum MatchResult {
    /// They are a pair.
    Pair,
    /// The emulator's belongs to a later one: the recorded one is missing.
    Later,
    /// Nothing recorded belongs to the emulator's.
    Surplus,
}

impl<'a> Matching<'a> {
    pub(super) fn new(player: Player, tolerance: &'a Tolerance) -> Matching<'a> {
        Matching {
            player,
            tolerance,
            anchor: TimeAnchor::default(),
            report: Report::default(),
            place: (Time::ZERO, 0),
            pending: None,
        }
    }

    pub(super) fn run(mut self, events: &[RecordedEvent]) -> Report {
        for (index, event) in events.iter().enumerate() {
            self.place = (event.at, event.file_line);
            match &event.event {
                Event::Input(what) => self.input(event.at, what),
                Event::Answer(line, answer) => {
                    let later = events.get(index + 1..).unwrap_or_default();
                    self.answer(*line, answer, later);
                }
                Event::Ended(line, how) => self.ended(event.at, *line, *how),
            }
        }
        // What the last answer of the recording was in time for, the emulator's may be too.
        let end = self.player.now();
        self.player.advance_to(end + self.tolerance.time);
        for line in self.player.lines_with_events() {
            self.player.flush(line);
            while let Some(robot_event) = self.player.take(line) {
                if !is_after_recording(line, &robot_event, end) {
                    self.surplus(line, robot_event);
                }
            }
        }
        self.report
    }

    /// The moment of the replay for a moment of the recording.
    fn due(&self, at: Time) -> Time {
        // Half an answer is taken when the host says the next thing, after whole answers of other ports that came later.
        let earlier = self.anchor.recorded.since(at).as_micros();
        let played = self.anchor.played + at.since(self.anchor.recorded);
        let earlier = u64::try_from(earlier).unwrap_or(u64::MAX);
        Time::from_micros(played.as_micros().saturating_sub(earlier))
    }

    fn input(&mut self, at: Time, what: &RecordKind) {
        let due = self.due(at).max(self.player.now());
        let question = self.pending_question(due, what);
        self.player.advance_to(due);
        if what.new_time().is_some() {
            self.end_epoch();
        }
        // Retrying at another time would lose unsolicited output.
        self.pending = question.filter(|_| self.player.lines_with_events().is_empty());
        if let RecordKind::FromHost { line, .. } = what {
            self.drop_answers(*line);
        }
        self.player.play(what);
        self.report.inputs += 1;
        let (recorded, played) = match what.new_time() {
            // Times go on from another moment, on both sides.
            Some(moment) => (moment, self.player.now()),
            None => (at, due),
        };
        self.anchor = TimeAnchor { recorded, played };
    }

    /// Time continues from another moment: what the emulator has sent until now was not recorded.
    fn end_epoch(&mut self) {
        self.player.flush_lines();
        for line in self.player.lines_with_events() {
            while self.player.first(line).is_some() {
                self.next_is_surplus(line);
            }
        }
    }

    /// A question to a robot that is moving or running: the answer may differ a moment later.
    fn pending_question(&self, at: Time, what: &RecordKind) -> Option<PendingQuestion> {
        let RecordKind::FromHost { line, .. } = what else {
            return None;
        };
        let goes_on = self.player.deadline().is_some() && !self.tolerance.time.is_zero();
        let asks = line.port.protocol().is_some() && goes_on && self.player.lines_with_events().is_empty();
        asks.then(|| PendingQuestion {
            before: self.player.clone(),
            at,
            line: *line,
            what: what.clone(),
        })
    }

    /// A host asks the next thing: what answered the last one and was not recorded is surplus. SP and what programs
    /// print may belong to a later moment of the recording.
    fn drop_answers(&mut self, line: PeerId) {
        if line.port.protocol().is_none() {
            return;
        }
        while let Some(RobotEvent::Answer(answer, _)) = self.player.first(line) {
            if answer.is_sp() {
                break;
            }
            self.next_is_surplus(line);
        }
    }

    fn answer(&mut self, line: PeerId, recorded: &Answer, later: &[RecordedEvent]) {
        self.report.answers += 1;
        let due = self.due(recorded.at);
        loop {
            self.wait_for_answer(line, due, recorded.complete);
            let answer = match self.player.first(line) {
                Some(RobotEvent::Answer(answer, _)) => answer,
                Some(RobotEvent::Ended(..)) => return self.ended_instead(line, recorded, later),
                None => return self.missing(line, recorded),
            };
            match self.match_answer(line, recorded, answer, later) {
                MatchResult::Later => return self.missing(line, recorded),
                MatchResult::Surplus => self.next_is_surplus(line),
                MatchResult::Pair => break,
            }
        }
        if let Some(RobotEvent::Answer(answer, reason)) = self.player.take(line) {
            let question = self.pending.take().filter(|question| question.line == line);
            let other =
                question.and_then(|question| self.answer_at_shifted_time(&question, recorded, &answer));
            self.pair(line, recorded, &other.unwrap_or(answer), reason, due);
        }
    }

    /// The answer of an emulator that was asked a little earlier or later, if that is the recorded one and this is not:
    /// what moves is seen at another moment over a wire. The emulator then continues from there.
    fn answer_at_shifted_time(
        &mut self,
        question: &PendingQuestion,
        recorded: &Answer,
        answer: &Answer,
    ) -> Option<Answer> {
        let most = self.tolerance.time;
        let patience = self.tolerance.answer_timeout;
        let differs = |answer: &Answer| {
            let (parts, _) = compare(&recorded.letters, &recorded.bytes, &answer.bytes, self.tolerance);
            !parts.is_empty()
        };
        if most.is_zero() || !differs(answer) {
            return None;
        }
        let earliest = question.before.now().max(question.at - most);
        let ends = [earliest, question.at + most].map(|moment| question.ask_at(moment, patience));
        // Where nothing moves there is no other moment.
        let mut others = ends.iter().flatten();
        if others.all(|(_, other)| other.bytes == answer.bytes) {
            return None;
        }
        let later = shifts(most).map(|step| Some(question.at + step));
        let earlier = shifts(most).map(|step| {
            let moment = Time::ZERO + question.at.since(Time::ZERO).checked_sub(step)?;
            (moment >= earliest).then_some(moment)
        });
        let moments = later.zip(earlier).flat_map(|(later, earlier)| [later, earlier]);
        let (player, answer) = moments
            .flatten()
            .filter_map(|moment| question.ask_at(moment, patience))
            .find(|(_, answer)| !differs(answer))?;
        self.player = player;
        self.report.shifted += 1;
        Some(answer)
    }

    /// The emulator has ended the connection on which something was recorded.
    fn ended_instead(&mut self, line: PeerId, recorded: &Answer, later: &[RecordedEvent]) {
        let ends_too = later
            .iter()
            .any(|event| matches!(&event.event, Event::Ended(other, _) if *other == line));
        if !ends_too {
            self.next_is_surplus(line);
        }
        self.missing(line, recorded);
    }

    /// Lets the emulator come up with something on this line, with as much patience as was asked for; if nothing
    /// comes, no time is lost.
    fn wait_for_answer(&mut self, line: PeerId, due: Time, complete: bool) {
        if self.player.first(line).is_some() {
            return;
        }
        let limit = due + self.tolerance.answer_timeout;
        let mut trial = self.player.clone();
        if !complete {
            trial.advance_to(due.max(trial.now()));
            trial.flush(line);
        }
        while trial.first(line).is_none() {
            match trial.deadline().filter(|deadline| *deadline <= limit) {
                Some(deadline) => trial.advance_to(deadline),
                None => {
                    trial.flush(line);
                    break;
                }
            }
        }
        if trial.first(line).is_some() {
            self.player = trial;
        }
    }

    fn match_answer(
        &self,
        line: PeerId,
        recorded: &Answer,
        emulated: &Answer,
        later: &[RecordedEvent],
    ) -> MatchResult {
        if recorded.bytes == emulated.bytes {
            return MatchResult::Pair;
        }
        match (line.port.protocol().is_some(), recorded.is_sp(), emulated.is_sp()) {
            (true, true, false) => return MatchResult::Later,
            (true, false, true) => return MatchResult::Surplus,
            _ => {}
        }
        // Until the host says the next thing on this line.
        let window = later.iter().take_while(|event| {
            !matches!(&event.event, Event::Input(RecordKind::FromHost { line: other, .. }) if *other == line)
        });
        let mut coming = window.map(|event| &event.event);
        if coming.any(|event| {
            matches!(event, Event::Answer(other, answer) if *other == line && answer.bytes == emulated.bytes)
        }) {
            return MatchResult::Later;
        }
        match self.player.second(line) {
            Some(RobotEvent::Answer(next, _)) if next.bytes == recorded.bytes => MatchResult::Surplus,
            _ => MatchResult::Pair,
        }
    }

    fn pair(&mut self, line: PeerId, recorded: &Answer, answer: &Answer, reason: Option<String>, due: Time) {
        let (parts, ignored) = compare(&recorded.letters, &recorded.bytes, &answer.bytes, self.tolerance);
        self.report.ignored += ignored;
        if !parts.is_empty() {
            let kind = DifferenceKind::Bytes {
                recorded: recorded.bytes.clone(),
                emulated: answer.bytes.clone(),
                parts,
                reason,
            };
            self.add_difference(line, &recorded.question, kind);
        }
        let apart = answer.at.since(due).max(due.since(answer.at));
        let unsolicited = self.tolerance.ignore.sp && recorded.is_sp();
        if apart > self.tolerance.time && !self.tolerance.ignore.time && !unsolicited {
            let kind = DifferenceKind::Time {
                recorded: recorded.bytes.clone(),
                recorded_after: recorded.at.since(self.anchor.recorded),
                emulated_after: answer.at.since(self.anchor.played),
            };
            self.add_difference(line, &recorded.question, kind);
        }
        // What the wire and the machines took moves nothing: a host that asks a moving robot a hundred times would
        // otherwise ask it each time a little earlier than it did.
        let played = if apart <= JITTER {
            answer.at.max(due)
        } else {
            answer.at
        };
        if recorded.at >= self.anchor.recorded {
            self.anchor = TimeAnchor {
                recorded: recorded.at,
                played: played.max(self.anchor.played),
            };
        }
    }

    fn ended(&mut self, at: Time, line: PeerId, how: EndReason) {
        self.pending = None;
        let due = self.due(at);
        self.wait_for_answer(line, due, true);
        while let Some(RobotEvent::Answer(..)) = self.player.first(line) {
            self.next_is_surplus(line);
            self.wait_for_answer(line, due, true);
        }
        match self.player.take(line) {
            Some(RobotEvent::Ended(emulated, when)) => {
                if emulated != how {
                    self.end_differs(line, Some(how), Some(emulated));
                }
                self.anchor = TimeAnchor {
                    recorded: at,
                    played: when.max(self.anchor.played),
                };
            }
            _ => {
                self.end_differs(line, Some(how), None);
                // The host has no connection any more, whatever the emulator thinks of it.
                let due = due.max(self.player.now());
                self.player.advance_to(due);
                let by = Side::Host;
                self.player.play(&RecordKind::Ended { line, by, how });
            }
        }
    }

    fn end_differs(&mut self, line: PeerId, recorded: Option<EndReason>, emulated: Option<EndReason>) {
        self.add_difference(line, "", DifferenceKind::Ended { recorded, emulated });
    }

    fn missing(&mut self, line: PeerId, recorded: &Answer) {
        if self.tolerance.ignore.sp && recorded.is_sp() {
            self.report.ignored += 1;
            return;
        }
        let kind = DifferenceKind::Missing {
            recorded: recorded.bytes.clone(),
            reason: self.player.remark(line.port),
        };
        self.add_difference(line, &recorded.question, kind);
    }

    fn next_is_surplus(&mut self, line: PeerId) {
        if let Some(robot_event) = self.player.take(line) {
            self.surplus(line, robot_event);
        }
    }

    fn surplus(&mut self, line: PeerId, robot_event: RobotEvent) {
        match robot_event {
            RobotEvent::Ended(how, _) => self.end_differs(line, None, Some(how)),
            RobotEvent::Answer(answer, _) if self.tolerance.ignore.sp && answer.is_sp() => {
                self.report.ignored += 1;
            }
            RobotEvent::Answer(answer, reason) => {
                let emulated = answer.bytes;
                self.add_difference(
                    line,
                    &answer.question,
                    DifferenceKind::Surplus { emulated, reason },
                );
            }
        }
    }

    fn add_difference(&mut self, line: PeerId, question: &str, kind: DifferenceKind) {
        if self.report.differences.len() >= MAX_DIFFERENCES {
            self.report.more += 1;
            return;
        }
        let (at, file_line) = self.place;
        self.report.differences.push(Difference {
            file_line,
            at,
            line,
            question: question.to_owned(),
            kind,
        });
    }
}
