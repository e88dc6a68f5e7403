//! Scene files: what good ones become, and what is said about broken ones.

use std::path::{Path, PathBuf};

use glam::{Vec2, Vec3};
use impasto_fuzz::scenes::HostileScene;
use impasto_runtime::error::SceneError;
use impasto_runtime::scene::{EnvironmentSource, Integrator, NO_MATERIAL, Scene};
use impasto_runtime::world::lights::distant::DistantLight;
use impasto_runtime::world::lights::quad::QuadLight;
use impasto_runtime::world::load;

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/scenes")
        .join(name)
}

/// Every file of `broken` says in its first lines what its error must contain.
#[test]
fn broken_scenes_are_explained() {
    let mut count = 0;
    let mut failures = String::new();
    for entry in std::fs::read_dir(folder("broken")).expect("the folder is there") {
        let path = entry.expect("it can be listed").path();
        if path.extension().is_none_or(|e| e != "toml") {
            continue;
        }
        count += 1;
        let text = std::fs::read_to_string(&path).expect("it can be read");
        let expected: Vec<&str> = text
            .lines()
            .filter_map(|l| l.strip_prefix("# expect: "))
            .collect();
        let said = load(&path)
            .err()
            .map_or("nothing".into(), |e| e.to_string());
        let missing: Vec<_> = expected
            .iter()
            .filter(|part| !said.contains(**part))
            .collect();
        if expected.is_empty() || !missing.is_empty() {
            failures += &format!("{}: missing {missing:#?} in\n{said}\n", path.display());
        }
    }
    assert!(failures.is_empty(), "{failures}");
    assert!(count >= 40, "{count} scenes were found");
}

fn room() -> Scene {
    load(&folder("good/room.toml")).expect("it loads")
}

#[test]
fn a_scene_has_what_its_file_says() {
    let room = room();
    assert_eq!(
        (room.name.as_str(), &room.base),
        ("a room", &folder("good"))
    );
    assert_eq!(
        (room.camera.up, room.camera.focus, room.camera.aperture),
        (Vec3::Y, 5.0, 0.0)
    );
    assert_eq!(
        room.integrator,
        Integrator {
            max_depth: 5,
            roulette_start: 4
        }
    );
    let environment = room.environment.expect("there is one");
    assert_eq!(
        environment.source,
        EnvironmentSource::Uniform(Vec3::new(0.5, 1.0, 1.5))
    );
    assert!(!environment.sample);
    let [quad, sun] = &room.lights[..] else {
        panic!("{:?}", room.lights);
    };
    let quad: &QuadLight = quad.get().expect("it is a quad");
    let sun: &DistantLight = sun.get().expect("it is far away");
    assert_eq!(
        (quad.radiance, quad.two_sided),
        (Vec3::new(1.0, 2.0, 3.0), false)
    );
    assert_eq!(
        (sun.to_light, sun.irradiance, sun.angle),
        (Vec3::Y, Vec3::splat(3.0), 0.0)
    );
}

