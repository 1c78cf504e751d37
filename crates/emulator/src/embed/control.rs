//! Control of a running robot by a test: the commands of `ts3100 ctl` as methods, without HTTP.
//!
//! Each method blocks until its effect is there, also in an async runtime. Durations are virtual time.

use super::{Emulator, Error, MAX_WAIT};
use std::future::Future;
use std::pin::pin;
use std::sync::Arc;
use std::task::{Context, Poll, Wake, Waker};
use std::thread::{self, Thread};
use std::time::{Duration, Instant};
use tokio::sync::oneshot;
use ts3100_controller::faults::{Fault, FaultAction, FaultReport};
use ts3100_controller::input::{By, JogMode};
use ts3100_controller::inspection::{Assignment, Breakpoint, InspectError, StepKind};
use ts3100_controller::panel::PanelState;
use ts3100_controller::queries::VariableView;
use ts3100_controller::signals::Signals;
use ts3100_controller::{Action, ActionError, ArmPose, Condition, Controller, IoKind, PanelAction, Port};
use ts3100_driver::clock::TimeMode;
use ts3100_driver::driver::request::{LinkAction, Request, View, WaitResult};
use ts3100_driver::driver::wait::Wait;
use ts3100_proto::command::Number;
use ts3100_proto::status::ExecutionStatus;

fn require_line(line: u16) -> Result<(), Error> {
    if Signals::exists(line) {
        return Ok(());
    }
    Err(Error::Line(line))
}

/// The state of the robot.
impl Emulator {
    /// Reads whatever you like of the controller, at one moment.
    ///
    /// # Errors
    /// [`Error::Ended`].
    pub fn read<T: Send + 'static>(
        &self,
        look: impl FnOnce(&Controller) -> T + Send + 'static,
    ) -> Result<T, Error> {
        self.view(move |view| look(view.controller))
    }

    pub(super) fn view<T: Send + 'static>(
        &self,
        look: impl FnOnce(&View<'_>) -> T + Send + 'static,
    ) -> Result<T, Error> {
        self.request(|reply| Request::Query(Box::new(move |(), view| reply(look(view)))))
    }

    /// The value of an expression as an open call of a task reads it, 0 the outermost; 1 is the main program.
    ///
    /// # Errors
    /// [`Error::Ended`]; inside, why it has no value.
    pub fn evaluate_expression(
        &self,
        task: u16,
        call: usize,
        expression: &str,
    ) -> Result<Result<VariableView, InspectError>, Error> {
        let expression = expression.to_owned();
        self.read(move |controller| controller.evaluate(task, call, &expression))
    }

    /// The execution status, as SU and SF show it.
    ///
    /// # Errors
    /// [`Error::Ended`].
    pub fn status(&self) -> Result<ExecutionStatus, Error> {
        self.read(Controller::status)
    }

    /// Power, servo power, key switch, modes and holds.
    ///
    /// # Errors
    /// [`Error::Ended`].
    pub fn state(&self) -> Result<PanelState, Error> {
        self.read(|controller| controller.state().clone())
    }

    /// The posture of the arm in joints and in coordinates.
    ///
    /// # Errors
    /// [`Error::Ended`].
    pub fn pose(&self) -> Result<ArmPose, Error> {
        self.read(Controller::arm_pose)
    }

    /// Whether an input line is on.
    ///
    /// # Errors
    /// [`Error::Line`] for a number that no line has, or [`Error::Ended`].
    pub fn input(&self, line: u16) -> Result<bool, Error> {
        require_line(line)?;
        self.read(move |controller| controller.signals().input(line))
    }

    /// Whether an output line is on.
    ///
    /// # Errors
    /// [`Error::Line`] for a number that no line has, or [`Error::Ended`].
    pub fn output(&self, line: u16) -> Result<bool, Error> {
        require_line(line)?;
        self.read(move |controller| controller.signals().output(line))
    }

    /// The numbers of the active alarms, for example `2-046`.
    ///
    /// # Errors
    /// [`Error::Ended`].
    pub fn alarms(&self) -> Result<Vec<String>, Error> {
        self.read(|controller| {
            let active = controller.alarms().active().iter();
            active.map(|alarm| alarm.code.number()).collect()
        })
    }

    /// Text that PRINT has shown on the teach pendant.
    ///
    /// # Errors
    /// [`Error::Ended`].
    pub fn pendant(&self) -> Result<String, Error> {
        self.read(|controller| controller.pendant().to_owned())
    }

    /// A variable of the selected file: of GLOBAL or DATA, an element such as `A(1,2)`, or `PICK.COUNT` of a program; `None` if
    /// there is none.
    ///
    /// # Errors
    /// [`Error::Ended`].
    pub fn variable(&self, name: &str) -> Result<Option<VariableView>, Error> {
        let name = name.to_owned();
        self.read(move |controller| controller.variable(&name).ok().flatten())
    }

    /// The names of the files on the RAM drive.
    ///
    /// # Errors
    /// [`Error::Ended`].
    pub fn files(&self) -> Result<Vec<String>, Error> {
        self.read(|controller| controller.files().map(|(name, _)| name.to_owned()).collect())
    }

    /// The content of a file on the RAM drive, without EOF; `None` if there is none.
    ///
    /// # Errors
    /// [`Error::Ended`].
    pub fn file(&self, name: &str) -> Result<Option<Vec<u8>>, Error> {
        let name = name.to_ascii_uppercase();
        self.read(move |controller| controller.drive().get(&name).map(<[u8]>::to_vec))
    }

    /// The faults with their counters.
    ///
    /// # Errors
    /// [`Error::Ended`].
    pub fn faults(&self) -> Result<Vec<FaultReport>, Error> {
        self.read(|controller| controller.faults().reports().cloned().collect())
    }
}

