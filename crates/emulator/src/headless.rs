//! Runs one SCOL program in this process, without sockets: `ts3100 run`. Peers are simulated on the program's
//! channels, INPUT reads from given records, and PRINT is reported to the caller.
//!
//! It uses the same controller as the daemon, so times, alarms and positions are the same. It is meant for unit
//! tests of robot programs. A host that speaks the protocol needs the daemon or [`crate::embed`]. The output of
//! `ts3100 run` is formatted in `cli::run`.

use crate::named_values::{PositionError, place_arm};
use crate::profile::Profile;
use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use ts3100_controller::findings::rules;
use ts3100_controller::told::StatementDetail;
use ts3100_controller::{
    ArmPose, Bytes, Config, Controller, DriveError, Event, Input, Output, PanelAction, Port, SelectError,
    StatementCoverage, Time,
};
use ts3100_driver::clock::TimeMode;
use ts3100_driver::seat::{ActionSource, Effects, Seat, Side};
use ts3100_proto::status::ExecutionStatus;
use ts3100_recording::program_test::TestPosition;
use ts3100_recording::scenario::{Play, Scenario, ScenarioOutcome};

/// Name of the teach pendant as a channel.
pub const PENDANT: &str = "TP";
/// The channels that get a simulated peer.
const CHANNELS: [Port; 3] = [Port::Com1, Port::Ip1, Port::Ip2];

/// A program to run, and under which conditions.
#[derive(Debug, Clone)]
pub struct RunRequest {
    /// Options, model and taught points of the controller.
    pub config: Config,
    /// Name of the file on the drive.
    pub name: String,
    /// Content of the file, with the line ends of the drive.
    pub source: Vec<u8>,
    /// Records for INPUT by channel (`TP`, `COM1`, `IP1`, `IP2`), without their CR. One is sent whenever an INPUT
    /// of the channel waits for more.
    pub records: BTreeMap<String, VecDeque<Vec<u8>>>,
    /// Input lines that are on from the beginning.
    pub lines_on: Vec<u16>,
    /// Where the arm is at START; without it in its ready posture.
    pub position: Option<TestPosition>,
    /// What happens to the robot from START on, and what is expected of the program.
    pub scenario: Option<Scenario>,
    /// A call such as `PLACE(2, 30.5)`, which is run instead of the main program.
    pub call: Option<String>,
    /// Report every statement as [`RunEvent::Statement`].
    pub trace: bool,
    /// Count the statements and their time in [`RunReport::profile`].
    pub profile: bool,
    /// Record the executed lines in [`RunReport::executed`].
    pub record_lines: bool,
    /// Time mode; `stepped` is refused.
    pub time: TimeMode,
    /// Longest run, in virtual time.
    pub max_time: Duration,
}

