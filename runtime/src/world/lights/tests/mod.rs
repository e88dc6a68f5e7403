//! A kind more goes the way of all others: lights at a point, which CONTRIBUTING.md shows.

use std::path::Path;

use glam::DVec3;

use super::*;
use crate::scene::formats::FORMATS;
use crate::scene::load_with;
use crate::world::needs::ROWS;
use point::PointLight;

mod point;

fn kinds() -> Vec<LightKind> {
    let all = LIGHT_KINDS.iter().copied();
    all.chain([point::KIND]).collect()
}

/// A scene of one triangle with these entries, far from the world's origin.
fn scene(lights: &str) -> Result<Scene, SceneError> {
    let folder = tempfile::tempdir().expect("a folder");
    let text = "[camera]\nposition = [100000, 0, 5]\nlook_at = [100000, 0, 0]\nfov = 40\n\
                [[geometry]]\nobj = 'a.obj'\ntranslate = [100000, 0, 0]\n\
                [materials.\"*\"]\nfile = 'm.impasto'\n";
    let path = folder.path().join("scene.toml");
    let obj = "v 0 0 0\nv 2 0 0\nv 0 2 0\nf 1 2 3\n";
    std::fs::write(folder.path().join("a.obj"), obj).expect("it is written");
    std::fs::write(&path, format!("{text}{lights}")).expect("it is written");
    load_with(&path, FORMATS, &readers(&kinds()))
}

/// The lights of a scene.
fn lights_of(scene: &Scene, table: &[LightKind]) -> Kinds {
    let (mesh, media) = (&scene.mesh, Media::default());
    let primitives: Vec<u32> = (0..mesh.len() as u32).collect();
    let context = Context::new(scene, mesh, mesh.bounds(), &primitives, &[], &media);
    Kinds::of(table, &context)
}

/// Validates a part that asks nothing of surfaces.
fn validate(part: &ShaderPart) {
    let mut wgsl = mis().wgsl + "struct Run { none: u32 }\n";
    wgsl += "@group(1) @binding(0) var<uniform> run: Run;\n";
    for (
        at,
        BufferData {
            name, wgsl_type, ..
        },
    ) in part.buffers.iter().enumerate()
    {
        wgsl += &format!("@group(0) @binding({at}) var<storage, read> {name}: {wgsl_type};\n");
    }
    wgsl += &part.wgsl;
    let module = naga::front::wgsl::parse_str(&wgsl);
    let module = module.unwrap_or_else(|e| panic!("{}\n{wgsl}", e.emit_to_string(&wgsl)));
    let (all, none) = (naga::valid::ValidationFlags::all(), Default::default());
    let mut validator = naga::valid::Validator::new(all, none);
    let valid = validator.validate(&module);
    valid.unwrap_or_else(|e| panic!("{}\n{wgsl}", e.emit_to_string(&wgsl)));
}

const SUN: &str = "[[lights]]\nkind = 'distant'\nto_light = [0, 1, 0]\nirradiance = 3\n";
const POINT: &str =
    "[[lights]]\nkind = 'point'\nposition = [100000, 1, 2]\nintensity = [4, 5, 6]\n";

#[test]
fn a_kind_is_a_file_with_its_wgsl_and_a_row() {
    let scene = scene(&format!("{POINT}{SUN}")).expect("it loads");
    assert_ne!(scene.origin, DVec3::ZERO);
    let point: &PointLight = scene.lights[0].get().expect("a point");
    let expected = (DVec3::new(1e5, 1.0, 2.0) - scene.origin).as_vec3();
    assert_eq!(point.position, expected);
    assert_eq!(scene.lights[1].get::<PointLight>(), None);
    assert_eq!(scene.mesh.len(), 1);

    let lights = lights_of(&scene, &kinds());
    let needs = Needs::of_rows(&[Need::LightChoice, Need::DirectionalLights]);
    let part = lights.written(&kinds(), needs);
    let calls = "    if pick.light < 1u { return sample_distant_light(pick, position); }\n    \
                 return sample_point_light(pick, position);\n";
    assert!(part.wgsl.contains(calls), "{}", part.wgsl);
    assert!(part.wgsl.contains("const FIRST_POINT_LIGHT: u32 = 1u;\n"));
    let buffers: Vec<&str> = part.buffers.iter().map(|b| b.name).collect();
    assert_eq!(buffers, ["light_table", "point_lights"]);
    validate(&part);
}

