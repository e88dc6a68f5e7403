//! Scenes with one kind of light each, and what kernels answer about them.
#![allow(dead_code)] // each test binary uses its part

use glam::Vec3;
use impasto_compiler::abi::{Emission, InstanceInfo};
use impasto_runtime::scene::{
    Camera, Environment, EnvironmentMap, EnvironmentSource, FilmSettings, Integrator, Light, Mesh,
    NO_MATERIAL, Scene, SceneLight,
};
use impasto_runtime::technique::Technique;
use impasto_runtime::world::KernelParts;
use impasto_runtime::world::lights::distant::DistantLight;
use impasto_runtime::world::lights::quad::QuadLight;
use impasto_runtime::world::lights::sphere::{Cone, SphereLight};

use super::worlds::kernel_parts;
use super::{Random, Row, floats, row, run};

/// A scene without light, of one triangle far below everything.
pub(crate) fn dark_scene() -> Scene {
    let mut scene = Scene {
        name: "test".into(),
        base: ".".into(),
        origin: Default::default(),
        camera: Camera {
            position: Vec3::ZERO,
            look_at: Vec3::Z,
            up: Vec3::Y,
            fov: 40.0,
            aperture: 0.0,
            focus: 1.0,
        },
        camera_media: Vec::new(),
        film: FilmSettings {
            width: 1,
            height: 1,
        },
        integrator: Integrator {
            max_depth: 1,
            roulette_start: 1,
        },
        mesh: Mesh::default(),
        objects: Vec::new(),
        placements: Vec::new(),
        places: Vec::new(),
        object_places: Vec::new(),
        materials: Vec::new(),
        lights: Vec::new(),
        environment: None,
        labels: Default::default(),
        warnings: Vec::new(),
    };
    let corner = Vec3::new(0.0, -30.0, 0.0);
    push_triangle(
        &mut scene,
        [corner, corner + Vec3::Z, corner + Vec3::X],
        NO_MATERIAL,
    );
    scene
}

pub(crate) fn push_triangle(scene: &mut Scene, corners: [Vec3; 3], material: u32) {
    scene.mesh.positions.push(corners);
    scene.mesh.materials.push(material);
    scene.mesh.lights.push(None);
}

pub(crate) fn push_quad(scene: &mut Scene, quad: QuadLight) {
    push_light(scene, quad);
}

/// Adds a light with its surface.
pub(crate) fn push_light(scene: &mut Scene, light: impl SceneLight) {
    let index = scene.lights.len() as u32;
    for corners in light.triangles() {
        push_triangle(scene, corners, NO_MATERIAL);
        scene.mesh.lights.pop();
        scene.mesh.lights.push(Some(index));
    }
    scene.lights.push(Light::new(light));
}

pub(crate) fn quad(corner: [f32; 3], u: [f32; 3], v: [f32; 3], radiance: f32) -> QuadLight {
    QuadLight {
        corner: corner.into(),
        u: u.into(),
        v: v.into(),
        radiance: Vec3::new(radiance, 0.5 * radiance, 0.25 * radiance),
        two_sided: false,
        sample: true,
    }
}

/// A sphere that shines into a cone of that outer angle with a soft edge, or everywhere.
pub(crate) fn sphere(
    center: [f32; 3],
    radius: f32,
    radiance: f32,
    outer: Option<f32>,
) -> SphereLight {
    SphereLight {
        center: center.into(),
        radius,
        radiance: Vec3::new(radiance, 0.5 * radiance, 0.25 * radiance),
        cone: outer.map(|outer| Cone {
            axis: -Vec3::from(center).normalize(),
            outer,
            inner: 0.5 * outer,
        }),
        sample: true,
    }
}

pub(crate) fn emissive(radiance: [f32; 3]) -> InstanceInfo {
    InstanceInfo {
        name: "lamp".into(),
        material: 0,
        emission: Emission::Uniform(radiance),
        medium: None,
    }
}

pub(crate) fn map_scene(width: u32, height: u32, texel: impl Fn(u32, u32) -> Vec3) -> Scene {
    let at = |i: u32| texel(i % width, i / width);
    let texels = (0..width * height).map(at).collect();
    Scene {
        environment: Some(Environment {
            source: EnvironmentSource::Map(EnvironmentMap {
                width,
                height,
                texels,
            }),
            rotate: 0.0,
            sample: true,
        }),
        ..dark_scene()
    }
}

pub(crate) fn distant(to_light: [f32; 3], irradiance: f32, angle: f32) -> Light {
    Light::new(DistantLight {
        to_light: Vec3::from(to_light).normalize(),
        irradiance: Vec3::splat(irradiance),
        angle,
        sample: true,
    })
}

pub(crate) fn uniform_environment(sample: bool) -> Option<Environment> {
    let source = EnvironmentSource::Uniform(Vec3::new(0.5, 1.0, 2.0));
    Some(Environment {
        source,
        rotate: 0.0,
        sample,
    })
}

