//! Questions for which servo power is switched, or a statement is executed with DO. Those of `turns.rs` move an axis;
//! these do not, but a person has to be at the emergency stop nevertheless.

use super::ROW;
use super::program::trust;
use crate::probe::{Ask, Class, Probe};
use crate::session::{ProbeError, QUIET, Reply, Session};
use std::time::Duration;
use ts3100_proto::status::ExecutionStatus;
use ts3100_proto::status::sf::{SfLayout, SystemStatus};

const MOTION: Probe = Probe {
    class: Class::Motion,
    ..ROW
};

/// One whose answers show positions.
pub(super) const PRIVATE: Probe = Probe {
    is_public: false,
    ..MOTION
};

/// Longest time that a DO without a motion may show as running.
const LONGEST_DO: Duration = Duration::from_millis(2_000);
/// How exactly the time of a DO is measured.
const DO_EXACT: Duration = Duration::from_millis(10);
/// Longest pause before servo power comes.
const LONGEST_SERVO: Duration = Duration::from_secs(12);
/// Most halvings of an interval.
const MOST_TRIES: usize = 10;

/// A program that waits, for what stops it.
const WAITS: &str = "GLOBAL\r\nR = 7.0\r\nEND\r\nPROGRAM SURVEY\r\nDELAY 3\r\nR = 1\r\nEND\r\n";

