//! The window of Impasto: a picture that is rendered while one works on it.
//!
//! The window knows nothing of files, compilers and devices. What it shows and what it asks for passes through
//! [`engine`], so that tests drive it by an engine of their own, and other displays (`--tev`) by the same one.

pub mod engine;
#[cfg(feature = "window")]
#[doc(hidden)]
pub mod testing;
#[cfg(feature = "window")]
pub mod window;
