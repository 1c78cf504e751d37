//! The interface between a running program and the world: pauses, requests, answers and faults.
//!
//! Nothing here does anything: serving a request is left to the caller. `machine::request_values` makes the requests.

use crate::prelude::*;

use crate::conditions::Conditions;
use crate::value::{Number, Position};

/// Most bytes one `PRINT` sends; the rest is cut off before its CR (SER-03).
pub const MAX_PRINT: usize = 256;

/// Values outside of the program that expressions may read.
pub trait Inputs {
    /// State of an input signal, counted from 1.
    fn din(&self, line: u16) -> bool;
    /// Whether there is an input signal of this number; one that is not there cannot be read.
    fn has_input(&self, _line: u16) -> bool {
        true
    }
    /// State of an output signal, counted from 1.
    fn dout(&self, line: u16) -> bool;
    /// `MOTION`: how much of the present motion is done, in percent; 100 when the arm is at rest.
    fn motion_percent(&self) -> f64;
    /// `HERE`: the present position.
    fn here(&self) -> Position;
    /// `MODE`: the operation mode, numbered by the outside.
    fn mode(&self) -> i32;
    /// `TIMER`: the running timer, in seconds.
    fn timer(&self) -> f64 {
        0.0
    }
    /// `MOTIONT`: seconds since the present motion began; 0 when the arm is at rest.
    fn motion_seconds(&self) -> f64 {
        0.0
    }
    /// `REMAINT`: remaining seconds of the present motion; 0 when the arm is at rest.
    fn remaining_seconds(&self) -> f64 {
        0.0
    }
    /// `DEST`: where the present motion leads; `HERE` when the arm is at rest.
    fn destination(&self) -> Position {
        self.here()
    }
}

/// The robot that a program is checked for: the lines it has, and what its arm can do.
pub trait Robot {
    /// Whether DIN can read this line.
    fn has_input(&self, line: u16) -> bool;
    /// Why the robot raises an alarm instead of doing this, if it does whatever the state it is in.
    ///
    /// The requests are those of constants: outputs and pulses, and motions to one position or of one axis. A motion
    /// of an axis by 0 asks whether the arm has the axis.
    fn refusal(&self, request: &Request) -> Option<String>;
}

/// The reason for which the machine returned.
#[derive(Debug, Clone, PartialEq)]
pub enum Pause {
    /// The fuel is used up, or the caller has to act (a new monitor, another coordinate system); the machine is before a
    /// statement.
    Fuel,
    /// The current statement makes a request; reply with `answer`.
    Request(Request),
    /// The condition of a `WAIT` is false; run again to evaluate it again.
    Waiting,
    /// The main program has come to its `END` (or `RETURN`).
    Ended,
    /// The statement cannot be executed; the machine stays on it.
    Fault(Fault),
}

/// Request of a statement to the outside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Request {
    /// Move the arm; answer when the next statement may run.
    Move(Box<Motion>),
    /// Send these bytes, at most [`MAX_PRINT`], as one text.
    Print {
        channel: Channel,
        /// The bytes; the CR at their end, if the statement has one, is never cut.
        data: Vec<u8>,
        /// Number of further bytes that the statement has.
        cut: usize,
    },
    /// Discard what the channel has received (BUF-01); never for the teach pendant.
    BufferReset { channel: Channel },
    /// Read numbers.
    Input {
        channel: Channel,
        /// Number of values.
        expected: usize,
    },
    /// Let time pass.
    Delay {
        /// Seconds, not negative, finite.
        seconds: f64,
    },
    /// Switch output signals, in this order; numbers count from 1.
    Outputs(Vec<(u16, bool)>),
    /// `STOP`: stop the execution; after the answer the next statement follows.
    Stop,
    /// Open or close a hand.
    Hand {
        /// 1 or 2.
        hand: u8,
        /// `OPEN`, not `CLOSE`.
        open: bool,
        /// `OPENI`, `CLOSEI`: without waiting for the end of the motion.
        at_once: bool,
    },
    /// `PULOUT`: switch an output on and, without waiting, off again.
    Pulse {
        /// The output, from 1.
        line: u16,
        /// Seconds, not negative, finite.
        seconds: f64,
    },
    /// `ACCEL = ...` or `DECEL = ...` asks for more than [`FULL`](crate::FULL); it is set already.
    OverFull {
        /// Percent, at most [`MAX_ACCEL`](crate::MAX_ACCEL).
        percent: f64,
    },
    /// `BREAK`: give up the motion under way.
    Break,
    /// `PAUSE`: hold the motion.
    Pause,
    /// `RESUME`: continue a motion held by `PAUSE`.
    Resume,
    /// `TIMER = ...`: set the timer, in seconds.
    SetTimer {
        /// The new value of the timer.
        seconds: f64,
    },
    /// `TASK`: start a program; the answer is its task ID.
    Task {
        /// Number of the PROGRAM block, from 0.
        program: usize,
    },
    /// `SWITCH`: let another task run.
    Switch,
    /// `RESTORE`: write values into the file, as [`restore_values`](crate::restore_values) does.
    Restore {
        /// Names of GLOBAL and DATA; none: all.
        names: Vec<String>,
    },
    /// `KILL`: end a task.
    Kill {
        /// Its ID.
        task: i32,
    },
}

