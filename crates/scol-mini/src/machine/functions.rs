//! Computes the functions of the language. Angles are in degrees. Results are computed in double precision and rounded to a
//! 32-bit real once.
//!
//! The table of functions and their arguments is in `builtin`.

use super::fast_sine;
use crate::prelude::*;

use super::Result;
use super::arithmetic::{binary, double, integer, real, single, truncated};
use super::evaluate::Execution;
use crate::MAX_BCD_DIGITS;
use crate::builtin::{Builtin, Numeric};
use crate::conditions::Conditions;
use crate::options::{Arm, LanguageOptions};
use crate::request::FaultKind;
use crate::tree::{Binary, Expression};
use crate::value::{Configuration, Number, Payload, Position, Trans, Value, ValueKind};

pub(super) const DEGREES: f64 = 180.0 / core::f64::consts::PI;

impl Execution<'_> {
    pub fn function(&mut self, builtin: Builtin, arguments: &[Expression]) -> Result<Value> {
        match builtin {
            Builtin::Din => self.signals(arguments, Self::input),
            Builtin::Dout => self.signals(arguments, |execution, line| Ok(execution.inputs.dout(line))),
            Builtin::Bcdin => self.bcd_in(arguments),
            Builtin::Gain => self.of_axis(arguments, |conditions| &conditions.gain),
            Builtin::Torque => self.of_axis(arguments, |conditions| &conditions.torque),
            Builtin::Trans => Ok(Trans::from_leading(self.arm(), &self.doubles(arguments)?).into()),
            Builtin::Payload => Ok(Payload::from_leading(&self.doubles(arguments)?).into()),
            Builtin::Point => {
                let numbers = self.doubles(arguments)?;
                self.point(&numbers)
            }
            Builtin::Max => Ok(self.extreme(arguments, |a, b| a > b)?.into()),
            Builtin::Min => Ok(self.extreme(arguments, |a, b| a < b)?.into()),
            // The compiler makes them an instruction of their own.
            Builtin::Numeric(_) => FaultKind::Type.fail("a function of numbers takes numbers"),
        }
    }

    /// The largest or smallest; real when any is real.
    fn extreme(&mut self, arguments: &[Expression], better: impl Fn(f64, f64) -> bool) -> Result<Number> {
        let (mut best, mut any_real) = (None, false);
        for argument in arguments {
            let number = self.number(argument)?;
            any_real |= matches!(number, Number::Real(_));
            if best.is_none_or(|best| better(double(number), double(best))) {
                best = Some(number);
            }
        }
        Ok(match best {
            Some(Number::Integer(value)) if !any_real => Number::Integer(value),
            best => Number::Real(best.map_or(0.0, double) as f32),
        })
    }

    /// `DIN(a, -b)`: 1 when all are on, those with a minus sign off.
    fn signals(
        &mut self,
        arguments: &[Expression],
        state: impl Fn(&Self, u16) -> Result<bool>,
    ) -> Result<Value> {
        let mut all = true;
        for argument in arguments {
            let (line, on) = self.signal(argument)?;
            all &= state(self, line)? == on;
        }
        Ok(Value::Integer(i32::from(all)))
    }

    fn input(&self, line: u16) -> Result<bool> {
        if self.inputs.has_input(line) {
            return Ok(self.inputs.din(line));
        }
        FaultKind::Range.fail(format!("there is no input {line}"))
    }

    /// The value of one axis, counted from 1.
    fn of_axis(&mut self, arguments: &[Expression], values: impl Fn(&Conditions) -> &[f64]) -> Result<Value> {
        let axis = arguments.first().map_or(Ok(1), |axis| self.axis(axis))?;
        let value = values(self.memory.conditions()).get(usize::from(axis).saturating_sub(1));
        Ok(Value::Real(value.copied().unwrap_or_default() as f32))
    }

    /// `BCDIN(first, digits)`: four inputs a digit, both with the lowest first.
    fn bcd_in(&mut self, arguments: &[Expression]) -> Result<Value> {
        let [first, digits] = arguments else {
            return FaultKind::Type.fail("BCDIN takes 2 arguments");
        };
        let (first, digits) = self.bcd_field(first, digits)?;
        let mut value = 0_i32;
        for digit in (0..digits).rev() {
            let line = first + digit * 4;
            let mut figure = 0;
            for bit in (0..4).rev() {
                figure = figure * 2 + i32::from(self.input(line + bit)?);
            }
            if figure > 9 {
                let message = format!("the inputs from {line} show {figure}, which is not a decimal digit");
                return FaultKind::Range.fail(message);
            }
            value = value * 10 + figure;
        }
        Ok(Value::Integer(value))
    }

    /// The outputs of `BCDOUT(first, digits, value)`.
    pub fn bcd_lines(&mut self, [first, digits, value]: &[Expression; 3]) -> Result<Vec<(u16, bool)>> {
        let (first, digits) = self.bcd_field(first, digits)?;
        let value = self.integer(value)?;
        let mut rest = value;
        let mut lines = Vec::new();
        for digit in 0..digits {
            let figure = rest % 10;
            rest /= 10;
            lines.extend((0..4).map(|bit| (first + digit * 4 + bit, figure >> bit & 1 == 1)));
        }
        if value < 0 || rest > 0 {
            return FaultKind::Range.fail(format!("BCDOUT has {digits} digits, found {value}"));
        }
        Ok(lines)
    }

    /// First signal and count of digits; the last signal has a number too.
    fn bcd_field(&mut self, first: &Expression, digits: &Expression) -> Result<(u16, u16)> {
        let (first, digits) = (self.signal(first)?, self.integer(digits)?);
        let most = MAX_BCD_DIGITS as u16;
        match (first, u16::try_from(digits)) {
            ((line, true), Ok(digits)) if (1..=most).contains(&digits) && line <= u16::MAX - 4 * most => {
                Ok((line, digits))
            }
            _ => {
                let expected = format!("expected a first signal and 1 to {most} digits");
                FaultKind::Range.fail(format!("{expected}, found {digits} digits"))
            }
        }
    }

    /// A signal and the state its sign names.
    pub fn signal(&mut self, argument: &Expression) -> Result<(u16, bool)> {
        let number = self.integer(argument)?;
        match u16::try_from(number.unsigned_abs()) {
            Ok(line) if line > 0 => Ok((line, number > 0)),
            _ => FaultKind::Range.fail(format!("there is no signal {number}")),
        }
    }

    fn doubles(&mut self, arguments: &[Expression]) -> Result<Vec<f64>> {
        arguments.iter().map(|argument| self.double(argument)).collect()
    }

    fn arm(&self) -> Arm {
        self.program.options.arm
    }

    /// `POINT(...)`: the coordinates, and after them the configuration; what is left out is 0.
    fn point(&self, numbers: &[f64]) -> Result<Value> {
        let arm = self.arm();
        let width = ValueKind::Position.width(arm);
        let (coords, config) = numbers.split_at_checked(width).unwrap_or((numbers, &[]));
        let mut position = Position::from_leading(coords);
        if let Some(number) = config.first() {
            position.config = configuration(arm, *number)?;
        }
        Ok(position.into())
    }
}

