//! What the passes make of real code: every function of the library and every material of
//! `materials/`, found by walking the folders, means the same after each pass, is never more work,
//! and does not change when it is optimised again. And every algebraic rule, one by one.
//!
//! Cases in the textual IR are in `tests/passes`.

mod corpus;
mod meaning;
mod rules;
mod unused;
