//! A scene as measured: times of plans, regret, and how far predictions are off.

use super::Result;
use crate::measure::Answer;
use impasto_compiler::partition::Form;
use impasto_runtime::lab::statistics::{median, rank_correlation};

use super::plans::{Plan, Set, Times, every, kernel, members};
use super::results::{CHOSEN, Scene};

/// Plans of up to so many materials are all added up.
pub const EXHAUSTIVE: u32 = 6;

/// Strategies that the chosen plan is held against, besides mega, which has no material kernels.
pub const BASELINES: [&str; 6] = [
    "own",
    "mixed",
    "binned",
    "inline",
    "paper",
    "threshold=1000",
];

/// What follows from a scene's numbers.
pub struct Measured<'a> {
    pub scene: &'a Scene,
    /// Materials on surfaces.
    used: Set,
    measured: Times,
    predicted: Times,
    pub auto: Plan,
    pub best: Plan,
    /// Seconds of the material kernels of either.
    auto_seconds: f64,
    best_seconds: f64,
}

/// A kernel or plan: what was predicted and what was measured, in seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    pub predicted: f64,
    pub measured: f64,
}

impl Pair {
    /// How far the prediction is off, as a share.
    pub fn error(self) -> f64 {
        (self.predicted / self.measured - 1.0).abs()
    }
}

impl<'a> Measured<'a> {
    /// # Errors
    /// A plan that names what the scene has not, or kernels that the chosen plan needs and that were not
    /// measured.
    pub fn new(scene: &'a Scene) -> Result<Self> {
        let times = |of: fn(&super::results::Kernel) -> f64| {
            let entries = scene.kernels.iter().map(|k| {
                let set = k.1.iter().fold(0, |set, i| set | 1 << i);
                (kernel(k.0, set), of(k))
            });
            Times::new(entries)
        };
        let (predicted, measured) = (times(|k| k.2), times(|k| k.3));
        let used = scene.materials.iter().enumerate().filter(|(_, m)| m.used);
        let used: Set = used.fold(0, |set, (i, _)| set | 1 << i);
        let what = format!("{} with {} paths", scene.name, scene.pool);
        let auto = parse(scene, &scene.auto).map_err(|e| format!("{what}: {e}"))?;
        let missing = || {
            format!(
                "{what}: a kernel of the chosen plan {} was not measured",
                scene.auto
            )
        };
        let auto_seconds = measured.sum(&auto).ok_or_else(missing)?;
        let mut new = Self {
            scene,
            used,
            measured,
            predicted,
            best: auto.clone(),
            best_seconds: auto_seconds,
            auto_seconds,
            auto,
        };
        let candidates = new
            .listed()
            .into_iter()
            .filter_map(|p| Some((new.measured.sum(&p)?, p)));
        let searched = new
            .measured
            .best(used)
            .map(|(plan, seconds)| (seconds, plan));
        let best = candidates
            .chain(searched)
            .min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((seconds, plan)) = best.filter(|(seconds, _)| *seconds < auto_seconds) {
            (new.best, new.best_seconds) = (plan, seconds);
        }
        Ok(new)
    }

    /// Materials that plans are about.
    pub fn count(&self) -> u32 {
        self.used.count_ones()
    }

    /// As a partition string.
    pub fn text(&self, plan: &Plan) -> String {
        plan.text(&names(self.scene))
    }

    /// Seconds of an iteration but for material kernels.
    fn rest(&self) -> f64 {
        self.scene.logic + self.scene.other
    }

    /// The different plans that the answer lists and that can be read.
    fn listed(&self) -> Vec<Plan> {
        let plans = self.scene.plans.iter();
        let mut out: Vec<Plan> = plans
            .filter_map(|p| parse(self.scene, &p.partition).ok())
            .collect();
        out.sort();
        out.dedup();
        out
    }

    /// The plan of a strategy.
    fn plan_of(&self, strategy: &str) -> Option<Plan> {
        let own = || members(self.used).map(|i| (Form::Own, 1 << i)).collect();
        match strategy {
            "own" => Some(Plan::new(own())),
            "mixed" => Some(Plan::new(vec![kernel(Form::Mixed, self.used)])),
            "binned" => Some(Plan::new(vec![kernel(Form::Binned, self.used)])),
            "inline" => Some(Plan::new(vec![kernel(Form::Inline, self.used)])),
            _ => {
                let listed = self.scene.plans.iter().find(|p| p.strategy == strategy);
                let Some(listed) = listed else {
                    return self.threshold(strategy.strip_prefix("threshold=")?.parse().ok()?);
                };
                parse(self.scene, &listed.partition).ok()
            }
        }
    }

    /// A kernel for each material of so many operations and more, and a mixed one for the others; none if
    /// the operations of one are not known.
    fn threshold(&self, operations: f64) -> Option<Plan> {
        let mut kernels = Vec::new();
        let mut others: Set = 0;
        for i in members(self.used) {
            if self.scene.materials[i].operations? >= operations {
                kernels.push((Form::Own, 1 << i));
            } else {
                others |= 1 << i;
            }
        }
        if others != 0 {
            kernels.push(kernel(Form::Mixed, others));
        }
        Some(Plan::new(kernels))
    }

