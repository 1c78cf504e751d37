//! Numbers as commands and variable data carry them.

/// A number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Number {
    /// Written without a decimal point or exponent, and within 32 bits.
    Integer(i32),
    /// Any other; finite.
    Real(f64),
}

impl Number {
    /// Its value.
    #[must_use]
    pub fn as_f64(self) -> f64 {
        match self {
            Number::Integer(value) => f64::from(value),
            Number::Real(value) => value,
        }
    }
}
