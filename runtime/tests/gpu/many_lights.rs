//! A million triangles that emit, from an OBJ file to the picture.

use std::fmt::Write;
use std::ops::ControlFlow;

use crate::gpu::stub::{assert_same_picture, cpu, samples};
use impasto_compiler::partition::Plan;
use impasto_compiler::{MaterialRequest, MemoryLoader, compile};
use impasto_runtime::render::{Renderer, Rendering};
use impasto_runtime::scene;

const MATERIALS: &str = "
use std::bsdf::diffuse;
use std::edf::uniform;
material floor { surface = diffuse(0.6); }
material lamp { surface = diffuse(0); emission = uniform(color(1)); }
";

const SCENE: &str = "
film = { width = 12, height = 8 }
integrator.max_depth = 2
camera = { position = [0.0, 0.9, 0.0], look_at = [0.0, 0.0, 0.1], fov = 60 }
[[geometry]]
obj = 'floor.obj'
[[geometry]]
obj = 'lamp.obj'
[materials.floor]
file = 'm.impasto'
material = 'floor'
[materials.lamp]
file = 'm.impasto'
material = 'lamp'
";

/// A square of side 2 at a height, of `side` by `side` squares of two triangles that face down.
fn square(side: usize, height: f32) -> String {
    let mut obj = String::from("usemtl lamp\n");
    for z in 0..=side {
        for x in 0..=side {
            let place = |i: usize| 2.0 * i as f32 / side as f32 - 1.0;
            let _ = writeln!(obj, "v {} {height} {}", place(x), place(z));
        }
    }
    for z in 0..side {
        for x in 0..side {
            let corner = 1 + z * (side + 1) + x;
            let (right, below) = (corner + 1, corner + side + 1);
            let _ = writeln!(
                obj,
                "f {corner} {right} {below}\nf {right} {} {below}",
                below + 1
            );
        }
    }
    obj
}

fn render(side: usize) -> Rendering {
    let folder = tempfile::tempdir().expect("a folder");
    let floor = "v -1 0 -1\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nusemtl floor\nf 1 2 3 4\n";
    for (name, text) in [
        ("floor.obj", floor),
        ("lamp.obj", &square(side, 1.0)),
        ("scene.toml", SCENE),
    ] {
        std::fs::write(folder.path().join(name), text).expect("written");
    }
    let scene = impasto_runtime::world::load(&folder.path().join("scene.toml"))
        .unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(scene.mesh.len(), 2 * side * side + 2);
    let mut files = MemoryLoader::default();
    files.add("m.impasto", MATERIALS);
    let request = |binding: &scene::MaterialBinding| {
        let mut request = MaterialRequest::new(&binding.name, "m.impasto");
        request.material = binding.material.clone();
        request
    };
    let requests: Vec<_> = scene.materials.iter().map(request).collect();
    let program = compile(&requests, &mut files).program.expect("it compiles");
    let names: Vec<String> = program.infos().into_iter().map(|m| m.name).collect();
    let plan = Plan::own(&names, &[]);
    let mut renderer = Renderer::new(cpu(), &scene, &program, &plan, &samples(64))
        .unwrap_or_else(|e| panic!("{e}"));
    let rendering = renderer.render(&mut |_| ControlFlow::Continue(()));
    rendering.unwrap_or_else(|e| panic!("{e}"))
}

/// The lamp in a million pieces gives the light of the lamp in two.
#[test]
fn a_million_emissive_triangles_light_a_floor() {
    let (many, few) = (render(708), render(1));
    assert_eq!(many.report.triangles, 1_002_530);
    assert_same_picture(&many, &few);
    let mean = many
        .film
        .pixels
        .iter()
        .map(|p| f64::from(p[0]))
        .sum::<f64>()
        / 96.0;
    // Between the floor's reflectance times a form factor of a half, and times one.
    assert!((0.2..0.6).contains(&mean), "{mean}");
}