/// Actions on the robot.
impl Emulator {
    /// Performs an action. The methods below have a name for each.
    ///
    /// # Errors
    /// [`Error::Refused`] with the reason, or [`Error::Ended`].
    pub fn act(&self, action: Action) -> Result<(), Error> {
        self.act_by(By::Owner, action)
    }

    fn act_by(&self, by: By, action: Action) -> Result<(), Error> {
        self.change(|reply| Request::Action(action, by, Box::new(move |result, _| reply(result))))
    }

    fn change(
        &self,
        request: impl FnOnce(Box<dyn FnOnce(Result<(), ActionError>) + Send>) -> Request,
    ) -> Result<(), Error> {
        let result: Result<(), ActionError> = self.request(request)?;
        result.map_err(Error::from)
    }

    fn at_link(&self, action: LinkAction) -> Result<(), Error> {
        self.change(|reply| Request::LinkAction(action, Box::new(move |result, _| reply(result))))
    }

    /// Does something at the operator panel as a person does, who gets no answer: what the state does not allow has no
    /// effect.
    ///
    /// # Errors
    /// [`Error::Ended`].
    pub fn panel(&self, panel: PanelAction) -> Result<(), Error> {
        self.act_by(By::Hand, Action::Panel(panel))
    }

    /// Arms a fault; `spec` has the form of `--fault`.
    ///
    /// # Errors
    /// [`Error::Fault`] for a wrong specification, or as [`Emulator::act`].
    pub fn arm_fault(&self, spec: &str) -> Result<(), Error> {
        let fault = Box::new(spec.parse::<Fault>()?);
        self.act(Action::Fault(FaultAction::Arm(fault)))
    }

    /// Handles bytes as if the peer of a port had sent them.
    ///
    /// # Errors
    /// As [`Emulator::act`].
    pub fn inject(&self, port: Port, bytes: &[u8]) -> Result<(), Error> {
        let bytes = bytes.to_vec();
        self.at_link(LinkAction::Inject { port, bytes })
    }

    /// Closes the connection of a port.
    ///
    /// # Errors
    /// As [`Emulator::act`].
    pub fn drop_peer(&self, port: Port) -> Result<(), Error> {
        self.at_link(LinkAction::Drop { port })
    }

    /// Returns to the state at the start, time included; connections are closed.
    ///
    /// # Errors
    /// As [`Emulator::act`].
    pub fn reset(&self) -> Result<(), Error> {
        self.at_link(LinkAction::Reset)
    }
}

