//! Holds materials and closures to what they promise: finite answers, light that is kept, samples that follow their
//! density, and whatever doc comments say besides.
//!
//! The compiler's interpreter answers, in double precision and in single; nothing here needs a GPU or reads a file. The
//! compiler's tests of its library rest on this crate, and so does `impasto test`.
//!
//! Whatever a user's material does is a result: what has no answer within a bounded work is [`lanes::Stuck`].

pub mod cells;
pub mod check;
pub mod closure;
pub mod distribution;
pub mod drawn;
pub mod effort;
pub mod evaluate;
pub mod lanes;
pub mod material;
pub mod precision;
pub mod promise;
pub mod statistics;
