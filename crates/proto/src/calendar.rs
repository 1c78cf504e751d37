//! Date and time as numbers, for the error history (EU), the alarm lists (AC, AH) and the version file (VR).
//!
//! Plain arithmetic of the proleptic Gregorian calendar: no time zones, no leap seconds. The caller decides which
//! clock a value comes from; [`crate::status::eu`] and [`crate::status::vr`] write it.

use crate::prelude::*;
use core::fmt;
use core::str::FromStr;

/// Date and time of the proleptic Gregorian calendar. Ordered by time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CalendarTime {
    /// Year, 0 to 65535.
    pub year: u16,
    /// Month, 1 to 12.
    pub month: u8,
    /// Day of the month, from 1.
    pub day: u8,
    /// Hour, 0 to 23.
    pub hour: u8,
    /// Minute, 0 to 59.
    pub minute: u8,
    /// Second, 0 to 59.
    pub second: u8,
}

/// A string that is not a date and time.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected a date and time YYYY-MM-DD HH:MM:SS, found {0:?}")]
pub struct CalendarError(String);

impl fmt::Display for CalendarTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04}-{:02}-{:02} ", self.year, self.month, self.day)?;
        write!(f, "{:02}:{:02}:{:02}", self.hour, self.minute, self.second)
    }
}

impl FromStr for CalendarTime {
    type Err = CalendarError;

    /// As `Display` writes it.
    fn from_str(text: &str) -> Result<CalendarTime, CalendarError> {
        let mut numbers = text.split(['-', ' ', ':']).map(str::parse::<u16>);
        let mut next = || numbers.next()?.ok();
        let mut read = || {
            let year = next()?;
            let mut small = || u8::try_from(next()?).ok();
            Some(CalendarTime {
                year,
                month: small()?,
                day: small()?,
                hour: small()?,
                minute: small()?,
                second: small()?,
            })
        };
        let read = read().filter(|at| at.is_valid() && at.to_string() == text);
        read.ok_or_else(|| CalendarError(text.to_string()))
    }
}

const SECONDS_PER_DAY: i64 = 86_400;
const DAYS_PER_ERA: i64 = 146_097;
const YEARS_PER_ERA: i64 = 400;

impl CalendarTime {
    /// The last second that this type can hold.
    pub const MAX: CalendarTime = CalendarTime {
        year: u16::MAX,
        month: 12,
        day: 31,
        hour: 23,
        minute: 59,
        second: 59,
    };

    /// Whether such a date and time exist.
    pub fn is_valid(self) -> bool {
        let days = days_in_month(self.year, self.month);
        (1..=days).contains(&self.day) && self.hour < 24 && self.minute < 60 && self.second < 60
    }

    /// The time `seconds` later; at most [`CalendarTime::MAX`]. Fields beyond their range carry over
    /// (the 31st of April is the 1st of May).
    #[must_use]
    pub fn plus_seconds(self, seconds: u64) -> CalendarTime {
        let clock = i64::from(self.hour) * 3_600 + i64::from(self.minute) * 60 + i64::from(self.second);
        let start = days_from_civil(i64::from(self.year), i64::from(self.month), i64::from(self.day));
        // i64 seconds reach further than the year 65535, where the result ends anyway.
        let passed = i64::try_from(seconds).unwrap_or(i64::MAX);
        let total = (start * SECONDS_PER_DAY + clock).saturating_add(passed);
        let (year, month, day) = civil_from_days(total.div_euclid(SECONDS_PER_DAY));
        let Ok(year) = u16::try_from(year.max(0)) else {
            return CalendarTime::MAX;
        };
        let rest = total.rem_euclid(SECONDS_PER_DAY);
        CalendarTime {
            year,
            month: field_value(month),
            day: field_value(day),
            hour: field_value(rest / 3_600),
            minute: field_value(rest / 60 % 60),
            second: field_value(rest % 60),
        }
    }
}

/// Days of a month; 0 for a month that does not exist.
fn days_in_month(year: u16, month: u8) -> u8 {
    match month {
        1 | 3 | 5 | 7 | 8 | 10 | 12 => 31,
        4 | 6 | 9 | 11 => 30,
        2 if year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400)) => 29,
        2 => 28,
        _ => 0,
    }
}

/// A field of date or time: always below 60.
fn field_value(value: i64) -> u8 {
    u8::try_from(value).unwrap_or(u8::MAX)
}