/// Why the program could not be started.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The RAM drive does not take the file.
    #[error(transparent)]
    Drive(#[from] DriveError),
    /// The program does not compile.
    #[error(transparent)]
    Select(#[from] SelectError),
    /// The controller refused to start it, and says why: `cannot start the program: servo power is off`.
    #[error("{0}")]
    Start(String),
    /// The arm cannot be placed where it should be at START.
    #[error(transparent)]
    Position(#[from] PositionError),
    /// Stepped time: no one would move the clock, so the program would never end.
    #[error("expected a time that passes (auto, real or xN), found {0}")]
    Time(TimeMode),
    /// The flag of [`run_until`] was set.
    #[error("the run was interrupted")]
    Interrupted,
}

/// Event of a program while it runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunEvent<'a> {
    /// PRINT sent bytes to a channel.
    Printed {
        /// `TP`, `COM1`, `IP1` or `IP2`.
        channel: &'static str,
        /// The bytes as sent, with their CR.
        bytes: &'a [u8],
    },
    /// A statement begins.
    Statement {
        /// Line of the file, from 1.
        line: u32,
        /// ID of its task, 1 for the main program.
        task: u16,
        /// What it did.
        detail: &'a StatementDetail,
    },
    /// An action of the scenario had no effect.
    Refused {
        /// Line of the action in the file of the scenario, from 1; 0 without a file.
        line: usize,
        /// The action and why: `cannot turn the servo on: the emergency stop is pressed`.
        reason: &'a str,
    },
}

/// End of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RunEnd {
    /// END of the main program.
    End,
    /// STOP, or another stop that no alarm caused.
    Stopped {
        /// Line at which the program stopped.
        line: u32,
    },
    /// An INPUT waits and the records of its channel are used up.
    OutOfInput {
        /// `TP`, `COM1`, `IP1` or `IP2`.
        channel: &'static str,
        /// Line of the INPUT.
        line: u32,
    },
    /// An INPUT waits on a channel that was given no records at all.
    NoInput {
        /// `TP`, `COM1`, `IP1` or `IP2`.
        channel: &'static str,
        /// Line of the INPUT.
        line: u32,
    },
    /// The power was turned off, and nothing planned turns it on.
    PowerOff,
    /// An alarm stopped the program.
    Alarm {
        /// Number of the alarm, for example `2-046`.
        number: String,
        /// Text of the alarm.
        text: String,
    },
    /// It waits for a condition that can no longer become true.
    Blocked {
        /// Line of the statement that waits.
        line: u32,
    },
    /// [`RunRequest::max_time`] has expired.
    TimeUp {
        /// Line at which the program was.
        line: u32,
    },
}

impl RunEnd {
    /// A word for programs, which is public: `end`, `alarm`.
    pub fn word(&self) -> &'static str {
        match self {
            RunEnd::End => "end",
            RunEnd::Stopped { .. } => "stopped",
            RunEnd::OutOfInput { .. } => "out-of-input",
            RunEnd::NoInput { .. } => "no-input",
            RunEnd::PowerOff => "power-off",
            RunEnd::Alarm { .. } => "alarm",
            RunEnd::Blocked { .. } => "stuck",
            RunEnd::TimeUp { .. } => "time-up",
        }
    }

    /// A sentence for people, to which a caller adds the remedy.
    pub fn sentence(&self) -> String {
        match self {
            RunEnd::End => "ended".to_owned(),
            RunEnd::Stopped { line } => format!("stopped, line {line} is next"),
            RunEnd::OutOfInput { channel, line } => {
                format!("INPUT at line {line} waits: all records of {channel} are used")
            }
            RunEnd::NoInput { channel, line } => format!("INPUT {channel} at line {line} waits"),
            RunEnd::PowerOff => "stopped: the power was turned off".to_owned(),
            RunEnd::Alarm { number, text } => format!("alarm {number} {text}"),
            RunEnd::Blocked { line } => {
                format!("line {line} waits for a condition that can no longer become true")
            }
            RunEnd::TimeUp { line } => format!("stopped at line {line}"),
        }
    }
}

/// The result of a run.
#[derive(Debug)]
pub struct RunReport {
    pub end: RunEnd,
    /// Virtual time from start to end.
    pub duration: Duration,
    /// Pose of the arm at the end.
    pub arm: ArmPose,
    /// User outputs that are on.
    pub outputs: Vec<u16>,
    /// Number of records that no INPUT read, by channel.
    pub unused: BTreeMap<String, usize>,
    /// The lines executed, if they were to be recorded.
    pub executed: StatementCoverage,
    /// The outcome of the scenario, if there is one.
    pub scenario: Option<ScenarioOutcome>,
    /// Where the time went, if it was to be counted.
    pub profile: Option<Profile>,
    /// The controller at the end, to ask it for more.
    pub controller: Box<Controller>,
}

