//! Makes requests: motions with their conditions, the bytes of a `PRINT`, signals, times. Values are checked for their range
//! here.
//!
//! The requests are defined in `request`; serving them is left to the caller.

use crate::prelude::*;

use super::arithmetic::unexpected;
use super::evaluate::Execution;
use super::functions::configuration;
use super::place::ValuePlace;
use super::{PendingRequest, Result};
use crate::builtin::Condition;
use crate::conditions::{Accuracy, Conditions, FULL, MAX_ACCEL};
use crate::request::{Channel, FaultKind, MAX_PRINT, Motion, Path, Request};
use crate::tree::{Ask, Change, Expression, Item, MotionKind, Node, PerAxis, Variable};
use crate::value::{Frame, Number, Position, Value};

/// Text that clears a receive buffer instead of being sent (BUF-03).
const BUFFER_RESET: &str = "BUFFRESET";
/// Most axes `MOVEA` and `MOVEI` can name.
pub(super) const MAX_AXIS: u8 = 8;
/// Width of the field of a number (PRT-04).
pub(crate) const FIELD: usize = 12;

impl Execution<'_> {
    /// The motion conditions as a statement changes them.
    pub fn changed(&mut self, change: &Change) -> Result<Conditions> {
        let mut conditions = self.memory.conditions().clone();
        match change {
            Change::Set(condition, value) => self.set(&mut conditions, *condition, value)?,
            Change::FreeLoad => conditions.payload = None,
            Change::Pass(on) => conditions.passing = *on,
            Change::Nowait(on) => conditions.nowait = *on,
            Change::PerAxis(condition, values) => {
                let percent = |value| self.percent("an axis", value, 0.0, FULL);
                let values = values.iter().map(percent).collect::<Result<Vec<f64>>>()?;
                let axes = match condition {
                    PerAxis::Gain => &mut conditions.gain,
                    PerAxis::Torque => &mut conditions.torque,
                };
                axes.iter_mut().zip(values).for_each(|(to, value)| *to = value);
            }
            Change::SetGain([axis, value]) => {
                let (axis, value) = (self.axis(axis)?, self.percent("an axis", value, 0.0, FULL)?);
                if let Some(to) = conditions.gain.get_mut(usize::from(axis) - 1) {
                    *to = value;
                }
            }
        }
        Ok(conditions)
    }

    /// Sets one condition to the value of an expression.
    fn set(&mut self, into: &mut Conditions, condition: Condition, value: &Expression) -> Result<()> {
        match condition {
            Condition::Speed => into.speed = self.percent("SPEED", value, 1.0, FULL)?,
            Condition::Accel => into.accel = self.percent("ACCEL", value, 1.0, MAX_ACCEL)?,
            Condition::Decel => into.decel = self.percent("DECEL", value, 1.0, MAX_ACCEL)?,
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
            Condition::Work => into.work = self.frame(value)?,
            Condition::Tool => into.tool = self.frame(value)?,
            Condition::Base => into.base = self.frame(value)?,
            Condition::Pass => {
                into.pass = self.percent("PASS", value, 0.0, FULL)?;
                into.passing = into.pass > 0.0;
            }
            Condition::Accur => {
                into.accuracy = match self.integer(value)? {
                    0 => Accuracy::Coarse,
                    1 => Accuracy::Fine,
                    other => {
                        return FaultKind::Range.fail(format!("ACCUR takes COARSE or FINE, found {other}"));
                    }
                }
            }
        }
        Ok(())
    }

    fn percent(&mut self, name: &str, value: &Expression, least: f64, most: f64) -> Result<f64> {
        let percent = self.double(value)?;
        if (least..=most).contains(&percent) {
            return Ok(percent);
        }
        FaultKind::Range.fail(format!("{name} takes {least} to {most}, found {percent}"))
    }

    /// Evaluates the operands of a statement and returns its request.
    pub fn request(&mut self, ask: &Ask) -> Result<PendingRequest> {
        let mut targets = Vec::new();
        let request = match ask {
            Ask::Move { motion, with } => self.motion(motion, with)?,
            Ask::Print { channel, items, cr } => self.print(*channel, items, *cr)?,
            Ask::Input(channel, variables) => {
                targets = self.places(variables)?;
                Request::Input {
                    channel: *channel,
                    expected: targets.len(),
                }
            }
            Ask::Task { target, block, .. } => {
                targets = self.places(target.as_slice())?;
                Request::Task { program: *block }
            }
            Ask::Delay(seconds) => Request::Delay {
                seconds: self.seconds("DELAY", seconds)?,
            },
            Ask::Outputs(lines) => {
                let lines = lines.iter().map(|line| self.signal(line));
                Request::Outputs(lines.collect::<Result<_>>()?)
            }
            Ask::Bcd(operands) => Request::Outputs(self.bcd_lines(operands)?),
            Ask::Pulse([line, seconds]) => self.pulse(line, seconds)?,
            Ask::Timer(seconds) => Request::SetTimer {
                seconds: self.double(seconds)?,
            },
            Ask::Restore(names) => Request::Restore {
                names: names.iter().map(|name| name.text.clone()).collect(),
            },
            Ask::Kill(task) => Request::Kill {
                task: self.integer(task)?,
            },
            Ask::Fixed(request) => request.clone(),
        };
        Ok(PendingRequest { request, targets })
    }

    /// The places of variables, in their order.
    fn places(&mut self, variables: &[Variable]) -> Result<Vec<ValuePlace>> {
        variables.iter().map(|variable| self.place(variable)).collect()
    }

    fn motion(&mut self, motion: &MotionKind, with: &[(Condition, Expression)]) -> Result<Request> {
        let mut conditions = self.memory.conditions().clone();
        let mut over_full: Option<f64> = None;
        for (condition, value) in with {
            self.set(&mut conditions, *condition, value)?;
            let percent = conditions.over_full(*condition);
            over_full = percent
                .map(|percent| over_full.map_or(percent, |other| other.max(percent)))
                .or(over_full);
        }
        Ok(Request::Move(Box::new(Motion {
            path: self.path(motion)?,
            conditions,
            over_full,
            own_frames: with.iter().any(|(condition, _)| condition.is_frame()),
        })))
    }

    fn pulse(&mut self, line: &Expression, seconds: &Expression) -> Result<Request> {
        let (line, on) = self.signal(line)?;
        if !on {
            return FaultKind::Range.fail(format!("PULOUT takes an output from 1 up, found -{line}"));
        }
        let seconds = self.seconds("PULOUT", seconds)?;
        Ok(Request::Pulse { line, seconds })
    }

    fn frame(&mut self, value: &Expression) -> Result<Frame> {
        let found = self.evaluate(value)?;
        let Value::Coordinate(trans) = found else {
            return Err(unexpected("coordinate data", &found));
        };
        Ok(Frame {
            name: name(value),
            trans: *trans,
        })
    }

    fn position(&mut self, value: &Expression) -> Result<Position> {
        let found = self.evaluate(value)?;
        let Value::Position(position) = found else {
            return Err(unexpected("positional data", &found));
        };
        Ok(*position)
    }

    fn path(&mut self, motion: &MotionKind) -> Result<Path> {
        Ok(match motion {
            MotionKind::Ptp(to) => Path::Ptp(self.position(to)?),
            MotionKind::Line(to) => Path::Line(self.position(to)?),
            MotionKind::Arc([via, end]) => Path::Arc {
                via: self.position(via)?,
                end: self.position(end)?,
            },
            MotionKind::Arch([end, gate]) => {
                let [retreat, single_axis_1, single_axis_2, ..] = self.position(gate)?.coords;
                Path::Arch {
                    end: self.position(end)?,
                    retreat,
                    single_axis_1,
                    single_axis_2,
                }
            }
            MotionKind::Axis([axis, value]) => Path::Axis {
                axis: self.axis(axis)?,
                value: self.double(value)?,
            },
            MotionKind::AxisBy([axis, delta]) => Path::AxisBy {
                axis: self.axis(axis)?,
                delta: self.double(delta)?,
            },
            MotionKind::Ready => Path::Ready,
        })
    }

    pub fn axis(&mut self, axis: &Expression) -> Result<u8> {
        let axis = self.integer(axis)?;
        match u8::try_from(axis) {
            Ok(number @ 1..=MAX_AXIS) => Ok(number),
            _ => FaultKind::Range.fail(format!("axes count from 1 to {MAX_AXIS}, found {axis}")),
        }
    }

    fn seconds(&mut self, name: &str, seconds: &Expression) -> Result<f64> {
        let seconds = self.double(seconds)?;
        if seconds < 0.0 {
            return FaultKind::Range.fail(format!("{name} takes seconds from 0 up, found {seconds}"));
        }
        Ok(seconds)
    }

    fn print(&mut self, channel: Channel, items: &[Item], cr: bool) -> Result<Request> {
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

/// The field of a number: right-aligned; integers decimal, reals with exactly three decimals rounded half away from
/// zero; what does not fit is twelve asterisks (PRT-04 to PRT-07, PRT-11, PRT-12).
fn field(number: Number) -> String {
    let text = match number {
        Number::Integer(value) => format!("{value}"),
        Number::Real(value) => {
            // A real has 24 significant bits, so thousandths of one that fits the field are exact in a double. What is
            // too large for the cast becomes its largest number, which does not fit either.
            let thousandths = libm::round(libm::fabs(f64::from(value) * 1000.0)) as u64;
            let sign = if value.is_sign_negative() { "-" } else { "" };
            format!("{sign}{}.{:03}", thousandths / 1000, thousandths % 1000)
        }
    };
    if text.len() > FIELD {
        "*".repeat(FIELD)
    } else {
        format!("{text:>FIELD$}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // clause: PRT-04 PRT-05 PRT-06 PRT-07 PRT-11 PRT-12
    #[test]
    fn fields_are_twelve_wide() {
        for (number, text) in [
            (Number::Integer(7), "           7"),
            (Number::Integer(1_234_567_890), "  1234567890"),
            (Number::Integer(-5), "          -5"),
            (Number::Integer(i32::MIN), " -2147483648"),
            (Number::Real(1.5), "       1.500"),
            (Number::Real(1234.5), "    1234.500"),
            (Number::Real(-12.25), "     -12.250"),
            (Number::Real(-1000.0 / 3.0), "    -333.333"),
            (Number::Real(2.0 / 3.0), "       0.667"),
            (Number::Real(0.0625), "       0.063"),
            (Number::Real(-0.0625), "      -0.063"),
            (Number::Real(12345.678), "   12345.678"),
            (Number::Real(99_999_990.0), "99999992.000"),
            (Number::Real(1e9), "************"),
            (Number::Real(-99_999_992.0), "************"),
            (Number::Real(f32::MAX), "************"),
        ] {
            assert_eq!(field(number), text);
        }
    }
}
