//! What glTF files give, and that no byte of them is trusted.

use std::path::{Path, PathBuf};

use glam::{DVec3, Vec2, Vec3};
use serde_json::{Value, json};

use super::{Choice, Model, member};
use crate::error::SceneError;
use crate::scene::formats::{FORMATS, Geometry};
use crate::world;
use crate::world::lights::distant::DistantLight;
use crate::world::lights::sphere::SphereLight;

mod compressed;
pub(super) mod speed;

/// Two triangles of a square in the plane of x and y, with texture coordinates, and a mirrored and moved copy.
pub(super) fn square() -> (Value, Vec<u8>) {
    let mut bytes = Vec::new();
    let positions: [f32; 12] = [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.];
    let uvs: [f32; 8] = [0., 1., 1., 1., 1., 0., 0., 0.];
    let indices: [u16; 6] = [0, 1, 2, 0, 2, 3];
    positions.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
    uvs.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
    indices.iter().for_each(|i| bytes.extend(i.to_le_bytes()));
    let json = json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0, 1] }],
        "nodes": [
            { "mesh": 0 },
            { "mesh": 0, "translation": [5.0, 0.0, 0.0], "scale": [-2.0, 2.0, 2.0] },
        ],
        "meshes": [{ "name": "Square", "primitives": [{
            "attributes": { "POSITION": 0, "TEXCOORD_0": 1 },
            "indices": 2,
            "material": 0,
        }] }],
        "materials": [{
            "name": "Old Paint",
            "pbrMetallicRoughness": { "baseColorFactor": [0.8, 0.2, 0.1, 1.0], "metallicFactor": 0.0 },
        }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
              "min": [0.0, 0.0, 0.0], "max": [1.0, 1.0, 0.0] },
            { "bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2" },
            { "bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 48 },
            { "buffer": 0, "byteOffset": 48, "byteLength": 32 },
            { "buffer": 0, "byteOffset": 80, "byteLength": 12 },
        ],
        "buffers": [{ "byteLength": 92 }],
    });
    (json, bytes)
}

/// A `.glb` of these parts.
pub(super) fn packed(json: &Value, binary: &[u8]) -> Vec<u8> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let length = 12 + 8 + text.len() + 8 + binary.len();
    let mut out = b"glTF".to_vec();
    let word = |out: &mut Vec<u8>, n: usize| out.extend((n as u32).to_le_bytes());
    word(&mut out, 2);
    word(&mut out, length);
    word(&mut out, text.len());
    out.extend(b"JSON");
    out.extend(text);
    word(&mut out, binary.len());
    out.extend(b"BIN\0");
    out.extend(binary);
    out
}

/// A file of these bytes, in a folder of its own.
pub(super) fn file_of(bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("m.glb");
    std::fs::write(&path, bytes).expect("a file");
    (folder, path)
}

/// Saves a file, as if so many seconds ago.
pub(super) fn save(path: &Path, bytes: &[u8], age: u64) {
    std::fs::write(path, bytes).expect("it is written");
    let file = std::fs::File::options().write(true).open(path);
    let then = crate::input::stamp::now() - std::time::Duration::from_secs(age);
    let file = file.expect("it is there");
    file.set_modified(then).expect("it has a time");
}

pub(super) fn read(path: &Path) -> Result<Geometry, SceneError> {
    read_at(path, 0.0)
}

pub(super) fn read_at(path: &Path, seconds: f64) -> Result<Geometry, SceneError> {
    let format = FORMATS.iter().find(|f| f.name == "glTF").expect("a row");
    (format.read)(path.parent().expect("a folder"), "m.glb", seconds)
}

fn geometry_of(bytes: Vec<u8>) -> Result<Geometry, SceneError> {
    let (_folder, path) = file_of(&bytes);
    read(&path)
}

fn of_json(change: impl Fn(&mut Value)) -> Result<Geometry, SceneError> {
    let (mut json, binary) = square();
    change(&mut json);
    geometry_of(packed(&json, &binary))
}

fn source_of(material: Value) -> String {
    let (mut json, binary) = square();
    json["materials"][0] = material;
    json["images"] = json!([{ "uri": "a.png" }, { "uri": "b.png" }]);
    json["samplers"] = json!([{ "wrapS": 33071, "wrapT": 33648 }]);
    json["textures"] = json!([{ "source": 0 }, { "source": 1, "sampler": 0 }]);
    let (_folder, path) = file_of(&packed(&json, &binary));
    let model = Model::read(&path, &Choice::default()).unwrap_or_else(|e| panic!("{e}"));
    model.source(&model.source_names[0]).expect("a source")
}

