//! The name of a moment in addresses and on the command line: `118` is the event of this number, `118@12.4` some time
//! after it, `@12.4` a time alone.

use std::str::FromStr;
use ts3100_controller::Time;

/// A moment as people name it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MomentKey {
    /// The last event that has happened.
    pub event: Option<u64>,
    /// Virtual time; without one, that of the event.
    pub at: Option<Time>,
}

/// A text that names no moment.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("a moment: expected `EVENT`, `EVENT@SECONDS` or `@SECONDS`, such as 118@12.4, found `{0}`")]
pub struct KeyError(String);

impl FromStr for MomentKey {
    type Err = KeyError;

    fn from_str(text: &str) -> Result<MomentKey, KeyError> {
        let wrong = || KeyError(text.chars().take(40).collect());
        let (event, at) = match text.split_once('@') {
            Some((event, at)) => (event, Some(parse_seconds(at).ok_or_else(wrong)?)),
            None => (text, None),
        };
        let event = match (event, at) {
            ("", Some(_)) => None,
            (event, _) => Some(event.parse().map_err(|_| wrong())?),
        };
        Ok(MomentKey { event, at })
    }
}

/// Seconds with at most six decimals, exactly: a binary number would be another microsecond.
pub fn parse_seconds(text: &str) -> Option<Time> {
    let (whole, part) = text.split_once('.').unwrap_or((text, ""));
    if part.len() > 6 || !part.bytes().all(|digit| digit.is_ascii_digit()) {
        return None;
    }
    let micros: u64 = format!("{part:0<6}").parse().ok()?;
    let seconds = whole
        .bytes()
        .all(|digit| digit.is_ascii_digit())
        .then_some(whole)?;
    let seconds: u64 = seconds.parse().ok()?;
    Some(Time::from_micros(
        seconds.checked_mul(1_000_000)?.checked_add(micros)?,
    ))
}

/// Seconds as [`parse_seconds`] reads them, with as many decimals as the time has.
pub fn short_seconds(at: Time) -> String {
    let text = at.to_string();
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moment_is_an_event_a_time_or_both() {
        let key = |text: &str| text.parse::<MomentKey>();
        let at = |micros| Some(Time::from_micros(micros));
        let event = Some(118);
        assert_eq!(key("118"), Ok(MomentKey { event, at: None }));
        assert_eq!(
            key("118@12.4"),
            Ok(MomentKey {
                event,
                at: at(12_400_000)
            })
        );
        assert_eq!(
            key("@0.000001"),
            Ok(MomentKey {
                event: None,
                at: at(1)
            })
        );
        for wrong in [
            "",
            "@",
            "x",
            "1@",
            "1@-2",
            "1@1.2345678",
            "1@+1",
            "@1e3",
            "-1",
            "1@99999999999999999999",
        ] {
            assert!(key(wrong).is_err(), "{wrong}");
        }
    }
}
