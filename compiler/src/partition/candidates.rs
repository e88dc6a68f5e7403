//! Plans that are worth a trial beside the one that the time model finds fastest.
//!
//! The model errs by about a tenth of a kernel's time, so that among plans that it finds about as fast a measurement decides. Of
//! kernels that two plans share the error is the same. So the more of the time of an iteration the kernels have in which a plan
//! differs from the chosen one, the less is known of it, and the more it may gain. Plans are tried in the order of what is
//! expected of them. docs/measurements.md, "Trials by what they promise", has what so many of them gain.

use super::search::{ordered, total};
use super::{Automatic, Calibrated, Form, Groups, Plan, PlanInputs, Search, Strategy, TimeModel};

/// What the model errs by, as a share of a kernel's time: one standard deviation.
const ERROR: f64 = 0.1;
/// The same of what another number of threads changes, of which the model knows nothing.
const ERROR_OF_THREADS: f64 = 0.2;

/// A candidate is expected to gain at least this share of an iteration.
const LEAST_GAIN: f64 = 1e-4;

/// Kernels of which every material is tried in the place of every other: of more, there would be too many.
const FEW: usize = 16;
/// Materials of a kernel that is cut in two in every way: of one more, there are twice as many.
const CUT: usize = 8;

/// Threads of a workgroup with which a driver may hold more of them at once: by 384, an H200 has 12 or 24 subgroups of a kernel in
/// flight, by 256 also 16. Its driver gives a thread 80 registers for 24 of them where it stays at 100 for 16, which serves some
/// kernels and not others (docs/measurements.md, "Workgroups that suit their kernels").
const WIDE: u32 = 384;
/// So many numbers are alive at once in materials of which that is to be expected.
const MANY_LIVE: u32 = 70;

/// A plan that is worth a trial beside another.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// The plan.
    pub plan: Plan,
    /// What is expected of it beside the other.
    pub expected: Expected,
}

impl Candidate {
    /// A plan beside the `chosen` one. `None` where costs, workload or profile are not known.
    pub fn new(inputs: &PlanInputs<'_>, chosen: &Plan, plan: Plan) -> Option<Self> {
        let expected = Present::new(inputs, chosen)?.expected(&plan.groups());
        Some(Self { plan, expected })
    }
}

/// What is expected of a plan beside another: the time of an iteration, in times of one by the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// The mean.
    pub ratio: f64,
    /// The standard deviation.
    pub error: f64,
}

impl Expected {
    /// The share of an iteration that it saves on average, where it goes on only if it is faster: of a logistic distribution, which
    /// is nearly normal.
    pub fn gain(self) -> f64 {
        let scale = self.error.max(f64::MIN_POSITIVE) * 3.0_f64.sqrt() / std::f64::consts::PI;
        let faster = (1.0 - self.ratio) / scale;
        scale * (faster.max(0.0) + (-faster.abs()).exp().ln_1p())
    }

    /// The share of an iteration that each iteration of a trial costs on average, by plans that turn out to be slower.
    pub fn loss(self) -> f64 {
        self.gain() + self.ratio - 1.0
    }

    /// Orders what promises more before what promises less.
    pub fn by_gain(&self, other: &Self) -> std::cmp::Ordering {
        other.gain().total_cmp(&self.gain())
    }

    /// The same beside a third plan, an iteration of which takes `ratio` times one of the other.
    #[must_use]
    pub fn beside(self, ratio: f64) -> Self {
        Self {
            ratio: self.ratio / ratio,
            error: self.error / ratio,
        }
    }
}

/// Plans that may turn out to be faster than `chosen`, at most `most`, in the order of what they are expected to gain. None where
/// costs, workload or profile are not known.
///
/// Up to half of them are what searches find where some forms are not allowed, and plans of strategies that people would try by
/// hand: where the model errs about a form, it does so in all kernels of that form. The others differ from the chosen plan in the
/// place of one material, or have one kernel cut in two.
pub fn candidates(inputs: &PlanInputs<'_>, chosen: &Plan, most: usize) -> Vec<Candidate> {
    let Some(present) = Present::new(inputs, chosen) else {
        return Vec::new();
    };
    let far = other_forms(inputs, &present.model);
    let near = [moved(&present.groups), cut(&present.groups)].concat();
    let mut found: Vec<Candidate> = Vec::new();
    for (kind, up_to) in [(far, most / 2), (near, most)] {
        for (expected, groups) in present.promising(kind) {
            if found.len() == up_to {
                break;
            }
            let plan = inputs.plan(&chosen.strategy, ordered(groups));
            let is_known = |known: &Candidate| known.plan.does_as(&plan);
            if !plan.does_as(chosen) && !found.iter().any(is_known) {
                found.push(Candidate { plan, expected });
            }
        }
    }
    found.sort_by(|a, b| a.expected.by_gain(&b.expected));
    found
}

