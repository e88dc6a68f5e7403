//! Scores of models of kernels' times, on mixes whose kernels were measured: no GPU is needed, and no scene.
//!
//! A model is anything that says how long a kernel takes: a device profile, a table that somebody made, or one of some
//! simple baselines. Its error is that of kernels' times. Its regret is what a search loses that trusts it: of all plans
//! that are made of measured kernels it takes the one that the model finds fastest, and that is held against the fastest.

mod data;
mod model;
mod table;
#[cfg(test)]
mod tests;

use impasto_compiler::partition::{Form, text};
use impasto_runtime::lab::statistics::{median, quantile};
use serde::Serialize;

pub use data::{Dataset, read};
pub use model::{BASELINES, Model};
pub use table::{by_size, scores as table, text as scores_text};

use super::partition::plans::{Plan, Sets, Times};
use super::partition::{Pair, correlation, median_error};
use crate::measure::Measurement;

/// How a model does.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Score {
    /// The model's name.
    pub model: String,
    /// Kernels that it predicts.
    pub kernels: usize,
    /// The median of |predicted / measured - 1|; none if it predicts no times.
    pub median_error: Option<f64>,
    /// The same that one kernel in ten exceeds.
    pub tenth_error: Option<f64>,
    /// Spearman's rank correlation of predicted and measured times.
    pub rank_correlation: Option<f64>,
    /// Of each mix for which it has a plan: what that loses.
    pub mixes: Vec<Lost>,
    /// Mixes for which it has none: a kernel was not measured, or not predicted.
    pub without_plan: usize,
    /// Why there is no score, if there is none: there are too few mixes to fit a model to, for instance.
    pub none: Option<String>,
}

/// What a plan loses in a mix.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Lost {
    /// The mix.
    pub mix: String,
    /// Materials on surfaces.
    pub materials: usize,
    /// The plan, as a partition string.
    pub plan: String,
    /// Time of an iteration by it over that by the best plan.
    pub regret: f64,
    /// The same of material kernels alone; none if the best takes no time.
    pub kernels_regret: Option<f64>,
}

impl Score {
    /// The regret of iterations: the median of mixes, and the worst with its mix.
    pub fn regret(&self) -> Option<(f64, f64, &str)> {
        let middle = median(self.mixes.iter().map(|lost| lost.regret))?;
        let worst = self
            .mixes
            .iter()
            .max_by(|a, b| a.regret.total_cmp(&b.regret))?;
        Some((middle, worst.regret, &worst.mix))
    }

    /// The worst regret of material kernels.
    pub fn worst_kernels(&self) -> Option<f64> {
        let all = self.mixes.iter().filter_map(|lost| lost.kernels_regret);
        all.max_by(f64::total_cmp)
    }

    /// The share of mixes in which its plan is the best.
    pub fn best(&self) -> f64 {
        let best = self.mixes.iter().filter(|lost| lost.regret <= 1.0 + 1e-9);
        best.count() as f64 / self.mixes.len().max(1) as f64
    }
}

/// A mix as scores need it.
struct Subject<'a> {
    set: &'a Measurement,
    sets: Sets,
    measured: Times,
    best: f64,
}

/// The most materials of a mix: sets of them are bits of a number, and all subsets are tried.
const MOST: u32 = 16;

impl<'a> Subject<'a> {
    fn new(set: &'a Measurement) -> Result<Self, String> {
        let scene = &set.scene;
        let sets = Sets::of(set)?;
        let used = sets.used.count_ones();
        if used > MOST {
            return Err(format!(
                "`{scene}` has {used} materials: scores are of at most {MOST}"
            ));
        }
        let measured = sets.times(set.kernels.iter().map(|k| Some(k.measured)));
        let best = measured.best(sets.used).map(|(_, seconds)| seconds);
        let best = best.ok_or_else(|| {
            format!(
                "the kernels of `{scene}` that were measured make no plan for all of its materials"
            )
        })?;
        Ok(Self {
            set,
            sets,
            measured,
            best,
        })
    }

