//! The control interface: who may call, what each call does, and that what it does is seen on the protocol side.

mod book;
mod clock;
mod debugging;
mod document;
#[cfg(unix)]
mod drive;
mod events;
mod field_bus;
mod guard;
mod page;
mod pendant;
mod resources;
mod whole;
