//! The options of the language: the arm, and the readings of the manual that a user can choose between.
//!
//! The caller chooses them.

/// Kind of arm, which decides how many coordinates a position has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Arm {
    /// Six axes and two more: `X Y Z A B C U V` and a configuration of five digits.
    #[default]
    SixAxis,
    /// SCARA: `X Y Z C T` and `LEFTY` or `RIGHTY`.
    Scara,
}

impl Arm {
    /// The letters of the coordinates of a position, in their order.
    pub fn coordinates(self) -> &'static str {
        match self {
            Arm::SixAxis => "XYZABCUV",
            Arm::Scara => "XYZCT",
        }
    }
}

/// Result of integer divided by integer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub enum IntDivision {
    /// An integer, truncated toward zero.
    #[default]
    Truncate,
    Real,
}

/// The switches of the language.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LanguageOptions {
    /// The width of positions and coordinates.
    pub arm: Arm,
    /// `true`: a `WORK` line of DATA holds for all following `POINT` lines; `false`: for the next only (DATA-10).
    pub sticky_work: bool,
    /// Result of integer divided by integer.
    pub int_division: IntDivision,
    /// `true`: a program that assigns to a name of DATA has a copy of its own; `false`: it changes the datum for all
    /// programs.
    pub data_copy: bool,
    /// Tolerance of comparisons: reals that differ by at most this are equal, neither less nor greater. 0: only equal
    /// numbers are equal. Integers are always compared exactly.
    pub equal_within: f32,
}
