//! SU SF EU VR: the status of the controller. The layouts are in `ts3100_proto::status`.

use super::CommandContext;
use crate::alarm::Alarm;
use crate::options::SfTexts;
use crate::outcome::Outcome;
use crate::prelude::*;
use crate::robot::Robot;
use crate::variation::Variation;
use ts3100_proto::calendar::CalendarTime;
use ts3100_proto::file::FlSender;
use ts3100_proto::status::eu::{ErrorEntry, encode_history};
use ts3100_proto::status::io::WORDS;
use ts3100_proto::status::sf::{SfLayout, SystemStatus};
use ts3100_proto::status::su::StatusBody;
use ts3100_proto::status::vr::{VersionRecord, VrLayout, encode_versions};
use ts3100_proto::text::EOF;

/// Speed limit while nothing lowers it, in percent.
const FULL_SPEED: u8 = 100;
/// Date of the software whose behaviour this is: that of the manual.
const SOFTWARE_DATE: CalendarTime = CalendarTime {
    year: 2014,
    month: 2,
    day: 6,
    hour: 10,
    minute: 30,
    second: 0,
};

impl Robot {
    /// The contents of SU.
    pub(crate) fn status_body(&self) -> StatusBody {
        StatusBody {
            master_mode: self.panel.state().master_mode(),
            run_mode: self.panel.state().run_mode,
            file: self.executor.file().to_string(),
            override_percent: self.panel.state().override_percent,
            speed_limit_percent: self.speed_limit(),
            machine_lock: self.panel.state().machine_lock,
            execution: self.executor.shown_status(),
        }
    }

    /// How fast the robot may be now, in percent of its full speed: LOW_SPD lowers it (D5). TEACHING sets a limit
    /// in mm/s instead, which no percentage states.
    pub(crate) fn speed_limit(&self) -> u8 {
        if self.is_slow() {
            self.context.config.options.low_speed
        } else {
            FULL_SPEED
        }
    }

    /// SU; it answers the SU request of SF (SF-21).
    pub(super) fn op_status(&mut self, context: &mut CommandContext<'_>) -> Outcome {
        let body = self.status_body();
        let content = body.encode(self.context.config.options.su_layout);
        *context.last_status = Some(body);
        Outcome::file(content)
    }

    /// SF (SF-01 to SF-46).
    pub(super) fn op_system_status(&mut self, context: &CommandContext<'_>) -> Outcome {
        let content = self.status_frame(context.last_status.as_ref());
        match (self.frame_layout(), self.context.config.options.sf_texts) {
            // The content fills its text: there is no room for an EOF (ste80722 S23).
            (SfLayout::Six, _) => Outcome::File(FlSender::single_text(content, &[])),
            (SfLayout::Eight, SfTexts::One) => Outcome::File(FlSender::single_text(content, &[EOF])),
            (SfLayout::Eight, SfTexts::Several) => Outcome::file(content),
        }
    }

    fn frame_layout(&self) -> SfLayout {
        match self.arm.kind() {
            scol_mini::Arm::SixAxis => SfLayout::Eight,
            scol_mini::Arm::Scara => SfLayout::Six,
        }
    }

    /// The content of SF, without EOF, for a host whose last SU said `asked`.
    pub(crate) fn status_frame(&self, asked: Option<&StatusBody>) -> Vec<u8> {
        self.system_status(asked).encode(self.frame_layout())
    }

