//! The named options (decision D0) by their keys: one row gives the key, the accepted values and the field that is
//! set.
//!
//! The presets belong to the dialect. The effects are in the controller and, for the links, in [`ts3100_driver::tcp`] and
//! [`ts3100_driver::store`].

use scol_mini::IntDivision;
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

type Setter = fn(&mut Options, &mut LinkOptions, &str) -> Option<()>;

/// Key, accepted values, and setter. A setter returns `None` if the value does not fit.
const TABLE: &[(&str, &str, Setter)] = &[
    ("channel.no_peer", "alarm or silent", |o, _, v| {
        assign(
            &mut o.no_peer,
            choice(v, &[("alarm", NoPeer::Alarm), ("silent", NoPeer::Silent)]),
        )
    }),
    (
        "channel.redial",
        "a duration from 10ms to an hour, for example 2s",
        |_, l, v| {
            assign(
                &mut l.redial,
                parse_duration(v).filter(|pause| *pause >= SHORTEST_REDIAL),
            )
        },
    ),
    ("channel.second", "refuse or replace", |_, l, v| {
        assign(
            &mut l.second,
            choice(
                v,
                &[
                    ("refuse", SecondConnection::Refuse),
                    ("replace", SecondConnection::Replace),
                ],
            ),
        )
    }),
    ("do.min_run", "a duration, for example 200ms", |o, _, v| {
        assign(&mut o.do_min_run, parse_duration(v))
    }),
    ("drive.capacity", "a number of bytes up to 99999000", |o, _, v| {
        let bytes = v.parse().ok();
        assign(
            &mut o.drive_capacity,
            bytes.filter(|bytes| *bytes <= MAX_CAPACITY),
        )
    }),
    (
        "drive.open_mode",
        "four digits 0, 1 or 2 as in [E00], for example `1 1 0 0`",
        |o, _, v| assign(&mut o.open_mode, parse_open_modes(v)),
    ),
    ("drive.when_full", "refuse or memory", |_, l, v| {
        assign(
            &mut l.when_full,
            choice(v, &[("refuse", WhenFull::Refuse), ("memory", WhenFull::Memory)]),
        )
    }),
    ("extensions", "true or false", |o, _, v| {
        assign(&mut o.extensions, v.parse().ok())
    }),
    ("input.malformed", "alarm or leading-number", |o, _, v| {
        assign(
            &mut o.malformed,
            choice(
                v,
                &[
                    ("alarm", Malformed::Alarm),
                    ("leading-number", Malformed::LeadingNumber),
                ],
            ),
        )
    }),
    ("parameter.line_end", "lf or cr", |o, _, v| {
        assign(
            &mut o.line_end,
            choice(v, &[("lf", LineEnd::Lf), ("cr", LineEnd::Cr)]),
        )
    }),
    ("scol.int_division", "truncate or real", |o, _, v| {
        assign(
            &mut o.int_division,
            choice(
                v,
                &[("truncate", IntDivision::Truncate), ("real", IntDivision::Real)],
            ),
        )
    }),
    ("dl.command_ends", "true or false", |o, _, v| {
        assign(&mut o.command_ends_download, v.parse().ok())
    }),
    ("scol.data_copy", "true or false", |o, _, v| {
        assign(&mut o.data_copy, v.parse().ok())
    }),
    ("scol.din_unknown", "alarm or zero", |o, _, v| {
        assign(
            &mut o.din_unknown,
            choice(v, &[("alarm", UnknownInput::Alarm), ("zero", UnknownInput::Zero)]),
        )
    }),
    ("scol.equal_within", "a number from 0 to 1000", |o, _, v| {
        let number = v.parse().ok();
        let number = number.filter(|number: &f32| (0.0..=1_000.0).contains(number));
        assign(&mut o.equal_within, number.map(Some))
    }),
    ("scol.sticky_work", "true or false", |o, _, v| {
        assign(&mut o.sticky_work, v.parse().ok())
    }),
    ("serial.bad_character", "drop or keep", |o, _, v| {
        assign(
            &mut o.bad_character,
            choice(v, &[("drop", BadCharacter::Drop), ("keep", BadCharacter::Keep)]),
        )
    }),
    ("serial.pacing", "true or false", |o, _, v| {
        assign(&mut o.serial_pacing, v.parse().ok())
    }),
    ("serial.while_sending", "lost or kept", |o, _, v| {
        assign(
            &mut o.while_sending,
            choice(v, &[("lost", WhileSending::Lost), ("kept", WhileSending::Kept)]),
        )
    }),
    ("servo.interval", "a duration, for example 7s", |o, _, v| {
        assign(&mut o.servo_interval, parse_duration(v))
    }),
    ("sf.split", "one or several (texts)", |o, _, v| {
        assign(
            &mut o.sf_texts,
            choice(v, &[("one", SfTexts::One), ("several", SfTexts::Several)]),
        )
    }),
    (
        "sig.low_speed",
        "a whole number of percent from 1 to 100",
        |o, _, v| {
            assign(
                &mut o.low_speed,
                v.parse().ok().filter(|percent| (1..=100).contains(percent)),
            )
        },
    ),
    ("sig.strobe", "free or required", |o, _, v| {
        assign(
            &mut o.strobe,
            choice(v, &[("free", Strobe::Free), ("required", Strobe::Required)]),
        )
    }),
    ("sp.unsolicited", "auto, true or false", |o, _, v| {
        assign(
            &mut o.unsolicited_sp,
            choice(
                v,
                &[
                    ("auto", UnsolicitedSp::Auto),
                    ("true", UnsolicitedSp::Always),
                    ("false", UnsolicitedSp::Never),
                ],
            ),
        )
    }),
    ("strict_50ms", "true or false", |o, _, v| {
        assign(&mut o.strict_50ms, v.parse().ok())
    }),
    ("su.layout", "one-record or six-records", |o, _, v| {
        assign(
            &mut o.su_layout,
            choice(
                v,
                &[
                    ("one-record", SuLayout::OneRecord),
                    ("six-records", SuLayout::SixRecords),
                ],
            ),
        )
    }),
    ("text.checksum", "none or sum", |o, _, v| {
        assign(
            &mut o.text.checksum,
            choice(v, &[("none", Checksum::None), ("sum", Checksum::Sum)]),
        )
    }),
    ("text.require_cr", "true or false", |o, _, v| {
        assign(&mut o.require_cr, v.parse().ok())
    }),
    ("text.stx", "detect or required", |o, _, v| {
        assign(
            &mut o.text.stx,
            choice(v, &[("detect", StxRule::Detect), ("required", StxRule::Required)]),
        )
    }),
    ("vr.layout", "blanks or packed", |o, _, v| {
        assign(
            &mut o.vr_layout,
            choice(v, &[("blanks", VrLayout::Blanks), ("packed", VrLayout::Packed)]),
        )
    }),
    ("wait.after_stop", "next or again", |o, _, v| {
        assign(
            &mut o.wait_after_stop,
            choice(
                v,
                &[("next", WaitAfterStop::Next), ("again", WaitAfterStop::Again)],
            ),
        )
    }),
];

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
    set(options, links, value).ok_or_else(|| OptionError::Value {
        key,
        expected: (*expected).to_owned(),
        found: value.to_owned(),
    })
}

