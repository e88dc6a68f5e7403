//! Instances of models as documents, and what these are when they are imported again.

use std::collections::BTreeMap;
use std::path::Path;

use impasto_compiler::diag::{self, Code};
use impasto_compiler::inspect::{Precision, Query, Shown, inspect};
use impasto_compiler::instance::{Instance, NormalMap, Value, Varying, instance};
use impasto_compiler::interface::{ParamInterface, interface};
use impasto_compiler::{Loader, MaterialRequest, MemoryLoader, ParameterValue};
use impasto_import::{MemoryFiles, Options, import, to_materialx};

use crate::common::{Disk, documents};

/// Models that MaterialX has, too.
const MODELS: [&str; 4] = [
    "standard_surface",
    "open_pbr",
    "gltf_pbr",
    "disney_principled",
];

/// Parameters that no node of MaterialX 1.39 has.
const LACKING: [&str; 4] = ["diffTrans", "flatness", "scatterDistance", "thin"];

/// The instance that a material of a source is.
fn of(text: &str, name: &str) -> Result<Instance, (Vec<Code>, String)> {
    let mut loader = MemoryLoader::default();
    loader.add("m.impasto", text);
    let request = MaterialRequest {
        material: Some(name.into()),
        ..MaterialRequest::new(name, "m.impasto")
    };
    let found = instance(&request, &mut loader);
    found.instance.ok_or_else(|| {
        let codes = found.diagnostics.iter().map(|d| d.code).collect();
        let text = diag::render::text(&found.sources, &found.diagnostics, false);
        (codes, text)
    })
}

/// A document of an instance.
#[track_caller]
fn document(instance: &Instance) -> String {
    let exported = to_materialx(instance, &instance.pictures);
    let exported = exported.unwrap_or_else(|problems| panic!("{problems:#?}"));
    assert_eq!(exported.warnings, [""; 0]);
    exported.text
}

/// The source that a document becomes again.
#[track_caller]
fn imported(document: &str, unchecked: bool) -> String {
    let mut files = MemoryFiles::default();
    files.add("d.mtlx", document);
    let options = Options {
        unchecked,
        ..Options::default()
    };
    let imported = import("d.mtlx", &mut files, &options);
    let mut imported = imported.unwrap_or_else(|errors| panic!("{document}\n{}", errors[0]));
    let missing = |warning: &str| warning.contains(".png");
    for warning in &imported.warnings {
        assert!(missing(&warning.message), "{document}\n{warning}");
    }
    imported.files.remove(0).1
}

/// An instance without places, in single precision, with pictures in the order in which arguments read them.
fn comparable(instance: &Instance) -> String {
    let single = |numbers: &[f64]| {
        let short = numbers.iter().map(|x| format!("{:.5e}", *x as f32 + 0.0));
        short.collect::<Vec<_>>().join(" ")
    };
    let varying = |v: &Varying| {
        let texel = v.texel.map(|texel| {
            let lookup = &instance.lookups[texel.lookup];
            let file = Path::new(&instance.pictures[lookup.picture]).file_name();
            let place = &lookup.place;
            let matrix = single(&place.matrix.concat());
            let offset = single(&place.offset);
            format!(
                "{:?} {file:?} uv{} {matrix} {offset} {:?} {}",
                texel.channels, place.set, lookup.wrap, lookup.filter
            )
        });
        let (offset, factor) = (single(&v.offset), single(&v.factor));
        format!("{offset} + {factor} * {texel:?} {}", v.has_vertex_color)
    };
    let value = |value: &Value| match value {
        Value::Numbers(numbers) => single(numbers),
        Value::Varying(v) => varying(v),
        Value::Normal(NormalMap {
            map,
            scale,
            flip_green,
        }) => {
            // MaterialX has no word for it: the map itself is turned over.
            let mut map = map.clone();
            if *flip_green {
                map.factor[1] *= -1.0;
                map.offset[1] = 1.0 - map.offset[1];
            }
            format!("{} {}", varying(&map), single(&[*scale]))
        }
        other => format!("{other:?}"),
    };
    let arguments = instance.arguments.iter();
    let arguments = arguments.map(|a| format!("{}: {}\n", a.name, value(&a.value)));
    format!("{}\n{}", instance.model, arguments.collect::<String>())
}

