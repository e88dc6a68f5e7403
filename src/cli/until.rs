//! `render --until`: goals in words, and what is said of a render that pursues them.

use std::time::Duration;

use clap::Args;
use impasto::goal::{Goal, kinds, parse};
use impasto::runtime::render::report::Report;
use impasto::runtime::render::until::{Check, Ending, Goals, LEAST_SAMPLES};

use super::Failure;
use super::completions::Known;
use super::outputs::Outputs;

/// Samples a pixel after which a render ends that was given no limit.
pub(super) const LIMIT: u32 = 1 << 20;

#[derive(Args)]
pub(super) struct UntilArgs {
    /// Render until the error is small enough or the time is up: `relmse=1e-3`, `rmse=0.01`, `time=60s`
    /// (ms, s, min, h). May be given several times: what is reached first ends the render. Errors are
    /// estimated while rendering, by two halves of the samples (see docs/until.md); --spp is the limit,
    /// otherwise 1048576 samples
    #[arg(long, value_name = "GOAL", value_parser = Known::new(parse, kinds), hide_possible_values = true, conflicts_with = "checkpoint")]
    until: Vec<Goal>,
}

impl UntilArgs {
    /// Is there a goal?
    pub(super) fn is_given(&self) -> bool {
        !self.until.is_empty()
    }

    /// The goals, if there are any and `spp` and the files to be written go with them.
    pub(super) fn goals(
        &self,
        spp: Option<u32>,
        outputs: &Outputs,
    ) -> Result<Option<Goals>, Failure> {
        if self.until.is_empty() {
            return Ok(None);
        }
        if spp.is_some_and(|spp| spp < LEAST_SAMPLES) {
            return Err(Failure::Error(format!(
                "--spp {} is too few to estimate an error by\n  hint: with --until it is the most that is \
                 taken, and at least {LEAST_SAMPLES}",
                spp.unwrap_or_default()
            )));
        }
        if outputs.is_film() {
            return Err(Failure::Error(
                "a .film file is a part of a render by one seed, but --until takes samples by two\n  hint: \
                 write a picture, or say how many samples to take with --spp"
                    .into(),
            ));
        }
        let mut goals = Goals::default();
        for goal in &self.until {
            let (name, before) = goal.add_to(&mut goals);
            if before {
                let message = format!("--until has more than one goal for {name}");
                return Err(Failure::Error(message));
            }
        }
        Ok(Some(goals))
    }
}

/// How near a render is to its goals.
#[derive(Clone, Copy, Debug)]
pub(super) struct Way {
    goals: Goals,
    /// The most samples a pixel.
    limit: f64,
    /// Samples a pixel that an error takes which was asked for, by the last estimate.
    expected: f64,
}

impl Way {
    /// Of a render that has just begun, of `limit` samples a pixel at most.
    pub(super) fn new(goals: &Goals, limit: u32) -> Self {
        Self {
            goals: *goals,
            limit: f64::from(limit),
            expected: f64::INFINITY,
        }
    }

    /// After one more estimate. relMSE and the square of RMSE fall like one over the samples, or faster.
    pub(super) fn seen(self, check: &Check) -> Self {
        let samples = f64::from(check.samples);
        let relmse = self.goals.relmse.map(|goal| check.relmse / goal);
        let rmse = self.goals.rmse.map(|goal| (check.rmse / goal).powi(2));
        let factors = relmse.into_iter().chain(rmse);
        let expected = factors.fold(f64::INFINITY, |least, factor| least.min(samples * factor));
        Self { expected, ..self }
    }

    /// The share that is done after so many samples a pixel and so much time, by the goal that is nearest.
    pub(super) fn share(&self, samples: f64, elapsed: Duration) -> f64 {
        let time = self.goals.time;
        let time = time.map_or(0.0, |time| elapsed.as_secs_f64() / time.as_secs_f64());
        let of_samples = samples / self.expected.min(self.limit).max(1.0);
        time.max(of_samples)
    }
}

/// A line for an estimate.
pub(super) fn line(check: &Check) -> String {
    format!(
        "{:>9} samples, {:>9.3} s: relMSE {:.3e}, RMSE {:.3e}",
        check.samples, check.seconds, check.relmse, check.rmse
    )
}

/// How a render came to its end; a warning if it missed an error that was asked for.
pub(super) fn ending(report: &Report, goals: &Goals) -> Option<String> {
    let last = report.convergence.last();
    let samples = report.samples_per_pixel;
    let why = match report.ended_by? {
        Ending::Relmse => return Some(format!("reached the relMSE after {samples} samples")),
        Ending::Rmse => return Some(format!("reached the RMSE after {samples} samples")),
        Ending::Interrupt => return None,
        Ending::Time => "the time was over",
        Ending::Samples => "all samples were taken",
    };
    let wanted = [("relMSE", goals.relmse), ("RMSE", goals.rmse)];
    let missed = wanted.into_iter().filter_map(|(name, goal)| {
        let is = last.map(|check| {
            if name == "relMSE" {
                check.relmse
            } else {
                check.rmse
            }
        });
        let is = is.map_or("unknown".to_owned(), |error| format!("{error:.3e}"));
        Some(format!("the {name} is {is}, not {:.3e}", goal?))
    });
    let missed: Vec<String> = missed.collect();
    Some(if missed.is_empty() {
        format!("{why} after {samples} samples")
    } else {
        format!(
            "warning: {why} after {samples} samples: {}",
            missed.join(", and ")
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_goal_tells_how_far_a_render_is() {
        let goals = Goals {
            relmse: Some(0.01),
            time: Some(Duration::from_secs(100)),
            ..Goals::default()
        };
        let begun = Way::new(&goals, 1000);
        let after = |way: &Way, samples, seconds| way.share(samples, Duration::from_secs(seconds));
        assert_eq!(after(&begun, 10.0, 0), 0.01);
        assert_eq!(after(&begun, 10.0, 25), 0.25);
        let check = Check {
            samples: 20,
            seconds: 1.0,
            gpu_seconds: 1.0,
            relmse: 0.04,
            rmse: 0.5,
        };
        let seen = begun.seen(&check);
        assert_eq!(after(&seen, 20.0, 10), 0.25);
        assert_eq!(after(&seen, 40.0, 10), 0.5);
        let both = Way::new(
            &Goals {
                rmse: Some(0.25),
                relmse: None,
                time: None,
            },
            1000,
        );
        assert_eq!(after(&both.seen(&check), 20.0, 9999), 0.25);
    }
}
