//! What follows from the numbers of a scene whose best plan and regret are known.

use super::super::fixture;
use super::super::results::{self, Material};
use super::*;

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-9 * b.abs()
}

#[test]
fn the_best_plan_and_the_regret_are_those_known() {
    let scene = fixture::scene();
    let measured = Measured::new(&scene).expect("fits");
    assert_eq!(measured.count(), 3, "the ghost is in no plan");
    assert_eq!(measured.text(&measured.best), "mixed:a,b|inline:c");
    assert_eq!(measured.text(&measured.auto), scene.auto);
    assert!(close(measured.material_regret(), 60.0 / 45.0));
    assert!(close(measured.regret(), 160.0 / 145.0));
    let mut answer = fixture::answer();
    assert_eq!(measured.disagreement(&answer), None);
    answer.regret = Some(1.2);
    assert!(
        measured
            .disagreement(&answer)
            .is_some_and(|why| why.contains("1.2000"))
    );
    for (strategy, seconds) in [
        ("own", 160.0),
        ("mixed", 190.0),
        ("inline", 195.0),
        ("paper", 152.0),
        ("threshold=1000", 165.0),
    ] {
        let regret = measured.regret_of(strategy).expect("known");
        assert!(close(regret, seconds / 145.0), "{strategy}: {regret}");
    }
    assert_eq!(measured.regret_of("threshold=7"), None);
    // Half as many paths a second, so twice the time.
    assert!(close(measured.render_ratio("mega").expect("rendered"), 2.0));
}

#[test]
fn all_plans_of_few_materials_are_added_up() {
    let scene = fixture::scene();
    let measured = Measured::new(&scene).expect("fits");
    let plans = measured.material_plans();
    assert_eq!(plans.len(), 22);
    let least = plans
        .iter()
        .map(|p| p.measured)
        .fold(f64::INFINITY, f64::min);
    assert!(close(least, 45e-6));
    let [kernels, materials, whole] = measured.median_errors().map(|e| e.expect("pairs"));
    assert!(
        kernels > whole && materials > whole,
        "what is known of both dilutes errors"
    );
}

#[test]
fn strategies_that_are_not_listed_follow_from_operations() {
    let mut scene = fixture::scene();
    scene.plans.retain(|p| p.strategy != "threshold=1000");
    let operations = [Some(1200.0), Some(300.0), Some(999.0)];
    for (material, operations) in scene.materials.iter_mut().zip(operations) {
        material.operations = operations;
    }
    let measured = Measured::new(&scene).expect("fits");
    let regret = measured.regret_of("threshold=1000").expect("known");
    assert!(
        close(regret, 165.0 / 145.0),
        "own:a|mixed:b,c and not {regret}"
    );
    scene.materials[1].operations = None;
    let measured = Measured::new(&scene).expect("fits");
    assert_eq!(measured.regret_of("threshold=1000"), None);
}

#[test]
fn beyond_six_materials_the_best_is_that_of_the_measured_kernels() {
    let mut scene = fixture::scene();
    let names = ["a", "b", "c", "d", "e", "f", "g"];
    scene.materials = names
        .iter()
        .map(|name| Material {
            name: (*name).into(),
            ..scene.materials[0].clone()
        })
        .collect();
    let own = |i| results::Kernel(Form::Own, vec![i], 9e-6, 10e-6, 0.0);
    scene.kernels = (0..names.len()).map(own).collect();
    scene
        .kernels
        .push(results::Kernel(Form::Binned, vec![1, 4], 30e-6, 12e-6, 0.0));
    let all: Vec<String> = names.iter().map(|name| format!("own:{name}")).collect();
    scene.auto = all.join("|");
    scene.plans = vec![results::Plan {
        strategy: "own".into(),
        partition: scene.auto.clone(),
        measured: None,
    }];
    let measured = Measured::new(&scene).expect("fits");
    assert_eq!(
        measured.text(&measured.best),
        "own:a|own:c|own:d|own:f|own:g|binned:b,e"
    );
    assert!(close(measured.regret(), 170.0 / 162.0));
    assert_eq!(
        measured.material_plans().len(),
        1,
        "a sample, and no sums over all"
    );
    assert_eq!(measured.regret_of("mixed"), None);
}

#[test]
fn of_inline_materials_the_logic_kernel_counts() {
    let scene = fixture::scene();
    let measured = Measured::new(&scene).expect("fits");
    let inline = measured.kernels(Some(Form::Inline))[0];
    assert!(
        close(inline.predicted, 65e-6) && close(inline.measured, 67e-6),
        "{inline:?}"
    );
    assert!(close(measured.kernels(Some(Form::Own))[0].measured, 20e-6));
    assert_eq!(measured.kernels(None).len(), 18);
}

#[test]
fn whole_iterations_are_held_against_sums() {
    let scene = fixture::scene();
    let measured = Measured::new(&scene).expect("fits");
    let ratios: Vec<f64> = measured
        .additivity()
        .iter()
        .map(|(_, _, ratio)| *ratio)
        .collect();
    let expected = [161.0 / 160.0, 161.0 / 160.0, 150.0 / 152.0, 168.0 / 161.0];
    assert_eq!(ratios.len(), expected.len());
    assert!(
        ratios.iter().zip(expected).all(|(a, b)| close(*a, b)),
        "{ratios:?}"
    );
}

#[test]
fn a_plan_that_was_not_measured_is_an_error() {
    let mut scene = fixture::scene();
    scene.kernels.retain(|k| k.0 != Form::Own);
    let why = Measured::new(&scene)
        .err()
        .expect("own kernels are missing");
    assert!(
        why.contains("was not measured") && why.contains("tiny"),
        "{why}"
    );
    scene.auto = "own:a|own:z".into();
    assert!(Measured::new(&scene).is_err_and(|why| why.contains("`z`")));
}
