//! Serves the requests of statements to the robot: motion, PRINT, INPUT, DELAY, outputs, hands, and the statements that
//! change a motion under way (BREAK, PAUSE, RESUME).
//!
//! `scheduler` runs the program until it requests something, calls `serve()`, and waits until the request is done.

use crate::alarm::{self, AlarmCode};
use crate::arm::SpeedLimits;
use crate::executor::step::Step;
use crate::executor::{Task, TaskState};
use crate::finding::rules;
use crate::io::channel::Datum;
use crate::io::line_names::HANDS;
use crate::io::signals::Signals;
use crate::limits::{COARSE_LEAD, LONGEST_DELAY, TEACHING_SPEED};
use crate::motion::MotionError;
use crate::options::{NoPeer, OutOfReach};
use crate::output::Output;
use crate::panel::KeySwitch;
use crate::port::Port;
use crate::port_facts::PortFacts;
use crate::prelude::*;
use crate::robot::Robot;
use crate::time::duration_from_seconds;
use bytes::Bytes;
use core::time::Duration;
use scol_mini::{Accuracy, Answer, Channel, FULL, MAX_PRINT, Motion, Number, Payload, Request};

impl Robot {
    pub(crate) fn serve(&mut self, ports: &dyn PortFacts, task: &mut Task, request: Request) -> Step {
        match request {
            Request::Move(motion) => return self.start_motion(task, &motion),
            Request::Print { channel, data, cut } => return self.print(ports, task, channel, &data, cut),
            Request::Input { channel, expected } => return self.input(task, channel, expected),
            // DELAY dwells where the motion before it has led, or where PAUSE holds the arm.
            Request::Delay { .. } if self.moves(task) && !self.executor.is_paused() => {
                return task.wait(TaskState::Resting);
            }
            Request::Delay { seconds } => {
                let until = self.context.now + duration_from_seconds(seconds, LONGEST_DELAY);
                task.enter(TaskState::Delaying { until });
                return Step::Begun;
            }
            Request::Hand { hand, open, at_once } => return self.work_hand(task, hand, open, at_once),
            Request::Pulse { line, seconds } => return self.pulse_output(task, line, seconds),
            Request::Break => return self.break_motion(task),
            Request::Task { program } => return self.executor.start_task(task, program, self.context.now),
            Request::Switch => return self.executor.switch_task(task),
            Request::Restore { names } => return self.executor.done(task).then(Step::Restore { names }),
            Request::Kill { task: victim } => return self.executor.kill_task(task, victim),
            Request::Stop => return self.executor.done(task).then(Step::Stopped),
            Request::BufferReset { channel } => {
                if let Some(buffer) = self.channels.input(channel) {
                    buffer.clear();
                }
            }
            Request::Outputs(switches) => {
                let bus = self.context.config.options.field_bus;
                if let Err(other) = self.signals.set_user_outputs(switches.iter().copied(), bus) {
                    return task.give_up(alarm::OUT_OF_RANGE, Signals::no_output(other, bus));
                }
            }
            Request::Pause => {
                // The motion slows along its path; one that has not begun does not begin.
                if self.executor.program_runs() && self.executor.pause() {
                    self.arm.hold(self.context.now);
                }
            }
            Request::Resume => self.end_pause(),
            Request::OverFull { percent } => self.report_over_full(task, Some(percent)),
            Request::SetTimer { seconds } => self.executor.set_timer(seconds, self.context.now),
        }
        self.executor.done(task)
    }

    /// How fast the arm may move now.
    pub(crate) fn pace(&self) -> SpeedLimits {
        let state = self.panel.state();
        SpeedLimits {
            override_percent: state.override_percent.min(self.speed_limit()),
            tool_speed_cap: (state.key == KeySwitch::Teaching).then_some(TEACHING_SPEED),
        }
    }