    fn system_status(&self, asked: Option<&StatusBody>) -> SystemStatus {
        let body = self.status_body();
        let conditions = self.executor.memory().conditions();
        let pose = self.arm.pose(self.context.now, conditions);
        let frames = self.arm.frames(self.context.now, conditions);
        let (executed, execution_task) = self.executor.executed(self.arm.is_moving());
        let (analysed, analysis_task) = self.executor.analysed();
        let line = |line: u32| u16::try_from(line).unwrap_or(u16::MAX);
        let lines = self.signals.line_words();
        SystemStatus {
            servo: self.panel.state().servo,
            emergency_stop: self.panel.state().emergency_stop,
            execution: body.execution,
            su_request: asked.is_some_and(|asked| *asked != body),
            alarms: self.alarms.status_words().into_iter().take(10).collect(),
            execution_line: line(executed),
            analysis_line: line(analysed),
            execution_task,
            analysis_task,
            feed_hold: self.panel.state().feed_hold,
            guide_coordinate: self.panel.state().jog_mode.coordinate,
            guide_rate: self.panel.state().jog_mode.rate,
            guide_mode: self.panel.state().jog_mode.mode,
            master_mode: body.master_mode.sf_code(),
            power_on_minutes: self.panel.state().power_on_minutes(self.context.now),
            run_minutes: self.panel.state().run_minutes(self.context.now),
            inputs: sf_words(lines.inputs),
            outputs: sf_words(lines.outputs),
            joint: single(pose.joints),
            // SCARA: X Y Z C T (hosts.md SF).
            world: single(pose.world.coords(pose.kind)),
            work: single(pose.work.coords(pose.kind)),
            work_name: self.arm.work_name(self.context.now, &frames),
            tool_name: frames.tool.name.unwrap_or_default(),
            base_name: frames.base.name.unwrap_or_default(),
        }
    }

    /// EU (EU-01 to EU-07).
    pub(super) fn op_error_history(&mut self, context: &CommandContext<'_>) -> Outcome {
        let entry = |alarm: &Alarm| ErrorEntry {
            level: alarm.code.level,
            code: alarm.code.code,
            at: alarm.at,
        };
        let mut entries: Vec<_> = self.alarms.history().map(entry).collect();
        let variation = context.variation.as_deref();
        if variation.is_some_and(Variation::lists_oldest_first) {
            entries.reverse();
        }
        Outcome::file(encode_history(&entries))
    }

    /// VR: the system software; to the letter of the manual also the arm's record (VR-03).
    pub(super) fn op_version(&mut self) -> Outcome {
        let system = self.context.config.controller.name();
        let arm = self.arm.model().name.rsplit('-').next();
        let arm = arm.unwrap_or_default().to_uppercase();
        let names = match self.context.config.options.vr_layout {
            VrLayout::Blanks => Vec::from([system.to_string()]),
            VrLayout::Packed => Vec::from([system.to_string(), arm]),
        };
        let records: Vec<VersionRecord> = names.into_iter().map(version).collect();
        Outcome::file(encode_versions(&records, self.context.config.options.vr_layout))
    }
}

/// A record whose checksum is the sum of the package version's characters and the name's: it tells two
/// versions of the emulator apart, as the real one tells two versions of the software.
fn version(name: String) -> VersionRecord {
    let text = name.bytes().chain(env!("CARGO_PKG_VERSION").bytes());
    let checksum = text.fold(0u16, |sum, byte| sum.rotate_left(3).wrapping_add(u16::from(byte)));
    VersionRecord {
        name,
        date: SOFTWARE_DATE,
        checksum,
    }
}

/// Below this, in mm or degrees, a coordinate is rounding noise of the kinematics and shown as zero.
const NOISE: f64 = 1e-9;

/// A coordinate without that noise, which would be printed as `-0.000`.
pub(super) fn quiet(value: f64) -> f64 {
    if value.abs() < NOISE { 0.0 } else { value }
}

/// SF has the first sixteen words of each direction; reserved ones of the six-axis edition are 0 as nothing drives
/// their lines.
fn sf_words(words: [u16; WORDS]) -> [u16; 16] {
    core::array::from_fn(|index| words.get(index).copied().unwrap_or_default())
}

/// SF carries single floats.
fn single(values: [f64; 8]) -> [f32; 8] {
    values.map(|value| quiet(value) as f32)
}
