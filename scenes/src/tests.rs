//! What every generated scene keeps to.

use std::collections::BTreeSet;
use std::hash::Hasher as _;
use std::sync::LazyLock;

use super::*;
use crate::check::{defects, is_closed, pieces, signed_volume};

/// The root of the repository.
fn root() -> &'static Path {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    manifest.parent().unwrap_or(manifest)
}

static MODELS: LazyLock<Vec<(&str, Model)>> = LazyLock::new(|| {
    let mut models = forest::models();
    models.extend([
        ("cornell", cornell::build()),
        ("carpaint", carpaint::build()),
        ("city", city::build()),
        ("conference", conference::build()),
        ("glasses", glasses::build()),
        ("materials_preview", preview::build()),
        ("swatches", swatches::ball()),
        ("swatches' stage", swatches::stage()),
        ("crossover", crossover::ball()),
        ("crossover's panel", crossover::panel()),
        ("mixes' room", mixes::room()),
        ("mixes' booths", mixes::booths()),
    ]);
    models
});

fn model(name: &str) -> &'static Model {
    let found = MODELS.iter().find(|(known, _)| *known == name);
    &found.expect("a scene of the list").1
}

#[test]
fn scenes_have_as_many_triangles_as_the_papers() {
    assert_eq!(model("carpaint").mesh.triangle_count(), 9_500);
    // Leaves are pairs of triangles, in two materials a plant.
    assert!(
        model("conference")
            .mesh
            .triangle_count()
            .abs_diff(conference::TRIANGLES)
            <= 1
    );
    assert!(
        model("city")
            .mesh
            .triangle_count()
            .abs_diff(city::TRIANGLES)
            <= 1
    );
}

#[test]
fn no_scene_has_empty_triangles_or_bad_normals() {
    for (name, model) in MODELS.iter() {
        assert_eq!(defects(&model.mesh), [""; 0], "in {name}");
    }
}

#[test]
fn things_that_need_an_inside_are_closed_and_face_outward() {
    let closed = [
        ("cornell", &["glass", "gold", "car_paint"][..]),
        ("carpaint", &["car_paint"]),
        ("city", &["rubber", "lamp", "paint_white"]),
        ("conference", &["glass", "chair", "chrome", "ceramic"]),
        ("glasses", &["glass", "amber", "mint", "ice", "ruby"]),
        ("materials_preview", &["sample", "foot"]),
        ("swatches", &["ball"]),
        ("crossover", &["ball"]),
    ];
    for (name, materials) in closed {
        let mesh = &model(name).mesh;
        for material in materials {
            let found = pieces(mesh, material);
            assert!(!found.is_empty(), "{name} has no {material}");
            for piece in found {
                assert!(is_closed(&piece), "a {material} of {name} is open");
                let volume = signed_volume(&mesh.positions, &piece);
                assert!(
                    volume > 0.0,
                    "a {material} of {name} is inside out: {volume}"
                );
            }
        }
    }
}

#[test]
fn every_material_of_a_mesh_is_in_its_library_and_the_reverse() {
    for (name, model) in MODELS.iter() {
        let used: BTreeSet<&str> = model.mesh.parts.iter().map(|part| part.material).collect();
        let listed: BTreeSet<&str> = model.materials.iter().map(|entry| entry.name).collect();
        assert_eq!(used, listed, "in {name}");
    }
}

#[test]
fn files_are_the_same_bytes_everywhere() {
    let digests = GENERATORS.map(|generator| {
        let files = (generator.generate)().expect("generates");
        (generator.name, digest(&files))
    });
    // Changes on purpose are entered here.
    let expected = [
        ("cornell", 0x11da_1ac4_796a_d0dc),
        ("carpaint", 0x8535_ed71_b640_384d),
        ("city", 0x2a31_d0ee_3cc0_83a1),
        ("conference", 0xa943_3770_13bf_c583),
        ("forest", 0xb261_1370_33f7_fb59),
        ("glasses", 0xd945_0bdb_e980_7eed),
        ("materials_preview", 0x3739_15af_d0b9_95a5),
        ("swatches", 0xe59a_e850_5f72_177b),
        ("crossover", 0xec98_823f_79b1_c902),
        ("textures", 0x0cdf_4d4d_b6dd_e235),
    ];
    assert_eq!(digests, expected, "{digests:#x?}");
}

fn digest(files: &[GeneratedFile]) -> u64 {
    let mut hash = Fnv(0xcbf2_9ce4_8422_2325);
    for file in files {
        hash.write(file.path.as_bytes());
        hash.write(&file.bytes);
    }
    hash.finish()
}

/// FNV-1a, whose values are the same on every machine and in every release of Rust.
struct Fnv(u64);

impl std::hash::Hasher for Fnv {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

#[test]
fn committed_files_are_what_the_generator_writes() {
    for name in ["cornell", "materials_preview", "swatches", "textures"] {
        for file in generate(name).expect("generates") {
            let on_disk = std::fs::read(root().join(&file.path)).unwrap_or_default();
            assert!(
                on_disk == file.bytes,
                "{}: run `cargo scenes {name}`",
                file.path
            );
        }
    }
}

#[test]
fn unknown_names_are_refused_with_those_that_are_known() {
    let error = generate("kornell").expect_err("there is no such scene");
    assert!(
        error.contains("`kornell`") && error.contains("conference"),
        "{error}"
    );
}
