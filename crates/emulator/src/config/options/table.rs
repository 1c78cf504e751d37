//! The table of the named options, and how their values are read.

use super::{Given, OptionRow, Setter, Values};
use scol_mini::IntDivision;
use std::ops::RangeInclusive;
use std::str::FromStr;
use std::time::Duration;
use ts3100_controller::limits;
use ts3100_controller::options::{
    BadCharacter, Malformed, NoPeer, SfTexts, Strobe, UnknownInput, UnsolicitedSp, WaitAfterStop,
    WhileSending,
};
use ts3100_driver::store::backing::WhenFull;
use ts3100_driver::tcp::SecondConnection;
use ts3100_proto::parameter::{LineEnd, OpenMode};
use ts3100_proto::status::su::SuLayout;
use ts3100_proto::status::vr::VrLayout;
use ts3100_proto::text::{Checksum, StxRule};
use ts3100_proto::words::split_duration;

/// Largest RAM drive in bytes: the largest number of files, each of the largest size.
const MAX_CAPACITY: usize = limits::MAX_FILES * limits::MAX_FILE;
/// Shortest silence before automatic time jumps: an answer on the loopback takes about as long.
const SHORTEST_SILENCE: Duration = Duration::from_micros(50);
/// Shortest pause between two attempts to dial, so that dialling does not use up the CPU.
const SHORTEST_REDIAL: Duration = Duration::from_millis(10);

