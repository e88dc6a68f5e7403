//! What the host learns while a render runs: counters and times of each submission.

use crate::error::RuntimeError;
use crate::gpu::Gpu;
use crate::gpu::schedule::Schedule;
use crate::kernels::dropped::Dropped;
use crate::kernels::queues::Counters;

/// What is known so far.
#[derive(Clone, Debug)]
pub(crate) struct Status {
    /// The buffer of counters as the last submission left it.
    pub counters: Vec<u32>,
    /// GPU seconds of each step of the schedule.
    pub step_seconds: Vec<f64>,
    /// GPU seconds in all.
    pub gpu_seconds: f64,
    /// Iterations run.
    pub iterations: u64,
    /// After each submission: paths finished, and GPU seconds until then.
    pub history: Vec<(u64, f64)>,
    /// What an earlier plan did.
    pub before: Before,
}

/// What was done by a plan that another took over from, as far as it is not part of the totals.
#[derive(Clone, Debug, Default)]
pub(crate) struct Before {
    /// Iterations run.
    pub iterations: u64,
    /// Requests for new paths.
    pub asked: u64,
    /// Samples that were dropped.
    pub dropped: Vec<Dropped>,
}

impl Status {
    pub(crate) fn new(steps: usize) -> Self {
        Self {
            counters: Vec::new(),
            step_seconds: vec![0.0; steps],
            gpu_seconds: 0.0,
            iterations: 0,
            history: Vec::new(),
            before: Before::default(),
        }
    }

    /// Goes on with another plan of `steps` steps, whose buffer of counters has `words` words and
    /// took over the first, the scalars.
    pub(crate) fn go_on(&mut self, before: Before, steps: usize, words: usize) {
        self.before = before;
        self.step_seconds = vec![0.0; steps];
        self.counters.truncate(Counters::SCALARS);
        self.counters.resize(words, 0);
    }

    /// Paths finished in a GPU second while the mixture of paths was steady: from a quarter to nine
    /// tenths of `total` paths, without the beginning, when camera rays are coherent and
    /// paths short, and without the end, when the pool runs empty. `None` if too few submissions
    /// fell into that time.
    pub(crate) fn steady_rate(&self, total: u64) -> Option<f64> {
        let between = |(paths, _): &&(u64, f64)| 4 * paths >= total && 10 * paths <= 9 * total;
        let (from, first) = self.history.iter().find(between)?;
        let (to, last) = self.history.iter().rfind(between)?;
        (last > first).then(|| (to - from) as f64 / (last - first))
    }
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

    /// Iterations of the submission that is under way.
    pub(crate) fn iterations(&self) -> u64 {
        u64::from(self.iterations)
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

    /// Waits for the submission and adds what it brought to `status`.
    pub(crate) fn wait(
        &mut self,
        gpu: &Gpu,
        schedule: &Schedule,
        status: &mut Status,
    ) -> Result<(), RuntimeError> {
        let Some(index) = self.index.take() else {
            return Ok(());
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
        let (seconds, all) = schedule.timing.seconds(&ticks, period);
        for (index, seconds) in seconds.into_iter().enumerate() {
            let step = index % schedule.steps.len();
            status.step_seconds[step] += seconds;
        }
        status.gpu_seconds += all;
        status.counters = counters;
        status.iterations += u64::from(self.iterations);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_steady_rate_leaves_begin_and_end_out() {
        let mut status = Status::new(1);
        status.history = vec![(100, 1.0), (250, 2.0), (500, 4.0), (900, 8.0), (1000, 99.0)];
        assert_eq!(status.steady_rate(1000), Some(650.0 / 6.0));
        status.history = vec![(100, 1.0), (500, 2.0), (1000, 3.0)];
        assert_eq!(status.steady_rate(1000), None);
    }
}
