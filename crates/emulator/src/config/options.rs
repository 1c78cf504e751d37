//! The named options (decision D0) by their keys: one row gives the key, the accepted values and the field that is
//! set.
//!
//! The presets belong to the dialect. The effects are in the controller and, for the links, in [`ts3100_driver::tcp`] and
//! [`ts3100_driver::store`].

use scol_mini::IntDivision;
use std::ops::RangeInclusive;
use std::str::FromStr;
use std::time::Duration;
use ts3100_controller::limits;
use ts3100_controller::options::{
    BadCharacter, Malformed, NoPeer, Options, SfTexts, Strobe, UnknownInput, UnsolicitedSp, WaitAfterStop,
    WhileSending,
};
use ts3100_driver::store::backing::WhenFull;
use ts3100_driver::tcp::{LinkOptions, SecondConnection};
use ts3100_proto::parameter::{LineEnd, OpenMode};
use ts3100_proto::status::su::SuLayout;
use ts3100_proto::status::vr::VrLayout;
use ts3100_proto::text::{Checksum, StxRule};
use ts3100_proto::words::split_duration;

/// Why a named option cannot be set.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum OptionError {
    /// No option has this name.
    #[error("unknown option `{key}`; known are {known}")]
    Unknown {
        /// The key as given.
        key: String,
        /// The known keys, separated by commas.
        known: String,
    },
    /// The value does not fit.
    #[error("option {key}: expected {expected}, found `{found}`")]
    Value {
        /// The key of the option.
        key: &'static str,
        /// The values it accepts.
        expected: String,
        /// The value as given.
        found: String,
    },
}

/// Largest RAM drive in bytes: the largest number of files, each of the largest size.
const MAX_CAPACITY: usize = limits::MAX_FILES * limits::MAX_FILE;
/// Shortest pause between two attempts to dial, so that dialling does not use up the CPU.
const SHORTEST_REDIAL: Duration = Duration::from_millis(10);

/// A value as given, and what its option accepts.
#[derive(Clone, Copy)]
struct Value<'a> {
    text: &'a str,
    accepted: &'static str,
}

