//! What Vulkan tells of a GPU and wgpu does not: its memory, and its UUID.

#[cfg(not(target_vendor = "apple"))]
mod vulkan;

#[cfg(not(target_vendor = "apple"))]
pub(super) use vulkan::{bytes, uuid};

/// Where there is no Vulkan, nothing is told.
#[cfg(target_vendor = "apple")]
pub(super) fn bytes(_: &wgpu::Adapter) -> Option<u64> {
    None
}

/// Where there is no Vulkan, nothing is told.
#[cfg(target_vendor = "apple")]
pub(super) fn uuid(_: &wgpu::Adapter) -> Option<String> {
    None
}