/// Runs a program to its end and reports to `listen` what it does, with the virtual time since the start.
///
/// # Errors
/// [`RunError`]: it did not start.
pub fn run(job: RunRequest, listen: &mut dyn FnMut(Duration, RunEvent<'_>)) -> Result<RunReport, RunError> {
    run_until(&AtomicBool::new(false), job, listen)
}

/// As [`run`], until the flag is set. Who sets it unparks the thread, which may be waiting for wall-clock time.
///
/// # Errors
/// [`RunError`]: it did not start, or the flag was set.
pub fn run_until(
    interrupted: &AtomicBool,
    job: RunRequest,
    listen: &mut dyn FnMut(Duration, RunEvent<'_>),
) -> Result<RunReport, RunError> {
    let scale = match job.time {
        TimeMode::Auto => None,
        TimeMode::Real => Some(1.0),
        TimeMode::Scaled(factor) => Some(factor),
        TimeMode::Stepped => return Err(RunError::Time(job.time)),
    };
    let mut run = HeadlessRun::new(job)?;
    let wall = Instant::now();
    let ending = loop {
        let due = run.next_step();
        if let (Some(scale), Some(due)) = (scale, due) {
            let due = wall_time(due, scale);
            while let Some(left) = due.checked_sub(wall.elapsed()).filter(|left| !left.is_zero()) {
                if interrupted.load(Ordering::Relaxed) {
                    break;
                }
                std::thread::park_timeout(left);
            }
        }
        if interrupted.load(Ordering::Relaxed) {
            return Err(RunError::Interrupted);
        }
        let ending = run.step();
        for (at, event) in run.take_events() {
            listen(at, event.shown());
        }
        if let Some(ending) = ending? {
            break ending;
        }
    };
    Ok(run.report(ending))
}

/// Wall-clock time that virtual time takes at this scale, at most what a duration holds.
fn wall_time(passed: Duration, scale: f64) -> Duration {
    Duration::try_from_secs_f64(passed.as_secs_f64() / scale).unwrap_or(Duration::MAX)
}

/// What a program has done, as [`RunEvent`] tells it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum KeptEvent {
    Printed {
        channel: &'static str,
        bytes: Bytes,
    },
    Statement {
        line: u32,
        task: u16,
        detail: Box<StatementDetail>,
    },
    Refused {
        line: usize,
        reason: String,
    },
}

impl KeptEvent {
    pub(crate) fn shown(&self) -> RunEvent<'_> {
        match self {
            KeptEvent::Printed { channel, bytes } => RunEvent::Printed { channel, bytes },
            KeptEvent::Statement { line, task, detail } => RunEvent::Statement {
                line: *line,
                task: *task,
                detail,
            },
            KeptEvent::Refused { line, reason } => RunEvent::Refused { line: *line, reason },
        }
    }
}

/// Result of a run, collected from its outputs.
#[derive(Clone)]
struct Outcome {
    /// Since they were taken last, with the time since the start.
    events: Vec<(Duration, KeptEvent)>,
    play: Option<Play>,
    started_at: Time,
    /// Statements are reported.
    trace: bool,
    alarm: Option<(String, String)>,
    /// The program runs.
    runs: bool,
    /// It is at its first step, and went there from running: by END. A reset does so from a stop.
    ended: bool,
    /// START is being pressed.
    starting: bool,
    /// Why START had no effect.
    refusal: Option<String>,
    executed: StatementCoverage,
    profile: Option<Profile>,
}

impl Outcome {
    /// An action of the scenario, the one under way, had no effect.
    fn add_refused(&mut self, at: Duration, reason: String) {
        let line = self.play.as_ref().and_then(Play::acting_line).unwrap_or_default();
        self.events.push((at, KeptEvent::Refused { line, reason }));
    }
}

