//! Renders at the ends of what can be asked for: a clear error or the right picture.

use crate::cli::common::{Run, SCENE, folder, impasto, names, write};

/// Renders a scene into a folder that must stay as it is if that fails.
fn render(scene: &str, arguments: &str) -> Run {
    let folder = folder();
    let out = folder.path().join("p.exr").display().to_string();
    let mut all = vec!["render", scene, "--out", &out];
    all.extend(arguments.split_whitespace());
    let run = impasto(&all);
    let files = names(folder.path());
    assert_eq!(files.is_empty(), run.code != 0, "{files:?}: {run:#?}");
    run
}

#[test]
fn pictures_of_no_or_too_many_pixels() {
    for size in ["0x0", "0x16", "16x0", "65537x1", "16", "x", "-1x5"] {
        render(SCENE, &format!("--size={size}"))
            .exits(2)
            .says("width and height from 1");
    }
    // More than any GPU binds at once.
    render(SCENE, "--device gpu --size 16384x16384 --spp 1")
        .exits(2)
        .says("the film")
        .says("10737418240")
        .says("hint: use a smaller scene or picture");
}

#[test]
fn pools_of_one_path_and_of_more_than_there_is_memory() {
    render(SCENE, "--size 3x2 --spp 1 --pool 1").exits(0);
    render(SCENE, "--device gpu --size 16x16 --spp 1 --pool 4294967295")
        .exits(2)
        .says("a pool of that size")
        .says("hint: use a smaller pool");
    render(SCENE, "--pool 0").exits(2).says("--pool");
}

#[test]
fn samples_beyond_the_last_index() {
    let small = "--size 4x4 --samples-from";
    render(SCENE, &format!("{small} 4294967290 --spp 5")).exits(0);
    render(SCENE, &format!("{small} 4294967290 --spp 6"))
        .exits(2)
        .says("the last sample's index is 4294967295: expected at most 2^32 - 2");
    render(SCENE, &format!("{small} 4294967296 --spp 1")).exits(2);
    render(SCENE, "--spp 0").exits(2).says("--spp");
    render(SCENE, "--spp 4294967296").exits(2).says("--spp");
}

/// A scene of one triangle.
fn triangle(corners: &str, head: &str, material: &str) -> Run {
    let folder = folder();
    let at = folder.path();
    write(at, "t.obj", format!("{corners}\nusemtl a\nf 1 2 3\n"));
    write(
        at,
        "m.impasto",
        "use std::bsdf::diffuse;\nuse std::edf::uniform;\n\
         material dull { surface = diffuse(0.6); }\n\
         material glowing { surface = diffuse(0.7); emission = uniform(color(1)); }\n",
    );
    let scene = format!(
        "film = {{ width = 8, height = 8 }}\n{head}\n\
         camera = {{ position = [0.0, 0.0, 3.0], look_at = [0.0, 0.0, 0.0], fov = 60 }}\n\
         [[geometry]]\nobj = 't.obj'\n[materials.a]\nfile = 'm.impasto'\nmaterial = '{material}'\n"
    );
    render(&write(at, "s.toml", scene), "--spp 4")
}

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0";
const LINE: &str = "v 0 0 0\nv 1 1 1\nv 2 2 2";

#[test]
fn scenes_without_light_and_without_area() {
    let sky = "environment.color = 1.0";
    triangle(TRIANGLE, sky, "dull").exits(0);
    triangle(TRIANGLE, "", "glowing").exits(0);
    triangle(TRIANGLE, "", "dull")
        .exits(2)
        .says("has no light")
        .says("hint: add [environment]");
    for (head, material) in [(sky, "dull"), ("", "glowing")] {
        triangle(LINE, head, material)
            .exits(2)
            .says("no face of its OBJ, PLY, glTF or USD files has an area");
    }
}
