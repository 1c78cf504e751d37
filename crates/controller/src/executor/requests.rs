//! Serves what a statement requests from the robot: motion, PRINT, INPUT, DELAY, outputs.
//!
//! `scheduler` runs the program until it requests something, calls `serve()`, and waits until the request is done.

use crate::alarm;
use crate::arm::SpeedLimits;
use crate::endpoint::Endpoints;
use crate::executor::scheduler::Step;
use crate::executor::{Stopwatch, Task, TaskState};
use crate::findings::rules;
use crate::input::KeySwitch;
use crate::io::channel::Datum;
use crate::io::signals::Signals;
use crate::limits::{COARSE_LEAD, LONGEST_DELAY, PENDANT_TEXT, TEACHING_SPEED};
use crate::motion::MotionError;
use crate::options::NoPeer;
use crate::output::Output;
use crate::port::Port;
use crate::robot::Robot;
use crate::time::duration_from_seconds;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::time::Duration;
use scol_mini::{Accuracy, Answer, Channel, MAX_PRINT, Motion, Number, Request};

impl Robot {
    pub(crate) fn serve(&mut self, endpoints: &mut Endpoints, task: &mut Task, request: Request) -> Step {
        match request {
            Request::Move(motion) => self.start_motion(task, &motion),
            Request::Print { channel, data, cut } => self.print(endpoints, task, channel, &data, cut),
            Request::BufferReset { channel } => {
                if let Some(buffer) = self.channel_mut(channel) {
                    buffer.clear();
                }
                self.answer(task, Answer::Done, false)
            }
            Request::Input { channel, expected } => self.input(task, channel, expected),
            // DELAY dwells where the motion before it has led.
            Request::Delay { .. } if self.moves(task) => {
                task.doing = TaskState::Resting;
                Step::Blocked
            }
            Request::Delay { seconds } => {
                let pause = duration_from_seconds(seconds, LONGEST_DELAY);
                task.doing = TaskState::Delaying {
                    until: self.now + pause,
                };
                Step::Begun
            }
            Request::Outputs(switches) => self.switch_outputs(task, &switches),
            Request::Hand { hand, open, at_once } => self.work_hand(task, hand, open, at_once),
            Request::Pulse { line, seconds } => self.pulse_output(task, line, seconds),
            Request::Break => self.break_motion(task),
            Request::Pause => self.pause_motion(task),
            Request::Resume => self.resume_motion(task),
            Request::SetTimer { seconds } => {
                self.executor.timer = Stopwatch {
                    set_at: self.now,
                    seconds,
                };
                self.answer(task, Answer::Done, false)
            }
            Request::Task { program } => self.start_task(task, program),
            Request::Switch => self.switch_task(task),
            Request::Restore { names } => match self.answer(task, Answer::Done, false) {
                Step::Done { .. } => Step::Restore { names },
                other => other,
            },
            Request::Kill { task: victim } => self.kill_task(task, victim),
            Request::Stop => match self.answer(task, Answer::Done, false) {
                Step::Done { .. } => Step::Stopped,
                other => other,
            },
        }
    }

    /// How fast the arm may move now.
    pub(crate) fn pace(&self) -> SpeedLimits {
        SpeedLimits {
            override_percent: if self.is_slow() {
                self.panel
                    .state()
                    .override_percent
                    .min(self.config.options.low_speed)
            } else {
                self.panel.state().override_percent
            },
            tool_speed_cap: (self.panel.state().key == KeySwitch::Teaching).then_some(TEACHING_SPEED),
        }
    }

