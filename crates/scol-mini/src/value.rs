//! The five kinds of values of the language and the order of their numbers.
//!
//! How values travel over the protocol is left to the protocol crate; computing with them is in `machine::evaluate`.

use crate::prelude::*;
use alloc::sync::Arc;

use crate::options::Arm;

/// The kind of a value; the protocol's type codes 0 to 4 in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum ValueKind {
    /// 32-bit signed integer.
    Integer,
    /// 32-bit float.
    Real,
    /// Load data (`PAYLOAD`).
    Load,
    /// Coordinate data (`TRANS`).
    Coordinate,
    /// Positional data (`POINT`).
    Position,
}

impl ValueKind {
    /// All of them, in the order of the type codes.
    pub const ALL: [ValueKind; 5] = [
        ValueKind::Integer,
        ValueKind::Real,
        ValueKind::Load,
        ValueKind::Coordinate,
        ValueKind::Position,
    ];

    /// Its word in documents of the control interface and for debuggers.
    pub fn word(self) -> &'static str {
        match self {
            ValueKind::Integer => "integer",
            ValueKind::Real => "real",
            ValueKind::Load => "load",
            ValueKind::Coordinate => "coordinate",
            ValueKind::Position => "position",
        }
    }

    /// The kind as messages name it, with its article.
    pub fn description(self) -> &'static str {
        match self {
            ValueKind::Integer => "an integer",
            ValueKind::Real => "a real",
            ValueKind::Load => "load data",
            ValueKind::Coordinate => "coordinate data",
            ValueKind::Position => "positional data",
        }
    }

    /// The zero of the kind.
    #[must_use]
    pub fn zero(self) -> Value {
        match self {
            ValueKind::Integer => Value::Integer(0),
            ValueKind::Real => Value::Real(0.0),
            ValueKind::Load => Payload::default().into(),
            ValueKind::Coordinate => Trans::default().into(),
            ValueKind::Position => Position::default().into(),
        }
    }

    /// Number of values that DATA has for it on this arm, without the configuration of a position.
    pub fn width(self, arm: Arm) -> usize {
        match (self, arm) {
            (ValueKind::Position, _) => arm.coordinates().len(),
            (ValueKind::Coordinate, _) => Trans::order(arm).len(),
            (ValueKind::Load, Arm::SixAxis) => 7,
            (ValueKind::Load, Arm::Scara) => 2,
            (ValueKind::Integer | ValueKind::Real, _) => 1,
        }
    }

    /// `true` for integer and real.
    pub fn is_number(self) -> bool {
        matches!(self, ValueKind::Integer | ValueKind::Real)
    }
}

/// A number of the language; one that was received tells by its decimal point which it is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Number {
    /// Written without a decimal point.
    Integer(i32),
    /// Written with one.
    Real(f32),
}

/// A value of the language: a number, or a box, because machines pass mostly numbers around.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Value {
    Integer(i32),
    Real(f32),
    /// Load data.
    Load(Box<Payload>),
    /// Coordinate data.
    Coordinate(Box<Trans>),
    /// Positional data.
    Position(Box<Position>),
}

impl Value {
    /// The kind of this value.
    pub fn kind(&self) -> ValueKind {
        match self {
            Value::Integer(_) => ValueKind::Integer,
            Value::Real(_) => ValueKind::Real,
            Value::Load(_) => ValueKind::Load,
            Value::Coordinate(_) => ValueKind::Coordinate,
            Value::Position(_) => ValueKind::Position,
        }
    }

    /// The number, if it is one.
    #[inline]
    pub(crate) fn number(&self) -> Option<Number> {
        match self {
            Value::Integer(value) => Some(Number::Integer(*value)),
            Value::Real(value) => Some(Number::Real(*value)),
            Value::Load(_) | Value::Coordinate(_) | Value::Position(_) => None,
        }
    }
}

impl From<Number> for Value {
    fn from(number: Number) -> Self {
        match number {
            Number::Integer(value) => Value::Integer(value),
            Number::Real(value) => Value::Real(value),
        }
    }
}

impl From<Payload> for Value {
    fn from(load: Payload) -> Self {
        Value::Load(Box::new(load))
    }
}

impl From<Trans> for Value {
    fn from(trans: Trans) -> Self {
        Value::Coordinate(Box::new(trans))
    }
}

impl From<Position> for Value {
    fn from(position: Position) -> Self {
        Value::Position(Box::new(position))
    }
}

