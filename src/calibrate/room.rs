//! The scenes that a GPU is calibrated in, made without files: what is drawn by chance and what lies
//! in large areas are the two ends of how hits come together.

use glam::Vec3;
use impasto_compiler::cost::Inputs;
use impasto_runtime::scene::{
    Camera, Environment, EnvironmentSource, FilmSettings, Integrator, Light, MaterialBinding, Mesh,
    NO_MATERIAL, Scene,
};
use impasto_runtime::world::lights::quad::QuadLight;

use super::sources::Palette;

/// The name under which a scene's bindings name the palette's file.
pub const FILE: &str = "calibrate.impasto";
/// Tiles along a wall or the floor.
const TILES: usize = 48;
/// Half of the side of the room, in metres.
const HALF: f32 = 2.0;
/// The seed by which tiles get materials.
const SEED: u64 = 0x71e5;

/// How neighbouring paths hit materials.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coherence {
    /// In a closed room whose tiles have materials by chance.
    Random,
    /// On a plane under the sky, in large areas.
    Runs,
}

/// A scene with all materials of a palette, `side` pixels high and wide.
pub fn scene(palette: &Palette, coherence: Coherence, side: u32) -> Scene {
    let name = match coherence {
        Coherence::Random => "random",
        Coherence::Runs => "runs",
    };
    let binding = |material: &String| MaterialBinding {
        written: None,
        name: material.clone(),
        file: FILE.into(),
        material: Some(material.clone()),
        params: Vec::new(),
        bake: false,
        has_keys: false,
    };
    let mut scene = Scene {
        name: format!("{} {name}", palette.name),
        base: ".".into(),
        origin: Default::default(),
        camera: camera(coherence),
        camera_media: Vec::new(),
        film: FilmSettings {
            width: side,
            height: side,
        },
        integrator: Integrator {
            max_depth: 8,
            roulette_start: 4,
        },
        mesh: Mesh::default(),
        objects: Vec::new(),
        placements: Vec::new(),
        places: Vec::new(),
        object_places: Vec::new(),
        materials: palette.materials.iter().map(binding).collect(),
        lights: Vec::new(),
        environment: None,
        labels: Default::default(),
        warnings: Vec::new(),
    };
    match coherence {
        Coherence::Random => room(&mut scene),
        Coherence::Runs => plane(&mut scene),
    }
    scene
}

fn camera(coherence: Coherence) -> Camera {
    let (position, look_at) = match coherence {
        Coherence::Random => (Vec3::new(-1.2, 0.3, -1.7), Vec3::new(0.4, -0.1, 0.6)),
        // The horizon leaves a third of the picture to the sky.
        Coherence::Runs => (Vec3::new(0.0, 1.0, -3.5), Vec3::new(0.0, 0.62, 0.0)),
    };
    Camera {
        position,
        look_at,
        up: Vec3::Y,
        fov: 55.0,
        aperture: 0.0,
        focus: 1.0,
    }
}

/// Six walls of tiles whose materials are drawn, and a lamp below the ceiling.
fn room(scene: &mut Scene) {
    let count = scene.materials.len();
    let mut numbers = Inputs::new(SEED);
    for axis in 0..3 {
        for side in [-HALF, HALF] {
            let mut n = [0.0; 3];
            n[axis] = side;
            let [u, v] = [1, 2].map(|turn| {
                let mut edge = [0.0; 3];
                edge[(axis + turn) % 3] = 2.0 * HALF;
                Vec3::from(edge)
            });
            // Seen from inside.
            let (u, v) = if side < 0.0 { (u, v) } else { (v, u) };
            let corner = Vec3::from(n) - 0.5 * (u + v);
            tiles(&mut scene.mesh, corner, u, v, &mut |_, _| {
                ((numbers.unit() * count as f64) as usize).min(count - 1)
            });
        }
    }
    lamp(scene);
}

/// A plane of six areas, under an even sky.
fn plane(scene: &mut Scene) {
    let count = scene.materials.len();
    let (u, v) = (Vec3::new(0.0, 0.0, 16.0), Vec3::new(16.0, 0.0, 0.0));
    let corner = Vec3::new(-8.0, 0.0, -4.5);
    tiles(&mut scene.mesh, corner, u, v, &mut |i, j| {
        let (row, column) = (i * 8 / TILES, j * 6 / TILES);
        (row * 3 + column) % count
    });
    scene.environment = Some(Environment {
        source: EnvironmentSource::Uniform(Vec3::new(0.7, 0.8, 1.0)),
        rotate: 0.0,
        sample: true,
    });
}

/// A parallelogram of tiles, the front where u x v points, each of the material that `pick` says.
fn tiles(
    mesh: &mut Mesh,
    corner: Vec3,
    u: Vec3,
    v: Vec3,
    pick: &mut dyn FnMut(usize, usize) -> usize,
) {
    let step = 1.0 / TILES as f32;
    for i in 0..TILES {
        for j in 0..TILES {
            let material = pick(i, j) as u32;
            let at = |a: usize, b: usize| corner + (a as f32 * step) * u + (b as f32 * step) * v;
            let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            quad(mesh, corners, material, None);
        }
    }
}

fn quad(mesh: &mut Mesh, [a, b, c, d]: [Vec3; 4], material: u32, light: Option<u32>) {
    for corners in [[a, b, c], [a, c, d]] {
        mesh.positions.push(corners);
        mesh.materials.push(material);
        mesh.lights.push(light);
    }
}

fn lamp(scene: &mut Scene) {
    let (corner, u, v) = (
        Vec3::new(-0.7, 0.97 * HALF, -0.7),
        Vec3::new(1.4, 0.0, 0.0),
        Vec3::new(0.0, 0.0, 1.4),
    );
    let corners = [corner, corner + u, corner + u + v, corner + v];
    quad(&mut scene.mesh, corners, NO_MATERIAL, Some(0));
    // The front is where u x v points: down.
    scene.lights.push(Light::new(QuadLight {
        corner,
        u,
        v,
        radiance: Vec3::splat(4.0),
        two_sided: false,
        sample: true,
    }));
}

#[cfg(test)]
mod tests {
    use super::super::sources::palettes;
    use super::*;

    #[test]
    fn walls_face_inwards_and_bind_every_material() {
        for palette in palettes() {
            for coherence in [Coherence::Random, Coherence::Runs] {
                let scene = scene(&palette, coherence, 16);
                let used = |m: usize| scene.mesh.materials.contains(&(m as u32));
                assert!((0..palette.materials.len()).all(used), "{}", scene.name);
                let camera = scene.camera.position;
                for [a, b, c] in &scene.mesh.positions {
                    let normal = (b - a).cross(c - a);
                    assert!(normal.dot(camera - a) > 0.0, "{}: {a}", scene.name);
                }
            }
        }
    }
}
