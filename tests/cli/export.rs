//! `impasto export`: files that other programs read, their pictures, and what is refused.

use std::path::Path;

use serde_json::{Value, json};

use crate::cli::common::{folder, impasto, names, write};

const SOURCE: &str = "use std::surface::open_pbr;

/// Worn paint.
material paint {
    param tint: color = color(0.5, 0.25, 0.125);
    param map: texture = \"pictures/map.png\";
    param rough: texture = \"pictures/rough.png\";

    material = open_pbr(
        base_color: tint * image(map, 2.0 * uv),
        specular_roughness: image_data(rough, uv).y,
    );
}
";

/// A folder `from` with a source of two pictures.
fn sources(temporary: &Path) -> String {
    let pictures = temporary.join("from/pictures");
    std::fs::create_dir_all(&pictures).expect("a folder");
    for name in ["map.png", "rough.png"] {
        picture(&pictures.join(name));
    }
    write(&temporary.join("from"), "paint.impasto", SOURCE)
}

fn picture(path: &Path) {
    let texels = image::RgbImage::from_pixel(2, 2, image::Rgb([200, 80, 40]));
    texels.save(path).expect("a picture");
}

#[test]
fn a_document_has_its_pictures_beside_it_and_comes_back() {
    let temporary = folder();
    let source = sources(temporary.path());
    let made = temporary.path().join("made");
    let out = made.join("paint.mtlx").display().to_string();
    let export = |tint: &str| {
        let param = format!("tint={tint}");
        impasto(&[
            "export",
            &source,
            "--to",
            "materialx",
            "--param",
            &param,
            "--out",
            &out,
        ])
    };
    let white = "color(1.0, 1.0, 1.0)";
    export(white)
        .exits(0)
        .says("wrote 3 files")
        .prints_nothing();
    assert_eq!(names(&made), ["paint.mtlx", "textures"]);
    assert_eq!(names(&made.join("textures")), ["map.png", "rough.png"]);
    let document = std::fs::read_to_string(&out).expect("a document");
    assert!(
        document.contains("value=\"textures/map.png\" colorspace=\"srgb_texture\""),
        "{document}"
    );
    assert!(
        !document.contains("multiply"),
        "white changes nothing: {document}"
    );
    // The same once more is no change, and something else stays.
    export(white).exits(0);
    export("color(0.5, 0.5, 0.5)")
        .exits(2)
        .says("paint.mtlx` is there already");
    assert_eq!(std::fs::read_to_string(&out).expect("the first"), document);
    let again = temporary.path().join("again");
    impasto(&["import", &out, "--out", &again.display().to_string()]).exits(0);
    let source = again.join("paint.impasto").display().to_string();
    impasto(&["check", &source])
        .exits(0)
        .says("0 errors, 0 warnings");
}

#[test]
fn pictures_below_the_folder_stay_where_they_are() {
    let temporary = folder();
    let source = sources(temporary.path());
    let from = temporary.path().join("from");
    std::fs::remove_file(from.join("pictures/rough.png")).expect("a picture");
    let out = from.join("paint.mtlx").display().to_string();
    let run = impasto(&[
        "export",
        &source,
        "--to",
        "materialx",
        "--out",
        &out,
        "--format",
        "json",
    ]);
    let told = run.exits(0).json();
    assert_eq!(told["written"], json!([out]));
    let warning = told["warnings"][0].as_str().unwrap_or_default();
    assert!(warning.contains("rough.png` is missing"), "{told}");
    assert_eq!(names(&from), ["paint.impasto", "paint.mtlx", "pictures"]);
    let document = std::fs::read_to_string(&out).expect("a document");
    assert!(
        document.contains("value=\"pictures/map.png\""),
        "{document}"
    );
}

