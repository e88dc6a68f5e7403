//! Boxes around the lights of a scene. The last ray of a path gathers the light that it meets and nothing else: one that
//! meets none of a few boxes need not be cast.

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;

use crate::world::bvh;

/// Every last ray is tested with all of them.
const MOST: usize = 8;
/// Boxes of a larger area than this share of that of the box around the scene are met by too many rays.
const SMALL: f32 = 0.5;
/// Two boxes are better than one around both if they have less than this share of its area.
const WORTH_A_BOX: f32 = 0.9;
/// By this share of the largest coordinate boxes are wider than lights: 16 units in the last place. Rounding here, and that
/// of ray casts, which may meet a light just beyond its edge, are a few.
const SLACK: f32 = 1.0 / (1 << 20) as f32;

/// Boxes in which everything lies that shines.
#[derive(Clone, Debug, Default)]
pub(super) struct Boxes {
    /// At most [`MOST`], in metres.
    boxes: Vec<Aabb>,
    /// Whether most rays meet none.
    pub(super) are_small: bool,
}

impl Boxes {
    /// Those around some triangles in a scene that reaches from corner to corner of `scene`.
    pub(super) fn around(triangles: impl Iterator<Item = [Vec3; 3]>, scene: [Vec3; 2]) -> Self {
        let all: Vec<Aabb> = triangles.map(|corners| bvh::bounds(&corners)).collect();
        if all.is_empty() {
            return Self::default();
        }
        let scene = Aabb::from_points(&scene.map(Vec3A::from));
        let slack = Vec3A::splat(SLACK * scene.min.abs().max(scene.max.abs()).max_element());
        let groups = divided(all);
        let boxes = groups.iter().map(|group| joined(group));
        let boxes: Vec<Aabb> = boxes
            .map(|around| Aabb::new(around.min - slack, around.max + slack))
            .collect();
        let area: f32 = boxes.iter().map(Aabb::half_area).sum();
        Self {
            are_small: area <= SMALL * scene.half_area(),
            boxes,
        }
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.boxes.len()
    }

    /// Two rows of words a box, its corners; see `boxes.wgsl`.
    pub(super) fn rows(&self) -> impl Iterator<Item = [[u32; 4]; 2]> {
        let row = |corner: Vec3A| corner.extend(0.0).to_array().map(f32::to_bits);
        let boxes = self.boxes.iter();
        boxes.map(move |each| [row(each.min), row(each.max)])
    }
}

/// Boxes in groups, each of which is better in one box than in two.
fn divided(all: Vec<Aabb>) -> Vec<Vec<Aabb>> {
    let (mut whole, mut groups) = (Vec::new(), vec![all]);
    // The largest first, as long as there may be more.
    while whole.len() + groups.len() < MOST {
        let area = |group: &Vec<Aabb>| joined(group).half_area();
        let largest =
            (0..groups.len()).max_by(|a, b| area(&groups[*a]).total_cmp(&area(&groups[*b])));
        let Some(largest) = largest else { break };
        match halved(groups.swap_remove(largest)) {
            Ok(halves) => groups.extend(halves),
            Err(group) => whole.push(group),
        }
    }
    whole.extend(groups);
    whole
}

/// A group on both sides of its middle, or the group if it is no better divided.
fn halved(group: Vec<Aabb>) -> Result<[Vec<Aabb>; 2], Vec<Aabb>> {
    let around = joined(&group);
    let axis = around.largest_axis();
    let middle = around.center_axis(axis);
    let (low, high): (Vec<Aabb>, Vec<Aabb>) = group
        .iter()
        .partition(|each| each.center_axis(axis) < middle);
    if low.is_empty() || high.is_empty() {
        return Err(group);
    }
    let area = joined(&low).half_area() + joined(&high).half_area();
    if area < WORTH_A_BOX * around.half_area() {
        Ok([low, high])
    } else {
        Err(group)
    }
}

fn joined(boxes: &[Aabb]) -> Aabb {
    let all = boxes.iter();
    all.fold(Aabb::empty(), |around, each| around.union(each))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: [Vec3; 2] = [Vec3::splat(-10.0), Vec3::splat(10.0)];

    /// The two triangles of a square of side 1 that faces y.
    fn square(x: f32, z: f32) -> [[Vec3; 3]; 2] {
        let at = |u: f32, v: f32| Vec3::new(x + u, 5.0, z + v);
        [
            [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0)],
            [at(0.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)],
        ]
    }

    #[test]
    fn every_light_has_a_box_of_its_own_while_there_are_few() {
        let lights = [square(-9.0, -9.0), square(0.0, 3.0), square(8.0, -2.0)];
        let boxes = Boxes::around(lights.iter().copied().flatten(), SCENE);
        assert_eq!(boxes.len(), 3);
        assert!(boxes.are_small);
        // Each a little wider than its square, and no more.
        for each in &boxes.boxes {
            let size = each.diagonal();
            assert!(size.x > 1.0 && size.x < 1.0001 && size.y > 0.0 && size.y < 0.0001);
        }
    }

    #[test]
    fn many_lights_share_boxes_and_all_lie_in_one() {
        // Two rows in opposite corners.
        let squares = (0..100u8).map(|i| {
            let along = 0.03 * f32::from(i);
            if i % 2 == 0 {
                square(along - 9.0, -9.0)
            } else {
                square(along + 5.0, 8.0)
            }
        });
        let triangles: Vec<[Vec3; 3]> = squares.flatten().collect();
        let boxes = Boxes::around(triangles.iter().copied(), SCENE);
        assert_eq!(boxes.len(), 2);
        assert!(boxes.are_small);
        for corner in triangles.as_flattened() {
            let corner = Vec3A::from(*corner);
            let holds = |each: &Aabb| corner.cmpgt(each.min).all() && corner.cmplt(each.max).all();
            assert!(boxes.boxes.iter().any(holds), "{corner}");
        }
    }

    #[test]
    fn lights_all_around_are_not_small() {
        let wall = [
            Vec3::splat(-10.0),
            Vec3::new(10.0, -10.0, 10.0),
            Vec3::splat(10.0),
        ];
        assert!(!Boxes::around([wall].into_iter(), SCENE).are_small);
        let none = Boxes::around(std::iter::empty(), SCENE);
        assert!(!none.are_small && none.len() == 0);
    }
}