    /// Time of an iteration by the chosen plan over that by the best.
    pub fn regret(&self) -> f64 {
        (self.rest() + self.auto_seconds) / (self.rest() + self.best_seconds)
    }

    /// The same of material kernels alone.
    pub fn material_regret(&self) -> f64 {
        self.auto_seconds / self.best_seconds
    }

    /// In what the answer's own sum over all plans differs from this one's, if it does: both add up the same
    /// kernels, each in its way.
    pub fn disagreement(&self, answer: &Answer) -> Option<String> {
        let said = answer.regret.filter(|_| self.count() <= EXHAUSTIVE)?;
        let found = self.material_regret();
        ((said / found - 1.0).abs() > 1e-3).then(|| {
            format!(
                "`impasto plan` has the regret {said:.4} against {}, this {found:.4} against {}",
                answer.best,
                self.text(&self.best)
            )
        })
    }

    /// The regret of another strategy's plan; none if it was not measured.
    pub fn regret_of(&self, strategy: &str) -> Option<f64> {
        let seconds = self.measured.sum(&self.plan_of(strategy)?)?;
        Some((self.rest() + seconds) / (self.rest() + self.best_seconds))
    }

    /// Paths a second of whole renders.
    pub fn rate(&self, label: &str) -> Option<f64> {
        self.scene.renders.iter().find(|r| r.label == label)?.rate()
    }

    /// Time of whole renders in another way over time by the chosen plan.
    pub fn render_ratio(&self, label: &str) -> Option<f64> {
        Some(self.rate(CHOSEN)? / self.rate(label)?)
    }

    /// Every kernel of a form, or of all. Inline materials have no kernel of their own: there it is the logic
    /// kernel with them in it.
    pub fn kernels(&self, form: Option<Form>) -> Vec<Pair> {
        let wanted = |k: &&super::results::Kernel| form.is_none_or(|f| f == k.0);
        let pair = |k: &super::results::Kernel| {
            let logic = if k.0 == Form::Inline {
                self.scene.logic
            } else {
                0.0
            };
            Pair {
                predicted: logic + k.2,
                measured: logic + k.3,
            }
        };
        self.scene.kernels.iter().filter(wanted).map(pair).collect()
    }

    /// Every plan up to [`EXHAUSTIVE`] materials and the listed ones beyond: the material kernels' times.
    pub fn material_plans(&self) -> Vec<Pair> {
        let plans = if self.count() <= EXHAUSTIVE {
            every(self.used)
        } else {
            self.listed()
        };
        let pair = |plan: &Plan| {
            Some(Pair {
                predicted: self.predicted.sum(plan)?,
                measured: self.measured.sum(plan)?,
            })
        };
        plans.iter().filter_map(pair).collect()
    }

    /// The same with all else that an iteration does.
    pub fn plans(&self) -> Vec<Pair> {
        let with_rest = |pair: Pair| Pair {
            predicted: pair.predicted + self.rest(),
            measured: pair.measured + self.rest(),
        };
        self.material_plans().into_iter().map(with_rest).collect()
    }

    /// Of each plan that was timed as a whole: its strategy, its partition, and time over the sum of its parts.
    pub fn additivity(&self) -> Vec<(&str, &str, f64)> {
        let one = |p: &'a super::results::Plan| {
            let plan = parse(self.scene, &p.partition).ok()?;
            let sum = self.rest() + self.measured.sum(&plan)?;
            Some((p.strategy.as_str(), p.partition.as_str(), p.measured? / sum))
        };
        self.scene.plans.iter().filter_map(one).collect()
    }

    /// Rank correlation of predicted and measured kernels.
    pub fn rank_correlation(&self) -> Option<f64> {
        correlation(&self.kernels(None))
    }

    /// Median error of kernels, of plans' material kernels and of whole iterations.
    pub fn median_errors(&self) -> [Option<f64>; 3] {
        [self.kernels(None), self.material_plans(), self.plans()].map(median_error)
    }
}

/// Median of |predicted / measured - 1|.
pub fn median_error(pairs: Vec<Pair>) -> Option<f64> {
    median(pairs.into_iter().map(Pair::error))
}

/// Spearman's.
pub fn correlation(pairs: &[Pair]) -> Option<f64> {
    let pairs: Vec<(f64, f64)> = pairs.iter().map(|p| (p.predicted, p.measured)).collect();
    rank_correlation(&pairs)
}

fn names(scene: &Scene) -> Vec<String> {
    scene.materials.iter().map(|m| m.name.clone()).collect()
}

/// A plan of the scene, from its partition string.
fn parse(scene: &Scene, partition: &str) -> Result<Plan> {
    let materials = scene.materials.iter().enumerate();
    let unused: Vec<usize> = materials.filter(|(_, m)| !m.used).map(|(i, _)| i).collect();
    Plan::parse(partition, &names(scene), &unused)
}

#[cfg(test)]
mod tests;