/// Does the source compile?
#[track_caller]
fn assert_compiles(source: &str) {
    use impasto_compiler::{MaterialRequest, MemoryLoader, compile, diag};
    let mut loader = MemoryLoader::default();
    loader.add("m.impasto", source);
    let compiled = compile(&[MaterialRequest::new("m", "m.impasto")], &mut loader);
    let text = diag::render::text(&compiled.sources, &compiled.diagnostics, false);
    assert_eq!(text, "", "{source}");
}

#[test]
fn nodes_put_meshes_where_they_are() {
    let all = of_json(|_| {}).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(all.triangles.len(), 4);
    let [first, .., last] = &all.triangles[..] else {
        panic!("four triangles")
    };
    assert_eq!(
        first.positions,
        [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0)]
    );
    // v goes up here.
    assert_eq!(first.uvs, Some([Vec2::ZERO, Vec2::X, Vec2::ONE]));
    // The mirror image has its outside outside.
    let corners = [[5.0, 0.0], [5.0, 2.0], [3.0, 2.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
    assert_eq!(last.positions, corners);
    let names: Vec<&str> = all.parts.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["Square", "Square"]);
    assert_eq!(all.materials[0].name, "Old Paint");
}

#[test]
fn modes_give_the_same_square() {
    let expected: Vec<_> = corners(&of_json(|_| {}));
    for (mode, indices) in [(5, [0u16, 1, 3, 2]), (6, [0, 1, 2, 3])] {
        let (mut json, mut binary) = square();
        binary.truncate(80);
        indices.iter().for_each(|i| binary.extend(i.to_le_bytes()));
        json["buffers"][0]["byteLength"] = binary.len().into();
        json["bufferViews"][2]["byteLength"] = 8.into();
        json["accessors"][2]["count"] = 4.into();
        json["meshes"][0]["primitives"][0]["mode"] = mode.into();
        let found = geometry_of(packed(&json, &binary));
        let area = |all: &[[DVec3; 3]]| -> DVec3 {
            all.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a)).sum()
        };
        let found = corners(&found);
        assert_eq!(found.len(), 4, "{mode}");
        assert_eq!(area(&found[..2]), area(&expected[..2]), "{mode}");
        let same_side = |[a, b, c]: &[DVec3; 3]| (*b - *a).cross(*c - *a).z > 0.0;
        assert!(found.iter().all(same_side), "{mode}");
    }
}

fn corners(geometry: &Result<Geometry, SceneError>) -> Vec<[DVec3; 3]> {
    let geometry = geometry.as_ref().unwrap_or_else(|e| panic!("{e}"));
    geometry.triangles.iter().map(|t| t.positions).collect()
}

#[test]
fn numbers_are_normalised_and_sparse() {
    let (mut json, mut binary) = square();
    // Colors of corners as bytes, four apart, and the last corner's place from a sparse list.
    binary.extend([255, 0, 0, 9, 0, 255, 0, 9, 0, 0, 255, 9, 51, 51, 51, 9]);
    binary.extend([3, 0, 0, 0]);
    [0.0f32, 2.0, 0.0]
        .iter()
        .for_each(|x| binary.extend(x.to_le_bytes()));
    json["buffers"][0]["byteLength"] = binary.len().into();
    let views = json["bufferViews"].as_array_mut().expect("views");
    views.push(json!({ "buffer": 0, "byteOffset": 92, "byteLength": 16, "byteStride": 4 }));
    views.push(json!({ "buffer": 0, "byteOffset": 108, "byteLength": 1 }));
    views.push(json!({ "buffer": 0, "byteOffset": 112, "byteLength": 12 }));
    let accessors = json["accessors"].as_array_mut().expect("accessors");
    accessors.push(
        json!({ "bufferView": 3, "componentType": 5121, "normalized": true,
                           "count": 4, "type": "VEC3" }),
    );
    accessors[0]["sparse"] = json!({ "count": 1,
        "indices": { "bufferView": 4, "componentType": 5121 }, "values": { "bufferView": 5 } });
    json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = 3.into();
    let found = geometry_of(packed(&json, &binary)).unwrap_or_else(|e| panic!("{e}"));
    let second = found.triangles[1];
    assert_eq!(second.positions[2], DVec3::new(0.0, 2.0, 0.0));
    assert_eq!(second.colors, Some([Vec3::X, Vec3::Z, Vec3::splat(0.2)]));
}

