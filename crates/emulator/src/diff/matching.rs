//! The recording and the emulator side by side: each answer recorded finds the emulator's, or does not.
//!
//! The host's waits are kept relative to what came before them: a host that sends 50 ms behind an answer does so
//! behind the emulator's answer, however long that took. So delays do not add up, and causes stay before effects. An
//! answer that is earlier than the recorded one by no more than a wire takes counts as in time: what comes behind it has
//! its recorded moment.

use super::compare::{compare, reply};
use super::player::{Player, Produced};
use super::unit::{Event, Placed, Unit};
use super::{Difference, Kind, MAX_DIFFERENCES, Report, Tolerance};
use crate::transcript::{EndReason, PeerId, RecordKind};
use std::time::Duration;
use ts3100_controller::Time;
use ts3100_proto::reply::Reply;

/// How much earlier than recorded an answer is because there is no wire between us.
const JITTER: Duration = Duration::from_millis(5);

/// Farthest moment at which a question is tried besides its own, in milliseconds.
const MAX_SHIFT: u64 = 1_000;

/// A moment of the recording and the moment of the replay that stands for it.
#[derive(Debug, Clone, Copy)]
struct Anchor {
    recorded: Time,
    played: Time,
}

/// A comparison under way.
pub(super) struct Matching<'a> {
    player: Player,
    tolerance: &'a Tolerance,
    anchor: Anchor,
    report: Report,
    /// Where in the recording: what is found by the way belongs there.
    place: (Time, usize),
    /// The last thing played, while nothing else has been played or taken since, and the emulator before it.
    asked: Option<Asked>,
}

/// What a host has asked, and the emulator it has not asked yet.
#[derive(Debug, Clone)]
struct Asked {
    before: Player,
    at: Time,
    line: PeerId,
    what: RecordKind,
}

impl Asked {
    /// The emulator that was asked at another moment, and what it answered; `None` where it was asked before that.
    fn at(&self, moment: Time, patience: Duration) -> Option<(Player, Unit)> {
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
            Produced::Answer(unit, _) => Some((player, unit)),
            Produced::Ended(..) => None,
        }
    }
}

/// The moments that are tried: each millisecond near by, each fifth one farther away.
fn steps(most: Duration) -> impl Iterator<Item = Duration> {
    let most = u64::try_from(most.as_millis()).unwrap_or(u64::MAX).min(MAX_SHIFT);
    (1..=most)
        .filter(|step| *step <= 10 || step % 5 == 0)
        .map(Duration::from_millis)
}

fn whole(duration: Duration) -> u64 {
    u64::try_from(duration.as_micros()).unwrap_or(u64::MAX)
}

/// Whether the emulator has said it by itself when the recording was over: nobody knows what the other said then.
fn is_unheard(line: PeerId, produced: &Produced, end: Time) -> bool {
    match produced {
        Produced::Answer(unit, _) => {
            let unasked = line.port.protocol().is_none() || reply(&unit.bytes) == Some(Reply::Sp);
            unasked && unit.at > end
        }
        Produced::Ended(..) => false,
    }
}

