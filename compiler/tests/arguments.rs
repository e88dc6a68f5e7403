//! What a material gives to the surface model that it is an instance of.

use impasto_compiler::diag::{self, Code};
use impasto_compiler::instance::{
    Channels, Found, Instance, NormalMap, Place, Texel, Value, Varying, instance,
};
use impasto_compiler::{MaterialRequest, MemoryLoader};

const USES: &str = "use std::surface::{open_pbr, gltf_pbr};
use std::pattern::normal_map;
use std::noise::perlin;
";

fn found(text: &str, params: &[(&str, &str)]) -> Found {
    let mut loader = MemoryLoader::default();
    loader.add("a.impasto", format!("{USES}{text}"));
    let request = MaterialRequest {
        material: Some("a".into()),
        params: params
            .iter()
            .map(|(name, value)| ((*name).to_owned(), (*value).into()))
            .collect(),
        ..MaterialRequest::new("a", "a.impasto")
    };
    instance(&request, &mut loader)
}

#[track_caller]
fn of(text: &str) -> Instance {
    let found = found(text, &[]);
    let problems = diag::render::text(&found.sources, &found.diagnostics, false);
    found.instance.unwrap_or_else(|| panic!("{problems}"))
}

/// Names and values.
fn values(instance: &Instance) -> Vec<(&str, Value)> {
    let arguments = instance.arguments.iter();
    arguments
        .map(|a| (a.name.as_str(), a.value.clone()))
        .collect()
}

fn numbers(numbers: &[f64]) -> Value {
    Value::Numbers(numbers.to_vec())
}

fn texel(channels: Channels, factor: &[f64]) -> Varying {
    Varying {
        offset: vec![0.0; factor.len()],
        factor: factor.to_vec(),
        texel: Some(Texel {
            lookup: 0,
            channels,
        }),
        has_vertex_color: false,
    }
}

/// What is said against a material, with the lines of the places.
fn refused(text: &str) -> Vec<String> {
    let found = found(text, &[]);
    assert_eq!(found.instance, None, "{text}");
    let problem = |d: &diag::Diagnostic| {
        assert_eq!(d.code, Code::NotExported, "{}", d.message);
        let line = d.span.map_or(0, |span| found.sources.line_column(span).0);
        format!("{line}: {}", d.message)
    };
    found.diagnostics.iter().map(problem).collect()
}

#[test]
fn constants_come_through_parameters_lets_functions_and_loops() {
    let text = "
        const ROUGH: float = 0.25;
        fn doubled(x: float) -> float { var y = x; for i in 0 .. 1 { y = y + x; } y }
        fn chosen(on: bool) -> float = if on { 0.5 } else { 0.75 };
        material a {
            param tint: color = color(0.1, 0.2, 0.3);
            param size: length = 2 mm;
            param thin: bool = true;
            let dark = tint * 0.5;
            material = open_pbr(
                base_color: dark,
                specular_roughness: doubled(ROUGH),
                coat_weight: chosen(thin),
                subsurface_radius: 2.0 * size,
                geometry_thin_walled: thin,
            );
        }";
    let expected = [
        ("base_color", numbers(&[0.05, 0.1, 0.15])),
        ("specular_roughness", numbers(&[0.5])),
        ("subsurface_radius", numbers(&[0.004])),
        ("coat_weight", numbers(&[0.5])),
        ("geometry_thin_walled", Value::Bool(true)),
    ];
    assert_eq!(values(&of(text)), expected);
    let set = found(text, &[("thin", "false"), ("tint", "color(0.8, 0.4, 0.2)")]);
    let set = set.instance.expect("no errors");
    let expected = [
        ("base_color", numbers(&[0.4, 0.2, 0.1])),
        ("specular_roughness", numbers(&[0.5])),
        ("subsurface_radius", numbers(&[0.004])),
        ("coat_weight", numbers(&[0.75])),
    ];
    assert_eq!(values(&set), expected, "`false` is the default");
}

#[test]
fn what_is_equal_to_a_default_is_not_given() {
    let text = "material a { param bent: normal = normal;
        material = open_pbr(base_color: color(0.8), specular_ior: 3.0 / 2.0, geometry_normal: bent,
                            geometry_tangent: tangent); }";
    assert_eq!(values(&of(text)), []);
}

#[test]
fn constants_are_held_to_the_range_of_the_parameter() {
    let text = "material a { param rough: float = 0.8;
        material = open_pbr(specular_roughness: 2.0 * rough); }";
    assert_eq!(values(&of(text)), [("specular_roughness", numbers(&[1.0]))]);
}

