//! What editors ask for: the names of a file with all their places, its tokens by kind, its blocks, and the words that can follow
//! at a place.
//!
//! It is made of the rows of `outline`, so it also covers a file with errors. How an editor asks is left to the caller. Start
//! with [`Index`].

mod context;
mod index;
mod marks;
mod name;
mod notes;
mod offers;

pub use context::{Call, Context, Expected};
pub use index::{Block, BlockKind, Index, Role, Symbol, SymbolKind, Use};
pub use marks::{Mark, MarkKind};
pub use name::{NameError, check_name};
pub use offers::{Offer, OfferKind, offers};
