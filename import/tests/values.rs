//! Values of nodes against their formulas, by the compiler's interpreter.

use impasto_compiler::inspect::{Precision, Query, Shown, inspect};
use impasto_compiler::{MemoryLoader, diag};

use crate::common::{compiled, of_text};

const U: f64 = 0.3;
const V: f64 = 0.7;

/// What a node named `n` gives at the texture coordinates (U, V); vectors of two are padded with zero, numbers stand
/// for grey.
#[track_caller]
fn value(nodes: &str, ty: &str) -> Vec<f64> {
    let text = format!(
        "<materialx version=\"1.39\"><texcoord name=\"st\" type=\"vector2\"/>\
         <extract name=\"u\" type=\"float\"><input name=\"in\" type=\"vector2\" nodename=\"st\"/></extract>\
         {nodes}<output name=\"shown\" type=\"{ty}\" nodename=\"n\"/></materialx>"
    );
    let imported = of_text(&text).unwrap_or_else(|errors| panic!("{}", errors[0]));
    let source = compiled(&imported);
    let mut loader = MemoryLoader::default();
    loader.add("t.impasto", source);
    let query = Query {
        file: "t.impasto".into(),
        item: Some("shown".into()),
        params: Vec::new(),
        at: format!("uv=({U}, {V})").parse().expect("a point"),
        precisions: vec![Precision::F64],
    };
    let found = inspect(&query, &mut loader).expect("readable");
    let problems = diag::render::text(&found.sources, &found.diagnostics, false);
    let answer = found
        .answers
        .first()
        .unwrap_or_else(|| panic!("{problems}"));
    match &answer.results[0].emission {
        Some(Shown::Vector(numbers)) => numbers.clone(),
        other => panic!("{other:?}\n{source}"),
    }
}

/// A node with inputs, each `NAME=VALUE` by its type: `u` and `st` are the nodes of these names.
fn node(category: &str, ty: &str, inputs: &[(&str, &str, &str)]) -> String {
    let mut text = format!("<{category} name=\"n\" type=\"{ty}\">");
    for (name, ty, value) in inputs {
        let value = match *value {
            "u" | "st" => format!("nodename=\"{value}\""),
            value => format!("value=\"{value}\""),
        };
        text.push_str(&format!("<input name=\"{name}\" type=\"{ty}\" {value}/>"));
    }
    text + &format!("</{category}>")
}

#[track_caller]
fn near(found: &[f64], expected: &[f64], what: &str) {
    let close = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-5 * b.abs().max(1.0);
    assert!(
        found.iter().zip(expected).all(close),
        "{what}: {found:?}, expected {expected:?}"
    );
}

