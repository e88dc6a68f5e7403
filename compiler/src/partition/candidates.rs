//! Plans that are worth a trial beside the one that the time model finds fastest.
//!
//! The model errs by some percent, and more where materials are inline, so that among plans that it finds about as fast a
//! measurement decides. Some candidates differ from the chosen plan in what the model is least sure of: whether anything is
//! inline, and which forms kernels with queues have. Strategies that people would try by hand are among them. Others differ in
//! the place of a single material. docs/measurements.md has what trials of so many of each gain.

use super::search::{ordered, total};
use super::{Automatic, Calibrated, Form, Groups, Plan, PlanInputs, PlanKernel, Search, Strategy};

/// A candidate is predicted to take at most so many times the iteration of the best: a trial must not cost more than it may gain.
const MARGIN: f64 = 1.25;

/// Kernels of which every material is tried in the place of every other: of more, there would be too many.
const FEW: usize = 16;

/// Threads of a workgroup with which a driver may hold more of them at once: by 384, an H200 has 12 or 24 subgroups of a kernel in
/// flight, by 256 also 16. Its driver gives a thread 80 registers for 24 of them where it stays at 100 for 16, which serves some
/// kernels and not others (docs/measurements.md, "Workgroups that suit their kernels").
const WIDE: u32 = 384;
/// So many numbers are alive at once in materials of which that is to be expected.
const MANY_LIVE: u32 = 70;

/// Plans that may turn out to be faster than `chosen`, at most `most` of either kind, the likeliest of each kind first. None where
/// costs, workload or profile are not known.
pub fn candidates(inputs: &PlanInputs<'_>, chosen: &Plan, most: usize) -> Vec<Plan> {
    let (Some(costs), Some(workload), Some(profile)) =
        (inputs.costs, inputs.workload, inputs.profile)
    else {
        return Vec::new();
    };
    let model = Calibrated {
        costs,
        workload,
        profile,
    };
    let rest = workload.logic_seconds + workload.other_seconds;
    let begin = chosen.groups();
    let limit = MARGIN * (rest + total(&model, &begin));
    let mut known = vec![chosen.clone()];
    let mut found = Vec::new();
    for kind in [other_forms(inputs, &model), moved(&begin)] {
        let timed = kind
            .into_iter()
            .map(|groups| (rest + total(&model, &groups), groups));
        let mut timed: Vec<(f64, Groups)> =
            timed.filter(|(seconds, _)| *seconds <= limit).collect();
        timed.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut left = most;
        for (_, groups) in timed {
            let plan = inputs.plan(&chosen.strategy, ordered(groups));
            if left > 0 && !known.iter().any(|other| plan.does_as(other)) {
                left -= 1;
                known.push(plan.clone());
                found.push(plan);
            }
        }
    }
    found
}

/// The `chosen` plan with workgroups of 384 threads for the kernels whose threads need many registers; `None` where no kernel does,
/// or costs are not known.
pub fn in_wide_workgroups(inputs: &PlanInputs<'_>, chosen: &Plan) -> Option<Plan> {
    let costs = inputs.costs?;
    let live = |m: &usize| costs.get(*m)?.as_ref().map(|cost| cost.live);
    let needs_many = |kernel: &PlanKernel| {
        kernel.form.has_queue() && kernel.materials.iter().filter_map(live).max() >= Some(MANY_LIVE)
    };
    let mut plan = chosen.clone();
    let mut wide = plan.kernels.iter_mut().filter(|k| needs_many(k)).peekable();
    wide.peek()?;
    wide.for_each(|kernel| kernel.workgroup = Some(WIDE));
    Some(plan)
}

