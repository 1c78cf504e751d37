//! Questions that turn the last axis by five or ten degrees, at one hundredth of its speed, and back at 5 %; one moves
//! the arm by a millimetre. A person has to be at the emergency stop.

use super::motion::{PRIVATE, arm_status};
use crate::probe::{Ask, Probe};
use crate::session::{ProbeError, QUIET, Reply, Session};
use std::time::Duration;
use ts3100_proto::status::ExecutionStatus;
use ts3100_proto::status::sf::SfLayout;

/// How far the last axis is turned, in degrees: that of a SCARA is the faster one, and each takes somewhat less than a second.
const ANGLE: f32 = 5.0;
const ANGLE_OF_SCARA: f32 = 10.0;
/// How far the arm is moved, in millimetres.
const SHIFT: f32 = 1.0;
/// Percent of its speed on the way back.
const SPEED_BACK: u8 = 5;
/// Two angles that differ by less are the same.
const EXACT: f32 = 0.05;
/// A motion that was accepted has begun by then.
const SOON: Duration = Duration::from_millis(100);
/// How long a turn may take: the override of the robot may be low.
const LONGEST_TURN: Duration = Duration::from_secs(30);
/// The type of a position, as MR numbers it.
const POSITION: u8 = 4;
/// The first statement of [`program`] is on this line.
const FIRST_LINE: u16 = 7;

pub(super) const PROBES: &[Probe] = &[
    Probe {
        id: "quick-status-motion",
        question: "What do DS and DC of SM show of a motion by DO?",
        sends: "DO,MOVEI n, 5 WITH SPEED = 1 for the last axis n (10 for a SCARA); SM,1 until it has ended",
        ask: Ask::Word(|session| turned(session, quick_status_motion)),
        readings: &[
            "DS is 1 meanwhile, DC counts at the end",
            "DS is 1 meanwhile, DC counts at the beginning",
            "DS is 1 meanwhile, DC stays",
            "DS stays 0",
        ],
        ..PRIVATE
    },
    Probe {
        id: "status-in-motion",
        question: "Does SU show a motion by DO as running until the arm rests?",
        sends: "DO,MOVEI n, 5 WITH SPEED = 1; SU and SF until it has ended",
        ask: Ask::Word(|session| turned(session, status_in_motion)),
        readings: &["until it rests", "not to its end", "it shows as stopped"],
        ..PRIVATE
    },
    Probe {
        id: "feed-hold-motion",
        question: "What does FD do to a motion by DO?",
        sends: "DO,MOVEI n, 5 WITH SPEED = 1; FD, SF twice, FD, SF",
        ask: Ask::Word(|session| turned(session, feed_hold_motion)),
        readings: &[
            "it is held, and goes on",
            "it is held, and given up",
            "it is not held",
        ],
        ..PRIVATE
    },
    Probe {
        id: "stop-in-motion",
        question: "What does SP do to a motion of a program?",
        sends: "a program: MOVEI n, 5 WITH SPEED = 1, R = 1; RN, SP, SF",
        ask: Ask::Steps(|session| turned(session, |session, turn| stopped_motion(session, turn, "SP"))),
        readings: &[
            "it ends, stop (continue)",
            "it is cut, stop (continue)",
            "it is cut, stop (retry)",
            "it ends, stop (retry)",
        ],
        ..PRIVATE
    },
    Probe {
        id: "break-in-motion",
        question: "What does EC,BREAK do to a motion of a program, and the next start?",
        sends: "a program: MOVEI n, 5 WITH SPEED = 1, R = 1; RN, EC,BREAK, SF, RN, SF",
        ask: Ask::Steps(|session| {
            turned(session, |session, turn| {
                let stopped = stopped_motion(session, turn, "EC,BREAK")?;
                let begin = angle(session, turn.axis)?;
                session.start()?;
                session.until_stopped(LONGEST_TURN)?;
                let end = angle(session, turn.axis)?;
                let goes_on = match () {
                    () if same(end, turn.target()) => "goes on to the same end",
                    () if same(end, begin + turn.by) => "begins again",
                    () if same(end, begin) => "gives it up",
                    () => "goes elsewhere",
                };
                Ok(format!("{stopped}; the next start {goes_on}"))
            })
        }),
        readings: &[
            "it is cut, stop (retry); the next start goes on to the same end",
            "it is cut, stop (retry); the next start begins again",
            "it is cut, stop (continue); the next start gives it up",
            "it is cut, stop (continue); the next start goes on to the same end",
        ],
        ..PRIVATE
    },
    Probe {
        id: "statement-after-motion",
        question: "When does the statement after a motion run?",
        sends: "two programs: TIMER = 0, MOVEI n, 5 WITH SPEED = 1, R = TIMER; one of them with ENABLE NOWAIT",
        ask: Ask::Word(|session| turned(session, statement_after_motion)),
        readings: &[
            "when the arm rests; with NOWAIT at once",
            "when the arm rests, with NOWAIT too",
            "at once, with NOWAIT too",
        ],
        ..PRIVATE
    },
    Probe {
        id: "lines-in-motion",
        question: "Which lines does SF show while the first of two motions is under way?",
        sends: "a program: MOVEI n, 5 WITH SPEED = 1, MOVEI n, -5 WITH SPEED = 5; RN, SF",
        ask: Ask::Steps(|session| turned(session, lines_in_motion)),
        readings: &[
            "execution: the first; analysis: the second",
            "execution: the first; analysis: the first",
            "execution: the second; analysis: the second",
        ],
        ..PRIVATE
    },
    Probe {
        id: "work-line",
        question: "For how many positions does a WORK line of the DATA block hold?",
        sends: "a program that puts HERE into a global, MR of it; a program that moves by 1 mm to a position after WORK, to the next one, and back, WITH SPEED = 5",
        ask: Ask::Word(work_line),
        readings: &["the next one", "all that follow"],
        decides: Some(("scol.sticky_work", &["false", "true"])),
        ..PRIVATE
    },
];