/// Exports a material and imports it again: the arguments are the same. Gives the second source.
#[track_caller]
fn round(text: &str, name: &str) -> String {
    let first = of(text, name).unwrap_or_else(|(_, problem)| panic!("{problem}"));
    let document = document(&first);
    let second_text = imported(&document, true);
    let second = of(&second_text, name);
    let second =
        second.unwrap_or_else(|(_, problem)| panic!("{document}\n{second_text}\n{problem}"));
    assert_eq!(
        comparable(&first),
        comparable(&second),
        "{document}\n{second_text}"
    );
    second_text
}

/// What a material answers in double precision at a few points, by name. The inside is not there where nothing enters.
fn answers(text: &str, name: &str) -> BTreeMap<String, Vec<f64>> {
    let mut loader = MemoryLoader::default();
    loader.add("m.impasto", text);
    let points = [
        "wo=(0.6, 0, 0.8), wi=(0, 0.6, 0.8), uv=(0.3, 0.7)",
        "wo=(0.1, 0.7, 0.7), wi=(-0.5, -0.1, 0.8), uv=(0.9, 0.2)",
    ];
    let mut answers: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for at in points {
        let query = Query {
            file: "m.impasto".into(),
            item: Some(name.into()),
            params: Vec::new(),
            at: at.parse().expect("a point"),
            precisions: vec![Precision::F64],
        };
        let found = inspect(&query, &mut loader).expect("a file");
        let problems = diag::render::text(&found.sources, &found.diagnostics, false);
        assert!(!diag::has_errors(&found.diagnostics), "{text}\n{problems}");
        let results = &found.answers[0].results[0];
        let mut push = |name: &str, shown: &Shown| {
            numbers(shown, answers.entry(name.to_owned()).or_default());
        };
        let surface = results.surface.as_ref().expect("a surface");
        push("albedo", &surface.albedo);
        push("toward", &surface.toward.value);
        push("pdf", &surface.toward.pdf);
        // What emits nothing emits black.
        let black = Shown::Vector(vec![0.0; 3]);
        push("emission", results.emission.as_ref().unwrap_or(&black));
        let outputs = results.outputs.iter();
        outputs.for_each(|named| push(&named.name, &named.value));
    }
    answers
}

fn numbers(shown: &Shown, found: &mut Vec<f64>) {
    match shown {
        Shown::Float(x) => found.push(*x),
        Shown::Vector(v) => found.extend(v),
        Shown::Fields(fields) => fields.iter().for_each(|(_, field)| numbers(field, found)),
        _ => {}
    }
}

/// Exports, imports and evaluates: both sources answer the same.
#[track_caller]
fn answers_the_same(text: &str, name: &str) {
    let second = round(text, name);
    let (a, b) = (answers(text, name), answers(&second, name));
    for key in ["albedo", "toward", "pdf", "emission"] {
        assert!(a.contains_key(key) && b.contains_key(key), "{key}");
    }
    for (key, a) in &a {
        let Some(b) = b.get(key) else { continue };
        assert_eq!(a.len(), b.len(), "{key}\n{text}\n{second}");
        for (x, y) in a.iter().zip(b) {
            let close = (x - y).abs() <= 1e-5 * (x.abs() + y.abs()) + 1e-9;
            assert!(close, "{key}: {x} is {y} after the round\n{text}\n{second}");
        }
    }
}

/// The parameters of a model that its node has.
fn params(model: &str) -> Vec<ParamInterface> {
    let mut params = all_params(model);
    params.retain(|param| model != "disney_principled" || !LACKING.contains(&&*param.name));
    params
}

fn all_params(model: &str) -> Vec<ParamInterface> {
    let found = interface(
        &format!("std::surface::{model}"),
        &mut MemoryLoader::default(),
    );
    let own = found.materials.into_iter().find(|m| m.name == model);
    own.expect("a model").params
}

/// A constant other than the default of a parameter, as a source has it.
fn constant(param: &ParamInterface) -> Option<String> {
    let (low, high) = param
        .hard
        .map_or((0.0, 1.0), |[low, high]| (low, high.min(low + 3.0)));
    let inside = |share: f32| low + share * (high - low);
    Some(match param.ty.as_str() {
        "bool" => (param.default_text != "true").to_string(),
        "int" => "1".into(),
        "float" => format!("{:?}", inside(0.37)),
        "color" => "color(0.2, 0.4, 0.7)".into(),
        "length" => match param.unit.map(|unit| unit.name) {
            Some(unit @ ("nm" | "um")) => format!("{:?} {unit}", 137.5),
            _ => "12.5 mm".into(),
        },
        "angle" => "40 deg".into(),
        // Its default is the surface's own.
        _ => return None,
    })
}

