//! Instances as glTF files, and what these are when they are read again.

use std::path::Path;

use impasto_compiler::diag;
use impasto_compiler::instance::{Exported, Instance, Value, Varying, instance};
use impasto_compiler::interface::{ParamInterface, interface};
use impasto_compiler::{MaterialRequest, MemoryLoader};
use serde_json::Value as Json;

use super::to_gltf;
use crate::input::gltf::rows::{Channel, Kind, OTHERS, ROWS};
use crate::input::gltf::{Choice, Model};

/// The instance that a material is.
#[track_caller]
fn of(text: &str) -> Instance {
    let mut loader = MemoryLoader::default();
    loader.add("m.impasto", text);
    let found = instance(&MaterialRequest::new("m", "m.impasto"), &mut loader);
    let problems = diag::render::text(&found.sources, &found.diagnostics, false);
    found
        .instance
        .unwrap_or_else(|| panic!("{text}\n{problems}"))
}

fn source(arguments: &str) -> String {
    format!(
        "use std::pattern::normal_map;
        use std::surface::gltf_pbr;
        material m {{
            param map: texture = \"a.png\";
            param other: texture = \"b.jpg\";
            let texel = image_data(map, uv);
            let _used = normal_map(color(image_data(other, uv).xyz), normal, tangent);
            let _texel = texel.x;
            material = gltf_pbr({arguments});
        }}"
    )
}

#[track_caller]
fn exported(instance: &Instance) -> Exported {
    let exported = to_gltf(instance, &instance.pictures);
    exported.unwrap_or_else(|problems| panic!("{problems:#?}"))
}

/// The source that a file becomes, with the path of its own pictures instead of `images/N`.
fn read_again(text: &str) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("m.gltf");
    std::fs::write(&path, text).expect("a file");
    let model = Model::read(&path, &Choice::default()).unwrap_or_else(|e| panic!("{text}\n{e}"));
    let name = &model.source_names[0];
    let mut source = model.source(name).expect("a source");
    let json: Json = serde_json::from_str(text).expect("JSON");
    for (number, image) in json["images"].as_array().into_iter().flatten().enumerate() {
        let uri = image["uri"].as_str().unwrap_or_default();
        source = source.replace(&format!("\"images/{number}\""), &format!("\"{uri}\""));
    }
    source
}

/// What an instance gives, in single precision, without places in the source.
fn comparable(instance: &Instance) -> String {
    let joined = |texts: Vec<String>| texts.join(" ");
    let single = |numbers: &[f64]| {
        let short = numbers.iter().map(|x| format!("{:.4e}", *x as f32 + 0.0));
        joined(short.collect())
    };
    // Places are about 1, and a right angle has a cosine that is not quite nothing.
    let rounded = |numbers: &[f64]| {
        let short = numbers
            .iter()
            .map(|x| format!("{:.4}", (x * 1e4).round() / 1e4 + 0.0));
        joined(short.collect())
    };
    let varying = |v: &Varying| {
        let texel = v.texel.map(|texel| {
            let lookup = &instance.lookups[texel.lookup];
            let file = Path::new(&instance.pictures[lookup.picture]).file_name();
            let (matrix, offset) = (
                rounded(&lookup.place.matrix.concat()),
                rounded(&lookup.place.offset),
            );
            let (channels, set, wrap) = (texel.channels, lookup.place.set, lookup.wrap);
            format!("{channels:?} {file:?} uv{set} {matrix} {offset} {wrap:?}")
        });
        format!("{} + {} {texel:?}", single(&v.offset), single(&v.factor))
    };
    let value = |value: &Value| match value {
        Value::Numbers(numbers) => single(numbers),
        Value::Varying(v) => varying(v),
        Value::Normal(n) => format!("{} {:.4e} {}", varying(&n.map), n.scale, n.flip_green),
        other => format!("{other:?}"),
    };
    let arguments = instance.arguments.iter();
    let lines = arguments.map(|a| format!("{}: {}\n", a.name, value(&a.value)));
    lines.collect()
}

/// Exports, reads and exports again: the arguments are the same, and so is the file.
#[track_caller]
fn round(arguments: &str) -> Json {
    let first = of(&source(arguments));
    let file = exported(&first);
    let text = read_again(&file.text);
    let second = of(&text);
    assert_eq!(
        comparable(&first),
        comparable(&second),
        "{}\n{text}",
        file.text
    );
    serde_json::from_str(&file.text).expect("JSON")
}

/// What is said against arguments.
#[track_caller]
fn refused(arguments: &str) -> Vec<String> {
    let instance = of(&source(arguments));
    let refused = to_gltf(&instance, &instance.pictures).expect_err(arguments);
    assert!(refused.iter().all(|d| d.span.is_some()));
    refused.into_iter().map(|d| d.message).collect()
}

