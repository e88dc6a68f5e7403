//! Where the materials of a mix are: 64 places, each of which a scene gives to one of its materials.
//!
//! In the room every small triangle is of a place drawn by lot, so that neighbouring paths hit whatever
//! they hit. The booths are eight by eight, open towards the camera, all of one's walls of one place:
//! a path stays in its booth, and neighbouring paths are in the same.

use glam::{DVec3, dvec3};

use crate::Model;
use crate::mesh::Mesh;
use crate::obj::MtlEntry;
use crate::random::{Random, lattice};
use crate::shapes::{Topology, grid};

/// Names of the places, in the booths column by column: paths are begun along the rows of a picture, and those that are
/// on their way at once should hit everything.
pub(super) const PLACES: [&str; 64] = [
    "s00", "s01", "s02", "s03", "s04", "s05", "s06", "s07", "s08", "s09", "s10", "s11", "s12",
    "s13", "s14", "s15", "s16", "s17", "s18", "s19", "s20", "s21", "s22", "s23", "s24", "s25",
    "s26", "s27", "s28", "s29", "s30", "s31", "s32", "s33", "s34", "s35", "s36", "s37", "s38",
    "s39", "s40", "s41", "s42", "s43", "s44", "s45", "s46", "s47", "s48", "s49", "s50", "s51",
    "s52", "s53", "s54", "s55", "s56", "s57", "s58", "s59", "s60", "s61", "s62", "s63",
];

static MATERIALS: [MtlEntry; PLACES.len()] = entries();

const fn entries() -> [MtlEntry; PLACES.len()] {
    let mut out = [MtlEntry::diffuse("", [0.6; 3]); PLACES.len()];
    let mut i = 0;
    while i < out.len() {
        out[i].name = PLACES[i];
        i += 1;
    }
    out
}

/// Size of the room in metres.
pub(super) const ROOM: DVec3 = dvec3(4.0, 3.0, 4.0);
/// Triangles' legs on its walls.
const CELL: f64 = 0.125;

/// How far its corners are off the walls' planes. Boxes without any thickness, as those of tessellated planes are, make
/// poor hierarchies: rays would take longer than materials.
const BUMP: f64 = 0.005;

/// Booths a row and a column.
const SIDE: usize = 8;
/// From the middle of a booth to that of the next, its width, and how deep it is, in metres.
const PITCH: f64 = 0.5;
const WIDTH: f64 = 0.49;
const DEPTH: f64 = 1.5;

/// The closed room; its floor is at y = 0, and x and z are 0 in the middle.
pub(crate) fn room() -> Model {
    let (half, height) = (0.5 * ROOM, dvec3(0.0, ROOM.y, 0.0));
    let corner = dvec3(-half.x, 0.0, -half.z);
    let mut mesh = Mesh::default();
    let mut lot = Random::new(64);
    for (origin, right, up) in walls(
        corner,
        dvec3(ROOM.x, 0.0, 0.0),
        height,
        dvec3(0.0, 0.0, ROOM.z),
    ) {
        let cells = |side: DVec3| (side.length() / CELL).round() as usize;
        let inward = right.cross(up).normalize();
        let wall = grid(cells(right), cells(up), Topology::Sheet, |u, v| {
            let place = origin + right * u + up * v;
            // The walls meet where they are plane.
            let is_edge = [u, v].iter().any(|t| *t <= 0.0 || *t >= 1.0);
            let [x, y, z] = (place * 1e3).round().to_array().map(|c| c as i64);
            let bump = if is_edge {
                0.0
            } else {
                lattice(x, y, z, 64) - 0.5
            };
            place + inward * (2.0 * BUMP * bump)
        });
        mesh.add_by(wall, |_| lot.pick(&PLACES));
    }
    Model {
        mesh,
        materials: &MATERIALS,
    }
}

