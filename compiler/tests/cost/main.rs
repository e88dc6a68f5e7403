//! Tests of what materials cost: numbers alive at once on IR as text, the rest on materials whose
//! cost can be worked out by hand.

#[path = "../common/mod.rs"]
mod common;
mod lines;
mod live;
mod vector;