/// The configuration of a number.
pub(super) fn configuration(arm: Arm, number: f64) -> Result<Configuration> {
    Configuration::listed(arm, number as i64).ok_or_else(|| {
        let form = match arm {
            Arm::SixAxis => "five digits 0 to 2",
            Arm::Scara => "0, 1 or 2",
        };
        FaultKind::Range.error(format!("a configuration is {form}, found {number}"))
    })
}

/// A function of one or two numbers.
pub(super) fn numeric(
    function: Numeric,
    first: Number,
    second: Number,
    options: &LanguageOptions,
) -> Result<Number> {
    match (function, first) {
        (Numeric::Mod, _) => binary(Binary::Modulo, first, second, options),
        (Numeric::Int, Number::Integer(value)) => Ok(Number::Integer(value)),
        (Numeric::Int, Number::Real(value)) => truncated(value).map(Number::Integer),
        (Numeric::Abs, Number::Integer(value)) => integer(value.checked_abs()),
        (Numeric::Abs, Number::Real(value)) => Ok(Number::Real(libm::fabsf(value))),
        (Numeric::Sgn, _) => {
            let value = double(first);
            Ok(Number::Integer(i32::from(value > 0.0) - i32::from(value < 0.0)))
        }
        _ => {
            let result = scalar(function, double(first), double(second));
            if result.is_nan() {
                let (word, x) = (Builtin::Numeric(function).keyword(), single(first));
                return FaultKind::Domain.fail(format!("{word} is not defined for {x}"));
            }
            real(result as f32)
        }
    }
}

/// The sine of an angle in degrees plus a number of quarter turns, exact at quarter turns: SIN(180) and COS(270) are 0,
/// so TAN(90) has no value. One quarter turn makes it the cosine.
pub(super) fn sine(quarters: i32, degrees: f64) -> f64 {
    // A real has 24 significant bits: below the bound the rest of whole quarter turns is exact without this.
    let within = match libm::fabs(degrees) < 1e6 {
        true => degrees,
        false => libm::fmod(degrees, 360.0),
    };
    // Which way half a quarter turn is rounded does not matter: the sine of 45 degrees is its cosine.
    let nearest = (within * (1.0 / 90.0) + libm::copysign(0.5, within)) as i32;
    let rest = (within - f64::from(nearest) * 90.0) / DEGREES;
    let value = match (nearest + quarters).rem_euclid(4) {
        0 => libm::sin(rest),
        1 => libm::cos(rest),
        2 => -libm::sin(rest),
        _ => -libm::cos(rest),
    };
    // Plus 0.0 makes a zero positive.
    value + 0.0
}

/// Functions of one or two reals; NaN outside the domain, and for functions that tell integers from reals.
fn scalar(function: Numeric, x: f64, y: f64) -> f64 {
    match function {
        // The result is rounded to a real, so the fast value is the same.
        Numeric::Sin => fast_sine::sine(x).map_or_else(|| sine(0, x), f64::from),
        Numeric::Cos => fast_sine::sine(x + 90.0).map_or_else(|| sine(1, x), f64::from),
        Numeric::Tan => match sine(1, x) {
            0.0 => f64::NAN,
            cosine => sine(0, x) / cosine + 0.0,
        },
        Numeric::Asin => libm::asin(x) * DEGREES,
        Numeric::Acos => libm::acos(x) * DEGREES,
        Numeric::Atan => libm::atan(x) * DEGREES,
        Numeric::Atan2 => libm::atan2(x, y) * DEGREES,
        Numeric::Sqrt => libm::sqrt(x),
        Numeric::Real => x,
        Numeric::Exp => libm::exp(x),
        Numeric::Ln | Numeric::Log10 if x <= 0.0 => f64::NAN,
        Numeric::Ln => libm::log(x),
        Numeric::Log10 => libm::log10(x),
        Numeric::Int | Numeric::Abs | Numeric::Sgn | Numeric::Mod => f64::NAN,
    }
}