/// The booths, around x = y = 0; their open sides are at z = 0 and look along +z.
pub(crate) fn booths() -> Model {
    let mut mesh = Mesh::default();
    for (i, place) in PLACES.iter().enumerate() {
        let middle = |n: usize| (n as f64 - 0.5 * (SIDE - 1) as f64) * PITCH;
        let (x, y) = (middle(i / SIDE), middle(i % SIDE));
        let corner = dvec3(x - 0.5 * WIDTH, y - 0.5 * WIDTH, -DEPTH);
        let [w, h, d] = [DVec3::X * WIDTH, DVec3::Y * WIDTH, DVec3::Z * DEPTH];
        // The last wall would close it.
        for (origin, right, up) in &walls(corner, w, h, d)[..5] {
            let wall = grid(1, 1, Topology::Sheet, |u, v| *origin + *right * u + *up * v);
            mesh.add(place, wall);
        }
    }
    Model {
        mesh,
        materials: &MATERIALS,
    }
}

/// The walls of a box as (corner, right, up), which face inward: floor, ceiling, left, right, back, and
/// the front at last.
fn walls(corner: DVec3, w: DVec3, h: DVec3, d: DVec3) -> [(DVec3, DVec3, DVec3); 6] {
    [
        (corner + d, w, -d),
        (corner + h, w, d),
        (corner + d, -d, h),
        (corner + w, d, h),
        (corner, w, h),
        (corner + w + d, -w, h),
    ]
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::check::{is_closed, signed_volume};
    use crate::mesh::Triangle;

    /// Corners at the same point get the same index, as the walls of a closed room would have it.
    fn welded(mesh: &Mesh) -> Vec<Triangle> {
        let key = |i: u32| {
            (mesh.positions[i as usize] * 1e6)
                .round()
                .to_array()
                .map(|c| c as i64)
        };
        let mut first = BTreeMap::new();
        let mut triangles: Vec<Triangle> = mesh
            .parts
            .iter()
            .flat_map(|p| p.triangles.clone())
            .collect();
        for corner in triangles.iter_mut().flatten() {
            corner.position = *first.entry(key(corner.position)).or_insert(corner.position);
        }
        triangles
    }

    #[test]
    fn the_room_is_closed_and_faces_inward() {
        let mesh = room().mesh;
        let triangles = welded(&mesh);
        assert!(is_closed(&triangles));
        let volume = signed_volume(&mesh.positions, &triangles);
        assert!(
            (volume / -ROOM.element_product() - 1.0).abs() < 1e-3,
            "{volume}"
        );
    }

    #[test]
    fn no_two_neighbours_on_a_wall_are_in_a_plane() {
        let mesh = room().mesh;
        let triangles = mesh.parts.iter().flat_map(|p| &p.triangles);
        let thin = triangles.filter(|t| {
            let points = t.map(|c| mesh.positions[c.position as usize]);
            let size = points.iter().fold(DVec3::NEG_INFINITY, |m, p| m.max(*p))
                - points.iter().fold(DVec3::INFINITY, |m, p| m.min(*p));
            size.min_element() < 1e-6
        });
        // Those whose three corners are on edges of walls.
        assert!(thin.count() <= 12);
    }

    #[test]
    fn places_share_the_room_evenly_and_by_lot() {
        let mesh = room().mesh;
        let even = mesh.triangle_count() / PLACES.len();
        for part in &mesh.parts {
            let count = part.triangles.len();
            assert!(
                count > even / 2 && count < 2 * even,
                "{}: {count} of {even}",
                part.material
            );
        }
    }

    #[test]
    fn a_booth_is_open_in_front_only_and_of_one_place() {
        let mesh = booths().mesh;
        for part in &mesh.parts {
            assert_eq!(part.triangles.len(), 10);
            let points = part
                .triangles
                .iter()
                .flatten()
                .map(|c| mesh.positions[c.position as usize]);
            let low = points.clone().fold(DVec3::INFINITY, DVec3::min);
            let high = points.fold(DVec3::NEG_INFINITY, DVec3::max);
            let size = (high - low) - dvec3(WIDTH, WIDTH, DEPTH);
            assert!(size.abs().max_element() < 1e-9);
            let front = part.triangles.iter().filter(|t| {
                t.iter()
                    .all(|c| mesh.positions[c.position as usize].z > -1e-9)
            });
            assert_eq!(front.count(), 0);
        }
    }
}
