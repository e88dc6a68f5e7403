//! A clearing with a pond in a forest of tens of thousands of trees, boulders, ferns and tufts of
//! grass: a dozen small meshes, each stored once and placed by a file of transforms.

mod flora;

use std::f64::consts::TAU;
use std::fmt::Write as _;

use glam::{DVec2, DVec3, dvec2, dvec3};

use crate::Model;
use crate::mesh::Mesh;
use crate::obj::MtlEntry;
use crate::random::{Random, fractal_noise};
use crate::shapes::{Topology, cuboid, grid};

/// Height of the pond's surface.
const WATER: f64 = -0.42;
/// The pond's middle and half of its length and width.
const POND: DVec2 = dvec2(-1.5, -9.0);
const POND_SIZE: DVec2 = dvec2(10.5, 6.5);
/// Where the camera stands; `examples/forest/scene.toml` says so, too.
const CAMERA: DVec2 = dvec2(2.6, 5.5);
/// The corners of the land.
const WEST: f64 = -170.0;
const EAST: f64 = 170.0;
const NORTH: f64 = -330.0;
const SOUTH: f64 = 45.0;

/// The materials of a mesh in its library. The scene's own bindings take their place.
fn library(mesh: &Mesh) -> &'static [MtlEntry] {
    const LIBRARIES: [&[MtlEntry]; 9] = [
        &[MtlEntry::diffuse("ground", [0.10, 0.09, 0.05])],
        &[MtlEntry::diffuse("water", [0.10, 0.15, 0.15])],
        &[
            MtlEntry::diffuse("bark", [0.10, 0.06, 0.04]),
            MtlEntry::diffuse("needles", [0.06, 0.13, 0.05]),
        ],
        &[MtlEntry::diffuse("birch", [0.62, 0.58, 0.52])],
        &[MtlEntry::diffuse("leaf", [0.30, 0.36, 0.06])],
        &[MtlEntry::diffuse("grass", [0.11, 0.20, 0.05])],
        &[MtlEntry::diffuse("fern", [0.15, 0.21, 0.05])],
        &[MtlEntry::diffuse("stone", [0.26, 0.25, 0.23])],
        &[
            MtlEntry::diffuse("stem", [0.78, 0.74, 0.64]),
            MtlEntry::diffuse("cap", [0.62, 0.03, 0.01]),
            MtlEntry::diffuse("flakes", [0.82, 0.79, 0.70]),
        ],
    ];
    let first = mesh.parts.first().map(|part| part.material);
    let is_its = |entries: &&&[MtlEntry]| entries.first().map(|entry| entry.name) == first;
    LIBRARIES.iter().find(is_its).copied().unwrap_or_default()
}

/// Every mesh, by the name of its file.
pub(crate) fn models() -> Vec<(&'static str, Model)> {
    let [birch_a, leaves_a] = flora::birch(11, 9.5);
    let [birch_b, leaves_b] = flora::birch(12, 7.5);
    [
        ("ground", ground()),
        ("water", water()),
        ("spruce_a", flora::spruce(1, 15.0, 2.9)),
        ("spruce_b", flora::spruce(2, 11.0, 2.3)),
        ("spruce_c", flora::spruce(3, 5.0, 1.5)),
        ("birch_a", birch_a),
        ("birch_b", birch_b),
        ("leaves_a", leaves_a),
        ("leaves_b", leaves_b),
        ("grass", flora::grass(21, 60, 0.42)),
        ("reed", flora::grass(22, 26, 1.25)),
        ("fern", flora::fern(23)),
        ("boulder_a", flora::boulder(31)),
        ("boulder_b", flora::boulder(58)),
        ("mushroom", flora::mushroom()),
    ]
    .map(|(name, mesh)| {
        let materials = library(&mesh);
        (name, Model { mesh, materials })
    })
    .into()
}