#[test]
fn numbers_are_those_of_the_formulas() {
    type Case<'a> = (&'a str, &'a [(&'a str, &'a str, &'a str)], f64);
    let cases: &[Case] = &[
        (
            "add",
            &[("in1", "float", "u"), ("in2", "float", "2")],
            U + 2.0,
        ),
        (
            "subtract",
            &[("in1", "float", "1"), ("in2", "float", "u")],
            1.0 - U,
        ),
        (
            "multiply",
            &[("in1", "float", "u"), ("in2", "float", "3")],
            3.0 * U,
        ),
        (
            "divide",
            &[("in1", "float", "u"), ("in2", "float", "4")],
            U / 4.0,
        ),
        (
            "modulo",
            &[("in1", "float", "u"), ("in2", "float", "-0.25")],
            U - -0.25 * (U / -0.25f64).floor(),
        ),
        ("fract", &[("in", "float", "u")], U),
        (
            "invert",
            &[("in", "float", "u"), ("amount", "float", "0.9")],
            0.9 - U,
        ),
        ("absval", &[("in", "float", "-2.5")], 2.5),
        ("sign", &[("in", "float", "-2.5")], -1.0),
        ("floor", &[("in", "float", "2.5")], 2.0),
        ("ceil", &[("in", "float", "2.5")], 3.0),
        (
            "power",
            &[("in1", "float", "u"), ("in2", "float", "2")],
            U * U,
        ),
        ("sin", &[("in", "float", "u")], U.sin()),
        ("cos", &[("in", "float", "u")], U.cos()),
        ("tan", &[("in", "float", "u")], U.tan()),
        ("asin", &[("in", "float", "u")], U.asin()),
        ("acos", &[("in", "float", "u")], U.acos()),
        (
            "atan2",
            &[("iny", "float", "u"), ("inx", "float", "0.5")],
            U.atan2(0.5),
        ),
        ("sqrt", &[("in", "float", "u")], U.sqrt()),
        ("ln", &[("in", "float", "2")], 2f64.ln()),
        ("exp", &[("in", "float", "u")], U.exp()),
        (
            "clamp",
            &[("in", "float", "u"), ("low", "float", "0.4")],
            0.4,
        ),
        (
            "min",
            &[("in1", "float", "u"), ("in2", "float", "0.2")],
            0.2,
        ),
        ("max", &[("in1", "float", "u"), ("in2", "float", "0.2")], U),
        ("magnitude", &[("in", "vector2", "st")], U.hypot(V)),
        (
            "dotproduct",
            &[("in1", "vector2", "st"), ("in2", "vector2", "2, 3")],
            2.0 * U + 3.0 * V,
        ),
        (
            "distance",
            &[("in1", "vector2", "st"), ("in2", "vector2", "1, 1")],
            (1.0 - U).hypot(1.0 - V),
        ),
        (
            "remap",
            &[
                ("in", "float", "u"),
                ("inlow", "float", "0.1"),
                ("inhigh", "float", "0.6"),
                ("outlow", "float", "1"),
                ("outhigh", "float", "3"),
            ],
            1.0 + (U - 0.1) / 0.5 * 2.0,
        ),
        (
            "range",
            &[
                ("in", "float", "u"),
                ("gamma", "float", "2"),
                ("outhigh", "float", "0.5"),
                ("doclamp", "boolean", "true"),
            ],
            0.5 * U.sqrt(),
        ),
        (
            "contrast",
            &[("in", "float", "u"), ("amount", "float", "2")],
            (U - 0.5) * 2.0 + 0.5,
        ),
        (
            "smoothstep",
            &[("in", "float", "u")],
            U * U * (3.0 - 2.0 * U),
        ),
        (
            "trianglewave",
            &[("in", "float", "u")],
            0.5 - ((U % 1.0) - 0.5).abs(),
        ),
        (
            "mix",
            &[
                ("fg", "float", "u"),
                ("bg", "float", "1"),
                ("mix", "float", "0.25"),
            ],
            0.25 * U + 0.75,
        ),
        (
            "plus",
            &[
                ("fg", "float", "u"),
                ("bg", "float", "0.5"),
                ("mix", "float", "0.5"),
            ],
            0.5 * (0.5 + U) + 0.25,
        ),
        (
            "screen",
            &[("fg", "float", "u"), ("bg", "float", "0.5")],
            1.0 - (1.0 - U) * 0.5,
        ),
        (
            "overlay",
            &[("fg", "float", "u"), ("bg", "float", "0.6")],
            1.0 - 2.0 * (1.0 - U) * 0.4,
        ),
        (
            "burn",
            &[
                ("fg", "float", "u"),
                ("bg", "float", "0.8"),
                ("mix", "float", "0.5"),
            ],
            0.5 * (1.0 - 0.2 / U) + 0.4,
        ),
        (
            "dodge",
            &[("fg", "float", "u"), ("bg", "float", "0.5")],
            0.5 / (1.0 - U),
        ),
        (
            "inside",
            &[("in", "float", "u"), ("mask", "float", "0.5")],
            0.5 * U,
        ),
        (
            "outside",
            &[("in", "float", "u"), ("mask", "float", "0.25")],
            0.75 * U,
        ),
        (
            "ifgreater",
            &[
                ("value1", "float", "u"),
                ("value2", "float", "0.2"),
                ("in1", "float", "2"),
                ("in2", "float", "3"),
            ],
            2.0,
        ),
        (
            "ifgreatereq",
            &[
                ("value1", "float", "0.1"),
                ("value2", "float", "u"),
                ("in1", "float", "2"),
                ("in2", "float", "3"),
            ],
            3.0,
        ),
        (
            "switch",
            &[
                ("in1", "float", "2"),
                ("in2", "float", "3"),
                ("which", "float", "u"),
            ],
            2.0,
        ),
        (
            "ramplr",
            &[("valuel", "float", "1"), ("valuer", "float", "3")],
            1.0 + 2.0 * U,
        ),
        (
            "ramptb",
            &[("valuet", "float", "1"), ("valueb", "float", "3")],
            3.0 - 2.0 * V,
        ),
        (
            "ramp4",
            &[
                ("valuetl", "float", "1"),
                ("valuetr", "float", "2"),
                ("valuebl", "float", "3"),
                ("valuebr", "float", "5"),
            ],
            (3.0 + 2.0 * U) * (1.0 - V) + (1.0 + U) * V,
        ),
        (
            "splitlr",
            &[("valuel", "float", "1"), ("valuer", "float", "3")],
            1.0,
        ),
        (
            "splittb",
            &[("valuet", "float", "1"), ("valueb", "float", "3")],
            1.0,
        ),
        (
            "circle",
            &[
                ("center", "vector2", "0.5, 0.5"),
                ("radius", "float", "0.3"),
            ],
            1.0,
        ),
        (
            "circle",
            &[
                ("center", "vector2", "0.5, 0.5"),
                ("radius", "float", "0.28"),
            ],
            0.0,
        ),
    ];
    for (category, inputs, expected) in cases {
        // Emission is light: what is negative is shown from the other side.
        let sign = expected.signum();
        let shown = node(category, "float", inputs).replace("name=\"n\"", "name=\"m\"");
        let turned = format!(
            "{shown}<multiply name=\"n\" type=\"float\"><input name=\"in1\" type=\"float\" nodename=\"m\"/>\
             <input name=\"in2\" type=\"float\" value=\"{sign}\"/></multiply>"
        );
        near(&value(&turned, "float"), &[expected * sign; 3], category);
    }
}