/// The `chosen` plan with workgroups of 384 threads for the kernels whose threads need many registers; `None` where no kernel does,
/// or nothing is known.
pub fn in_wide_workgroups(inputs: &PlanInputs<'_>, chosen: &Plan) -> Option<Candidate> {
    let present = Present::new(inputs, chosen)?;
    let costs = present.model.costs;
    let live = |m: &usize| costs.get(*m)?.as_ref().map(|cost| cost.live);
    let needs_many = |(form, members): &&(Form, Vec<usize>)| {
        form.has_queue() && members.iter().filter_map(live).max() >= Some(MANY_LIVE)
    };
    let seconds = present.seconds(present.groups.iter().filter(needs_many));
    if seconds.is_empty() {
        return None;
    }
    let mut plan = chosen.clone();
    for (kernel, group) in plan.kernels.iter_mut().zip(&present.groups) {
        if needs_many(&group) {
            kernel.workgroup = Some(WIDE);
        }
    }
    let error = ERROR_OF_THREADS * present.spread(seconds.iter());
    let expected = Expected { ratio: 1.0, error };
    Some(Candidate { plan, expected })
}

/// The plan that others are held against.
struct Present<'a> {
    model: Calibrated<'a>,
    groups: Groups,
    /// Seconds of an iteration.
    seconds: f64,
}

impl<'a> Present<'a> {
    fn new(inputs: &PlanInputs<'a>, chosen: &Plan) -> Option<Self> {
        let (costs, workload, profile) = (inputs.costs?, inputs.workload?, inputs.profile?);
        let model = Calibrated {
            costs,
            workload,
            profile,
        };
        let groups = chosen.groups();
        let rest = workload.logic_seconds + workload.other_seconds;
        let seconds = rest + total(&model, &groups);
        Some(Self {
            model,
            groups,
            seconds,
        })
    }

    /// Those of some plans that promise something, in the order of what they are expected to gain.
    fn promising(&self, plans: Vec<Groups>) -> Vec<(Expected, Groups)> {
        let expected = plans
            .into_iter()
            .map(|groups| (self.expected(&groups), groups));
        let mut all: Vec<_> = expected
            .filter(|(expected, _)| expected.gain() >= LEAST_GAIN)
            .collect();
        all.sort_by(|(a, _), (b, _)| a.by_gain(b));
        all
    }

    /// What is expected of a plan of other kernels: those that both have take the same.
    fn expected(&self, groups: &Groups) -> Expected {
        let [mine, others] = [(&self.groups, groups), (groups, &self.groups)]
            .map(|(of, beside)| self.seconds(of.iter().filter(|kernel| !beside.contains(kernel))));
        let more = others.iter().sum::<f64>() - mine.iter().sum::<f64>();
        Expected {
            ratio: 1.0 + more / self.seconds,
            error: ERROR * self.spread(mine.iter().chain(&others)),
        }
    }

    fn seconds<'g>(&self, kernels: impl Iterator<Item = &'g (Form, Vec<usize>)>) -> Vec<f64> {
        let seconds = kernels.map(|(form, members)| self.model.seconds(*form, members));
        seconds.collect()
    }

    /// By how much of an iteration the time of kernels errs that take so many seconds and err by all of them, each for itself.
    fn spread<'s>(&self, seconds: impl Iterator<Item = &'s f64>) -> f64 {
        seconds.map(|s| s * s).sum::<f64>().sqrt() / self.seconds
    }
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

/// The plans in which one kernel is two: its materials are divided in every way, and either part has every form.
fn cut(groups: &Groups) -> Vec<Groups> {
    let mut all = Vec::new();
    for (k, (_, members)) in groups.iter().enumerate() {
        if !(2..=CUT).contains(&members.len()) {
            continue;
        }
        let rest: Groups = [&groups[..k], &groups[k + 1..]].concat();
        for [one, other] in parts(members) {
            for form in Form::of_members(one.len()) {
                for beside in Form::of_members(other.len()) {
                    let kernels = rest.iter().cloned();
                    let two = [(form, one.clone()), (beside, other.clone())];
                    let new: Groups = kernels.chain(two).collect();
                    let inline = new.iter().filter(|(form, _)| *form == Form::Inline);
                    if inline.count() <= 1 {
                        all.push(new);
                    }
                }
            }
        }
    }
    all
}

