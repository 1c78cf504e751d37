//! The rules, and how one is broken.

use serde::Serialize;
use std::fmt;
use ts3100_controller::Time;

/// A rule that holds whatever happens.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rule {
    OneAnswer,
    SpOutsideExchanges,
    Permissions,
    StillWithoutServo,
    AlarmsLatch,
    WholeFiles,
    Agreement,
    StopsReported,
    ShortestDo,
    AxisLimits,
    AxisSpeeds,
    EventsOnce,
    Snapshots,
    SameBytes,
}

impl Rule {
    /// Every rule: its name, what it says, and where the manual says it.
    pub const ALL: [(Rule, &'static str, &'static str, &'static str); 14] = [
        (
            Rule::OneAnswer,
            "one-answer",
            "every request has one answer of its kind, in order and within 10 s, and nothing else comes",
            "CMD-OK, TRN-01, TRN-02",
        ),
        (
            Rule::SpOutsideExchanges,
            "sp-outside-exchanges",
            "an SP never comes inside an open exchange",
            "CMD-SP-07, D7",
        ),
        (
            Rule::Permissions,
            "permissions",
            "what tables 5.3 and 5.4 have invalid is answered NG, and the rest not for that reason",
            "tables 5.3 and 5.4 of both editions",
        ),
        (
            Rule::StillWithoutServo,
            "still-without-servo",
            "no axis moves without servo power but to brake, and there is none in an emergency stop or with the safety switch open",
            "CMD-BR, SF-04, SF-05",
        ),
        (
            Rule::AlarmsLatch,
            "alarms-latch",
            "an active alarm stays until alarms are reset or the power goes off",
            "ALM, RS,ERR",
        ),
        (
            Rule::WholeFiles,
            "whole-files",
            "a file on the drive is one that came whole, and the drive and its disk have the same",
            "CMD-DL, FL-01",
        ),
        (
            Rule::Agreement,
            "agreement",
            "SU, SF and SM of one moment agree with each other and with the panel",
            "SU-12, SF-04 to SF-06, T1",
        ),
        (
            Rule::StopsReported,
            "stops-reported",
            "a stop that no host has asked for has its SP, unless a start comes first",
            "D7, T23",
        ),
        (
            Rule::ShortestDo,
            "shortest-do",
            "a DO shows RUN for at least 200 ms",
            "D7, option do.min_run",
        ),
        (
            Rule::AxisLimits,
            "axis-limits",
            "every axis stays within its limits",
            "the model",
        ),
        (
            Rule::AxisSpeeds,
            "axis-speeds",
            "no axis is faster than the model says",
            "the model",
        ),
        (
            Rule::EventsOnce,
            "events-once",
            "an emergency or safety stop is in one SM of each connection, once",
            "T1",
        ),
        (
            Rule::Snapshots,
            "snapshots",
            "a snapshot that is written and read back is the controller that it was taken of",
            "ours",
        ),
        (
            Rule::SameBytes,
            "same-bytes",
            "the same plan gives the same bytes at the same times",
            "ours",
        ),
    ];

    /// Its row.
    fn row(self) -> &'static (Rule, &'static str, &'static str, &'static str) {
        let index = Rule::ALL.iter().position(|(rule, ..)| *rule == self);
        &Rule::ALL[index.unwrap_or_default()]
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        self.row().1
    }

    /// The rule, as a sentence without its end.
    pub fn sentence(self) -> &'static str {
        self.row().2
    }

    /// Where the manual says it.
    pub fn source(self) -> &'static str {
        self.row().3
    }

    /// The rule of this name.
    pub fn from_name(name: &str) -> Option<Rule> {
        Rule::ALL.iter().find(|row| row.1 == name).map(|row| row.0)
    }
}

/// A broken rule.
#[derive(Debug, Clone, PartialEq)]
pub struct Violation {
    pub rule: Rule,
    /// Number of the robot, from 0.
    pub robot: usize,
    /// The moment, in the time of the robot.
    pub at: Time,
    /// The observation, as a sentence without its end.
    pub seen: String,
}

impl Violation {
    /// Two runs of one plan differ.
    pub(crate) fn of_bytes() -> Violation {
        Violation {
            rule: Rule::SameBytes,
            robot: 0,
            at: Time::ZERO,
            seen: "the second run of the plan put out other bytes".to_owned(),
        }
    }
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (rule, robot) = (self.rule, self.robot + 1);
        write!(
            f,
            "{} at robot {robot} after {}: {}; the rule: {} ({})",
            rule.name(),
            self.at,
            self.seen,
            rule.sentence(),
            rule.source()
        )
    }
}
