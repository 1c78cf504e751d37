//! A recorded run, opened: any moment of it as it was, and a timeline of everything that happened.
//!
//! The transcript is the only truth. [`run`] plays it once from its start, and keeps copies on the way from which every
//! moment is near; [`lanes`] collects meanwhile what a timeline shows. [`serve`] is the page of the control interface
//! that shows the run.
//!
//! Start with [`run::Run`].

// A new variant of an enum of ours is met at every place that tells them apart.
#![cfg_attr(not(test), warn(clippy::wildcard_enum_match_arm))]

pub mod course;
mod data;
pub mod html;
pub mod key;
pub mod kind;
pub mod lanes;
pub mod list;
pub mod patch;
pub mod robot;
pub mod run;
pub mod serve;
pub mod summary;
pub mod why;
