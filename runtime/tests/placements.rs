//! What scenes say of placements, and what becomes of it.

use std::fmt::Write;

use crate::support::worlds::kernel_parts;
use glam::{Vec2, Vec3};
use impasto_runtime::error::SceneError;
use impasto_runtime::scene::Scene;
use impasto_runtime::technique::{Copies, Stack, Technique};
use impasto_runtime::world::KernelParts;
use impasto_runtime::world::Split;
use impasto_runtime::world::load;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\n\
                        usemtl leaf\nf 1//1 2//1 3//1\nusemtl wood\nf 1 2 3\n";

/// A strip of many triangles.
fn strip(triangles: usize) -> String {
    let mut text = String::new();
    for i in 0..triangles + 2 {
        let _ = writeln!(text, "v {} {} 0", i / 2, i % 2);
    }
    for i in 1..=triangles {
        let _ = writeln!(text, "f {i} {} {}", i + 1, i + 2);
    }
    text
}

fn load_with(files: &[(&str, String)], toml: &str) -> Result<Scene, SceneError> {
    let folder = tempfile::tempdir().expect("a folder");
    let head = "camera = { position = [0, 0, 5], look_at = [0, 0, 0], fov = 40 }\n\
                [environment]\ncolor = 1\n\
                [materials.\"*\"]\nfile = \"x.impasto\"\n\
                [materials.red]\nfile = \"x.impasto\"\nparams.k = 1\n\
                [materials.blue]\nfile = \"x.impasto\"\nparams.k = 2\n";
    let scene = (String::from("scene.toml"), head.to_owned() + toml);
    let files = files
        .iter()
        .map(|(name, text)| ((*name).to_owned(), text.clone()));
    for (name, text) in files.chain([scene, ("t.obj".into(), TRIANGLE.into())]) {
        std::fs::write(folder.path().join(name), text).expect("it is written");
    }
    load(&folder.path().join("scene.toml"))
}

const LISTED: &str = "[[geometry]]
obj = 't.obj'
share = true
scale = 2
placements = [
  { translate = [1, 0, 0] },
  { rotate = [0, 0, 90], scale = [1, -1, 1], material = 'red' },
  { matrix = [0, 0, 1, 5, 0, 1, 0, 6, 1, 0, 0, 7], material = 'blue' },
]
";

#[test]
fn placements_apply_after_their_entry() {
    let scene = load_with(&[], LISTED).expect("it loads");
    assert!(scene.mesh.is_empty());
    assert_eq!((scene.objects.len(), scene.placements.len()), (1, 3));
    assert_eq!(scene.objects[0].mesh.materials, [0, 1]);
    let at = |index: usize, p: [f32; 3]| scene.placements[index].transform.point(p.into());
    let near = |a: Vec3, b: [f32; 3]| a.distance(b.into()) < 1e-5;
    assert!(near(at(0, [1.0, 0.0, 0.0]), [3.0, 0.0, 0.0]));
    assert!(near(at(1, [1.0, 2.0, 0.0]), [4.0, 2.0, 0.0]));
    assert!(near(at(2, [1.0, 2.0, 3.0]), [11.0, 10.0, 9.0]));
    let materials: Vec<&[u32]> = scene.placements.iter().map(|p| &*p.materials).collect();
    assert_eq!(materials, [[0, 0], [1, 1], [2, 2]]);
}

#[test]
fn a_file_of_placements_says_the_same() {
    let listed = load_with(&[], LISTED).expect("it loads");
    let table =
        "# three of them\nx, y, z, rz, sy, material\n1 0 0 0 1 -\n\n0 0 0 90 -1 red # mirrored\n";
    let matrix = "m00 m01 m02 m03 m10 m11 m12 m13 m20 m21 m22 m23 material\n\
                  0 0 1 5  0 1 0 6  1 0 0 7  blue\n";
    let entry = |file: &str| {
        format!("[[geometry]]\nobj = 't.obj'\nshare = true\nscale = 2\nplacements = '{file}'\n")
    };
    let files = [("a.txt", table.to_owned()), ("b.csv", matrix.to_owned())];
    let filed = load_with(&files, &(entry("a.txt") + &entry("b.csv"))).expect("it loads");
    assert_eq!(filed.objects, listed.objects);
    assert_eq!(filed.placements, listed.placements);
}

