//! Scenes from files with compiled materials: the same closed forms as in `furnace`, through
//! the real hierarchy, lights and generated code.

use std::ops::ControlFlow;
use std::path::Path;

use impasto_compiler::abi::InstanceInfo;
use impasto_compiler::partition::{Form, PlanInputs, Strategy};
use impasto_compiler::{Loader, MaterialRequest, Parameters, Program, compile};
use impasto_runtime::device::DeviceRef;
use impasto_runtime::options::RenderOptions;
use impasto_runtime::render::{Renderer, Rendering};
use impasto_runtime::scene::{self, Scene};
use impasto_runtime::technique::Technique;
use impasto_runtime::world::World;

use crate::gpu::media::{Layer, assert_channel, stack};
use crate::gpu::stub::{assert_mean, cpu, gpu, mean, red, samples};

/// A cube from -1 to 1 whose faces look inwards.
const ROOM: &str = "
v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1
usemtl wall
f 1 2 3 4\nf 8 7 6 5\nf 5 1 4 8\nf 2 6 7 3\nf 4 3 7 8\nf 5 6 2 1
";

/// A cube from -0.4 to 0.4 whose faces look outwards.
const BLOCK: &str = "
v -.4 -.4 -.4\nv .4 -.4 -.4\nv .4 .4 -.4\nv -.4 .4 -.4
v -.4 -.4 .4\nv .4 -.4 .4\nv .4 .4 .4\nv -.4 .4 .4
usemtl block
f 4 3 2 1\nf 5 6 7 8\nf 8 4 1 5\nf 3 7 6 2\nf 8 7 3 4\nf 1 2 6 5
";

/// A sphere of radius 0.5 in `2 n` by `n` squares, with a hierarchy some levels deep.
fn ball(n: usize) -> String {
    let mut text = String::from("usemtl ball\n");
    for (j, i) in (0..=n).flat_map(|j| (0..2 * n).map(move |i| (j, i))) {
        let theta = std::f64::consts::PI * (j as f64 / n as f64).clamp(1e-3, 1.0 - 1e-3);
        let phi = std::f64::consts::PI * i as f64 / n as f64;
        let (x, z) = (theta.sin() * phi.cos(), theta.sin() * phi.sin());
        text += &format!("v {} {} {}\n", 0.5 * x, 0.5 * theta.cos(), -0.5 * z);
    }
    for (j, i) in (0..n).flat_map(|j| (0..2 * n).map(move |i| (j, i))) {
        let at = |j: usize, i: usize| 1 + j * 2 * n + i % (2 * n);
        let corners = [at(j, i), at(j + 1, i), at(j + 1, i + 1), at(j, i + 1)];
        let [a, b, c, d] = corners;
        text += &format!("f {a} {b} {c} {d}\n");
    }
    text
}

const MATERIALS: &str = "
use std::bsdf::{diffuse, mirror, smooth_dielectric};
use std::edf::uniform;
material glowing { surface = diffuse(0.7); emission = uniform(color(1)); }
material dull { surface = diffuse(0.6); }
material glass { surface = smooth_dielectric(ior: 1.5); }
material silver { surface = mirror(); }
material liquid {
    param absorption: color = 0.0;
    param ior: float = 1.5;
    param priority: int = 0;
    surface = smooth_dielectric(ior: ior / exterior_ior);
    interior = medium(absorption: absorption, ior: ior, priority: priority);
}
material chart {
    param origin: point = point(0);
    let place = position - origin;
    surface = diffuse(0);
    emission = uniform(color(1 + place.x, 1 + place.y, 1 + place.z));
}
material net { surface = diffuse(1); opacity = 0.5; }
material ember {
    param priority: int = 3;
    surface = diffuse(0.5);
    emission = uniform(color(3));
    interior = medium(ior: 1.2, priority: priority);
}
";

struct Folder<'a>(&'a Path);

impl Loader for Folder<'_> {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        std::fs::read(self.0.join(path)).map_err(|e| e.to_string())
    }
}

/// Loads a scene, and compiles its materials.
pub fn load(toml: &str) -> (Scene, Program) {
    load_with(toml, &[])
}

