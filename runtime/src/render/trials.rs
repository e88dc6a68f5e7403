//! Trials: since every plan gives the same bits, a render that lasts runs several of those that the model finds good, each for
//! some iterations, and keeps the one that was fastest.
//!
//! Two plans at a time are held against each other: the fastest so far and the next one. The paths in flight are the same and
//! so is their mixture, so that the time of an iteration tells which is faster.

use std::sync::mpsc::TryRecvError;

use impasto_compiler::partition::{Expected, Plan};

use super::background::{Jobbing, Made, Outcome};
use super::build::BuiltPlan;
use crate::render::status::Status;

/// By how much another plan must be faster, as a share: less is noise.
const NOTABLE: f64 = 0.005;

/// By how much of an iteration a plan that was timed before may be slower or faster now.
const TIMED: f64 = 0.005;

/// A trial begins if what it is expected to gain over what is left of the render is so many times what it is expected to cost while
/// it lasts: the best that is expected of several plans is less than the sum of them.
const WORTH: f64 = 4.0;

/// Plans that wait to be tried beside the one that runs.
#[derive(Debug)]
pub(super) struct Trials {
    job: Jobbing,
    stage: Stage,
    least: Least,
    stopwatch: Stopwatch,
    /// What an iteration takes by the fastest so far, in times of one by the first plan.
    fastest: f64,
    /// What ran before the first plan, if it could be timed.
    begun: Option<Timed>,
}

/// A plan that ran.
#[derive(Debug)]
pub(super) struct Timed {
    pub plan: Plan,
    /// What an iteration took, while it counted hits.
    pub seconds: f64,
}

/// How long a plan is timed, at least.
#[derive(Clone, Copy, Debug)]
pub(super) struct Least {
    pub iterations: u64,
    /// Of the GPU.
    pub seconds: f64,
}

impl Least {
    /// How long it is where an iteration takes some seconds.
    fn time(self, iteration: f64) -> f64 {
        self.seconds.max(self.iterations as f64 * iteration)
    }
}

#[derive(Debug)]
enum Stage {
    /// The fastest so far runs and is timed, until another is built.
    Timing,
    /// Another is to run.
    Due(Box<Trial>),
    /// It runs and is timed.
    Running(Box<Trial>),
    /// The fastest is to run again.
    Back(Box<BuiltPlan>),
    Over,
}

/// A plan that is tried.
#[derive(Debug)]
struct Trial {
    made: Made,
    /// The plan that does not run meanwhile: before the trial the one to be tried, then the fastest so far.
    other: BuiltPlan,
    /// What an iteration took by the fastest so far, in seconds.
    least: f64,
}

/// What became of a trial.
#[derive(Debug)]
pub(super) struct Tried {
    /// The plan, and what it took to make.
    pub made: Made,
    /// Seconds of an iteration by it, and by the fastest until then; or why it could not run.
    pub outcome: Result<[f64; 2], String>,
    /// Whether it goes on.
    pub is_kept: bool,
}

impl Timed {
    /// What is expected of a plan beside another, of which an iteration takes some `seconds`, if it is this one.
    fn expected(&self, plan: &Plan, seconds: f64) -> Option<Expected> {
        plan.does_as(&self.plan).then(|| Expected {
            ratio: self.seconds / seconds,
            error: TIMED,
        })
    }
}

/// Whether a trial may gain more than it costs where so many times its time is left.
fn is_worth(expected: Expected, left: f64) -> bool {
    left * expected.gain() >= WORTH * expected.loss()
}

impl Trial {
    /// Whether it may gain more than it costs where so many times its time is left.
    fn is_worth(&self, left: f64) -> bool {
        self.made.expected.is_some_and(|it| is_worth(it, left))
    }
}

impl Trials {
    /// Of what a job makes, beside a plan that begins to run now in the place of what has `begun`.
    pub(super) fn new(job: Jobbing, least: Least, begun: Option<Timed>, status: &Status) -> Self {
        Self {
            job,
            least,
            stage: Stage::Timing,
            stopwatch: Stopwatch::new(status),
            fastest: 1.0,
            begun,
        }
    }

    /// Times anew in a pass, after so many iterations in which the mixture of paths becomes steady.
    pub(super) fn begin_pass(&mut self, iterations: u64, warm: u64) {
        self.stopwatch = Stopwatch {
            from: iterations + warm,
            begin: None,
        };
    }

    /// Goes on, now that more is known and `left` seconds of the render are; with `wait` not before the next plan is built. What
    /// became of a trial, if one ended.
    pub(super) fn advance(&mut self, status: &Status, left: f64, wait: bool) -> Option<Tried> {
        let seconds = self.stopwatch.seconds(status, self.least)?;
        let (stage, tried) = match std::mem::replace(&mut self.stage, Stage::Over) {
            Stage::Timing => {
                let trials_left = left / self.least.time(seconds);
                match (trials_left >= WORTH).then(|| self.next(seconds, wait)) {
                    Some((Stage::Due(trial), _)) if !trial.is_worth(trials_left) => {
                        (Stage::Timing, None)
                    }
                    Some(next) => next,
                    None => (self.over(), None),
                }
            }
            Stage::Running(trial) => {
                let is_kept = seconds < trial.least * (1.0 - NOTABLE);
                let tried = Tried {
                    made: trial.made,
                    outcome: Ok([seconds, trial.least]),
                    is_kept,
                };
                let stage = if is_kept {
                    self.fastest *= seconds / trial.least;
                    Stage::Timing
                } else {
                    Stage::Back(Box::new(trial.other))
                };
                (stage, Some(tried))
            }
            same => (same, None),
        };
        self.stage = stage;
        tried
    }

