//! Boxes around pieces of large triangles, in the place of one around all of each: early split clipping, after
//! Ernst and Greiner, "Early Split Clipping for Bounding Volume Hierarchies" (2007), by the rules of obvhs.
//!
//! A large triangle that lies askew has a box that is empty for the most part, and pulls everything that it reaches
//! into large nodes. What rays meet stays the triangle: a ray that hits it hits it in a piece whose box it meets.

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::splits::split_aabbs_precise;
use obvhs::triangle::Triangle;

use super::build::MAX_COORDINATE;
use crate::scene::{MAX_TRIANGLES, Mesh};

/// How often pieces are divided again.
const ROUNDS: usize = 12;
/// At how many places of its longest side a box may be divided.
const PLACES: u32 = 12;
/// Boxes are divided that have more than so many times the mean area of triangles' boxes ...
const LARGE: f32 = 3.0;
/// ... and if they have less than so many times of it, or less than a share of the largest, then those too of
/// which it saves less: areas shrink by the second factor, not by the first.
const MEDIUM: f32 = 4.0;
const SHARE_OF_LARGEST: f32 = 0.1;
const SAVES: [f32; 2] = [1.8, 1.6];
/// One more reference for so many triangles, at most: each is stored with all that its triangle has.
const TRIANGLES_A_REFERENCE: usize = 8;
/// Further references that any mesh may have.
const FEW: usize = 1 << 10;
/// How much boxes of pieces are widened, relative to the largest coordinate of the triangle: 32 units in its last
/// place. Where edges are divided is rounded, by some units, and so is where rays are thought to hit, by some units of
/// what lies farthest away.
const PADDING: f32 = 1.0 / (1 << 19) as f32;

/// What a tree is built over, if some triangles are in pieces.
pub(super) struct Pieces {
    /// Of triangles that are whole, and of pieces.
    pub boxes: Vec<Aabb>,
    /// The triangle that each box is of: the first boxes are of all triangles in their order.
    pub triangles: Vec<u32>,
    /// The share of the areas of all triangles' boxes that is saved.
    pub saved: f64,
}

/// Divides large triangles of a mesh, of which these are the boxes; none if there is nothing to divide.
pub(super) fn divide(mesh: &Mesh, boxes: &[Aabb]) -> Option<Pieces> {
    let most = most_references(boxes.len());
    let (mean, largest) = areas(boxes);
    let is_large = |index: &u32| {
        let each = &boxes[*index as usize];
        in_range(each) && each.half_area() > LARGE * mean
    };
    // The triangle of each piece, and which of the divided triangles it is.
    let divided: Vec<u32> = (0..boxes.len() as u32).filter(is_large).collect();
    let triangles: Vec<Triangle> = divided.iter().map(|t| triangle(mesh, *t)).collect();
    let mut pieces: Vec<Aabb> = divided.iter().map(|t| boxes[*t as usize]).collect();
    let mut of: Vec<u32> = (0..divided.len() as u32).collect();
    for _ in 0..ROUNDS {
        let count = pieces.len();
        // A round divides each of them once at most.
        let may_be_divided = pieces.iter().filter(|p| p.half_area() > LARGE * mean);
        if count - divided.len() + may_be_divided.count() > most {
            break;
        }
        split_aabbs_precise(
            &mut pieces,
            &mut of,
            &triangles,
            LARGE * mean,
            (MEDIUM * mean).max((1.0 - SHARE_OF_LARGEST) * mean + SHARE_OF_LARGEST * largest),
            SAVES[0],
            SAVES[1],
            1,
            PLACES,
        );
        if pieces.len() == count {
            break;
        }
    }
    if pieces.len() == divided.len() {
        return None;
    }
    let padded = |(piece, of): (&Aabb, &u32)| {
        let whole = &boxes[divided[*of as usize] as usize];
        if piece == whole {
            *whole
        } else {
            pad(piece, whole)
        }
    };
    let mut pieces = pieces.iter().zip(&of).map(padded);
    let mut all = boxes.to_vec();
    for (triangle, piece) in divided.iter().zip(&mut pieces) {
        all[*triangle as usize] = piece;
    }
    all.extend(pieces);
    let others = of[divided.len()..].iter().map(|of| divided[*of as usize]);
    let area = |boxes: &[Aabb]| boxes.iter().map(|b| f64::from(b.half_area())).sum::<f64>();
    Some(Pieces {
        saved: 1.0 - area(&all) / area(boxes),
        boxes: all,
        triangles: (0..boxes.len() as u32).chain(others).collect(),
    })
}

/// Further references that so many triangles may have.
fn most_references(triangles: usize) -> usize {
    let most = (triangles / TRIANGLES_A_REFERENCE).max(FEW);
    most.min(MAX_TRIANGLES.saturating_sub(triangles))
}

/// The mean and the largest half area of boxes.
fn areas(boxes: &[Aabb]) -> (f32, f32) {
    let areas = boxes.iter().filter(|b| in_range(b)).map(Aabb::half_area);
    let (sum, largest) = areas.fold((0.0, 0.0f32), |(sum, largest), area| {
        (sum + f64::from(area), area.max(largest))
    });
    ((sum / boxes.len().max(1) as f64) as f32, largest)
}

fn in_range(each: &Aabb) -> bool {
    let largest = each.min.abs().max(each.max.abs());
    largest.cmple(Vec3A::splat(MAX_COORDINATE)).all()
}

fn triangle(mesh: &Mesh, index: u32) -> Triangle {
    let [v0, v1, v2] = mesh.positions[index as usize].map(Vec3A::from);
    Triangle { v0, v1, v2 }
}