/// The same, with more files for it to name.
pub fn load_with(toml: &str, more: &[(&str, &str)]) -> (Scene, Program) {
    let folder = tempfile::tempdir().expect("a folder");
    let files = [
        ("room.obj", ROOM),
        ("block.obj", BLOCK),
        ("ball.obj", &ball(24)),
        ("m.impasto", MATERIALS),
        ("scene.toml", toml),
    ];
    for (name, text) in files.iter().chain(more) {
        std::fs::write(folder.path().join(name), text).expect("written");
    }
    let scene = impasto_runtime::world::load(&folder.path().join("scene.toml"))
        .unwrap_or_else(|e| panic!("{e}"));
    let request = |binding: &scene::MaterialBinding| MaterialRequest {
        apart: false,
        moment: None,
        written: None,
        name: binding.name.clone(),
        file: binding.file.clone(),
        material: binding.material.clone(),
        params: binding.params.clone(),
        parameters: if binding.bake {
            Parameters::Baked
        } else {
            Parameters::Agreed
        },
    };
    let requests: Vec<_> = scene.materials.iter().map(request).collect();
    let compilation = compile(&requests, &mut Folder(folder.path()));
    let program = compilation.program;
    (
        scene,
        program.unwrap_or_else(|| panic!("{:?}", compilation.diagnostics)),
    )
}

/// A renderer by a strategy of that name, or with all materials `inline`, or on the processor.
pub fn renderer(
    scene: &Scene,
    program: &Program,
    strategy: &str,
    options: &RenderOptions,
) -> Renderer<'static> {
    let names: Vec<String> = program.infos().into_iter().map(|m| m.name).collect();
    let inline = strategy == "inline";
    let (device, strategy) = match strategy {
        "inline" => (gpu().into(), "shared"),
        "processor" => (DeviceRef::from(cpu()), "mega"),
        other => (gpu().into(), other),
    };
    let strategy = Strategy::parse(strategy);
    let plan = strategy.and_then(|strategy| strategy.plan(&PlanInputs::of_names(&names)));
    let mut plan = plan.unwrap_or_else(|e| panic!("{e}"));
    for kernel in &mut plan.kernels {
        if inline {
            kernel.form = Form::Inline;
        }
    }
    Renderer::new(device, scene, program, &plan, options).unwrap_or_else(|e| panic!("{e}"))
}

pub fn render(
    scene: &Scene,
    program: &Program,
    strategy: &str,
    options: &RenderOptions,
) -> Rendering {
    let mut renderer = renderer(scene, program, strategy, options);
    let rendering = renderer.render(&mut |_| ControlFlow::Continue(()));
    let rendering = rendering.unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(rendering.report.queue_overflow, 0);
    assert_eq!(rendering.report.nonfinite_samples, 0);
    rendering
}

pub fn room(size: f32, offset: f32, depth: u32) -> String {
    let place = |p: [f32; 3]| p.map(|v| v * size + offset);
    format!(
        "film = {{ width = 24, height = 16 }}\nintegrator.max_depth = {depth}\n\
         camera = {{ position = {:?}, look_at = {:?}, fov = 60 }}\n\
         [[geometry]]\nobj = 'room.obj'\nscale = {size:?}\ntranslate = {:?}\n\
         [materials.wall]\nfile = 'm.impasto'\nmaterial = 'glowing'\n",
        place([0.1, 0.6, 0.8]),
        place([0.0, 0.0, 0.0]),
        [offset; 3],
    )
}

/// All walls emit 1 and reflect 0.7: three segments see 1 + 0.7 + 0.49, whatever the size and
/// place of the room.
#[test]
fn closed_room_of_a_compiled_emissive_material() {
    for (size, offset) in [(1.0, 0.0), (1e-3, 0.0), (1e3, 0.0), (1.0, 300.0)] {
        let (scene, program) = load(&room(size, offset, 3));
        let rendering = render(&scene, &program, "wavefront", &samples(64));
        assert!(rendering.report.items_of("shadow") > Some(0));
        assert_mean(&rendering, 1.0 + 0.7 + 0.49);
    }
}