    /// What is expected of a plan beside the fastest so far, of which an iteration takes some `seconds`.
    fn expected(&self, made: &Made, seconds: f64) -> Option<Expected> {
        let timed = self.begun.as_ref().zip(made.plan.as_ref());
        let timed = timed.and_then(|(begun, plan)| begun.expected(plan, seconds));
        timed.or_else(|| made.expected.map(|it| it.beside(self.fastest)))
    }

    /// No further plan is made.
    fn over(&self) -> Stage {
        self.job.cancel();
        Stage::Over
    }

    /// The next plan, beside one of which an iteration takes `least` seconds.
    fn next(&self, least: f64, wait: bool) -> (Stage, Option<Tried>) {
        let next = if wait {
            self.job.wait()
        } else {
            self.job.next()
        };
        let outcome: Outcome = match next {
            Ok(outcome) => outcome,
            Err(TryRecvError::Empty) => return (Stage::Timing, None),
            Err(TryRecvError::Disconnected) => return (Stage::Over, None),
        };
        let (mut made, built) = outcome;
        made.expected = self.expected(&made, least);
        match built {
            Ok(other) => (Stage::Due(Box::new(Trial { made, other, least })), None),
            Err(why) => {
                let tried = Tried {
                    made,
                    outcome: Err(why),
                    is_kept: false,
                };
                (Stage::Timing, Some(tried))
            }
        }
    }

    /// Whether another plan is to run now.
    pub(super) fn is_due(&self) -> bool {
        matches!(self.stage, Stage::Due(_) | Stage::Back(_))
    }

    /// The plan that is to run in the place of the `present` one, if it is not the present one.
    pub(super) fn change(&mut self, present: &BuiltPlan, status: &Status) -> Option<BuiltPlan> {
        let (stage, next) = match std::mem::replace(&mut self.stage, Stage::Over) {
            Stage::Due(mut trial) => {
                let next = std::mem::replace(&mut trial.other, present.clone());
                (Stage::Running(trial), Some(next))
            }
            Stage::Back(fastest) => (Stage::Timing, Some(*fastest)),
            same => (same, None),
        };
        self.stage = stage;
        if next.is_some() {
            self.stopwatch = Stopwatch::new(status);
        }
        next
    }
}

/// Times iterations of the plan that runs.
#[derive(Debug)]
struct Stopwatch {
    /// It begins at the first submission that ends after so many iterations.
    from: u64,
    /// Iterations and GPU seconds then.
    begin: Option<(u64, f64)>,
}

impl Stopwatch {
    /// Begins when the next submission has ended.
    fn new(status: &Status) -> Self {
        Self {
            from: status.iterations + 1,
            begin: None,
        }
    }

    /// Seconds of an iteration, once enough are over.
    fn seconds(&mut self, status: &Status, least: Least) -> Option<f64> {
        let now = (status.iterations, status.gpu_seconds);
        if now.0 < self.from {
            return None;
        }
        let begin = *self.begin.get_or_insert(now);
        let (iterations, seconds) = (now.0 - begin.0, now.1 - begin.1);
        (iterations >= least.iterations && seconds >= least.seconds)
            .then(|| seconds / iterations as f64)
    }
}

#[cfg(test)]
mod tests {
    use impasto_compiler::partition::Form;

    use super::*;

    fn at(iterations: u64, gpu_seconds: f64) -> Status {
        Status {
            iterations,
            gpu_seconds,
            ..Status::new(1)
        }
    }

    #[test]
    fn the_more_is_left_the_less_must_be_promised() {
        let least = |ratio, error| {
            let expected = Expected { ratio, error };
            let is_worth = |left: &i32| is_worth(expected, f64::from(*left));
            assert!((1..1000).filter(is_worth).is_sorted_by(|a, b| a + 1 == *b));
            (1..1000).find(is_worth)
        };
        // As fast as what runs for all that is known: as likely faster as slower.
        assert_eq!(least(1.0, 0.1), Some(WORTH as i32));
        assert_eq!(least(0.8, 0.0), Some(1));
        assert!(least(1.02, 0.05) < least(1.1, 0.05));
        assert!(least(1.1, 0.2) < least(1.1, 0.05));
        assert_eq!(least(1.5, 0.02), None);
    }

    #[test]
    fn what_was_timed_is_expected_to_take_that_again() {
        let names = ["a", "b"].map(String::from);
        let plan = |form| Plan::wavefront("auto", [(form, vec![0, 1])], Vec::new(), &names);
        let begun = Timed {
            plan: plan(Form::Mixed),
            seconds: 0.03,
        };
        let expected = begun.expected(&plan(Form::Mixed), 0.04);
        let expected = expected.expect("it is the same plan");
        assert!(
            expected.ratio == 0.75 && is_worth(expected, WORTH),
            "{expected:?}"
        );
        assert_eq!(begun.expected(&plan(Form::Binned), 0.04), None);
    }

    #[test]
    fn what_is_timed_is_steady_and_long_enough() {
        let least = Least {
            iterations: 16,
            seconds: 0.03,
        };
        let mut stopwatch = Stopwatch::new(&at(100, 5.0));
        assert_eq!(stopwatch.seconds(&at(100, 5.0), least), None);
        // The first submission is the first with warm caches behind it: it starts the watch.
        assert_eq!(stopwatch.seconds(&at(104, 9.0), least), None);
        assert_eq!(stopwatch.seconds(&at(119, 9.5), least), None, "too few");
        assert_eq!(stopwatch.seconds(&at(124, 9.02), least), None, "too short");
        assert_eq!(stopwatch.seconds(&at(124, 9.5), least), Some(0.025));
    }
}
