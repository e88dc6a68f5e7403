//! The language server, spoken to as an editor does.

mod client;
mod fixtures;
mod protocol;
mod robust;
mod scenes;
mod workspace;

#[test]
fn every_file_of_tests_is_in_the_program() {
    listed::check(concat!(env!("CARGO_MANIFEST_DIR"), "/tests"), &[]);
}

#[path = "../../compiler/tests/common/listed.rs"]
mod listed;