#[test]
fn sources_say_what_differs_from_defaults() {
    let plain = source_of(json!({ "name": "Old Paint",
        "pbrMetallicRoughness": { "baseColorFactor": [0.8, 0.2, 0.1, 1.0], "metallicFactor": 0.0 } }));
    let expected = "//! From `m.glb`.

use std::surface::gltf_pbr;

/// The material `Old Paint`.
material old_paint {
    param base_color: color = color(0.8, 0.2, 0.1);
    param metallic: float = 0.0 in 0.0 .. 1.0;

    material = gltf_pbr(
        base_color: base_color,
        metallic: metallic,
    );
}
";
    assert_eq!(plain, expected);
    assert_compiles(&plain);
}

#[test]
fn sources_look_pictures_up() {
    let source = source_of(json!({
        "name": "if",
        "alphaMode": "MASK",
        "alphaCutoff": 0.3,
        "pbrMetallicRoughness": {
            "baseColorTexture": { "index": 0, "extensions": { "KHR_texture_transform": {
                "offset": [0.5, 0.0], "rotation": 1.5, "scale": [2.0, 3.0], "texCoord": 1 } } },
            "metallicRoughnessTexture": { "index": 1 },
            "roughnessFactor": 0.5,
        },
        "normalTexture": { "index": 1, "scale": 0.5 },
        "emissiveTexture": { "index": 0 },
        "emissiveFactor": [1.0, 1.0, 1.0],
        "extensions": {
            "KHR_materials_clearcoat": { "clearcoatFactor": 1.0 },
            "KHR_materials_iridescence": { "iridescenceFactor": 1.0,
                "iridescenceThicknessTexture": { "index": 0 } },
            "KHR_materials_volume": { "thicknessFactor": 0.1, "attenuationDistance": 0.2 },
            "KHR_materials_emissive_strength": { "emissiveStrength": 5.0 },
            "KHR_materials_anisotropy": { "anisotropyStrength": 0.5, "anisotropyRotation": 1.0 },
        },
    }));
    assert_compiles(&source);
    for part in [
        "material material_if {",
        "base_color: image(base_color_map, transformed(uv1, vec2(0.5, 0.0), 1.5, vec2(2.0, 3.0)))",
        "metallic: image_data(metallic_roughness_map, uv, wrap_u: CLAMP, wrap_v: MIRROR).z",
        "roughness: roughness * image_data(metallic_roughness_map, uv,",
        "param metallic_roughness_map: texture = \"images/1\";",
        "alpha: image_alpha(base_color_map, transformed(",
        "alpha_mode: 1",
        "scale: 0.5)",
        "mix(iridescence_thickness_minimum, iridescence_thickness, image_data(",
        "thickness: thickness",
        "emissive_strength: emissive_strength",
    ] {
        assert!(source.contains(part), "{part}\n{source}");
    }
}

