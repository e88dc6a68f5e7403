//! Asking Vulkan for the properties of a GPU that wgpu does not pass on.
#![allow(unsafe_code)]

use ash::vk;
use wgpu::hal::api::Vulkan;

/// Bytes of memory that a GPU has for itself; `None` if it shares the processor's, or is not reached through Vulkan.
pub(crate) fn bytes(adapter: &wgpu::Adapter) -> Option<u64> {
    if adapter.get_info().device_type != wgpu::DeviceType::DiscreteGpu {
        return None;
    }
    // SAFETY: the adapter is looked at while it is borrowed, and nothing of it is destroyed.
    let adapter = unsafe { adapter.as_hal::<Vulkan>() }?;
    let instance = adapter.shared_instance().raw_instance();
    // SAFETY: the physical device is of this instance.
    let properties =
        unsafe { instance.get_physical_device_memory_properties(adapter.raw_physical_device()) };
    let heaps = properties.memory_heaps_as_slice().iter();
    let own = heaps.filter(|heap| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL));
    // A window through which the processor reaches a part of it is a heap of its own.
    own.map(|heap| heap.size).max()
}

/// The UUID of a GPU as [`Selector::Uuid`](crate::gpu::selection::Selector::Uuid) has it; `None` if it is not
/// reached through Vulkan.
pub(crate) fn uuid(adapter: &wgpu::Adapter) -> Option<String> {
    // SAFETY: as in `bytes`.
    let adapter = unsafe { adapter.as_hal::<Vulkan>() }?;
    let shared = adapter.shared_instance();
    let (instance, physical) = (shared.raw_instance(), adapter.raw_physical_device());
    // SAFETY: the physical device is of this instance.
    let version = unsafe { instance.get_physical_device_properties(physical) }.api_version;
    if version.min(shared.instance_api_version()) < vk::API_VERSION_1_1 {
        return None;
    }
    let mut ids = vk::PhysicalDeviceIDProperties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut ids);
    // SAFETY: instance and device are of Vulkan 1.1 or newer, which has this call; what the properties point to
    // lives until after it.
    unsafe { instance.get_physical_device_properties2(physical, &mut properties) };
    let hex: String = ids
        .device_uuid
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    let parts = [
        &hex[..8],
        &hex[8..12],
        &hex[12..16],
        &hex[16..20],
        &hex[20..],
    ];
    Some(parts.join("-"))
}