    fn start_motion(&mut self, task: &mut Task, motion: &Motion) -> Step {
        if !self.takes_arm(task) {
            let line = task.machine.line();
            task.machine.skip();
            let detail = format!("line {line}: task {} wants to move it", task.id());
            return Step::Trouble(alarm::ARM_TAKEN, detail);
        }
        if self.is_held() {
            task.doing = TaskState::Holding;
            return Step::Blocked;
        }
        if let Some(mass) = self.overload(motion) {
            let line = task.machine.line();
            let heaviest = self.arm.model().max_payload;
            let detail = format!("line {line}: a load of at most {heaviest} kg expected, {mass} kg found");
            return Step::Trouble(alarm::OVERLOAD, detail);
        }
        let lead = match motion.conditions.accuracy {
            Accuracy::Coarse => COARSE_LEAD,
            Accuracy::Fine => Duration::ZERO,
        };
        let passing = motion.conditions.passing && task.machine.motion_ahead().is_some();
        let begun = if !self.arm.is_moving() {
            self.arm
                .start(self.now, motion, self.pace(), self.panel.state().machine_lock)
                .map(|()| true)
        } else if self.executor.pass > 0.0 {
            let taken = self.arm.append(self.now, motion, self.executor.pass, self.pace());
            if taken == Ok(true) {
                task.doing = TaskState::Queued { lead, passing };
            }
            taken
        } else {
            Ok(false)
        };
        match begun {
            Ok(false) => {
                task.doing = TaskState::Resting;
                Step::Blocked
            }
            Ok(true) => {
                self.executor.pass = match motion.conditions.passing {
                    true => motion.conditions.pass,
                    false => 0.0,
                };
                if let TaskState::Queued { .. } = task.doing {
                    return Step::Begun;
                }
                self.arm.finish_due(self.now);
                self.begun(task, lead, passing || motion.conditions.nowait)
            }
            Err(error) => {
                let line = task.machine.line();
                let code = match error {
                    MotionError::Singular { .. } => alarm::SINGULAR,
                    MotionError::Free { .. } => alarm::AXIS_FREE,
                    MotionError::Unreachable(_)
                    | MotionError::OnPath { .. }
                    | MotionError::Configuration { .. }
                    | MotionError::NoArc
                    | MotionError::Gate { .. }
                    | MotionError::NoSuchAxis { .. } => alarm::OUT_OF_REACH,
                };
                Step::Trouble(code, format!("line {line}: {error}"))
            }
        }
    }

    /// The motion of a statement has begun: the statement is over when the arm has arrived, or at once.
    pub(crate) fn begun(&mut self, task: &mut Task, lead: Duration, at_once: bool) -> Step {
        self.executor.motion_line = task.machine.line();
        if at_once {
            return self.answer(task, Answer::Done, true);
        }
        task.doing = TaskState::Moving { lead };
        Step::Begun
    }

    /// Mass of a load that is too heavy for the arm.
    fn overload(&self, motion: &Motion) -> Option<f64> {
        let (_, load) = motion.conditions.payload.as_ref()?;
        (load.mass > self.arm.model().max_payload).then_some(load.mass)
    }

    fn print(
        &mut self,
        endpoints: &mut Endpoints,
        task: &mut Task,
        channel: Channel,
        data: &[u8],
        cut: usize,
    ) -> Step {
        let line = task.machine.line();
        let Some(port) = Port::from_channel(channel) else {
            self.tell_cut(None, line, data, cut);
            self.show_on_pendant(data);
            return self.answer(task, Answer::Done, false);
        };
        if let Some(until) = endpoints.line_free_at(port, data.len()) {
            task.doing = TaskState::Pausing { until };
            return Step::Blocked;
        }
        self.tell_cut(Some(port), line, data, cut);
        let missing = self.missing_peer(port);
        if missing {
            let message = format!("line {line}: PRINT {port}: no peer is connected");
            self.report(&rules::PRINT_WITHOUT_PEER, port, data, message);
        }
        if !missing && !data.is_empty() {
            endpoints.send_bytes(self, port, data);
        }
        match (self.answer(task, Answer::Done, false), missing) {
            (Step::Done { .. }, true) if self.config.options.no_peer == NoPeer::Alarm => Step::Trouble(
                alarm::INVALID_CHANNEL,
                format!("line {line}: PRINT {port}: no peer is connected"),
            ),
            (step, _) => step,
        }
    }

    fn tell_cut(&mut self, port: Option<Port>, line: u32, data: &[u8], cut: usize) {
        if cut > 0 {
            let message = format!("line {line}: PRINT: at most {MAX_PRINT} bytes expected, {cut} more found");
            self.report(&rules::PRINT_CUT, port, data, message);
        }
    }

    fn input(&mut self, task: &mut Task, channel: Channel, wanted: usize) -> Step {
        let missing = Port::from_channel(channel).filter(|&port| self.missing_peer(port));
        if let Some(port) = missing {
            let message = format!("line {}: INPUT {port}: no peer is connected", task.machine.line());
            self.report(&rules::INPUT_WITHOUT_PEER, port, &[], message);
        }
        if let Some(port) = missing.filter(|_| self.config.options.no_peer == NoPeer::Alarm) {
            let line = task.machine.line();
            self.cancel_input(task, Vec::new());
            let detail = format!("line {line}: INPUT {port}: no peer is connected");
            return Step::Trouble(alarm::INVALID_CHANNEL, detail);
        }
        task.doing = TaskState::Reading {
            channel,
            wanted,
            got: Vec::new(),
        };
        self.read_values(task)
    }