/// A picture for a parameter.
fn picture(param: &ParamInterface) -> Option<String> {
    Some(match param.ty.as_str() {
        "float" => "0.5 * image_data(map, uv * 2.0).y".into(),
        "color" => "color(0.5, 0.25, 1.0) * image(map, uv)".into(),
        "length" => match param.unit.map(|unit| unit.name) {
            Some(unit @ ("nm" | "um")) => format!("image_data(map, uv).x * 500 {unit}"),
            _ => "image_data(map, uv).x * 2 cm".into(),
        },
        "angle" => "image_data(map, uv).x * 30 deg".into(),
        "normal" => {
            "normal_map(color(image_data(map, uv).xyz), normal, tangent, scale: 0.7)".into()
        }
        _ => return None,
    })
}

fn source(model: &str, arguments: &str) -> String {
    let uses = format!("use std::surface::{model};\n");
    let map = if arguments.contains("map") {
        "param map: texture = \"a.png\";"
    } else {
        ""
    };
    let bent = if arguments.contains("normal_map") {
        "use std::pattern::normal_map;\n"
    } else {
        ""
    };
    format!("{bent}{uses}material glaze {{ {map} material = {model}({arguments}); }}")
}

#[test]
fn every_parameter_of_every_model_comes_back_as_a_constant() {
    for model in MODELS {
        for param in params(model) {
            let Some(value) = constant(&param) else {
                continue;
            };
            let text = source(model, &format!("{}: {value}", param.name));
            let instance = of(&text, "glaze").unwrap_or_else(|(_, problem)| panic!("{problem}"));
            assert_eq!(instance.arguments.len(), 1, "{text}");
            round(&text, "glaze");
        }
    }
}

#[test]
fn every_parameter_of_every_model_comes_back_as_a_picture() {
    let mut media = Vec::new();
    for model in MODELS {
        for param in params(model) {
            let Some(value) = picture(&param) else {
                continue;
            };
            let text = source(model, &format!("{}: {value}", param.name));
            match of(&text, "glaze") {
                // What fills an object does not vary over its surface.
                Err((codes, _)) if codes == [Code::VaryingMedium] => media.push(param.name),
                _ => drop(round(&text, "glaze")),
            }
        }
    }
    assert!(media.len() < 5, "{media:?}");
    for weight in ["transmission", "transmission_weight", "specTrans"] {
        assert!(!media.iter().any(|name| name == weight), "{weight}");
    }
}

#[test]
fn a_model_is_an_instance_of_itself() {
    let request = MaterialRequest {
        params: vec![("coat_weight".into(), ParameterValue::Float(0.5))],
        ..MaterialRequest::new("open_pbr", "std::surface::open_pbr")
    };
    let found = instance(&request, &mut MemoryLoader::default());
    let instance = found.instance.expect("an instance");
    assert_eq!(instance.model, "open_pbr");
    let text = document(&instance);
    assert!(
        text.contains("<input name=\"coat_weight\" type=\"float\" value=\"0.5\" />"),
        "{text}"
    );
    assert_eq!(text.matches("<input").count(), 2, "{text}");
    imported(&text, false);
}

#[test]
fn all_parameters_together_answer_the_same() {
    for model in MODELS {
        let all = params(model);
        let values = all
            .iter()
            .filter_map(|p| Some(format!("{}: {}", p.name, constant(p)?)));
        let arguments: Vec<String> = values.collect();
        answers_the_same(&source(model, &arguments.join(", ")), "glaze");
    }
}

/// Lookups of all kinds.
const LOOKUPS: [&str; 14] = [
    "base_color: image(map, uv1)",
    "base_color: image(map, uv, wrap: CLAMP)",
    "base_color: image(map, uv * vec2(2.0, 4.0) - vec2(0.25, 0.5), wrap_u: MIRROR, wrap_v: BORDER)",
    "base_color: image(map, uv1 * 2.0 + vec2(0.5, 0.0), filter: NEAREST)",
    "base_color: image(map, vec2(0.8 * uv.x + 0.6 * uv.y, 0.5 - uv.x), filter: BICUBIC)",
    "base_color: image(map, vec2(1.0 - uv.x, uv.y))",
    "base_color: color(image_data(map, uv).xyz)",
    "base_color: color(image_data(map, uv).w)",
    "base_color: color(0.5, 0.25, 0.1) * image(map, uv).g",
    "base_color: color(0.5, 0.25, 0.1) * image(map, uv) * vertex_color",
    "base_color: 0.7 * vertex_color",
    "base_color: color(0.2) + 0.5 * image(map, uv)",
    "specular_roughness: image_alpha(map, uv), base_metalness: image_data(map, uv).z, coat_weight: image(map, uv).r",
    "geometry_normal: normal_map(color(image_data(map, uv).xyz), normal, tangent, flip_green: true)",
];

