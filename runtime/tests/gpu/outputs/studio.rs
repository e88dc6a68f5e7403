//! The scene of the tests of outputs, of which is known what every pixel shows, and what renders and reads it.

use std::ops::ControlFlow;
use std::path::Path;

use impasto_compiler::{Loader, MaterialRequest, Program, compile, compile_with_looks};
use impasto_runtime::film::outputs::{ALL_GROUPS, At, OUTPUTS, ask_for_looks};
use impasto_runtime::options::RenderOptions;
use impasto_runtime::render::{Renderer, Rendering};
use impasto_runtime::scene::{self, Scene};

/// A card from -1 to 1 in the plane z = 0 with coordinates from 0 to 1, in two parts; a tile before it whose normals
/// lean; and a tile behind the camera.
const CARD: &str = "
v -1 -1 0\nv 0 -1 0\nv 0 1 0\nv -1 1 0\nv 1 -1 0\nv 1 1 0
vt 0 0\nvt 0.5 0\nvt 0.5 1\nvt 0 1\nvt 1 0\nvt 1 1
o left\nusemtl left\nf 1/1 2/2 3/3 4/4
o right\nusemtl right\nf 2/2 5/5 6/6 3/3
";
/// A square of side 0.4 about the origin, whose vertex normals lean to the right.
const TILE: &str = "
v -.2 -.2 0\nv .2 -.2 0\nv .2 .2 0\nv -.2 .2 0\nvn 0.6 0 0.8
g tile\nusemtl tile\nf 1//1 2//1 3//1 4//1
";
/// A cube from -0.5 to 0.5.
const BLOCK: &str = "
v -.5 -.5 -.5\nv .5 -.5 -.5\nv .5 .5 -.5\nv -.5 .5 -.5\nv -.5 -.5 .5\nv .5 -.5 .5\nv .5 .5 .5\nv -.5 .5 .5
usemtl block
f 4 3 2 1\nf 5 6 7 8\nf 8 4 1 5\nf 3 7 6 2\nf 8 7 3 4\nf 1 2 6 5
";
const MATERIALS: &str = "
use std::bsdf::{diffuse, smooth_dielectric, specular};
use std::edf::uniform;
material plain { param color: color = 0.5; surface = diffuse(color); }
material coated { surface = mix(specular(color(1.0)), diffuse(color(0.2, 0.4, 0.6)), 0.5); }
material bumpy { surface = diffuse(0.5, normal: vec3(0.0, 0.6, 0.8)); }
material glow { surface = diffuse(0.3); emission = uniform(color(2, 1, 0.5)); }
material shade { surface = diffuse(0.3); emission = uniform(color(1 + position.x)); }
material liquid {
    param ior: float = 1.5;
    param priority: int = 0;
    surface = smooth_dielectric(ior: ior / exterior_ior);
    interior = medium(absorption: color(0.5), ior: ior, priority: priority);
}
";

struct Folder<'a>(&'a Path);

impl Loader for Folder<'_> {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        std::fs::read(self.0.join(path)).map_err(|e| e.to_string())
    }
}

/// A scene with its materials, compiled for some outputs.
pub(super) fn load(toml: &str, outputs: &[&str]) -> (Scene, Program) {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in [
        ("card.obj", CARD),
        ("tile.obj", TILE),
        ("block.obj", BLOCK),
        ("m.impasto", MATERIALS),
        ("scene.toml", toml),
    ] {
        std::fs::write(folder.path().join(name), text).expect("written");
    }
    let scene = impasto_runtime::world::load(&folder.path().join("scene.toml"))
        .unwrap_or_else(|e| panic!("{e}"));
    let request = |binding: &scene::MaterialBinding| MaterialRequest {
        material: binding.material.clone(),
        params: binding.params.clone(),
        ..MaterialRequest::new(binding.name.clone(), binding.file.clone())
    };
    let requests: Vec<_> = scene.materials.iter().map(request).collect();
    let compiled = if ask_for_looks(&strings(outputs)) {
        compile_with_looks(&requests, &mut Folder(folder.path()))
    } else {
        compile(&requests, &mut Folder(folder.path()))
    };
    let program = compiled.program;
    (
        scene,
        program.unwrap_or_else(|| panic!("{:?}", compiled.diagnostics)),
    )
}