/// What became of an answer of the emulator beside one that was recorded.
enum Verdict {
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
            anchor: Anchor {
                recorded: Time::ZERO,
                played: Time::ZERO,
            },
            report: Report::default(),
            place: (Time::ZERO, 0),
            asked: None,
        }
    }

    pub(super) fn run(mut self, events: &[Placed]) -> Report {
        for (index, placed) in events.iter().enumerate() {
            self.place = (placed.at, placed.file_line);
            match &placed.event {
                Event::Input(what) => self.input(placed.at, what),
                Event::Answer(line, unit) => {
                    let behind = events.get(index + 1..).unwrap_or_default();
                    self.answer(*line, unit, behind);
                }
                Event::Ended(line, how) => self.ended(placed.at, *line, *how),
            }
        }
        // What the last answer of the recording was in time for, the emulator's may be too.
        let end = self.player.now();
        self.player.advance_to(end + self.tolerance.time);
        for line in self.player.left() {
            self.player.flush(line);
            while let Some(produced) = self.player.take(line) {
                if !is_unheard(line, &produced, end) {
                    self.surplus(line, produced);
                }
            }
        }
        self.report
    }

    /// The moment of the replay for a moment of the recording.
    fn due(&self, at: Time) -> Time {
        self.anchor.played + at.since(self.anchor.recorded)
    }

    fn input(&mut self, at: Time, what: &RecordKind) {
        let due = self.due(at).max(self.player.now());
        let asked = self.asked(due, what);
        self.player.advance_to(due);
        // What has come of itself meanwhile would be lost with another moment.
        self.asked = asked.filter(|_| self.player.left().is_empty());
        if let RecordKind::FromHost { line, .. } = what {
            self.drop_answers(*line);
        }
        self.player.play(what);
        self.report.inputs += 1;
        self.anchor = match what {
            // Times go on from another moment, on both sides.
            RecordKind::Edge(edge) if edge.begins_at().is_some() => Anchor {
                recorded: edge.begins_at().unwrap_or(at),
                played: self.player.now(),
            },
            _ => Anchor {
                recorded: at,
                played: due,
            },
        };
    }

    /// A question of a host to a robot in which something goes on: the answer may be another one a moment later.
    fn asked(&self, at: Time, what: &RecordKind) -> Option<Asked> {
        let RecordKind::FromHost { line, .. } = what else {
            return None;
        };
        let goes_on = self.player.deadline().is_some() && !self.tolerance.time.is_zero();
        let asks = line.port.protocol().is_some() && goes_on && self.player.left().is_empty();
        asks.then(|| Asked {
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
        while let Some(Produced::Answer(unit, _)) = self.player.first(line) {
            if reply(&unit.bytes) == Some(Reply::Sp) {
                break;
            }
            if let Some(produced) = self.player.take(line) {
                self.surplus(line, produced);
            }
        }
    }

    fn answer(&mut self, line: PeerId, recorded: &Unit, behind: &[Placed]) {
        self.report.answers += 1;
        let due = self.due(recorded.at);
        loop {
            self.wait(line, due, recorded.complete);
            let unit = match self.player.first(line) {
                Some(Produced::Answer(unit, _)) => unit,
                Some(Produced::Ended(..)) => return self.ended_instead(line, recorded, behind),
                None => return self.missing(line, recorded),
            };
            match self.judge(line, recorded, unit, behind) {
                Verdict::Later => return self.missing(line, recorded),
                Verdict::Surplus => {
                    if let Some(produced) = self.player.take(line) {
                        self.surplus(line, produced);
                    }
                }
                Verdict::Pair => break,
            }
        }
        if let Some(Produced::Answer(unit, reason)) = self.player.take(line) {
            let asked = self.asked.take().filter(|asked| asked.line == line);
            let other = asked.and_then(|asked| self.at_another_moment(&asked, recorded, &unit));
            self.pair(line, recorded, &other.unwrap_or(unit), reason, due);
        }
    }

    /// The answer of an emulator that was asked a little earlier or later, if that is the recorded one and this is not:
    /// what moves is seen at another moment over a wire. The emulator then goes on from there.
    fn at_another_moment(&mut self, asked: &Asked, recorded: &Unit, unit: &Unit) -> Option<Unit> {
        let most = self.tolerance.time;
        let patience = self.tolerance.patience;
        let differs = |unit: &Unit| {
            let (parts, _) = compare(&recorded.letters, &recorded.bytes, &unit.bytes, self.tolerance);
            !parts.is_empty()
        };
        if most.is_zero() || !differs(unit) {
            return None;
        }
        let earliest = asked.before.now().max(Time::from_micros(
            asked.at.as_micros().saturating_sub(whole(most)),
        ));
        let ends = [earliest, asked.at + most].map(|moment| asked.at(moment, patience));
        // Where nothing moves there is no other moment.
        if ends.iter().flatten().all(|(_, other)| other.bytes == unit.bytes) {
            return None;
        }
        let later = steps(most).map(|step| Some(asked.at + step));
        let earlier = steps(most).map(|step| {
            let micros = asked.at.as_micros().checked_sub(whole(step))?;
            Some(Time::from_micros(micros)).filter(|moment| *moment >= earliest)
        });
        let moments = later.zip(earlier).flat_map(|(later, earlier)| [later, earlier]);
        let (player, unit) = moments
            .flatten()
            .filter_map(|moment| asked.at(moment, patience))
            .find(|(_, unit)| !differs(unit))?;
        self.player = player;
        self.report.moments += 1;
        Some(unit)
    }

    /// The emulator has ended the connection on which something was recorded.
    fn ended_instead(&mut self, line: PeerId, recorded: &Unit, behind: &[Placed]) {
        let ends_too = behind
            .iter()
            .any(|placed| matches!(&placed.event, Event::Ended(other, _) if *other == line));
        if !ends_too && let Some(produced) = self.player.take(line) {
            self.surplus(line, produced);
        }
        self.missing(line, recorded);
    }

    /// Lets the emulator come up with something on this line, with as much patience as was asked for; if nothing
    /// comes, no time is lost.
    fn wait(&mut self, line: PeerId, due: Time, complete: bool) {
        if self.player.first(line).is_some() {
            return;
        }
        let limit = due + self.tolerance.patience;
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

    fn judge(&self, line: PeerId, recorded: &Unit, emulated: &Unit, behind: &[Placed]) -> Verdict {
        if recorded.bytes == emulated.bytes {
            return Verdict::Pair;
        }
        let is_sp = |unit: &Unit| reply(&unit.bytes) == Some(Reply::Sp);
        match (line.port.protocol().is_some(), is_sp(recorded), is_sp(emulated)) {
            (true, true, false) => return Verdict::Later,
            (true, false, true) => return Verdict::Surplus,
            _ => {}
        }
        // Until the host says the next thing on this line.
        let window = behind.iter().take_while(|placed| {
            !matches!(&placed.event, Event::Input(RecordKind::FromHost { line: other, .. }) if *other == line)
        });
        let mut coming = window.filter_map(|placed| match &placed.event {
            Event::Answer(other, unit) if *other == line => Some(unit),
            _ => None,
        });
        if coming.any(|unit| unit.bytes == emulated.bytes) {
            return Verdict::Later;
        }
        match self.player.second(line) {
            Some(Produced::Answer(next, _)) if next.bytes == recorded.bytes => Verdict::Surplus,
            _ => Verdict::Pair,
        }
    }

    fn pair(&mut self, line: PeerId, recorded: &Unit, unit: &Unit, reason: Option<String>, due: Time) {
        let question = recorded.question.clone();
        let (parts, ignored) = compare(&recorded.letters, &recorded.bytes, &unit.bytes, self.tolerance);
        self.report.ignored += ignored;
        if !parts.is_empty() {
            let kind = Kind::Bytes {
                recorded: recorded.bytes.clone(),
                emulated: unit.bytes.clone(),
                parts,
                reason,
            };
            self.differ(line, &question, kind);
        }
        let apart = unit.at.since(due).max(due.since(unit.at));
        let unsolicited = self.tolerance.ignore.sp && reply(&recorded.bytes) == Some(Reply::Sp);
        if apart > self.tolerance.time && !self.tolerance.ignore.time && !unsolicited {
            let kind = Kind::Time {
                recorded: recorded.bytes.clone(),
                recorded_after: recorded.at.since(self.anchor.recorded),
                emulated_after: unit.at.since(self.anchor.played),
            };
            self.differ(line, &question, kind);
        }
        // What the wire and the machines took moves nothing: a host that asks a moving robot a hundred times would
        // otherwise ask it each time a little earlier than it did.
        let played = if apart <= JITTER {
            unit.at.max(due)
        } else {
            unit.at
        };
        self.anchor = Anchor {
            recorded: recorded.at,
            played: played.max(self.anchor.played),
        };
    }

    fn ended(&mut self, at: Time, line: PeerId, how: EndReason) {
        self.asked = None;
        let due = self.due(at);
        self.wait(line, due, true);
        while let Some(Produced::Answer(..)) = self.player.first(line) {
            if let Some(produced) = self.player.take(line) {
                self.surplus(line, produced);
            }
            self.wait(line, due, true);
        }
        match self.player.take(line) {
            Some(Produced::Ended(emulated, when)) => {
                if emulated != how {
                    self.end_differs(line, Some(how), Some(emulated));
                }
                self.anchor = Anchor {
                    recorded: at,
                    played: when.max(self.anchor.played),
                };
            }
            _ => {
                self.end_differs(line, Some(how), None);
                // The host has no connection any more, whatever the emulator thinks of it.
                let due = due.max(self.player.now());
                self.player.advance_to(due);
                let by = crate::transcript::Side::Host;
                self.player.play(&RecordKind::Ended { line, by, how });
            }
        }
    }

    fn end_differs(&mut self, line: PeerId, recorded: Option<EndReason>, emulated: Option<EndReason>) {
        self.differ(line, "", Kind::Ended { recorded, emulated });
    }

    fn missing(&mut self, line: PeerId, recorded: &Unit) {
        if self.tolerance.ignore.sp && reply(&recorded.bytes) == Some(Reply::Sp) {
            self.report.ignored += 1;
            return;
        }
        let kind = Kind::Missing {
            recorded: recorded.bytes.clone(),
            reason: self.player.remark(line.port),
        };
        self.differ(line, &recorded.question, kind);
    }

    fn surplus(&mut self, line: PeerId, produced: Produced) {
        match produced {
            Produced::Ended(how, _) => self.end_differs(line, None, Some(how)),
            Produced::Answer(unit, _)
                if self.tolerance.ignore.sp && reply(&unit.bytes) == Some(Reply::Sp) =>
            {
                self.report.ignored += 1;
            }
            Produced::Answer(unit, reason) => {
                let question = unit.question.clone();
                let emulated = unit.bytes;
                self.differ(line, &question, Kind::Surplus { emulated, reason });
            }
        }
    }

    fn differ(&mut self, line: PeerId, question: &str, kind: Kind) {
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
