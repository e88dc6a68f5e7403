//! How kernels follow light below a surface, as far as its cost depends on it.

/// How often light is turned below a surface until its steps become longer.
pub const COARSE_TURNS: u32 = 256;
/// After how many more turns they double again.
pub const COARSER_TURNS: u32 = 128;
/// A walk that carries less than this of what it began with may be ended by chance.
pub const FAINT: f32 = 0.25;
