//! A second format goes the way of OBJ files: lists of triangles, nine numbers and the name of a
//! material a line.
//!
//! ```text
//! color red 0.8 0.1 0.1
//! 0 0 0  1 0 0  0 1 0  red
//! ```

use std::path::{Path, PathBuf};

use glam::Vec3;

use super::*;
use crate::scene::{Scene, load_with};

const TRIANGLES: Format = Format {
    name: "triangle list",
    extensions: &["tri", "tris"],
    read,
    without_material: "triangles without a name",
    values: &[FileValue {
        name: "color",
        fallback: &[0.5; 3],
    }],
    values_of: "a list of triangles",
};

fn read(base: &Path, name: &str, _: f64) -> Result<Geometry, SceneError> {
    let path = &base.join(name);
    let text = std::fs::read_to_string(path)
        .map_err(|e| SceneError::in_file(path, format!("cannot read the triangles: {e}")))?;
    let mut geometry = Geometry::default();
    for (index, line) in text.lines().enumerate() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let numbers = |words: &[&str]| -> Result<Vec<f64>, SceneError> {
            let error = |_| SceneError::in_file(path, "no number").line(index + 1);
            words.iter().map(|w| w.parse().map_err(error)).collect()
        };
        match &words[..] {
            ["color", name, rgb @ ..] => geometry.materials.push(FileMaterial {
                name: (*name).to_owned(),
                values: vec![("color", ParameterValue::Floats(numbers(rgb)?))],
            }),
            [corners @ .., material] if corners.len() == 9 => {
                let at = numbers(corners)?;
                let known = geometry.materials.iter().position(|m| m.name == *material);
                let material = known.unwrap_or_else(|| {
                    geometry.materials.push(FileMaterial {
                        name: (*material).to_owned(),
                        ..FileMaterial::default()
                    });
                    geometry.materials.len() - 1
                });
                geometry.triangles.push(Triangle {
                    positions: [0, 3, 6].map(|first| DVec3::from_slice(&at[first..])),
                    material,
                    ..Triangle::default()
                });
            }
            _ => geometry.warnings.push(Warning {
                line: Some(index + 1),
                message: "no triangle".into(),
            }),
        }
    }
    Ok(geometry)
}

const BOTH: &[Format] = &[obj::FORMAT, TRIANGLES];

/// Loads a scene of a folder with these files.
fn scene(text: &str, files: &[(&str, &str)], formats: &[Format]) -> Result<Scene, SceneError> {
    let folder = tempfile::tempdir().expect("a folder");
    let camera = "[camera]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\nfov = 40\n";
    let text = format!("{camera}{text}");
    for (name, text) in files.iter().chain(&[("scene.toml", &text[..])]) {
        std::fs::write(folder.path().join(name), text).expect("it is written");
    }
    let path: PathBuf = folder.path().join("scene.toml");
    load_with(&path, formats, &[])
}

const OBJ: &str = "v 0 0 0\nv 2 0 0\nv 0 2 0\nusemtl red\nf 1 2 3\n";
const TRI: &str = "color red 0.8 0.1 0.25\n0 0 0 1 0 0 0 1 0 red\n\n0 0 1 1 0 1 0 1 1 blue\n";

#[test]
fn a_second_format_is_a_reader_and_a_row() {
    let text = "[[geometry]]\nfile = 'a.obj'\n\
        [[geometry]]\nfile = 'b.TRI'\nscale = 3\nplacements = [{ translate = [1, 0, 0] }]\n\
        [materials.\"*\"]\nfile = 'm.impasto'\nparams = { tint = '$color', rough = 0.5 }\n";
    let scene = scene(text, &[("a.obj", OBJ), ("b.TRI", TRI)], BOTH).expect("it loads");
    assert_eq!(scene.mesh.len(), 3);
    assert_eq!(
        scene.mesh.positions[1],
        [[1.0, 0.0, 0.0], [4.0, 0.0, 0.0], [1.0, 3.0, 0.0]].map(Vec3::from)
    );
    assert_eq!(scene.warnings, ["b.TRI:3: no triangle"]);
    // The OBJ file says no `color`, and what it lacks is what a list says of no color.
    assert_eq!(scene.mesh.materials, [0, 1, 0]);
    let tint = |m: usize| scene.materials[m].params[0].clone();
    assert_eq!(
        [tint(0), tint(1)],
        [[0.5, 0.5, 0.5], [0.8, 0.1, 0.25]]
            .map(|rgb| ("tint".to_owned(), ParameterValue::Floats(rgb.into())))
    );
}

