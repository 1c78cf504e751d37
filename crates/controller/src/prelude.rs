//! Names that the prelude of `std` has and that of `core` lacks, for all modules of this crate.

pub(crate) use alloc::boxed::Box;
pub(crate) use alloc::string::{String, ToString};
pub(crate) use alloc::vec::Vec;