    fn start_motion(&mut self, task: &mut Task, motion: &Motion) -> Step {
        if !self.executor.takes_arm(task) {
            let reason = format!("task {} has to move it", task.id());
            return task.give_up(alarm::ARM_TAKEN, reason);
        }
        if self.is_held() {
            return task.wait(TaskState::Holding);
        }
        let level = task
            .keeps_height
            .then(|| self.arm.at_present_height(self.context.now, motion));
        let motion = level.as_ref().unwrap_or(motion);
        let heaviest = self.arm.model().max_payload;
        if let Some((_, Payload { mass, .. })) = &motion.conditions.payload
            && *mass > heaviest
        {
            let reason = format!("the load is {mass} kg; the arm carries at most {heaviest} kg");
            return task.alarm(alarm::OVERLOAD, reason);
        }
        let lead = match motion.conditions.accuracy {
            Accuracy::Coarse => COARSE_LEAD,
            Accuracy::Fine => Duration::ZERO,
        };
        // With PASS the statement is over early, so that the next MOVE can be put after the motion in time.
        let reads_ahead = motion.conditions.passing && task.machine().motion_ahead().is_some();
        let passing = reads_ahead || motion.conditions.nowait;
        let moving = self.arm.is_moving();
        let begun = if !moving {
            let locked = self.panel.state().machine_lock;
            let started = self.arm.start(self.context.now, motion, self.pace(), locked);
            started.map(|()| true)
        } else if self.executor.pass() > 0.0 {
            self.arm
                .append(self.context.now, motion, self.executor.pass(), self.pace())
        } else {
            Ok(false)
        };
        match begun {
            Ok(false) => task.wait(TaskState::Resting),
            Ok(true) => {
                self.report_over_full(task, motion.over_full);
                self.executor.set_pass(match motion.conditions.passing {
                    true => motion.conditions.pass,
                    false => 0.0,
                });
                if moving {
                    task.enter(TaskState::Queued { lead, passing });
                    return Step::Begun;
                }
                // A motion without a way ends at the instant at which it begins.
                self.arm.finish_due(self.context.now);
                self.begun(task, lead, passing)
            }
            Err(error) => {
                let code = match error {
                    MotionError::Singular { .. } => match self.context.config.options.out_of_reach {
                        OutOfReach::Level8 => alarm::UNABLE_TO_TRANS,
                        OutOfReach::Level4 => alarm::SINGULAR,
                    },
                    MotionError::Free { .. } => alarm::AXIS_FREE,
                    MotionError::Unreachable(_)
                    | MotionError::OnPath { .. }
                    | MotionError::Configuration { .. }
                    | MotionError::NoArc
                    | MotionError::AtLimit { .. }
                    | MotionError::NoSuchAxis { .. } => match self.context.config.options.out_of_reach {
                        OutOfReach::Level8 => alarm::INVALID_RANGE,
                        OutOfReach::Level4 => alarm::OUT_OF_REACH,
                    },
                    // A bad value: nothing was interpolated (T8.3), and a start goes on after the statement.
                    MotionError::Gate { .. } => return task.give_up(alarm::OUT_OF_RANGE, error),
                };
                task.alarm(code, error)
            }
        }
    }

    /// The motion of a statement has begun: the statement ends when the arm arrives, or immediately.
    pub(crate) fn begun(&mut self, task: &mut Task, lead: Duration, at_once: bool) -> Step {
        self.executor.begin_motion(task.line());
        if at_once {
            return self.executor.moved(task);
        }
        task.enter(TaskState::Moving { lead });
        Step::Begun
    }

    /// A statement sets ACCEL or DECEL to this, if it is above 100 percent. The motor that it may overload is not modelled.
    fn report_over_full(&mut self, task: &Task, percent: Option<f64>) {
        let Some(percent) = percent else { return };
        let line = task.line();
        let message =
            format!("line {line}: {percent} percent of the acceleration; the arm moves as with {FULL}");
        self.context.report(&rules::ACCEL_OVER_FULL, None, &[], message);
    }