/// How high the land is.
fn height(at: DVec2) -> f64 {
    let p = dvec3(at.x, 0.0, at.y);
    let rough = fractal_noise(p * 0.11 + 70.0, 4, 5) - 0.5;
    let fine = fractal_noise(p * 0.9 + 20.0, 3, 6) - 0.5;
    // Hills around the clearing, less of them towards the gap in the north.
    let away = at.distance(dvec2(0.0, -8.0));
    let hill = smoothstep(16.0, 190.0, away);
    let gap = 1.0 - 0.75 * (-(at.x / 38.0 + 0.25 * (at.y * 0.03).sin()).powi(2)).exp();
    let ridge = 0.55 + 0.9 * fractal_noise(p * 0.012 + 3.0, 4, 9);
    let hollow = (-pond_distance(at).powi(2) * 1.1).exp();
    0.9 * rough + 0.14 * fine + 78.0 * hill * hill * gap * ridge - 1.75 * hollow + 0.25
}

/// 0 in the middle of the pond, about 1 at its shore.
fn pond_distance(at: DVec2) -> f64 {
    ((at - POND) / POND_SIZE).length()
}

fn smoothstep(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The land, finer near the camera.
fn ground() -> Mesh {
    let spread = |t: f64, low: f64, high: f64, near: f64| {
        // Cubic around `near`, so that cells there are a fraction of those at the ends.
        let s = 2.0 * t - 1.0;
        let end = if s < 0.0 { near - low } else { high - near };
        near + end * (0.12 * s + 0.88 * s * s * s)
    };
    let land = grid(240, 240, Topology::Sheet, |u, v| {
        let x = spread(u, WEST, EAST, 0.0);
        let z = spread(1.0 - v, NORTH, SOUTH, -2.0);
        dvec3(x, height(dvec2(x, z)), z)
    });
    let mut mesh = Mesh::default();
    mesh.add("ground", land);
    mesh
}

/// A body of water whose sides and bottom are below the land.
fn water() -> Mesh {
    let half = dvec3(POND_SIZE.x * 1.55, 0.0, POND_SIZE.y * 1.75);
    let middle = dvec3(POND.x, 0.0, POND.y);
    let low = middle - half + DVec3::Y * (WATER - 6.0);
    let mut mesh = Mesh::default();
    mesh.add("water", cuboid(low, middle + half + DVec3::Y * WATER));
    mesh
}

/// A file of placements.
struct Places {
    name: &'static str,
    text: String,
}

impl Places {
    fn new(name: &'static str, columns: &str) -> Self {
        let text = format!("{columns}\n");
        Places { name, text }
    }

    /// A place with its foot on the land, turned about y, and `more` columns.
    fn stand(&mut self, random: &mut Random, at: DVec2, sink: f64, more: &str) {
        let turn = random.range(0.0, 360.0);
        let y = height(at) - sink;
        let _ = writeln!(self.text, "{:.3} {y:.3} {:.3} {turn:.1} {more}", at.x, at.y);
    }
}

/// The files of placements, by name.
pub(crate) fn placements() -> Vec<(&'static str, Vec<u8>)> {
    let mut files = trees();
    files.extend(undergrowth());
    files.extend(stones());
    files
        .into_iter()
        .map(|f| (f.name, f.text.into_bytes()))
        .collect()
}

/// One point in each cell of a grid between two corners.
fn scatter(
    random: &mut Random,
    [low, high]: [DVec2; 2],
    cell: f64,
    mut visit: impl FnMut(&mut Random, DVec2),
) {
    let count = ((high - low) / cell).floor();
    for row in 0..count.y as usize {
        for column in 0..count.x as usize {
            let jitter = dvec2(random.unit(), random.unit());
            visit(
                random,
                low + (dvec2(column as f64, row as f64) + jitter) * cell,
            );
        }
    }
}

/// Is there room for a tree: on land, off the clearing, and not in the way of the camera?
fn is_wooded(random: &mut Random, at: DVec2) -> bool {
    let shore = pond_distance(at);
    let to_camera = at.distance(CAMERA);
    let glade = fractal_noise(dvec3(at.x, 3.0, at.y) * 0.045, 3, 77);
    let density = smoothstep(1.35, 2.3, shore) * smoothstep(0.22, 0.42, glade);
    to_camera > 7.5 && height(at) > WATER + 0.25 && random.chance(density)
}

fn trees() -> Vec<Places> {
    const STAND: &str = "x y z ry scale";
    const TINTED: &str = "x y z ry scale material";
    let mut spruces = ["spruces_a", "spruces_b", "spruces_c"].map(|n| Places::new(n, STAND));
    let mut wood = ["birches_a", "birches_b"].map(|n| Places::new(n, STAND));
    let mut leaves = ["foliage_a", "foliage_b"].map(|n| Places::new(n, TINTED));
    let random = &mut Random::new(2013);
    let land = [
        dvec2(WEST + 4.0, NORTH + 4.0),
        dvec2(EAST - 4.0, SOUTH - 4.0),
    ];
    scatter(random, land, 2.75, |random, at| {
        if !is_wooded(random, at) {
            return;
        }
        // Birches like the light at the water; far up there are spruces alone.
        let edge = 1.0 - smoothstep(2.0, 7.0, pond_distance(at));
        let grove = fractal_noise(dvec3(at.x, 9.0, at.y) * 0.03, 2, 41);
        let birch = 0.04 + 0.55 * edge + 0.5 * smoothstep(0.55, 0.7, grove);
        if random.chance(birch) {
            let kind = usize::from(random.chance(0.5));
            let scale = random.range(0.7, 1.2);
            let turn = random.range(0.0, 360.0);
            let place = format!(
                "{:.3} {:.3} {:.3} {turn:.1} {scale:.3}",
                at.x,
                height(at) - 0.1,
                at.y
            );
            let autumn =
                fractal_noise(dvec3(at.x, 1.0, at.y) * 0.06, 3, 13) + random.range(-0.16, 0.16);
            let color = match autumn {
                a if a < 0.37 => "leaf_green",
                a if a < 0.47 => "leaf_lime",
                a if a < 0.58 => "leaf_gold",
                _ => "leaf_copper",
            };
            let _ = writeln!(wood[kind].text, "{place}");
            let _ = writeln!(leaves[kind].text, "{place} {color}");
        } else {
            let kind = random.pick(&[0, 0, 1, 1, 1, 2]);
            let scale = format!("{:.3}", random.range(0.75, 1.25));
            spruces[kind].stand(random, at, 0.15, &scale);
        }
    });
    spruces.into_iter().chain(wood).chain(leaves).collect()
}

fn undergrowth() -> Vec<Places> {
    const STRETCHED: &str = "x y z ry sx sy sz";
    let mut grass = Places::new("grasses", "x y z ry sx sy sz material");
    let mut reeds = Places::new("reeds", STRETCHED);
    let mut ferns = Places::new("ferns", STRETCHED);
    let mut mushrooms = Places::new("mushrooms", STRETCHED);
    let random = &mut Random::new(55);
    let meadow = [dvec2(-38.0, -48.0), dvec2(38.0, 16.0)];
    scatter(random, meadow, 0.21, |random, at| {
        let h = height(at);
        let patch = fractal_noise(dvec3(at.x, 5.0, at.y) * 0.35, 3, 23);
        let near = 1.0 - 0.75 * smoothstep(12.0, 45.0, at.distance(CAMERA));
        if h < WATER + 0.04 || !random.chance(near * smoothstep(0.16, 0.46, patch)) {
            return;
        }
        let (wide, tall) = (
            random.range(0.8, 1.5),
            random.range(0.45, 1.2) * (0.5 + patch),
        );
        let dry = random.chance(0.12 + 0.5 * smoothstep(0.55, 0.7, patch));
        let color = if dry { "grass_dry" } else { "grass_green" };
        // Every other one is a mirror image.
        let hand = if random.chance(0.5) { wide } else { -wide };
        grass.stand(
            random,
            at,
            0.01,
            &format!("{hand:.3} {tall:.3} {wide:.3} {color}"),
        );
    });
    scatter(random, meadow, 0.34, |random, at| {
        let h = height(at);
        let patch = fractal_noise(dvec3(at.x, 2.0, at.y) * 0.22, 2, 29);
        let shallow = smoothstep(WATER - 0.42, WATER - 0.1, h) * smoothstep(WATER + 0.14, WATER, h);
        if random.chance(0.75 * shallow * smoothstep(0.46, 0.6, patch)) {
            let tall = random.range(0.7, 1.25);
            reeds.stand(random, at, 0.0, &format!("1 {tall:.3} 1"));
        }
    });
    scatter(random, meadow, 0.8, |random, at| {
        let shade = smoothstep(1.25, 1.9, pond_distance(at));
        let patch = fractal_noise(dvec3(at.x, 8.0, at.y) * 0.2, 2, 37);
        let here = height(at) > WATER + 0.2 && at.distance(CAMERA) > 1.6;
        if here && random.chance(0.6 * shade * smoothstep(0.45, 0.62, patch)) {
            let size = random.range(0.6, 1.3);
            let tall = size * random.range(0.7, 1.15);
            ferns.stand(random, at, 0.02, &format!("{size:.3} {tall:.3} {size:.3}"));
        }
    });
    for ring in [
        dvec2(1.3, 2.6),
        dvec2(3.7, 1.9),
        dvec2(-0.4, 1.1),
        dvec2(2.7, 0.2),
    ] {
        for _ in 0..9 {
            let angle = random.unit() * TAU;
            let at = ring + dvec2(angle.cos(), angle.sin()) * random.range(0.05, 0.5);
            let size = random.range(0.4, 1.0);
            let tall = size * random.range(0.8, 1.2);
            if height(at) > WATER + 0.06 {
                mushrooms.stand(random, at, 0.0, &format!("{size:.3} {tall:.3} {size:.3}"));
            }
        }
    }
    vec![grass, reeds, ferns, mushrooms]
}

fn stones() -> Vec<Places> {
    const LYING: &str = "x y z ry sx sy sz";
    let mut files = ["boulders_a", "boulders_b"].map(|n| Places::new(n, LYING));
    let random = &mut Random::new(99);
    let mut lay = |random: &mut Random, at: DVec2, size: f64| {
        let axes = [(); 3].map(|_| size * random.range(0.65, 1.35));
        let hand = if random.chance(0.5) {
            axes[0]
        } else {
            -axes[0]
        };
        let more = format!("{hand:.3} {:.3} {:.3}", axes[1], axes[2]);
        let kind = usize::from(random.chance(0.5));
        files[kind].stand(random, at, 0.1 * size, &more);
    };
    for _ in 0..420 {
        // Around the shore, the more the nearer.
        let angle = random.unit() * TAU;
        let out = 1.0 + random.range(-0.12, 0.4) * random.unit();
        let at = POND + POND_SIZE * dvec2(angle.cos(), angle.sin()) * out;
        if at.distance(CAMERA) > 3.0 {
            let size = 0.16 + 0.75 * random.unit().powi(4);
            lay(random, at, size);
        }
    }
    let land = [dvec2(-110.0, -200.0), dvec2(110.0, 20.0)];
    scatter(random, land, 6.0, |random, at| {
        if random.chance(0.35) && pond_distance(at) > 1.2 && at.distance(CAMERA) > 4.0 {
            let size = 0.3 + 1.6 * random.unit().powi(3);
            lay(random, at, size);
        }
    });
    files.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pond_is_a_hollow_that_its_water_does_not_leave() {
        assert!(height(POND) < WATER - 0.5);
        let box_half = dvec2(POND_SIZE.x * 1.55, POND_SIZE.y * 1.75);
        for i in 0..400 {
            let t = f64::from(i % 100) / 50.0 - 1.0;
            let side =
                [dvec2(t, 1.0), dvec2(t, -1.0), dvec2(1.0, t), dvec2(-1.0, t)][i as usize / 100];
            let at = POND + box_half * side;
            assert!(height(at) > WATER + 0.02, "water stands at {at}");
        }
    }

    #[test]
    fn trees_stand_on_land_and_there_are_tens_of_thousands_of_things() {
        let files = placements();
        let mut total = 0;
        for (name, bytes) in &files {
            let text = std::str::from_utf8(bytes).expect("text");
            let mut lines = text.lines();
            let columns = lines.next().expect("a header").split(' ').count();
            for line in lines {
                assert_eq!(line.split(' ').count(), columns, "{name}: {line}");
                let y: f64 = line
                    .split(' ')
                    .nth(1)
                    .expect("y")
                    .parse()
                    .expect("a number");
                assert!(y > WATER - 1.4, "{name}: {line}");
                if name.starts_with("spruces") || name.starts_with("birches") {
                    assert!(y > WATER, "{name}: {line}");
                }
                total += 1;
            }
        }
        assert!((40_000..120_000).contains(&total), "{total}");
    }
}
