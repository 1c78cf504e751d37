//! Questions for which servo power is switched, or a statement is executed with DO. Those of `turns.rs` move an axis; these do
//! not, but somebody stands at the emergency stop all the same.

use super::ROW;
use super::program::trust;
use crate::probe::{Ask, Class, Probe};
use crate::talk::{Heard, QUIET, Talk, Trouble};
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
        ask: Ask::Word(|talk| {
            talk.reopen()?;
            talk.select(WAITS)?;
            talk.take_stops();
            talk.command("DO,R = 1")?;
            talk.until_stopped(LONGEST_DO)?;
            talk.wait(QUIET)?;
            let is_told = talk.take_stops() > 0;
            Ok(if trust(talk, is_told)? { "SP" } else { "none" })
        }),
        readings: &["none", "SP"],
        ..MOTION
    },
    Probe {
        id: "do-flow-control",
        question: "Is DO with flow control refused?",
        sends: "DO,GOTO L1",
        ask: Ask::Word(|talk| {
            talk.select(WAITS)?;
            talk.reply("DO,GOTO L1")
        }),
        readings: &["NG", "OK"],
        ..MOTION
    },
    Probe {
        id: "break-in-delay",
        question: "Where does EC,BREAK stop a program?",
        sends: "a program with DELAY 3; RN, EC,BREAK",
        ask: Ask::Steps(|talk| {
            talk.reopen()?;
            talk.select(WAITS)?;
            talk.take_stops();
            talk.begin()?;
            if !talk.asks("EC,BREAK")? {
                talk.finish()?;
                return Ok("NG".to_owned());
            }
            let status = talk.finish()?;
            talk.wait(QUIET)?;
            let is_told = talk.take_stops() > 0;
            let notice = if trust(talk, is_told)? { ", SP" } else { "" };
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
        ask: Ask::Word(|talk| {
            let mut held = Vec::new();
            for _ in 0..2 {
                talk.command("FD")?;
                held.push(total_status(talk)?.feed_hold);
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
        ask: Ask::Steps(|talk| {
            let (_, status) = stopped_in_feed_hold(talk)?;
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
        ask: Ask::Word(|talk| Ok(stopped_in_feed_hold(talk)?.0.as_str())),
        readings: &["running", "stop (retry)", "stop (continue)"],
        ..PRIVATE
    },
    Probe {
        id: "reset-ends-feed-hold",
        question: "Does RS,PRG end feed hold?",
        sends: "FD, RS,PRG, SF",
        ask: Ask::Word(|talk| {
            talk.select(WAITS)?;
            talk.command("FD")?;
            talk.command("RS,PRG")?;
            let is_held = total_status(talk)?.feed_hold;
            if is_held {
                talk.command("FD")?;
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
        ask: Ask::Word(|talk| {
            talk.command("EC,MODE CYCLE")?;
            talk.reply("EC,MODE CY")
        }),
        readings: &["OK", "NG"],
        ..MOTION
    },
    Probe {
        id: "quick-status-do",
        question: "Does a DO that moves nothing change DC of SM?",
        sends: "SM,1, DO,R = 1, SM,1",
        ask: Ask::Word(|talk| {
            talk.select(WAITS)?;
            let before = executed(talk)?;
            talk.command("DO,R = 1")?;
            talk.until_stopped(LONGEST_DO)?;
            let after = executed(talk)?;
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
        ask: Ask::Word(|talk| {
            talk.command("SO")?;
            talk.reply("SO")
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
pub(crate) fn arm_status(talk: &mut Talk<'_>) -> Result<(SfLayout, SystemStatus), Trouble> {
    let (form, content) = talk.total_status()?;
    let layout = match form {
        "one text, SCARA" => SfLayout::Six,
        _ => SfLayout::Eight,
    };
    let status = SystemStatus::decode(content.get(..layout.len()).unwrap_or_default(), layout);
    status
        .map(|status| (layout, status))
        .map_err(|_| Trouble::Surprise("the answer to SF has no form that is known".to_owned()))
}

fn total_status(talk: &mut Talk<'_>) -> Result<SystemStatus, Trouble> {
    Ok(arm_status(talk)?.1)
}

/// DC of SM.
fn executed(talk: &mut Talk<'_>) -> Result<Option<String>, Trouble> {
    let content = talk.file("SM,1")?;
    let text = String::from_utf8_lossy(&content);
    let mut items = text.split(' ').filter(|item| item.starts_with("DC"));
    Ok(items.next().map(str::to_owned))
}

/// Holds a program and stops it: the status while it is held, and after SP.
fn stopped_in_feed_hold(talk: &mut Talk<'_>) -> Result<(ExecutionStatus, SystemStatus), Trouble> {
    talk.select(WAITS)?;
    talk.begin()?;
    talk.command("FD")?;
    let held = talk.status()?.execution;
    talk.command("SP")?;
    talk.wait(QUIET)?;
    let status = total_status(talk)?;
    if status.feed_hold {
        talk.command("FD")?;
    }
    talk.finish()?;
    Ok((held, status))
}

/// Halves the interval in which the time lies, until it is known to 10 ms. What the network adds is never taken for time of the
/// controller: the beginning lies between DO and its OK, the moment of the status between SU and its answer.
fn do_shown_running(talk: &mut Talk<'_>) -> Result<Heard, Trouble> {
    talk.select(WAITS)?;
    let (mut least, mut most) = (Duration::ZERO, LONGEST_DO);
    // One after the other first: that narrows it down to the time of two answers.
    talk.command("DO,R = 1")?;
    let (sent, accepted) = talk.asked();
    while least < LONGEST_DO && talk.status()?.execution == ExecutionStatus::Running {
        least = talk.asked().0.saturating_sub(accepted);
    }
    most = most.min(talk.asked().1.saturating_sub(sent));
    for _ in 0..MOST_TRIES {
        if most.saturating_sub(least) <= DO_EXACT {
            break;
        }
        talk.until_stopped(LONGEST_DO)?;
        talk.command("DO,R = 1")?;
        let (sent, accepted) = talk.asked();
        let aim = accepted + (least + most) / 2;
        talk.wait(aim.saturating_sub(talk.now()))?;
        let execution = talk.status()?.execution;
        let (asked, answered) = talk.asked();
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

fn servo_interval(talk: &mut Talk<'_>) -> Result<Heard, Trouble> {
    let (mut least, mut most) = (Duration::ZERO, Duration::ZERO);
    for _ in 0..3 {
        talk.command("BR")?;
        talk.wait(QUIET)?;
        talk.command("SO")?;
        let (sent, accepted) = talk.asked();
        let mut last_off = Duration::ZERO;
        loop {
            let asked = talk.now();
            let is_on = total_status(talk)?.servo;
            let answered = talk.now();
            if is_on {
                least = least.max(last_off);
                most = most.max(answered.saturating_sub(sent));
                break;
            }
            last_off = asked.saturating_sub(accepted);
            if last_off > LONGEST_SERVO {
                return Ok("servo power does not come".to_owned());
            }
            talk.wait(QUIET)?;
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