const fn row(
    key: &'static str,
    values: Values,
    [field, manual]: [&'static str; 2],
    set: Setter,
) -> OptionRow {
    OptionRow {
        key,
        values,
        field,
        manual,
        set,
    }
}

/// Every option, in alphabetical order: key, values, defaults in the dialects `field` and `manual`, and setter.
pub static OPTIONS: &[OptionRow] = &[
    row(
        "auto.silence",
        Values::Duration {
            least: "0.05ms",
            example: "1ms",
        },
        ["1ms", "1ms"],
        |_, l, v| v.duration_from(&mut l.silence, SHORTEST_SILENCE),
    ),
    row(
        "channel.no_peer",
        Values::Words(&["alarm", "silent"]),
        ["alarm", "silent"],
        |o, _, v| v.word(&mut o.no_peer, [NoPeer::Alarm, NoPeer::Silent]),
    ),
    row(
        "channel.redial",
        Values::Duration {
            least: "10ms",
            example: "2s",
        },
        ["2s", "2s"],
        |_, l, v| v.duration_from(&mut l.redial, SHORTEST_REDIAL),
    ),
    row(
        "channel.second",
        Values::Words(&["refuse", "replace"]),
        ["refuse", "refuse"],
        |_, l, v| {
            v.word(
                &mut l.second,
                [SecondConnection::Refuse, SecondConnection::Replace],
            )
        },
    ),
    row("dl.command_ends", Values::Flag, ["true", "true"], |o, _, v| {
        v.word(&mut o.command_ends_download, [true, false])
    }),
    row(
        "do.min_run",
        Values::Duration {
            least: "0s",
            example: "200ms",
        },
        ["200ms", "200ms"],
        |o, _, v| v.duration_from(&mut o.do_min_run, Duration::ZERO),
    ),
    row(
        "drive.capacity",
        Values::Whole {
            unit: "bytes",
            min: 0,
            max: MAX_CAPACITY,
        },
        ["1048576", "1048576"],
        |o, _, v| v.number(&mut o.drive_capacity, 0..=MAX_CAPACITY),
    ),
    row(
        "drive.open_mode",
        Values::OpenModes,
        ["1 1 1 1", "1 0 0 0"],
        |o, _, v| {
            o.open_mode = parse_open_modes(v.text)?;
            Some(())
        },
    ),
    row(
        "drive.when_full",
        Values::Words(&["refuse", "memory"]),
        ["refuse", "refuse"],
        |_, l, v| v.word(&mut l.when_full, [WhenFull::Refuse, WhenFull::Memory]),
    ),
    row("extensions", Values::Flag, ["true", "false"], |o, _, v| {
        v.word(&mut o.extensions, [true, false])
    }),
    row(
        "input.malformed",
        Values::Words(&["alarm", "leading-number"]),
        ["alarm", "leading-number"],
        |o, _, v| v.word(&mut o.malformed, [Malformed::Alarm, Malformed::LeadingNumber]),
    ),
    row(
        "parameter.line_end",
        Values::Words(&["lf", "cr"]),
        ["lf", "cr"],
        |o, _, v| v.word(&mut o.line_end, [LineEnd::Lf, LineEnd::Cr]),
    ),
    row("reply.delay", Values::Quartiles, ["0", "0"], |o, _, v| {
        parse_quartiles(v.text).map(|times| o.reply_delay = times)
    }),
    row("scol.data_copy", Values::Flag, ["false", "false"], |o, _, v| {
        v.word(&mut o.data_copy, [true, false])
    }),
    row(
        "scol.din_unknown",
        Values::Words(&["alarm", "zero"]),
        ["alarm", "alarm"],
        |o, _, v| v.word(&mut o.din_unknown, [UnknownInput::Alarm, UnknownInput::Zero]),
    ),
    row(
        "scol.equal_within",
        Values::Number {
            min: 0.0,
            max: 1_000.0,
        },
        ["", ""],
        |o, _, v| {
            let mut within = 0.0;
            v.number(&mut within, 0.0..=1_000.0)?;
            o.equal_within = Some(within);
            Some(())
        },
    ),
    row(
        "scol.int_division",
        Values::Words(&["truncate", "real"]),
        ["truncate", "truncate"],
        |o, _, v| v.word(&mut o.int_division, [IntDivision::Truncate, IntDivision::Real]),
    ),
    row("scol.sticky_work", Values::Flag, ["false", "false"], |o, _, v| {
        v.word(&mut o.sticky_work, [true, false])
    }),
    row(
        "serial.bad_character",
        Values::Words(&["drop", "keep"]),
        ["drop", "drop"],
        |o, _, v| v.word(&mut o.bad_character, [BadCharacter::Drop, BadCharacter::Keep]),
    ),
    row("serial.pacing", Values::Flag, ["true", "true"], |o, _, v| {
        v.word(&mut o.serial_pacing, [true, false])
    }),
    row(
        "serial.while_sending",
        Values::Words(&["lost", "kept"]),
        ["lost", "lost"],
        |o, _, v| v.word(&mut o.while_sending, [WhileSending::Lost, WhileSending::Kept]),
    ),
    row(
        "servo.interval",
        Values::Duration {
            least: "0s",
            example: "7s",
        },
        ["0s", "0s"],
        |o, _, v| v.duration_from(&mut o.servo_interval, Duration::ZERO),
    ),
    row(
        "sf.split",
        Values::Words(&["one", "several"]),
        ["one", "several"],
        |o, _, v| v.word(&mut o.sf_texts, [SfTexts::One, SfTexts::Several]),
    ),
    row(
        "sig.low_speed",
        Values::Whole {
            unit: "percent",
            min: 1,
            max: 100,
        },
        ["10", "10"],
        |o, _, v| v.number(&mut o.low_speed, 1..=100),
    ),
    row(
        "sig.strobe",
        Values::Words(&["free", "required"]),
        ["free", "free"],
        |o, _, v| v.word(&mut o.strobe, [Strobe::Free, Strobe::Required]),
    ),
    row(
        "sp.unsolicited",
        Values::Words(&["auto", "true", "false"]),
        ["auto", "true"],
        |o, _, v| {
            use UnsolicitedSp::{Always, Auto, Never};
            v.word(&mut o.unsolicited_sp, [Auto, Always, Never])
        },
    ),
    row("strict_50ms", Values::Flag, ["false", "false"], |o, _, v| {
        v.word(&mut o.strict_50ms, [true, false])
    }),
    row(
        "su.layout",
        Values::Words(&["one-record", "six-records"]),
        ["one-record", "six-records"],
        |o, _, v| v.word(&mut o.su_layout, [SuLayout::OneRecord, SuLayout::SixRecords]),
    ),
    row(
        "text.checksum",
        Values::Words(&["none", "sum"]),
        ["none", "none"],
        |o, _, v| v.word(&mut o.text.checksum, [Checksum::None, Checksum::Sum]),
    ),
    row("text.require_cr", Values::Flag, ["false", "true"], |o, _, v| {
        v.word(&mut o.require_cr, [true, false])
    }),
    row(
        "text.stx",
        Values::Words(&["detect", "required"]),
        ["detect", "required"],
        |o, _, v| v.word(&mut o.text.stx, [StxRule::Detect, StxRule::Required]),
    ),
    row(
        "vr.layout",
        Values::Words(&["blanks", "packed"]),
        ["blanks", "packed"],
        |o, _, v| v.word(&mut o.vr_layout, [VrLayout::Blanks, VrLayout::Packed]),
    ),
    row(
        "wait.after_stop",
        Values::Words(&["next", "again"]),
        ["next", "next"],
        |o, _, v| {
            v.word(
                &mut o.wait_after_stop,
                [WaitAfterStop::Next, WaitAfterStop::Again],
            )
        },
    ),
];

impl Given<'_> {
    /// Sets the meaning of an accepted word. `_` counts as `-`, because keys are written with one and values with the
    /// other.
    fn word<T, const N: usize>(self, place: &mut T, meanings: [T; N]) -> Option<()> {
        let given = self.text.replace('_', "-");
        let mut words = self.words.iter().zip(meanings);
        *place = words.find(|(word, _)| **word == given)?.1;
        Some(())
    }

    /// Sets a number of this range.
    fn number<T: FromStr + PartialOrd>(self, place: &mut T, range: RangeInclusive<T>) -> Option<()> {
        let number = self.text.parse().ok();
        *place = number.filter(|number| range.contains(number))?;
        Some(())
    }

    /// Sets a duration, `200ms`, `2s` or `0.5s`; at most an hour.
    fn duration_from(self, place: &mut Duration, least: Duration) -> Option<()> {
        const HOUR: Duration = Duration::from_secs(3_600);
        let (number, micros) = split_duration(self.text, &["ms", "s"])?;
        let seconds = number.trim().parse::<f64>().ok()? * f64::from(micros) / 1e6;
        let duration = Duration::try_from_secs_f64(seconds).ok();
        *place = duration.filter(|duration| (least..=HOUR).contains(duration))?;
        Some(())
    }
}

/// Five times in milliseconds in rising order; one stands for all.
fn parse_quartiles(text: &str) -> Option<[Duration; 5]> {
    const MOST: f64 = 60_000.0;
    let words = text.split([' ', ',']).filter(|part| !part.is_empty());
    let times = words.map(|word| {
        let millis = word.parse::<f64>().ok()?;
        (0.0..=MOST)
            .contains(&millis)
            .then(|| Duration::from_secs_f64(millis / 1e3))
    });
    let times = times.collect::<Option<Vec<Duration>>>()?;
    match times.as_slice() {
        [one] => Some([*one; 5]),
        five if five.is_sorted() => five.try_into().ok(),
        _ => None,
    }
}

fn parse_open_modes(text: &str) -> Option<[OpenMode; 4]> {
    let digits = text.split([' ', ',']).filter(|part| !part.is_empty());
    let modes: Option<Vec<OpenMode>> = digits
        .map(|digit| match digit {
            "0" => Some(OpenMode::NotUsed),
            "1" => Some(OpenMode::Server),
            "2" => Some(OpenMode::Client),
            _ => None,
        })
        .collect();
    modes?.try_into().ok()
}