#[test]
fn lookups_come_back_with_places_channels_and_modes() {
    for arguments in LOOKUPS {
        answers_the_same(&source("open_pbr", arguments), "glaze");
    }
}

#[test]
fn materials_of_the_folder_come_back_where_they_are_instances() {
    /// Files of the folder.
    struct Folder;
    impl Loader for Folder {
        fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
            std::fs::read(path).map_err(|error| error.to_string())
        }
    }
    let entries = std::fs::read_dir("../materials").expect("materials");
    let mut exported = Vec::new();
    for entry in entries.flatten() {
        let path = entry.path();
        let Some(name) = path.file_stem().and_then(|stem| stem.to_str()) else {
            continue;
        };
        if path.extension().is_none_or(|e| e != "impasto") {
            continue;
        }
        let file = path.display().to_string();
        let found = instance(&MaterialRequest::new(name, &file), &mut Folder);
        match found.instance {
            Some(_) => {
                let text = std::fs::read_to_string(&path).expect("a source");
                answers_the_same(&text, name);
                exported.push(name.to_owned());
            }
            // The others say why, and nothing else is wrong.
            None => {
                let errors = found.diagnostics.iter().filter(|d| d.is_error());
                let known = [Code::NotExported, Code::NoMaterial];
                errors.for_each(|d| assert!(known.contains(&d.code), "{file}: {}", d.message));
            }
        }
    }
    exported.sort();
    assert_eq!(exported, ["open_pbr_carpaint", "principled"]);
}

#[test]
fn documents_come_back_where_they_are_instances() {
    let (mut count, mut refused) = (0, 0);
    for path in documents("documents") {
        let path = path.display().to_string();
        let imported = import(&path, &mut Disk, &Options::default());
        let Ok(imported) = imported else { continue };
        let text = &imported.files[0].1;
        for (name, _) in &imported.materials {
            match of(text, name) {
                Ok(_) => {
                    round(text, name);
                    count += 1;
                }
                Err((codes, problem)) => {
                    let is_known = |code: &Code| *code == Code::NotExported;
                    assert!(codes.iter().all(is_known), "{path}: {problem}");
                    refused += 1;
                }
            }
        }
    }
    // The documents are there for nodes of all kinds, most of which are no pictures.
    assert!(
        count >= 1 && refused >= 3,
        "{count} came back, {refused} did not"
    );
}

