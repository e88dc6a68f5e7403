//! What the host learns while a render runs: counters and times of each submission.

use crate::gpu::submission::Done;
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

    /// Adds what a submission did.
    pub(crate) fn add(&mut self, done: Done) {
        for (sum, seconds) in self.step_seconds.iter_mut().zip(&done.step_seconds) {
            *sum += seconds;
        }
        self.gpu_seconds += done.seconds;
        self.counters = done.counters;
        self.iterations += u64::from(done.iterations);
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
