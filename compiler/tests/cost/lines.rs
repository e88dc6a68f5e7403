//! Which source lines operations are attributed to.

use impasto_compiler::cost::{self, Cost, Inputs, LineCost};

use crate::common::program;

/// The cost of a text's only material, and of its lines.
fn costs(text: &str) -> (Cost, Vec<LineCost>) {
    let program = program(text);
    let mut inputs = Inputs::new(0);
    let points: Vec<_> = (0..256).map(|_| (0, inputs.anywhere())).collect();
    let measured = cost::Measured::new(&program, 0, &points);
    let measured = measured.expect("there are inputs");
    (measured.cost(), measured.lines())
}

/// The line whose text begins with `start`.
#[track_caller]
fn line<'l>(lines: &'l [LineCost], start: &str) -> &'l LineCost {
    let found = lines.iter().find(|l| l.text.starts_with(start));
    found.unwrap_or_else(|| panic!("no line `{start}` in {lines:#?}"))
}

#[test]
fn lines_add_up_to_their_material() {
    for text in [
        include_str!("../../../materials/car_paint.impasto"),
        include_str!("../../../materials/leaf.impasto"),
        include_str!("../../../materials/voronoi_floor.impasto"),
        include_str!("../../../materials/frosted_glass.impasto"),
        include_str!("../../../materials/mandelbrot_wall.impasto"),
    ] {
        let (cost, lines) = costs(text);
        let sum = |of: &dyn Fn(&LineCost) -> f64| lines.iter().map(of).sum::<f64>();
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-6 * b.max(1.0), "{a} is not {b}");
        let classes = &cost.operations.classes;
        close(sum(&|l| l.operations), cost.operations.mean);
        close(sum(&|l| l.classes.alu), classes.alu);
        close(sum(&|l| l.classes.special), classes.special);
        close(sum(&|l| l.classes.integer), classes.integer);
        close(sum(&|l| l.classes.turns), classes.turns);
        close(sum(&|l| l.issued), cost.issued[5].sum());
        for line in &lines {
            assert!(line.issued >= line.operations - 1e-9, "{line:?}");
            assert!(line.with_calls >= line.operations - 1e-9, "{line:?}");
            close(line.share, line.with_calls / cost.operations.mean);
            assert!(line.share <= 1.0, "{line:?}");
        }
        assert!(lines.is_sorted_by(|a, b| a.with_calls >= b.with_calls));
        // Whatever the library does, some line of the author's asked for.
        let library = lines.iter().filter(|l| l.library);
        let library: f64 = library.map(|l| l.operations).sum();
        let most: f64 = lines
            .iter()
            .filter(|l| !l.library)
            .map(|l| l.with_calls)
            .sum();
        assert!(
            library > 0.0 && most > 0.999 * cost.operations.mean,
            "{lines:#?}"
        );
    }
}

#[test]
fn a_function_in_line_belongs_to_its_own_lines_and_to_those_that_call_it() {
    let (_, lines) = costs(
        "use std::edf::uniform;
         fn twice(x: float) -> float {
             let y = sqrt(x);
             exp(y) + log(y + 3.0)
         }
         material m {
             let a = twice(uv.x);
             let b = twice(uv.y + normal.x);
             emission = uniform(color(a * b + sin(position.x)));
         }",
    );
    let special = |start: &str| line(&lines, start).classes.special;
    assert_eq!(special("let y"), 2.0);
    assert_eq!(special("exp(y)"), 4.0);
    assert_eq!(special("emission"), 1.0);
    let (a, b) = (line(&lines, "let a"), line(&lines, "let b"));
    // A root, an exponential, a logarithm and two sums, the last of which the `let` names; one
    // argument is a sum itself.
    assert_eq!((a.operations, a.with_calls), (1.0, 5.0));
    assert_eq!((b.operations, b.with_calls), (2.0, 6.0));
    assert_eq!(
        (a.line, a.file.as_str(), a.library),
        (7, "m.impasto", false)
    );
}

