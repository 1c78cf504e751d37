//! The cells a program works on, as the instructions of `sprint` use them: read, computed with and stored as long as
//! nothing is special. `None` means that something is, and that nothing has happened; `quick` knows what to do then.

use crate::cell::Cell;
use crate::code::{AccumOp, ElementRef, Register, Relation, TEMPORARIES};
use crate::program::Program;

/// The cells a program works on.
pub(super) struct Registers<'a> {
    pub cells: &'a mut [Cell],
    /// The first temporary.
    pub temporaries: usize,
    /// Reals that differ by so much or less are equal.
    pub within: f32,
}

impl<'a> Registers<'a> {
    #[inline(always)]
    pub fn new(cells: &'a mut [Cell], of: Rules) -> Registers<'a> {
        let Rules { temporaries, within } = of;
        Registers {
            cells,
            temporaries,
            within,
        }
    }
}

/// What holds for all cells of a program.
#[derive(Clone, Copy)]
pub(super) struct Rules {
    temporaries: usize,
    within: f32,
}

impl Rules {
    pub fn of(program: &Program) -> Rules {
        Rules {
            temporaries: program.symbols.cells,
            within: program.options.equal_within,
        }
    }
}

impl Registers<'_> {
    #[inline(always)]
    pub fn read(&self, register: Register) -> Option<Cell> {
        self.cells.get(usize::from(register)).copied()
    }

    #[inline(always)]
    pub fn read_real(&self, register: Register) -> Option<f32> {
        self.read(register)?.as_real()
    }

    #[inline(always)]
    pub fn is_temporary(&self, register: Register) -> bool {
        usize::from(register).wrapping_sub(self.temporaries) < TEMPORARIES
    }

    /// Stores an integer where one is, or in a temporary.
    #[inline(always)]
    pub fn put_integer(&mut self, to: Register, value: i32) -> Option<()> {
        let place = self.read(to)?;
        if !place.is_integer() && !self.is_temporary(to) {
            return None;
        }
        *self.cells.get_mut(usize::from(to))? = Cell::integer(value);
        Some(())
    }

    /// Stores a real where one is, or in a temporary; it has to be finite.
    #[inline(always)]
    pub fn put_real(&mut self, to: Register, value: f32) -> Option<()> {
        let place = self.read(to)?;
        if !value.is_finite() || !place.is_real() && !self.is_temporary(to) {
            return None;
        }
        *self.cells.get_mut(usize::from(to))? = Cell::real(value);
        Some(())
    }

    /// Stores a number of the kind that is there, or in a temporary.
    #[inline(always)]
    pub fn put(&mut self, to: Register, value: Cell) -> Option<()> {
        if let Some(value) = value.as_integer() {
            return self.put_integer(to, value);
        }
        self.put_real(to, value.as_real()?)
    }

    #[inline(always)]
    pub fn arithmetic(
        &mut self,
        (to, a, b): (Register, Register, Register),
        integers: impl Fn(i32, i32) -> Option<i32>,
        reals: impl Fn(f32, f32) -> f32,
    ) -> Option<()> {
        let (a, b) = (self.read(a)?, self.read(b)?);
        if let Some([a, b]) = Cell::integers([a, b]) {
            return self.put_integer(to, integers(a, b)?);
        }
        self.put_real(to, reals(a.single()?, b.single()?))
    }

    #[inline(always)]
    pub fn holds(&self, relation: Relation, a: Register, b: Register) -> Option<bool> {
        let (a, b) = (self.read(a)?, self.read(b)?);
        if let Some([a, b]) = Cell::integers([a, b]) {
            return Some(relation.integers(a, b));
        }
        Some(relation.reals(a.single()?, b.single()?, self.within))
    }

    /// An element; what is outside the array is nowhere.
    #[inline(always)]
    pub fn element(&self, near: ElementRef) -> Option<Register> {
        let index = self.read(near.index)?.as_integer()?;
        // One that wraps around is far beyond any array.
        let index = index.wrapping_add(i32::from(near.offset)) as u32;
        (index < u32::from(near.array.length)).then(|| near.array.base.wrapping_add(index as u16))
    }

