//! Assignment to several components, matrices and unsigned ints, against values computed by hand.

use impasto_compiler::ir::value::Value;

use super::flow::{call, module};

fn ints(text: &str, cases: &[(&str, &[u32], u32)]) {
    let m = module(text);
    for (name, args, expected) in cases {
        let args = args.iter().map(|&u| Value::Int(u as i32)).collect();
        let found = call(&m, name, args);
        assert_eq!(found.as_int() as u32, *expected, "{name}");
    }
}

#[test]
fn several_components_are_assigned_at_once() {
    let m = module(
        "
fn swapped(v: vec3) -> vec3 { var w = v; w.xz = w.zx; w }
fn scaled(c: color) -> color { var d = c; d.rg *= 2.0; d.bgr -= 1.0; d }
fn turned(v: vec4) -> vec4 { var w = v; w.wzyx = v; w }
fn whole(p: point) -> point { var q = p; q.xyz = vec3(7.0); q.zy = vec2(1.0, 2.0); q }
",
    );
    let of = |name: &str, v: &[f64]| call(&m, name, vec![Value::vector(v)]).to_f64();
    assert_eq!(of("swapped", &[1.0, 2.0, 3.0]), [3.0, 2.0, 1.0]);
    assert_eq!(of("scaled", &[1.0, 2.0, 3.0]), [1.0, 3.0, 2.0]);
    assert_eq!(of("turned", &[1.0, 2.0, 3.0, 4.0]), [4.0, 3.0, 2.0, 1.0]);
    assert_eq!(of("whole", &[0.0, 0.0, 0.0]), [7.0, 2.0, 1.0]);
}

#[test]
fn matrices_of_two_columns_are_combined() {
    let m = module(
        "
fn times(x: vec2, y: vec2, v: vec2) -> vec2 = mat2(x, y) * v;
fn product(x: vec2, y: vec2, v: vec2) -> vec2 { let m = mat2(x, y); (m * transpose(m)) * v }
fn det(x: vec2, y: vec2, v: vec2) -> float = determinant(mat2(x, y));
fn solved(x: vec2, y: vec2, v: vec2) -> vec2 { let m = mat2(x, y); inverse(m) * (m * v) }
fn sum(x: vec2, y: vec2, v: vec2) -> vec2 = (2.0 * mat2(x, y) - mat2(1) / 2.0 + -mat2(x, y)) * v;
fn written(x: vec2, y: vec2, v: vec2) -> vec2 = mat2(x.x, x.y, y.x, y.y).y + mat2(x, y).x;
fn flat(x: vec2, y: vec2, v: vec2) -> vec2 = inverse(mat2(x, 2.0 * x)) * v;
fn kept(x: vec2, y: vec2, v: vec2) -> vec2 { var m = mat2(x, y); if v.x > 0.0 { m *= mat2(y, x); } m * v }
const QUARTER: mat2 = mat2(0, 1, -1, 0);
fn quarter(x: vec2, y: vec2, v: vec2) -> vec2 = QUARTER * v;
",
    );
    let of = |name: &str| {
        let args = [[1.0, 2.0], [3.0, 5.0], [10.0, 100.0]];
        call(&m, name, args.iter().map(|v| Value::vector(v)).collect()).to_f64()
    };
    assert_eq!(of("times"), [310.0, 520.0]);
    // [1 3; 2 5] [1 2; 3 5] = [10 17; 17 29]
    assert_eq!(of("product"), [1800.0, 3070.0]);
    assert_eq!(of("det"), [-1.0]);
    assert_eq!(of("solved"), [10.0, 100.0]);
    assert_eq!(of("sum"), [305.0, 470.0]);
    assert_eq!(of("written"), [4.0, 7.0]);
    assert_eq!(of("flat"), [0.0, 0.0]);
    // [1 3; 2 5] ([3 5]', [1 2]') has the columns (18, 31) and (7, 12).
    assert_eq!(of("kept"), [880.0, 1510.0]);
    assert_eq!(of("quarter"), [-100.0, 10.0]);
}

