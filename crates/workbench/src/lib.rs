//! Servers that editors start while SCOL is written. [`lsp`] is the language server.
//!
//! A server is a value: messages in, messages out. It sees the disk through the trait [`lsp::Project`]; reading stdin is left to
//! its subcommand. [`framing`] cuts a stream into messages. Errors and warnings, formatting and the names of a file come from
//! `scol-mini`, the words of the documentation from the book.

// A new variant of an enum of ours is met at every place that tells them apart.
#![cfg_attr(not(test), warn(clippy::wildcard_enum_match_arm))]

pub mod dap;
pub mod framing;
pub mod lsp;
pub mod rpc;