/// Glass neither absorbs nor loses a path at its faces, so under an even sky it is as bright
/// as the sky; what is missing is caught inside for more than 60 segments.
#[test]
fn glass_under_an_even_sky_is_invisible() {
    let (scene, program) = load(
        "film = { width = 24, height = 16 }\n\
         integrator = { max_depth = 64, roulette_start = 1000 }\n\
         camera = { position = [1.1, 0.9, 1.3], look_at = [0, 0, 0], fov = 40 }\n\
         environment = { color = 2 }\n\
         [[geometry]]\nobj = 'block.obj'\n\
         [materials.block]\nfile = 'm.impasto'\nmaterial = 'glass'\n",
    );
    let rendering = render(&scene, &program, "wavefront", &samples(64));
    let extended = rendering
        .report
        .kernels
        .iter()
        .find(|k| k.name == "material_glass");
    assert!(extended.is_some_and(|k| k.items > rendering.report.paths / 4));
    let (mean, _) = mean(red(&rendering));
    assert!((mean - 2.0).abs() < 0.02, "{mean}");
}

/// A row of blocks of `liquid` under an even sky of 2, seen from `z` along -z at right angles.
fn blocks(z: f32, medium: &str, each: &[(f32, &str)]) -> (Scene, Program) {
    let mut toml = format!(
        "film = {{ width = 16, height = 16 }}\n\
         integrator = {{ max_depth = 64, roulette_start = 1000 }}\n\
         environment = {{ color = 2 }}\n\
         camera = {{ position = [0.05, 0.11, {z:?}], look_at = [0.05, 0.11, -9], fov = 0.01 {medium} }}\n"
    );
    for (i, (z, params)) in each.iter().enumerate() {
        toml += &format!(
            "[materials.b{i}]\nfile = 'm.impasto'\nmaterial = 'liquid'\nparams = {{ {params} }}\n\
             [[geometry]]\nobj = 'block.obj'\ntranslate = [0, 0, {z:?}]\nmaterial = 'b{i}'\n"
        );
    }
    load(&toml)
}

/// Light that passes layers and light they reflect is all there is to see, less what they absorb.
fn assert_layers(rendering: &Rendering, layers: &[Layer]) {
    for channel in 0..3 {
        let [passed, reflected] = stack(layers, channel);
        assert_channel(rendering, channel, 2.0 * (passed + reflected));
    }
}

/// Two instances of one material, each with an interior of its own.
#[test]
fn instances_absorb_each_by_its_own_interior() {
    let [red, blue] = [[0.1, 1.0, 2.0], [2.0, 0.5, 0.1]];
    let (scene, program) = blocks(
        3.0,
        "",
        &[
            (0.0, "absorption = [0.1, 1.0, 2.0]"),
            (-2.0, "absorption = [2.0, 0.5, 0.1], ior = 1.25"),
        ],
    );
    assert_eq!(program.infos().len(), 1);
    let layers = [(0.8, red, 1.5), (1.2, [0.0; 3], 1.0), (0.8, blue, 1.25)];
    for strategy in ["wavefront", "shared", "inline", "mega"] {
        let rendering = render(&scene, &program, strategy, &samples(64));
        assert_eq!(
            (
                rendering.report.material_count,
                rendering.report.instance_count
            ),
            (1, 2)
        );
        assert_layers(&rendering, &layers);
    }
}

/// Blocks at -0.4..0.4 and at 0..0.8: what they share is the one's or the other's.
#[test]
fn compiled_interiors_nest_by_priority() {
    for (first, second, layers) in [
        (
            1,
            2,
            [(0.8, [0.0, 1.0, 0.0], 1.33), (0.4, [1.0, 0.0, 0.0], 1.5)],
        ),
        (
            2,
            1,
            [(0.4, [0.0, 1.0, 0.0], 1.33), (0.8, [1.0, 0.0, 0.0], 1.5)],
        ),
    ] {
        let near = format!("absorption = [0, 1, 0], ior = 1.33, priority = {second}");
        let far = format!("absorption = [1, 0, 0], priority = {first}");
        let (scene, program) = blocks(3.0, "", &[(0.0, &far), (0.4, &near)]);
        let rendering = render(&scene, &program, "wavefront", &samples(64));
        assert_layers(&rendering, &layers);
    }
}

