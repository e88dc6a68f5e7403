//! glTF files: rendered and checked as they are, and imported as folders to go on with.

use std::path::Path;

use serde_json::{Value, json};

use crate::cli::common::{Run, folder, impasto, names};

/// A square that faces +z, as wide as its picture of four texels, in a `.glb`.
fn square() -> (Value, Vec<u8>) {
    let mut binary = Vec::new();
    let positions: [f32; 12] = [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.];
    let uvs: [f32; 8] = [0., 1., 1., 1., 1., 0., 0., 0.];
    let indices: [u16; 6] = [0, 1, 2, 0, 2, 3];
    positions
        .iter()
        .for_each(|x| binary.extend(x.to_le_bytes()));
    uvs.iter().for_each(|x| binary.extend(x.to_le_bytes()));
    indices.iter().for_each(|i| binary.extend(i.to_le_bytes()));
    let mut picture = std::io::Cursor::new(Vec::new());
    // Above red and green, below blue and white.
    let texels = [255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255];
    let texels = image::RgbImage::from_raw(2, 2, texels.to_vec()).expect("four texels");
    texels
        .write_to(&mut picture, image::ImageFormat::Png)
        .expect("a picture");
    let picture = picture.into_inner();
    let json = json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": [0, 1] }],
        "nodes": [{ "mesh": 0 }, { "camera": 0, "translation": [0.5, 0.5, 2.0] }],
        "cameras": [{ "type": "perspective",
                      "perspective": { "yfov": 0.48, "aspectRatio": 1.0, "znear": 0.1 } }],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "indices": 2, "material": 0 }] }],
        "materials": [{ "name": "Four Colors", "extensions": { "KHR_materials_unlit": {} },
                        "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }],
        "samplers": [{ "magFilter": 9728, "wrapS": 33071, "wrapT": 33071 }],
        "textures": [{ "source": 0, "sampler": 0 }],
        "images": [{ "bufferView": 3, "mimeType": "image/png" }],
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
            { "buffer": 0, "byteOffset": 92, "byteLength": picture.len() },
        ],
        "buffers": [{ "byteLength": 92 + picture.len() }],
    });
    binary.extend(picture);
    (json, binary)
}

fn write_glb(path: &Path, (json, mut binary): (Value, Vec<u8>)) {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let mut out = b"glTF".to_vec();
    let length = 28 + text.len() + binary.len();
    let words = |out: &mut Vec<u8>, n: usize| out.extend((n as u32).to_le_bytes());
    words(&mut out, 2);
    words(&mut out, length);
    words(&mut out, text.len());
    out.extend(b"JSON");
    out.extend(text);
    words(&mut out, binary.len());
    out.extend(b"BIN\0");
    out.extend(binary);
    std::fs::write(path, out).expect("a file");
}

/// The four quarters of a picture of the square: above left, above right, below left, below right.
fn quarters(scene: &str, out: &Path) -> [[u8; 3]; 4] {
    let picture = out.display().to_string();
    let args = ["--size", "32x32", "--spp", "4", "--device", "cpu"];
    impasto(&[&["render", scene, "--out", &picture], &args[..]].concat()).exits(0);
    let pixels = image::open(out).expect("a picture").to_rgb8();
    [(4, 4), (28, 4), (4, 28), (28, 28)].map(|(x, y)| pixels.get_pixel(x, y).0)
}

const EXPECTED: [[u8; 3]; 4] = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255]];

#[test]
fn a_file_is_rendered_checked_and_imported() {
    let temporary = folder();
    let file = temporary.path().join("square.glb");
    write_glb(&file, square());
    let path = file.display().to_string();
    impasto(&["check", &path])
        .exits(0)
        .says("checked 1 file: 0 errors, 0 warnings");
    assert_eq!(quarters(&path, &temporary.path().join("a.png")), EXPECTED);
    // A member, as if it lay in a folder.
    let source = format!("{path}/four_colors.impasto");
    impasto(&["check", &source])
        .exits(0)
        .says("0 errors, 0 warnings");
    impasto(&["fmt", "--check", &source]).exits(0);
    let out = temporary.path().join("made");
    let out_text = out.display().to_string();
    let import = || impasto(&["import", &path, "--out", &out_text]);
    import().exits(0).says("impasto render");
    let made = ["four_colors.impasto", "images", "scene.toml", "square.glb"];
    assert_eq!(names(&out), made);
    // The pictures are the folder's own from now on.
    let scene = out.join("scene.toml").display().to_string();
    impasto(&["check", &scene])
        .exits(0)
        .says("0 errors, 0 warnings");
    assert_eq!(quarters(&scene, &temporary.path().join("b.png")), EXPECTED);
    // Nobody's work is written over.
    import().exits(0);
    let source = out.join("four_colors.impasto");
    std::fs::write(&source, "// mine").expect("an edit");
    import()
        .exits(2)
        .says("four_colors.impasto` is there already");
    assert_eq!(std::fs::read_to_string(source).expect("mine"), "// mine");
}

