//! Objects in whole renders: where a surface is in its object, which object it is, and what its corners have,
//! however the object is placed and stored, on a GPU, on the processor and in replays.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::LazyLock;

use impasto::runtime::device::DeviceRef;
use impasto::runtime::scene::Transform;
use impasto::runtime::technique::{Regeneration, Sampler, Technique};
use impasto::runtime::world::World;
use impasto::trace::MaterialCode;
use impasto::trace::path::{Replayer, with_room};
use impasto::{
    Cpu, CpuOptions, Gpu, GpuOptions, Program, RenderOptions, Renderer, Rendering, Scene, Strategy,
};

const SIDE: u32 = 24;
const BIAS: f32 = 8.0;

/// One for all tests: some drivers cannot make and drop several at a time.
static GPU: LazyLock<Gpu> =
    LazyLock::new(|| Gpu::new(&GpuOptions::default()).unwrap_or_else(|e| panic!("{e}")));

/// A roof of two quads, modelled far from the origin of its file, with colors and texture coordinates.
const ROOF: &str = "\
v 10 0 -1 1 0 0\nv 12 0 -1 0 1 0\nv 12 1 0 0 0 1\nv 10 1 0 1 1 1\nv 12 0 1 0.5 0.5 0.5\nv 10 0 1 0 0 0
vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl roof\nf 1/1 4/4 3/3 2/2\nf 4/1 6/4 5/3 3/2\n";

/// The same with texture coordinates that are turned.
fn second() -> String {
    ROOF.replace(
        "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1",
        "vt 3 0\nvt 3 5\nvt 0 5\nvt 0 0",
    )
}

/// The ground is the first entry, the roofs are the second.
fn scene(folder: &Path, x: &str, shared: bool) -> (Scene, Program) {
    let file = |name: &str, text: &str| {
        std::fs::write(folder.join(name), text).expect("it is written");
    };
    file("roof.obj", ROOF);
    file("second.obj", &second());
    file(
        "ground.obj",
        "v -9 -9 -9\nv 9 -9 -9\nv 0 -9 9\nusemtl ground\nf 1 3 2\n",
    );
    let material = |name: &str, x: &str| {
        format!(
            "use std::edf::uniform;\nmaterial {name} {{ emission = uniform({BIAS:.1} + color({x})); }}\n"
        )
    };
    file("roof.impasto", &material("roof", x));
    file(
        "ground.impasto",
        &material("ground", "0.0 * vec3(position)"),
    );
    let places: Vec<String> = PLACES.iter().map(|p| format!("{{ {p} }}")).collect();
    let scene = format!(
        "[camera]\nposition = [100.5, 8, 203]\nlook_at = [100.5, 0, 200]\nfov = 45\n\
         [film]\nwidth = {SIDE}\nheight = {SIDE}\n[integrator]\nmax_depth = 2\n\
         [[geometry]]\nfile = \"ground.obj\"\ntranslate = [100, 0, 200]\n\
         [[geometry]]\nfile = \"roof.obj\"\nuv1 = \"second.obj\"\nshare = {shared}\n\
         translate = [-11, 0, 0]\nplacements = [{}]\n\
         [materials.roof]\nfile = \"roof.impasto\"\n[materials.ground]\nfile = \"ground.impasto\"\n",
        places.join(", ")
    );
    file("scene.toml", &scene);
    let scene = impasto::load(&folder.join("scene.toml")).unwrap_or_else(|e| panic!("{e}"));
    let program = impasto::compile(&scene).unwrap_or_else(|e| panic!("{e}"));
    (scene, program)
}

/// Turned; stretched and turned; mirrored.
const PLACES: [&str; 3] = [
    "translate = [98, 0, 200], rotate = [0, 40, 0]",
    "translate = [101, 1, 199], scale = [0.7, 1.5, 1], rotate = [20, 0, 70]",
    "translate = [103, 0, 201], scale = [-1, 1, 0.5]",
];

/// What the scene says of the places, in its own words.
fn places() -> [Transform; 3] {
    use glam::Vec3;
    let place = |scale: [f32; 3], rotate: [f32; 3], to: [f32; 3]| {
        let at = |v: [f32; 3]| Vec3::from(v);
        let entry = Transform::new(Vec3::ONE, Vec3::ZERO, at([-11.0, 0.0, 0.0]));
        entry.then(&Transform::new(at(scale), at(rotate), at(to)))
    };
    [
        place([1.0; 3], [0.0, 40.0, 0.0], [98.0, 0.0, 200.0]),
        place([0.7, 1.5, 1.0], [20.0, 0.0, 70.0], [101.0, 1.0, 199.0]),
        place([-1.0, 1.0, 0.5], [0.0; 3], [103.0, 0.0, 201.0]),
    ]
}

