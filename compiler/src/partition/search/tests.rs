//! Searches against each other, against plans that know nothing, and on what is degenerate.

use super::super::cases::{Case, Random};
use super::super::{Calibrated, Plan};
use super::*;

/// A model with no more structure than a sum: what kernels take is drawn for each pair of members.
struct Pairs {
    alone: Vec<f64>,
    pair: Vec<Vec<f64>>,
}

impl Pairs {
    fn new(count: usize, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let alone = (0..count).map(|_| random.between(1.0, 4.0)).collect();
        let row = |i: usize| (0..i).map(|_| random.between(-0.8, 1.0)).collect();
        Self {
            alone,
            pair: (0..count).map(row).collect(),
        }
    }
}

impl TimeModel for Pairs {
    fn seconds(&self, form: Form, members: &[usize]) -> f64 {
        let (base, times, all) = match form {
            Form::Own => (1.0, 1.0, 0.0),
            Form::Mixed => (1.2, 1.0, 1.0),
            Form::Binned => (2.0, 1.1, 0.3),
            Form::Inline => (0.0, 1.4, 1.3),
        };
        let alone: f64 = members.iter().map(|m| self.alone[*m]).sum();
        let pairs = members
            .iter()
            .flat_map(|a| members.iter().filter(move |b| *b < a).map(move |b| (a, b)));
        let together: f64 = pairs.map(|(a, b)| self.pair[*a][*b]).sum();
        (base + times * alone + all * together).max(0.1)
    }
}

fn problem(count: usize) -> Problem {
    Problem::new(0..count)
}

/// Every partition of `rest` into blocks appended to `blocks`, with every choice of forms.
fn every(rest: &[usize], blocks: &mut Groups, visit: &mut dyn FnMut(&Groups)) {
    let Some((first, rest)) = rest.split_first() else {
        return visit(blocks);
    };
    for i in 0..blocks.len() {
        if blocks[i].0 != Form::Own {
            blocks[i].1.push(*first);
            every(rest, blocks, visit);
            blocks[i].1.pop();
        }
    }
    for form in Form::all() {
        if form != Form::Inline || blocks.iter().all(|(f, _)| *f != Form::Inline) {
            blocks.push((form, vec![*first]));
            every(rest, blocks, visit);
            blocks.pop();
        }
    }
}

#[track_caller]
fn assert_complete(groups: &Groups, count: usize) {
    let names: Vec<String> = (0..count).map(|i| format!("m{i}")).collect();
    let plan = Plan::wavefront("test", groups.clone(), Vec::new(), &names);
    assert_eq!(plan.check(count), Ok(()), "{groups:?}");
}

/// How much worse than the exact partition the heuristic's is: the worst and the mean, as shares.
fn excess(cases: u64, model: impl Fn(u64) -> (usize, Box<dyn TimeModel>)) -> (f64, f64) {
    let (mut worst, mut sum) = (0.0f64, 0.0);
    for seed in 0..cases {
        let (count, model) = model(seed);
        let [exact, found]: [Groups; 2] = [&Exact as &dyn Search, &Heuristic::default()]
            .map(|search| search.search(&problem(count), &*model));
        assert_complete(&exact, count);
        assert_complete(&found, count);
        let [a, b] = [&found, &exact].map(|groups| total(&*model, groups).max(1e-12));
        let excess = a / b - 1.0;
        assert!(
            excess > -1e-6,
            "the exact search misses a better partition: seed {seed}"
        );
        worst = worst.max(excess);
        sum += excess;
    }
    (worst, sum / cases as f64)
}

#[test]
fn exact_is_the_best_of_all() {
    for seed in 0..8 {
        let (case, pairs) = (Case::new(5, seed), Pairs::new(5, seed));
        for model in [&case.model() as &dyn TimeModel, &pairs] {
            let mut least = f64::INFINITY;
            every(&[0, 1, 2, 3, 4], &mut Groups::new(), &mut |groups| {
                least = least.min(total(model, groups));
            });
            let found = total(model, &Exact.search(&problem(5), model));
            assert!(
                (found / least - 1.0).abs() < 1e-6,
                "{seed}: {found} and {least}"
            );
        }
    }
}

/// `Calibrated` owns nothing; this does.
struct Owned(Case);

impl TimeModel for Owned {
    fn seconds(&self, form: Form, members: &[usize]) -> f64 {
        self.0.model().seconds(form, members)
    }
}

#[test]
fn the_heuristic_comes_near_the_exact_search() {
    let count = |seed| 2 + (seed % 9) as usize;
    let calibrated = |count, seed| (count, Box::new(Owned(Case::new(count, seed))) as Box<_>);
    let (worst, mean) = excess(300, |seed| calibrated(count(seed), seed));
    assert!(worst < 0.025 && mean < 0.0005, "worst {worst}, mean {mean}");
    let (worst, mean) = excess(5, |seed| calibrated(13, seed));
    assert!(worst < 0.025, "of 13 materials: worst {worst}, mean {mean}");
    let (worst, mean) = excess(150, |seed| {
        let count = count(seed);
        (count, Box::new(Pairs::new(count, seed)))
    });
    assert!(
        worst < 0.03 && mean < 0.001,
        "pairs: worst {worst}, mean {mean}"
    );
}