fn params() -> Vec<ParamInterface> {
    let found = interface("std::surface::gltf_pbr", &mut MemoryLoader::default());
    let own = found.materials.into_iter().find(|m| m.name == "gltf_pbr");
    own.expect("the model").params
}

#[test]
fn the_table_and_its_exceptions_are_all_parameters_of_the_model() {
    let mut known: Vec<&str> = ROWS.iter().map(|row| row.name).chain(OTHERS).collect();
    known.sort_unstable();
    let params = params();
    let mut own: Vec<&str> = params.iter().map(|p| p.name.as_str()).collect();
    own.sort_unstable();
    assert_eq!(known, own);
}

#[test]
fn every_parameter_comes_back_as_a_constant() {
    for row in ROWS {
        if row
            .map
            .is_some_and(|(_, channel)| channel == Channel::Normal)
        {
            continue;
        }
        let value = match row.kind {
            Kind::Color | Kind::Tint => "color(0.2, 0.4, 0.7)",
            Kind::Share => "0.35",
            Kind::Float => "1.75",
            Kind::Meters => "12.5 mm",
            Kind::Nanometers => "250 nm",
            Kind::Radians => "40 deg",
        };
        let json = round(&format!(
            "iridescence_thickness: 137 nm, {}: {value}",
            row.name
        ));
        let has_extension = json["extensionsUsed"]
            .as_array()
            .is_some_and(|e| e.len() > 1);
        let is_extension =
            row.of != super::FILM && matches!(row.of, crate::input::gltf::rows::Of::Extension(_));
        assert_eq!(has_extension, is_extension, "{json:#}");
    }
}

#[test]
fn every_parameter_comes_back_as_a_picture_where_gltf_has_one() {
    for row in ROWS {
        let argument = match row.map.map(|(_, channel)| channel) {
            None => {
                let picture = if row.kind == Kind::Color {
                    "image(map, uv)"
                } else {
                    "texel.x"
                };
                let picture = match row.kind {
                    Kind::Meters => format!("{picture} * 1 m"),
                    Kind::Radians => format!("{picture} * 1 rad"),
                    _ => picture.to_owned(),
                };
                // What fills an object does not vary at all.
                if ![
                    "ior",
                    "attenuation_distance",
                    "attenuation_color",
                    "thickness",
                    "dispersion",
                ]
                .contains(&row.name)
                {
                    let said = refused(&format!("{}: {picture}", row.name));
                    assert!(said[0].contains("glTF has no picture there"), "{said:?}");
                }
                continue;
            }
            Some(Channel::Color) => "color(0.5, 0.25, 1.0) * image(map, uv)".to_owned(),
            Some(Channel::Normal) => {
                "normal_map(color(texel.xyz), normal, tangent, scale: 0.7)".to_owned()
            }
            Some(Channel::Alpha) => "0.5 * image_alpha(map, uv)".to_owned(),
            Some(Channel::Red) => "0.5 * texel.x".to_owned(),
            Some(Channel::Green) => "0.5 * texel.y".to_owned(),
            Some(Channel::Blue) => "0.5 * texel.z".to_owned(),
        };
        // Both in one picture.
        let other = match row.name {
            "roughness" => ", metallic: texel.z",
            "metallic" => ", roughness: texel.y",
            _ => "",
        };
        round(&format!("{}: {argument}{other}", row.name));
    }
}

#[test]
fn a_film_is_between_two_thicknesses() {
    let json = round("iridescence: 1.0, iridescence_thickness: mix(120 nm, 480 nm, texel.y)");
    let film = &json["materials"][0]["extensions"]["KHR_materials_iridescence"];
    assert_eq!(film["iridescenceThicknessMinimum"], 120.0);
    assert_eq!(film["iridescenceThicknessMaximum"], 480.0);
    // The default of glTF is 400.
    let json = round("iridescence: 1.0, iridescence_thickness: 100 nm, iridescence_ior: 1.4");
    let film = &json["materials"][0]["extensions"]["KHR_materials_iridescence"];
    assert_eq!(film["iridescenceThicknessMaximum"], 100.0);
    assert_eq!(
        refused("iridescence_thickness: mix(120 nm, 480 nm, texel.x)").len(),
        1
    );
}

#[test]
fn pictures_have_places_wraps_and_sets() {
    let places = [
        "uv1",
        "uv * vec2(2.0, 4.0) + vec2(0.25, 0.5)",
        "uv1 * -2.0",
        "vec2(1.0 - uv.x, uv.y)",
        "vec2(uv.y, uv.x)",
        "vec2(0.8 * uv.x + 0.6 * uv.y, 0.8 * uv.y - 0.6 * uv.x + 0.1)",
        "uv, wrap: CLAMP",
        "uv, wrap_u: MIRROR",
    ];
    for place in places {
        round(&format!("base_color: image(map, {place})"));
    }
    let json = round(
        "base_color: image(map, uv), emissive: image(map, uv), specular_color: image(map, uv1)",
    );
    assert_eq!(json["textures"].as_array().map(Vec::len), Some(1));
    assert_eq!(json["images"].as_array().map(Vec::len), Some(1));
    let lacking = [
        ("uv, wrap: BORDER", "BORDER"),
        ("uv, filter: BICUBIC", "BICUBIC"),
        ("vec2(uv.x + uv.y, uv.y)", "shear"),
    ];
    for (place, word) in lacking {
        let said = refused(&format!("base_color: image(map, {place})"));
        assert!(said.len() == 1 && said[0].contains(word), "{said:?}");
    }
}