/// What the search finds where some forms are not allowed, and the plans of strategies that the model can compare.
fn other_forms(inputs: &PlanInputs<'_>, model: &Calibrated<'_>) -> Vec<Groups> {
    let without = [
        &[Form::Inline][..],
        &[Form::Binned],
        &[Form::Mixed],
        &[Form::Inline, Form::Binned],
        &[Form::Inline, Form::Mixed],
        &[Form::Mixed, Form::Binned],
    ];
    let searched = without.into_iter().map(|without| {
        let mut problem = inputs.problem();
        problem.forms.retain(|form| !without.contains(form));
        Automatic.search(&problem, &model.prepared())
    });
    let strategies = Strategy::comparable().filter_map(|strategy| strategy.plan(inputs).ok());
    let all = searched.chain(strategies.map(|plan| plan.groups()));
    all.filter(|groups| !groups.is_empty()).collect()
}

/// The plans in which one material is elsewhere: in another kernel, in one of its own, or inline.
fn moved(groups: &Groups) -> Vec<Groups> {
    if groups.len() > FEW {
        return Vec::new();
    }
    let members = groups.iter().enumerate();
    let members = members.flat_map(|(k, (_, members))| members.iter().map(move |m| (k, *m)));
    members.flat_map(|(k, m)| places(groups, k, m)).collect()
}

