//! All tests of the runtime in one program: it is linked once, and one device serves them.

mod bvh;
mod environment;
mod gpu;
mod lights;
mod materials;
mod native;
mod placed;
mod placements;
mod scene;
mod support;
mod surface;
mod textures;

#[allow(dead_code, unused_imports)] // the rest is for tests of the library itself
#[path = "../../compiler/tests/stdlib/library.rs"]
mod library;
#[path = "../../compiler/tests/common/listed.rs"]
mod listed;
#[path = "../../compiler/tests/common/record.rs"]
mod record;

#[test]
fn every_file_of_tests_is_in_the_program() {
    listed::check(concat!(env!("CARGO_MANIFEST_DIR"), "/tests"), &[]);
}
