//! All tests of the compiler but those of `limits.rs`, in one program: it is linked once, and what one test has
//! prepared the next one finds.

mod analysis;
mod arguments;
mod bad_input;
mod called;
mod closures;
mod codegen;
mod common;
mod cost;
mod effort;
mod explain;
mod foreign;
mod format;
mod inspect;
mod instances;
mod interface;
mod interpreter;
mod layering;
mod materials;
mod mutations;
mod numbers;
mod optimise;
mod oracle;
mod outputs;
mod parser;
mod passes;
mod reference;
mod render;
mod slopes;
mod stdlib;
mod textures;
mod values;
mod widths;

#[test]
fn every_file_of_tests_is_in_the_program() {
    common::listed::check(concat!(env!("CARGO_MANIFEST_DIR"), "/tests"), &["limits"]);
}
