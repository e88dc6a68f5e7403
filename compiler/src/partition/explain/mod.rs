//! Why a plan is as it is: what each kernel takes and of which parts, what the best other way for
//! it would take and why that is more, what plans by other rules would take, and what the estimate does
//! not know.
//!
//! Everything is said of the model. Whether the model is right is a question for measurements.

use serde::Serialize;

use super::search::total;
use super::{
    Calibrated, Form, Groups, Organisation, Plan, PlanError, PlanInputs, Prediction, Strategy,
    TimeModel,
};

mod alternatives;
mod text;
mod unknown;

pub use alternatives::Alternative;

/// A plan, and all that is known of what it is for.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// The plan.
    pub plan: &'a Plan,
    /// The names of the program's materials, in its order.
    pub names: &'a [String],
    /// Costs, workload and profile.
    pub model: Calibrated<'a>,
    /// Is the profile that of the device the plan is for? Otherwise it is scaled from another's.
    pub exact: bool,
}

/// An explanation. Times are in seconds of an iteration.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Explanation {
    /// The strategy that made the plan.
    pub strategy: String,
    /// The plan as a partition string.
    pub partition: String,
    /// The device of the profile.
    pub device: String,
    /// Is the profile the device's own?
    pub exact: bool,
    /// Paths in flight.
    pub pool: u32,
    /// What all material kernels take.
    pub seconds: f64,
    /// What all else takes; 0 if it was not measured.
    pub other_seconds: f64,
    /// The kernels, in the plan's order.
    pub kernels: Vec<Kernel>,
    /// What the plans of other strategies take.
    pub strategies: Vec<OtherPlan>,
    /// Materials that no surface binds.
    pub unused: Vec<String>,
    /// Materials on a surface that no path has hit.
    pub never_hit: Vec<String>,
    /// What the estimate does not know, in sentences.
    pub unknown: Vec<String>,
}

/// A kernel of the plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Kernel {
    /// Its name.
    pub name: String,
    /// Its form.
    pub form: Form,
    /// The materials it evaluates.
    pub members: Vec<Member>,
    /// What it takes, in parts.
    pub predicted: Prediction,
    /// Its part of what all material kernels take.
    pub share: f64,
    /// How many members a subgroup that has work evaluates one after the other, on average.
    pub diverges: f64,
    /// The best other way, if there is any.
    pub alternative: Option<Alternative>,
}

/// A material of a kernel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Member {
    /// Its name.
    pub material: String,
    /// Hits in an iteration over slots.
    pub share: f64,
    /// How many neighbouring slots hit it together, on average: 32 over the independent draws of a block.
    pub run: f64,
    /// Mean operations of an evaluation; none if its cost is not known.
    pub operations: Option<f64>,
    /// Operations of a lane over those that its subgroup issues.
    pub efficiency: Option<f64>,
}

/// A plan by another rule.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OtherPlan {
    /// The strategy.
    pub strategy: String,
    /// Its plan.
    pub partition: String,
    /// What its material kernels take.
    pub seconds: f64,
    /// That over what those of the plan explained take; none where those take nothing.
    pub times: Option<f64>,
}

/// Explains a plan.
///
/// # Errors
/// If the plan is a megakernel, of which the model knows nothing, or does not fit the materials.
pub fn explain(subject: &Subject) -> Result<Explanation, PlanError> {
    let Subject {
        plan, names, model, ..
    } = subject;
    plan.check_named(names)?;
    if plan.organisation == Organisation::Mega {
        let error = PlanError::new(
            "the time model knows nothing of megakernels, so there is nothing to explain",
        );
        return Err(
            error.hint("`impasto render --strategy mega --report FILE` says what one takes")
        );
    }
    let groups = plan.groups();
    let seconds = total(model, &groups);
    let workload = model.workload;
    let name = |m: usize| names[m].clone();
    let placed = groups
        .iter()
        .flat_map(|(_, members)| members.iter().copied());
    let never_hit = placed.filter(|m| subject.share(*m) == 0.0);
    Ok(Explanation {
        strategy: plan.strategy.clone(),
        partition: super::text::print(plan, names),
        device: model.profile.device.clone(),
        exact: subject.exact,
        pool: workload.pool,
        seconds,
        other_seconds: workload.logic_seconds + workload.other_seconds,
        kernels: (0..groups.len())
            .map(|k| subject.kernel(k, &groups, seconds))
            .collect(),
        strategies: subject.other_plans(seconds),
        unused: plan.unused.iter().map(|m| name(*m)).collect(),
        never_hit: never_hit.map(name).collect(),
        unknown: unknown::sentences(subject),
    })
}