#[test]
fn what_is_unlit_shines() {
    let source = source_of(json!({ "extensions": { "KHR_materials_unlit": {} },
        "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }));
    assert_compiles(&source);
    assert!(
        source.contains("emission = uniform(image(base_color_map, uv));"),
        "{source}"
    );
    assert!(!source.contains("gltf_pbr"), "{source}");
}

#[test]
fn names_are_there_once() {
    let (mut json, binary) = square();
    let named = ["a", "a_2", "a", "A", "", "a"].map(|name| json!({ "name": name }));
    json["materials"] = named.to_vec().into();
    let (_folder, path) = file_of(&packed(&json, &binary));
    let model = Model::read(&path, &Choice::default()).unwrap_or_else(|e| panic!("{e}"));
    let names = ["a", "a_2", "a_3", "A", "material_4", "a_4"];
    assert_eq!(model.material_names, names);
    let sources = ["a", "a_2", "a_3", "a_4", "material_4", "a_4_2"];
    assert_eq!(model.source_names, sources);
}

/// A picture turned by a quarter in a space where v goes down, as viewers of glTF show it.
#[test]
fn transforms_scale_then_turn_then_move() {
    let (c, s) = (0.0f64, 1.0f64);
    let transformed = |[x, y]: [f64; 2]| {
        let p = [2.0 * x, 3.0 * (1.0 - y)];
        let turned = [c * p[0] + s * p[1], c * p[1] - s * p[0]];
        [turned[0] + 0.5, 1.0 - turned[1] - 0.25]
    };
    // In glTF: (u, v) = (0.25, 0.5) scales to (0.5, 1.5), turns to (1.5, -0.5), and moves to (2, -0.25).
    assert_eq!(transformed([0.25, 0.5]), [2.0, 1.25]);
    assert!(super::material::TRANSFORMED.contains("cos(turn) * p.x + sin(turn) * p.y"));
}

#[test]
fn a_scene_may_have_no_nodes() {
    let empty = |j: &mut Value| j["scenes"] = json!([{ "name": "empty" }]);
    let error = of_json(empty).expect_err("nothing is there").to_string();
    assert!(error.contains("has no triangles"), "{error}");
    let beside = of_json(|j| j["scenes"] = json!([{ "nodes": [0] }, {}]));
    assert_eq!(corners(&beside).len(), 2);
}

/// Places that are many are in a file of their own.
#[test]
fn many_nodes_are_as_many_places() {
    let (mut json, binary) = square();
    let count = 10_001;
    let node = |i: usize| json!({ "mesh": 0, "translation": [i, 0, 0] });
    json["nodes"] = (0..count).map(node).collect();
    json["scenes"] = json!([{ "nodes": (0..count).collect::<Vec<_>>() }]);
    let (_folder, path) = file_of(&packed(&json, &binary));
    let text = member(&path, Path::new("scene.toml")).expect("a scene");
    let text = String::from_utf8(text).expect("text");
    assert!(text.contains("placements = \"placements/0.txt\""), "{text}");
    let scene = world::load(&path).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(scene.mesh.len(), 2 * count);
    let corner = scene.mesh.positions[2 * count - 1][0];
    assert_eq!(corner, Vec3::new(10_000.0, 0.0, 0.0));
}

/// A folder with a file, and the scene in it.
fn scene_of(json: &Value, binary: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("Model.GLB");
    std::fs::write(&path, packed(json, binary)).expect("a file");
    (folder, path)
}

#[test]
fn a_file_is_a_scene() {
    let (mut json, binary) = square();
    let (_folder, path) = scene_of(&json, &binary);
    let scene = world::load(&path).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(scene.name, "Model");
    assert_eq!(scene.mesh.len(), 4);
    assert_eq!(scene.materials[0].file, "old_paint.impasto");
    assert!(scene.environment.is_some(), "a file without lights is lit");
    // All of it is in the picture.
    let to = |p: Vec3| (p - scene.camera.position).normalize();
    let forward = to(scene.camera.look_at);
    let half = (0.5 * scene.camera.fov).to_radians();
    for corner in [
        Vec3::ZERO,
        Vec3::Y,
        Vec3::new(5.0, 2.0, 0.0),
        Vec3::new(3.0, 2.0, 0.0),
    ] {
        assert!(forward.dot(to(corner)).acos() < half, "{corner}");
    }
    // A camera and lights of its own.
    json["nodes"] = json!([
        { "mesh": 0 },
        { "camera": 0, "translation": [0.0, 0.0, 7.0],
          "children": [2, 3] },
        { "extensions": { "KHR_lights_punctual": { "light": 0 } } },
        { "extensions": { "KHR_lights_punctual": { "light": 1 } } },
    ]);
    json["cameras"] = json!([{ "type": "perspective",
        "perspective": { "yfov": 0.5, "aspectRatio": 2.0, "znear": 0.1 } }]);
    json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "directional", "intensity": 683.0, "color": [1.0, 0.5, 0.0] },
        { "type": "point", "intensity": 683.0 },
    ] } });
    let (_folder, path) = scene_of(&json, &binary);
    let scene = world::load(&path).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(scene.camera.position, Vec3::new(0.0, 0.0, 7.0));
    assert_eq!([scene.film.width, scene.film.height], [1024, 512]);
    assert!((scene.camera.fov - 0.5f32.to_degrees()).abs() < 1e-4);
    assert!(scene.environment.is_none());
    let [sun, lamp] = &scene.lights[..] else {
        panic!("{:?}", scene.lights)
    };
    let sun: &DistantLight = sun.get().expect("a sun");
    assert_eq!(
        [sun.to_light, sun.irradiance],
        [Vec3::Z, Vec3::new(1.0, 0.5, 0.0)]
    );
    let lamp: &SphereLight = lamp.get().expect("a lamp");
    assert_eq!(lamp.cone, None);
    // Into every direction goes a candela by 683, as of a disc of the sphere's radius.
    let intensity = lamp.radiance.x * std::f32::consts::PI * lamp.radius * lamp.radius;
    assert!((intensity - 1.0).abs() < 1e-5, "{intensity}");
}