pub(super) const PROBES: &[Probe] = &[
    Probe {
        id: "do-shown-running",
        question: "How long does a DO that moves nothing show as running?",
        sends: "DO,R = 1, and SU a moment later, several times",
        ask: Ask::Steps(do_shown_running),
        readings: &["200", "*"],
        decides: Some(("do.min_run", &["200ms", "*ms"])),
        ..MOTION
    },
    Probe {
        id: "do-stop-notice",
        question: "Is SP sent at the end of a DO?",
        sends: "DO,R = 1",
        ask: Ask::Word(|session| {
            session.reopen()?;
            session.select(WAITS)?;
            session.take_stops();
            session.command("DO,R = 1")?;
            session.until_stopped(LONGEST_DO)?;
            session.wait(QUIET)?;
            let is_told = session.take_stops() > 0;
            Ok(if trust(session, is_told)? { "SP" } else { "none" })
        }),
        readings: &["none", "SP"],
        ..MOTION
    },
    Probe {
        id: "do-flow-control",
        question: "Is DO with flow control refused?",
        sends: "DO,GOTO L1",
        ask: Ask::Word(|session| {
            session.select(WAITS)?;
            session.acknowledgement("DO,GOTO L1")
        }),
        readings: &["NG", "OK"],
        ..MOTION
    },
    Probe {
        id: "break-in-delay",
        question: "Where does EC,BREAK stop a program?",
        sends: "a program with DELAY 3; RN, EC,BREAK",
        ask: Ask::Steps(|session| {
            session.reopen()?;
            session.select(WAITS)?;
            session.take_stops();
            session.begin()?;
            if !session.is_accepted("EC,BREAK")? {
                session.finish()?;
                return Ok("NG".to_owned());
            }
            let status = session.finish()?;
            session.wait(QUIET)?;
            let is_told = session.take_stops() > 0;
            let notice = if trust(session, is_told)? { ", SP" } else { "" };
            Ok(format!(
                "{}{notice}",
                status.map_or("running", ExecutionStatus::as_str)
            ))
        }),
        readings: &[
            "stop (retry)",
            "stop (continue)",
            "stop (retry), SP",
            "stop (continue), SP",
            "NG",
        ],
        ..MOTION
    },
    Probe {
        id: "feed-hold",
        question: "Does the second FD end feed hold?",
        sends: "FD, SF, FD, SF",
        ask: Ask::Word(|session| {
            let mut held = Vec::new();
            for _ in 0..2 {
                session.command("FD")?;
                held.push(total_status(session)?.feed_hold);
            }
            Ok(match held.as_slice() {
                [true, false] => "it ends it",
                [true, true] => "it stays",
                _ => "FD does not show",
            })
        }),
        readings: &["it ends it", "it stays"],
        ..PRIVATE
    },
    Probe {
        id: "stop-in-feed-hold",
        question: "Where does SP in feed hold stop a program?",
        sends: "a program with DELAY 3; RN, FD, SU, SP, SF",
        ask: Ask::Steps(|session| {
            let (_, status) = stopped_in_feed_hold(session)?;
            let hold = if status.feed_hold { ", still held" } else { "" };
            Ok(format!("{}{hold}", status.execution.as_str()))
        }),
        readings: &["stop (retry)", "stop (continue)", "running, still held"],
        ..PRIVATE
    },
    Probe {
        id: "feed-hold-running",
        question: "Does SU show a program in feed hold as running?",
        sends: "a program with DELAY 3; RN, FD, SU, SP, SF",
        ask: Ask::Word(|session| Ok(stopped_in_feed_hold(session)?.0.as_str())),
        readings: &["running", "stop (retry)", "stop (continue)"],
        ..PRIVATE
    },
    Probe {
        id: "reset-ends-feed-hold",
        question: "Does RS,PRG end feed hold?",
        sends: "FD, RS,PRG, SF",
        ask: Ask::Word(|session| {
            session.select(WAITS)?;
            session.command("FD")?;
            session.command("RS,PRG")?;
            let is_held = total_status(session)?.feed_hold;
            if is_held {
                session.command("FD")?;
            }
            Ok(if is_held { "it stays" } else { "it ends it" })
        }),
        readings: &["it ends it", "it stays"],
        ..PRIVATE
    },
    Probe {
        id: "mode-abbreviation",
        question: "Are the words of EC,MODE taken when they are cut?",
        sends: "EC,MODE CYCLE and EC,MODE CY, in cycle operation",
        ask: Ask::Word(|session| {
            session.command("EC,MODE CYCLE")?;
            session.acknowledgement("EC,MODE CY")
        }),
        readings: &["OK", "NG"],
        ..MOTION
    },
    Probe {
        id: "quick-status-do",
        question: "Does a DO that moves nothing change DC of SM?",
        sends: "SM,1, DO,R = 1, SM,1",
        ask: Ask::Word(|session| {
            session.select(WAITS)?;
            let before = executed(session)?;
            session.command("DO,R = 1")?;
            session.until_stopped(LONGEST_DO)?;
            let after = executed(session)?;
            Ok(match (&before, &after) {
                (Some(_), Some(_)) if before == after => "it stays",
                (Some(_), Some(_)) => "it counts",
                _ => "no DC",
            })
        }),
        readings: &["it stays", "it counts"],
        ..MOTION
    },
    Probe {
        id: "servo-twice",
        question: "What is answered to SO while servo power is on?",
        sends: "SO, SO",
        ask: Ask::Word(|session| {
            session.command("SO")?;
            session.acknowledgement("SO")
        }),
        readings: &["OK", "NG"],
        ..MOTION
    },
    Probe {
        id: "servo-interval",
        question: "How much later does every third servo-on take effect, in seconds?",
        sends: "BR, SO, SF, three times",
        ask: Ask::Steps(servo_interval),
        readings: &["0", "*"],
        decides: Some(("servo.interval", &["0s", "*s"])),
        ..PRIVATE
    },
];

/// SF, and of which arm it is.
pub(crate) fn arm_status(session: &mut Session<'_>) -> Result<(SfLayout, SystemStatus), ProbeError> {
    let (form, content) = session.total_status()?;
    let layout = match form {
        "one text, SCARA" => SfLayout::Six,
        _ => SfLayout::Eight,
    };
    let status = SystemStatus::decode(content.get(..layout.len()).unwrap_or_default(), layout);
    status
        .map(|status| (layout, status))
        .map_err(|_| ProbeError::Unexpected("the answer to SF has no form that is known".to_owned()))
}

fn total_status(session: &mut Session<'_>) -> Result<SystemStatus, ProbeError> {
    Ok(arm_status(session)?.1)
}