/// The scenes that the general tests walk through, with what their materials emit.
pub(crate) fn scenes() -> Vec<(&'static str, Scene, Vec<InstanceInfo>)> {
    let mut scenes = Vec::new();
    let mut triangle = dark_scene();
    push_triangle(
        &mut triangle,
        [
            Vec3::new(-0.5, 2.0, 0.0),
            Vec3::new(1.0, 2.0, 0.3),
            Vec3::new(0.0, 2.5, 1.0),
        ],
        0,
    );
    scenes.push(("triangle", triangle, vec![emissive([3.0, 2.0, 1.0])]));

    let mut mesh = dark_scene();
    let mut random = Random::new(7);
    for _ in 0..40 {
        let center = 3.0 * random.direction();
        let corners = [(); 3].map(|_| center + 0.4 * random.direction());
        push_triangle(&mut mesh, corners, random.bits() % 3);
    }
    let infos = [[5.0, 1.0, 0.1], [0.0; 3], [0.2, 0.1, 4.0]].map(emissive);
    scenes.push(("mesh", mesh, infos.into()));

    let mut one_quad = dark_scene();
    push_quad(
        &mut one_quad,
        quad([-1.0, 2.0, -1.0], [2.0, 0.0, 0.0], [0.0, 0.3, 1.0], 4.0),
    );
    scenes.push(("quad", one_quad, vec![]));

    let mut both_sides = dark_scene();
    let upward = quad([-1.0, 0.7, -1.0], [0.0, 0.0, 2.0], [2.0, 0.0, 0.0], 4.0);
    push_quad(
        &mut both_sides,
        QuadLight {
            two_sided: true,
            ..upward
        },
    );
    scenes.push(("two-sided quad", both_sides, vec![]));

    let mut lamp = dark_scene();
    push_light(&mut lamp, sphere([0.5, 2.6, -0.3], 0.5, 4.0, None));
    scenes.push(("sphere", lamp, vec![]));
    let mut spots = dark_scene();
    push_light(&mut spots, sphere([-1.0, 2.5, 0.4], 0.3, 4.0, Some(40.0)));
    push_light(&mut spots, sphere([1.5, 2.0, 0.4], 0.2, 3.0, None));
    scenes.push(("a spot and a sphere", spots, vec![]));

    let cone = Scene {
        lights: vec![distant([0.3, 1.0, -0.2], 2.0, 30.0)],
        ..dark_scene()
    };
    scenes.push(("distant cone", cone, vec![]));
    let half_sky = Scene {
        lights: vec![distant([0.0, 1.0, 0.0], 2.0, 179.0)],
        ..dark_scene()
    };
    scenes.push(("distant half sky", half_sky, vec![]));

    let uniform = Scene {
        environment: uniform_environment(true),
        ..dark_scene()
    };
    scenes.push(("uniform environment", uniform, vec![]));
    let gradient = map_scene(16, 8, |x, y| {
        Vec3::new(x as f32 + 0.1, y as f32, (x * y) as f32 * 0.2)
    });
    scenes.push(("gradient map", turned(gradient, 77.0), vec![]));
    let spot = map_scene(16, 8, |x, y| {
        Vec3::splat(if (x, y) == (0, 3) { 50.0 } else { 0.0 })
    });
    scenes.push(("one bright texel", spot, vec![]));
    let poles = map_scene(9, 5, |_, y| {
        Vec3::splat(if y == 0 { 3.0 } else { f32::from(y == 4) })
    });
    scenes.push(("bright poles", turned(poles, -20.0), vec![]));
    // Row 28: a sun of 1e6 beside a sky of 1e-3.
    let sun = |x, y| Vec3::splat(if (x, y) == (4, 2) { 1e6 } else { 1e-3 });
    scenes.push(("sun and sky", map_scene(16, 8, sun), vec![]));
    let both = vec![
        distant([0.0, 1.0, 0.5], 5.0, 10.0),
        distant([1.0, 0.3, 0.0], 1.0, 40.0),
    ];
    let two = Scene {
        lights: both,
        ..dark_scene()
    };
    scenes.push(("two distant lights", two, vec![]));
    let tiny = map_scene(1, 1, |_, _| Vec3::splat(2.0));
    scenes.push(("map of one texel", tiny, vec![]));
    scenes
}

/// Several kinds at once, which hide one another.
pub(crate) fn mixed_scene() -> (Scene, Vec<InstanceInfo>) {
    let mut scene = turned(
        map_scene(8, 4, |x, y| Vec3::splat((x + 3 * y) as f32 * 0.1)),
        10.0,
    );
    scene.lights = vec![distant([1.0, 2.0, 0.5], 1.5, 20.0)];
    push_triangle(
        &mut scene,
        [
            Vec3::new(0.2, 2.0, 0.0),
            Vec3::new(1.2, 2.0, 0.3),
            Vec3::new(0.5, 2.5, 1.0),
        ],
        0,
    );
    push_quad(
        &mut scene,
        quad([-1.0, 1.5, -1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], 4.0),
    );
    push_light(&mut scene, sphere([1.5, 1.0, 1.5], 0.3, 2.0, Some(70.0)));
    push_quad(
        &mut scene,
        quad([-3.0, 3.0, -3.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0], 4.0),
    );
    (scene, vec![emissive([3.0, 2.0, 1.0])])
}

