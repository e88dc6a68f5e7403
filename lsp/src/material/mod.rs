//! What editors ask of sources in Impasto, in terms of texts and bytes: the protocol is for `server`.

pub mod actions;
pub mod colors;
pub mod completion;
pub mod cursor;
pub mod describe;
pub mod hover;
pub mod imports;
pub mod outline;
pub mod references;
pub mod rename;
pub mod signature;
pub mod symbols;
pub mod tokens;
