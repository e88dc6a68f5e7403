//! A submission of iterations, and what it brings back.

use super::Gpu;
use super::schedule::Schedule;
use crate::error::RuntimeError;

/// What a submission did.
#[derive(Clone, Debug, Default)]
pub(crate) struct Done {
    /// The buffer of counters as it left them.
    pub counters: Vec<u32>,
    /// Seconds of each step of the schedule.
    pub step_seconds: Vec<f64>,
    /// Seconds in all.
    pub seconds: f64,
    /// Its iterations.
    pub iterations: u32,
}

/// A submission and the buffer that brings its status back, for one submission after another.
#[derive(Debug)]
pub(crate) struct Submission {
    readback: wgpu::Buffer,
    queries: Option<(wgpu::QuerySet, wgpu::Buffer)>,
    counter_bytes: u64,
    query_count: u32,
    iterations: u32,
    index: Option<wgpu::SubmissionIndex>,
}

impl Submission {
    /// Room for `counters` words and `queries` timestamps.
    pub(crate) fn new(gpu: &Gpu, counters: usize, queries: u32) -> Result<Self, RuntimeError> {
        let counter_bytes = (4 * counters as u64).next_multiple_of(8);
        let query_bytes = 8 * u64::from(queries);
        let buffer = |label, size, usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: usage | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let timestamps = (queries > 0).then(|| {
            let set = gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("timestamps"),
                ty: wgpu::QueryType::Timestamp,
                count: queries,
            });
            let usage = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
            (set, buffer("timestamps", query_bytes, usage))
        });
        let size = counter_bytes + query_bytes;
        let submission = Self {
            readback: buffer("status", size, wgpu::BufferUsages::MAP_READ),
            queries: timestamps,
            counter_bytes,
            query_count: 0,
            iterations: 0,
            index: None,
        };
        gpu.check()?;
        Ok(submission)
    }

    pub(crate) fn queries(&self) -> Option<&wgpu::QuerySet> {
        self.queries.as_ref().map(|(set, _)| set)
    }

    /// Records the copies into the readback buffer, of `queries` timestamps.
    pub(crate) fn copy(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        counters: &wgpu::Buffer,
        queries: u32,
    ) {
        self.query_count = queries;
        let bytes = counters.size().min(self.counter_bytes);
        encoder.copy_buffer_to_buffer(counters, 0, &self.readback, 0, bytes);
        if let Some((set, resolved)) = &self.queries {
            let (at, bytes) = (self.counter_bytes, 8 * u64::from(queries));
            encoder.resolve_query_set(set, 0..queries, resolved, 0);
            encoder.copy_buffer_to_buffer(resolved, 0, &self.readback, at, bytes);
        }
    }

    /// Submits what was recorded.
    pub(crate) fn submit(&mut self, gpu: &Gpu, encoder: wgpu::CommandEncoder, iterations: u32) {
        self.iterations = iterations;
        self.index = Some(gpu.queue.submit([encoder.finish()]));
    }

    /// Waits for the submission; what it did. Nothing if nothing was submitted.
    pub(crate) fn wait(&mut self, gpu: &Gpu, schedule: &Schedule) -> Result<Done, RuntimeError> {
        let Some(index) = self.index.take() else {
            return Ok(Done::default());
        };
        let size = self.counter_bytes + 8 * u64::from(self.query_count);
        let split = self.counter_bytes as usize;
        let (counters, ticks): (Vec<u32>, Vec<u64>) =
            gpu.read(&self.readback, index, size, |bytes| {
                let (counters, ticks) = bytes.split_at(split);
                (
                    bytemuck::pod_collect_to_vec(counters),
                    bytemuck::pod_collect_to_vec(ticks),
                )
            })?;
        let period = gpu.queue.get_timestamp_period();
        let (each, all) = schedule.timing.seconds(&ticks, period);
        let mut step_seconds = vec![0.0; schedule.steps.len()];
        for (index, seconds) in each.into_iter().enumerate() {
            step_seconds[index % schedule.steps.len()] += seconds;
        }
        Ok(Done {
            counters,
            step_seconds,
            seconds: all,
            iterations: self.iterations,
        })
    }
}
