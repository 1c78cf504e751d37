//! Everything that the owner of a controller may read. Reading changes nothing.
//!
//! The control interface turns these values into documents.

use crate::Controller;
use crate::alarm::Alarms;
use crate::arm::{ArmPose, Frames};
use crate::drive::Drive;
use crate::endpoint::session::{Exchange, Session};
use crate::executor::Task;
pub use crate::executor::TaskView;
use crate::faults::Faults;
use crate::faults::effects::FaultEffects;
use crate::inspection::{Assignment, Breakpoint, BreakpointError, InspectError, Inspection, Stopped};
use crate::io::line_names::HANDS;
use crate::io::signals::Signals;
use crate::listed::listed;
use crate::network::NetworkConfig;
use crate::options::Config;
use crate::panel::PanelState;
use crate::port::Port;
use crate::prelude::*;
use crate::time::Time;
use crate::watched::Watched;
use alloc::collections::BTreeSet;
use scol_mini::{Channel, Local, Memory, Value, ValueKind};
use ts3100_proto::calendar::CalendarTime;
use ts3100_proto::command::Number;
use ts3100_proto::name::{NameError, VariableName, split_subscripts};
use ts3100_proto::parameter::{EthernetParameters, SerialSettings, UserParameters};
use ts3100_proto::status::ExecutionStatus;
use ts3100_proto::status::position::CurrentPosition;

/// Elements of one array that are shown at most.
pub const MAX_ELEMENTS: usize = 1_000;

/// A communication port at a moment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PortView {
    /// `idle`, `sending`, `receiving`: the exchange of a protocol port.
    pub exchange: Option<&'static str>,
    /// A text has begun and is not complete.
    pub partial: bool,
    /// Bytes in the ring buffer of a SCOL channel, oldest first.
    pub buffer: Vec<u8>,
}

/// A variable of the selected file at a moment.
#[derive(Debug, Clone, PartialEq)]
pub struct VariableView {
    /// Its name; of a variable of a program with it, as in `PICK.COUNT`.
    pub name: String,
    /// Its kind; `None` when the first assignment will fix it.
    pub kind: Option<ValueKind>,
    /// Upper bounds of its subscripts; empty for a plain variable.
    pub bounds: Vec<u32>,
    /// Its value, in the order of MR; `None` when it has none, or when it is an array.
    pub value: Option<Vec<Number>>,
}

/// A task as somebody sees it who looks at the program.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskStack {
    /// 1 the main program.
    pub id: u16,
    /// As of [`TaskView`].
    pub state: &'static str,
    /// Its open calls, outermost first, then those of the action of its monitor.
    pub calls: Vec<CallView>,
    /// How many of them the action interrupts, while there is one.
    pub interrupted: Option<usize>,
}

/// An open call.
#[derive(Debug, Clone, PartialEq)]
pub struct CallView {
    /// The program that was called.
    pub program: String,
    /// The file line at which it is; after an alarm, that of the statement at fault.
    pub line: u32,
    /// Its parameters and variables.
    pub locals: Vec<VariableView>,
}

impl Controller {
    /// Modes, key, buttons, and how long everything runs.
    pub fn state(&self) -> &PanelState {
        self.robot.panel.state()
    }

    /// The digital lines.
    pub fn signals(&self) -> &Signals {
        &self.robot.signals
    }

    /// Active alarms and the history.
    pub fn alarms(&self) -> &Alarms {
        &self.robot.alarms
    }

    /// The RAM drive.
    pub fn drive(&self) -> &Drive {
        &self.robot.drive
    }

    /// The configuration it was made from.
    pub fn config(&self) -> &Config {
        &self.robot.context.config
    }

    /// The Ethernet parameters in effect.
    pub fn ethernet(&self) -> &EthernetParameters {
        self.robot.parameters.ethernet()
    }

    /// The user parameters in effect.
    pub fn user(&self) -> &UserParameters {
        self.robot.parameters.user()
    }