impl Effects for Outcome {
    fn perform(&mut self, _at: Time, output: Output, controller: &Controller) -> Vec<Input> {
        self.executed.record(&output);
        if let (Some(profile), Output::Event(Event::Statement { line, task, .. })) =
            (&mut self.profile, &output)
        {
            profile.count(*task, *line);
        }
        let at = controller.now().since(self.started_at);
        let mut add = |event| self.events.push((at, event));
        match output {
            Output::Send { port, bytes } if CHANNELS.contains(&port) => {
                let channel = port.name();
                add(KeptEvent::Printed { channel, bytes });
            }
            Output::Pendant(text) => add(KeptEvent::Printed {
                channel: PENDANT,
                bytes: text.into(),
            }),
            Output::Event(Event::Statement {
                line,
                task,
                detail: Some(detail),
                ..
            }) if self.trace => {
                add(KeptEvent::Statement { line, task, detail });
            }
            Output::Event(Event::Alarm { number, text }) => self.alarm = Some((number, text)),
            Output::Event(Event::Status { status, .. }) => {
                let is_reset = status == ExecutionStatus::Reset;
                self.ended = is_reset && (self.ended || self.runs);
                self.runs = status == ExecutionStatus::Running;
                // What stopped the program before is over when it runs again.
                if self.runs {
                    self.alarm = None;
                }
            }
            Output::Event(Event::Finding(finding)) if *finding.rule == rules::PANEL_REFUSED => {
                let reason = finding.message.to_string();
                if self.starting {
                    self.refusal = Some(reason);
                } else {
                    self.add_refused(at, reason);
                }
            }
            Output::Event(Event::ActionRefused(error)) => {
                self.add_refused(at, error.to_string());
            }
            Output::Event(_)
            | Output::Send { .. }
            | Output::Persist { .. }
            | Output::Stored { .. }
            | Output::Erased { .. }
            | Output::PowerCycled
            | Output::Disconnect { .. }
            | Output::Stall { .. }
            | Output::PowerOff => {}
        }
        Vec::new()
    }
}

/// A run on its way: each step is one thing that is due.
pub(crate) struct HeadlessRun {
    seat: Seat,
    records: BTreeMap<String, VecDeque<Vec<u8>>>,
    /// Channels for which `--input` was given, also with an empty file.
    channels_with_records: Vec<String>,
    outcome: Outcome,
    /// START has been pressed.
    started: bool,
    /// Where the arm is placed before that.
    position: Option<TestPosition>,
    /// Comes with the next step: something was changed from outside.
    woken_by: Option<Input>,
    /// Longest run, in virtual time.
    limit: Duration,
}

impl Clone for HeadlessRun {
    /// A run of its own from the same moment on: its scenario too.
    fn clone(&self) -> HeadlessRun {
        let mut seat = self.seat.clone();
        let play = self.outcome.play.as_ref().map(|play| play.fork(&mut seat));
        HeadlessRun {
            seat,
            records: self.records.clone(),
            channels_with_records: self.channels_with_records.clone(),
            outcome: Outcome {
                play,
                ..self.outcome.clone()
            },
            started: self.started,
            position: self.position.clone(),
            woken_by: self.woken_by.clone(),
            limit: self.limit,
        }
    }
}

impl HeadlessRun {
    /// The program before START.
    ///
    /// # Errors
    /// [`RunError`]: the file is not taken, or does not compile.
    pub(crate) fn new(job: RunRequest) -> Result<HeadlessRun, RunError> {
        let mut config = job.config;
        // There is no serial line here, so a record arrives without the delay of its baud rate.
        config.options.serial_pacing = false;
        let mut run = HeadlessRun {
            seat: Seat::new(Controller::new(config, Vec::new())?),
            channels_with_records: job.records.keys().cloned().collect(),
            records: job.records,
            outcome: Outcome {
                events: Vec::new(),
                play: job.scenario.map(Play::new),
                started_at: Time::ZERO,
                trace: job.trace,
                alarm: None,
                runs: false,
                ended: false,
                starting: false,
                refusal: None,
                executed: StatementCoverage::default(),
                profile: job.profile.then(Profile::default),
            },
            started: false,
            position: job.position,
            woken_by: None,
            limit: job.max_time,
        };
        run.prepare(&job.name, job.call.as_deref(), &job.source, &job.lines_on)?;
        run.seat
            .await_statements(job.trace || job.record_lines || job.profile);
        run.seat.controller.tell_effects(job.trace);
        run.outcome.started_at = run.seat.controller.now();
        Ok(run)
    }

    /// When the next step is due, since the start; `None` if it can be taken at once.
    fn next_step(&self) -> Option<Duration> {
        let waits = self.started && self.end().is_none() && !self.has_record();
        let due = self.seat.deadline().filter(|_| waits)?;
        Some(due.since(self.outcome.started_at).min(self.limit))
    }

