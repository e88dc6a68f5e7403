//! The cost vector of materials whose cost can be worked out by hand.

use impasto_compiler::cost::{self, Classes, Cost, Inputs, LANES};
use impasto_compiler::inspect::At;

use impasto_compiler::{MaterialRequest, MemoryLoader, Program, compile};

use crate::common::program;

/// The cost of a text's only material at `samples` points with texture coordinates in [0, 1).
fn cost(text: &str, samples: usize) -> Cost {
    let program = program(text);
    let mut inputs = Inputs::new(0);
    let points: Vec<(usize, At)> = (0..samples).map(|_| (0, inputs.anywhere())).collect();
    let found = cost::vector(&program, 0, &points);
    found.expect("there are inputs")
}

fn emitting(value: &str, functions: &str) -> String {
    format!("use std::edf::uniform;\nmaterial m {{ emission = uniform({value}); }}\n{functions}")
}

/// As many turns as the first texture coordinate says, times 64.
const TURNS: &str = "fn turns(x: float) -> float {
    var sum = x;
    for i in 0 .. min(int(x * 64.0), 64) { sum = sqrt(sum + float(i)); }
    sum
}";

#[test]
fn one_lane_issues_its_operations() {
    for text in [
        include_str!("../../../materials/car_paint.impasto"),
        include_str!("../../../materials/mandelbrot_wall.impasto"),
        &emitting("color(turns(uv.x))", TURNS),
    ] {
        let cost = cost(text, 100);
        assert_eq!(cost.issued[0], cost.operations.classes);
        assert_eq!(cost.operations.mean, cost.operations.classes.sum());
        assert_eq!(cost.operations.evaluations, 100);
    }
}

#[test]
fn more_lanes_issue_no_less() {
    for text in [
        include_str!("../../../materials/car_paint.impasto"),
        include_str!("../../../materials/mandelbrot_wall.impasto"),
        include_str!("../../../materials/frosted_glass.impasto"),
    ] {
        // Also where the last subgroup is not full.
        for samples in [256, 77, 5] {
            let issued = cost(text, samples).issued;
            for pair in issued.windows(2) {
                let classes = |c: &Classes| [c.alu, c.special, c.integer, c.texture, c.turns];
                let (a, b) = (classes(&pair[0]), classes(&pair[1]));
                assert!(a.iter().zip(b).all(|(a, b)| *a <= b + 1e-9), "{issued:?}");
            }
            assert!(
                samples < 256 || issued[5].sum() > issued[0].sum(),
                "{issued:?}"
            );
        }
    }
}

#[test]
fn lanes_that_do_the_same_issue_what_one_does() {
    let text = emitting("color(sin(uv.x) + cos(uv.y * 3.0))", "");
    for samples in [1, 5, 77, 1500] {
        let cost = cost(&text, samples);
        assert!(cost.issued.iter().all(|i| *i == cost.issued[0]), "{cost:?}");
        assert_eq!(cost.efficiency(), 1.0);
    }
}

#[test]
fn a_subgroup_stays_in_a_loop_as_long_as_its_longest_lane() {
    let cost = cost(&emitting("color(turns(uv.x))", TURNS), 4096);
    for (issued, lanes) in cost.issued.iter().zip(LANES) {
        // The greatest of n uniform numbers is n / (n + 1) in the mean; turns are rounded down.
        let n = f64::from(lanes);
        let expected = 64.0 * n / (n + 1.0) - 0.5;
        assert!((issued.turns - expected).abs() < 0.8, "{lanes}: {issued:?}");
    }
    assert!(
        (cost.efficiency() - 0.52).abs() < 0.03,
        "{}",
        cost.efficiency()
    );
}

#[test]
fn a_subgroup_takes_each_branch_that_a_lane_takes() {
    // A quarter of all points takes the one side, and the others the other.
    let text = emitting(
        "color(either(uv.x))",
        "fn either(x: float) -> float {
             var y = x;
             if x < 0.25 { y = sqrt(sqrt(sqrt(sqrt(x + 1.0) + 2.0) + 3.0) + 4.0); }
             else { y = sin(sin(x + 1.0) + 2.0); }
             y
         }",
    );
    let cost = cost(&text, 4096);
    for (issued, lanes) in cost.issued.iter().zip(LANES) {
        let n = f64::from(lanes);
        let any = |share: f64| 1.0 - (1.0 - share).powf(n);
        let expected = 4.0 * any(0.25) + 2.0 * any(0.75);
        assert!(
            (issued.special - expected).abs() < 0.1,
            "{lanes}: {issued:?}, {expected}"
        );
    }
}

