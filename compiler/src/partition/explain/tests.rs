//! What explanations say, against the model that they explain.

use super::super::cases::Case;
use super::super::text::parse;
use super::super::{Automatic, Problem, Search};
use super::*;

fn names(count: usize) -> Vec<String> {
    (0..count).map(|i| format!("m{i}")).collect()
}

fn explained(case: &Case, plan: &Plan, exact: bool) -> Explanation {
    let names = names(case.costs.len());
    let subject = Subject {
        plan,
        names: &names,
        model: case.model(),
        exact,
    };
    explain(&subject).unwrap_or_else(|e| panic!("{e}"))
}

/// The plan of a strategy that must know nothing, for `count` materials.
fn planned(strategy: Strategy, count: usize) -> Plan {
    let names = names(count);
    let plan = strategy.plan(&PlanInputs::of_names(&names));
    plan.unwrap_or_else(|e| panic!("{e}"))
}

fn auto(case: &Case) -> Plan {
    let count = case.costs.len();
    let groups = Automatic.search(&Problem::new(0..count), &case.model());
    Plan::wavefront("auto", groups, Vec::new(), &names(count))
}

/// What the model says of a partition string.
fn seconds(case: &Case, partition: &str) -> f64 {
    let plan = parse(partition, &names(case.costs.len()), &[])
        .unwrap_or_else(|e| panic!("{partition}: {e}"));
    let kernels = plan.kernels.iter();
    kernels
        .map(|k| case.model().seconds(k.form, &k.materials))
        .sum()
}

#[test]
fn the_best_plan_has_no_better_alternative() {
    for seed in 0..40 {
        let case = Case::new(2 + seed as usize % 7, seed);
        let found = explained(&case, &auto(&case), true);
        for kernel in &found.kernels {
            let other = kernel.alternative.as_ref().expect("there are others");
            assert!(other.more >= -1e-9 * found.seconds, "{seed}: {other:?}");
        }
        let least = found
            .strategies
            .iter()
            .map(|r| r.seconds / found.seconds)
            .fold(f64::INFINITY, f64::min);
        assert!(
            found.seconds == 0.0 || (least - 1.0).abs() < 1e-9,
            "{seed}: {:?}",
            found.strategies
        );
    }
}

#[test]
fn alternatives_are_plans_that_take_what_is_said() {
    for seed in 0..40 {
        let count = 1 + seed as usize % 8;
        let case = Case::new(count, seed);
        for strategy in [
            Strategy::OWN,
            Strategy::MIXED,
            Strategy::BINNED,
            Strategy::INLINE,
        ] {
            let found = explained(&case, &planned(strategy, count), true);
            let parts: f64 = found.kernels.iter().map(|k| k.predicted.total).sum();
            assert!((parts / found.seconds - 1.0).abs() < 1e-9 || found.seconds == 0.0);
            assert!((seconds(&case, &found.partition) - found.seconds).abs() < 1e-12);
            for other in found.kernels.iter().filter_map(|k| k.alternative.as_ref()) {
                let more = seconds(&case, &other.partition) - found.seconds;
                assert!(
                    (more - other.more).abs() < 1e-12,
                    "{strategy:?} {seed}: {other:?}"
                );
                assert_ne!(other.partition, found.partition);
                assert!(
                    other.part_more * other.more >= 0.0 || other.more.abs() < 1e-9,
                    "{other:?}"
                );
            }
            for other in &found.strategies {
                assert!((seconds(&case, &other.partition) - other.seconds).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn the_best_alternative_is_the_least() {
    // Of two materials with a kernel each there are few others, which can be counted out by hand.
    for seed in 0..20 {
        let case = Case::new(2, seed);
        let found = explained(&case, &Plan::own(&names(2), &[]), true);
        let others = ["mixed:m0,m1", "binned:m0,m1", "inline:m0|own:m1"];
        let least = others.map(|p| seconds(&case, p) - found.seconds);
        let least = least.into_iter().fold(f64::INFINITY, f64::min);
        let said = found.kernels[0]
            .alternative
            .as_ref()
            .expect("there are others");
        assert!((said.more - least).abs() < 1e-12, "{seed}: {said:?}");
    }
}

#[test]
fn what_is_not_hit_or_not_used_is_said() {
    let mut case = Case::new(5, 3);
    for hits in &mut case.workload.materials[2..] {
        (hits.share, hits.present) = (0.0, 0.0);
    }
    let plan = Plan::own(&names(5), &[2, 4]);
    let text = explained(&case, &plan, true).to_string();
    assert!(
        text.contains("no surface uses `m2` and `m4`: no kernel"),
        "{text}"
    );
    assert!(text.contains("no path has hit `m3` yet"), "{text}");
    assert!(!text.contains("NaN") && !text.contains("inf "), "{text}");
}

#[test]
fn what_the_estimate_does_not_know_depends_on_the_case() {
    let mut case = Case::new(3, 1);
    let plan = planned(Strategy::MIXED, 3);
    let text = |case: &Case, exact| explained(case, &plan, exact).unknown.join("\n");
    let plain = text(&case, true);
    assert!(
        !plain.contains("impasto calibrate") && text(&case, false).contains("impasto calibrate")
    );
    assert!(
        !plain.contains("textures") && !plain.contains("loops"),
        "{plain}"
    );
    let cost = case.costs[1].as_mut().expect("it has one");
    cost.operations.classes.texture = 2.0;
    (cost.loops, cost.operations.max) = (1, 100_000);
    case.costs[2] = None;
    case.profile.fit.points = 120;
    let odd = text(&case, true);
    for part in [
        "textures of `m1`",
        "branches of `m1`",
        "what `m2` cost",
        "(120 measured)",
    ] {
        assert!(odd.contains(part) && !plain.contains(part), "{part}: {odd}");
    }
}

#[test]
fn a_switch_diverges_and_own_kernels_do_not() {
    let mut case = Case::new(4, 2);
    for hits in &mut case.workload.materials {
        (hits.share, hits.present) = (0.25, 1.0 - 0.75f64.powi(32));
    }
    let of = |case: &Case, strategy: Strategy| {
        explained(case, &planned(strategy, 4), true).kernels[0].diverges
    };
    assert_eq!(of(&case, Strategy::OWN), 1.0);
    assert_eq!(of(&case, Strategy::BINNED), 1.0);
    assert!((of(&case, Strategy::INLINE) - 4.0).abs() < 0.01);
    for hits in &mut case.workload.materials {
        hits.present = 0.25;
    }
    assert!((of(&case, Strategy::MIXED) - 1.0).abs() < 0.01);
}

#[test]
fn megakernels_and_misfits_are_refused() {
    let case = Case::new(3, 1);
    let names = names(3);
    let refused = |plan: &Plan| {
        let model = case.model();
        explain(&Subject {
            plan,
            names: &names,
            model,
            exact: true,
        })
        .expect_err("it is none")
        .to_string()
    };
    assert!(refused(&Plan::mega(&names, &[])).contains("nothing of megakernels"));
    assert!(refused(&Plan::own(&names[..2], &[])).contains("no kernel for `m2`"));
}
