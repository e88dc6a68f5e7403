//! Arrays, loops over them and functions of arrays of any length, against values computed by hand.

use impasto_compiler::ir::value::Value;

use super::flow::{call, module};

fn at(m: &impasto_compiler::ir::Module, name: &str, i: i32) -> Vec<f64> {
    call(m, name, vec![Value::Int(i)]).to_f64()
}

#[test]
fn an_index_chooses_the_element() {
    let m = module(
        "
struct pair { a: float, m: mat3 }
const PRIMES: int[7] = [2, 3, 5, 7, 11, 13, 17];
const COLORS: color[3] = [0.5, color(1.0, 2.0, 3.0), 4];
fn prime(i: int) -> float = float(PRIMES[i]);
fn tint(i: int) -> color = COLORS[i];
fn flag(i: int) -> float = if [true, false, true][i] { 1.0 } else { 0.0 };
fn pairs(i: int) -> vec3 {
    let two = [pair(1.0, mat3(2)), pair(3.0, mat3(4))];
    vec3(two[i].a, two[i].m.y.y, [mat3(5), mat3(6), mat3(7)][i].x.x)
}
",
    );
    let primes: Vec<f64> = (-2..9).flat_map(|i| at(&m, "prime", i)).collect();
    // An index outside takes the nearest element.
    let expected = [2.0, 2.0, 2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 17.0, 17.0];
    assert_eq!(primes, expected);
    assert_eq!(at(&m, "tint", 0), [0.5; 3]);
    assert_eq!(at(&m, "tint", 1), [1.0, 2.0, 3.0]);
    assert_eq!(at(&m, "tint", 2), [4.0; 3]);
    assert_eq!([0, 1, 2].map(|i| at(&m, "flag", i)[0]), [1.0, 0.0, 1.0]);
    assert_eq!(at(&m, "pairs", 0), [1.0, 2.0, 5.0]);
    assert_eq!(at(&m, "pairs", 1), [3.0, 4.0, 6.0]);
    assert_eq!(at(&m, "pairs", i32::MAX), [3.0, 4.0, 7.0]);
}

#[test]
fn elements_are_assigned() {
    let m = module(
        "
struct knots { y: float[3], n: int }
fn counted(i: int) -> float {
    var bins = fill(0, 4);
    for k in 0 .. 10 { bins[k & i] += 1; }
    float(bins[0] * 1000 + bins[1] * 100 + bins[2] * 10 + bins[3])
}
fn parts(i: int) -> vec3 {
    var v = [vec3(1.0), vec3(2.0), vec3(3.0)];
    v[i].zx *= vec2(10.0, 100.0);
    v[1] += 0.5;
    v[i]
}
fn fields(i: int) -> vec3 {
    var k = knots([1, 2, 3], 5);
    k.y[i] = 7.0;
    k.n -= i;
    k.y[0] += float(k.n);
    vec3(k.y[0], k.y[1], k.y[2])
}
fn whole(i: int) -> float {
    var a: float[] = [1, 2];
    if i > 0 { a = [3, 4]; }
    a[0] + a[1]
}
fn outside(i: int) -> vec2 {
    var a = [1.0, 2.0];
    a[i] = 9.0;
    vec2(a[0], a[1])
}
",
    );
    assert_eq!(at(&m, "counted", 3), [3322.0]);
    assert_eq!(at(&m, "counted", 1), [5500.0]);
    assert_eq!(at(&m, "parts", 0), [100.0, 1.0, 10.0]);
    assert_eq!(at(&m, "parts", 1), [200.5, 2.5, 20.5]);
    assert_eq!(at(&m, "fields", 0), [12.0, 2.0, 3.0]);
    assert_eq!(at(&m, "fields", 2), [4.0, 2.0, 7.0]);
    assert_eq!(at(&m, "whole", 0), [3.0]);
    assert_eq!(at(&m, "whole", 1), [7.0]);
    assert_eq!(at(&m, "outside", -5), [9.0, 2.0]);
    assert_eq!(at(&m, "outside", 5), [1.0, 9.0]);
}

#[test]
fn functions_take_arrays_of_any_length() {
    let m = module(
        "
fn sum(values: float[]) -> float {
    var s = 0.0;
    for i in 0 .. count(values) { s += values[i]; }
    s
}
fn last(values: vec2[]) -> vec2 = values[count(values) - 1];
fn both(a: float[], b: float[]) -> float {
    var s = 0.0;
    for i in 0 .. count(a) {
        for k in 0 .. count(b) { s += a[i] * b[k]; }
    }
    s
}
fn first_above(values: float[], x: float) -> int {
    for i in 0 .. count(values) { if values[i] > x { break; } }
    var at = -1;
    for i in 0 .. count(values) {
        if values[i] > x { at = i; break; }
    }
    at
}
fn called(i: int) -> vec4 = vec4(
    sum([1, 2, 3]),
    sum(fill(0.5, 40)),
    last([vec2(1.0), vec2(2.0, 8.0)]).y,
    both([1, 2], [3, 4, 5]),
);
fn found(i: int) -> float = float(first_above([1, 5, 3, 9], float(i)));
",
    );
    assert_eq!(at(&m, "called", 0), [6.0, 20.0, 8.0, 36.0]);
    let found: Vec<f64> = [0, 1, 4, 5, 9]
        .iter()
        .flat_map(|i| at(&m, "found", *i))
        .collect();
    assert_eq!(found, [0.0, 1.0, 1.0, 3.0, -1.0]);
}