    /// Text that PRINT has shown on the teach pendant.
    pub fn pendant(&self) -> &str {
        self.robot.channels.pendant()
    }

    /// Name of the selected file; empty when none is.
    pub fn selected(&self) -> &str {
        self.robot.executor.file()
    }

    /// Where the program stops, in ascending order of the lines of the selected file.
    pub fn breakpoints(&self) -> &[Breakpoint] {
        self.robot.executor.breakpoints().set()
    }

    /// Lines of the selected file with a breakpoint, from 1, in ascending order.
    pub fn breakpoint_lines(&self) -> impl Iterator<Item = u32> {
        let lines: BTreeSet<u32> = self.breakpoints().iter().map(|set| set.line).collect();
        lines.into_iter()
    }

    /// Why the program stopped last; none while it runs, and after a reset.
    pub fn stopped(&self) -> Option<&Stopped> {
        self.robot.executor.stopped()
    }

    /// The alarm that stops the program, from when it is raised until the next start or reset.
    pub fn alarm_stop(&self) -> Option<&Stopped> {
        self.robot.executor.alarm_stop()
    }

    /// Execution status, as SU and SF show it.
    pub fn status(&self) -> ExecutionStatus {
        self.robot.executor.shown_status()
    }

    /// The content of SF as the host on this port would get it now, without EOF: 276 bytes, of a SCARA 250.
    pub fn status_frame(&self, port: Port) -> Vec<u8> {
        let session = self.endpoints.sessions.get(&port);
        let asked = session.and_then(|session| session.last_status.as_ref());
        self.robot.status_frame(asked)
    }

    /// Nothing runs, nothing moves, and no host is owed or owes anything: an answer that waits for the disk, or that a
    /// fault delays, is still to come.
    pub fn is_idle(&self) -> bool {
        let endpoints = &self.endpoints;
        let is_owed = |port: &Port| endpoints.send_queue.waiting(*port).0 > 0;
        self.status() != ExecutionStatus::Running
            && !self.robot.arm.is_moving()
            && !self.robot.persistence.is_waiting()
            && !endpoints.sessions.values().any(Session::awaits_host)
            && !endpoints.sessions.keys().any(is_owed)
    }

    /// The main program, its tasks, and the statement of DO.
    pub fn tasks(&self) -> Vec<TaskView> {
        self.robot.executor.task_views()
    }

    /// The tasks of the program with their open calls and the variables of each.
    pub fn stacks(&self) -> Vec<TaskStack> {
        let executor = &self.robot.executor;
        let memory = executor.memory();
        let stacks = executor.program_tasks().map(|task| {
            let mut view = task.view(executor.program_runs());
            // The statement at fault was given up, so the task is at the next one. Who looks wants to see the fault.
            let alarm = executor.alarm_stop().filter(|alarm| alarm.task == view.id);
            if let (Some(line), Some((_, at))) = (alarm.and_then(|alarm| alarm.line), view.calls.last_mut()) {
                *at = line;
            }
            let machines = task.parts().map(Task::machine);
            let has_action = task.parts().count() > 1;
            let locals = machines.flat_map(|machine| {
                let calls = 0..machine.depth();
                calls.map(|call| machine.locals(call, memory))
            });
            let calls = view.calls.into_iter().zip(locals);
            TaskStack {
                id: view.id,
                state: view.state,
                interrupted: has_action.then(|| task.machine().depth()),
                calls: calls
                    .map(|((program, line), locals)| CallView {
                        program,
                        line,
                        locals: locals.into_iter().map(|local| self.local_view(local)).collect(),
                    })
                    .collect(),
            }
        });
        stacks.collect()
    }

    fn local_view(&self, local: Local) -> VariableView {
        VariableView {
            name: local.name,
            kind: local.info.kind,
            bounds: local.bounds,
            value: local.value.map(|value| self.listed(&value)),
        }
    }