    /// Presses START; afterwards each call does the next thing that is due, or gives a record to the INPUT that waits for
    /// one. Returns how the run has ended, if it has.
    ///
    /// # Errors
    /// [`RunError::Start`]: the program did not start. [`RunError::Position`]: the arm cannot be where it should be.
    pub(crate) fn step(&mut self) -> Result<Option<RunEnd>, RunError> {
        let started_at = self.outcome.started_at;
        if !self.started {
            self.started = true;
            if let Some(play) = &self.outcome.play {
                play.start(&mut self.seat);
                // What is planned for the start comes before START.
                self.feed(started_at, Input::Tick);
            }
            if let Some(place) = self.position.take() {
                place_arm(&mut self.seat.controller, &place)?;
            }
            self.outcome.starting = true;
            self.feed(started_at, Input::by_hand(PanelAction::Start));
            self.outcome.starting = false;
            if let Some(reason) = self.outcome.refusal.take() {
                return Err(RunError::Start(reason));
            }
            return Ok(self.end());
        }
        if let Some(input) = self.woken_by.take() {
            self.feed(self.seat.controller.now(), input);
            return Ok(self.end());
        }
        if let Some(ending) = self.end() {
            return Ok(Some(ending));
        }
        if self.give_record() {
            return Ok(self.end());
        }
        let Some(deadline) = self.seat.deadline() else {
            return Ok(Some(self.end_of_blocked()));
        };
        let limit = started_at + self.limit;
        if deadline > limit {
            self.feed(limit, Input::Tick);
            let line = self.seat.controller.line();
            return Ok(Some(RunEnd::TimeUp { line }));
        }
        self.feed(deadline, Input::Tick);
        Ok(self.end())
    }

    /// Virtual time since START.
    pub(crate) fn passed(&self) -> Duration {
        self.seat.controller.now().since(self.outcome.started_at)
    }

    /// The controller as it is now.
    pub(crate) fn controller(&self) -> &Controller {
        &self.seat.controller
    }

    /// The controller, to inspect or assign; its time passes by [`HeadlessRun::step`] alone.
    pub(crate) fn controller_mut(&mut self) -> &mut Controller {
        &mut self.seat.controller
    }

    /// The run may take this much longer.
    pub(crate) fn extend(&mut self, by: Duration) {
        self.limit = self.limit.saturating_add(by);
    }

    /// Takes this with the next step, at the present time.
    pub(crate) fn wake(&mut self, input: Input) {
        self.woken_by = Some(input);
    }

    /// Whether START continues it.
    pub(crate) fn waits_for_start(&self) -> bool {
        self.started && matches!(self.end(), Some(RunEnd::Stopped { .. } | RunEnd::Alarm { .. }))
    }

    /// What has happened since the last call.
    pub(crate) fn take_events(&mut self) -> Vec<(Duration, KeptEvent)> {
        std::mem::take(&mut self.outcome.events)
    }

    /// Does everything before START: file, peers, input lines, servo power.
    fn prepare(
        &mut self,
        name: &str,
        call: Option<&str>,
        source: &[u8],
        lines_on: &[u16],
    ) -> Result<(), RunError> {
        self.seat.controller.put_file(name, source)?;
        match call {
            Some(call) => self.seat.controller.select_call(Time::ZERO, name, call)?,
            None => self.seat.controller.select(Time::ZERO, name)?,
        }
        for port in CHANNELS {
            let peer = "headless".to_owned();
            self.feed(Time::ZERO, Input::Connected { port, peer });
        }
        let switches = lines_on
            .iter()
            .map(|&line| PanelAction::InputLine { line, on: true });
        for panel in switches.chain([PanelAction::Servo(true)]) {
            self.feed(Time::ZERO, Input::by_hand(panel));
        }
        // Alarms and refusals of the preparation are not part of the run.
        (self.outcome.alarm, self.outcome.refusal) = (None, None);
        Ok(())
    }