fn technique() -> Technique {
    Technique {
        sampler: Sampler::Independent,
        regeneration: Regeneration::Never,
        ..Technique::default()
    }
}

fn render<'d>(device: impl Into<DeviceRef<'d>>, scene: &Scene, program: &Program) -> Rendering {
    let options = RenderOptions {
        samples: 1,
        seed: 5,
        technique: technique(),
        outputs: vec!["position".into()],
        ..RenderOptions::default()
    };
    let plan = impasto::plan(program, Strategy::OWN).expect("a plan");
    let renderer = Renderer::new(device, scene, program, &plan, &options);
    let mut renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
    let rendering = renderer.render(&mut |_| ControlFlow::Continue(()));
    rendering.unwrap_or_else(|e| panic!("{e}"))
}

/// Pixels of roofs: their values, where they are in the world, and in which place.
struct Seen {
    value: [f32; 3],
    position: glam::DVec3,
    place: usize,
}

fn seen(rendering: &Rendering) -> Vec<Seen> {
    let positions = rendering.sums.sums.values("position");
    let mut found = Vec::new();
    for (pixel, value) in rendering.film.pixels.iter().enumerate() {
        let at = |c: usize| f64::from(positions[c][pixel]);
        let position = glam::DVec3::new(at(0), at(1), at(2));
        let inside = places().iter().position(|place| {
            let p = place.matrix.inverse() * (position - place.translation);
            let on_roof = (p.y - (1.0 - p.z.abs())).abs() < 1e-3;
            on_roof && (9.999..12.001).contains(&p.x) && p.z.abs() < 1.0
        });
        // Emission is on the front side.
        let is_lit = *value != [0.0; 3];
        if let Some(place) = inside.filter(|_| is_lit) {
            found.push(Seen {
                value: value.map(|x| x - BIAS),
                position,
                place,
            });
        }
    }
    assert!(found.len() > 40, "{} pixels see roofs", found.len());
    for place in 0..PLACES.len() {
        assert!(
            found.iter().any(|s| s.place == place),
            "{place} is not seen"
        );
    }
    found
}

