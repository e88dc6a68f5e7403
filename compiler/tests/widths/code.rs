//! What code comes of widths: little, and none where nothing asks.

use crate::common::{codes, program, wgsl};
use impasto_compiler::abi::{Input, InputSet};

fn emitting(x: &str) -> String {
    format!("use std::edf::uniform;\nmaterial m {{ emission = uniform(color({x})); }}")
}

fn inputs(x: &str) -> InputSet {
    program(&emitting(x)).infos()[0].inputs
}

#[test]
fn a_width_of_scaled_coordinates_is_a_few_operations() {
    let operations = |x: &str| {
        let program = program(&emitting(x));
        let f = program.compiled()[0].emission.as_ref().expect("emits");
        let structs = &program.ir().structs;
        let each = f
            .evaluated()
            .into_iter()
            .map(|id| f.counts(structs, id).operations());
        each.sum::<u64>()
    };
    let width = operations("vec3(filter_width(8.0 * uv), 0.0)") - operations("vec3(uv, 0.0)");
    // Of two components: two products, their squares, a sum, a root and a minimum.
    assert!(width <= 14, "{width}");
    assert!(!wgsl(&emitting("vec3(filter_width(8.0 * uv), 0.0)")).contains("filter_width"));
}

#[test]
fn what_a_width_is_made_of_is_asked_for() {
    let none = inputs("vec3(uv, position.x)");
    assert!(!none.has(Input::Footprint) && !none.has(Input::FootprintUv));
    let of_uv = inputs("vec3(filter_width(uv), 0.0)");
    assert!(
        of_uv.has(Input::FootprintUv)
            && !of_uv.has(Input::Footprint)
            && !of_uv.has(Input::Uv)
            && !of_uv.has(Input::Position)
    );
    let of_position = inputs("vec3(filter_width(position))");
    assert!(
        of_position.has(Input::Footprint)
            && !of_position.has(Input::FootprintUv)
            && !of_position.has(Input::Position)
    );
    let of_steps = inputs("vec3(filter_width(floor(uv)), filter_width(normal.x))");
    assert!(!of_steps.has(Input::FootprintUv) && !of_steps.has(Input::Footprint));
}

/// Fields that nobody reads are not declared, so that scenes without widths have the code they had.
#[test]
fn code_without_widths_declares_no_footprint() {
    assert!(!wgsl(&emitting("vec3(uv, 0.0)")).contains("footprint"));
    let of_uv = wgsl(&emitting("vec3(filter_width(uv), 0.0)"));
    assert!(
        of_uv.contains("footprint_uv_x: vec2f,\n    footprint_uv_y: vec2f,"),
        "{of_uv}"
    );
    assert!(!of_uv.contains("footprint_x"));
}

/// A width decides a branch of a function away where it is the constant zero.
#[test]
fn no_width_is_the_code_without_filtering() {
    let text = |width: &str| {
        format!(
            "use std::edf::uniform;
            fn ramp(x: float, width: float = 0.0) -> float = if width > 0.0 {{ smoothstep(-width, width, x) }} else {{ step(0.0, x) }};
            material m {{ emission = uniform(color(ramp(uv.x - 0.5{width}))); }}"
        )
    };
    // The places of the source differ.
    let bare = |text: String| -> String {
        let lines = wgsl(&text);
        let lines = lines
            .lines()
            .map(|l| l.split("//").next().unwrap_or("").trim_end());
        lines.collect::<Vec<_>>().join("\n")
    };
    let point_sampled = bare(text(""));
    assert_eq!(bare(text(", width: filter_width(2.0)")), point_sampled);
    assert_eq!(bare(text(", width: filter_width(normal.x)")), point_sampled);
    assert_ne!(bare(text(", width: filter_width(uv.x)")), point_sampled);
}

#[test]
fn what_grows_without_end_is_an_error() {
    let mut items =
        "use std::edf::uniform;\nfn f0(x: float) -> float = sin(x) + x * x;\n".to_owned();
    for i in 1..16 {
        let before = i - 1;
        items += &format!(
            "fn f{i}(x: float) -> float {{ var s = 0.0; for i in 0 .. 2 {{ s += f{before}(x + s) * f{before}(2.0 * x) + f{before}(s * s); }} s }}\n"
        );
    }
    let text =
        format!("{items}material m {{ emission = uniform(color(filter_width(f15(uv.x)))); }}");
    assert!(codes(&text, &[]).contains(&"E0315") || codes(&text, &[]).contains(&"E0308"));
}