#[test]
fn geometry_is_cut_into_triangles_and_placed() {
    let mesh = room().mesh;
    // Twice: the quad's two triangles, two single ones and three of the pentagon; and a quad light. Where all
    // have one material, a triangle of the pentagon is the first of the single ones.
    assert_eq!(mesh.len(), 7 + 6 + 2);
    // x -> -z and z -> x by a quarter turn about y, after doubling.
    let near = |a: Vec3, b: [f32; 3]| a.distance(b.into()) < 1e-5;
    let [a, b, c] = mesh.positions[0];
    assert!(near(a, [10.0, 0.0, 0.0]) && near(b, [10.0, 0.0, -2.0]) && near(c, [10.0, 2.0, -2.0]));
    let normals = mesh.normals[0].expect("it has normals");
    assert!(normals.iter().all(|n| near(*n, [1.0, 0.0, 0.0])));
    assert_eq!(mesh.uvs[1], [Vec2::ZERO, Vec2::ONE, Vec2::Y]);
    // No normals are made up for faces without; those with decide which side is outside.
    assert_eq!(mesh.normals[2], None);
    let [a, b, c] = mesh.positions[7 + 3];
    assert_eq!([a, b, c], [Vec3::ZERO, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
    // A fourth coordinate divides the others.
    assert!(
        mesh.positions[7..13]
            .iter()
            .flatten()
            .any(|p| *p == Vec3::new(1.0, 1.0, 0.0))
    );
    assert!(!mesh.positions[7..13].iter().flatten().any(|p| p.x > 1.0));
    // The quad light comes last.
    assert_eq!(mesh.materials[13..], [NO_MATERIAL; 2]);
    assert_eq!(mesh.lights[12..], [None, Some(0), Some(0)]);
    assert_eq!(
        mesh.positions[13],
        [[0.0, 3.0, 0.0], [1.0, 3.0, 0.0], [1.0, 3.0, 1.0]].map(Vec3::from)
    );
}

#[test]
fn materials_are_bound_by_name() {
    let room = room();
    let params = |i: usize| -> Vec<String> {
        room.materials[i]
            .params
            .iter()
            .map(|(k, v)| format!("{k} = {v}"))
            .collect()
    };
    let names: Vec<&str> = room.materials.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["wall paper", "lamp", "unlisted", "glass"]);
    let wall = [
        "base = color(0.25, 0.25, 0.25)",
        "glow = color(0.0, 0.0, 0.0)",
        "picture = \"tex/paper/blue.png\"",
    ];
    assert_eq!(params(0), wall);
    // Without a picture the parameter keeps its default.
    assert_eq!(
        params(1),
        ["base = color(0.1, 0.2, 0.3)", "glow = color(4.0, 5.0, 6.0)"]
    );
    assert_eq!(
        params(2),
        ["base = color(0.8, 0.8, 0.8)", "glow = color(0.0, 0.0, 0.0)"]
    );
    let glass = [
        "ior = 1.5",
        "rough = true",
        "steps = 3",
        "thickness = 0.6 mm",
        "tint = color(1.0, 0.5, 0.25)",
        "uv = vec2(1.0, 2.0)",
    ];
    let mut sorted = params(3);
    sorted.sort();
    assert_eq!(sorted, glass);
    assert_eq!(room.materials[3].material.as_deref(), Some("thin"));
    assert_eq!(room.materials[3].file, "../m/glass.impasto");
    assert_eq!(
        room.mesh.materials,
        [
            0,
            0,
            1,
            1,
            2,
            2,
            2,
            3,
            3,
            3,
            3,
            3,
            3,
            NO_MATERIAL,
            NO_MATERIAL
        ]
    );
}

#[test]
fn oddities_are_told() {
    let warnings = room().warnings;
    let has = |part: &str| warnings.iter().any(|w| w.contains(part));
    assert!(
        has("room.obj: triangles without area, left out: 1"),
        "{warnings:?}"
    );
    assert!(
        has("triangles wound against their normals, turned over: 1"),
        "{warnings:?}"
    );
    assert!(
        has("faces of fewer than three corners, left out: 1"),
        "{warnings:?}"
    );
    assert!(
        has("room.obj: faces that cross themselves, cut into triangles that overlap: 1"),
        "{warnings:?}"
    );
    assert!(
        has("the scene: triangles that are where equal ones are, left out: 1"),
        "{warnings:?}"
    );
    assert!(has("nothing uses the material `unused`"), "{warnings:?}");
}

/// The example of the manual: a frame whose opening an edge, there and back, joins to the outline; and a dart
/// with normals and texture coordinates, which stay with their corners.
#[test]
fn concave_faces_and_faces_with_holes_are_cut_along_their_outline() {
    let obj = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 2 0\nv 2 2 0\nv 2 1 0\n\
               f 1 2 3 4 1 5 6 7 8 5\n\
               v 9 0 0\nv 11 -1 0\nv 9.5 0 0\nv 11 1 0\nvn 0 0 1\n\
               vt 9 0\nvt 11 -1\nvt 9.5 0\nvt 11 1\nf 10/2/1 11/3/1 12/4/1 9/1/1\n";
    let scene = load_with(&[("t.obj", obj.into())], "").expect("it loads");
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let area = |[a, b, c]: &[Vec3; 3]| 0.5 * (b - a).cross(c - a).z;
    let areas: Vec<f32> = scene.mesh.positions.iter().map(area).collect();
    assert!(areas.iter().all(|area| *area > 0.0), "{areas:?}");
    assert!(
        (areas[..8].iter().sum::<f32>() - 15.0).abs() < 1e-5,
        "{areas:?}"
    );
    assert!(
        (areas[8..].iter().sum::<f32>() - 0.5).abs() < 1e-5,
        "{areas:?}"
    );
    for (corners, uvs) in scene.mesh.positions[8..].iter().zip(&scene.mesh.uvs[8..]) {
        assert_eq!(corners.map(|c| Vec2::new(c.x, c.y)), *uvs);
    }
}

/// Loads a scene of one triangle from a folder of its own, with more files and text.
fn load_with(files: &[(&str, Vec<u8>)], text: &str) -> Result<Scene, SceneError> {
    let folder = tempfile::tempdir().expect("a folder");
    let mut all = "[camera]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\nfov = 40\n".to_owned();
    all += "[[geometry]]\nobj = \"t.obj\"\n[materials.\"*\"]\nfile = \"x.impasto\"\n";
    let triangle = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_vec();
    let write = |name: &str, bytes: &[u8]| {
        std::fs::write(folder.path().join(name), bytes).expect("it is written")
    };
    write("t.obj", &triangle);
    for (name, bytes) in files {
        write(name, bytes);
    }
    write("scene.toml", (all + text).as_bytes());
    load(&folder.path().join("scene.toml"))
}

#[test]
fn identical_bindings_are_one_material() {
    let obj =
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 1 3 2\nusemtl c\nf 1 2 3\n";
    let text =
        "[materials.b]\nfile = \"x.impasto\"\n[materials.c]\nfile = \"x.impasto\"\nparams.k = 1\n";
    let scene = load_with(&[("t.obj", obj.into())], text).expect("it loads");
    assert_eq!(scene.mesh.materials, [0, 0, 1]);
    assert_eq!(
        scene
            .materials
            .iter()
            .map(|m| m.name.as_str())
            .collect::<Vec<_>>(),
        ["x", "c"]
    );
}

#[test]
fn a_missing_mtl_file_nobody_needs_is_a_warning() {
    let obj = "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";
    let scene = load_with(&[("t.obj", obj.into())], "").expect("it loads");
    assert!(
        scene.warnings.iter().any(|w| w.contains("gone.mtl")),
        "{:?}",
        scene.warnings
    );
}

#[test]
fn files_that_are_cut_short_never_panic() {
    // Every prefix of an OBJ file, an MTL file and a scene loads or is explained.
    let good = folder("good");
    let read = |name: &str| std::fs::read(good.join(name)).expect("it can be read");
    let (obj, mtl, toml) = (read("room.obj"), read("tex/room.mtl"), read("room.toml"));
    let text = "[materials.glass]\nfile = \"g.impasto\"\nparams = { base = \"$Kd\" }\n";
    for end in 0..obj.len() {
        let _ = load_with(&[("t.obj", obj[..end].to_vec())], text);
    }
    let head = "mtllib t.mtl\nusemtl lamp\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    for end in 0..mtl.len() {
        let text = "[materials.lamp]\nfile = \"g.impasto\"\nparams = { base = \"$Kd\" }\n";
        let _ = load_with(
            &[("t.obj", head.into()), ("t.mtl", mtl[..end].to_vec())],
            text,
        );
    }
    for end in 0..toml.len() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("s.toml"), &toml[..end]).expect("it is written");
        assert!(
            load(&folder.path().join("s.toml")).is_err(),
            "there is no OBJ file"
        );
    }
}