#[test]
fn the_same_function_called_on_both_sides_is_issued_twice() {
    let text = emitting(
        "color(either(uv.x))",
        "fn slow(x: float) -> float {
             var sum = x;
             for i in 0 .. 50 { sum = sqrt(sum + float(i) + cos(sum) * sin(sum + 1.0) + tan(x) + exp(x * 0.1)
                 + log(x + 3.0 + sum) + sqrt(x + 2.0) + acos(x - 0.5 * sum) + pow(sum, 1.5 + x)); }
             sum
         }
         fn either(x: float) -> float {
             var y = x;
             if x < 0.5 { y = slow(x * 3.0); } else { y = slow(x - 7.0) + 1.0; }
             y
         }",
    );
    let cost = cost(&text, 1024);
    assert!((cost.issued[0].turns - 50.0).abs() < 1e-9, "{cost:?}");
    assert!((cost.issued[5].turns - 100.0).abs() < 1e-9, "{cost:?}");
    // Both calls are in line, each with its loop.
    assert_eq!(cost.loops, 2);
}

/// A program of one material with an instance for each value of its parameter `name`.
fn instances(text: &str, name: &str, values: &[&str]) -> Program {
    let mut files = MemoryLoader::default();
    files.add("m.impasto", text);
    let request = |value: &&str| MaterialRequest {
        params: vec![(name.to_owned(), (*value).into())],
        ..MaterialRequest::new(*value, "m.impasto")
    };
    let requests: Vec<MaterialRequest> = values.iter().map(request).collect();
    let compiled = compile(&requests, &mut files);
    compiled.program.expect("it compiles")
}

/// The cost of the only material of a program, with as many inputs for each instance.
fn over_instances(program: &Program, each: usize) -> Cost {
    assert_eq!(program.materials().len(), 1);
    let mut inputs = Inputs::new(0);
    let of = (0..program.instances().len() * each).map(|i| i / each);
    let points: Vec<(usize, At)> = of.map(|i| (i, inputs.anywhere())).collect();
    let found = cost::vector(program, 0, &points);
    found.expect("there are inputs")
}

#[test]
fn instances_share_subgroups() {
    let text = "use std::edf::uniform;
        material m {
            param turns: int = 1;
            emission = uniform(color(slow(uv.x, turns)));
        }
        fn slow(x: float, turns: int) -> float {
            var sum = x;
            for i in 0 .. min(turns, 100) { sum = sqrt(sum + float(i)); }
            sum
        }";
    let program = instances(text, "turns", &["8", "40"]);
    // More than one batch, each of which has inputs of both.
    for each in [256, 1024] {
        let cost = over_instances(&program, each);
        assert!((cost.issued[0].turns - 24.0).abs() < 1e-9, "{cost:?}");
        assert!((cost.issued[1].turns - 32.0).abs() < 1.0, "{cost:?}");
        assert!((cost.issued[5].turns - 40.0).abs() < 1e-3, "{cost:?}");
        assert_eq!(
            (cost.operations.evaluations, cost.loops),
            (2 * each as u64, 1)
        );
        assert!(
            cost.operations.max >= cost.operations.min + 32 * 3,
            "{cost:?}"
        );
    }
}

#[test]
fn bytes_are_rows_of_parameters_and_texels() {
    let text = "use std::edf::uniform;
        material m {
            param tint: color = color(0.5);
            emission = uniform(tint * uv.x);
        }";
    let program = instances(text, "tint", &["0.25", "0.5"]);
    // Three floats are a row.
    assert_eq!(over_instances(&program, 8).bytes, 16.0);
    // One instance has its color in the code.
    assert_eq!(
        over_instances(&instances(text, "tint", &["0.25"]), 8).bytes,
        0.0
    );
    // A texture: what is known of it, and four texels of eight bytes, here for half of all points.
    let text = "use std::edf::uniform;
        material m {
            param paper: texture = \"a.png\";
            emission = uniform(some(paper, uv));
        }
        fn some(t: texture, uv: vec2) -> color {
            var c = color(0.0);
            if uv.x < 0.5 { c = image(t, uv); }
            c
        }";
    let cost = cost(text, 1024);
    assert!(cost.operations.classes.texture > 0.4 && cost.operations.classes.texture < 0.6);
    assert!(
        (cost.bytes - 40.0 * cost.operations.classes.texture).abs() < 1e-9,
        "{cost:?}"
    );
}

#[test]
fn code_counts_once_what_loops_repeat_and_what_branches_skip() {
    let code = |value: &str, functions: &str| cost(&emitting(value, functions), 16).code;
    let plain = code("color(uv.x)", "");
    // Two sines and a sum.
    assert_eq!(code("color(sin(uv.x) + sin(uv.y))", ""), plain + 3);
    // The turn, a conversion, a sum and a root; the bound is a product, converted, and at most 64.
    assert_eq!(code("color(turns(uv.x))", TURNS), plain + 7);
}

#[test]
fn nothing_is_known_without_inputs() {
    let program = program(&emitting("color(uv.x)", ""));
    assert_eq!(cost::vector(&program, 0, &[]), None);
    assert!(cost::lines(&program, 0, &[]).is_empty());
}