/// What is turned, from where, and how far.
#[derive(Debug, Clone, Copy)]
struct Turn {
    /// The last axis: 4 of a SCARA, 6 else.
    axis: usize,
    /// Where it was.
    from: f32,
    /// Towards the middle of its range.
    by: f32,
}

impl Turn {
    fn target(self) -> f32 {
        self.from + self.by
    }

    /// The motion that is looked at, for DO or a program.
    fn statement(self) -> String {
        motion(1, self.axis, self.by)
    }

    /// And back.
    fn back(self, speed: u8) -> String {
        motion(speed, self.axis, -self.by)
    }
}

/// A motion at `speed` percent.
fn motion(speed: u8, axis: usize, by: f32) -> String {
    format!("MOVEI {axis}, {by:.2} WITH SPEED = {speed}")
}

fn same(one: f32, other: f32) -> bool {
    (one - other).abs() < EXACT
}

/// Asks, and turns the axis back to where it was.
fn turned<H>(
    session: &mut Session<'_>,
    steps: impl FnOnce(&mut Session<'_>, Turn) -> Result<H, ProbeError>,
) -> Result<H, ProbeError> {
    let (layout, status) = arm_status(session)?;
    let (axis, size) = match layout {
        SfLayout::Six => (4, ANGLE_OF_SCARA),
        SfLayout::Eight => (6, ANGLE),
    };
    let from = joint(&status.joint, axis);
    let by = if from > 0.0 { -size } else { size };
    let heard = steps(session, Turn { axis, from, by });
    if heard.as_ref().is_err_and(|error| !error.is_refusal()) {
        // What is unclear must not go on at a machine.
        return heard;
    }
    if heard.is_err() {
        session.finish()?;
    }
    let rest = from - angle(session, axis)?;
    if rest.abs() >= EXACT {
        session.command(&format!("DO,{}", motion(SPEED_BACK, axis, rest)))?;
        session.until_stopped(LONGEST_TURN)?;
    }
    heard
}

/// The first axis that is no longer where it was, and by how much.
pub(crate) fn moved_axis(before: &[f32; 8], now: &[f32; 8]) -> Option<(usize, f32)> {
    let by = now.iter().zip(before).map(|(now, before)| now - before);
    (1..).zip(by).find(|(_, by)| by.abs() >= EXACT)
}

/// A program of these statements.
fn program(statements: &[&str]) -> String {
    let statements = statements.join("\r\n");
    format!(
        "GLOBAL\r\nR = 7.0\r\nEND\r\nPROGRAM SURVEY\r\nTIMER = 0\r\nDISABLE NOWAIT\r\n{statements}\r\nEND\r\n"
    )
}

fn joint(joints: &[f32; 8], axis: usize) -> f32 {
    joints.get(axis - 1).copied().unwrap_or_default()
}

fn angle(session: &mut Session<'_>, axis: usize) -> Result<f32, ProbeError> {
    Ok(joint(&arm_status(session)?.1.joint, axis))
}

/// DO needs a selected file.
fn start_by_do(session: &mut Session<'_>, turn: Turn) -> Result<(), ProbeError> {
    session.select(&program(&["R = 1"]))?;
    session.command(&format!("DO,{}", turn.statement()))
}

/// The axis is no longer where it was.
fn expect_turned(turn: Turn, now: f32) -> Result<(), ProbeError> {
    match same(now, turn.from) {
        false => Ok(()),
        true => Err(ProbeError::Refused(format!(
            "axis {} did not turn: it may be missing, or at its limit",
            turn.axis
        ))),
    }
}

fn too_fast() -> ProbeError {
    ProbeError::Refused("the motion was too fast to see".to_owned())
}

/// DC and DS.
fn quick_status(session: &mut Session<'_>) -> Result<(String, bool), ProbeError> {
    let content = session.file("SM,1")?;
    let text = String::from_utf8_lossy(&content).into_owned();
    let item = |name| text.split_whitespace().find_map(|item| item.strip_prefix(name));
    match (item("DC"), item("DS")) {
        (Some(count), Some(is_active)) => Ok((count.to_owned(), is_active == "1")),
        _ => Err(ProbeError::Refused("SM shows no DC and DS".to_owned())),
    }
}

fn quick_status_motion(session: &mut Session<'_>, turn: Turn) -> Result<&'static str, ProbeError> {
    let (before, _) = quick_status(session)?;
    start_by_do(session, turn)?;
    let during = quick_status(session)?;
    session.wait(QUIET)?;
    let later = quick_status(session)?;
    session.until_stopped(LONGEST_TURN)?;
    let (after, is_active) = quick_status(session)?;
    expect_turned(turn, angle(session, turn.axis)?)?;
    let is_seen = (during.1 || later.1) && !is_active;
    let is_early = during.0 != before;
    Ok(match (is_seen, is_early, after != before) {
        (true, false, true) => "DS is 1 meanwhile, DC counts at the end",
        (true, true, _) => "DS is 1 meanwhile, DC counts at the beginning",
        (true, false, false) => "DS is 1 meanwhile, DC stays",
        (false, ..) if !is_active => "DS stays 0",
        (false, ..) => "DS stays 1",
    })
}

fn status_in_motion(session: &mut Session<'_>, turn: Turn) -> Result<&'static str, ProbeError> {
    start_by_do(session, turn)?;
    session.wait(SOON)?;
    let is_shown = session.status()?.execution == ExecutionStatus::Running;
    let during = angle(session, turn.axis)?;
    session.until_stopped(LONGEST_TURN)?;
    let end = angle(session, turn.axis)?;
    session.wait(QUIET)?;
    let rest = angle(session, turn.axis)?;
    expect_turned(turn, rest)?;
    if same(during, rest) {
        return Err(too_fast());
    }
    Ok(match (is_shown, same(end, rest)) {
        (true, true) => "until it rests",
        (true, false) => "not to its end",
        (false, _) => "it shows as stopped",
    })
}

fn feed_hold_motion(session: &mut Session<'_>, turn: Turn) -> Result<&'static str, ProbeError> {
    start_by_do(session, turn)?;
    // Before anything is asked: a status of a serial line takes as long as the turn.
    session.wait(QUIET)?;
    session.command("FD")?;
    session.wait(QUIET)?;
    let first = angle(session, turn.axis)?;
    let second = angle(session, turn.axis)?;
    session.command("FD")?;
    session.until_stopped(LONGEST_TURN)?;
    let end = angle(session, turn.axis)?;
    expect_turned(turn, first)?;
    if same(first, turn.target()) {
        // FD came after its end.
        return Err(too_fast());
    }
    Ok(match (same(first, second), same(end, turn.target())) {
        (true, true) => "it is held, and goes on",
        (true, false) => "it is held, and given up",
        (false, _) => "it is not held",
    })
}

/// Starts a program that turns, and stops it by this command: returns the outcome of the motion and the place of the
/// stop.
fn stopped_motion(session: &mut Session<'_>, turn: Turn, command: &str) -> Result<Reply, ProbeError> {
    session.select(&program(&[&turn.statement(), "R = 1"]))?;
    session.start()?;
    session.wait(QUIET)?;
    session.command(command)?;
    let execution = session.until_stopped(LONGEST_TURN)?;
    if execution == Some(ExecutionStatus::Reset) {
        // Its end came first.
        return Err(too_fast());
    }
    // The status may be there before the arm rests.
    session.wait(QUIET)?;
    let now = angle(session, turn.axis)?;
    expect_turned(turn, now)?;
    let end = match same(now, turn.target()) {
        true => "it ends",
        false => "it is cut",
    };
    Ok(format!(
        "{end}, {}",
        execution.map_or("running", ExecutionStatus::as_str)
    ))
}

fn statement_after_motion(session: &mut Session<'_>, turn: Turn) -> Result<&'static str, ProbeError> {
    let mut time = |wait: &str, motion: &str| {
        session.select(&program(&[wait, motion, "R = TIMER"]))?;
        session.start()?;
        session.until_stopped(LONGEST_TURN)?;
        number(session, "R")
    };
    // The turn takes about a second, whatever the unit of TIMER is.
    let waiting = time("DISABLE NOWAIT", &turn.statement())?;
    let at_once = time("ENABLE NOWAIT", &turn.back(1))?;
    let is_late = |time: f32| time > waiting.max(at_once) / 2.0;
    Ok(match (is_late(waiting), is_late(at_once)) {
        (true, false) => "when the arm rests; with NOWAIT at once",
        (true, true) if waiting > 0.2 => "when the arm rests, with NOWAIT too",
        _ => "at once, with NOWAIT too",
    })
}

fn lines_in_motion(session: &mut Session<'_>, turn: Turn) -> Result<Reply, ProbeError> {
    session.select(&program(&[&turn.statement(), &turn.back(SPEED_BACK)]))?;
    session.start()?;
    session.wait(SOON)?;
    let (_, status) = arm_status(session)?;
    let turned = |to: f32| (to - turn.from).abs();
    let now = turned(joint(&status.joint, turn.axis));
    // On the way back the angle becomes smaller.
    if now < EXACT || turned(angle(session, turn.axis)?) <= now {
        return Err(too_fast());
    }
    session.until_stopped(LONGEST_TURN)?;
    let line = |number: u16| match number {
        0 => "none".to_owned(),
        number if number == FIRST_LINE => "the first".to_owned(),
        number if number == FIRST_LINE + 1 => "the second".to_owned(),
        number => format!("line {number}"),
    };
    Ok(format!(
        "execution: {}; analysis: {}",
        line(status.execution_line),
        line(status.analysis_line)
    ))
}

fn number(session: &mut Session<'_>, name: &str) -> Result<f32, ProbeError> {
    let value = session.variable(name, 1)?;
    let number = value.parse();
    number.map_err(|_| ProbeError::Refused(format!("{name} is {value}")))
}

/// The first position is in the coordinate system for certain; the second one has the same numbers. They are those of the place
/// where the arm is, as MR tells them, with its posture.
fn work_line(session: &mut Session<'_>) -> Result<&'static str, ProbeError> {
    session.run("GLOBAL\r\nPSURV = POINT(0,0,0)\r\nEND\r\nPROGRAM SURVEY\r\nPSURV = HERE\r\nEND\r\n")?;
    let here = session.variable("PSURV", POSITION)?;
    let (place, posture) = here.rsplit_once(' ').unwrap_or((&here, ""));
    // MR writes it as a real.
    let posture = posture.split('.').next().unwrap_or_default();
    let here = format!("{}/{posture}", place.replace(' ', ","));
    // Towards the base the arm has room.
    let shift = if here.starts_with('-') { SHIFT } else { -SHIFT };
    let has_run = session.try_run(&format!(
        "GLOBAL\r\nR = 7.0\r\nS = 7.0\r\nEND\r\nPROGRAM SURVEY\r\nDISABLE NOWAIT\r\nP = HERE\r\n\
         MOVE PSURV1 WITH SPEED = {SPEED_BACK}\r\nR = HERE.X - P.X\r\n\
         MOVE PSURV2 WITH SPEED = {SPEED_BACK}\r\nS = HERE.X - P.X\r\n\
         MOVE P WITH SPEED = {SPEED_BACK}\r\nEND\r\n\
         DATA\r\nTRANS TSURV = {shift},0,0\r\nWORK TSURV\r\nPOINT PSURV1 = {here}\r\nPOINT PSURV2 = {here}\r\nEND\r\n"
    ))?;
    if !has_run {
        return Err(ProbeError::Refused(format!(
            "the arm cannot be moved by {SHIFT} mm here"
        )));
    }
    let is_shifted = |moved: f32| (moved - shift).abs() < SHIFT / 2.0;
    let (first, second) = (number(session, "R")?, number(session, "S")?);
    Ok(match (is_shifted(first), is_shifted(second)) {
        (true, false) => "the next one",
        (true, true) => "all that follow",
        (false, _) => "none",
    })
}
