//! The tests that see the whole line, in one program: it is linked once.

mod cli;
mod diagnostics;
mod documentation;
mod editor;
mod filtering;
mod generated;
mod instances;
mod live;
mod needs;
mod plans;
mod probe;
mod processor;
mod render;
mod shot;
mod snapshots;
mod spaces;
mod subsurface;
mod textures;
mod trace;
mod tutorial;
mod until;
#[cfg(feature = "window")]
mod window;

#[path = "../compiler/tests/common/listed.rs"]
mod listed;
#[path = "../compiler/tests/common/record.rs"]
mod record;
#[cfg(feature = "window")]
#[path = "../viewer/tests/screen/mod.rs"]
#[allow(clippy::unwrap_used)]
mod screen;

#[test]
fn every_file_of_tests_is_in_the_program() {
    listed::check(concat!(env!("CARGO_MANIFEST_DIR"), "/tests"), &[]);
}
