//! MR and MW: reading and writing global variables.

use crate::command::Number;
use crate::name::VariableName;
use alloc::vec::Vec;

/// What MR asks for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VariableRead {
    /// The variable or the element.
    pub variable: VariableName,
    /// Its type as the host states it.
    pub kind: VariableKind,
}

/// What MW asks for.
#[derive(Debug, Clone, PartialEq)]
pub struct VariableWrite {
    /// The value is written back to the program file too (CMD-MW-02).
    pub restore: bool,
    /// The variable or the element.
    pub variable: VariableName,
    /// Its type as the host states it.
    pub kind: VariableKind,
    /// The values; how many there must be depends on the type and the arm.
    pub values: Vec<Number>,
}

/// Type code of a variable (CMD-MR-04).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VariableKind {
    /// -1: the controller finds the type itself (CMD-MR-05).
    Unclarified,
    /// 0.
    Integer,
    /// 1.
    Real,
    /// 2: mass, centre of gravity, size.
    Load,
    /// 3: a coordinate system.
    Coordinate,
    /// 4: a position.
    Position,
    /// 5: an element of an array of integers.
    IntegerArray,
    /// 6: an element of an array of reals.
    RealArray,
    /// 7: an element of an array of loads.
    LoadArray,
    /// 8: an element of an array of coordinate systems.
    CoordinateArray,
    /// 9: an element of an array of positions.
    PositionArray,
}

impl VariableKind {
    /// All types, in the order of their codes.
    pub const ALL: [VariableKind; 11] = [
        VariableKind::Unclarified,
        VariableKind::Integer,
        VariableKind::Real,
        VariableKind::Load,
        VariableKind::Coordinate,
        VariableKind::Position,
        VariableKind::IntegerArray,
        VariableKind::RealArray,
        VariableKind::LoadArray,
        VariableKind::CoordinateArray,
        VariableKind::PositionArray,
    ];

    /// The code, -1 to 9.
    #[must_use]
    pub fn code(self) -> i32 {
        match self {
            VariableKind::Unclarified => -1,
            VariableKind::Integer => 0,
            VariableKind::Real => 1,
            VariableKind::Load => 2,
            VariableKind::Coordinate => 3,
            VariableKind::Position => 4,
            VariableKind::IntegerArray => 5,
            VariableKind::RealArray => 6,
            VariableKind::LoadArray => 7,
            VariableKind::CoordinateArray => 8,
            VariableKind::PositionArray => 9,
        }
    }

    /// The type with this code.
    #[must_use]
    pub fn from_code(code: i32) -> Option<VariableKind> {
        VariableKind::ALL.into_iter().find(|kind| kind.code() == code)
    }

    /// The type of an element, for an array type; otherwise the type itself.
    #[must_use]
    pub fn scalar(self) -> VariableKind {
        match self {
            VariableKind::IntegerArray => VariableKind::Integer,
            VariableKind::RealArray => VariableKind::Real,
            VariableKind::LoadArray => VariableKind::Load,
            VariableKind::CoordinateArray => VariableKind::Coordinate,
            VariableKind::PositionArray => VariableKind::Position,
            other => other,
        }
    }

    /// Whether it is an array type.
    #[must_use]
    pub fn is_array(self) -> bool {
        self.scalar() != self
    }
}