#[test]
fn environment_maps_keep_their_range_and_repair_what_is_no_radiance() {
    let pixels = vec![
        1e6,
        -2.0,
        f32::NAN,
        f32::INFINITY,
        0.5,
        0.25,
        0.0,
        1.0,
        2.0,
        3.0,
        4.0,
        5.0,
    ];
    let image = image::Rgb32FImage::from_raw(2, 2, pixels).expect("four pixels");
    let mut exr = std::io::Cursor::new(Vec::new());
    image
        .write_to(&mut exr, image::ImageFormat::OpenExr)
        .expect("it is encoded");
    let exr = exr.into_inner();
    let text = "[environment]\nfile = \"sky.exr\"\nscale = 2\nrotate = 30\n";
    let scene = load_with(&[("sky.exr", exr.clone())], text).expect("it loads");
    let environment = scene.environment.expect("there is one");
    assert!(environment.sample && environment.rotate == 30.0);
    let EnvironmentSource::Map(map) = environment.source else {
        panic!("a map");
    };
    assert_eq!((map.width, map.height), (2, 2));
    assert_eq!(map.texels[0], Vec3::new(2e6, 0.0, 0.0));
    assert_eq!(map.texels[1], Vec3::new(131_008.0, 1.0, 0.5));
    assert!(
        scene
            .warnings
            .iter()
            .any(|w| w.starts_with("sky.exr: ") && w.ends_with(": 3")),
        "{:?}",
        scene.warnings
    );
    // Cut short anywhere, it is an error and no panic.
    for end in (0..exr.len()).step_by(7) {
        let error = load_with(&[("sky.exr", exr[..end].to_vec())], text);
        assert!(error.is_err(), "{end} of {} bytes load", exr.len());
    }
}

/// Where several lights are equal they are one, and the scene is that of the one.
#[test]
fn a_light_that_is_there_twice_shines_once() {
    for name in ["quads", "glowing"] {
        let hostile = HostileScene::named(name).expect("a row of the table");
        let [one, three] = [1, 3].map(|count| {
            let folder = tempfile::tempdir().expect("a folder");
            let path = hostile
                .write(count, folder.path())
                .expect("it can be written");
            load(&path).expect("it loads")
        });
        assert_eq!(one.mesh, three.mesh, "{name}");
        assert!(one.warnings.is_empty(), "{:?}", one.warnings);
        let warned = |part: &str| three.warnings.iter().any(|w| w.contains(part));
        assert!(
            warned("that are where equal ones are, left out: 2"),
            "{:?}",
            three.warnings
        );
    }
}

/// Lights in one place that differ in anything are different lights.
#[test]
fn lights_in_one_place_that_differ_all_stay() {
    let quads = HostileScene::named("quads").expect("a row of the table");
    let folder = tempfile::tempdir().expect("a folder");
    let path = quads.write(3, folder.path()).expect("it can be written");
    let text = std::fs::read_to_string(&path).expect("it can be read");
    let text = text.replacen("radiance = 3.0", "radiance = 3.0\ngroup = 'key'", 1);
    let text = text.replacen("radiance = 3.0\n[[", "radiance = 2.0\n[[", 1);
    std::fs::write(&path, text).expect("it can be written");
    let scene = load(&path).expect("it loads");
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    assert_eq!(scene.mesh.len(), 1 + 3 * 2);
}