    /// The value of an expression as the call with this index of a task reads it, in a copy.
    ///
    /// # Errors
    /// See [`InspectError`].
    pub fn evaluate(&self, task: u16, call: usize, text: &str) -> Result<VariableView, InspectError> {
        let mut robot = self.robot.clone();
        let value = robot.evaluate(task, call, text)?;
        Ok(VariableView {
            name: String::from(text),
            kind: Some(value.kind()),
            bounds: Vec::new(),
            value: Some(self.listed(&value)),
        })
    }

    /// Carries out an assignment as the call with this index of a task sees its variable. What waits for the variable looks at
    /// it with the next input.
    ///
    /// # Errors
    /// See [`InspectError`].
    pub fn assign(&mut self, assignment: &Assignment) -> Result<(), InspectError> {
        self.robot.assign(assignment).map(drop)
    }

    /// The lines of the selected file on which a statement begins, in ascending order.
    pub fn statement_lines(&self) -> Vec<u32> {
        self.robot.executor.program().statement_lines()
    }

    /// Checks the expressions of a breakpoint as the program of its line reads them.
    ///
    /// # Errors
    /// See [`BreakpointError`].
    pub fn check_breakpoint(&self, breakpoint: &Breakpoint) -> Result<(), BreakpointError> {
        breakpoint.check(self.robot.executor.program())
    }

    /// From now on every statement is looked at, until the inspection is taken or halts the program.
    pub fn inspect(&mut self, inspection: Inspection) {
        *self.robot.executor.inspection_mut() = Some(Box::new(inspection));
    }

    /// Takes what has looked at the statements.
    pub fn take_inspection(&mut self) -> Option<Inspection> {
        self.robot
            .executor
            .inspection_mut()
            .take()
            .map(|inspection| *inspection)
    }

    /// Whether an inspection has halted the program: the controller is as it was then, and takes no input.
    pub fn is_halted(&self) -> bool {
        self.robot.executor.is_halted()
    }

    /// Lines of the selected file that are executed and analysed (SF-24).
    pub fn steps(&self) -> (u32, u32) {
        self.robot.steps()
    }

    /// Hand 1 and hand 2: open, closed, or, when neither of its outputs is on or both are, neither.
    pub fn hands(&self) -> [Option<bool>; 2] {
        HANDS.map(|(opens, closes)| {
            let [open, closed] = [opens, closes].map(|line| self.robot.signals.output(line));
            (open != closed).then_some(open)
        })
    }

    /// The posture of the arm now.
    pub fn arm_pose(&self) -> ArmPose {
        let conditions = self.robot.executor.memory().conditions();
        self.robot.arm.pose(self.robot.context.now, conditions)
    }

    /// The posture of the arm at a time from now on, as far as nothing changes the course of its motion, and the completed
    /// percentage of the motion then.
    pub fn arm_pose_at(&self, at: Time) -> (ArmPose, f64) {
        let conditions = self.robot.executor.memory().conditions();
        (self.robot.arm.pose(at, conditions), self.robot.arm.percent(at))
    }

    /// Name of the work coordinate system in which the pose is given; empty if it has none.
    pub fn work_name(&self) -> String {
        self.robot.arm.work_name(self.robot.context.now, &self.frames())
    }

    /// The coordinate systems in force.
    pub fn frames(&self) -> Frames {
        let conditions = self.robot.executor.memory().conditions();
        self.robot.arm.frames(self.robot.context.now, conditions)
    }

    /// Tool points in world coordinates along the path of the motion under way or else of the last one, at most
    /// [`PATH_POINTS`](crate::PATH_POINTS); empty before the first, and after a restore.
    pub fn motion_path(&self) -> Vec<[f64; 3]> {
        self.robot.arm.path(&self.frames())
    }

    /// Whether a motion is under way or held.
    pub fn is_arm_moving(&self) -> bool {
        self.robot.arm.is_moving()
    }