/// Pictures as other programs write them.
const PICTURES: &str = r#"<materialx version="1.39" colorspace="lin_rec709">
  <gltf_colorimage name="base" type="multioutput">
    <input name="file" type="filename" value="a.png" colorspace="srgb_texture"/>
    <input name="color" type="color4" value="0.5, 0.25, 1, 0.75"/>
    <output name="outcolor" type="color3"/><output name="outa" type="float"/>
  </gltf_colorimage>
  <gltf_image name="rough" type="float">
    <input name="file" type="filename" value="b.png"/>
    <input name="factor" type="float" value="0.5"/>
    <input name="scale" type="vector2" value="0.5, 0.25"/>
    <input name="rotate" type="float" value="30"/>
  </gltf_image>
  <gltf_normalmap name="bent" type="vector3"><input name="file" type="filename" value="n.png"/></gltf_normalmap>
  <gltf_iridescence_thickness name="film" type="float">
    <input name="file" type="filename" value="b.png"/>
    <input name="thicknessMin" type="float" value="120"/>
  </gltf_iridescence_thickness>
  <place2d name="placed" type="vector2">
    <input name="texcoord" type="vector2" nodename="st"/>
    <input name="scale" type="vector2" value="2, 0.5"/><input name="rotate" type="float" value="15"/>
  </place2d>
  <texcoord name="st" type="vector2"/>
  <image name="orm" type="vector3">
    <input name="file" type="filename" value="orm.png"/>
    <input name="texcoord" type="vector2" nodename="placed"/>
    <input name="uaddressmode" type="string" value="mirror"/>
  </image>
  <extract name="metal" type="float">
    <input name="in" type="vector3" nodename="orm"/><input name="index" type="integer" value="2"/>
  </extract>
  <UsdUVTexture name="usd" type="multioutput">
    <input name="file" type="filename" value="c.png"/><input name="scale" type="color4" value="0.5, 0.5, 0.5, 1"/>
  </UsdUVTexture>
  <tiledimage name="sheen" type="color3">
    <input name="file" type="filename" value="d.png" colorspace="lin_rec709"/>
    <input name="uvtiling" type="vector2" value="3, 2"/><input name="uvoffset" type="vector2" value="0.5, 0"/>
  </tiledimage>
  <gltf_pbr name="shader" type="surfaceshader">
    <input name="base_color" type="color3" nodename="base" output="outcolor"/>
    <input name="alpha" type="float" nodename="base" output="outa"/>
    <input name="alpha_mode" type="integer" value="2"/>
    <input name="metallic" type="float" nodename="metal"/>
    <input name="roughness" type="float" nodename="rough"/>
    <input name="normal" type="vector3" nodename="bent"/>
    <input name="iridescence" type="float" value="1"/>
    <input name="iridescence_thickness" type="float" nodename="film"/>
    <input name="clearcoat" type="float" nodename="usd" output="g"/>
    <input name="sheen_color" type="color3" nodename="sheen"/>
  </gltf_pbr>
  <surfacematerial name="glaze" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="shader"/>
  </surfacematerial>
</materialx>"#;

#[test]
fn pictures_of_other_programs_come_back() {
    let text = imported(PICTURES, false);
    let instance = of(&text, "glaze").unwrap_or_else(|(_, problem)| panic!("{text}\n{problem}"));
    assert_eq!(instance.arguments.len(), 10, "{text}");
    answers_the_same(&text, "glaze");
}

/// A document as it is exported, to be read.
#[test]
fn a_document_is_as_a_person_would_write_it() {
    let text = "use std::surface::standard_surface;
        use std::pattern::normal_map;
        material worn_paint {
            param color_map: texture = \"textures/a & b.png\";
            param rough_map: texture = \"textures/rough.png\";
            param bumps: texture = \"textures/n.exr\";
            material = standard_surface(
                base_color: color(0.5, 1.0, 1.0) * image(color_map, 4.0 * uv),
                specular_roughness: image_data(rough_map, uv).y,
                thin_film_thickness: 420 nm,
                thin_walled: true,
                normal: normal_map(color(image_data(bumps, uv).xyz), normal, tangent, scale: 0.5),
            );
        }";
    let instance = of(text, "worn_paint").expect("an instance");
    insta::assert_snapshot!("exported", document(&instance));
}

#[test]
fn a_model_that_materialx_lacks_is_refused() {
    let mut instance = of(&source("open_pbr", ""), "glaze").expect("an instance");
    instance.model = "lacquer".into();
    let refused = to_materialx(&instance, &[]).expect_err("no such node");
    assert_eq!(refused[0].message, "MaterialX has no node for `lacquer`");
    let expected = refused[0].expected.as_deref().unwrap_or_default();
    assert!(
        expected.contains("`open_pbr`") && !expected.contains("usd"),
        "{expected}"
    );
}

#[test]
fn what_disneys_node_lacks_is_refused() {
    let mut refused = Vec::new();
    for param in all_params("disney_principled") {
        let Some(value) = constant(&param) else {
            continue;
        };
        let text = source("disney_principled", &format!("{}: {value}", param.name));
        let instance = of(&text, "glaze").unwrap_or_else(|(_, problem)| panic!("{problem}"));
        if let Err(problems) = to_materialx(&instance, &[]) {
            assert!(problems[0].message.contains("has no input of this name"));
            refused.push(param.name);
        }
    }
    refused.sort();
    assert_eq!(refused, LACKING);
}

#[test]
fn an_input_that_the_node_lacks_is_refused_by_its_name() {
    let mut instance = of(&source("open_pbr", "base_weight: 0.5"), "glaze").expect("an instance");
    instance.arguments[0].name = "base_wait".into();
    let refused = to_materialx(&instance, &[]).expect_err("no such input");
    assert!(refused[0].message.contains("`base_wait` of `open_pbr`"));
    assert!(refused[0].span.is_some());
}