pub(crate) fn turned(mut scene: Scene, degrees: f32) -> Scene {
    if let Some(environment) = &mut scene.environment {
        environment.rotate = degrees;
    }
    scene
}

pub(crate) fn parts(scene: &Scene, instances: &[InstanceInfo]) -> KernelParts {
    kernel_parts(scene, instances, &Technique::default()).expect("the parts build")
}

pub(crate) fn evaluate(
    parts: &KernelParts,
    body: &str,
    input: &[Row],
    count: usize,
    rows: usize,
) -> Vec<Row> {
    let mis = impasto_runtime::world::lights::mis();
    let all = [
        &parts.geometry,
        &parts.bvh,
        &parts.surface,
        &mis,
        &parts.lights,
    ];
    run(&all, body, input, count, rows)
}

/// A light sample with what a ray along it meets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) wi: Vec3,
    pub(crate) pdf: f32,
    pub(crate) radiance: Vec3,
    pub(crate) visible: bool,
    /// Emission that a ray along wi meets, and the same weighted against density `pdf`.
    pub(crate) met: Vec3,
    pub(crate) weighted: Vec3,
}

pub(crate) fn sample(parts: &KernelParts, position: Vec3, count: usize, seed: u64) -> Vec<Sample> {
    let mut random = Random::new(seed);
    let numbers: Vec<Row> = (0..count).map(|_| [(); 4].map(|_| random.bits())).collect();
    sample_with(parts, position, &numbers)
}

/// One sample for each row of random bits.
pub(crate) fn sample_with(parts: &KernelParts, position: Vec3, numbers: &[Row]) -> Vec<Sample> {
    let count = numbers.len();
    let mut input = vec![row(position.extend(0.0).to_array())];
    input.extend(numbers);
    let body = EMISSION.to_owned()
        + "
        let position = bitcast<vec3<f32>>(input[0].xyz);
        let s = sample_light(position, input[i + 1u]);
        let visible = !trace_any(position, s.wi, s.distance, NO_PRIMITIVE);
        result[4u * i] = bitcast<vec4<u32>>(vec4<f32>(s.wi, s.pdf));
        result[4u * i + 1u] = bitcast<vec4<u32>>(vec4<f32>(s.radiance, select(0.0, 1.0, visible)));
        result[4u * i + 2u] = bitcast<vec4<u32>>(vec4<f32>(emission(position, s.wi, 0.0), 0.0));
        result[4u * i + 3u] = bitcast<vec4<u32>>(vec4<f32>(emission(position, s.wi, s.pdf), 0.0));";
    let rows = split_body(parts, &body, &input, count, 4 * count);
    let sample = |rows: &[Row]| {
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| floats(rows[k]));
        assert!(
            [a, b, c, d].as_flattened().iter().all(|v| v.is_finite()),
            "{a:?} {b:?} {c:?} {d:?}"
        );
        Sample {
            wi: Vec3::from_slice(&a),
            pdf: a[3],
            radiance: Vec3::from_slice(&b),
            visible: b[3] == 1.0,
            met: Vec3::from_slice(&c),
            weighted: Vec3::from_slice(&d),
        }
    };
    rows.chunks(4).map(sample).collect()
}

/// `fn emission`: what a ray meets, weighted against `bsdf_pdf`. Goes before the body.
const EMISSION: &str = "
    fn emission(position: vec3<f32>, direction: vec3<f32>, bsdf_pdf: f32) -> vec3<f32> {
        let hit = trace_closest(position, direction, 3e38, NO_PRIMITIVE);
        if hit.primitive == NO_PRIMITIVE {
            return light_escape(direction, bsdf_pdf);
        }
        return light_hit(hit.primitive, hit.t, direction, bsdf_pdf);
    }
    //body";

/// Moves the functions before `//body` out of the body.
pub(crate) fn split_body(
    parts: &KernelParts,
    body: &str,
    input: &[Row],
    count: usize,
    rows: usize,
) -> Vec<Row> {
    let (functions, body) = body.split_once("//body").expect("a marked body");
    let mut parts = parts.clone();
    parts.lights.wgsl += functions;
    evaluate(&parts, body, input, count, rows)
}

/// What rays from `position` along `directions` meet, weighted against `bsdf_pdf`.
pub(crate) fn met(
    parts: &KernelParts,
    position: Vec3,
    directions: &[Vec3],
    bsdf_pdf: f32,
) -> Vec<Vec3> {
    let mut input = vec![row(position.extend(bsdf_pdf).to_array())];
    input.extend(directions.iter().map(|d| row(d.extend(0.0).to_array())));
    let body = EMISSION.to_owned()
        + "
        let start = bitcast<vec4<f32>>(input[0]);
        let direction = bitcast<vec3<f32>>(input[i + 1u].xyz);
        result[i] = bitcast<vec4<u32>>(vec4<f32>(emission(start.xyz, direction, start.w), 0.0));";
    let count = directions.len();
    let rows = split_body(parts, &body, &input, count, count);
    rows.iter().map(|r| Vec3::from_slice(&floats(*r))).collect()
}
