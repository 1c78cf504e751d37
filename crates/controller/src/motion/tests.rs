//! Whole motions, from plan to rest.