    fn print(
        &mut self,
        ports: &dyn PortFacts,
        task: &mut Task,
        channel: Channel,
        data: &[u8],
        cut: usize,
    ) -> Step {
        let (line, port) = (task.line(), Port::from_channel(channel));
        // Before the finding: a PRINT that waits for room is served again, and would be reported each time.
        if let Some(until) = port.and_then(|port| ports.line_free_at(port, data.len())) {
            return task.wait(TaskState::Pausing { until });
        }
        if cut > 0 {
            let message = format!("line {line}: PRINT: {cut} bytes too long; at most {MAX_PRINT} are sent");
            self.context.report(&rules::PRINT_CUT, port, data, message);
        }
        let Some(port) = port else {
            let text = String::from_utf8_lossy(data).into_owned();
            self.channels.show(&text);
            self.context.outputs.push(Output::Pendant(text));
            return self.executor.done(task);
        };
        if !self.missing_peer(port) {
            let step = self.executor.done(task);
            let bytes = Bytes::copy_from_slice(data);
            return if data.is_empty() {
                step
            } else {
                step.then(Step::Print { port, bytes })
            };
        }
        let message = format!("line {line}: PRINT {port}: no peer is connected");
        self.context
            .report(&rules::PRINT_WITHOUT_PEER, port, data, message.as_str());
        if self.context.config.options.no_peer == NoPeer::Alarm {
            self.blame_alarm(&rules::PRINT_WITHOUT_PEER, Some(port));
        }
        // The statement is over first: RN after the alarm of level 2 goes on with the next one.
        let step = self.executor.done(task);
        match self.context.config.options.no_peer {
            NoPeer::Alarm => step.then(Step::Alarm {
                code: alarm::INVALID_CHANNEL,
                line: Some(line),
                detail: message,
            }),
            NoPeer::Silent => step,
        }
    }

    fn input(&mut self, task: &mut Task, channel: Channel, wanted: usize) -> Step {
        let missing = Port::from_channel(channel).filter(|&port| self.missing_peer(port));
        if let Some(port) = missing {
            let reason = format!("INPUT {port}: no peer is connected");
            let message = format!("line {}: {reason}", task.line());
            self.context
                .report(&rules::INPUT_WITHOUT_PEER, port, &[], message);
            if self.context.config.options.no_peer == NoPeer::Alarm {
                self.blame_alarm(&rules::INPUT_WITHOUT_PEER, Some(port));
                return self.cancel_input(task, Vec::new(), alarm::INVALID_CHANNEL, &reason);
            }
        }
        task.enter(TaskState::Reading {
            channel,
            wanted,
            got: Vec::new(),
        });
        self.read_values(task)
    }

    /// Gives a waiting INPUT the values of its channel.
    pub(crate) fn read_values(&mut self, task: &mut Task) -> Step {
        let malformed = self.context.config.options.malformed(self.arm.kind());
        let TaskState::Reading {
            channel,
            wanted,
            mut got,
        } = task.state().clone()
        else {
            return Step::Blocked;
        };
        while got.len() < wanted {
            let buffer = self.channels.input(channel);
            match buffer.map_or(Datum::Incomplete, |buffer| buffer.take(malformed)) {
                Datum::Value(value) => got.push(value),
                Datum::Empty => {
                    let message = "nothing between two separators; read as 0 (INP-17)";
                    self.context
                        .report(&rules::INPUT_EMPTY, Port::from_channel(channel), &[], message);
                    got.push(Number::Integer(0));
                }
                Datum::Leading(token, value) => {
                    self.not_a_number(channel, &token, "a number");
                    got.push(value);
                }
                Datum::Incomplete => {
                    return task.wait(TaskState::Reading { channel, wanted, got });
                }
                Datum::OutOfRange(token) => {
                    self.blame_alarm(&rules::INPUT_NOT_A_NUMBER, Port::from_channel(channel));
                    let reason = format!("INPUT: expected a number in the range of a real, found {token:?}");
                    return self.cancel_input(task, got, alarm::OVERFLOW, &reason);
                }
                Datum::Malformed(token) => {
                    if let Some(number) = self.parameters.number_of(&token) {
                        got.push(Number::Integer(number.into()));
                        continue;
                    }
                    let expected = self.parameters.expected_by_input();
                    let reason = self.not_a_number(channel, &token, expected);
                    self.blame_alarm(&rules::INPUT_NOT_A_NUMBER, Port::from_channel(channel));
                    return self.cancel_input(task, got, alarm::INVALID_CHANNEL, &reason);
                }
            }
        }
        self.executor.answer(task, Answer::Values(got))
    }