#[test]
fn calls_within_calls_belong_to_all_of_them() {
    let (_, lines) = costs(
        "use std::edf::uniform;
         fn inner(x: float) -> float {
             exp(x + 0.5)
         }
         fn outer(x: float) -> float {
             let first = inner(x) * 3.0;
             let second = inner(x * 5.0) * 7.0;
             first + second
         }
         material m {
             emission = uniform(color(
                 outer(uv.x)
                 + inner(uv.y)
             ));
         }",
    );
    let with_calls = |start: &str| line(&lines, start).with_calls;
    // An exponential and its sum are two; besides, products, and the sum of both.
    assert_eq!(with_calls("exp(x"), 6.0);
    assert_eq!(with_calls("let first"), 3.0);
    assert_eq!(with_calls("let second"), 4.0);
    assert_eq!(with_calls("outer(uv.x)"), 8.0 + 1.0);
    assert_eq!(with_calls("+ inner(uv.y)"), 2.0);
}

/// A function that is too large to go in line, which calls another.
const LARGE: &str = "
    fn slow(x: float) -> float {
        var sum = x;
        for i in 0 .. 50 {
            sum = sqrt(sum + float(i) + cos(sum) * sin(sum + 1.0) + tan(x) + exp(x * 0.1)
                + log(x + 3.0 + sum) + sqrt(x + 2.0) + acos(x - 0.5 * sum) + pow(sum, 1.5 + x));
            sum = noise(sum);
        }
        sum
    }
    fn noise(x: float) -> float {
        cos(x + 5.0)
    }";

#[test]
fn a_function_that_stays_is_shared_out_to_its_callers() {
    let (cost, lines) = costs(&format!(
        "use std::edf::uniform;
         material m {{
             let a = slow(uv.x);
             let b = if uv.y < 0.5 {{ 0.0 }} else {{
                 slow(uv.y)
             }};
             emission = uniform(color(a + b));
         }}{LARGE}"
    ));
    let (a, b) = (line(&lines, "let a"), line(&lines, "slow(uv.y)"));
    let taken = b.with_calls / a.with_calls;
    assert!(
        (taken - 0.5).abs() < 0.1,
        "half of the points take it, not {taken}"
    );
    let own = line(&lines, "sum = sqrt");
    assert!(
        own.operations > 0.5 * (a.with_calls + b.with_calls),
        "{lines:#?}"
    );
    // A call in a call belongs to all of them.
    let (inner, calls) = (
        line(&lines, "cos(x + 5.0)"),
        line(&lines, "sum = noise(sum)"),
    );
    assert_eq!(inner.operations, calls.with_calls);
    assert!(a.with_calls + b.with_calls <= cost.operations.mean);
    let turns: f64 = line(&lines, "for i in").classes.turns;
    assert!((turns - 75.0).abs() < 5.0, "{turns}");
}

#[test]
fn closures_belong_to_the_lines_that_made_them() {
    let text = "use std::bsdf::{blinn_phong, diffuse};
         use std::edf::uniform;
         fn coat(under: color) -> bsdf {
             layer(
                 blinn_phong(exponent: 40.0),
                 diffuse(under),
             )
         }
         material m {
             surface = coat(color(uv.x));
         }";
    let (cost, lines) = costs(text);
    let whole = line(&lines, "surface = coat").with_calls;
    assert!(whole > 0.4 * cost.operations.mean, "{lines:#?}");
    let lobes = line(&lines, "blinn_phong(").with_calls + line(&lines, "diffuse(").with_calls;
    assert!(
        lobes > 0.4 * cost.operations.mean && lobes <= whole + 1e-9,
        "{lines:#?}"
    );
    // Choosing a lobe and combining them belongs to the material as a whole.
    assert!(line(&lines, "material m").operations > 0.0);
    // What comes after the call is not part of it.
    let glowing = text.replace(
        "coat(color(uv.x));",
        "coat(color(uv.x));\nemission = uniform(color(sin(uv.y)));",
    );
    let (_, lines) = costs(&glowing);
    assert!(line(&lines, "emission").operations > 0.0);
    assert_eq!(line(&lines, "surface = coat").with_calls, whole);
}
