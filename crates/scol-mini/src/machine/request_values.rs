//! Makes requests: motions with their conditions, the bytes of a `PRINT`, signals, times. Values are checked for their range
//! here.
//!
//! The requests are defined in `request`; serving them is left to the caller.

use alloc::boxed::Box;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use super::evaluate::{Context, unexpected};
use super::functions::configuration;
use super::place::ValuePlace;
use super::print::field;
use super::{PendingRequest, Result, RuntimeError};
use crate::conditions::{Accuracy, Condition, Conditions};
use crate::request::{Channel, FaultKind, MAX_PRINT, Motion, Path, Request};
use crate::tree::{Expression, Item, MotionKind, Node, Simple, Variable};
use crate::value::{Frame as System, Position, Value};

/// Text that clears a receive buffer instead of being sent (BUF-03).
const BUFFER_RESET: &str = "BUFFRESET";
/// Most axes `MOVEA` and `MOVEI` can name.
const MAX_AXIS: i32 = 8;

impl Context<'_> {
    /// Sets one condition to the value of an expression.
    pub fn set(&self, into: &mut Conditions, condition: Condition, value: &Expression) -> Result<()> {
        match condition {
            Condition::Speed => into.speed = self.percent("SPEED", value)?,
            Condition::Accel => into.accel = self.percent("ACCEL", value)?,
            Condition::Decel => into.decel = self.percent("DECEL", value)?,
            Condition::Config => {
                into.config = configuration(self.program.options.arm, self.double(value)?)?;
            }
            Condition::Payload => {
                let found = self.evaluate(value)?;
                let Value::Load(load) = found else {
                    return Err(unexpected("load data", &found));
                };
                into.payload = Some((name(value), *load));
            }
            Condition::Work => into.work = self.system_frame(value)?,
            Condition::Tool => into.tool = self.system_frame(value)?,
            Condition::Base => into.base = self.system_frame(value)?,
            Condition::Pass => {
                into.pass = self.within("PASS", value, 0.0)?;
                into.passing = into.pass > 0.0;
            }
            Condition::Accur => {
                into.accuracy = match self.integer(value)? {
                    0 => Accuracy::Coarse,
                    1 => Accuracy::Fine,
                    other => {
                        let message = format!("ACCUR takes COARSE or FINE, found {other}");
                        return Err(RuntimeError::new(FaultKind::Range, message));
                    }
                }
            }
        }
        Ok(())
    }

    fn percent(&self, name: &str, value: &Expression) -> Result<f64> {
        self.within(name, value, 1.0)
    }

    fn within(&self, name: &str, value: &Expression, least: f64) -> Result<f64> {
        let percent = self.double(value)?;
        if (least..=100.0).contains(&percent) {
            return Ok(percent);
        }
        Err(RuntimeError::new(
            FaultKind::Range,
            format!("{name} takes {least} to 100, found {percent}"),
        ))
    }

    /// A gain or torque.
    pub fn axis_percent(&self, value: &Expression) -> Result<f64> {
        self.within("an axis", value, 0.0)
    }

    /// Gains or torques, axis 1 first.
    pub fn per_axis(&self, values: &[Expression]) -> Result<Vec<f64>> {
        values.iter().map(|value| self.axis_percent(value)).collect()
    }

    /// What a statement asks for; `None` for one that asks for nothing.
    pub fn request(&self, simple: &Simple) -> Result<Option<PendingRequest>> {
        let mut targets = Vec::new();
        let request = match simple {
            Simple::Move { motion, with } => self.motion(motion, with)?,
            Simple::Print { channel, items, cr } => self.print(*channel, items, *cr)?,
            Simple::Input {
                channel,
                targets: variables,
            } => {
                targets = self.places(variables)?;
                Request::Input {
                    channel: *channel,
                    expected: targets.len(),
                }
            }
            Simple::Task { target, block, .. } => {
                targets = self.places(target.as_slice())?;
                Request::Task { program: *block }
            }
            Simple::Delay(seconds) => Request::Delay {
                seconds: self.seconds("DELAY", seconds)?,
            },
            Simple::Outputs(lines) => Request::Outputs(
                lines
                    .iter()
                    .map(|line| self.signal(line))
                    .collect::<Result<_>>()?,
            ),
            Simple::Bcd([first, digits, value]) => Request::Outputs(self.bcd_lines(first, digits, value)?),
            Simple::Hand { hand, open, at_once } => Request::Hand {
                hand: *hand,
                open: *open,
                at_once: *at_once,
            },
            Simple::Pulse(line, seconds) => self.pulse(line, seconds)?,
            Simple::Break => Request::Break,
            Simple::Pause => Request::Pause,
            Simple::Resume => Request::Resume,
            Simple::Timer(seconds) => Request::SetTimer {
                seconds: self.double(seconds)?,
            },
            Simple::Yield => Request::Switch,
            Simple::Restore(names) => Request::Restore {
                names: names.iter().map(|name| name.text.clone()).collect(),
            },
            Simple::Kill(task) => Request::Kill {
                task: self.integer(task)?,
            },
            Simple::Stop => Request::Stop,
            Simple::Assign { .. }
            | Simple::Set(..)
            | Simple::FreeLoad
            | Simple::Switch(..)
            | Simple::Ignore
            | Simple::PerAxis(..)
            | Simple::SetGain(..) => return Ok(None),
        };
        Ok(Some(PendingRequest { request, targets }))
    }

    /// The places of variables, in their order.
    fn places(&self, variables: &[Variable]) -> Result<Vec<ValuePlace>> {
        variables.iter().map(|variable| self.place(variable)).collect()
    }

    fn motion(&self, motion: &MotionKind, with: &[(Condition, Expression)]) -> Result<Request> {
        let mut conditions = self.memory.conditions().clone();
        for (condition, value) in with {
            self.set(&mut conditions, *condition, value)?;
        }
        Ok(Request::Move(Box::new(Motion {
            path: self.path(motion)?,
            conditions,
            own_frames: with.iter().any(|(condition, _)| condition.is_frame()),
        })))
    }

    fn pulse(&self, line: &Expression, seconds: &Expression) -> Result<Request> {
        match self.signal(line)? {
            (line, true) => Ok(Request::Pulse {
                line,
                seconds: self.seconds("PULOUT", seconds)?,
            }),
            (line, false) => {
                let message = format!("PULOUT takes an output from 1 up, found -{line}");
                Err(RuntimeError::new(FaultKind::Range, message))
            }
        }
    }

    fn system_frame(&self, value: &Expression) -> Result<System> {
        let found = self.evaluate(value)?;
        let Value::Coordinate(trans) = found else {
            return Err(unexpected("coordinate data", &found));
        };
        Ok(System {
            name: name(value),
            trans: *trans,
        })
    }

    fn position(&self, value: &Expression) -> Result<Position> {
        let found = self.evaluate(value)?;
        let Value::Position(position) = found else {
            return Err(unexpected("positional data", &found));
        };
        Ok(*position)
    }

    fn path(&self, motion: &MotionKind) -> Result<Path> {
        Ok(match motion {
            MotionKind::Ptp(to) => Path::Ptp(self.position(to)?),
            MotionKind::Line(to) => Path::Line(self.position(to)?),
            MotionKind::Arc(via, end) => Path::Arc {
                via: self.position(via)?,
                end: self.position(end)?,
            },
            MotionKind::Arch(end, gate) => {
                let [rise, height, descent, ..] = self.position(gate)?.coords;
                Path::Arch {
                    end: self.position(end)?,
                    rise,
                    height,
                    descent,
                }
            }
            MotionKind::Axis(axis, value) => Path::Axis {
                axis: self.axis(axis)?,
                value: self.double(value)?,
            },
            MotionKind::AxisBy(axis, delta) => Path::AxisBy {
                axis: self.axis(axis)?,
                delta: self.double(delta)?,
            },
            MotionKind::Ready => Path::Ready,
        })
    }

    pub fn axis(&self, axis: &Expression) -> Result<u8> {
        let axis = self.integer(axis)?;
        match u8::try_from(axis) {
            Ok(number) if (1..=MAX_AXIS).contains(&axis) => Ok(number),
            _ => Err(RuntimeError::new(
                FaultKind::Range,
                format!("axes count from 1 to {MAX_AXIS}, found {axis}"),
            )),
        }
    }

    fn seconds(&self, name: &str, seconds: &Expression) -> Result<f64> {
        let seconds = self.double(seconds)?;
        if seconds < 0.0 {
            let message = format!("{name} takes seconds from 0 up, found {seconds}");
            return Err(RuntimeError::new(FaultKind::Range, message));
        }
        Ok(seconds)
    }

    fn print(&self, channel: Channel, items: &[Item], cr: bool) -> Result<Request> {
        if let ([Item::Text(text)], false) = (items, cr)
            && text == BUFFER_RESET
            && channel != Channel::Tp
        {
            return Ok(Request::BufferReset { channel });
        }
        let mut data = Vec::new();
        for item in items {
            match item {
                Item::Text(text) => data.extend_from_slice(text.as_bytes()),
                Item::Value(value) => data.extend_from_slice(field(self.number(value)?).as_bytes()),
            }
        }
        let room = MAX_PRINT - usize::from(cr);
        let cut = data.len().saturating_sub(room);
        data.truncate(room);
        if cr {
            data.push(b'\r');
        }
        Ok(Request::Print { channel, data, cut })
    }
}

/// The name of a plain variable, which SF reports.
fn name(value: &Expression) -> Option<String> {
    let Node::Variable(variable) = &value.node else {
        return None;
    };
    variable.subscripts.is_empty().then(|| variable.name.text.clone())
}
