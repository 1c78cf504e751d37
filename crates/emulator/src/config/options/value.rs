//! Reading and writing the values of the named options, by the type of their field.

use super::Values;
use std::fmt::Display;
use std::str::FromStr;
use std::time::Duration;
use ts3100_controller::Options;
use ts3100_controller::time::{parse_duration, parse_duration_in};
use ts3100_driver::tcp::LinkOptions;
use ts3100_proto::parameter::OpenMode;

/// The field of an option.
pub(super) type Place<T> = for<'a> fn(&'a mut Options, &'a mut LinkOptions) -> &'a mut T;

/// Access to the field of an option: sets it and shows it.
pub(super) trait Setting: Sync {
    /// The values it accepts.
    fn values(&self) -> Values;
    /// Sets it; `None` if the value does not fit.
    fn set(&self, options: &mut Options, links: &mut LinkOptions, text: &str) -> Option<()>;
    /// The value it has; empty if it depends on the arm.
    fn text(&self, options: &mut Options, links: &mut LinkOptions) -> String;
}

/// A field whose type says which values there are.
pub(super) struct Field<T: 'static>(pub Place<T>);

/// A type of field with values of its own.
pub(super) trait Value: Sized {
    fn values() -> Values;
    fn parse(text: &str) -> Option<Self>;
    fn text(&self) -> String;
}

impl<T: Value> Setting for Field<T> {
    fn values(&self) -> Values {
        T::values()
    }

    fn set(&self, options: &mut Options, links: &mut LinkOptions, text: &str) -> Option<()> {
        *self.0(options, links) = T::parse(text)?;
        Some(())
    }

    fn text(&self, options: &mut Options, links: &mut LinkOptions) -> String {
        self.0(options, links).text()
    }
}

impl Value for bool {
    fn values() -> Values {
        Values::Flag
    }

    fn parse(text: &str) -> Option<bool> {
        text.parse().ok()
    }

    fn text(&self) -> String {
        self.to_string()
    }
}

/// The parts of a list.
fn parts(text: &str) -> impl Iterator<Item = &str> {
    text.split([' ', ',']).filter(|part| !part.is_empty())
}

/// Open mode of each of IP0 to IP3.
impl Value for [OpenMode; 4] {
    fn values() -> Values {
        Values::OpenModes
    }

    fn parse(text: &str) -> Option<[OpenMode; 4]> {
        let modes = parts(text).map(|digit| match digit {
            "0" => Some(OpenMode::NotUsed),
            "1" => Some(OpenMode::Server),
            "2" => Some(OpenMode::Client),
            _ => None,
        });
        modes.collect::<Option<Vec<OpenMode>>>()?.try_into().ok()
    }

    fn text(&self) -> String {
        self.map(|mode| mode.number().to_string()).join(" ")
    }
}

/// Five durations in rising order; a single one is used for all, and a number without a unit is milliseconds.
impl Value for [Duration; 5] {
    fn values() -> Values {
        Values::Quartiles
    }

    fn parse(text: &str) -> Option<[Duration; 5]> {
        const MOST: Duration = Duration::from_secs(60);
        let mut words: Vec<String> = Vec::new();
        for part in parts(text) {
            match words.last_mut() {
                // A unit belongs to the number before it.
                Some(number) if part.starts_with(char::is_alphabetic) => number.push_str(part),
                _ => words.push(part.to_owned()),
            }
        }
        let words = words.iter();
        let times = words.map(|word| parse_duration_in("ms", word).ok().filter(|time| *time <= MOST));
        let times = times.collect::<Option<Vec<Duration>>>()?;
        match times.as_slice() {
            [one] => Some([*one; 5]),
            five if five.is_sorted() => five.try_into().ok(),
            _ => None,
        }
    }

    fn text(&self) -> String {
        let mut times = self.map(|time| (time.as_secs_f64() * 1e3).to_string()).to_vec();
        times.dedup();
        times.join(" ")
    }
}

/// It depends on the arm unless it is set.
impl<T: Value> Value for Option<T> {
    fn values() -> Values {
        T::values()
    }

    fn parse(text: &str) -> Option<Option<T>> {
        T::parse(text).map(Some)
    }

    fn text(&self) -> String {
        self.as_ref().map(T::text).unwrap_or_default()
    }
}

/// A duration from the shortest to an hour, and a usual one: `200ms`, `2s` or `0.5s`.
pub(super) struct Period(pub &'static str, pub &'static str, pub Place<Duration>);

impl Setting for Period {
    fn values(&self) -> Values {
        let Period(least, example, _) = *self;
        Values::Duration { least, example }
    }

    fn set(&self, options: &mut Options, links: &mut LinkOptions, text: &str) -> Option<()> {
        const HOUR: Duration = Duration::from_secs(3_600);
        let range = parse_duration(self.0).ok()?..=HOUR;
        *self.2(options, links) = parse_duration(text).ok().filter(|time| range.contains(time))?;
        Some(())
    }

    fn text(&self, options: &mut Options, links: &mut LinkOptions) -> String {
        match self.2(options, links).as_micros() {
            micros if micros % 1_000_000 == 0 => format!("{}s", micros / 1_000_000),
            micros if micros % 1_000 == 0 => format!("{}ms", micros / 1_000),
            micros => format!("{micros}us"),
        }
    }
}

/// A whole number: what it counts, its smallest and its largest value.
pub(super) struct Whole<T: 'static>(pub &'static str, pub T, pub T, pub Place<T>);

impl<T: Copy + Display + FromStr + Into<usize> + PartialOrd + Sync> Setting for Whole<T> {
    fn values(&self) -> Values {
        let Whole(unit, min, max, _) = *self;
        let (min, max) = (min.into(), max.into());
        Values::Whole { unit, min, max }
    }

    fn set(&self, options: &mut Options, links: &mut LinkOptions, text: &str) -> Option<()> {
        let number = text.parse().ok();
        *self.3(options, links) = number.filter(|number| (self.1..=self.2).contains(number))?;
        Some(())
    }

    fn text(&self, options: &mut Options, links: &mut LinkOptions) -> String {
        self.3(options, links).to_string()
    }
}

/// A number that depends on the arm unless it is set: its smallest and its largest value.
pub(super) struct Real(pub f32, pub f32, pub Place<Option<f32>>);

impl Setting for Real {
    fn values(&self) -> Values {
        let Real(min, max, _) = *self;
        Values::Number { min, max }
    }

    fn set(&self, options: &mut Options, links: &mut LinkOptions, text: &str) -> Option<()> {
        let number = text.parse().ok();
        let number: f32 = number.filter(|number| (self.0..=self.1).contains(number))?;
        *self.2(options, links) = Some(number);
        Some(())
    }

    fn text(&self, options: &mut Options, links: &mut LinkOptions) -> String {
        let number = *self.2(options, links);
        number.map(|number| number.to_string()).unwrap_or_default()
    }
}