    fn feed(&mut self, now: Time, input: Input) {
        if let Some(profile) = &mut self.outcome.profile {
            profile.pass(&self.seat.controller, now);
        }
        let _refusal_is_an_event = self.seat.feed(now, input, Side::Host, &mut self.outcome);
    }

    /// End of the run; `None` while the program runs, and while what is planned may continue it after a stop.
    fn end(&self) -> Option<RunEnd> {
        if self.seat.controller.program_runs() {
            return None;
        }
        let planned = self.outcome.play.as_ref().and_then(ActionSource::deadline);
        if planned.is_some() && !self.outcome.ended {
            return None;
        }
        Some(match self.outcome.alarm.clone() {
            Some((number, text)) => RunEnd::Alarm { number, text },
            None if self.outcome.ended => RunEnd::End,
            None if !self.seat.controller.state().powered => RunEnd::PowerOff,
            None => RunEnd::Stopped {
                line: self.seat.controller.line(),
            },
        })
    }

    /// Whether there is a record for the INPUT that waits.
    fn has_record(&self) -> bool {
        let channel = self.seat.controller.waits_for();
        let name = channel.map(|channel| Port::from_channel(channel).map_or(PENDANT, Port::name));
        let records = name.and_then(|name| self.records.get(name));
        records.is_some_and(|records| !records.is_empty())
    }

    /// Sends a record to the INPUT that waits; false if none waits or there is none for it.
    fn give_record(&mut self) -> bool {
        let Some(channel) = self.seat.controller.waits_for() else {
            return false;
        };
        let port = Port::from_channel(channel);
        let name = port.map_or(PENDANT, Port::name);
        let Some(mut record) = self.records.get_mut(name).and_then(VecDeque::pop_front) else {
            return false;
        };
        record.push(b'\r');
        let input = match port {
            Some(port) => Input::received(port, record),
            None => Input::by_hand(PanelAction::Keys(String::from_utf8_lossy(&record).into_owned())),
        };
        self.feed(self.seat.controller.now(), input);
        true
    }

    /// The end of a program that waits while no timer is pending.
    fn end_of_blocked(&self) -> RunEnd {
        let line = self.seat.controller.line();
        let Some(channel) = self.seat.controller.waits_for() else {
            return RunEnd::Blocked { line };
        };
        let channel = Port::from_channel(channel).map_or(PENDANT, Port::name);
        if self.channels_with_records.iter().any(|known| known == channel) {
            RunEnd::OutOfInput { channel, line }
        } else {
            RunEnd::NoInput { channel, line }
        }
    }

    /// The expectations of the scenario that are not met so far.
    pub(crate) fn unmet(&self) -> Vec<String> {
        let play = self.outcome.play.as_ref();
        let outcome = play.map(|play| play.outcome(self.seat.controller.now()));
        outcome.map_or_else(Vec::new, |outcome| outcome.failures().collect())
    }

    /// The report of a run that has ended.
    pub(crate) fn report(self, ending: RunEnd) -> RunReport {
        let unused = self.records.into_iter().map(|(name, rest)| (name, rest.len()));
        RunReport {
            end: ending,
            duration: self.seat.controller.now().since(self.outcome.started_at),
            arm: self.seat.controller.arm_pose(),
            outputs: self.seat.controller.outputs_on(),
            unused: unused.filter(|(_, rest)| *rest > 0).collect(),
            scenario: self
                .outcome
                .play
                .map(|play| play.outcome(self.seat.controller.now())),
            executed: self.outcome.executed,
            profile: self.outcome.profile,
            controller: Box::new(self.seat.controller),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slowest_time_takes_as_long_as_a_duration_can_be() {
        let second = Duration::from_secs(1);
        for (scale, expected) in [
            (10.0, second / 10),
            (0.5, second * 2),
            (1e-300, Duration::MAX),
            (f64::from_bits(1), Duration::MAX),
        ] {
            assert_eq!(wall_time(second, scale), expected, "{scale}");
            assert_eq!(wall_time(Duration::ZERO, scale), Duration::ZERO, "{scale}");
        }
    }
}
