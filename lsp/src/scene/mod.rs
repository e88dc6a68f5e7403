//! What editors ask of scene files, in terms of texts and bytes.

pub mod cursor;
pub mod features;
pub mod manual;
pub mod outline;