#[test]
fn a_camera_in_a_block_sees_through_what_is_left_of_it() {
    let params = "absorption = [0.5, 1.0, 2.0]";
    let (scene, program) = blocks(0.0, ", medium = 'b0'", &[(0.0, params)]);
    assert_eq!(scene.camera_media, [0]);
    let rendering = render(&scene, &program, "wavefront", &samples(64));
    for (channel, a) in [0.5, 1.0, 2.0].into_iter().enumerate() {
        // Out at the first face, or after so many turns between the two.
        let (r, way) = (0.04, f64::exp(-0.4 * a));
        let expected = 2.0 * (1.0 - r) * way / (1.0 - r * way * way);
        // What comes in is squeezed into a narrower cone, so that radiance is higher inside.
        assert_channel(&rendering, channel, expected * 1.5 * 1.5);
    }
    let (scene, program) = blocks(0.0, ", medium = 'b0'", &[(0.0, "")]);
    let mut dull = scene.clone();
    dull.materials[0].material = Some("dull".into());
    let instances: Vec<_> = program.instances().iter().map(|i| i.info.clone()).collect();
    let none = instances.iter().map(|i| InstanceInfo {
        medium: None,
        ..i.clone()
    });
    let error = World::new(
        &dull,
        &program.infos(),
        &none.collect::<Vec<_>>(),
        &[],
        &Technique::default(),
    );
    let error = error.expect_err("there is nothing to be in").to_string();
    assert!(
        error.contains("`b0`") && error.contains("interior"),
        "{error}"
    );
}

/// Walls that emit 1 and reflect 0.7 make a room of radiance 1 / 0.3, and what absorbs nothing
/// leaves it at that. Light samples that it blocks must be made up for by scattering.
#[test]
fn cut_outs_and_clear_things_in_an_even_room_are_invisible() {
    for block in ["net", "glass", "liquid"] {
        let toml = room(1.0, 0.0, 64)
            + &format!(
                "[[geometry]]\nobj = 'block.obj'\n\
                 [materials.block]\nfile = 'm.impasto'\nmaterial = '{block}'\n"
            );
        let (scene, program) = load(&toml);
        let rendering = render(&scene, &program, "wavefront", &samples(64));
        let (mean, error) = mean(red(&rendering));
        let difference = (mean - 1.0 / 0.3).abs();
        // Glass keeps some paths for more than 64 segments.
        assert!(
            difference <= 4.0 * error + 0.01,
            "{block}: {mean} +- {error}"
        );
    }
}

/// A boundary that is hidden does not shine either, for scattered rays and light samples alike.
#[test]
fn what_a_medium_hides_gives_no_light() {
    let toml = room(1.0, 0.0, 4).replace("glowing", "dull")
        + "[[geometry]]\nobj = 'block.obj'\n\
           [materials.block]\nfile = 'm.impasto'\nmaterial = 'ember'\n\
           [materials.thick]\nfile = 'm.impasto'\nmaterial = 'liquid'\nparams.priority = 5\n";
    let (scene, program) = load(&toml);
    let open = render(&scene, &program, "wavefront", &samples(16));
    let (seen, _) = mean(red(&open));
    assert!(seen > 0.3, "{seen}");
    let (scene, program) = load(&toml.replace("fov = 60", "fov = 60, medium = 'thick'"));
    let hidden = render(&scene, &program, "wavefront", &samples(4));
    assert!(red(&hidden).all(|v| v == 0.0));
    // Where it is there but might not be, chance alone finds it, on average as much.
    let (scene, program) = load(
        &toml
            .replace("fov = 60", "fov = 60, medium = 'thick'")
            .replace("params.priority = 5", "params = { priority = 1, ior = 1 }"),
    );
    let around = render(&scene, &program, "wavefront", &samples(64));
    assert_eq!(around.report.items_of("shadow"), None);
    let difference = red(&around).zip(red(&open)).map(|(a, b)| a - b);
    let (difference, error) = mean(difference);
    assert!(difference.abs() <= 4.0 * error, "{difference} +- {error}");
}

/// A lamp, walls, and a block of glass or metal: every organisation gives the same picture.
#[test]
fn every_organisation_renders_the_same_scene() {
    for block in ["glass", "silver", "dull"] {
        let toml = room(1.0, 0.0, 6).replace("glowing", "dull")
            + &format!(
                "[[geometry]]\nobj = 'block.obj'\n\
                 [materials.block]\nfile = 'm.impasto'\nmaterial = '{block}'\n\
                 [[lights]]\nkind = 'quad'\ncorner = [-0.3, 0.99, -0.3]\n\
                 u = [0.6, 0, 0]\nv = [0, 0, 0.6]\nradiance = [10, 10, 10]\n"
            );
        let (scene, program) = load(&toml);
        let reference = render(&scene, &program, "wavefront", &samples(8));
        assert!(red(&reference).all(|v| v >= 0.0) && red(&reference).any(|v| v > 0.1));
        for strategy in ["shared", "inline", "mega", "processor"] {
            let other = render(&scene, &program, strategy, &samples(8));
            if gpu().info().kind == "software" && strategy != "processor" {
                assert!(other.film == reference.film, "{block}: {strategy} differs");
            }
            let (difference, error) = mean(red(&other).zip(red(&reference)).map(|(a, b)| a - b));
            // Where all paths are the same, what is left is rounding, which need not be even.
            let rounding = 1e-5 * mean(red(&reference)).0;
            let allowed = 4.0 * error + rounding;
            assert!(
                difference.abs() <= allowed,
                "{block}: {strategy} differs by {difference}, more than {allowed}"
            );
        }
    }
}