    /// What the plan that a model chooses loses; none if it has none.
    fn lost(&self, plan: Option<Plan>) -> Option<Lost> {
        let plan = plan?;
        let seconds = self.measured.sum(&plan)?;
        let rest = self.set.logic_seconds + self.set.other_seconds;
        Some(Lost {
            mix: self.set.scene.clone(),
            materials: self.sets.used.count_ones() as usize,
            plan: plan.text(&self.sets.names),
            regret: (rest + seconds) / (rest + self.best),
            kernels_regret: (self.best > 0.0).then(|| seconds / self.best),
        })
    }

    /// What the best of some plans loses, of those that are made of measured kernels.
    fn least_lost(&self, plans: &[impasto_compiler::partition::Plan]) -> Option<Lost> {
        let parsed = plans.iter().map(|plan| {
            let plan = self.sets.plan(&text::print(plan, &self.sets.names));
            self.lost(plan.ok())
        });
        let all = parsed.flatten();
        all.min_by(|a, b| a.regret.total_cmp(&b.regret))
    }

    /// The plan of measured kernels whose predicted times add up to the least.
    fn chosen(&self, predicted: &[Option<f64>]) -> Option<Plan> {
        let times = self.sets.times(predicted.iter().copied());
        times.best(self.sets.used).map(|(plan, _)| plan)
    }

    /// What was predicted and what was measured of each kernel. Of inline materials, it is the logic kernel with them in it.
    fn pairs(&self, predicted: &[Option<f64>]) -> Vec<Pair> {
        let pair = |(kernel, predicted): (&crate::measure::Kernel, &Option<f64>)| {
            let logic = match kernel.form {
                Form::Inline => self.set.logic_seconds,
                _ => 0.0,
            };
            Some(Pair {
                predicted: logic + (*predicted)?,
                measured: logic + kernel.measured,
            })
        };
        let pairs = self.set.kernels.iter().zip(predicted).filter_map(pair);
        // Measured inline materials may make logic seem faster than without any.
        pairs.filter(|pair| pair.measured > 0.0).collect()
    }
}

/// How models do on measured mixes.
///
/// # Errors
/// If a mix makes no plan, or no model has a score.
pub fn score(sets: &[Measurement], models: &[Model]) -> Result<Vec<Score>, String> {
    let subjects = sets
        .iter()
        .map(Subject::new)
        .collect::<Result<Vec<_>, _>>()?;
    let scores = models.iter().map(|model| one(&subjects, model));
    let scores = scores.collect::<Result<Vec<_>, _>>()?;
    match scores
        .iter()
        .map(|s| s.none.as_ref())
        .collect::<Option<Vec<_>>>()
    {
        Some(none) if !none.is_empty() => {
            let each = scores.iter().zip(none);
            let each = each.map(|(score, why)| format!("`{}`: {why}", score.model));
            Err(each.collect::<Vec<_>>().join("\n"))
        }
        _ => Ok(scores),
    }
}

fn one(subjects: &[Subject<'_>], model: &Model) -> Result<Score, String> {
    let mut score = Score {
        model: model.name(),
        kernels: 0,
        median_error: None,
        tenth_error: None,
        rank_correlation: None,
        mixes: Vec::new(),
        without_plan: 0,
        none: None,
    };
    let sets: Vec<&Measurement> = subjects.iter().map(|subject| subject.set).collect();
    let mut pairs: Vec<Pair> = Vec::new();
    let halves = match model.of_halves(&sets) {
        Ok(halves) => halves,
        Err(why) => {
            score.none = Some(why);
            return Ok(score);
        }
    };
    for (at, subject) in subjects.iter().enumerate() {
        let model = &halves[at % 2];
        let plans = model.plans(subject.set)?;
        let lost = if plans.is_empty() {
            let predicted = model.predict(subject.set, &sets);
            pairs.extend(subject.pairs(&predicted));
            subject.lost(subject.chosen(&predicted))
        } else {
            subject.least_lost(&plans)
        };
        match lost {
            Some(lost) => score.mixes.push(lost),
            None => score.without_plan += 1,
        }
    }
    if score.mixes.is_empty() {
        score.none = Some("it has a plan for none of the mixes".into());
        return Ok(score);
    }
    score.kernels = pairs.len();
    score.tenth_error = quantile(pairs.iter().copied().map(Pair::error), 0.9);
    score.rank_correlation = correlation(&pairs);
    score.median_error = median_error(pairs);
    Ok(score)
}
