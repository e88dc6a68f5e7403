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
mod lights;
mod lost;
mod many_lights;
mod media;
mod ops;
mod outputs;
mod passes;
mod pixels;
mod placed;
mod planes;
mod plans;
mod random;
mod replan;
mod scene;
mod several;
mod stub;
mod techniques;
mod volume;
mod workload;