#[test]
fn coordinates_and_vectors_are_those_of_the_formulas() {
    let (s, c) = 30f64.to_radians().sin_cos();
    let turned = node(
        "rotate2d",
        "vector2",
        &[("in", "vector2", "st"), ("amount", "float", "30")],
    );
    let (x, y) = (c * U + s * V, c * V - s * U);
    near(&value(&turned, "vector2"), &[x, y, 0.0], "rotate2d");

    let inputs = [
        ("texcoord", "vector2", "st"),
        ("pivot", "vector2", "0.1, 0.2"),
        ("scale", "vector2", "0.5, 2"),
        ("rotate", "float", "30"),
        ("offset", "vector2", "-1, -1"),
    ];
    let (p, q) = ((U - 0.1) / 0.5, (V - 0.2) / 2.0);
    let placed = [c * p + s * q + 1.0 + 0.1, c * q - s * p + 1.0 + 0.2, 0.0];
    near(
        &value(&node("place2d", "vector2", &inputs), "vector2"),
        &placed,
        "place2d",
    );

    let mut moved = inputs.to_vec();
    moved.push(("operationorder", "integer", "1"));
    let (p, q) = (U - 0.1 + 1.0, V - 0.2 + 1.0);
    let placed = [
        (c * p + s * q) / 0.5 + 0.1,
        (c * q - s * p) / 2.0 + 0.2,
        0.0,
    ];
    near(
        &value(&node("place2d", "vector2", &moved), "vector2"),
        &placed,
        "place2d, moved first",
    );

    // Clockwise about y, seen from its end: z goes to -x.
    let about = [
        ("in", "vector3", "1, 2, 3"),
        ("amount", "float", "-90"),
        ("axis", "vector3", "0, 1, 0"),
    ];
    let rotated = value(&node("rotate3d", "vector3", &about), "vector3");
    near(&[rotated[0], rotated[1]], &[3.0, 2.0], "rotate3d");

    let matrix = "1, 2, 0, 0, 1, 0, 0.5, 0.25, 1";
    let transformed = node(
        "transformmatrix",
        "vector2",
        &[("in", "vector2", "st"), ("mat", "matrix33", matrix)],
    );
    near(
        &value(&transformed, "vector2"),
        &[U + 0.5, 2.0 * U + V + 0.25, 0.0],
        "transformmatrix",
    );

    let tiles = [
        ("uvtiling", "vector2", "4, 4"),
        ("color1", "color3", "0.9, 0.9, 0.9"),
    ];
    // (1, 2) is a square with an odd sum.
    near(
        &value(&node("checkerboard", "color3", &tiles), "color3"),
        &[0.9; 3],
        "checkerboard",
    );
}