/// Days since 0000-03-01. Counting years from March puts the leap day at the end of the year.
fn days_from_civil(year: i64, month: i64, day: i64) -> i64 {
    let months = year * 12 + (month - 1) - 2;
    let (year, month) = (months.div_euclid(12), months.rem_euclid(12));
    let era = year.div_euclid(YEARS_PER_ERA);
    let year_of_era = year.rem_euclid(YEARS_PER_ERA);
    let day_of_year = (153 * month + 2) / 5 + day - 1;
    era * DAYS_PER_ERA + year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year
}

/// Year, month and day of a count of [`days_from_civil`].
fn civil_from_days(days: i64) -> (i64, i64, i64) {
    let era = days.div_euclid(DAYS_PER_ERA);
    let day_of_era = days.rem_euclid(DAYS_PER_ERA);
    let year_of_era = (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month + 2) / 5 + 1;
    let year = era * YEARS_PER_ERA + year_of_era + i64::from(month >= 10);
    (year, if month < 10 { month + 3 } else { month - 9 }, day)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(year: u16, month: u8, day: u8, hour: u8, minute: u8, second: u8) -> CalendarTime {
        CalendarTime {
            year,
            month,
            day,
            hour,
            minute,
            second,
        }
    }

    #[test]
    fn seconds_carry_through_every_field() {
        assert_eq!(
            at(2023, 12, 31, 23, 59, 59).plus_seconds(1),
            at(2024, 1, 1, 0, 0, 0)
        );
        assert_eq!(
            at(2024, 2, 28, 23, 59, 59).plus_seconds(1),
            at(2024, 2, 29, 0, 0, 0)
        );
        assert_eq!(
            at(2100, 2, 28, 23, 59, 59).plus_seconds(1),
            at(2100, 3, 1, 0, 0, 0)
        );
        assert_eq!(
            at(2000, 2, 28, 12, 0, 0).plus_seconds(86_400),
            at(2000, 2, 29, 12, 0, 0)
        );
        assert_eq!(
            at(1970, 1, 1, 0, 0, 0).plus_seconds(1_391_682_600),
            at(2014, 2, 6, 10, 30, 0)
        );
        assert_eq!(at(2014, 2, 6, 1, 2, 3).plus_seconds(0), at(2014, 2, 6, 1, 2, 3));
    }

    #[test]
    fn a_time_is_read_only_as_it_is_written_and_only_if_it_exists() {
        let leap_day = at(2024, 2, 29, 23, 59, 59);
        assert_eq!("2024-02-29 23:59:59".parse(), Ok(leap_day));
        for wrong in [
            "2024-2-29 23:59:59",
            "2024-02-29-23-59-59",
            "2024-02-29 23:59:59:00",
            "2024-02-30 23:59:59",
            "2023-02-29 23:59:59",
            "2024-13-01 23:59:59",
            "2024-02-29 24:00:00",
            "2024-02-29 23:60:00",
            "2024-02-29 23:59:60",
            "2024-02-00 23:59:59",
        ] {
            let error = CalendarError(wrong.to_string());
            assert_eq!(wrong.parse::<CalendarTime>(), Err(error), "{wrong}");
        }
    }

    #[test]
    fn every_day_of_an_era_is_followed_by_the_next() {
        let mut day = at(1899, 12, 31, 5, 6, 7);
        for _ in 0..DAYS_PER_ERA {
            let next = day.plus_seconds(86_400);
            assert!(next.is_valid() && next > day, "{day:?} {next:?}");
            let expected = if day.day < days_in_month(day.year, day.month) {
                CalendarTime {
                    day: day.day + 1,
                    ..day
                }
            } else if day.month < 12 {
                CalendarTime {
                    month: day.month + 1,
                    day: 1,
                    ..day
                }
            } else {
                CalendarTime {
                    year: day.year + 1,
                    month: 1,
                    day: 1,
                    ..day
                }
            };
            assert_eq!(next, expected);
            day = next;
        }
        assert_eq!(day, at(2299, 12, 31, 5, 6, 7));
    }

    #[test]
    fn ends_saturate_and_odd_fields_carry() {
        assert_eq!(CalendarTime::MAX.plus_seconds(1), CalendarTime::MAX);
        assert_eq!(at(2014, 1, 1, 0, 0, 0).plus_seconds(u64::MAX), CalendarTime::MAX);
        assert_eq!(at(2014, 4, 31, 0, 0, 0).plus_seconds(0), at(2014, 5, 1, 0, 0, 0));
        assert_eq!(
            at(2014, 13, 1, 24, 60, 60).plus_seconds(0),
            at(2015, 1, 2, 1, 1, 0)
        );
        assert_eq!(at(0, 0, 0, 0, 0, 0).plus_seconds(0).year, 0);
        assert!(!at(2014, 2, 29, 0, 0, 0).is_valid());
        assert!(!at(2014, 0, 1, 0, 0, 0).is_valid());
    }
}
