//! Ramps and splines of any number of values against those of up to eight, which have tests of their
//! own.

use super::text::Text;
use impasto_verify::statistics::Numbers;

const TEXT: &str = "
use std::pattern::{color_ramp, color_spline, color_stops, spline, spline_through, value_stops};

fn few_stops(x: float, a: color, b: color, c: color, p: vec3, curve: int, width: float) -> color =
    color_ramp(x, 3, a, b, c, at_1: p.x, at_2: p.y, at_3: p.z, curve: curve, width: width);
fn any_stops(x: float, a: color, b: color, c: color, p: vec3, curve: int, width: float) -> color =
    color_stops(x, [p.x, p.y, p.z], [a, b, c], curve, width: width);
fn any_values(x: float, a: color, b: color, c: color, p: vec3, curve: int, width: float) -> color =
    color(value_stops(x, [p.x, p.y, p.z], [a.r, b.r, c.r], curve, width: width));

fn few_knots(x: float, a: vec3, b: vec3, kind: int) -> float =
    spline(x, 6, a.x, a.y, a.z, b.x, b.y, b.z, kind: kind);
fn any_knots(x: float, a: vec3, b: vec3, kind: int) -> float =
    spline_through(x, [a.x, a.y, a.z, b.x, b.y, b.z], kind);
fn any_colors(x: float, a: vec3, b: vec3, kind: int) -> color = color_spline(
    x,
    [
        color(a.x, 1.0, b.x),
        color(a.y, 1.0, b.y),
        color(a.z, 1.0, b.z),
        color(b.x, 1.0, a.x),
        color(b.y, 1.0, a.y),
        color(b.z, 1.0, a.z),
    ],
    kind,
);
fn single(x: float) -> vec3 =
    vec3(value_stops(x, [0.5], [7.0]), spline_through(x, [7.0]), color_spline(x, [7.0]).g);
fn long(x: float) -> float = spline_through(x, fill(3.0, 200));
";

fn near(found: &[f64], expected: &[f64], what: &str) {
    let off = found
        .iter()
        .zip(expected)
        .any(|(a, b)| (a - b).abs() > 1e-9);
    assert!(
        !off && found.len() == expected.len(),
        "{what}: {found:?}, not {expected:?}"
    );
}

#[test]
fn ramps_of_any_length_are_those_of_few_stops() {
    let text = Text::new(TEXT);
    let mut n = Numbers::new(3);
    for i in 0..600 {
        let mut color = || [n.unit(), n.unit(), n.unit()];
        let (a, b, c, mut places) = (color(), color(), color(), color());
        places.sort_by(f64::total_cmp);
        let x = [n.between(-0.2, 1.2)];
        let curve = [f64::from(i % 3)];
        let width = [if i % 2 == 0 { 0.0 } else { n.unit() }];
        let args: [&[f64]; 7] = [&x, &a, &b, &c, &places, &curve, &width];
        let of = |name: &str| text.call::<f64>(name, &args);
        near(&of("any_stops"), &of("few_stops"), &format!("{args:?}"));
        near(
            &of("any_values")[..1],
            &of("few_stops")[..1],
            &format!("{args:?}"),
        );
    }
}

#[test]
fn splines_of_any_length_are_those_of_few_knots() {
    let text = Text::new(TEXT);
    let mut n = Numbers::new(4);
    for i in 0..600 {
        let mut knots = || [n.unit(), n.unit(), n.unit()];
        let (a, b) = (knots(), knots());
        let (x, kind) = ([n.between(-0.2, 1.2)], [f64::from(i % 4)]);
        let value = |name: &str, a: &[f64], b: &[f64]| text.call::<f64>(name, &[&x, a, b, &kind]);
        let few = value("few_knots", &a, &b);
        near(&value("any_knots", &a, &b), &few, "one number");
        let colors = [few[0], 1.0, value("few_knots", &b, &a)[0]];
        near(&value("any_colors", &a, &b), &colors, "colors");
    }
    for x in [-1.0, 0.0, 0.3, 1.0, 9.0] {
        near(&text.call::<f64>("single", &[&[x]]), &[7.0; 3], "one value");
        near(&text.call::<f64>("long", &[&[x]]), &[3.0], "200 values");
    }
}