#[test]
fn colors_are_those_of_the_formulas() {
    let color = ("in", "color3", "0.5, 0.25, 0.1");
    let luma = 0.5 * 0.2722287 + 0.25 * 0.6740818 + 0.1 * 0.0536895;
    near(
        &value(&node("luminance", "color3", &[color]), "color3"),
        &[luma; 3],
        "luminance",
    );
    let hsv = value(&node("rgbtohsv", "color3", &[color]), "color3");
    near(&hsv, &[(0.15 / 0.4) / 6.0, 0.8, 0.5], "rgbtohsv");
    let back = format!("{}, {}, {}", hsv[0], hsv[1], hsv[2]);
    let back = value(
        &node("hsvtorgb", "color3", &[("in", "color3", &back)]),
        "color3",
    );
    near(&back, &[0.5, 0.25, 0.1], "hsvtorgb");
    let half = value(
        &node("saturate", "color3", &[color, ("amount", "float", "0.5")]),
        "color3",
    );
    near(
        &half,
        &[0.25 + luma / 2.0, 0.125 + luma / 2.0, 0.05 + luma / 2.0],
        "saturate",
    );
    let same = value(
        &node(
            "hsvadjust",
            "color3",
            &[color, ("amount", "vector3", "0, 1, 2")],
        ),
        "color3",
    );
    near(&same, &[1.0, 0.5, 0.2], "hsvadjust");
    let over = [
        ("fg", "color4", "0.2, 0.1, 0, 0.5"),
        ("bg", "color4", "0.4, 0.4, 0.4, 1"),
    ];
    near(
        &value(&node("over", "color4", &over), "color4"),
        &[0.4, 0.3, 0.2],
        "over",
    );
    near(
        &value(&node("matte", "color4", &over), "color4"),
        &[0.3, 0.25, 0.2],
        "matte",
    );
    near(
        &value(&node("disjointover", "color4", &over), "color4"),
        &[0.4, 0.3, 0.2],
        "disjointover",
    );
    let ramp = [
        ("num_intervals", "integer", "3"),
        ("interpolation", "integer", "0"),
        ("color1", "color4", "0, 0, 0, 1"),
        ("interval2", "float", "0.25"),
        ("color2", "color4", "1, 0, 0, 1"),
        ("color3", "color4", "0, 1, 0, 1"),
    ];
    let t = (U - 0.25) / 0.75;
    near(
        &value(&node("ramp", "color4", &ramp), "color4"),
        &[1.0 - t, t, 0.0],
        "ramp",
    );
}

#[test]
fn matrices_of_four_by_four_are_computed() {
    let nodes = "<constant name=\"a\" type=\"matrix44\"><input name=\"value\" type=\"matrix44\" \
        value=\"2,0,0,0, 0,4,0,0, 0,0,1,0, 1,2,3,1\"/></constant>\
        <invertmatrix name=\"b\" type=\"matrix44\"><input name=\"in\" type=\"matrix44\" nodename=\"a\"/></invertmatrix>\
        <transformmatrix name=\"n\" type=\"vector3\"><input name=\"in\" type=\"vector3\" value=\"5, 10, 7\"/>\
        <input name=\"mat\" type=\"matrix44\" nodename=\"b\"/></transformmatrix>";
    near(&value(nodes, "vector3"), &[2.0, 2.0, 4.0], "invertmatrix");
}