    /// Whether the arm moves because a host or somebody at the teach pendant guides it.
    pub fn is_jogging(&self) -> bool {
        self.robot.arm.is_jogging()
    }

    /// Percentage of the motion completed; 100 if none is under way.
    pub fn motion_percent(&self) -> f64 {
        self.robot.arm.percent(self.robot.context.now)
    }

    /// A communication port.
    pub fn port(&self, port: Port) -> PortView {
        let session = self.endpoints.sessions.get(&port);
        let channel = self.robot.channels.get(port);
        PortView {
            exchange: session.map(|session| match session.exchange() {
                Exchange::Idle => "idle",
                Exchange::Sending { .. } => "sending",
                Exchange::Receiving { .. } => "receiving",
            }),
            partial: session.is_some_and(Session::is_partial),
            buffer: channel
                .map(crate::io::channel::Channel::bytes)
                .unwrap_or_default(),
        }
    }

    /// The variables of the selected file: those of GLOBAL and DATA in alphabetical order, then those of its programs.
    pub fn variables(&self) -> Vec<VariableView> {
        let program = self.robot.executor.program();
        let shared = program.variables();
        let shared = shared.map(|(name, info, bounds)| (String::from(name), info, bounds));
        let view = |(name, info, bounds): (String, scol_mini::VariableInfo, &[u32])| {
            let value = self.held(&name, &[]);
            VariableView {
                kind: info.kind.or(value.as_ref().map(Value::kind)),
                bounds: bounds.to_vec(),
                value: value.map(|value| self.listed(&value)),
                name,
            }
        };
        shared.chain(program.locals()).map(view).collect()
    }

    /// One variable: `COUNT`, the element `A(1,2)`, or `PICK.COUNT` of a program; `None` when there is no such.
    ///
    /// # Errors
    /// The text is not a name.
    pub fn variable(&self, name: &str) -> Result<Option<VariableView>, NameError> {
        // Variables of programs have longer names than those that a host reads.
        let (base, subscripts) = split_subscripts(name)?;
        if !base.contains('.') {
            VariableName::parse(name)?;
        }
        Ok(self.find(base, &subscripts))
    }

    fn find(&self, name: &str, subscripts: &[i32]) -> Option<VariableView> {
        let mut views = self.variables().into_iter();
        let mut view = views.find(|view| view.name.eq_ignore_ascii_case(name))?;
        if !subscripts.is_empty() {
            let mut pairs = view.bounds.iter().zip(subscripts);
            let within = pairs.all(|(bound, at)| u32::try_from(*at).is_ok_and(|at| at <= *bound));
            if !within || view.bounds.len() != subscripts.len() {
                return None;
            }
            view.value = self.value_of(name, subscripts);
            view.bounds.clear();
        }
        Some(view)
    }

    /// The values of an array of one subscript, in order, at most [`MAX_ELEMENTS`].
    pub fn elements(&self, name: &str, bound: u32) -> Vec<Option<Vec<Number>>> {
        let subscripts = 0..=i32::try_from(bound).unwrap_or(i32::MAX);
        let values = subscripts.map(|subscript| self.value_of(name, &[subscript]));
        values.take(MAX_ELEMENTS).collect()
    }

    fn value_of(&self, name: &str, subscripts: &[i32]) -> Option<Vec<Number>> {
        let value = self.held(name, subscripts)?;
        Some(self.listed(&value))
    }

    fn held(&self, name: &str, subscripts: &[i32]) -> Option<Value> {
        let (memory, program) = (self.robot.executor.memory(), self.robot.executor.program());
        let read = if name.contains('.') {
            Memory::local
        } else {
            Memory::global
        };
        read(memory, program, name, subscripts).ok()
    }

    /// In the order of MR; a configuration has its digits and no decimal point.
    fn listed(&self, value: &Value) -> Vec<Number> {
        listed(value, self.robot.arm.kind())
    }