#[test]
fn messages_say_what_the_table_holds() {
    let entry = |line: &str| format!("[[geometry]]\n{line}\n[materials.\"*\"]\nfile = 'm'\n");
    let said = |line: &str, files: &[(&str, &str)], formats: &[Format]| {
        let error = scene(&entry(line), files, formats).expect_err(line);
        error.to_string()
    };
    let unknown = said("file = 'a.ply'", &[], BOTH);
    assert!(
        unknown.contains("scene.toml:6:8: `a.ply` is in no format that is read here"),
        "{unknown}"
    );
    assert!(
        unknown.contains("OBJ (.obj), triangle list (.tri, .tris)"),
        "{unknown}"
    );
    let both = said("file = 'a.obj'\nobj = 'a.obj'", &[], BOTH);
    assert!(
        both.contains("needs one of `file`, `obj` and `gltf`"),
        "{both}"
    );
    // A name that is under `obj` need not say so.
    let flat = "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n";
    let empty = said("obj = 'a.txt'", &[("a.txt", flat)], FORMATS);
    assert!(
        empty.contains("no face of its OBJ, PLY, glTF or USD files"),
        "{empty}"
    );
    let unnamed = "[[geometry]]\nfile = 'a.obj'\n[materials.m]\nfile = 'm'\nparams.p = '$colour'\n";
    let unnamed = scene(unnamed, &[], BOTH).expect_err("no such value");
    let expected = "no value of an MTL file or a list of triangles";
    assert!(unnamed.to_string().contains(expected), "{unnamed}");
}

#[test]
fn objects_and_groups_have_their_triangles() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = "v 0 0 0\nv 2 0 0\nv 0 2 0\nv 2 2 0\nf 1 2 3\no lid\ng empty\ng rim of it\nf 1 2 4 3\n\
                usemtl a\nf 1 2 3\no foot\nf 1 2 3\ng last\n";
    std::fs::write(folder.path().join("a.obj"), text).expect("it is written");
    let geometry = (obj::FORMAT.read)(folder.path(), "a.obj", 0.0).expect("it is read");
    let parts: Vec<(&str, Range<usize>)> = geometry
        .parts
        .iter()
        .map(|part| (part.name.as_str(), part.triangles.clone()))
        .collect();
    assert_eq!(parts, [("lid", 1..4), ("rim of it", 1..4), ("foot", 4..5)]);
    assert_eq!(geometry.triangles.len(), 5);
}

#[test]
fn a_scene_reads_ply_files_beside_obj_files() {
    let ply = "ply\nformat ascii 1.0\ncomment TextureFile wood.png\nelement vertex 3\nproperty float x\n\
        property float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\n\
        end_header\n0 0 0\n1 0 0\n0 3 0\n3 0 1 2\n";
    let text = "[[geometry]]\nobj = 'a.obj'\n[[geometry]]\nfile = 'b.PLY'\n\
        [[geometry]]\nobj = 'b.PLY'\ntranslate = [0, 0, 1]\nmaterial = 'm'\n\
        [materials.\"*\"]\nfile = 'm.impasto'\nparams = { picture = '$TextureFile' }\n\
        [materials.m]\nfile = 'm.impasto'\n";
    let scene = scene(text, &[("a.obj", OBJ), ("b.PLY", ply)], FORMATS).expect("it loads");
    assert_eq!(scene.mesh.positions[1][2], Vec3::new(0.0, 3.0, 0.0));
    assert_eq!(scene.mesh.len(), 3);
    let picture = ParameterValue::Texture("wood.png".into());
    let params: Vec<_> = scene.materials.iter().map(|m| m.params.clone()).collect();
    // The OBJ file names no picture, so that its binding is the same as `m`.
    assert_eq!(params, [vec![], vec![("picture".to_owned(), picture)]]);
}