/// Answer to a [`Request`].
#[derive(Debug, Clone, PartialEq)]
pub enum Answer {
    /// The request was served.
    Done,
    /// The numbers of an `INPUT`, exactly as many as expected, or the ID of a `TASK`.
    Values(Vec<Number>),
    /// The numbers of an `INPUT` that was cut short; the other variables become 0 (INP-10).
    Cancelled(Vec<Number>),
}

/// A motion with its conditions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    pub path: Path,
    /// The conditions with the `WITH` clause applied.
    pub conditions: Conditions,
    /// `WITH` sets ACCEL or DECEL to this many percent, more than [`FULL`](crate::FULL); the greater of the two.
    pub over_full: Option<f64>,
    /// `WITH` names a coordinate system: those of `conditions` apply during this motion only.
    pub own_frames: bool,
}

/// Way and target of a motion. Positions are still relative to their own coordinate system.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Path {
    /// `MOVE`: all axes at once.
    Ptp(Position),
    /// `MOVES`: the tool point goes straight.
    Line(Position),
    /// `MOVEC`: the tool point follows an arc.
    Arc {
        /// A point the arc passes.
        via: Position,
        end: Position,
    },
    /// `MOVEJ`: up, across, down (ste85409 L69).
    Arch {
        end: Position,
        /// Height of the way across over the higher of start and end, mm.
        retreat: f64,
        /// Straight up before the way across begins, mm.
        single_axis_1: f64,
        /// Straight down after the way across, mm.
        single_axis_2: f64,
    },
    /// `MOVEA`: one axis to a value.
    Axis {
        /// Axis, counted from 1, at most 8.
        axis: u8,
        /// Degrees or mm.
        value: f64,
    },
    /// `MOVEI`: one axis by a difference.
    AxisBy {
        /// Axis, counted from 1, at most 8.
        axis: u8,
        /// Degrees or mm.
        delta: f64,
    },
    /// `READY`: to the origin posture of the machine.
    Ready,
}

/// A channel of `PRINT` and `INPUT`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Channel {
    /// Teach pendant, the default (PRT-02, INP-02).
    Tp,
    /// Serial port COM1.
    Com1,
    /// Ethernet port IP1.
    Ip1,
    /// Ethernet port IP2.
    Ip2,
}

/// Why a statement could not be executed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("line {line}: {message}")]
pub struct Fault {
    /// The class, for the alarm.
    pub kind: FaultKind,
    /// File line of the statement, from 1.
    pub line: u32,
    /// Message, with what was expected and what was found.
    pub message: String,
}

/// The classes of faults.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum FaultKind {
    /// Division by zero, also of `MOD`.
    DivisionByZero,
    /// A variable without a value was read.
    Undefined,
    /// A value of the wrong kind.
    Type,
    /// A number outside what the statement takes.
    Range,
    /// An array element that does not exist.
    Subscript,
    /// Calls nested too deeply.
    Nesting,
    /// A result too large for its kind.
    Overflow,
    /// A `NEXT` whose `FOR` was not executed.
    NextWithoutFor,
    /// A function outside its domain (`SQRT(-1)`).
    Domain,
}