#[test]
fn pictures_have_factors_and_channels() {
    let text = "material a {
        param map: texture = \"a.png\";
        param tint: color = color(0.5, 0.0, 1.0);
        let texel = image_data(map, uv);
        material = open_pbr(
            base_color: tint * image(map, uv),
            base_metalness: texel.z,
            specular_roughness: 3.0 * texel.y,
            transmission_color: color(texel.xyz),
            coat_color: color(image(map, uv).g),
            geometry_opacity: 0.5 * image_alpha(map, uv),
            thin_film_thickness: mix(100 nm, 400 nm, texel.x),
        ); }";
    let instance = of(text);
    let nm = Varying {
        offset: vec![100.0 * 1e-9],
        ..texel(Channels::One(0), &[400.0 * 1e-9 - 100.0 * 1e-9])
    };
    let expected = [
        ("base_color", texel(Channels::Color, &[0.5, 0.0, 1.0])),
        ("base_metalness", texel(Channels::One(2), &[1.0])),
        // Its parameter ends at 1: other programs hold it likewise.
        ("specular_roughness", texel(Channels::One(1), &[3.0])),
        ("transmission_color", texel(Channels::Data, &[1.0; 3])),
        ("coat_color", texel(Channels::OneOfColor(1), &[1.0; 3])),
        ("thin_film_thickness", nm),
        ("geometry_opacity", texel(Channels::One(3), &[0.5])),
    ];
    let expected = expected.map(|(name, varying)| (name, Value::Varying(varying)));
    assert_eq!(values(&instance), expected);
    assert_eq!(instance.pictures, ["a.png"]);
    assert_eq!(instance.lookups.len(), 1);
}

#[test]
fn lookups_have_places_and_modes() {
    let text = "
        fn turned(at: vec2, angle: float) -> vec2 =
            vec2(cos(angle) * at.x + sin(angle) * at.y, cos(angle) * at.y - sin(angle) * at.x);
        material a {
        param map: texture = \"a.png\";
        material = open_pbr(
            base_color: image(map, uv * vec2(2.0, 3.0) - vec2(0.5, 0.0), wrap_u: CLAMP, wrap_v: MIRROR),
            coat_color: image(map, turned(uv1, 0.5), filter: NEAREST),
        ); }";
    let instance = of(text);
    let first = &instance.lookups[0];
    assert_eq!((first.wrap, first.filter), ([2, 1], 0));
    let place = Place {
        set: 0,
        matrix: [[2.0, 0.0], [0.0, 3.0]],
        offset: [-0.5, 0.0],
    };
    assert_eq!(first.place, place);
    let second = &instance.lookups[1];
    assert_eq!(
        (second.wrap, second.filter, second.place.set),
        ([0, 0], 1, 1)
    );
    let (sin, cos) = 0.5f64.sin_cos();
    assert_eq!(second.place.matrix, [[cos, sin], [-sin, cos]]);
}

#[test]
fn normal_maps_are_found_through_functions_and_materials() {
    let text = "
        fn bent(texel: vec4, normal: normal, tangent: vector) -> normal =
            normal_map(color(texel.xyz), normal, tangent, scale: 0.5, flip_green: true);
        material mine { param tilt: normal = normal;
            material = open_pbr(geometry_normal: tilt, base_color: color(0.1)); }
        material a { param map: texture = \"n.png\";
            material = mine(tilt: bent(image_data(map, uv), normal, tangent)); }";
    let normal = NormalMap {
        map: texel(Channels::Data, &[1.0; 3]),
        scale: 0.5,
        flip_green: true,
    };
    let expected = [
        ("base_color", numbers(&[0.1; 3])),
        ("geometry_normal", Value::Normal(normal)),
    ];
    assert_eq!(values(&of(text)), expected);
}

#[test]
fn a_normal_map_that_is_turned_over_here_and_there_is_refused() {
    let text = "material a { param map: texture = \"n.png\";
        material = open_pbr(geometry_normal: normal_map(color(image_data(map, uv).xyz), normal, tangent,
            flip_green: uv.x > 0.5)); }";
    assert_eq!(refused(text).len(), 1);
}

#[test]
fn the_color_of_corners_multiplies() {
    let text = "material a { param map: texture = \"a.png\";
        material = open_pbr(base_color: image(map, uv) * vertex_color, coat_color: 0.5 * vertex_color); }";
    let both = Varying {
        has_vertex_color: true,
        ..texel(Channels::Color, &[1.0; 3])
    };
    let alone = Varying {
        texel: None,
        factor: vec![0.5; 3],
        ..both.clone()
    };
    let expected = [
        ("base_color", Value::Varying(both)),
        ("coat_color", Value::Varying(alone)),
    ];
    assert_eq!(values(&of(text)), expected);
}