/// DC of SM.
fn executed(session: &mut Session<'_>) -> Result<Option<String>, ProbeError> {
    let content = session.file("SM,1")?;
    let text = String::from_utf8_lossy(&content);
    let mut items = text.split(' ').filter(|item| item.starts_with("DC"));
    Ok(items.next().map(str::to_owned))
}

/// Holds a program and stops it: the status while it is held, and after SP.
fn stopped_in_feed_hold(session: &mut Session<'_>) -> Result<(ExecutionStatus, SystemStatus), ProbeError> {
    session.select(WAITS)?;
    session.begin()?;
    session.command("FD")?;
    let held = session.status()?.execution;
    session.command("SP")?;
    session.wait(QUIET)?;
    let status = total_status(session)?;
    if status.feed_hold {
        session.command("FD")?;
    }
    session.finish()?;
    Ok((held, status))
}

/// Halves the interval in which the time lies, until it is known to 10 ms. What the network adds is never taken for time of the
/// controller: the beginning lies between DO and its OK, the moment of the status between SU and its answer.
fn do_shown_running(session: &mut Session<'_>) -> Result<Reply, ProbeError> {
    session.select(WAITS)?;
    let (mut least, mut most) = (Duration::ZERO, LONGEST_DO);
    // One after the other first: that narrows it down to the time of two answers.
    session.command("DO,R = 1")?;
    let (sent, accepted) = session.request_times();
    while least < LONGEST_DO && session.status()?.execution == ExecutionStatus::Running {
        least = session.request_times().0.saturating_sub(accepted);
    }
    most = most.min(session.request_times().1.saturating_sub(sent));
    for _ in 0..MOST_TRIES {
        if most.saturating_sub(least) <= DO_EXACT {
            break;
        }
        session.until_stopped(LONGEST_DO)?;
        session.command("DO,R = 1")?;
        let (sent, accepted) = session.request_times();
        let aim = accepted + (least + most) / 2;
        session.wait(aim.saturating_sub(session.now()))?;
        let execution = session.status()?.execution;
        let (asked, answered) = session.request_times();
        if execution == ExecutionStatus::Running {
            least = least.max(asked.saturating_sub(accepted));
        } else {
            most = most.min(answered.saturating_sub(sent));
        }
    }
    if most < least || most.saturating_sub(least) > 2 * DO_EXACT {
        return Ok("not to be measured here".to_owned());
    }
    // Of the times that are possible the roundest is the likeliest. A clock may be off by what it is read to.
    let off = DO_EXACT / 2;
    let (least, most) = (least.saturating_sub(off).as_millis(), (most + off).as_millis());
    let rounded = |step: &u128| Some(most / step * step).filter(|time| *time >= least);
    let roundest = [1_000, 500, 100, 50, 20, 10].iter().find_map(rounded);
    Ok(roundest.unwrap_or(least.midpoint(most)).to_string())
}

fn servo_interval(session: &mut Session<'_>) -> Result<Reply, ProbeError> {
    let (mut least, mut most) = (Duration::ZERO, Duration::ZERO);
    for _ in 0..3 {
        session.command("BR")?;
        session.wait(QUIET)?;
        session.command("SO")?;
        let (sent, accepted) = session.request_times();
        let mut last_off = Duration::ZERO;
        loop {
            let asked = session.now();
            let is_on = total_status(session)?.servo;
            let answered = session.now();
            if is_on {
                least = least.max(last_off);
                most = most.max(answered.saturating_sub(sent));
                break;
            }
            last_off = asked.saturating_sub(accepted);
            if last_off > LONGEST_SERVO {
                return Ok("servo power does not come".to_owned());
            }
            session.wait(QUIET)?;
        }
    }
    let whole = most.as_secs();
    let is_only_one = Duration::from_secs(whole) >= least && whole.saturating_sub(1) < least.as_secs() + 1;
    Ok(match (least.is_zero(), is_only_one) {
        (true, _) => "0".to_owned(),
        (false, true) => whole.to_string(),
        (false, false) => "not to be measured here".to_owned(),
    })
}