#[test]
fn what_is_wrong_is_said_of_the_file() {
    let temporary = folder();
    let wrong = |change: &dyn Fn(&mut Value)| -> Run {
        let file = temporary.path().join("wrong.glb");
        let (mut json, binary) = square();
        change(&mut json);
        write_glb(&file, (json, binary));
        impasto(&["check", &file.display().to_string()]).exits(1)
    };
    wrong(&|j| j["meshes"][0]["primitives"][0]["indices"] = 9.into())
        .says("wrong.glb")
        .says("`meshes[0].primitives[0].indices` leads to something that is not there");
    wrong(&|j| j["images"][0] = json!({ "uri": "../secret.png" }))
        .says("`../secret.png` is not in the file's folder");
    wrong(&|j| j["images"][0] = json!({ "uri": "lost.png" })).says("`lost.png`: no such file");
    wrong(&|j| j["extensionsRequired"] = json!(["KHR_texture_basisu"]))
        .says("requires the extension `KHR_texture_basisu`, which is not read");
    let other = temporary.path().join("a.fbx").display().to_string();
    impasto(&["import", &other])
        .exits(2)
        .says("in no format that is imported");
}

const DOCUMENT: &str = r#"<?xml version="1.0"?>
<materialx version="1.39">
  <image name="map" type="color3"><input name="file" type="filename" value="map.png" colorspace="srgb_texture" /></image>
  <standard_surface name="shader" type="surfaceshader">
    <input name="base_color" type="color3" nodename="map" />
    <input name="specular_roughness" type="float" value="0.4" />
  </standard_surface>
  <surfacematerial name="clay" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="shader" />
  </surfacematerial>
</materialx>"#;

#[test]
fn documents_of_materialx_become_sources() {
    let temporary = folder();
    let file = temporary.path().join("clay.mtlx");
    std::fs::write(&file, DOCUMENT).expect("a document");
    let texels = image::RgbImage::from_pixel(2, 2, image::Rgb([200, 80, 40]));
    texels
        .save(temporary.path().join("map.png"))
        .expect("a picture");
    let out = temporary.path().join("made");
    let path = file.display().to_string();
    let out_text = out.display().to_string();
    impasto(&["import", &path, "--out", &out_text])
        .exits(0)
        .says("impasto render");
    assert_eq!(names(&out), ["clay.impasto", "textures"]);
    assert_eq!(names(&out.join("textures")), ["map.png"]);
    let source = out.join("clay.impasto").display().to_string();
    impasto(&["check", &source])
        .exits(0)
        .says("0 errors, 0 warnings");
    impasto(&["fmt", "--check", &source]).exits(0);
    let picture = temporary.path().join("clay.png").display().to_string();
    let args = [
        "--size", "32x24", "--spp", "2", "--device", "cpu", "--out", &picture,
    ];
    impasto(&[&["render", &source], &args[..]].concat()).exits(0);
    std::fs::write(&file, without_counterpart()).expect("a document");
    let run = impasto(&["import", &path, "--out", &out_text, "--format", "json"]).exits(1);
    let errors = &run.json()["errors"];
    assert!(
        errors[0]
            .as_str()
            .is_some_and(|e| e.contains("clay.mtlx:3:")),
        "{errors}"
    );
}

/// The document with a node that has no counterpart, in its third line.
fn without_counterpart() -> String {
    DOCUMENT
        .replace("<image", "<hextiledtriplanar")
        .replace("</image>", "</hextiledtriplanar>")
}

