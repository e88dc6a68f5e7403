//! The command as its users meet it: exit codes, streams, files, and input that is not what it
//! should be. Every test runs the built program.

mod aov;
mod calibrate;
mod check;
pub(crate) mod common;
mod completions;
mod converge;
mod cost;
mod cost_lines;
mod devices;
mod emit_check;
mod eval;
mod experiment;
mod explain;
mod export;
mod farm;
#[cfg(unix)]
mod faults;
mod film;
mod fmt;
mod hostile;
mod import;
mod limits;
mod new;
mod plan;
mod plans;
mod progress;
mod rays;
mod render;
mod shot;
mod snapshots;
#[cfg(unix)]
mod streams;
mod test;
mod trace;
mod until;
mod usd;
