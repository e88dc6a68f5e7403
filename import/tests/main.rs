//! Documents of MaterialX, good and bad, and what becomes of them.

mod bad_input;
mod common;
mod documents;
mod export;
mod origins;
mod page;
mod rows;
mod values;