/// Makes the method of each row of the table of controls.
macro_rules! methods_of_controls {
    (
        switches { $(
            $(#[$doc:meta])*
            $name:ident: $variant:ident($type:ty $(, $range:expr)?) = $path:literal {
                form: $form:literal,
                document: $document:ident { $field:ident: $state:ident },
                act: $act:ident,
                $($more:tt)*
            }
        )* }
        buttons { $(
            $(#[$press_doc:meta])*
            $press_name:ident: $press:ident = $press_path:literal { $($press_more:tt)* }
        )* }
        queries $queries:tt
    ) => {
        /// Switches and buttons: the table of controls.
        impl Emulator {
            $(
                $(#[$doc])*
                ///
                /// # Errors
                /// As [`Emulator::act`].
                pub fn $act(&self, $field: $type) -> Result<(), Error> {
                    self.act(Action::Panel(PanelAction::$variant($field)))
                }
            )*
            $(
                $(#[$press_doc])*
                ///
                /// # Errors
                /// As [`Emulator::act`].
                pub fn $press_name(&self) -> Result<(), Error> {
                    self.act(Action::Panel(PanelAction::$press))
                }
            )*
        }
    };
}

ts3100_controller::controls!(methods_of_controls);

/// Methods for actions without a row in the table of controls.
macro_rules! actions {
    ($($(#[$doc:meta])* $name:ident($($argument:ident: $type:ty),*) => $action:expr;)*) => {
        /// Lines, files, positions, faults and power.
        impl Emulator {
            $(
                $(#[$doc])*
                ///
                /// # Errors
                /// As [`Emulator::act`].
                pub fn $name(&self $(, $argument: $type)*) -> Result<(), Error> {
                    self.act($action)
                }
            )*
        }
    };
}

actions! {
    /// Runs the program until it comes to the line, from 1.
    run_program_to(line: u32) => Action::RunTo(line);
    /// Sets the breakpoints of the selected file: lines from 1. An empty list ends them.
    set_breakpoints(lines: &[u32]) => Action::Breakpoints(lines.iter().map(|line| Breakpoint::at(*line)).collect());
    /// Runs the stopped program until a step of a task ends; 1 is the main program.
    step_task(kind: StepKind, task: u16) => Action::StepTask { kind, task };
    /// Carries out an assignment in an open call of the stopped program, 0 the outermost: `N = 5`.
    assign_variable(task: u16, call: usize, assignment: &str) =>
        Action::Assign(Assignment { task, call, text: assignment.to_owned() });
    /// Presses a key of the teach pendant that moves the arm; in TEACHING only. Axes count from 1.
    jog(axis: u8, positive: bool, mode: JogMode) => Action::Panel(PanelAction::Jog { axis, positive, mode });
    /// Types on the teach pendant; `\r` is the Enter key.
    press_keys(keys: &str) => Action::Panel(PanelAction::Keys(keys.to_owned()));
    /// Raises an alarm by its number, for example `2-046`, with a detail after its text.
    raise_alarm(number: &str, detail: &str) =>
        Action::RaiseAlarm { number: number.to_owned(), detail: detail.to_owned() };
    /// Drives an input line.
    set_input(line: u16, on: bool) => Action::Panel(PanelAction::InputLine { line, on });
    /// Sets a user output, as IW does.
    set_output(line: u16, on: bool) => Action::SetOutput { line, on };
    /// Sets variables as MW does; as many numbers as the type has. With `restore` also in the file.
    set_variable(name: &str, values: &[Number], restore: bool) =>
        Action::SetVariable { name: name.to_owned(), values: values.to_vec(), restore };
    /// Puts a file on the RAM drive.
    put_file(name: &str, content: impl AsRef<[u8]>) =>
        Action::PutFile { name: name.to_ascii_uppercase(), content: content.as_ref().to_vec() };
    /// Erases a file, as ER does.
    erase_file(name: &str) => Action::EraseFile { name: name.to_ascii_uppercase() };
    /// Selects a file, as SL does.
    select_file(name: &str) => Action::Select { name: name.to_ascii_uppercase() };
    /// Turns the power off; every connection is closed.
    power_off() => Action::PowerOff;
    /// Turns the power on.
    power_on() => Action::PowerOn;
    /// Turns the power off and on again.
    power_cycle() => Action::Panel(PanelAction::PowerCycle);
    /// Turns an input on or off for a time and then back.
    pulse_input(line: u16, on: bool, length: Duration) => Action::Pulse { side: IoKind::Input, line, on, length };
    /// Turns an output on for a time and then off.
    pulse_output(line: u16, length: Duration) => Action::Pulse { side: IoKind::Output, line, on: true, length };
    /// Forces an input to a state, whatever drives it.
    force_input(line: u16, on: bool) => Action::Force { side: IoKind::Input, line, on };
    /// Forces an output to a state, whatever drives it.
    force_output(line: u16, on: bool) => Action::Force { side: IoKind::Output, line, on };
    /// Releases a forced input.
    release_input(line: u16) => Action::Release { side: IoKind::Input, line };
    /// Releases a forced output.
    release_output(line: u16) => Action::Release { side: IoKind::Output, line };
    /// Sets a position to the present one of the arm. With `restore` also in the file.
    teach_position(name: &str, restore: bool) => Action::Teach { name: name.to_owned(), restore };
    /// Disarms a fault by its number.
    disarm_fault(id: u32) => Action::Fault(FaultAction::Disarm(id));
    /// Removes all faults.
    clear_faults() => Action::Fault(FaultAction::Clear);
}

/// Time.
impl Emulator {
    /// Virtual time since the start.
    ///
    /// # Errors
    /// [`Error::Ended`].
    pub fn now(&self) -> Result<Duration, Error> {
        self.read(|controller| Duration::from_micros(controller.now().as_micros()))
    }

    /// Time mode.
    ///
    /// # Errors
    /// [`Error::Ended`].
    pub fn time_mode(&self) -> Result<TimeMode, Error> {
        self.view(|view| view.time)
    }

    /// Sets how time passes.
    ///
    /// # Errors
    /// [`Error::Ended`].
    pub fn set_time_mode(&self, mode: TimeMode) -> Result<(), Error> {
        self.at_link(LinkAction::TimeMode(mode))
    }

    /// Advances time; everything that is due meanwhile happens at its own time. Works in every time mode.
    ///
    /// # Errors
    /// [`Error::CutShort`] if the state is replaced meanwhile, [`Error::Late`] after [`MAX_WAIT`], or [`Error::Ended`].
    pub fn advance(&self, by: Duration) -> Result<(), Error> {
        let ended = self.wait(Wait::new(None, by, true))?;
        // Nothing was waited for but the time itself.
        if ended.passed < by {
            return Err(Error::CutShort);
        }
        Ok(())
    }

    /// Advances time until a condition is met, for example `"output 5 on"` or `"printed IP1 DONE"`, for at most `within`.
    /// Returns whether it was met. A state that already holds ends it at once.
    ///
    /// # Errors
    /// [`Error::Condition`] for a condition that cannot be read, or as [`Emulator::advance`].
    pub fn advance_until(&self, condition: &str, within: Duration) -> Result<bool, Error> {
        let condition: Condition = condition.parse()?;
        Ok(self.wait(Wait::new(Some(condition), within, true))?.reached)
    }

    /// Waits for a condition while time passes, for at most `within`. Returns whether it was met.
    ///
    /// # Errors
    /// As [`Emulator::advance_until`]; in stepped time [`Error::Late`] unless another thread advances it.
    pub fn wait_until(&self, condition: &str, within: Duration) -> Result<bool, Error> {
        let condition: Condition = condition.parse()?;
        Ok(self.wait(Wait::new(Some(condition), within, false))?.reached)
    }

    fn wait(&self, wait: Wait) -> Result<WaitResult, Error> {
        let (done, is_done) = oneshot::channel();
        let sent = self.started.requests.try_send(Request::Wait(wait, done));
        sent.map_err(|_| Error::Ended)?;
        match block_on(is_done, MAX_WAIT) {
            Some(Ok(ended)) => Ok(ended),
            Some(Err(_)) => Err(Error::Ended),
            None => Err(Error::Late(MAX_WAIT)),
        }
    }
}

/// Wakes a thread.
struct Unpark(Thread);

impl Wake for Unpark {
    fn wake(self: Arc<Unpark>) {
        self.0.unpark();
    }
}

/// Blocks this thread until the future is ready; `None` after `limit`. Unlike a runtime's own it works within one.
fn block_on<T>(future: impl Future<Output = T>, limit: Duration) -> Option<T> {
    // Without the budget of an async task that calls: it would be spent for good, because the task does not give way.
    let mut future = pin!(tokio::task::unconstrained(future));
    let waker = Waker::from(Arc::new(Unpark(thread::current())));
    let mut context = Context::from_waker(&waker);
    let until = Instant::now() + limit;
    loop {
        if let Poll::Ready(value) = future.as_mut().poll(&mut context) {
            return Some(value);
        }
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return None;
        }
        thread::park_timeout(left);
    }
}