/// Lights that are found by chance give the light that sampled ones give, without a shadow ray.
#[test]
fn lights_give_as_much_whether_they_are_sampled_or_not() {
    let quad = "[[lights]]\nkind = 'quad'\ncorner = [-0.8, 0.99, -0.8]\n\
                u = [1.6, 0, 0]\nv = [0, 0, 1.6]\nradiance = [2, 2, 2]\n";
    let sun = "[[lights]]\nkind = 'distant'\nto_light = [0, 0, 1]\nirradiance = 1\nangle = 120\n";
    for light in [quad, sun] {
        let room = room(1.0, 0.0, 4).replace("glowing", "dull");
        // The sun shines on a block without a room around it.
        let objects = if light == sun {
            room.replace("room.obj", "block.obj")
                .replace("materials.wall", "materials.block")
        } else {
            room
        };
        let toml = objects + light;
        let (scene, program) = load(&toml);
        let sampled = render(&scene, &program, "wavefront", &samples(64));
        let (scene, program) = load(&(toml + "sample = false\n"));
        let found = render(&scene, &program, "wavefront", &samples(256));
        assert_eq!(found.report.items_of("shadow"), None);
        let (brightness, _) = mean(red(&sampled));
        assert!(brightness > 1e-3, "{light}: {brightness}");
        let (difference, error) = mean(red(&found).zip(red(&sampled)).map(|(a, b)| a - b));
        assert!(
            difference.abs() <= 4.0 * error,
            "{light}: {difference} +- {error}"
        );
    }
}

/// Instances that share code read each parameter where it lies in their rows.
#[test]
fn instances_have_their_own_values_of_every_parameter() {
    const HALVES: &str = "v -9 -9 -1\nv 0 -9 -1\nv 0 9 -1\nv -9 9 -1\nv 9 -9 -1\nv 9 9 -1\n\
                          usemtl left\nf 1 2 3 4\nusemtl right\nf 2 5 6 3\n";
    const LAMP: &str = "use std::bsdf::diffuse;\nuse std::edf::uniform;\n\
                        material lamp {\n\
                        param a: float = 1.0;\nparam b: float = 1.0;\nparam tint: color = 1.0;\n\
                        param c: float = 1.0;\nparam d: float = 1.0;\n\
                        surface = diffuse(0.0);\n\
                        emission = uniform(tint + color(a, b, c) * -position.z + d * position.z * position.z);\n\
                        }";
    let toml = "film = { width = 2, height = 1 }\nintegrator.max_depth = 1\n\
                camera = { position = [0, 0, 0], look_at = [0, 0, -1], fov = 20 }\n\
                [[geometry]]\nobj = 'halves.obj'\n\
                [materials.left]\nfile = 'lamp.impasto'\n\
                params = { a = 1, b = 2, c = 3, d = 4, tint = [0.1, 0.2, 0.3] }\n\
                [materials.right]\nfile = 'lamp.impasto'\n\
                params = { a = 8, b = 7, c = 6, d = 5, tint = [0.6, 0.5, 0.4] }\n";
    let (scene, program) = load_with(toml, &[("halves.obj", HALVES), ("lamp.impasto", LAMP)]);
    assert_eq!(program.infos().len(), 1, "they share their code");
    let pixels = render(&scene, &program, "wavefront", &samples(4))
        .film
        .pixels;
    for (found, expected) in pixels.iter().zip([[5.1, 6.2, 7.3], [13.6, 12.5, 11.4f32]]) {
        for (x, y) in found.iter().zip(expected) {
            assert!((x - y).abs() < 1e-4, "{found:?}, expected {expected:?}");
        }
    }
}