#[test]
fn a_material_of_a_gltf_file_comes_back() {
    let temporary = folder();
    picture(&temporary.path().join("bricks.png"));
    let material = json!({
        "name": "bricks",
        "alphaMode": "MASK",
        "alphaCutoff": 0.25,
        "normalTexture": { "index": 0, "scale": 0.5 },
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.5, 0.25, 1.0, 1.0],
            "baseColorTexture": { "index": 0, "extensions": {
                "KHR_texture_transform": { "offset": [0.5, 0.0], "rotation": 0.25, "scale": [2.0, 4.0] } } },
            "metallicRoughnessTexture": { "index": 0 },
        },
        "extensions": { "KHR_materials_clearcoat": { "clearcoatFactor": 0.75 } },
    });
    let file = json!({
        "asset": { "version": "2.0" },
        "materials": [material],
        "textures": [{ "source": 0 }],
        "images": [{ "uri": "bricks.png" }],
    });
    let file = write(temporary.path(), "bricks.gltf", file.to_string());
    // Out of the file itself, without unpacking it.
    let out = temporary.path().join("made/bricks.gltf");
    let source = format!("{file}/bricks.impasto");
    let out_text = out.display().to_string();
    impasto(&["export", &source, "--to", "gltf-pbr", "--out", &out_text]).exits(0);
    let text = std::fs::read_to_string(&out).expect("a file");
    let again: Value = serde_json::from_str(&text).expect("JSON");
    let mut own = again["materials"][0].clone();
    let base = &mut own["pbrMetallicRoughness"];
    let offset = base["baseColorTexture"]["extensions"]["KHR_texture_transform"]["offset"].clone();
    assert!(
        (offset[0].as_f64().unwrap_or(9.0) - 0.5).abs() < 1e-6,
        "{text}"
    );
    // A rotation comes back but for rounding.
    base["baseColorTexture"] = material["pbrMetallicRoughness"]["baseColorTexture"].clone();
    assert_eq!(own, material, "{text}");
    assert_eq!(again["images"], json!([{ "uri": "textures/0.png" }]));
    assert_eq!(names(&out.with_file_name("textures")), ["0.png"]);
    let used = json!(["KHR_materials_clearcoat", "KHR_texture_transform"]);
    assert_eq!(again["extensionsUsed"], used);
}

#[test]
fn tiles_are_copied_by_their_numbers() {
    let temporary = folder();
    let from = temporary.path().join("from");
    std::fs::create_dir_all(&from).expect("a folder");
    for tile in ["1001", "1002"] {
        picture(&from.join(format!("wall.{tile}.png")));
    }
    let text = "use std::surface::open_pbr;\nmaterial wall {
        param map: texture = \"wall.<UDIM>.png\"; material = open_pbr(base_color: image(map, uv)); }";
    let source = write(&from, "wall.impasto", text);
    let out = temporary.path().join("wall/wall.mtlx");
    let out_text = out.display().to_string();
    impasto(&["export", &source, "--to", "materialx", "--out", &out_text]).exits(0);
    let copied = names(&out.with_file_name("textures"));
    assert_eq!(copied, ["wall.1001.png", "wall.1002.png"]);
    let gltf = temporary.path().join("wall.gltf").display().to_string();
    let text = text.replace("open_pbr", "gltf_pbr");
    let source = write(&from, "gltf.impasto", text);
    impasto(&["export", &source, "--to", "gltf-pbr", "--out", &gltf])
        .exits(1)
        .says("is not");
}

#[test]
fn what_cannot_be_said_is_refused_with_its_places() {
    let temporary = folder();
    let text = "use std::surface::open_pbr;
use std::noise::perlin;
material rock {
    let spots = perlin(position / 3 mm);
    material = open_pbr(
        base_color: color(spots),
        coat_weight: sin(uv.x),
    );
}
";
    let source = write(temporary.path(), "rock.impasto", text);
    let out = temporary.path().join("rock.mtlx").display().to_string();
    let export = |to: &str, out: &str, more: &[&str]| {
        impasto(&[&["export", &source, "--to", to, "--out", out], more].concat())
    };
    export("materialx", &out, &[])
        .exits(1)
        .says("`base_color` of `open_pbr` cannot be exported: it depends on `perlin`")
        .says("rock.impasto:6:")
        .says("rock.impasto:7:");
    assert_eq!(names(temporary.path()), ["rock.impasto"]);
    let told = export("materialx", &out, &["--format", "json"])
        .exits(1)
        .json();
    assert_eq!(told["diagnostics"].as_array().map(Vec::len), Some(2));
    assert_eq!(told["diagnostics"][0]["code"], "E0401");
    // glTF takes one model.
    let plain = write(
        temporary.path(),
        "plain.impasto",
        "use std::surface::open_pbr;\nmaterial plain { material = open_pbr(); }\n",
    );
    let gltf = temporary.path().join("plain.gltf").display().to_string();
    impasto(&["export", &plain, "--to", "gltf-pbr", "--out", &gltf])
        .exits(1)
        .says("`open_pbr` is no model of glTF")
        .says("--to materialx");
    export("materialx", &gltf, &[])
        .exits(2)
        .says("--out NAME.mtlx");
    export("materialx", &out, &["--param", "size=1"])
        .exits(1)
        .says("has no parameter `size`");
    export("materialx", &out, &["--material", "stone"])
        .exits(1)
        .says("no material `stone`");
    let lost = temporary.path().join("lost.impasto").display().to_string();
    impasto(&["export", &lost, "--to", "materialx", "--out", &out]).exits(1);
}
