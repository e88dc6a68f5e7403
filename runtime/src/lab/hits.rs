//! What the iteration hits that is measured: counted on the host, from the queues themselves.

use impasto_compiler::partition::workload::BLOCK;
use impasto_compiler::partition::{Form, Plan};

use super::{Candidate, Lab};
use crate::error::RuntimeError;
use crate::kernels::buffers::BufferId;
use crate::technique::SlotOrder;

impl Lab<'_> {
    /// Counts the hits of each material, and the blocks of neighbouring slots with any.
    pub(super) fn count_hits(&mut self, own: &Plan) -> Result<(), RuntimeError> {
        let pool = f64::from(self.sizes.pool);
        let blocks = self.sizes.pool.div_ceil(BLOCK) as usize;
        // Any kernel will do: all queues are filled before it.
        let Some(any) = own.kernels.first() else {
            return Ok(());
        };
        let any = Candidate {
            form: Form::Own,
            members: any.materials.clone(),
        };
        // Where paths are before logic puts them in the order of queues, which is where it meets them.
        let order = self.inputs.technique.slot_order;
        self.inputs.technique.slot_order = SlotOrder::Fixed;
        let run = self.runs(&[any]).map(|mut runs| runs.swap_remove(0));
        self.inputs.technique.slot_order = order;
        let run = run?.map_err(RuntimeError::Validation)?;
        let sample = self.time(std::slice::from_ref(&run))?.swap_remove(0);
        let counters = sample.last().map_or(&[][..], |s| &s.counters[..]);
        let queues = self.inputs.layout(own)?.queues.of_kernels(own);
        for (kernel, queues) in own.kernels.iter().zip(queues) {
            let (material, queue) = (kernel.materials[0], queues.start);
            let taken = run.counters.taken_of(counters, queue);
            let mut met = vec![false; blocks];
            for slot in self.read_queue(queue, taken)? {
                if let Some(block) = met.get_mut((slot / BLOCK) as usize) {
                    *block = true;
                }
            }
            let present = met.iter().filter(|met| **met).count();
            let hits = &mut self.workload.materials[material];
            hits.share = f64::from(taken) / pool;
            hits.present = present as f64 / blocks as f64;
        }
        Ok(())
    }

    /// The slots in a queue.
    fn read_queue(&self, queue: usize, length: u32) -> Result<Vec<u32>, RuntimeError> {
        if length == 0 {
            return Ok(Vec::new());
        }
        let (gpu, queues) = (self.gpu, self.resources.buffer(BufferId::Queues));
        let size = 4 * u64::from(length);
        let staging = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("queue readback"),
            size,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let begin = 4 * queue as u64 * u64::from(self.sizes.pool);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(queues, begin, &staging, 0, size);
        let index = gpu.queue.submit([encoder.finish()]);
        gpu.read(&staging, index, size, |bytes| {
            bytemuck::pod_collect_to_vec(bytes)
        })
    }
}