#[test]
fn matrices_of_three_columns_are_combined() {
    let m = module(
        "
fn det(x: vec3, y: vec3, z: vec3, v: vec3) -> float = determinant(mat3(x, y, z));
fn solved(x: vec3, y: vec3, z: vec3, v: vec3) -> vec3 { let m = mat3(x, y, z); inverse(m) * (m * v) }
fn product(x: vec3, y: vec3, z: vec3, v: vec3) -> vec3 { let m = mat3(x, y, z); (m * m) * v - m * (m * v) }
fn turned(x: vec3, y: vec3, z: vec3, v: vec3) -> vec3 = transpose(mat3(x, y, z)) * v;
fn column(x: vec3, y: vec3, z: vec3, v: vec3) -> vec3 { var m = mat3(x, y, z); m = m + mat3(1.0); m.y }
fn nine(x: vec3, y: vec3, z: vec3, v: vec3) -> vec3 = mat3(1, 2, 3, 4, 5, 6, 7, 8, 10) * v;
fn flat(x: vec3, y: vec3, z: vec3, v: vec3) -> vec3 = inverse(mat3(x, y, x + y)) * v;
",
    );
    let of = |name: &str| {
        let args = [
            [1.0, 2.0, 3.0],
            [4.0, 5.0, 6.0],
            [7.0, 8.0, 10.0],
            [1.0, 10.0, 100.0],
        ];
        call(&m, name, args.iter().map(|v| Value::vector(v)).collect()).to_f64()
    };
    assert_eq!(of("det"), [-3.0]);
    for (found, expected) in of("solved").iter().zip([1.0, 10.0, 100.0]) {
        assert!((found - expected).abs() < 1e-9, "{found} {expected}");
    }
    assert_eq!(of("product"), [0.0; 3]);
    assert_eq!(of("turned"), [321.0, 654.0, 1087.0]);
    assert_eq!(of("column"), [4.0, 6.0, 6.0]);
    assert_eq!(of("nine"), [741.0, 852.0, 1063.0]);
    assert_eq!(of("flat"), [0.0; 3]);
}

#[test]
fn unsigned_ints_shift_divide_and_compare_by_all_bits() {
    const TOP: u32 = 0x8000_0000;
    let text = "
fn shr(a: uint, b: uint) -> uint = a >> b;
fn shr_by_int(a: uint, b: int) -> uint = a >> b;
fn shr_of_int(a: int, b: uint) -> int = a >> b;
fn div(a: uint, b: uint) -> uint = a / b;
fn rem(a: uint, b: uint) -> uint = a % b;
fn less(a: uint, b: uint) -> uint = uint(a < b);
fn most(a: uint, b: uint) -> uint = max(a, b);
fn held(a: uint) -> uint = clamp(a, 3u, 0x90000000u);
fn minus(a: uint) -> uint = -a;
fn mixed(a: uint) -> uint { var s = a; s += 5; s ^= s << 3; s >>= 1; s &= 0xfffu; s |= 4096; s %= 5000; s <<= 1u; s }
fn of_float(a: uint) -> uint = uint(float(a) * 2.0);
fn near(a: uint) -> uint = uint(-0.5 * a);
fn same_hash(a: uint) -> uint = hash(a, 7u) ^ uint(hash(int(a), 7));
";
    ints(
        text,
        &[
            ("shr", &[TOP, 31], 1),
            ("shr", &[TOP, 33], TOP >> 1),
            ("shr_by_int", &[u32::MAX, 28], 15),
            ("shr_of_int", &[TOP, 31], u32::MAX),
            ("div", &[u32::MAX, 2], 0x7fff_ffff),
            ("div", &[TOP, u32::MAX], 0),
            ("div", &[7, 0], 0),
            ("rem", &[u32::MAX, 10], 5),
            ("rem", &[7, 0], 0),
            ("less", &[1, TOP], 1),
            ("less", &[TOP, 1], 0),
            ("most", &[1, TOP], TOP),
            ("held", &[u32::MAX], 0x9000_0000),
            ("held", &[0], 3),
            ("minus", &[1], u32::MAX),
            ("mixed", &[3], 8264),
            ("of_float", &[TOP - 256], u32::MAX - 511),
            ("of_float", &[u32::MAX], 0xffff_ff00),
            ("near", &[4], 0),
            ("same_hash", &[12345], 0),
        ],
    );
}

/// PCG (Jarzynski and Olano 2020), as the listing has it in GLSL.
#[test]
fn hashes_port_line_by_line() {
    let text = "
fn pcg(v: uint) -> uint {
    var state = v * 747796405u + 2891336453u;
    var word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    (word >> 22u) ^ word
}
fn difference(v: uint) -> uint = pcg(v) - hash(v);
";
    for v in [0, 1, 12345, u32::MAX] {
        ints(text, &[("difference", &[v], 0)]);
    }
    ints(text, &[("pcg", &[0], 129_708_002)]);
}
