//! Common parts of the file of every resource: extractors, answers, and the description of its documents.
//!
//! Begin with `pendant`, a simple resource.

pub use super::body::{Json, NoBody, Path};
pub use super::handle::{Answer, Handle};
pub use super::problem::Problem;
pub(crate) use super::route_table::call;
pub use serde::{Deserialize, Serialize};
pub use ts3100_driver::driver::request::View;