/// The box of a piece with all that rounding may have taken off it, within the box of its triangle.
fn pad(piece: &Aabb, whole: &Aabb) -> Aabb {
    let largest = whole.min.abs().max(whole.max.abs()).max_element();
    let padding = Vec3A::splat(PADDING * largest);
    let [low, high] = [piece.min.min(piece.max), piece.min.max(piece.max)];
    let padded = Aabb::new(low - padding, high + padding).intersection(whole);
    if padded.valid() { padded } else { *whole }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use impasto_fuzz::Random;
    use proptest::prelude::*;

    use super::super::bounds;
    use super::*;

    fn unit(random: &mut Random) -> f32 {
        (random.bits() >> 40) as f32 / (1 << 24) as f32
    }

    fn point(random: &mut Random) -> Vec3 {
        Vec3::from([(); 3].map(|()| 2.0 * unit(random) - 1.0))
    }

    /// So many small triangles and so many long ones about a place.
    fn mesh(random: &mut Random, small: usize, large: usize, place: Vec3) -> Mesh {
        let sizes = std::iter::repeat_n(0.01, small).chain(std::iter::repeat_n(1.0, large));
        let corners = |size: f32| {
            let center = place + point(random);
            let [along, across] = [(); 2].map(|()| size * point(random));
            let width = if size < 1.0 { 1.0 } else { 0.05 };
            [center - along, center + along, center + width * across]
        };
        Mesh {
            positions: sizes.map(corners).collect(),
            ..Mesh::default()
        }
    }

    fn boxes(mesh: &Mesh) -> Vec<Aabb> {
        mesh.positions.iter().map(bounds).collect()
    }

    /// The boxes of each triangle's pieces.
    fn of_triangles(pieces: &Pieces, triangles: usize) -> Vec<Vec<Aabb>> {
        assert_eq!(pieces.boxes.len(), pieces.triangles.len());
        let mut all = vec![Vec::new(); triangles];
        for (piece, triangle) in pieces.boxes.iter().zip(&pieces.triangles) {
            all[*triangle as usize].push(*piece);
        }
        all
    }

    #[test]
    fn pieces_hold_all_of_their_triangles_and_little_else() {
        let mut random = Random(5);
        for place in [Vec3::ZERO, Vec3::new(1000.0, -3e4, 7.0)] {
            let mesh = mesh(&mut random, 3000, 40, place);
            let whole = boxes(&mesh);
            let pieces = divide(&mesh, &whole).expect("large ones");
            let area = |boxes: &[Aabb]| boxes.iter().map(|b| f64::from(b.half_area())).sum::<f64>();
            assert!(area(&pieces.boxes) < 0.6 * area(&whole));
            let of_triangles = of_triangles(&pieces, mesh.len());
            for ((corners, own), whole) in mesh.positions.iter().zip(&of_triangles).zip(&whole) {
                let [a, b, c] = corners.map(|p| p.as_dvec3());
                for each in own {
                    assert!(each.min.cmpge(whole.min).all() && each.max.cmple(whole.max).all());
                }
                for _ in 0..20 {
                    let [mut s, mut t] = [(); 2].map(|()| f64::from(unit(&mut random)));
                    if s + t > 1.0 {
                        (s, t) = (1.0 - s, 1.0 - t);
                    }
                    let point = a + s * (b - a) + t * (c - a);
                    let holds = |each: &Aabb| {
                        let [low, high] = [each.min, each.max].map(|p| Vec3::from(p).as_dvec3());
                        point.cmpge(low).all() && point.cmple(high).all()
                    };
                    // One of a single box is within by rounding only.
                    assert!(
                        own.len() == 1 || own.iter().any(holds),
                        "{corners:?}: {point}"
                    );
                }
            }
        }
    }

    #[test]
    fn triangles_of_one_size_stay_whole() {
        let mesh = mesh(&mut Random(6), 0, 500, Vec3::ZERO);
        let boxes = vec![bounds(&mesh.positions[0]); 500];
        let equal = Mesh {
            positions: vec![mesh.positions[0]; 500],
            ..Mesh::default()
        };
        assert!(divide(&equal, &boxes).is_none());
        assert!(divide(&Mesh::default(), &[]).is_none());
    }

    /// Of very many large triangles among even more, each could have thousands of pieces.
    #[test]
    fn there_are_few_references_more_than_triangles() {
        let mut random = Random(7);
        let mut most = 0;
        for (small, large) in [(2000, 3), (2000, 200), (40_000, 1000)] {
            let mesh = mesh(&mut random, small, large, Vec3::ZERO);
            let pieces = divide(&mesh, &boxes(&mesh)).expect("large ones");
            let further = pieces.boxes.len() - mesh.len();
            eprintln!("{small} + {large}: {further}");
            assert!(further <= most_references(mesh.len()));
            most = most.max(further);
        }
        assert!(most > FEW, "the bound was never near");
    }

    proptest! {
        #[test]
        fn any_numbers_can_be_divided(
            corners in proptest::collection::vec(any::<[u32; 9]>(), 0..20),
            exponent in -30i32..38,
        ) {
            let mut mesh = mesh(&mut Random(8), 100, 2, Vec3::ZERO);
            for corner in mesh.positions.iter_mut().flatten() {
                *corner *= 10f32.powi(exponent);
            }
            let any = corners.iter().map(|c| {
                [0, 3, 6].map(|k| Vec3::from([0, 1, 2].map(|i| f32::from_bits(c[k + i]))))
            });
            mesh.positions.extend(any);
            let whole = boxes(&mesh);
            if let Some(pieces) = divide(&mesh, &whole) {
                prop_assert!(pieces.boxes.len() - mesh.len() <= most_references(mesh.len()));
                for own in of_triangles(&pieces, mesh.len()) {
                    prop_assert!(!own.is_empty());
                }
            }
        }
    }
}