/// The posture of an arm: shoulder, elbow, wrist, axis 4, axis 6, each 0 (undefined), 1 or 2 (DATA-04).
/// A SCARA uses the first only: 1 `LEFTY`, 2 `RIGHTY`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Configuration {
    /// Shoulder, elbow, wrist, axis 4, axis 6, each 0 to 2.
    pub digits: [u8; 5],
}

impl Configuration {
    /// Reads a number of five decimal digits such as 12111, shoulder first; `None` when a digit is not 0, 1 or 2.
    pub fn from_number(number: i64) -> Option<Self> {
        let mut rest = u64::try_from(number).ok()?;
        let mut digits = [0; 5];
        for digit in digits.iter_mut().rev() {
            *digit = (rest % 10) as u8;
            rest /= 10;
        }
        Some(Self { digits }).filter(|config| rest == 0 && config.is_valid())
    }

    /// The number of five digits, shoulder first.
    pub fn number(&self) -> i64 {
        let digits = self.digits.iter();
        digits.fold(0, |number, digit| number * 10 + i64::from(*digit))
    }

    /// The configuration a program writes as `number` on this arm: five digits, or 0, 1, 2 on a SCARA.
    pub fn listed(arm: Arm, number: i64) -> Option<Self> {
        match arm {
            Arm::SixAxis => Self::from_number(number),
            Arm::Scara => {
                let digits = [u8::try_from(number).ok()?, 0, 0, 0, 0];
                Some(Self { digits }).filter(|config| config.is_valid())
            }
        }
    }

    /// The number a program writes for this configuration on this arm.
    pub fn number_on(&self, arm: Arm) -> i64 {
        match arm {
            Arm::SixAxis => self.number(),
            Arm::Scara => i64::from(self.digits[0]),
        }
    }

    /// Whether each digit is one that the arm has: 0, 1 or 2.
    pub(crate) fn is_valid(self) -> bool {
        self.digits.iter().all(|digit| *digit <= 2)
    }
}

/// A position in mm and degrees.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Position {
    /// In the order of `POINT()`: six-axis `X Y Z A B C U V`; SCARA `X Y Z C T`, the rest 0.
    pub coords: [f64; 8],
    /// The posture; undefined = keep the present one.
    pub config: Configuration,
    /// The coordinate system the position refers to, from a `WORK` line of DATA (DATA-09); `None` = the current one.
    // A frame that several positions share is written with each; without this the field could be left out.
    #[serde(deserialize_with = "serde::Deserialize::deserialize")]
    pub work: Option<Arc<Frame>>,
}

impl Position {
    /// The numbers of MR, MW and DATA with the configuration last: nine on a six-axis arm, six on a SCARA.
    pub fn listed(&self, arm: Arm) -> Vec<f64> {
        let coords = self.coords.into_iter().take(arm.coordinates().len());
        // A configuration has at most five digits, exact in a double.
        coords.chain([self.config.number_on(arm) as f64]).collect()
    }

    /// The opposite of [`Position::listed`]; `None` for a wrong count or an impossible configuration.
    pub fn from_listed(arm: Arm, numbers: &[f64]) -> Option<Self> {
        let (config, coords) = numbers.split_last()?;
        if coords.len() != arm.coordinates().len() || *config != libm::trunc(*config) {
            return None;
        }
        Some(Position {
            config: Configuration::listed(arm, *config as i64)?,
            ..Self::from_leading(coords)
        })
    }

    /// The position of these coordinates, those left out being 0 and surplus ones dropped.
    pub(crate) fn from_leading(numbers: &[f64]) -> Self {
        let mut position = Self::default();
        for (to, from) in position.coords.iter_mut().zip(numbers) {
            *to = *from;
        }
        position
    }
}

/// A coordinate system: shifted along the axes of the old one, then rotated. mm and degrees.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Trans {
    /// `X Y Z A B C`; on a SCARA only `X Y Z` and `C` (the last) are used.
    pub coords: [f64; 6],
}