impl Subject<'_> {
    fn kernel(&self, k: usize, groups: &Groups, seconds: f64) -> Kernel {
        let (form, members) = &groups[k];
        let predicted = self.model.predict(*form, members);
        Kernel {
            name: self.plan.kernels[k].name.clone(),
            form: *form,
            members: members.iter().map(|m| self.member(*m)).collect(),
            predicted,
            share: if seconds > 0.0 {
                predicted.total / seconds
            } else {
                0.0
            },
            diverges: self.diverges(*form, members),
            alternative: alternatives::best(self, groups, k),
        }
    }

    fn member(&self, m: usize) -> Member {
        let hits = self.model.workload.materials.get(m);
        let cost = self.model.costs.get(m).and_then(Option::as_ref);
        Member {
            material: self.names[m].clone(),
            share: self.share(m),
            run: hits.map_or(1.0, |h| f64::from(super::workload::BLOCK) / h.draws()),
            operations: cost.map(|c| c.operations.mean),
            efficiency: cost.map(|c| c.efficiency()),
        }
    }

    fn share(&self, m: usize) -> f64 {
        self.model
            .workload
            .materials
            .get(m)
            .map_or(0.0, |h| h.share)
    }

    /// How many members a subgroup evaluates, on average over those that evaluate any.
    fn diverges(&self, form: Form, members: &[usize]) -> f64 {
        if !form.diverges() {
            return 1.0;
        }
        let of = |m: &usize| self.model.subgroups(form, *m, members).0;
        let all: f64 = members.iter().map(of).sum();
        // Of subgroups that are busy at all there are at least as many as of the commonest member,
        // and as full ones hold the hits.
        let most = members.iter().map(of).fold(0.0, f64::max);
        let hits: f64 = members.iter().map(|m| self.share(*m)).sum();
        let full =
            hits * f64::from(self.model.workload.pool) / f64::from(self.model.profile.subgroup);
        match most.max(full) {
            busy if busy > 0.0 => (all / busy).max(1.0),
            _ => 1.0,
        }
    }

    /// How many lanes evaluate at a time where `groups` do, on average.
    fn lanes<'g>(&self, groups: impl Iterator<Item = &'g (Form, Vec<usize>)>) -> f64 {
        let (mut hits, mut subgroups) = (0.0, 0.0);
        for (form, members) in groups {
            for m in members {
                let (count, lanes) = self.model.subgroups(*form, *m, members);
                hits += count * lanes;
                subgroups += count;
            }
        }
        if subgroups > 0.0 {
            hits / subgroups
        } else {
            f64::from(self.model.profile.subgroup)
        }
    }

    /// What other strategies come to, by the same model.
    fn other_plans(&self, seconds: f64) -> Vec<OtherPlan> {
        let inputs = PlanInputs {
            names: self.names,
            unused: &self.plan.unused,
            costs: Some(self.model.costs),
            workload: Some(self.model.workload),
            profile: Some(self.model.profile),
        };
        let other = |strategy: Strategy| {
            let plan = strategy.plan(&inputs).ok()?;
            let kernels = plan.kernels.iter();
            let takes: f64 = kernels
                .map(|k| self.model.seconds(k.form, &k.materials))
                .sum();
            Some(OtherPlan {
                strategy: strategy.to_string(),
                partition: super::text::print(&plan, self.names),
                seconds: takes,
                times: (seconds > 0.0).then(|| takes / seconds),
            })
        };
        Strategy::comparable().filter_map(other).collect()
    }
}

#[cfg(test)]
mod tests;
