//! Tests that run kernels, on whatever GPU there is (a software one will do). They fail
//! without one: a renderer that cannot be run is not tested.
//!
//! The worlds are small and made by hand, so that what should come out is known in closed
//! form; see `stub`.

mod casts;
mod determinism;
mod dropped;
mod extremes;
mod film;
mod furnace;
mod info;
mod lab;
#[allow(dead_code)] // the rest is for tests of the library itself
#[path = "../../../compiler/tests/stdlib/library.rs"]
mod library;
mod lights;
mod lost;
mod many_lights;
mod media;
mod ops;
mod passes;
mod pixels;
mod placed;
mod planes;
mod plans;
mod random;
#[path = "../../../compiler/tests/common/record.rs"]
mod record;
mod replan;
mod scene;
mod stub;
#[path = "../support/mod.rs"]
mod support;
mod techniques;
mod volume;
mod workload;