#[test]
fn what_is_repeated_often_is_shared_and_nothing_else() {
    let counts = |triangles: usize, toml: &str| {
        let scene = load_with(&[("s.obj", strip(triangles))], toml).expect("it loads");
        (
            scene.mesh.len(),
            scene.objects.len(),
            scene.placements.len(),
        )
    };
    let entry = "[[geometry]]\nobj = 's.obj'\n";
    // Each at a place of its own, and none at that of an entry without placements.
    let place = |index: usize| format!("{{ translate = [0, 0, {}] }}, ", index + 1);
    let places = |times: usize| (0..times).map(place).collect::<String>();
    let many = |times: usize| format!("{entry}placements = [{}]\n", places(times));
    // 2^20 triangles saved.
    assert_eq!(counts(4096, &many(257)), (0, 1, 257));
    assert_eq!(counts(4095, &many(257)), (257 * 4095, 0, 0));
    assert_eq!(counts(4096, &many(256)), (256 * 4096, 0, 0));
    // Entries of the same file count together.
    assert_eq!(counts(4096, &(many(256) + entry)), (0, 1, 257));
    assert_eq!(
        counts(4096, &(many(257) + "share = false\n")),
        (257 * 4096, 0, 0)
    );
    // Those that decide for themselves do not count.
    let own = many(257) + "share = false\n" + entry;
    assert_eq!(counts(4096, &own), (258 * 4096, 0, 0));
    assert_eq!(counts(10, &format!("{entry}share = true\n")), (0, 1, 1));
}

#[test]
fn copies_are_placed_triangles() {
    let placed = load_with(&[], LISTED).expect("it loads");
    let copied = load_with(&[], &LISTED.replace("share = true", "share = false"));
    let copied = copied.expect("it loads");
    assert!(copied.objects.is_empty());
    let flat = Split::new(&placed, &[], Copies::Flat).expect("it fits");
    assert_eq!(flat.world.positions.len(), 6);
    for (a, b) in flat
        .world
        .positions
        .iter()
        .flatten()
        .zip(copied.mesh.positions.iter().flatten())
    {
        assert!(a.distance(*b) < 1e-6, "{a} {b}");
    }
    assert_eq!(flat.world.materials, copied.mesh.materials);
    assert_eq!(flat.world.normals.len(), copied.mesh.normals.len());
    let normals = flat.world.normals.iter().zip(&copied.mesh.normals);
    for (a, b) in normals {
        assert_eq!(a.is_some(), b.is_some());
        let pairs = a.iter().flatten().zip(b.iter().flatten());
        assert!(pairs.clone().all(|(a, b)| a.distance(*b) < 1e-6));
    }
    assert_eq!(copied.warnings, placed.warnings);
}

#[test]
fn too_many_copies_are_an_error_before_they_fill_the_memory() {
    let mut places = String::from("x y z\n");
    (0..100_000).for_each(|i| places += &format!("{i} 0 0\n"));
    let files = [("s.obj", strip(1000)), ("p.txt", places)];
    let entry = "[[geometry]]\nobj = 's.obj'\nplacements = 'p.txt'\n";
    let shared = load_with(&files, entry).expect("100 M triangles are fine if they are shared");
    let counts = Split::new(&shared, &[], Copies::Shared)
        .expect("it fits")
        .counts();
    assert_eq!(
        (counts.triangles, counts.placed_triangles),
        (1000, 100_000_000)
    );
    let error = Split::new(&shared, &[], Copies::Flat).expect_err("too many");
    assert!(error.to_string().contains("100000000 triangles"), "{error}");
    assert!(shared.flattened().is_err());
    let error = load_with(&files, &format!("{entry}share = false\n")).expect_err("too many");
    let text = error.to_string();
    assert!(text.contains("more than 89478485 triangles"), "{text}");
    assert!(text.contains("share = false"), "{text}");
}