#[test]
fn spots_have_cones_and_go_where_their_nodes_go() {
    let (mut json, binary) = square();
    let turned = std::f32::consts::FRAC_1_SQRT_2;
    json["nodes"] = json!([
        { "mesh": 0 },
        { "translation": [0.0, 0.0, 7.0], "rotation": [turned, 0.0, 0.0, turned],
          "extensions": { "KHR_lights_punctual": { "light": 0 } } },
    ]);
    json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "spot", "intensity": 683.0, "spot": { "innerConeAngle": 0.2, "outerConeAngle": 0.5 } },
    ] } });
    let mut bytes = binary.clone();
    for number in [0.0f32, 2.0, 0.0, 0.0, 7.0, 4.0, 0.0, 7.0] {
        bytes.extend(number.to_le_bytes());
    }
    json["buffers"][0]["byteLength"] = bytes.len().into();
    let views = json["bufferViews"].as_array_mut().expect("a list");
    views.push(json!({ "buffer": 0, "byteOffset": 92, "byteLength": 8 }));
    views.push(json!({ "buffer": 0, "byteOffset": 100, "byteLength": 24 }));
    let accessors = json["accessors"].as_array_mut().expect("a list");
    accessors.push(
        json!({ "bufferView": 3, "componentType": 5126, "count": 2, "type": "SCALAR",
        "min": [0.0], "max": [2.0] }),
    );
    accessors.push(json!({ "bufferView": 4, "componentType": 5126, "count": 2, "type": "VEC3" }));
    json["animations"] = json!([{
        "channels": [{ "sampler": 0, "target": { "node": 1, "path": "translation" } }],
        "samplers": [{ "input": 3, "output": 4 }],
    }]);
    let (_folder, path) = scene_of(&json, &bytes);
    let file = world::open(&path).unwrap_or_else(|e| panic!("{e}"));
    for (frame, x) in [(0.0, 0.0), (12.0, 1.0), (48.0, 4.0), (60.0, 4.0)] {
        let asked = crate::scene::Asked {
            frame,
            ..Default::default()
        };
        let scene = file.scene(&asked).unwrap_or_else(|e| panic!("{e}"));
        let [spot] = &scene.lights[..] else {
            panic!("{:?}", scene.lights)
        };
        let spot: &SphereLight = spot.get().expect("a spot");
        let place = (spot.center.as_dvec3() + scene.origin).as_vec3();
        assert!(
            place.distance(Vec3::new(x, 0.0, 7.0)) < 1e-4,
            "{frame}: {place}"
        );
        let cone = spot.cone.expect("a cone");
        // A quarter turn about x has it shine up.
        assert!(cone.axis.distance(Vec3::Y) < 1e-5, "{cone:?}");
        let angles = [cone.outer, cone.inner].map(f32::to_radians);
        assert!(
            (angles[0] - 0.5).abs() < 1e-5 && (angles[1] - 0.2).abs() < 1e-5,
            "{cone:?}"
        );
    }
}

#[test]
fn variants_and_animations_are_folders() {
    let (mut json, binary) = square();
    json["materials"] = json!([{ "name": "Red" }, { "name": "Blue" }]);
    json["extensionsUsed"] = json!(["KHR_materials_variants"]);
    json["extensions"] = json!({ "KHR_materials_variants": { "variants": [{ "name": "day" }, { "name": "night" }] } });
    json["meshes"][0]["primitives"][0]["extensions"] = json!({ "KHR_materials_variants": {
        "mappings": [{ "material": 0, "variants": [0] }, { "material": 1, "variants": [1] }],
    } });
    let (_folder, path) = scene_of(&json, &binary);
    for (folder, material) in [
        ("", "red.impasto"),
        ("variants/day", "red.impasto"),
        ("variants/night", "blue.impasto"),
        ("variants/1", "blue.impasto"),
    ] {
        let scene = world::load(&path.join(folder)).unwrap_or_else(|e| panic!("{folder}: {e}"));
        let shown = &scene.materials[scene.mesh.materials[0] as usize].file;
        assert_eq!(shown, material, "{folder}");
    }
    for (folder, expected) in [
        ("variants/dusk", "the file has no variant `dusk`"),
        ("variants/2", "there are `day`, `night`"),
        ("animations/walk", "it has no animations"),
        ("variants", "no such file"),
        ("other/scene.toml", "no such file"),
    ] {
        let error = world::load(&path.join(folder))
            .expect_err(folder)
            .to_string();
        assert!(error.contains(expected), "{folder}: {error}");
    }
}

