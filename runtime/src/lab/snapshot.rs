//! A copy of what paths are between two iterations, and putting it back.
//!
//! What a plan does not decide is kept: the state of the pool, what rays hit that were cast by
//! request, and which work is handed out. The queues are empty at that point, and the film may gather
//! what it likes.

use crate::error::RuntimeError;
use crate::gpu::Gpu;
use crate::gpu::resources::Resources;
use crate::kernels::buffers::BufferId;
use crate::kernels::queues::Counters;

/// The buffers that paths live in.
const BUFFERS: [BufferId; 3] = [
    BufferId::State,
    BufferId::ExtensionHits,
    BufferId::ShadowResults,
];
/// Bytes of the counters that every plan has in the same place.
const SCALAR_BYTES: u64 = 4 * Counters::SCALARS as u64;

/// The copy.
pub(super) struct Snapshot {
    copies: [wgpu::Buffer; BUFFERS.len()],
    scalars: wgpu::Buffer,
}

impl Snapshot {
    /// Room for a copy.
    pub(super) fn new(gpu: &Gpu, resources: &Resources) -> Result<Self, RuntimeError> {
        let room = |label, size| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let snapshot = Self {
            copies: BUFFERS.map(|id| room(id.row().name, resources.buffer(id).size())),
            scalars: room("counters", SCALAR_BYTES),
        };
        gpu.check()?;
        Ok(snapshot)
    }

    /// Copies what is there now.
    pub(super) fn take(&self, gpu: &Gpu, resources: &Resources) {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        for (id, copy) in BUFFERS.into_iter().zip(&self.copies) {
            encoder.copy_buffer_to_buffer(resources.buffer(id), 0, copy, 0, copy.size());
        }
        let counters = resources.counters();
        encoder.copy_buffer_to_buffer(counters, 0, &self.scalars, 0, SCALAR_BYTES);
        gpu.queue.submit([encoder.finish()]);
    }

    /// Records that everything is put back, and that the queues are empty.
    pub(super) fn restore(&self, encoder: &mut wgpu::CommandEncoder, resources: &Resources) {
        for (id, copy) in BUFFERS.into_iter().zip(&self.copies) {
            encoder.copy_buffer_to_buffer(copy, 0, resources.buffer(id), 0, copy.size());
        }
        let counters = resources.counters();
        encoder.clear_buffer(counters, 0, None);
        encoder.copy_buffer_to_buffer(&self.scalars, 0, counters, 0, SCALAR_BYTES);
    }
}