#[test]
fn everything_else_is_refused_with_its_place_and_all_at_once() {
    let text = "material a { param map: texture = \"a.png\";
let spots = perlin(position / 3 mm);
material = open_pbr(
    base_color: color(spots),
    specular_roughness: sin(uv.x),
    coat_weight: image_data(map, uv).x * image_data(map, uv).y,
    fuzz_weight: image_data(map, 2.0 * uv).x + image_data(map, uv).x,
    fuzz_color: image(map, position.xy),
    coat_color: color(uv.x, 0.0, 0.0),
    geometry_normal: normalize(normal + 0.1 * tangent),
    geometry_tangent: vector(cross(normal, tangent)),
); }";
    let depends = |line: u32, name: &str, what: &str| {
        format!("{line}: `{name}` of `open_pbr` cannot be exported: it depends on {what}")
    };
    let expected = [
        depends(7, "base_color", "`perlin`"),
        depends(8, "specular_roughness", "`sin` of what varies"),
        depends(9, "coat_weight", "a product of texels"),
        depends(10, "fuzz_weight", "a sum of texels"),
        depends(
            11,
            "fuzz_color",
            "a place in a picture that depends on `position`",
        ),
        depends(12, "coat_color", "`uv`"),
    ];
    let refused = refused(text);
    let (first, geometry): (Vec<String>, Vec<String>) = refused
        .into_iter()
        .partition(|problem| !problem.contains("geometry_"));
    let sorted = |mut list: Vec<String>| {
        list.sort();
        list
    };
    assert_eq!(sorted(first), sorted(expected.to_vec()));
    assert_eq!(geometry.len(), 2, "{geometry:?}");
}

#[test]
fn a_branch_on_what_varies_is_refused_and_one_on_a_constant_is_not() {
    let text = |cond: &str| {
        format!(
            "fn f(c: bool, x: float) -> float {{ var y = 0.5; for i in 0 .. 3 {{
                if c {{ break; }} y = y * x; }} y }}
             material a {{ material = open_pbr(coat_weight: f({cond}, 0.5)); }}"
        )
    };
    assert_eq!(
        values(&of(&text("true"))),
        [("coat_weight", numbers(&[0.5]))]
    );
    assert_eq!(
        values(&of(&text("1 > 2"))),
        [("coat_weight", numbers(&[0.0625]))]
    );
    assert_eq!(refused(&text("uv.x > 0.5")).len(), 1);
}

#[test]
fn a_material_that_is_no_call_of_a_model_is_told_what_is_expected() {
    let closures = "use std::bsdf::diffuse;\nmaterial a { surface = diffuse(0.5); }";
    assert_eq!(
        refused(closures),
        ["5: `a` is not one call of a surface model"]
    );
    let parts = "material a { let m = open_pbr(); surface = m.surface; }";
    assert_eq!(refused(parts).len(), 1);
    let two = "material a { param c: bool = true;
        material = if c { open_pbr() } else { gltf_pbr() }; }";
    assert_eq!(refused(two).len(), 1);
}

#[test]
fn errors_of_the_material_itself_are_told_as_the_compiler_tells_them() {
    let found = found("material a { material = open_pbr(base_colour: 1.0); }", &[]);
    assert_eq!(found.instance, None);
    assert_eq!(found.diagnostics[0].code, Code::UnknownArgument);
}

#[test]
fn endless_work_ends_in_an_error() {
    let text = "
        fn f(x: float) -> float { var y = x; for i in 0 .. 60000 { y = y * 0.999 + x; } y }
        fn g(x: float) -> float { var y = x; for i in 0 .. 60000 { y = f(y); } y }
        fn h(x: float) -> float { var y = x; for i in 0 .. 60000 { y = g(y); } y }
        material a { material = open_pbr(coat_weight: h(uv.x)); }";
    // The checker bounds nested loops; what it lets pass ends here.
    let found = found(text, &[]);
    assert_eq!(found.instance, None);
    let long: Vec<String> = (1..400)
        .map(|n| format!("fn f{n}(x: float) -> float = 0.5 + 0.5 * f{}(x);", n - 1))
        .collect();
    let deep = format!(
        "fn f0(x: float) -> float = x;\n{}\nmaterial a {{ material = open_pbr(coat_weight: f399(0.5)); }}",
        long.join("\n")
    );
    let problems = refused(&deep);
    assert!(problems[0].contains("too deep"), "{problems:?}");
}