/// Sets the field of an option; `None` if the value does not fit.
type Setter = fn(&mut Options, &mut LinkOptions, Value<'_>) -> Option<()>;

/// Key, accepted values, and setter. Where words are accepted, the setter has their meanings in the same order.
const TABLE: &[(&str, &str, Setter)] = &[
    ("channel.no_peer", "alarm or silent", |o, _, v| {
        v.word(&mut o.no_peer, [NoPeer::Alarm, NoPeer::Silent])
    }),
    (
        "channel.redial",
        "a duration from 10ms to an hour, for example 2s",
        |_, l, v| v.duration_from(&mut l.redial, SHORTEST_REDIAL),
    ),
    ("channel.second", "refuse or replace", |_, l, v| {
        v.word(
            &mut l.second,
            [SecondConnection::Refuse, SecondConnection::Replace],
        )
    }),
    ("do.min_run", "a duration, for example 200ms", |o, _, v| {
        v.duration_from(&mut o.do_min_run, Duration::ZERO)
    }),
    ("drive.capacity", "a number of bytes up to 99999000", |o, _, v| {
        v.number(&mut o.drive_capacity, 0..=MAX_CAPACITY)
    }),
    (
        "drive.open_mode",
        "four digits 0, 1 or 2 as in [E00], for example `1 1 0 0`",
        |o, _, v| {
            o.open_mode = parse_open_modes(v.text)?;
            Some(())
        },
    ),
    ("drive.when_full", "refuse or memory", |_, l, v| {
        v.word(&mut l.when_full, [WhenFull::Refuse, WhenFull::Memory])
    }),
    ("extensions", "true or false", |o, _, v| {
        v.word(&mut o.extensions, [true, false])
    }),
    ("input.malformed", "alarm or leading-number", |o, _, v| {
        v.word(&mut o.malformed, [Malformed::Alarm, Malformed::LeadingNumber])
    }),
    ("parameter.line_end", "lf or cr", |o, _, v| {
        v.word(&mut o.line_end, [LineEnd::Lf, LineEnd::Cr])
    }),
    ("scol.int_division", "truncate or real", |o, _, v| {
        v.word(&mut o.int_division, [IntDivision::Truncate, IntDivision::Real])
    }),
    ("dl.command_ends", "true or false", |o, _, v| {
        v.word(&mut o.command_ends_download, [true, false])
    }),
    ("scol.data_copy", "true or false", |o, _, v| {
        v.word(&mut o.data_copy, [true, false])
    }),
    ("scol.din_unknown", "alarm or zero", |o, _, v| {
        v.word(&mut o.din_unknown, [UnknownInput::Alarm, UnknownInput::Zero])
    }),
    ("scol.equal_within", "a number from 0 to 1000", |o, _, v| {
        let mut within = 0.0;
        v.number(&mut within, 0.0..=1_000.0)?;
        o.equal_within = Some(within);
        Some(())
    }),
    ("scol.sticky_work", "true or false", |o, _, v| {
        v.word(&mut o.sticky_work, [true, false])
    }),
    ("serial.bad_character", "drop or keep", |o, _, v| {
        v.word(&mut o.bad_character, [BadCharacter::Drop, BadCharacter::Keep])
    }),
    ("serial.pacing", "true or false", |o, _, v| {
        v.word(&mut o.serial_pacing, [true, false])
    }),
    ("serial.while_sending", "lost or kept", |o, _, v| {
        v.word(&mut o.while_sending, [WhileSending::Lost, WhileSending::Kept])
    }),
    ("servo.interval", "a duration, for example 7s", |o, _, v| {
        v.duration_from(&mut o.servo_interval, Duration::ZERO)
    }),
    ("sf.split", "one or several (texts)", |o, _, v| {
        v.word(&mut o.sf_texts, [SfTexts::One, SfTexts::Several])
    }),
    (
        "sig.low_speed",
        "a whole number of percent from 1 to 100",
        |o, _, v| v.number(&mut o.low_speed, 1..=100),
    ),
    ("sig.strobe", "free or required", |o, _, v| {
        v.word(&mut o.strobe, [Strobe::Free, Strobe::Required])
    }),
    ("sp.unsolicited", "auto, true or false", |o, _, v| {
        use UnsolicitedSp::{Always, Auto, Never};
        v.word(&mut o.unsolicited_sp, [Auto, Always, Never])
    }),
    ("strict_50ms", "true or false", |o, _, v| {
        v.word(&mut o.strict_50ms, [true, false])
    }),
    ("su.layout", "one-record or six-records", |o, _, v| {
        v.word(&mut o.su_layout, [SuLayout::OneRecord, SuLayout::SixRecords])
    }),
    ("text.checksum", "none or sum", |o, _, v| {
        v.word(&mut o.text.checksum, [Checksum::None, Checksum::Sum])
    }),
    ("text.require_cr", "true or false", |o, _, v| {
        v.word(&mut o.require_cr, [true, false])
    }),
    ("text.stx", "detect or required", |o, _, v| {
        v.word(&mut o.text.stx, [StxRule::Detect, StxRule::Required])
    }),
    ("vr.layout", "blanks or packed", |o, _, v| {
        v.word(&mut o.vr_layout, [VrLayout::Blanks, VrLayout::Packed])
    }),
    ("wait.after_stop", "next or again", |o, _, v| {
        v.word(
            &mut o.wait_after_stop,
            [WaitAfterStop::Next, WaitAfterStop::Again],
        )
    }),
];

impl Value<'_> {
    /// Sets the meaning of an accepted word. `_` counts as `-`, because keys are written with one and values with the
    /// other.
    fn word<T, const N: usize>(self, place: &mut T, meanings: [T; N]) -> Option<()> {
        let given = self.text.replace('_', "-");
        let words = self
            .accepted
            .split([' ', ','])
            .filter(|word| !["", "or"].contains(word));
        *place = words.zip(meanings).find(|(word, _)| *word == given)?.1;
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

/// The keys of all named options with the values they accept, in alphabetical order.
#[must_use]
pub fn option_keys() -> Vec<(&'static str, &'static str)> {
    TABLE.iter().map(|(key, values, _)| (*key, *values)).collect()
}

/// Sets one named option.
///
/// # Errors
/// An unknown key, or a value the option does not accept.
pub fn set_option(
    options: &mut Options,
    links: &mut LinkOptions,
    key: &str,
    value: &str,
) -> Result<(), OptionError> {
    let Some((key, expected, set)) = TABLE.iter().find(|(known, _, _)| *known == key) else {
        let known: Vec<&str> = TABLE.iter().map(|(known, _, _)| *known).collect();
        return Err(OptionError::Unknown {
            key: key.to_owned(),
            known: known.join(", "),
        });
    };
    let given = Value {
        text: value,
        accepted: expected,
    };
    set(options, links, given).ok_or_else(|| OptionError::Value {
        key,
        expected: (*expected).to_owned(),
        found: value.to_owned(),
    })
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

#[cfg(test)]
mod tests;