fn assign<T>(place: &mut T, value: Option<T>) -> Option<()> {
    *place = value?;
    Some(())
}

/// The meaning of a word. `_` counts as `-`, because keys are written with one and values with the other.
fn choice<T: Copy>(value: &str, words: &[(&str, T)]) -> Option<T> {
    let value = value.replace('_', "-");
    words
        .iter()
        .find(|(word, _)| *word == value)
        .map(|(_, meaning)| *meaning)
}

/// Parses `200ms`, `2s` or `0.5s`; at most an hour.
fn parse_duration(text: &str) -> Option<Duration> {
    const HOUR: Duration = Duration::from_secs(3_600);
    let (number, micros) = split_duration(text, &["ms", "s"])?;
    let seconds = number.trim().parse::<f64>().ok()? * f64::from(micros) / 1e6;
    Duration::try_from_secs_f64(seconds)
        .ok()
        .filter(|duration| *duration <= HOUR)
}

fn parse_open_modes(text: &str) -> Option<[OpenMode; 4]> {
    let digits = text.split([' ', ',']).filter(|part| !part.is_empty());
    let modes: Option<Vec<OpenMode>> = digits
        .map(|digit| {
            choice(
                digit,
                &[
                    ("0", OpenMode::NotUsed),
                    ("1", OpenMode::Server),
                    ("2", OpenMode::Client),
                ],
            )
        })
        .collect();
    modes?.try_into().ok()
}

#[cfg(test)]
mod tests;