/// Every way to divide materials in two, once.
fn parts(members: &[usize]) -> Vec<[Vec<usize>; 2]> {
    let divided = |set: usize| {
        let part = |bit| {
            let all = members.iter().enumerate();
            all.filter(|(at, _)| set >> at & 1 == bit)
                .map(|(_, m)| *m)
                .collect()
        };
        [part(0), part(1)]
    };
    // The last member is in the first part.
    (1..1 << (members.len() - 1)).map(divided).collect()
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
                let others = candidates(inputs, &first, 8);
                let gains: Vec<f64> = others.iter().map(|c| c.expected.gain()).collect();
                assert!(gains.is_sorted_by(|a, b| a >= b), "{gains:?}");
                plans.extend(others.into_iter().map(|c| c.plan));
                assert!(plans.len() <= 1 + 8, "{count}: {}", plans.len());
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
                let Candidate {
                    plan: wide,
                    expected,
                } = in_wide_workgroups(inputs, &plan)?;
                assert!(
                    expected.ratio == 1.0 && expected.error > 0.0,
                    "{expected:?}"
                );
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
                let tried = candidates(inputs, &first, 8);
                let fastest = tried
                    .iter()
                    .map(|c| takes(&c.plan))
                    .fold(takes(&first), f64::min);
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
    fn what_promises_nothing_is_not_tried_and_nothing_where_nothing_is_known() {
        let case = Case::new(6, 7);
        with_inputs(&case, |inputs| {
            let first = chosen(inputs);
            let model = case.model();
            let rest = case.workload.logic_seconds;
            let seconds = |plan: &Plan| rest + total(&model, &plan.groups());
            for candidate in candidates(inputs, &first, 100) {
                let ratio = seconds(&candidate.plan) / seconds(&first);
                let expected = candidate.expected;
                assert!(
                    (expected.ratio - ratio).abs() < 1e-9,
                    "{expected:?} {ratio}"
                );
                assert!(expected.gain() >= LEAST_GAIN, "{expected:?}");
            }
            let unknown = PlanInputs {
                profile: None,
                ..*inputs
            };
            assert!(candidates(&unknown, &first, 4).is_empty());
            assert!(candidates(inputs, &first, 0).is_empty());
        });
    }

    /// The mean of what a plan saves over a logistic distribution, by adding up its quantiles.
    #[test]
    fn gain_and_loss_are_means_of_a_distribution() {
        for (ratio, error) in [(1.0, 0.05), (1.1, 0.05), (0.9, 0.2), (1.3, 0.02)] {
            let expected = Expected { ratio, error };
            let scale = error * 3.0_f64.sqrt() / std::f64::consts::PI;
            let quantile = |at: u32| {
                let share = (f64::from(at) + 0.5) / 1e5;
                ratio + scale * (share / (1.0 - share)).ln()
            };
            let mean =
                |of: fn(f64) -> f64| (0..100_000).map(|at| of(quantile(at))).sum::<f64>() / 1e5;
            let [gain, loss] = [|r: f64| (1.0 - r).max(0.0), |r: f64| (r - 1.0).max(0.0)].map(mean);
            assert!((expected.gain() - gain).abs() < 1e-5, "{expected:?} {gain}");
            assert!((expected.loss() - loss).abs() < 1e-5, "{expected:?} {loss}");
        }
        let surely = Expected {
            ratio: 0.75,
            error: 0.0,
        };
        assert_eq!((surely.gain(), surely.loss()), (0.25, 0.0));
        assert_eq!(surely.beside(0.5).ratio, 1.5);
    }

    #[test]
    fn a_kernel_is_cut_in_every_way() {
        let own = (Form::Own, vec![7]);
        let of = |members: &[usize], form| {
            let mut all = cut(&vec![own.clone(), (form, members.to_vec())]);
            assert!(all.iter().all(|groups| groups.contains(&own)));
            all.sort();
            all.dedup();
            all.len()
        };
        // Two parts of one: own or inline, and not both inline.
        assert_eq!(of(&[1, 2], Form::Mixed), 3);
        // One and two in three ways: mixed, binned or inline beside own; mixed or binned beside inline.
        assert_eq!(of(&[1, 2, 4], Form::Binned), 3 * 5);
        assert_eq!(of(&(0..=CUT).collect::<Vec<_>>(), Form::Binned), 0);
        let inline = vec![(Form::Inline, vec![0]), (Form::Binned, vec![1, 2])];
        assert_eq!(cut(&inline).len(), 1);
    }
}