/// The same of material `m` of kernel `k`.
fn places(groups: &Groups, k: usize, m: usize) -> Vec<Groups> {
    let mut rest = groups.clone();
    let (form, members) = &mut rest[k];
    members.retain(|other| *other != m);
    *form = form.with_members(members.len());
    if members.is_empty() {
        rest.remove(k);
    }
    let with = |kernel: (Form, Vec<usize>)| -> Groups {
        let kernels = rest.iter().cloned();
        kernels.chain([kernel]).collect()
    };
    let mut all = vec![with((Form::Own, vec![m]))];
    if rest.iter().all(|(form, _)| *form != Form::Inline) {
        all.push(with((Form::Inline, vec![m])));
    }
    for (j, (form, members)) in rest.iter().enumerate() {
        let mut together = members.clone();
        together.push(m);
        together.sort_unstable();
        let forms: Vec<Form> = if form.takes_several() {
            vec![*form]
        } else {
            Form::queued_of_members(together.len()).collect()
        };
        for form in forms {
            let mut new = rest.clone();
            new[j] = (form, together.clone());
            all.push(new);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::super::cases::Case;
    use super::*;

    /// What is known of a case by a model, with the names of its materials.
    fn with_inputs<T>(case: &Case, work: impl FnOnce(&PlanInputs<'_>) -> T) -> T {
        let hits = case.workload.materials.iter();
        let names: Vec<String> = hits.map(|hits| hits.material.clone()).collect();
        work(&PlanInputs {
            costs: Some(&case.costs),
            workload: Some(&case.workload),
            profile: Some(&case.profile),
            ..PlanInputs::of_names(&names)
        })
    }

    fn chosen(inputs: &PlanInputs<'_>) -> Plan {
        Strategy::AUTO.plan(inputs).expect("all is known")
    }

    #[test]
    fn each_is_another_plan_of_all_materials() {
        for count in [1, 2, 5, 9, 12] {
            let case = Case::new(count, count as u64);
            with_inputs(&case, |inputs| {
                let first = chosen(inputs);
                let mut plans = vec![first.clone()];
                plans.extend(candidates(inputs, &first, 4));
                assert!(plans.len() <= 1 + 2 * 4, "{count}: {}", plans.len());
                assert!(plans.len() > usize::from(count > 1), "{count}");
                for (at, plan) in plans.iter().enumerate() {
                    let kernels = plan.kernels.iter();
                    let mut members: Vec<usize> =
                        kernels.flat_map(|k| k.materials.clone()).collect();
                    members.sort_unstable();
                    assert_eq!(members, (0..count).collect::<Vec<_>>());
                    assert_eq!(plan.strategy, "auto");
                    assert!(plans[..at].iter().all(|other| !plan.does_as(other)));
                }
            });
        }
    }

    /// Kernels that are inline have no workgroups of their own.
    #[test]
    fn kernels_that_need_many_registers_may_have_wide_workgroups() {
        let mut case = Case::new(3, 5);
        for (cost, live) in case.costs.iter_mut().zip([MANY_LIVE, MANY_LIVE - 1, 200]) {
            cost.as_mut().expect("it is known").live = live;
        }
        with_inputs(&case, |inputs| {
            let groups = |of: &[(Form, &[usize])]| {
                let groups = of.iter().map(|(form, members)| (*form, members.to_vec()));
                inputs.plan("auto", groups.collect())
            };
            let wide = |of: &[(Form, &[usize])]| {
                let plan = groups(of);
                let wide = in_wide_workgroups(inputs, &plan)?;
                assert_eq!(wide.groups(), plan.groups());
                assert!(!wide.does_as(&plan));
                Some(wide.kernels.iter().map(|k| k.workgroup).collect::<Vec<_>>())
            };
            let own = [(Form::Own, &[0][..]), (Form::Own, &[1]), (Form::Own, &[2])];
            assert_eq!(wide(&own), Some(vec![Some(WIDE), None, Some(WIDE)]));
            let mixed = [(Form::Mixed, &[0, 1][..]), (Form::Inline, &[2])];
            assert_eq!(wide(&mixed), Some(vec![Some(WIDE), None]));
            let few = [(Form::Own, &[1][..]), (Form::Inline, &[0, 2])];
            assert_eq!(wide(&few), None);
            let unknown = PlanInputs {
                costs: None,
                ..*inputs
            };
            assert_eq!(in_wide_workgroups(&unknown, &groups(&own)), None);
        });
    }

    /// A GPU that runs some forms otherwise than the model thinks: trials find what it is fastest at.
    #[test]
    fn trials_make_up_for_a_model_that_errs() {
        let (mut lost, mut lost_with_trials) = (0.0, 0.0);
        for seed in 0..24 {
            let case = Case::new(3 + seed as usize % 6, 100 + seed);
            let mut truth = Case::new(3 + seed as usize % 6, 100 + seed);
            let weights = &mut truth.profile.weights;
            weights.pressure = if seed % 2 == 0 { 3.0 } else { 0.0 };
            weights.launch *= if seed % 3 == 0 { 4.0 } else { 0.5 };
            weights.code *= if seed % 4 < 2 { 0.2 } else { 3.0 };
            let (model, rest) = (truth.model(), truth.workload.logic_seconds);
            let takes = |plan: &Plan| rest + total(&model, &plan.groups());
            let best = with_inputs(&truth, |inputs| takes(&chosen(inputs)));
            with_inputs(&case, |inputs| {
                let first = chosen(inputs);
                let tried = candidates(inputs, &first, 4);
                let fastest = tried.iter().map(&takes).fold(takes(&first), f64::min);
                lost += takes(&first) / best - 1.0;
                lost_with_trials += fastest / best - 1.0;
            });
        }
        let [lost, lost_with_trials] = [lost, lost_with_trials].map(|sum| sum / 24.0);
        assert!(lost > 0.01, "the model errs: {lost}");
        assert!(
            lost_with_trials < 0.4 * lost,
            "{lost_with_trials} of {lost}"
        );
    }

    #[test]
    fn what_is_far_slower_is_not_tried_and_nothing_where_nothing_is_known() {
        let case = Case::new(6, 7);
        with_inputs(&case, |inputs| {
            let first = chosen(inputs);
            let model = case.model();
            let rest = case.workload.logic_seconds;
            let limit = MARGIN * (rest + total(&model, &first.groups()));
            for plan in candidates(inputs, &first, 100) {
                assert!(rest + total(&model, &plan.groups()) <= limit);
            }
            let unknown = PlanInputs {
                profile: None,
                ..*inputs
            };
            assert!(candidates(&unknown, &first, 4).is_empty());
            assert!(candidates(inputs, &first, 0).is_empty());
        });
    }
}