    /// Gives a waiting INPUT what its channel holds.
    pub(crate) fn read_values(&mut self, task: &mut Task) -> Step {
        let malformed = self.config.options.malformed;
        let TaskState::Reading { channel, wanted, got } = &mut task.doing else {
            return Step::Blocked;
        };
        let (channel, wanted) = (*channel, *wanted);
        let mut values = core::mem::take(got);
        while values.len() < wanted {
            let datum = self
                .channel_mut(channel)
                .map_or(Datum::Incomplete, |buffer| buffer.take(malformed));
            match datum {
                Datum::Value(value) => values.push(value),
                Datum::Empty => {
                    let message = "nothing between two separators; read as 0 (INP-17)";
                    self.report(&rules::INPUT_EMPTY, Port::from_channel(channel), &[], message);
                    values.push(Number::Integer(0));
                }
                Datum::Leading(token, value) => {
                    self.not_a_number(channel, &token);
                    values.push(value);
                }
                Datum::Incomplete => {
                    task.doing = TaskState::Reading {
                        channel,
                        wanted,
                        got: values,
                    };
                    return Step::Blocked;
                }
                Datum::OutOfRange(token) => {
                    let line = task.machine.line();
                    self.cancel_input(task, values);
                    let detail = format!(
                        "line {line}: INPUT: a number in the range of a real expected, {token:?} found"
                    );
                    return Step::Trouble(alarm::OVERFLOW, detail);
                }
                Datum::Malformed(token) => {
                    self.not_a_number(channel, &token);
                    let line = task.machine.line();
                    self.cancel_input(task, values);
                    let detail = format!("line {line}: INPUT: a number expected, {token:?} found");
                    return Step::Trouble(alarm::INVALID_CHANNEL, detail);
                }
            }
        }
        self.answer(task, Answer::Values(values), false)
    }

    fn not_a_number(&mut self, channel: Channel, token: &str) {
        let message = format!("INPUT: a number expected, {token:?} found");
        self.report(
            &rules::INPUT_NOT_A_NUMBER,
            Port::from_channel(channel),
            token.as_bytes(),
            message,
        );
    }

    fn cancel_input(&mut self, task: &mut Task, values: Vec<scol_mini::Number>) {
        // A fault in storing the values would only repeat what the alarm that follows says.
        if let Step::Trouble(..) = self.answer(task, Answer::Cancelled(values), false) {
            task.doing = TaskState::Ready;
        }
    }

    fn switch_outputs(&mut self, task: &mut Task, switches: &[(u16, bool)]) -> Step {
        let line = task.machine.line();
        if let Some((output, _)) = switches
            .iter()
            .find(|(output, _)| !Signals::is_user_output(*output))
        {
            task.machine.skip();
            let detail = format!("line {line}: output 1-64, 101-164 or 201-208 expected, {output} found");
            return Step::Trouble(alarm::OUT_OF_RANGE, detail);
        }
        for &(output, on) in switches {
            self.signals.set_output(output, on);
        }
        self.answer(task, Answer::Done, false)
    }

    fn show_on_pendant(&mut self, data: &[u8]) {
        let text = String::from_utf8_lossy(data).into_owned();
        self.pendant.push_str(&text);
        let surplus = self.pendant.len().saturating_sub(PENDANT_TEXT);
        let cut = (surplus..=self.pendant.len())
            .find(|&at| self.pendant.is_char_boundary(at))
            .unwrap_or(0);
        self.pendant.drain(..cut);
        self.push_output(Output::Pendant(text));
    }

    /// Whether the port is an Ethernet channel without a peer. A serial line has no way to tell.
    fn missing_peer(&self, port: Port) -> bool {
        port.ethernet_index().is_some()
            && self
                .channels
                .get(&port)
                .is_none_or(|buffer| buffer.peer.is_none())
    }

    fn channel_mut(&mut self, channel: Channel) -> Option<&mut crate::io::channel::Channel> {
        match Port::from_channel(channel) {
            Some(port) => self.channels.get_mut(&port),
            None => Some(&mut self.keys),
        }
    }
}
