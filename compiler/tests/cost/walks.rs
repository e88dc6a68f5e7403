//! Ray casts of light that walks below surfaces.

use impasto_compiler::cost::{Inputs, Measured, Walks};

use crate::common::program;

fn walks(surface: &str) -> Option<Walks> {
    let uses = "use std::bsdf::{diffuse, random_walk};";
    let program = program(&format!("{uses}\nmaterial m {{ surface = {surface}; }}"));
    let mut inputs = Inputs::new(0);
    let points: Vec<_> = (0..1000).map(|_| (0, inputs.anywhere())).collect();
    let measured = Measured::new(&program, 0, &points);
    measured.expect("there are inputs").walks()
}

/// What renders of a floor count (docs/measurements.md).
#[test]
fn casts_are_as_many_as_renders_count() {
    let counted = [
        (0.05, 2.0),
        (0.2, 3.5),
        (0.5, 7.5),
        (0.8, 20.9),
        (0.9, 28.8),
        (0.99, 31.6),
    ];
    for (color, casts) in counted {
        let found = walks(&format!("random_walk({color:?})")).expect("it walks");
        assert_eq!(found.share, 1.0);
        let ratio = found.casts / casts;
        assert!((0.8..1.2).contains(&ratio), "{color}: {found:?}");
    }
}

#[test]
fn channels_count_alike() {
    let [red, green, both] = ["color(0.9)", "color(0.1)", "color(0.9, 0.1, 0.1)"]
        .map(|c| walks(&format!("random_walk({c})")).expect("it walks").casts);
    assert!((both - (red + 2.0 * green) / 3.0).abs() < 1e-6);
}

#[test]
fn only_evaluations_that_go_below_have_walks() {
    assert_eq!(walks("diffuse(0.5)"), None);
    let half = walks("mix(diffuse(0.5), random_walk(0.5), 0.5)").expect("it walks");
    assert!((half.share - 0.5).abs() < 0.05, "{half:?}");
}