    /// `c` joined to `a` times `b`.
    #[inline(always)]
    pub fn multiplied(
        &mut self,
        to: Register,
        [a, b, c]: [Register; 3],
        integers: impl Fn(i32, i32) -> Option<i32>,
        reals: impl Fn(f32, f32) -> f32,
    ) -> Option<()> {
        let cells = [self.read(a)?, self.read(b)?, self.read(c)?];
        if let Some([a, b, c]) = Cell::integers(cells) {
            return self.put_integer(to, integers(c, a.checked_mul(b)?)?);
        }
        let [a, b, c] = Cell::reals(cells)?;
        // A product that is not finite leaves no sum that is.
        self.put_real(to, reals(c, a * b))
    }

    /// The number in an element.
    #[inline(always)]
    pub fn loaded(&self, near: ElementRef) -> Option<Cell> {
        self.read(self.element(near)?)
    }

    /// What comes of a number in a cell and another.
    #[inline(always)]
    pub fn combine(
        &mut self,
        to: Register,
        (with, it): (Register, Cell),
        integers: impl Fn(i32, i32) -> Option<i32>,
        reals: impl Fn(f32, f32) -> f32,
    ) -> Option<()> {
        let cells = [self.read(with)?, it];
        if let Some([with, it]) = Cell::integers(cells) {
            return self.put_integer(to, integers(with, it)?);
        }
        let [with, it] = Cell::reals(cells)?;
        self.put_real(to, reals(with, it))
    }

    /// A function of a real, joined to `with`.
    #[inline(always)]
    pub fn joined(
        &mut self,
        function: impl Fn(f32) -> Option<f32>,
        a: Register,
        to: Register,
        join: AccumOp,
        with: Register,
    ) -> Option<()> {
        let it = function(self.read_real(a)?)?;
        let with = self.read_real(with)?;
        self.put_real(to, join.reals(with, it))
    }

    /// A function of a real, times another, joined to `with`.
    #[inline(always)]
    pub fn scaled(
        &mut self,
        function: impl Fn(f32) -> Option<f32>,
        (a, by): (Register, Register),
        to: Register,
        join: AccumOp,
        with: Register,
    ) -> Option<()> {
        // As in `multiplied`; a scaled number is not multiplied again.
        let it = function(self.read_real(a)?)? * self.read_real(by)?;
        let with = self.read_real(with)?;
        self.put_real(to, join.reals(with, it))
    }

    /// `to` joined to `by` where the relation holds, without a branch: whether it does is often hard to foresee. A result
    /// that would not fit is left to the others even where it is not wanted.
    #[inline(always)]
    pub fn guarded(
        &mut self,
        (relation, a, b): (Relation, Register, Register),
        (to, by): (Register, Register),
        integers: impl Fn(i32, i32) -> Option<i32>,
        reals: impl Fn(f32, f32) -> f32,
    ) -> Option<()> {
        let cells = [self.read(a)?, self.read(b)?, self.read(to)?, self.read(by)?];
        let new = if let Some([a, b, old, by]) = Cell::integers(cells) {
            let value = integers(old, by)?;
            Cell::integer(if relation.integers(a, b) { value } else { old })
        } else {
            let [a, b, old, by] = Cell::reals(cells)?;
            // Reals take longer to compute than it takes to have foreseen it wrongly now and then.
            if !relation.reals(a, b, self.within) {
                return Some(());
            }
            Cell::real(finite(reals(old, by))?)
        };
        *self.cells.get_mut(usize::from(to))? = new;
        Some(())
    }
}

/// A real, if it is finite.
#[inline(always)]
pub(super) fn finite(value: f32) -> Option<f32> {
    value.is_finite().then_some(value)
}

/// SQRT. Rounded once: the same as computed in double precision and rounded again.
#[inline(always)]
pub(super) fn root(of: f32) -> Option<f32> {
    finite(libm::sqrtf(of))
}

impl AccumOp {
    #[inline(always)]
    pub fn integers(self, with: i32, it: i32) -> Option<i32> {
        match self {
            AccumOp::Add => with.checked_add(it),
            AccumOp::From => with.checked_sub(it),
            AccumOp::Less => it.checked_sub(with),
            AccumOp::Multiply => with.checked_mul(it),
        }
    }

    #[inline(always)]
    pub fn reals(self, with: f32, it: f32) -> f32 {
        match self {
            AccumOp::Add => with + it,
            AccumOp::From => with - it,
            AccumOp::Less => it - with,
            AccumOp::Multiply => with * it,
        }
    }
}
