//! `check` of scenes and folders, and that errors show the line of the scene which names what is wrong.

use std::path::Path;

use crate::cli::common::{folder, impasto, write};

const MATERIAL: &str = "use std::bsdf::diffuse;
material wall {
    param roughness: float = 0.5 in 0.0 .. 1.0;
    param depth: length = 1 mm;
    param map: texture = \"there.png\";
    surface = diffuse(image(map, uv) * roughness * float(depth));
}
";

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// A scene whose lines 6, 8, 11 and 12 are told.
fn scene(environment: &str, geometry: &str, material: &str, params: &str) -> String {
    format!(
        "[camera]\nposition = [0, 0, 3]\nlook_at = [0, 0, 0]\nfov = 40\n[environment]\n{environment}\n\
         [[geometry]]\nfile = \"{geometry}\"\nmaterial = \"w\"\n[materials.w]\nfile = \"{material}\"\n\
         params = {{ {params} }}\n"
    )
}

fn good() -> String {
    scene("color = 1", "t.obj", "wall.impasto", "roughness = 0.3")
}

/// A folder with what scenes name.
fn room() -> tempfile::TempDir {
    let folder = folder();
    let at = folder.path();
    write(at, "wall.impasto", MATERIAL);
    write(at, "t.obj", TRIANGLE);
    image::RgbImage::new(1, 1)
        .save(at.join("there.png"))
        .expect("it can be written");
    folder
}

fn path(at: &Path, name: &str) -> String {
    at.join(name).display().to_string()
}

#[test]
fn a_good_scene_is_checked_with_its_materials() {
    let room = room();
    let file = write(room.path(), "scene.toml", good());
    let run = impasto(&["check", &file]).exits(0).prints_nothing();
    run.says("checked 1 file: 0 errors, 0 warnings");
}

/// What a scene names wrongly: the line and what is marked in it, with `check` and with `render`.
#[test]
fn errors_show_the_line_of_the_scene() {
    let room = room();
    let at = room.path();
    let texture = "map = \"gone.png\"";
    let with = |params| scene("color = 1", "t.obj", "wall.impasto", params);
    let cases = [
        (
            scene("file = \"sky.hdr\"", "t.obj", "wall.impasto", ""),
            "sky.hdr: cannot read the environment map",
            "6 | file = \"sky.hdr\"\n   |        ^^^^^^^^^\n",
        ),
        (
            scene("color = 1", "gone.obj", "wall.impasto", ""),
            "gone.obj: cannot read the OBJ file",
            "8 | file = \"gone.obj\"\n   |        ^^^^^^^^^^\n",
        ),
        (
            with(texture),
            "gone.png: cannot read the texture",
            "12 | params = { map = \"gone.png\" }\n    |                  ^^^^^^^^^^\n",
        ),
        (
            scene("color = 1", "t.obj", "gone.impasto", ""),
            "cannot read `gone.impasto`",
            " file = \"gone.impasto\"\n",
        ),
        (
            with("rougness = 0.3"),
            "did you mean `roughness`?",
            "12 │ params = { rougness = 0.3 }\n   │            ^^^^^^^^\n",
        ),
        (
            with("roughness = true"),
            "E0301",
            "12 │ params = { roughness = true }\n   │                        ^^^^\n",
        ),
        (
            with("roughness = 1.5"),
            "E0305",
            "12 │ params = { roughness = 1.5 }\n   │                        ^^^\n",
        ),
        (
            with("depth = 2"),
            "E0303",
            "12 │ params = { depth = 2 }\n   │                    ^\n",
        ),
        // Within a string, the part of the expression.
        (
            with("depth = \"2 mn\""),
            "E0213",
            "12 │ params = { depth = \"2 mn\" }\n   │                       ^^\n",
        ),
        (
            good().replace("fov", "fovv"),
            "did you mean `fov`?",
            "4 | fovv = 40\n   | ^^^^\n",
        ),
    ];
    for (text, message, line) in cases {
        let file = write(at, "scene.toml", &text);
        impasto(&["check", &file])
            .exits(1)
            .says(message)
            .says(line)
            .says("scene.toml:")
            .says("checked 1 file: 1 error, 0 warnings");
        let out = path(at, "p.png");
        let run = impasto(&["render", &file, "--spp", "1", "--out", &out]);
        assert_ne!(run.code, 0, "{run:#?}");
        run.says(message).says(line);
    }
}

/// A color in bytes is brighter than any surface: `base_color = [255, 0, 0]`.
#[test]
fn colors_of_scenes_that_are_too_bright_are_told() {
    let room = room();
    let text =
        "use std::bsdf::diffuse;\nmaterial w { param c: color = 0.5; surface = diffuse(c); }";
    write(room.path(), "w.impasto", text);
    let scene = scene("color = 1", "t.obj", "w.impasto", "c = [255, 0, 0]");
    let file = write(room.path(), "scene.toml", scene);
    impasto(&["check", &file])
        .exits(0)
        .says("W0005")
        .says("1 warning");
}

#[test]
fn folders_are_searched_for_materials_and_scenes() {
    let room = room();
    let at = room.path();
    std::fs::create_dir(at.join("below")).expect("it can be made");
    write(at, "below/scene.toml", good());
    write(at, "below/Cargo.toml", "[package]\nname = \"no scene\"\n");
    // Its files are relative to its own folder, where they are not.
    impasto(&["check", &path(at, "")])
        .exits(1)
        .says("t.obj")
        .says("checked 2 files: 1 error, 0 warnings");
    write(at, "below/scene.toml", "[camera]\nfov = ");
    let run = impasto(&["check", &path(at, ""), "--format", "json"]).exits(1);
    let found = run.json();
    assert_eq!((&found["files"], &found["errors"]), (&2.into(), &1.into()));
    let first = &found["diagnostics"][0];
    assert_eq!(
        (&first["line"], &first["severity"]),
        (&2.into(), &"error".into())
    );
}

/// Files that cannot be read are not among those that were checked.
#[test]
fn the_count_is_of_files_that_were_read() {
    let room = room();
    let at = room.path();
    let (wall, gone) = (path(at, "wall.impasto"), path(at, "gone.toml"));
    impasto(&["check", &wall, &gone])
        .exits(2)
        .says("gone.toml")
        .says("checked 1 file: 0 errors, 0 warnings")
        .says("1 file could not be read");
}
