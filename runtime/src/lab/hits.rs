//! What the iteration hits that is measured: counted on the host, from the queues themselves.

use impasto_compiler::partition::workload::BLOCK;
use impasto_compiler::partition::{Form, Plan};

use super::{Candidate, Lab};
use crate::error::RuntimeError;
use crate::kernels::buffers::BufferId;
use crate::technique::SlotOrder;
use crate::world::needs::Need;

impl Lab<'_> {
    /// Counts the hits of each material, and the blocks with any of neighbouring threads that look for hits.
    pub(super) fn count_hits(&mut self, own: &Plan) -> Result<(), RuntimeError> {
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
        let layout = self.inputs.layout(own)?;
        let read = |queue| self.read_queue(queue, run.counters.taken_of(counters, queue));
        let begun = if layout.needs.has(Need::CameraDecides) {
            read(layout.queues.new_paths())?
        } else {
            Vec::new()
        };
        // The threads that look for hits: one a slot, and behind these one for each path that begins.
        let pool = self.sizes.pool;
        let first = pool.next_multiple_of(BLOCK);
        let mut threads: Vec<u32> = (0..pool).collect();
        for (thread, slot) in (first..).zip(&begun) {
            if let Some(of_slot) = threads.get_mut(*slot as usize) {
                *of_slot = thread;
            }
        }
        let blocks = (first as usize + begun.len()).div_ceil(BLOCK as usize);
        let share = |some: &[u32]| some.len() as f64 / f64::from(pool);
        let mut counted = Vec::new();
        for (kernel, queues) in own.kernels.iter().zip(layout.queues.of_kernels(own)) {
            let slots = read(queues.start)?;
            let mut met = vec![false; blocks];
            for thread in slots.iter().filter_map(|slot| threads.get(*slot as usize)) {
                met[(thread / BLOCK) as usize] = true;
            }
            let met = met.iter().filter(|met| **met).count() as f64 / blocks as f64;
            counted.push((kernel.materials[0], share(&slots), met));
        }
        self.workload.begun = share(&begun);
        for (material, share, met) in counted {
            self.workload.materials[material].count(share, met, self.workload.begun);
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