#[test]
fn a_kind_that_a_scene_lacks_is_there_if_its_row_asks_for_it_alone() {
    let scene = scene(SUN).expect("it loads");
    let mut table = kinds();
    table.last_mut().expect("a kind").needs = &[Need::Lens];
    let lights = lights_of(&scene, &table);
    let without = lights.written(&table, Needs::of_rows(&[Need::DirectionalLights]));
    assert!(!without.wgsl.contains("point_light"), "{}", without.wgsl);
    assert_eq!(without.buffers.len(), 1);
    let needs = Needs::of_rows(&[Need::DirectionalLights, Need::Lens]);
    let idle = lights.written(&table, needs);
    let call = "if pick.light < run.none { return sample_point_light(pick, position); }";
    assert!(idle.wgsl.contains(call), "{}", idle.wgsl);
    [without, idle].iter().for_each(validate);
}

#[test]
fn entries_are_read_by_the_table() {
    let light = |entry: &str| format!("[[lights]]\n{entry}\n");
    let refused = |entry: &str| scene(&light(entry)).expect_err(entry).to_string();
    let unknown = refused("kind = 'torus'");
    let expected =
        "`kind` of [[lights]] must be \"quad\" or \"sphere\" or \"distant\" or \"point\", not";
    assert!(unknown.contains(expected), "{unknown}");
    let half = refused("kind = 'sphere'\ncenter = [0, 0, 0]\nradius = 1\nradiance = 1\ncone = 20");
    assert!(
        half.contains("needs the direction that it shines in"),
        "{half}"
    );
    let wide = refused(
        "kind = 'sphere'\ncenter = [0, 0, 0]\nradius = 1\nradiance = 1\naxis = [0, 1, 0]\ncone = 20\ninner = 21",
    );
    assert!(wide.contains("degrees from 0 to `cone`"), "{wide}");
    let flat = refused("kind = 'sphere'\ncenter = [0, 0, 0]\nradius = 0\nradiance = 1");
    assert!(flat.contains("a radius above 0"), "{flat}");
    let lacking = refused("kind = 'point'\nposition = [0, 0, 0]");
    assert!(lacking.contains("needs `intensity`"), "{lacking}");
    let odd = refused("kind = 'point'\nposition = [0, 0, 0]\nintensity = 1\nsample = true");
    assert!(odd.contains("has no key `sample`"), "{odd}");
}

#[test]
fn the_row_of_a_kind_names_its_functions_and_needs() {
    let dark = Kinds::default();
    let mut needs = Vec::new();
    for kind in LIGHT_KINDS {
        assert!(!kind.needs.is_empty(), "{}", kind.name);
        for need in kind.needs {
            let part = dark.written(LIGHT_KINDS, Needs::of_rows(&[*need]));
            for (other, function) in sample_functions() {
                let is_there = part.wgsl.contains(&format!("fn {function}("));
                assert_eq!(is_there, other == kind.name, "{other} for {need:?}");
            }
        }
        needs.extend(kind.needs);
    }
    // They come first, so that what is decided after them can be built on them.
    let rows: Vec<Need> = ROWS.iter().map(|row| row.need).collect();
    assert_eq!(rows[..needs.len()], needs);
}

/// The page has what is compiled here, and lines for a row of needs.
#[test]
fn the_page_on_adding_a_light_is_true() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../CONTRIBUTING.md");
    let page = std::fs::read_to_string(page).expect("a page");
    let start = page.find("## Add a light").expect("a section");
    let mut lines = page[start..].lines();
    let files = [include_str!("point.rs"), include_str!("point.wgsl")];
    for line in files.iter().flat_map(|file| file.lines()) {
        assert!(lines.any(|shown| shown == line), "the page lacks `{line}`");
    }
}
