//! What statements want from the world: motions with their conditions, and the bytes of a `PRINT`.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use super::Trouble;
use super::evaluate::Context;
use super::functions::configuration;
use super::print::field;
use crate::conditions::{Conditions, Frame as System};
use crate::request::{Channel, FaultKind, MAX_PRINT, Path, Request};
use crate::tree::{Condition, Course, Expression, Item, Node};
use crate::value::{Position, Value};

/// Text that clears a receive buffer instead of being sent (BUF-03).
const BUFFER_RESET: &str = "BUFFRESET";
/// Most axes `MOVEA` and `MOVEI` can name.
const MAX_AXIS: i32 = 8;

impl Context<'_> {
    /// Sets one condition to the value of an expression.
    pub fn set(
        &self,
        into: &mut Conditions,
        condition: Condition,
        value: &Expression,
    ) -> Result<(), Trouble> {
        match condition {
            Condition::Speed => into.speed = self.percent("SPEED", value)?,
            Condition::Accel => into.accel = self.percent("ACCEL", value)?,
            Condition::Decel => into.decel = self.percent("DECEL", value)?,
            Condition::Config => {
                into.config = configuration(self.program.options.arm, self.double(value)?)?;
            }
            Condition::Payload => match self.evaluate(value)? {
                Value::Load(load) => into.payload = Some((name(value), load)),
                other => return Err(wrong("load data", &other)),
            },
            Condition::Work => into.work = self.system_frame(value)?,
            Condition::Tool => into.tool = self.system_frame(value)?,
            Condition::Base => into.base = self.system_frame(value)?,
        }
        Ok(())
    }

    fn percent(&self, name: &str, value: &Expression) -> Result<f64, Trouble> {
        let percent = self.double(value)?;
        if (1.0..=100.0).contains(&percent) {
            return Ok(percent);
        }
        Err(Trouble::new(
            FaultKind::Range,
            format!("{name} takes 1 to 100, found {percent}"),
        ))
    }

    fn system_frame(&self, value: &Expression) -> Result<System, Trouble> {
        match self.evaluate(value)? {
            Value::Coordinate(trans) => Ok(System {
                name: name(value),
                trans,
            }),
            other => Err(wrong("coordinate data", &other)),
        }
    }

    fn position(&self, value: &Expression) -> Result<Position, Trouble> {
        match self.evaluate(value)? {
            Value::Position(position) => Ok(position),
            other => Err(wrong("positional data", &other)),
        }
    }

    pub fn path(&self, course: &Course) -> Result<Path, Trouble> {
        Ok(match course {
            Course::Ptp(to) => Path::Ptp(self.position(to)?),
            Course::Line(to) => Path::Line(self.position(to)?),
            Course::Arc(via, end) => Path::Arc {
                via: self.position(via)?,
                end: self.position(end)?,
            },
            Course::Arch(end, gate) => {
                let [rise, height, descent, ..] = self.position(gate)?.coords;
                Path::Arch {
                    end: self.position(end)?,
                    rise,
                    height,
                    descent,
                }
            }
            Course::Axis(axis, value) => Path::Axis {
                axis: self.axis(axis)?,
                value: self.double(value)?,
            },
            Course::AxisBy(axis, delta) => Path::AxisBy {
                axis: self.axis(axis)?,
                delta: self.double(delta)?,
            },
            Course::Ready => Path::Ready,
        })
    }

    fn axis(&self, axis: &Expression) -> Result<u8, Trouble> {
        let axis = self.integer(axis)?;
        match u8::try_from(axis) {
            Ok(number) if (1..=MAX_AXIS).contains(&axis) => Ok(number),
            _ => Err(Trouble::new(
                FaultKind::Range,
                format!("axes count from 1 to {MAX_AXIS}, found {axis}"),
            )),
        }
    }

    /// The request of a DELAY.
    pub fn delay(&self, seconds: &Expression) -> Result<Request, Trouble> {
        let seconds = self.double(seconds)?;
        if seconds < 0.0 {
            let message = format!("DELAY takes seconds from 0 up, found {seconds}");
            return Err(Trouble::new(FaultKind::Range, message));
        }
        Ok(Request::Delay { seconds })
    }

    pub fn print(&self, channel: Channel, items: &[Item], cr: bool) -> Result<Request, Trouble> {
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
        if cr {
            data.push(b'\r');
        }
        data.truncate(MAX_PRINT);
        Ok(Request::Print { channel, data })
    }
}

/// The name of a plain variable, which SF reports.
fn name(value: &Expression) -> Option<String> {
    match &value.node {
        Node::Variable(variable) if variable.subscripts.is_empty() => Some(variable.name.text.clone()),
        _ => None,
    }
}

fn wrong(expected: &str, found: &Value) -> Trouble {
    Trouble::new(
        FaultKind::Type,
        format!("expected {expected}, found {}", found.kind().word()),
    )
}
