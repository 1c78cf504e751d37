//! The TS3100 robot controller as a pure value.
#![no_std]
extern crate alloc;
pub mod model;
pub mod motion;