#[test]
fn it_is_never_worse_than_what_knows_nothing() {
    for seed in 0..20 {
        for count in [12, 30, 120] {
            let (case, pairs) = (Case::new(count, seed), Pairs::new(count, seed));
            for model in [&case.model() as &dyn TimeModel, &pairs] {
                if count > 30 && seed > 2 {
                    continue;
                }
                let found = Automatic.search(&problem(count), model);
                assert_complete(&found, count);
                let all: Vec<usize> = (0..count).collect();
                let own: Groups = all.iter().map(|m| (Form::Own, vec![*m])).collect();
                let one = [Form::Mixed, Form::Binned, Form::Inline].map(|f| vec![(f, all.clone())]);
                for uniform in one.into_iter().chain([own]) {
                    let (a, b) = (total(model, &found), total(model, &uniform));
                    assert!(a <= b * (1.0 + 1e-6), "{count} {seed}: {a} and {b}");
                }
            }
        }
    }
}

#[test]
fn equal_problems_have_equal_answers() {
    let case = Case::new(40, 7);
    let search = || Automatic.search(&problem(40), &case.model());
    assert_eq!(search(), search());
}

#[test]
fn only_the_materials_and_forms_asked_for_are_used() {
    let case = Case::new(20, 3);
    for (materials, forms) in [
        (vec![2, 5, 7], vec![Form::Mixed]),
        (vec![2, 5, 7], vec![Form::Own]),
        ((1..20).collect(), vec![Form::Own, Form::Binned]),
        ((1..20).collect(), vec![Form::Inline]),
        ((1..20).collect(), vec![Form::Mixed]),
    ] {
        let problem = Problem { materials, forms };
        let groups = Automatic.search(&problem, &case.model());
        let mut placed: Vec<usize> = groups.iter().flat_map(|(_, m)| m.clone()).collect();
        placed.sort_unstable();
        assert_eq!(placed, problem.materials);
        assert!(
            groups.iter().all(|(form, _)| problem.allows(*form)),
            "{groups:?}"
        );
    }
    let impossible = Problem {
        materials: vec![1, 2],
        forms: Vec::new(),
    };
    for search in [&Exact as &dyn Search, &Heuristic::default()] {
        assert_eq!(search.search(&impossible, &case.model()), Groups::new());
        assert_eq!(search.search(&problem(0), &case.model()), Groups::new());
    }
}

#[test]
fn one_material_has_one_kernel() {
    let case = Case::new(1, 1);
    for search in [&Automatic as &dyn Search, &Heuristic::default()] {
        let groups = search.search(&problem(1), &case.model());
        assert_eq!(groups.len(), 1);
        assert!(matches!(groups[0].0, Form::Own | Form::Inline));
    }
}

#[test]
fn materials_that_nobody_hits_cost_no_kernel() {
    for seed in 0..10 {
        for count in [6, 14] {
            let mut case = Case::new(count, seed);
            let ordinary = total(
                &case.model(),
                &Automatic.search(&problem(count), &case.model()),
            );
            for hits in &mut case.workload.materials[2..] {
                (hits.share, hits.present) = (0.0, 0.0);
            }
            let found = Automatic.search(&problem(count), &case.model());
            assert_complete(&found, count);
            let for_nobody = |(form, m): &(Form, Vec<usize>)| *form != Form::Inline && m[0] > 1;
            assert!(!found.iter().any(for_nobody), "{found:?}");
            assert!(total(&case.model(), &found) <= ordinary);
        }
    }
    let mut case = Case::new(14, 1);
    for hits in &mut case.workload.materials {
        (hits.share, hits.present) = (0.0, 0.0);
    }
    let found = Automatic.search(&problem(14), &case.model());
    assert_complete(&found, 14);
    assert!(total(&case.model(), &found).is_finite());
}

/// Counts the members of all kernels that a model is asked for: what a search takes, without a clock.
struct Counted<'a>(Calibrated<'a>, std::cell::Cell<usize>);

impl TimeModel for Counted<'_> {
    fn seconds(&self, form: Form, members: &[usize]) -> f64 {
        self.1.set(self.1.get() + members.len());
        self.0.seconds(form, members)
    }
}

/// A member takes the model about 0.1 us, so that these limits are about 2 ms, 50 ms and 1 s.
#[test]
fn a_thousand_materials_are_planned() {
    for (count, limit) in [(10, 20_000), (64, 500_000), (1000, 10_000_000)] {
        let case = Case::new(count, 5);
        let model = Counted(case.model(), Default::default());
        let found = Automatic.search(&problem(count), &model);
        let asked = model.1.get();
        assert!(asked < limit, "{count} materials: {asked} members");
        assert_complete(&found, count);
        let binned = [(Form::Binned, (0..count).collect())];
        assert!(total(&model, &found) <= total(&model, &binned));
    }
}