    /// Reports the finding; returns its message.
    fn not_a_number(&mut self, channel: Channel, token: &str, expected: &str) -> String {
        let message = format!("INPUT: expected {expected}, found {token:?}");
        let port = Port::from_channel(channel);
        self.context.report(
            &rules::INPUT_NOT_A_NUMBER,
            port,
            token.as_bytes(),
            message.clone(),
        );
        message
    }

    /// Ends the INPUT with these values. A fault in storing them would only repeat the alarm.
    fn cancel_input(&mut self, task: &mut Task, values: Vec<Number>, code: AlarmCode, reason: &str) -> Step {
        // The text first: the answer moves the task on to the next line.
        let step = task.alarm(code, reason);
        self.executor.answer(task, Answer::Cancelled(values));
        step
    }

    /// OPEN, CLOSE: when the arm rests, or at once.
    fn work_hand(&mut self, task: &mut Task, hand: u8, open: bool, at_once: bool) -> Step {
        // OPEN and CLOSE work where the motion before them has led.
        if !at_once && self.arm.is_moving() {
            return task.wait(TaskState::Resting);
        }
        let index = usize::from(hand).saturating_sub(1);
        if let Some(&(opens, closes)) = HANDS.get(index) {
            self.signals.set_output(opens, open);
            self.signals.set_output(closes, !open);
        }
        self.executor.done(task)
    }

    /// PULOUT: turns the output on now and off later; the program does not wait.
    fn pulse_output(&mut self, task: &mut Task, output: u16, seconds: f64) -> Step {
        let bus = self.context.config.options.field_bus;
        if !Signals::is_user_output(output, bus) {
            return task.give_up(alarm::OUT_OF_RANGE, Signals::no_output(output, bus));
        }
        let pulse = duration_from_seconds(seconds, LONGEST_DELAY);
        self.signals.pulse_output(output, self.context.now + pulse);
        self.executor.done(task)
    }

    /// BREAK: gives up the current motion. Statements that wait for it continue when the arm rests, and so does this
    /// one.
    fn break_motion(&mut self, task: &mut Task) -> Step {
        self.arm.stop(self.context.now);
        self.end_pause();
        let step = self.executor.done(task);
        if self.arm.is_moving() && matches!(step, Step::Done { .. }) {
            task.enter(TaskState::Resting);
        }
        step
    }

    /// Continues the motion after PAUSE, unless feed hold holds it too.
    pub(crate) fn end_pause(&mut self) {
        if self.executor.resume() && !self.panel.state().feed_hold {
            self.arm.resume(self.context.now);
        }
    }

    /// Whether no motion may continue or begin.
    pub(crate) fn is_held(&self) -> bool {
        self.panel.state().feed_hold || self.executor.is_paused()
    }

    /// Whether the port is an Ethernet channel without a peer. A serial line has no way to tell.
    fn missing_peer(&self, port: Port) -> bool {
        let buffer = self.channels.get(port);
        port.ethernet_index().is_some() && buffer.is_none_or(|buffer| buffer.peer().is_none())
    }
}