#[test]
fn a_picture_that_two_share_has_both_or_nothing() {
    round("metallic: 0.5 * texel.z, roughness: texel.y");
    round("metallic: 0.0, roughness: texel.y");
    round("metallic: texel.z, roughness: 0.0");
    let cases = [
        // Metallic is 1 by default.
        ("roughness: texel.y", "multiplies `metallic`"),
        (
            "roughness: 0.5, metallic: texel.z",
            "multiplies `roughness`",
        ),
        (
            "metallic: 0.0, roughness: texel.x",
            "green of `metallicRoughnessTexture`",
        ),
        (
            "metallic: image_data(other, uv).z, roughness: texel.y",
            "multiplies",
        ),
    ];
    for (arguments, words) in cases {
        let said = refused(arguments);
        assert!(
            said.iter().any(|s| s.contains(words)),
            "{arguments}: {said:?}"
        );
    }
}

#[test]
fn alpha_is_that_of_the_base_colors_picture() {
    let json = round(
        "base_color: color(0.5) * image(map, uv), alpha: 0.25 * image_alpha(map, uv), alpha_mode: 2",
    );
    let material = &json["materials"][0];
    assert_eq!(material["alphaMode"], "BLEND");
    assert_eq!(
        material["pbrMetallicRoughness"]["baseColorFactor"],
        serde_json::json!([0.5, 0.5, 0.5, 0.25])
    );
    round("alpha: 0.25, alpha_mode: 2");
    round("alpha: image_alpha(map, uv), base_color: color(0.0), alpha_mode: 1, alpha_cutoff: 0.25");
    // A JPEG is opaque: its alpha changes nothing.
    let opaque = exported(&of(&source(
        "base_color: image(other, uv), alpha: 0.5, alpha_mode: 1",
    )));
    assert!(opaque.text.contains("0.5"), "{}", opaque.text);
    let cases = [
        "base_color: image(map, uv), alpha_mode: 2",
        "base_color: image(map, uv), alpha: 0.5, alpha_mode: 1",
        "alpha: image_alpha(map, uv), alpha_mode: 2",
        "base_color: image(map, uv), alpha: texel.x, alpha_mode: 2",
    ];
    for arguments in cases {
        let said = refused(arguments);
        assert!(
            said.len() == 1 && said[0].contains("alpha"),
            "{arguments}: {said:?}"
        );
    }
    // Opaque is opaque, whatever alpha is.
    assert_eq!(
        exported(&of(&source("alpha: texel.x"))),
        exported(&of(&source("")))
    );
}

#[test]
fn what_gltf_cannot_say_is_refused_all_at_once() {
    let said = refused(
        "emissive: color(2.0, 1.0, 0.0), base_color: color(1.5),
         clearcoat: 0.2 + 0.5 * texel.x,
         normal: normal_map(color(texel.xyz), normal, tangent, flip_green: true),
         specular: image(map, uv).r",
    );
    assert_eq!(said.len(), 5, "{said:#?}");
}

#[test]
fn files_are_pngs_and_jpegs_and_their_names_are_uris() {
    let mut instance = of(&source("base_color: image(map, uv)"));
    let named = |name: &str| to_gltf(&instance, &[name.to_owned(), String::new()]);
    let file = named("textures/a b#.png").expect("a file");
    assert!(
        file.text.contains("\"uri\": \"textures/a%20b%23.png\""),
        "{}",
        file.text
    );
    for name in ["a.exr", "a.<UDIM>.png", "a"] {
        assert!(named(name).is_err(), "{name}");
    }
    instance.model = "open_pbr".into();
    let other = to_gltf(&instance, &[]).expect_err("another model");
    assert_eq!(other[0].message, "`open_pbr` is no model of glTF");
}

#[test]
fn what_differs_is_a_warning() {
    let warnings = |arguments: &str| exported(&of(&source(arguments))).warnings;
    assert!(warnings("base_color: image(map, uv) * vertex_color")[0].contains("COLOR_0"));
    assert!(warnings("occlusion: texel.x")[0].contains("occlusion"));
    assert!(warnings("anisotropy_strength: texel.z")[0].contains("anisotropyTexture"));
    assert_eq!(refused("emissive: image(map, uv) * vertex_color").len(), 1);
}
