//! What a driver tells of the machine code of kernels: registers, size and stack.

#[cfg(not(target_vendor = "apple"))]
mod vulkan;

#[cfg(not(target_vendor = "apple"))]
pub(crate) use vulkan::Statistics;

/// What the driver says of one kernel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct KernelStatistics {
    /// Registers of a thread, where it tells.
    pub registers: Option<u32>,
    /// Bytes of machine code, where it tells.
    pub binary_bytes: Option<u64>,
    /// Bytes of stack that a thread needs, where it tells.
    pub stack_bytes: Option<u64>,
}

/// Where there is no Vulkan, nothing is told.
#[cfg(target_vendor = "apple")]
pub(crate) struct Statistics<'g>(std::marker::PhantomData<&'g super::Gpu>);

#[cfg(target_vendor = "apple")]
impl<'g> Statistics<'g> {
    pub(crate) fn open(_: &'g super::Gpu) -> Option<Self> {
        None
    }

    pub(crate) fn of(
        &self,
        _name: &str,
        _wgsl: &str,
        _bindings: &[crate::kernels::compose::Binding],
    ) -> Option<KernelStatistics> {
        None
    }
}
