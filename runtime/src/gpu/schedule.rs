//! Recording: the dispatches of iterations, in order, with their timestamps.

use crate::gpu::Timing;

/// How many workgroups a dispatch has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Size {
    /// Known when recording: x, y.
    Direct(u32, u32),
    /// Read from the buffer of arguments at a byte offset.
    Indirect(u64),
}

impl Size {
    /// Enough groups for `items` threads, in rows of at most `row` groups.
    pub(crate) fn for_items(items: u32, workgroup: u32, row: u32) -> Self {
        let groups = items.div_ceil(workgroup);
        Size::Direct(groups.min(row), groups.div_ceil(row))
    }
}

/// One dispatch of an iteration.
#[derive(Clone, Debug)]
pub(crate) struct Step {
    pub name: String,
    pub pipeline: wgpu::ComputePipeline,
    pub bind_group: wgpu::BindGroup,
    pub size: Size,
}

/// The dispatches of one iteration and the buffer their indirect sizes are in.
#[derive(Clone, Debug)]
pub(crate) struct Schedule {
    pub steps: Vec<Step>,
    pub arguments: wgpu::Buffer,
    pub timing: Timing,
}

impl Schedule {
    /// Records `iterations` iterations. `queries` has room for their timestamps, if the
    /// timing writes any.
    pub(crate) fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        iterations: u32,
        queries: Option<&wgpu::QuerySet>,
    ) {
        match (self.timing, queries) {
            (Timing::AroundPass, Some(queries)) => {
                self.record_timed_passes(encoder, iterations, queries);
            }
            (Timing::InPass, Some(queries)) => {
                self.record_one_pass(encoder, iterations, Some(queries));
            }
            _ => self.record_one_pass(encoder, iterations, None),
        }
    }

    /// A pass for all dispatches: entering one costs several times what a dispatch costs.
    fn record_one_pass(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        iterations: u32,
        queries: Option<&wgpu::QuerySet>,
    ) {
        let descriptor = wgpu::ComputePassDescriptor {
            label: Some("impasto"),
            timestamp_writes: None,
        };
        let mut pass = encoder.begin_compute_pass(&descriptor);
        let mut query = 0;
        let mut stamp = |pass: &mut wgpu::ComputePass<'_>| {
            if let Some(queries) = queries {
                pass.write_timestamp(queries, query);
                query += 1;
            }
        };
        stamp(&mut pass);
        for _ in 0..iterations {
            for step in &self.steps {
                self.dispatch(&mut pass, step);
                stamp(&mut pass);
            }
        }
    }

    fn record_timed_passes(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        iterations: u32,
        queries: &wgpu::QuerySet,
    ) {
        let steps = (0..iterations).flat_map(|_| &self.steps);
        for (index, step) in (0..).zip(steps) {
            let descriptor = wgpu::ComputePassDescriptor {
                label: Some(&step.name),
                timestamp_writes: Some(wgpu::ComputePassTimestampWrites {
                    query_set: queries,
                    beginning_of_pass_write_index: Some(2 * index),
                    end_of_pass_write_index: Some(2 * index + 1),
                }),
            };
            self.dispatch(&mut encoder.begin_compute_pass(&descriptor), step);
        }
    }

    fn dispatch(&self, pass: &mut wgpu::ComputePass<'_>, step: &Step) {
        pass.set_pipeline(&step.pipeline);
        pass.set_bind_group(0, &step.bind_group, &[]);
        match step.size {
            Size::Direct(x, y) => pass.dispatch_workgroups(x, y, 1),
            Size::Indirect(at) => pass.dispatch_workgroups_indirect(&self.arguments, at),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pool_beyond_one_dimension_opens_a_second() {
        let row = 65_535;
        assert_eq!(Size::for_items(1, 64, row), Size::Direct(1, 1));
        assert_eq!(Size::for_items(64 * row, 64, row), Size::Direct(row, 1));
        assert_eq!(Size::for_items(64 * row + 1, 64, row), Size::Direct(row, 2));
    }
}