#[test]
fn a_sample_of_copies_has_something_of_everything() {
    let mut places = String::from("x y z material\n");
    for i in 0..1000 {
        let _ = writeln!(places, "{i} 0 0 {}", if i == 777 { "red" } else { "blue" });
    }
    let files = [("s.obj", strip(10)), ("p.txt", places)];
    let toml = "[[geometry]]\nobj = 't.obj'\n\
                [[geometry]]\nobj = 's.obj'\nshare = true\nplacements = 'p.txt'\n";
    let scene = load_with(&files, toml).expect("it loads");
    let all = scene.sampled(usize::MAX);
    assert_eq!(
        (all.len(), *all == scene.flattened().expect("it fits").mesh),
        (10_002, true)
    );
    let some = scene.sampled(1000);
    assert!((900..1100).contains(&(some.len() - 2)), "{}", some.len());
    // Each list of materials is there, and places from all of the file.
    let lists: std::collections::BTreeSet<u32> = some.materials.iter().copied().collect();
    assert_eq!(lists.len(), 3);
    let far = some.positions.iter().filter(|p| p[0].x > 500.0).count();
    assert!((350..650).contains(&far), "{far}");
    let none = scene.sampled(0);
    assert_eq!(none.len(), 2 + 2 * 10);
}

fn parts(scene: &Scene, technique: &Technique) -> Result<KernelParts, SceneError> {
    kernel_parts(scene, &[], technique)
}

#[test]
fn a_scene_without_placements_has_no_trace_of_them() {
    let mut copied = load_with(&[], &LISTED.replace("share = true", "share = false"));
    let copied = copied.as_mut().expect("it loads");
    copied.mesh.uvs = vec![[Vec2::ZERO, Vec2::X, Vec2::Y]; copied.mesh.len()];
    let placed = load_with(&[], LISTED).expect("it loads");
    let text = |scene: &Scene, copies: Copies| {
        let technique = Technique {
            copies,
            ..Technique::default()
        };
        let parts = parts(scene, &technique).expect("it builds");
        let all = [parts.geometry, parts.bvh, parts.surface];
        let buffers = all.iter().flat_map(|p| p.buffers.iter().map(|b| b.name));
        let buffers: Vec<&str> = buffers.collect();
        (all.map(|p| p.wgsl).concat().to_lowercase(), buffers)
    };
    let (single, buffers) = text(copied, Copies::Shared);
    assert!(
        !single.contains("placement") && !single.contains('#'),
        "{single}"
    );
    assert_eq!(
        buffers,
        ["triangles", "bvh_nodes", "vertex_normals", "vertex_uvs"]
    );
    let (two, buffers) = text(&placed, Copies::Shared);
    assert!(two.contains("placement") && !two.contains('#'));
    assert!(buffers.contains(&"placements") && !buffers.contains(&"vertex_uvs"));
    let (flat, _) = text(&placed, Copies::Flat);
    assert!(!flat.contains("placement"));
}

#[test]
fn a_trail_does_not_lead_through_two_levels() {
    let scene = load_with(&[], LISTED).expect("it loads");
    let mut technique = Technique {
        stack: Stack::Trail,
        ..Technique::default()
    };
    let error = parts(&scene, &technique)
        .expect_err("it is refused")
        .to_string();
    assert!(
        error.contains("--stack trail") && error.contains("--copies flat"),
        "{error}"
    );
    technique.copies = Copies::Flat;
    assert!(parts(&scene, &technique).is_ok());
}