pub(super) fn strings(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

pub(super) fn asking(outputs: &[&str], samples: u32) -> RenderOptions {
    RenderOptions {
        samples,
        outputs: strings(outputs),
        ..RenderOptions::default()
    }
}

pub(super) fn renderer(
    (scene, program): &(Scene, Program),
    strategy: &str,
    options: &RenderOptions,
) -> Renderer<'static> {
    crate::gpu::scene::renderer(scene, program, strategy, options)
}

pub(super) fn render(
    scene: &(Scene, Program),
    strategy: &str,
    options: &RenderOptions,
) -> Rendering {
    let rendering = renderer(scene, strategy, options).render(&mut |_| ControlFlow::Continue(()));
    let rendering = rendering.unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(rendering.report.nonfinite_samples, 0);
    assert_eq!(rendering.report.clamped_samples, 0);
    rendering
}

const SIZE: usize = 16;

/// The card seen from 4 m away, 16 pixels being 3.2 m wide, with a tile 1 m before its right half, and light of every
/// kind in four groups.
pub(super) const STUDIO: &str = "
film = { width = 16, height = 16 }
integrator = { max_depth = 4, roulette_start = 2 }
camera = { position = [0, 0, 4], look_at = [0, 0, 0], fov = 43.60282 }
environment = { color = [0.2, 0.3, 0.5], sample = true, group = 'sky' }
[[geometry]]
obj = 'card.obj'
[[geometry]]
obj = 'tile.obj'
translate = [0.45, 0, 1]
[[geometry]]
obj = 'tile.obj'
translate = [-0.6, 0.6, 0.5]
material = 'glow'
[materials.left]
file = 'm.impasto'
material = 'plain'
params.color = [0.8, 0.4, 0.2]
[materials.right]
file = 'm.impasto'
material = 'coated'
[materials.tile]
file = 'm.impasto'
material = 'bumpy'
[materials.glow]
file = 'm.impasto'
material = 'glow'
group = 'key'
[[lights]]
kind = 'quad'
corner = [-1.5, -1.4, 0.2]
u = [0.6, 0, 0]
v = [0, 0.3, 0]
radiance = [3, 3, 2]
two_sided = true
[[lights]]
kind = 'distant'
to_light = [0.3, 0.2, 1]
irradiance = [1, 1, 1]
angle = 10
group = 'key'
[[lights]]
kind = 'distant'
to_light = [-0.3, 0.4, 1]
irradiance = [0.2, 0.4, 0.3]
group = 'rim'
";

/// Every name of the table, and the groups of the studio.
pub(super) fn everything() -> Vec<&'static str> {
    let plain = OUTPUTS.iter().filter(|o| o.at != At::Light);
    plain.map(|o| o.name).chain([ALL_GROUPS]).collect()
}

/// The pixel at a place of the card's plane.
pub(super) fn at(x: f32, y: f32) -> usize {
    let column = ((x + 1.6) / 0.2) as usize;
    column + SIZE * (((1.6 - y) / 0.2) as usize)
}

/// What a layer has at a pixel.
pub(super) fn value(rendering: &Rendering, name: &str, pixel: usize) -> Vec<f32> {
    let values = rendering.sums.sums.values(name);
    assert!(!values.is_empty(), "{name}");
    values.iter().map(|channel| channel[pixel]).collect()
}

#[track_caller]
pub(super) fn assert_near(found: &[f32], expected: &[f32], within: f32) {
    let far = |(a, b): (&f32, &f32)| (a - b).abs() > within;
    let apart = found.len() != expected.len() || found.iter().zip(expected).any(far);
    assert!(!apart, "{found:?} is not {expected:?}");
}

/// The names of the ids in a pixel, with their coverage.
pub(super) fn names(rendering: &Rendering, layer: &str, pixel: usize) -> Vec<(String, f32)> {
    let sums = &rendering.sums.sums;
    let found = sums.layers().iter().find(|l| l.name == layer);
    let names = &found.expect("a layer").names;
    let samples = rendering.film.samples[pixel] as f32;
    let ids = sums.ids(layer, pixel).into_iter();
    ids.map(|id| (names[id.id as usize].clone(), id.count as f32 / samples))
        .collect()
}