    /// From now on every statement of the program is told by
    /// [`Event::Statement`](crate::output::Event::Statement), or no longer.
    pub fn trace(&mut self, on: bool) {
        self.robot.context.outputs.trace(on);
    }

    /// From now on every statement that is told ([`Controller::trace`]) is told with what it did, or without.
    pub fn tell_effects(&mut self, on: bool) {
        self.robot.context.outputs.tell_effects(on);
    }

    /// From now on every statement that is told ([`Controller::trace`]) is told with this value before it; `None`: without.
    pub fn watch(&mut self, watched: Option<Watched>) {
        self.robot.context.outputs.watch(watched);
    }

    /// The present value in words; empty where there is none, as of a variable that is not in the selected file.
    pub fn read_watched(&self, watched: &Watched) -> String {
        self.robot.read_watched(watched)
    }

    /// The files of the RAM drive in alphabetical order, each with its content without EOF.
    pub fn files(&self) -> impl Iterator<Item = (&str, &[u8])> {
        self.robot.drive.files()
    }

    /// Whether a program runs in automatic operation.
    pub fn program_runs(&self) -> bool {
        self.robot.executor.program_runs()
    }

    /// Current file line of the program; 0 when no file is selected.
    pub fn line(&self) -> u32 {
        self.robot.executor.line()
    }

    /// The channel from which an INPUT waits for values.
    pub fn waits_for(&self) -> Option<Channel> {
        self.robot.executor.reading().next()
    }

    /// User outputs that are on, in the order of their numbers.
    pub fn outputs_on(&self) -> Vec<u16> {
        let bus = self.robot.context.config.options.field_bus;
        let lines = Signals::numbers().filter(|line| Signals::is_user_output(*line, bus));
        lines.filter(|line| self.robot.signals.output(*line)).collect()
    }

    /// Date and time now, as the error history writes it.
    pub fn calendar_now(&self) -> CalendarTime {
        self.robot.context.calendar()
    }

    /// Sets the date and time at [`Time::ZERO`](crate::time::Time::ZERO).
    pub fn set_calendar(&mut self, calendar: CalendarTime) {
        self.robot.context.config.calendar = calendar;
    }

    /// The Ethernet channels as of the last power-on.
    pub fn network(&self) -> &NetworkConfig {
        self.robot.parameters.network()
    }

    /// The virtual time up to which everything has happened.
    pub fn now(&self) -> Time {
        self.robot.context.now
    }

    /// Whether time may jump: no host is in the middle of a text or owes an answer, none has a watchdog armed (WD), and
    /// none holds a guided motion. While characters are on its line a host owes nothing.
    pub fn host_is_silent(&self) -> bool {
        !self.endpoints.host_owes_text()
            && self.robot.panel.state().watchdog.is_none()
            && !self.robot.arm.is_jogging()
    }

    /// The faults that are armed or were.
    pub fn faults(&self) -> &Faults {
        &self.endpoints.faults
    }

    /// This controller without faults and variation: what it does without them is compared with what it does.
    #[must_use]
    pub fn without_faults(&self) -> Controller {
        let mut copy = self.clone();
        copy.endpoints.faults = Faults::new(self.robot.context.config.fault_seed);
        copy.robot.context.fault_effects = FaultEffects::default();
        copy.endpoints.variation = None;
        copy.find_due();
        copy
    }

    /// Settings of a serial port as of the last power-on; `None` for the Ethernet channels.
    pub fn serial_line(&self, port: Port) -> Option<SerialSettings> {
        self.robot.parameters.serial_line(port)
    }

    /// How many bytes a serial line takes now without losing any: an edge that reads no more than this from its
    /// host loses nothing. `None` for the Ethernet channels.
    pub fn line_room(&self, port: Port) -> Option<usize> {
        self.endpoints.line_room(port)
    }

    /// The current position file of the SCARA edition (S28); no command is known that asks for it.
    pub fn current_position(&self) -> CurrentPosition {
        self.robot.current_position()
    }
}