/// Checks what roofs show, stored once or copied, on a GPU and on the processor.
fn check(
    x: &str,
    tolerance: f64,
    expected: impl Fn(&Transform, usize, glam::DVec3) -> glam::DVec3,
) {
    let cpu = Cpu::new(&CpuOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    for shared in [false, true] {
        let folder = tempfile::tempdir().expect("a folder");
        let (scene, program) = scene(folder.path(), x, shared);
        for rendering in [
            render(&*GPU, &scene, &program),
            render(&cpu, &scene, &program),
        ] {
            for Seen {
                value,
                position,
                place,
            } in seen(&rendering)
            {
                let of = &places()[place];
                let object = of.matrix.inverse() * (position - of.translation);
                let expected = expected(of, place, object);
                let value = glam::Vec3::from(value).as_dvec3();
                assert!(
                    (value - expected).abs().max_element() < tolerance,
                    "{x} at {position} in place {place}, shared: {shared}: {value}, not {expected}"
                );
            }
        }
    }
}

#[test]
fn object_positions_are_those_of_the_file() {
    check("0.1 * vec3(object_position)", 1e-4, |_, _, object| {
        0.1 * object
    });
    check(
        "0.1 * vec3(object_from_world(position + vector(0.0, 1.0, 0.0)))",
        1e-4,
        |of, _, object| 0.1 * (object + of.matrix.inverse() * glam::DVec3::Y),
    );
    check(
        "0.01 * vec3(world_from_object(point(11.0, 0.0, 0.0)))",
        1e-4,
        |of, _, _| 0.01 * (of.matrix * glam::DVec3::new(11.0, 0.0, 0.0) + of.translation),
    );
}

#[test]
fn object_normals_are_those_of_the_file() {
    check("vec3(object_normal)", 1e-4, |_, _, object| {
        glam::DVec3::new(0.0, 1.0, object.z.signum()).normalize()
    });
    check(
        "vec3(world_from_object(object_normal) - normal)",
        1e-4,
        |_, _, _| glam::DVec3::ZERO,
    );
    check("vec3(object_scale)", 1e-5, |of, _, _| {
        glam::DVec3::splat(of.matrix.determinant().abs().cbrt())
    });
}

#[test]
fn placements_are_counted_in_the_order_of_the_scene() {
    check("vec3(float(instance_id))", 1e-4, |_, place, _| {
        glam::DVec3::splat(1.0 + place as f64)
    });
}

/// The texture coordinates of a place in the file.
fn on_quad(object: glam::DVec3) -> [f64; 2] {
    let back = object.z < 0.0;
    [
        0.5 * (object.x - 10.0),
        if back { 1.0 + object.z } else { object.z },
    ]
}

#[test]
fn corners_have_colors_and_two_sets_of_coordinates() {
    let linear = |shown: f64| ((shown + 0.055) / 1.055).powf(2.4);
    check("vec3(uv, 0.0) - 0.5", 1e-3, |_, _, object| {
        let [u, v] = on_quad(object);
        glam::DVec3::new(u, v, 0.0) - 0.5
    });
    check("0.1 * vec3(uv1, 0.0)", 1e-3, |_, _, object| {
        let [u, v] = on_quad(object);
        0.1 * glam::DVec3::new(3.0 * (1.0 - v), 5.0 * u, 0.0)
    });
    // At the ridge the colors are blue and white, at the eaves red and green, or grey and black.
    check("vec3(vertex_color.b, 0.0, 0.0)", 2e-3, |_, _, object| {
        let u = 0.5 * (object.x - 10.0);
        if object.z < 0.0 {
            return glam::DVec3::new(1.0 + object.z, 0.0, 0.0);
        }
        let grey = linear(0.5);
        // Black at 10, grey at 12, and blue at the ridge: the two triangles are cut by the diagonal.
        let (v, s) = (object.z, u);
        let cut = if v > s {
            s * grey + (1.0 - v)
        } else {
            v * grey + (1.0 - v)
        };
        glam::DVec3::new(cut, 0.0, 0.0)
    });
}

#[test]
fn views_point_to_the_camera() {
    check("vec3(facing) - 0.5 * vec3(view)", 1e-3, |of, _, object| {
        let normal = glam::DVec3::new(0.0, 1.0, object.z.signum());
        let normal = (of.matrix.inverse().transpose() * normal).normalize();
        let position = of.matrix * object + of.translation;
        let view = (glam::DVec3::new(100.5, 8.0, 203.0) - position).normalize();
        glam::DVec3::splat(normal.dot(view).abs()) - 0.5 * view
    });
}

#[test]
fn replays_see_objects_as_kernels_do() {
    let x = "0.1 * vec3(object_position) + 0.3 * vec3(object_normal) + 0.1 * vec3(uv1, instance_random(3)) \
             + 0.2 * vec3(vertex_color) * facing + 0.01 * vec3(gradient(sin(object_position.x * uv1.y)))";
    for shared in [false, true] {
        let folder = tempfile::tempdir().expect("a folder");
        let (scene, program) = scene(folder.path(), x, shared);
        let rendering = render(&*GPU, &scene, &program);
        seen(&rendering);
        let technique = technique();
        let world = World::of_program(&scene, &program, &technique);
        let world = world.unwrap_or_else(|e| panic!("{e}"));
        for code in [MaterialCode::Ir, MaterialCode::Wgsl] {
            let replayed = with_room(|| {
                let replayer =
                    Replayer::new(&world, &program, technique.sampler).expect("a kernel");
                let code = replayer.code(code).expect("known code");
                let mut session = replayer.session::<f64>(&code).expect("known buffers");
                let mut pixel = |p: u32| {
                    let path = session.path([p % SIDE, p / SIDE], 0, 5);
                    path.unwrap_or_else(|e| panic!("{e}")).radiance
                };
                (0..SIDE * SIDE).map(&mut pixel).collect::<Vec<_>>()
            });
            let replayed = replayed.unwrap_or_else(|e| panic!("{e}"));
            let pairs = rendering.film.pixels.iter().zip(&replayed);
            let far = |(a, b): &(&[f32; 3], &[f64; 3])| {
                (0..3).any(|c| (f64::from(a[c]) - b[c]).abs() > 2e-3)
            };
            let different: Vec<_> = pairs.filter(far).collect();
            assert!(
                different.len() <= 3,
                "{} pixels differ by {code:?}: {:?}",
                different.len(),
                &different[..4]
            );
        }
    }
}
