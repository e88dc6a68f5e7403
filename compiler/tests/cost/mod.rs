//! Tests of what materials cost: numbers alive at once on IR as text, the rest on materials whose
//! cost can be worked out by hand.

mod lines;
mod live;
mod vector;
mod walks;
