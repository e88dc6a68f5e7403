//! The kernels of a plan as text: which there are, what each is made of, and what they share.

pub(crate) mod buffers;
pub(crate) mod camera;
mod check;
pub(crate) mod compose;
pub(crate) mod cones;
pub mod dropped;
pub(crate) mod hits;
pub(crate) mod layout;
pub(crate) mod modules;
pub(crate) mod order;
pub(crate) mod outputs;
pub(crate) mod parts;
pub(crate) mod prints;
pub(crate) mod profile;
pub(crate) mod queues;
pub mod random;
mod requests;
pub(crate) mod run;
pub(crate) mod shells;
pub(crate) mod stages;
pub(crate) mod state;
mod surface_point;
pub(crate) mod tiles;
pub(crate) mod validate;
mod wavefront;

#[cfg(test)]
mod tests;
