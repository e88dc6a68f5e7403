//! Studies of the renderer: what a TOML file says is measured, kept, and told, for any scenes, materials, models and GPUs.
//!
//! | module | what it does |
//! |---|---|
//! | [`study`] | reads the file: scenes, mixes, and parts, each of a kind |
//! | [`records`] | keeps a file a measurement, from which a later run goes on |
//! | [`run`] | measures what is not there yet, one process a measurement |
//! | [`results`] | what pages are made of: JSON and CSV, each row with command, version, device and date |
//! | [`page`] | text, tables and plots |
//! | [`mod@write`] | where all that goes |
//! | `partition`, `rates`, `convergence` | what the kinds of parts measure, and their tables |
//! | [`score`] | models of kernels' times held against measured mixes, without a GPU |
//!
//! Data runs down this list. A measurement is the command itself, run as a process: its line is in the row, and what it
//! takes is what a user waits for.

mod convergence;
mod csv;
mod named;
pub mod page;
mod partition;
mod process;
mod rates;
pub mod records;
pub mod results;
pub mod run;
pub mod score;
pub mod study;
pub mod write;

pub use impasto_scenes::mixes;
pub use process::version;
