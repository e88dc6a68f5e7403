//! A word of each of eight invocations, as wide code and hosts that answer its calls share it.

/// Eight words: one of each of eight invocations.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(32))]
pub struct Cell(pub [u32; 8]);