#[test]
fn documents_are_sources_where_they_are() {
    let temporary = folder();
    let art = temporary.path().join("art");
    std::fs::create_dir(&art).expect("a folder");
    let file = art.join("clay.mtlx");
    std::fs::write(&file, DOCUMENT).expect("a document");
    let texels =
        image::RgbImage::from_fn(2, 2, |x, y| image::Rgb([200, 80 * x as u8, 90 * y as u8]));
    texels.save(art.join("map.png")).expect("a picture");
    let path = file.display().to_string();
    impasto(&["check", &path])
        .exits(0)
        .says("0 errors, 0 warnings");

    // As it is, it looks as what is imported.
    let made = temporary.path().join("made").display().to_string();
    impasto(&["import", &path, "--out", &made]).exits(0);
    let picture = |of: &str| {
        let out = temporary.path().join("out.png");
        let out_text = out.display().to_string();
        let args = [
            "--size", "32x24", "--spp", "2", "--device", "cpu", "--out", &out_text,
        ];
        impasto(&[&["render", of], &args[..]].concat()).exits(0);
        image::open(out).expect("a picture").to_rgb8()
    };
    let own = picture(&path);
    assert!(own == picture(&format!("{made}/clay.impasto")));

    // Scenes take materials of it.
    let obj = "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nusemtl body\nf 1 2 3\n";
    std::fs::write(temporary.path().join("one.obj"), obj).expect("a mesh");
    let scene = temporary.path().join("scene.toml");
    let text = "[camera]\nposition = [0, 0, 3]\nlook_at = [0, 0, 0]\nfov = 40\n\
        [film]\nwidth = 8\nheight = 8\n[[geometry]]\nfile = \"one.obj\"\n\
        [materials.body]\nfile = \"art/clay.mtlx\"\n[environment]\ncolor = 1\n";
    std::fs::write(&scene, text).expect("a scene");
    let scene = scene.display().to_string();
    impasto(&["check", &scene])
        .exits(0)
        .says("0 errors, 0 warnings");
    let lit = picture(&scene);
    let is_red = |p: &image::Rgb<u8>| p.0[0] > p.0[2].saturating_add(20);
    assert!(lit.pixels().any(is_red));

    // What the compiler has against it is told by its lines.
    let medium = "<materialx version=\"1.39\">\n  <noise3d name=\"clouds\" type=\"color3\" />\n  \
        <absorption_vdf name=\"inside\" type=\"VDF\">\n    \
        <input name=\"absorption\" type=\"vector3\" nodename=\"thick\" />\n  </absorption_vdf>\n  \
        <convert name=\"thick\" type=\"vector3\"><input name=\"in\" type=\"color3\" nodename=\"clouds\" /></convert>\n  \
        <dielectric_bsdf name=\"clear\" type=\"BSDF\"><input name=\"scatter_mode\" type=\"string\" value=\"RT\" /></dielectric_bsdf>\n  \
        <layer name=\"filled\" type=\"BSDF\"><input name=\"top\" type=\"BSDF\" nodename=\"clear\" />\
        <input name=\"base\" type=\"VDF\" nodename=\"inside\" /></layer>\n  \
        <surface name=\"s\" type=\"surfaceshader\"><input name=\"bsdf\" type=\"BSDF\" nodename=\"filled\" /></surface>\n\
        </materialx>\n";
    std::fs::write(&file, medium).expect("a document");
    for of in [&path, &scene] {
        impasto(&["check", of])
            .exits(1)
            .says("clay.mtlx:2:3")
            .says("<noise3d name=\"clouds\" type=\"color3\" />")
            .says("from: the `noise3d` node `clouds`, which becomes");
    }
    std::fs::write(&file, DOCUMENT).expect("a document");

    // It is read only.
    impasto(&["fmt", &path]).exits(2).says("impasto import");
    assert_eq!(std::fs::read_to_string(&file).expect("it"), DOCUMENT);
    std::fs::write(&file, without_counterpart()).expect("a document");
    for (wrong, code) in [(&path, 2), (&scene, 1)] {
        impasto(&["check", wrong])
            .exits(code)
            .says("clay.mtlx")
            .says("line 3:");
    }
}
