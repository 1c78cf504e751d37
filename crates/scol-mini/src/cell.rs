//! A cell of the memory: a number, or the index of a value that is not a number, in eight bytes.
//!
//! A cell is read and written as one word: a processor that writes two halves and reads the whole has to wait for itself.
//! With an enum of Rust instead the loops of `benches` run a quarter slower, and that over arrays misses its target.
//! The values that are not numbers are kept by `memory`; `machine::vm` computes on cells.

use crate::value::Number;

/// Content of one place: a number itself, anything else by its number among the vectors of the memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(from = "Held", into = "Held")]
pub(crate) struct Cell(u64);

/// A cell taken apart.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) enum Held {
    Nothing,
    Integer(i32),
    Real(f32),
    Vector(u32),
}

// The kind is the upper half. An integer is 0 and a real is all ones, so that several of them are known by one look.
const INTEGER: u64 = 0;
const REAL: u64 = 0xffff_ffff;
const EMPTY: u64 = 1;
const VECTOR: u64 = 2;

impl Cell {
    /// A cell without a value.
    pub const EMPTY: Cell = Cell(EMPTY << 32);

    #[inline(always)]
    pub fn integer(value: i32) -> Self {
        Self(u64::from(value as u32))
    }

    #[inline(always)]
    pub fn real(value: f32) -> Self {
        Self(REAL << 32 | u64::from(value.to_bits()))
    }

    pub fn vector(at: u32) -> Self {
        Self(VECTOR << 32 | u64::from(at))
    }

    #[inline(always)]
    fn kind(self) -> u64 {
        self.0 >> 32
    }

    #[inline(always)]
    fn low(self) -> u32 {
        self.0 as u32
    }

    #[inline(always)]
    pub fn is_integer(self) -> bool {
        self.kind() == INTEGER
    }

    #[inline(always)]
    pub fn is_real(self) -> bool {
        self.kind() == REAL
    }

    #[inline(always)]
    pub fn is_number(self) -> bool {
        self.is_integer() || self.is_real()
    }

    /// Whether both hold a value of the same kind, or none.
    #[inline(always)]
    pub fn is_like(self, other: Cell) -> bool {
        self.kind() == other.kind()
    }

    #[inline(always)]
    pub fn held(self) -> Held {
        match self.kind() {
            INTEGER => Held::Integer(self.low() as i32),
            REAL => Held::Real(f32::from_bits(self.low())),
            VECTOR => Held::Vector(self.low()),
            _ => Held::Nothing,
        }
    }

    #[inline(always)]
    pub fn number(self) -> Option<Number> {
        match self.held() {
            Held::Integer(value) => Some(Number::Integer(value)),
            Held::Real(value) => Some(Number::Real(value)),
            Held::Nothing | Held::Vector(_) => None,
        }
    }

    /// The integer, if it is one.
    #[inline(always)]
    pub fn as_integer(self) -> Option<i32> {
        self.is_integer().then_some(self.low() as i32)
    }

    /// The real, if it is one.
    #[inline(always)]
    pub fn as_real(self) -> Option<f32> {
        self.is_real().then_some(f32::from_bits(self.low()))
    }

    /// The number as a real, if it is one.
    #[inline(always)]
    pub fn single(self) -> Option<f32> {
        self.as_real()
            .or_else(|| self.as_integer().map(|value| value as f32))
    }

    /// Returns the integers in these cells, if all are integers.
    #[inline(always)]
    pub fn integers<const N: usize>(cells: [Cell; N]) -> Option<[i32; N]> {
        let all = cells.iter().fold(0, |all, cell| all | cell.0) >> 32 == INTEGER;
        all.then(|| cells.map(|cell| cell.low() as i32))
    }
}

impl From<Held> for Cell {
    fn from(held: Held) -> Self {
        match held {
            Held::Nothing => Cell::EMPTY,
            Held::Integer(value) => Cell::integer(value),
            Held::Real(value) => Cell::real(value),
            Held::Vector(at) => Cell::vector(at),
        }
    }
}

impl From<Cell> for Held {
    fn from(cell: Cell) -> Self {
        cell.held()
    }
}

impl From<Number> for Cell {
    #[inline(always)]
    fn from(number: Number) -> Self {
        match number {
            Number::Integer(value) => Cell::integer(value),
            Number::Real(value) => Cell::real(value),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_put_in_comes_out() {
        for value in [0, 1, -1, i32::MIN, i32::MAX] {
            assert_eq!(Cell::integer(value).held(), Held::Integer(value));
            assert_eq!(Cell::integer(value).number(), Some(Number::Integer(value)));
            assert_eq!(Cell::integer(value).single(), Some(value as f32));
        }
        assert_eq!(Cell::real(-1.5).held(), Held::Real(-1.5));
        assert_eq!(Cell::real(-1.5).single(), Some(-1.5));
        assert_eq!(Cell::vector(u32::MAX).held(), Held::Vector(u32::MAX));
        assert_eq!(Cell::vector(0).number(), None);
        assert_eq!(Cell::EMPTY.number(), None);
        assert_eq!(Cell::EMPTY.single(), None);
    }

    #[test]
    fn several_cells_are_looked_at_in_one() {
        let all = [
            Cell::integer(-1),
            Cell::real(-1.5),
            Cell::EMPTY,
            Cell::vector(u32::MAX),
        ];
        for a in all {
            for b in all {
                let integers = a.is_integer() && b.is_integer();
                assert_eq!(Cell::integers([a, b]), integers.then_some([-1, -1]));
            }
        }
    }
}