impl Trans {
    /// Indices in `coords` of the numbers of a program, DATA, MR and MW, in their order.
    pub(crate) fn order(arm: Arm) -> &'static [usize] {
        match arm {
            Arm::SixAxis => &[0, 1, 2, 3, 4, 5],
            Arm::Scara => &[0, 1, 2, 5],
        }
    }

    /// The numbers of MR, MW and DATA: `X Y Z A B C`, on a SCARA `X Y Z C`.
    pub fn listed(&self, arm: Arm) -> Vec<f64> {
        let order = Self::order(arm).iter();
        order.filter_map(|at| self.coords.get(*at).copied()).collect()
    }

    /// The opposite of [`Trans::listed`]; `None` for a wrong count.
    pub fn from_listed(arm: Arm, numbers: &[f64]) -> Option<Self> {
        (numbers.len() == Self::order(arm).len()).then(|| Self::from_leading(arm, numbers))
    }

    /// As [`Trans::from_listed`], missing numbers being 0 and surplus ones dropped.
    pub(crate) fn from_leading(arm: Arm, numbers: &[f64]) -> Self {
        let mut trans = Self::default();
        for (at, number) in Self::order(arm).iter().zip(numbers) {
            if let Some(coordinate) = trans.coords.get_mut(*at) {
                *coordinate = *number;
            }
        }
        trans
    }
}

/// A coordinate system in use, with the name of the variable it came from (SF reports names).
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Frame {
    /// Upper-case name of the coordinate data; `None` when it was written in place.
    pub name: Option<String>,
    /// Its origin and orientation in the system around it, in mm and degrees.
    pub trans: Trans,
}

/// Load data: mass in kg, centre of gravity and size in mm. A SCARA knows mass and `gravity[0]` only.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Payload {
    /// Mass in kg.
    pub mass: f64,
    /// Offset of the centre of gravity from the tool axis, X Y Z, in mm.
    pub gravity: [f64; 3],
    /// Size X Y Z in mm.
    pub size: [f64; 3],
}

impl Payload {
    /// The numbers of MR, MW and DATA: mass, gravity X Y Z, size X Y Z; on a SCARA mass and gravity X.
    pub fn listed(&self, arm: Arm) -> Vec<f64> {
        let all = core::iter::once(self.mass).chain(self.gravity).chain(self.size);
        all.take(ValueKind::Load.width(arm)).collect()
    }

    /// The opposite of [`Payload::listed`]; `None` for a wrong count.
    pub fn from_listed(arm: Arm, numbers: &[f64]) -> Option<Self> {
        (numbers.len() == ValueKind::Load.width(arm)).then(|| Self::from_leading(numbers))
    }

    /// As [`Payload::from_listed`], missing numbers being 0 and surplus ones dropped.
    pub(crate) fn from_leading(numbers: &[f64]) -> Self {
        let mut numbers = numbers.iter().copied();
        let mut next = || numbers.next().unwrap_or(0.0);
        Self {
            mass: next(),
            gravity: [next(), next(), next()],
            size: [next(), next(), next()],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;

    // clause: DATA-04
    #[test]
    fn a_configuration_is_five_digits_of_0_to_2() {
        let config = Configuration::from_number(12111).unwrap();
        assert_eq!(config.digits, [1, 2, 1, 1, 1]);
        assert_eq!(config.number(), 12111);
        assert_eq!(Configuration::from_number(13111), None);
        assert_eq!(Configuration::from_number(-1), None);
        assert_eq!(Configuration::from_number(111_111), None);
        assert_eq!(Configuration::listed(Arm::Scara, 2).unwrap().digits[0], 2);
        assert_eq!(Configuration::listed(Arm::Scara, 3), None);
    }

    // clause: CMD-MW-04 CMD-MW-05
    #[test]
    fn listed_and_from_listed_are_opposites() {
        let nine = vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 12111.0];
        assert_eq!(
            Position::from_listed(Arm::SixAxis, &nine)
                .unwrap()
                .listed(Arm::SixAxis),
            nine
        );
        assert_eq!(Position::from_listed(Arm::SixAxis, &nine[..8]), None);
        let six = vec![1.0, 2.0, 3.0, 4.0, 5.0, 2.0];
        assert_eq!(
            Position::from_listed(Arm::Scara, &six)
                .unwrap()
                .listed(Arm::Scara),
            six
        );
        let four = vec![1.0, 2.0, 3.0, 90.0];
        let trans = Trans::from_listed(Arm::Scara, &four).unwrap();
        assert_eq!(trans.coords, [1.0, 2.0, 3.0, 0.0, 0.0, 90.0]);
        assert_eq!(trans.listed(Arm::Scara), four);
        let load = vec![3.0, 100.0, 1.0, 2.0, 4.0, 5.0, 6.0];
        assert_eq!(
            Payload::from_listed(Arm::SixAxis, &load)
                .unwrap()
                .listed(Arm::SixAxis),
            load
        );
        assert_eq!(Payload::from_listed(Arm::SixAxis, &load[..6]), None);
    }
}
