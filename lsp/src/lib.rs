//! The language server of Impasto: what editors ask while a source or scene is written.
//!
//! [`serve`] answers one client. Data runs one way: the protocol (`server`) keeps texts (`documents`) and asks what they
//! mean (`material`, `scene`), in bytes; what takes longer than a key is done by a thread (`worker`) for the margin and
//! for whole checks. What needs devices or other programs, a [`Host`] does.

pub mod documents;
pub mod host;
pub mod library;
pub mod margin;
pub mod material;
pub mod scene;
mod server;
pub mod text;
mod worker;

pub use host::{Host, PlannedMaterial, ScenePlan};
pub use server::{run, serve};
