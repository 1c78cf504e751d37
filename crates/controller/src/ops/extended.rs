//! SM AC AH IO HI HO PR VL ZS: commands of real host programs beyond the manual (hosts.md 2). Served only with the
//! option `extensions`.

use super::CommandContext;
use super::variables::in_range;
use crate::alarm::Alarm;
use crate::arm::ArmPose;
use crate::io::signals::Signals;
use crate::motion::Pose;
use crate::ops::status::quiet;
use crate::outcome::Outcome;
use crate::prelude::*;
use crate::refusal::Refusal;
use crate::robot::Robot;
use core::time::Duration;
use scol_mini::{Arm, Configuration, Frame, Trans};
use ts3100_proto::command::{PositionQuery, ZsFrame};
use ts3100_proto::name::VariableName;
use ts3100_proto::status::ac::{AlarmRecord, encode_alarms};
use ts3100_proto::status::eu::YearDigits;
use ts3100_proto::status::pr::encode_position;
use ts3100_proto::status::sm::QuickStatus;
use ts3100_proto::status::{AlarmLevel, MasterMode};

/// Span over which VL takes the speed of the arm, from now on: what was before may belong to another motion.
const VELOCITY_SPAN: Duration = Duration::from_millis(1);

impl Robot {
    /// AC: the active alarms.
    pub(crate) fn op_active_alarms(&self) -> Outcome {
        alarm_list(
            self.alarms.active().iter().rev(),
            self.context.config.options.ac_date,
        )
    }

    /// AH: the history of alarms.
    pub(crate) fn op_alarm_history(&self) -> Outcome {
        alarm_list(self.alarms.history(), YearDigits::Two)
    }

    /// SM: the quick status (hosts.md SM). EE, SE, SC and BC are events since the last SM of this connection; ES and SS are
    /// states (T1). An FL that the host does not acknowledge has shown them all the same.
    pub(super) fn op_quick_status(&mut self, context: &mut CommandContext<'_>) -> Outcome {
        let requests = self.panel.state().stop_requests;
        let seen = core::mem::replace(context.seen_requests, requests);
        let [emergency_stop, safety_stop, stop_command, break_command] = requests.since(&seen);
        let status = QuickStatus {
            emergency_stop,
            safety_stop,
            stop_command,
            break_command,
            emergency_switch: self.panel.state().emergency_stop,
            safety_switch: self.panel.state().safety_open,
            servo: self.panel.state().servo,
            master_mode: match self.panel.state().master_mode() {
                MasterMode::Teaching => 0,
                MasterMode::Internal => 1,
                MasterMode::ExtSig => 2,
                MasterMode::ExtRs232c => 4,
                MasterMode::ExtEther => 5,
            },
            run_mode: self.panel.state().run_mode as u8,
            run_status: self.executor.shown_status().code(),
            override_percent: self.panel.state().override_percent,
            alarm_level: self.alarms.worst_level().map_or(0, AlarmLevel::number),
            ended: self.executor.direct_ended(),
            busy: self.executor.has_direct(),
        };
        Outcome::file(status.encode())
    }

    /// HI: inputs as one number, the first line being its lowest bit.
    pub(super) fn op_read_inputs(&mut self, first: u16, count: u8) -> Outcome {
        let lines = lines(first, count);
        if let Some(line) = lines.clone().find(|line| !Signals::exists(*line)) {
            return Outcome::Ng(Refusal::NoSuchLine(line));
        }
        let set = lines.enumerate().filter(|(_, line)| self.signals.input(*line));
        let value: u32 = set.map(|(bit, _)| 1 << bit).sum();
        Outcome::file(format!("{value}\r").into_bytes())
    }

    /// HO: outputs from one number.
    pub(super) fn op_write_outputs(&mut self, first: u16, count: u8, value: u32) -> Outcome {
        let lines = lines(first, count).enumerate();
        let states = lines.map(|(bit, line)| (line, value >> bit & 1 == 1));
        let bus = self.context.config.options.field_bus;
        let set = self.signals.set_user_outputs(states, bus);
        Outcome::from_result(set.map_err(|line| Refusal::NoOutput(Signals::no_output(line, bus))))
    }

    /// PR: the position. The servo follows exactly, so command and feedback are the same.
    pub(super) fn op_position(&mut self, query: PositionQuery) -> Outcome {
        let pose = self
            .arm
            .pose(self.context.now, self.executor.memory().conditions());
        let digits = pose.configuration;
        let config = Configuration { digits }.number_on(self.arm.kind());
        let place = match query {
            PositionQuery::CommandJoint | PositionQuery::FeedbackJoint => {
                return position(pose.joints.into_iter(), None);
            }
            PositionQuery::CommandWorld | PositionQuery::FeedbackWorld => &pose.world,
            PositionQuery::CommandWork | PositionQuery::FeedbackWork => &pose.work,
        };
        position(coordinates(&pose, place).into_iter(), Some(config))
    }

    /// VL: how fast the joints (0) or the world coordinates (1) change, per second.
    pub(super) fn op_velocity(&mut self, which: u8) -> Outcome {
        let conditions = self.executor.memory().conditions();
        let (early, late) = (self.context.now, self.context.now + VELOCITY_SPAN);
        let seconds = late.since(early).as_secs_f64();
        let place = |at| {
            let pose = self.arm.pose(at, conditions);
            match which {
                0 => pose.joints.to_vec(),
                _ => coordinates(&pose, &pose.world),
            }
        };
        let (before, after) = (place(early), place(late));
        let speed = |(before, after): (&f64, &f64)| (after - before) / seconds;
        position(before.iter().zip(&after).map(speed), None)
    }

    /// ZS: the work coordinate or the tool, by name and values.
    pub(super) fn op_set_frame(&mut self, frame: ZsFrame, name: &VariableName, values: &[f64]) -> Outcome {
        if !in_range(values) {
            return Outcome::Ng(Refusal::NotReal);
        }
        let Some(trans) = Trans::from_listed(self.arm.kind(), values) else {
            return Outcome::Ng(Refusal::NoCoordinate(values.len()));
        };
        let set = Frame {
            name: Some(name.name.clone()),
            trans,
        };
        let conditions = self.executor.memory_mut().conditions_mut();
        match frame {
            ZsFrame::Work => conditions.work = set,
            ZsFrame::Tool => conditions.tool = set,
        }
        Outcome::Ok
    }
}

/// FL with values of the arm.
fn position(values: impl Iterator<Item = f64>, config: Option<i64>) -> Outcome {
    Outcome::file(encode_position(&values.map(quiet).collect::<Vec<_>>(), config))
}

/// SCARA: X Y Z C T and an unused one; six-axis: X Y Z A B C U V (hosts.md 2).
fn coordinates(arm: &ArmPose, pose: &Pose) -> Vec<f64> {
    let count = match arm.kind {
        Arm::SixAxis => 8,
        Arm::Scara => 6,
    };
    pose.coords(arm.kind).into_iter().take(count).collect()
}

fn lines(first: u16, count: u8) -> impl Iterator<Item = u16> + Clone {
    (0..u16::from(count)).map(move |place| first.saturating_add(place))
}

/// AC and AH: these alarms, newest first.
fn alarm_list<'a>(alarms: impl Iterator<Item = &'a Alarm>, year: YearDigits) -> Outcome {
    let records = alarms.map(|alarm| AlarmRecord {
        // `002-046` (ste80722 S21, S22).
        number: format!("{:03}-{:03}", alarm.code.level.number(), alarm.code.code),
        message: alarm.message(),
        at: alarm.at,
    });
    Outcome::file(encode_alarms(&records.collect::<Vec<_>>(), year))
}