/// Nothing but what is in the list of the parser's own, whatever it is.
#[test]
fn odd_kinds_of_values_are_no_panic() {
    let odd = [
        json!(7),
        json!("x"),
        json!([1]),
        json!({ "a": 1 }),
        json!(null),
    ];
    let places = [
        "/textures",
        "/meshes",
        "/animations",
        "/extensions",
        "/bufferViews",
        "/scenes",
    ];
    for value in odd {
        for place in places {
            let (mut json, binary) = square();
            json[&place[1..]] = value.clone();
            let (_folder, path) = file_of(&packed(&json, &binary));
            for choice in [
                Choice::default(),
                Choice {
                    animation: Some("0".into()),
                    variant: None,
                },
                Choice {
                    animation: None,
                    variant: Some("0".into()),
                },
            ] {
                let _ = Model::read(&path, &choice);
            }
        }
    }
}

#[test]
fn damage_is_told() {
    type Change<'a> = &'a dyn Fn(&mut Value);
    let cases: [(&str, Change); 11] = [
        (
            "`meshes[0].primitives[0].attributes[\"POSITION\"]` leads to something",
            &|j| {
                j["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 3.into();
            },
        ),
        ("glTF of 1.0", &|j| j["asset"]["version"] = "1.0".into()),
        ("`KHR_none`", &|j| {
            j["extensionsRequired"] = json!(["KHR_none"])
        }),
        (
            "`meshes[0].primitives[0].indices` leads to something",
            &|j| {
                j["meshes"][0]["primitives"][0]["indices"] = 7.into();
            },
        ),
        ("reaches behind its buffer", &|j| {
            j["accessors"][0]["count"] = 400.into()
        }),
        ("reaches behind its buffer", &|j| {
            j["bufferViews"][0]["byteLength"] = 4_000_000.into()
        }),
        ("cut off", &|j| {
            j["buffers"][0]["byteLength"] = 93_000.into()
        }),
        ("has 4000000000 elements and no buffer", &|j| {
            j["accessors"][0] = json!({ "componentType": 5126, "count": 4_000_000_000u64, "type": "VEC3",
                "min": [0.0, 0.0, 0.0], "max": [1.0, 1.0, 0.0], "sparse": { "count": 1,
                "indices": { "bufferView": 2, "componentType": 5123 }, "values": { "bufferView": 0 } } });
        }),
        ("is within itself", &|j| {
            j["nodes"][0]["children"] = json!([0])
        }),
        ("is not in the file's folder", &|j| {
            j["buffers"][0]["uri"] = "../a.bin".into()
        }),
        ("`a.bin`: no such file", &|j| {
            j["buffers"][0]["uri"] = "a.bin".into()
        }),
    ];
    for (expected, change) in &cases {
        let error = of_json(change).expect_err(expected).to_string();
        assert!(error.contains(expected), "{expected}: {error}");
    }
    let (json, mut binary) = square();
    binary[80] = 9;
    let error = geometry_of(packed(&json, &binary))
        .expect_err("an index")
        .to_string();
    assert!(error.contains("corner 9 of 4"), "{error}");
    let empty = geometry_of(Vec::new()).expect_err("nothing").to_string();
    assert!(empty.contains("empty"), "{empty}");
}

/// Whatever is cut off or changed, nothing panics, and a member is there or is not.
#[test]
fn no_byte_is_trusted() {
    let (json, binary) = square();
    let whole = packed(&json, &binary);
    let (_folder, path) = file_of(&whole);
    let ask = |bytes: &[u8]| {
        std::fs::write(&path, bytes).expect("a file");
        let _ = read(&path);
        for name in ["scene.toml", "old_paint.impasto", "images/0", "../x"] {
            let _ = member(&path, Path::new(name));
        }
    };
    for end in 0..whole.len() {
        ask(&whole[..end]);
    }
    let mut state = 1u64;
    for _ in 0..3000 {
        let mut bytes = whole.clone();
        for _ in 0..3 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let at = (state >> 33) as usize % bytes.len();
            bytes[at] = (state >> 24) as u8;
        }
        ask(&bytes);
    }
}
