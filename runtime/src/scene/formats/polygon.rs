//! Cuts polygons into triangles: by ears, after Held, "FIST: Fast Industrial-Strength Triangulation of
//! Polygons" (2001). Holes are part of the outline, joined to it by an edge that is there twice.
//!
//! A corner is an ear if the triangle of it and its neighbors holds no other part of the outline; cutting
//! it off leaves a polygon of one corner less. Only the two neighbors of an ear can become ears by that,
//! so corners are asked at most three times each, and the corners that may lie in an ear are in a tree:
//! a polygon of any shape takes little more time than sorting its corners. After an ear its neighbors wait
//! until all others were asked, which cuts round polygons in halves instead of slivers.

use std::collections::VecDeque;

use glam::{DVec2, DVec3};

/// Corners of polygons that stay fans if they can: triangles around the first corner. A ray through a fan
/// meets the boxes of half of its triangles.
const LARGEST_FAN: usize = 64;
/// How much of a polygon's area triangles of a fan may lie outside of it, by the rounding of its corners.
const ROUNDING: f64 = 1e-6;

/// Triangles as indices of corners, always two less than those.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Cut {
    pub(super) triangles: Vec<[usize; 3]>,
    /// Does the outline cross itself, so that no triangles cover just what is inside?
    pub(super) crosses: bool,
}

/// Cuts the polygon of these corners, at least three, which lie in a plane or about so.
pub(super) fn cut(corners: &[DVec3]) -> Cut {
    let fan = |crosses| Cut {
        triangles: (2..corners.len()).map(|c| [0, c - 1, c]).collect(),
        crosses,
    };
    if corners.len() < 4 {
        return fan(false);
    }
    let normal = normal(corners);
    if normal == DVec3::ZERO {
        // Its corners lie on a line, or as much of it is on one side as on the other.
        return fan(!is_line(corners));
    }
    if is_fan(corners, normal) && corners.len() <= LARGEST_FAN {
        return fan(false);
    }
    Outline::new(flattened(corners, normal)).cut()
}

/// Newell's normal, of which the length is twice the area. It is exact enough for corners far from the origin
/// since they are taken from the first of them.
fn normal(corners: &[DVec3]) -> DVec3 {
    let edges = corners.windows(2).skip(1);
    let cross = |edge: &[DVec3]| (edge[0] - corners[0]).cross(edge[1] - corners[0]);
    let normal: DVec3 = edges.map(cross).sum();
    let reach = corners.iter().map(|c| (c - corners[0]).abs().max_element());
    let reach = reach.fold(0.0, f64::max);
    let is_rounding = normal.length() <= 1e-12 * reach * reach;
    if is_rounding || !normal.is_finite() {
        DVec3::ZERO
    } else {
        normal
    }
}

fn is_line(corners: &[DVec3]) -> bool {
    let first = corners[0];
    let far = corners.iter().map(|c| c - first);
    let far = far.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    let along = far.unwrap_or_default();
    let aside = |c: &DVec3| (c - first).cross(along).length();
    corners
        .iter()
        .all(|c| aside(c) <= 1e-9 * along.length_squared())
}

/// Do the triangles around the first corner cover the polygon? They do if none is turned over: the outline
/// then winds around that corner one way, and by less than a turn.
fn is_fan(corners: &[DVec3], normal: DVec3) -> bool {
    let (first, up) = (corners[0], normal.normalize());
    let limit = -ROUNDING * normal.length();
    let edges = corners
        .windows(2)
        .skip(1)
        .map(|e| [e[0] - first, e[1] - first]);
    let mut turn = 0.0;
    for [a, b] in edges {
        let area = a.cross(b).dot(up);
        if area < limit {
            return false;
        }
        turn += area.max(0.0).atan2(a.dot(b));
    }
    turn < std::f64::consts::TAU
}

/// The corners without the coordinate along which the polygon is thinnest, counter-clockwise.
fn flattened(corners: &[DVec3], normal: DVec3) -> Vec<DVec2> {
    let size = normal.abs();
    let (pick, up): (fn(DVec3) -> DVec2, f64) = if size.x >= size.y.max(size.z) {
        (|p| DVec2::new(p.y, p.z), normal.x)
    } else if size.y >= size.z {
        (|p| DVec2::new(p.z, p.x), normal.y)
    } else {
        (|p| DVec2::new(p.x, p.y), normal.z)
    };
    let mirror = DVec2::new(up.signum(), 1.0);
    let first = pick(corners[0]);
    corners
        .iter()
        .map(|&c| mirror * (pick(c) - first))
        .collect()
}

/// Twice the area of a triangle, positive if it is counter-clockwise.
fn doubled_area(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// What is left of a polygon.
struct Outline {
    points: Vec<DVec2>,
    /// The corners before and after each corner.
    before: Vec<usize>,
    after: Vec<usize>,
    /// Corners to be asked, each with how often its neighbors had changed when it was put there.
    waiting: VecDeque<(usize, u32)>,
    changes: Vec<u32>,
    obstacles: Obstacles,
    left: usize,
    triangles: Vec<[usize; 3]>,
}

impl Outline {
    fn new(points: Vec<DVec2>) -> Outline {
        let count = points.len();
        let before: Vec<usize> = (0..count).map(|i| (i + count - 1) % count).collect();
        let after: Vec<usize> = (0..count).map(|i| (i + 1) % count).collect();
        let may_be_inside = |&i: &usize| {
            let [a, b, c] = [before[i], i, after[i]].map(|i| points[i]);
            doubled_area(a, b, c) <= 0.0
        };
        let obstacles = Obstacles::new((0..count).filter(may_be_inside).collect(), &points);
        Outline {
            waiting: (0..count).map(|i| (i, 0)).collect(),
            changes: vec![0; count],
            triangles: Vec::with_capacity(count - 2),
            left: count,
            points,
            before,
            after,
            obstacles,
        }
    }

    fn cut(mut self) -> Cut {
        self.cut_ears(false);
        if self.left > 3 {
            // Rounding, or corners on an edge of others.
            let corners = self.corners();
            self.waiting = corners.iter().map(|&i| (i, self.changes[i])).collect();
            self.cut_ears(true);
        }
        let corners = self.corners();
        let rest = (2..corners.len()).map(|i| [corners[0], corners[i - 1], corners[i]]);
        self.triangles.extend(rest);
        // Ears are not turned over. If the rest is, some of it lies outside.
        let area =
            |t: &[usize; 3]| doubled_area(self.points[t[0]], self.points[t[1]], self.points[t[2]]);
        let whole: f64 = self.triangles.iter().map(area).sum();
        let rest = &self.triangles[self.points.len() - self.left..];
        Cut {
            crosses: rest.iter().any(|t| area(t) < -ROUNDING * whole),
            triangles: self.triangles,
        }
    }

    /// The corners that are left, in their order.
    fn corners(&self) -> Vec<usize> {
        let start = (0..self.points.len())
            .find(|&i| self.is_left(i))
            .unwrap_or(0);
        std::iter::successors(Some(start), |&i| Some(self.after[i]))
            .take(self.left)
            .collect()
    }

    fn is_left(&self, corner: usize) -> bool {
        self.changes[corner] != u32::MAX
    }

    /// Cuts off ears until there are none, or three corners are left.
    fn cut_ears(&mut self, flat_ones: bool) {
        while self.left > 3
            && let Some((corner, changes)) = self.waiting.pop_front()
        {
            if self.changes[corner] == changes && self.is_ear(corner, flat_ones) {
                self.cut_off(corner);
            }
        }
    }

    /// Nothing else may be in an ear or, unless flat ones count, on the edge that cuts it off.
    fn is_ear(&self, corner: usize, flat_ones: bool) -> bool {
        let [a, b, c] = [self.before[corner], corner, self.after[corner]].map(|i| self.points[i]);
        let area = doubled_area(a, b, c);
        if area < 0.0 || (area == 0.0 && !flat_ones) {
            return false;
        }
        let edge = |p: DVec2| doubled_area(c, a, p);
        let is_inside = |p: DVec2| {
            let inner = doubled_area(a, b, p) > 0.0 && doubled_area(b, c, p) > 0.0;
            inner && (edge(p) > 0.0 || (edge(p) == 0.0 && !flat_ones))
        };
        !self.obstacles.any_in([a, b, c], is_inside)
    }

    fn cut_off(&mut self, corner: usize) {
        let (a, c) = (self.before[corner], self.after[corner]);
        self.triangles.push([a, corner, c]);
        self.after[a] = c;
        self.before[c] = a;
        self.changes[corner] = u32::MAX;
        self.obstacles.remove(corner);
        self.left -= 1;
        for neighbor in [a, c] {
            self.changes[neighbor] += 1;
            self.waiting.push_back((neighbor, self.changes[neighbor]));
            let [a, b, c] =
                [self.before[neighbor], neighbor, self.after[neighbor]].map(|i| self.points[i]);
            if doubled_area(a, b, c) > 0.0 {
                self.obstacles.remove(neighbor);
            }
        }
    }
}

/// The corners that may lie in an ear, those that are not convex: a tree that is a list, in which the middle
/// of each range divides it along the longer side of its box.
struct Obstacles {
    nodes: Vec<Node>,
    /// The node of each corner that is or was one.
    of_corner: Vec<Option<usize>>,
}

/// A corner, and what is still there in the range whose middle it is.
struct Node {
    point: DVec2,
    is_there: bool,
    count: usize,
    low: DVec2,
    high: DVec2,
}

impl Obstacles {
    fn new(mut corners: Vec<usize>, points: &[DVec2]) -> Obstacles {
        let mut nodes: Vec<Node> = Vec::new();
        nodes.resize_with(corners.len(), || Node {
            point: DVec2::ZERO,
            is_there: true,
            count: 0,
            low: DVec2::INFINITY,
            high: DVec2::NEG_INFINITY,
        });
        let mut ranges = vec![(0, corners.len())];
        while let Some((first, end)) = ranges.pop() {
            if first == end {
                continue;
            }
            let range = &mut corners[first..end];
            let low = range.iter().fold(DVec2::INFINITY, |m, &i| m.min(points[i]));
            let high = range
                .iter()
                .fold(DVec2::NEG_INFINITY, |m, &i| m.max(points[i]));
            let axis = usize::from((high - low).y > (high - low).x);
            let key = |i: &usize| points[*i][axis];
            range.select_nth_unstable_by((end - first) / 2, |i, j| key(i).total_cmp(&key(j)));
            let middle = usize::midpoint(first, end);
            nodes[middle] = Node {
                point: points[corners[middle]],
                is_there: true,
                count: end - first,
                low,
                high,
            };
            ranges.extend([(first, middle), (middle + 1, end)]);
        }
        let mut of_corner = vec![None; points.len()];
        for (node, &corner) in corners.iter().enumerate() {
            of_corner[corner] = Some(node);
        }
        Obstacles { nodes, of_corner }
    }

    fn remove(&mut self, corner: usize) {
        let Some(node) = self.of_corner[corner].take() else {
            return;
        };
        let (mut first, mut end) = (0, self.nodes.len());
        loop {
            let middle = usize::midpoint(first, end);
            self.nodes[middle].count -= 1;
            match node.cmp(&middle) {
                std::cmp::Ordering::Less => end = middle,
                std::cmp::Ordering::Greater => first = middle + 1,
                std::cmp::Ordering::Equal => break,
            }
        }
        self.nodes[node].is_there = false;
    }

    /// Is one that is still there inside a triangle?
    fn any_in(&self, triangle: [DVec2; 3], is_inside: impl Fn(DVec2) -> bool) -> bool {
        let [a, b, c] = triangle;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        // A box lies outside if it is beyond one of the edges as a whole.
        let is_apart = |node: &Node| {
            let beyond = |from: DVec2, to: DVec2| {
                let inward = (to - from).perp();
                let nearest = DVec2::select(inward.cmpgt(DVec2::ZERO), node.high, node.low);
                (nearest - from).dot(inward) < 0.0
            };
            let off = node.high.cmplt(low).any() || node.low.cmpgt(high).any();
            off || beyond(a, b) || beyond(b, c) || beyond(c, a)
        };
        let mut ranges = vec![(0, self.nodes.len())];
        while let Some((first, end)) = ranges.pop() {
            let middle = usize::midpoint(first, end);
            let Some(node) = self.nodes.get(middle).filter(|_| first < end) else {
                continue;
            };
            if node.count == 0 || is_apart(node) {
                continue;
            }
            if node.is_there && is_inside(node.point) {
                return true;
            }
            ranges.extend([(first, middle), (middle + 1, end)]);
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use impasto_fuzz::Random;
    use proptest::prelude::*;

    use super::*;

    fn flat(points: &[[f64; 2]]) -> Vec<DVec3> {
        points
            .iter()
            .map(|[x, y]| DVec3::new(*x, *y, 0.0))
            .collect()
    }

    fn area(corners: &[DVec3], [a, b, c]: [usize; 3]) -> f64 {
        0.5 * (corners[b] - corners[a]).cross(corners[c] - corners[a]).z
    }

    /// Cuts a polygon of the plane z = 0 that winds counter-clockwise and does not cross itself. The
    /// triangles are as large as it together, none is turned over, so they cover it once.
    #[track_caller]
    fn covers(corners: &[DVec3]) -> Cut {
        let cut = cut(corners);
        assert_eq!(cut.triangles.len(), corners.len() - 2);
        assert!(!cut.crosses);
        let whole = 0.5 * normal(corners).z;
        let areas = cut.triangles.iter().map(|t| area(corners, *t));
        let sum: f64 = areas.clone().sum();
        assert!((sum - whole).abs() <= 1e-9 * whole, "{sum} {whole}");
        let worst = areas.fold(f64::INFINITY, f64::min);
        assert!(worst >= -1e-6 * whole, "{worst} of {whole}");
        cut
    }

    fn fan(count: usize) -> Vec<[usize; 3]> {
        (2..count).map(|c| [0, c - 1, c]).collect()
    }

    fn around(share: f64, radius: f64) -> [f64; 2] {
        let (y, x) = (std::f64::consts::TAU * share).sin_cos();
        [radius * x, radius * y]
    }

    #[test]
    fn convex_polygons_are_fans_from_their_first_corner() {
        for count in 3..=LARGEST_FAN {
            let points: Vec<[f64; 2]> = (0..count)
                .map(|i| around(i as f64 / count as f64, 2.0))
                .collect();
            assert_eq!(covers(&flat(&points)).triangles, fan(count));
        }
        // With a corner in the midst of an edge, and one off the plane.
        let mut points = flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]);
        assert_eq!(covers(&points).triangles, fan(5));
        points[3].z = 0.1;
        assert_eq!(cut(&points).triangles, fan(5));
    }

    /// Ray casts through a fan of many triangles would be slow.
    #[test]
    fn large_convex_polygons_are_cut_in_halves() {
        let count = 1024;
        let points: Vec<[f64; 2]> = (0..count)
            .map(|i| around(i as f64 / count as f64, 1.0))
            .collect();
        let corners = flat(&points);
        let cut = covers(&corners);
        let boxes = |p: DVec3| {
            let holds = |t: &&[usize; 3]| {
                let [a, b, c] = t.map(|i| corners[i]);
                p.cmpge(a.min(b).min(c)).all() && p.cmple(a.max(b).max(c)).all()
            };
            cut.triangles.iter().filter(holds).count()
        };
        let most = (0..200).map(|i| {
            let [x, y] = around(0.618 * f64::from(i), f64::from(i) / 200.0);
            boxes(DVec3::new(x, y, 0.0))
        });
        let most = most.max().unwrap_or(0);
        assert!(most <= 24, "{most} boxes");
    }

    #[test]
    fn a_dart_is_cut_at_its_dent() {
        let points = [[0.0, 0.0], [2.0, -1.0], [0.5, 0.0], [2.0, 1.0]];
        for turn in 0..4 {
            let mut points = points;
            points.rotate_left(turn);
            covers(&flat(&points));
        }
    }

    /// A square with a square hole, joined by an edge that is there twice; and with two of them.
    #[test]
    fn holes_stay_open() {
        let one = [
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 4.0],
            [0.0, 4.0],
            [0.0, 0.0],
            [1.0, 1.0],
            [1.0, 2.0],
            [2.0, 2.0],
            [2.0, 1.0],
            [1.0, 1.0],
        ];
        let inside = |corners: &[DVec3], cut: &Cut, p: DVec3| {
            let sees = |t: &&[usize; 3]| {
                let [a, b, c] = t.map(|i| corners[i]);
                [(a, b), (b, c), (c, a)]
                    .iter()
                    .all(|(a, b)| (*b - *a).cross(p - *a).z > 0.0)
            };
            cut.triangles.iter().filter(sees).count()
        };
        for turn in 0..one.len() {
            let mut points = one;
            points.rotate_left(turn);
            let corners = flat(&points);
            let cut = covers(&corners);
            assert_eq!(
                inside(&corners, &cut, DVec3::new(1.51, 1.47, 0.0)),
                0,
                "turned by {turn}"
            );
            assert_eq!(
                inside(&corners, &cut, DVec3::new(3.01, 2.97, 0.0)),
                1,
                "turned by {turn}"
            );
        }
        let two = [
            [0.0, 0.0],
            [9.0, 0.0],
            [9.0, 4.0],
            [0.0, 4.0],
            [0.0, 0.0],
            [1.0, 1.0],
            [1.0, 2.0],
            [2.0, 2.0],
            [2.0, 1.0],
            [5.0, 1.0],
            [5.0, 2.0],
            [6.0, 2.0],
            [6.0, 1.0],
            [5.0, 1.0],
            [2.0, 1.0],
            [1.0, 1.0],
        ];
        let corners = flat(&two);
        assert_eq!(
            inside(&corners, &covers(&corners), DVec3::new(5.51, 1.47, 0.0)),
            0
        );
    }

    #[test]
    fn polygons_in_any_plane_keep_their_side() {
        let points = [[0.0, 0.0], [2.0, -1.0], [0.5, 0.0], [2.0, 1.0]];
        let axes = [
            DVec3::X,
            DVec3::Y,
            DVec3::Z,
            DVec3::new(1.0, -2.0, 0.5),
            DVec3::new(-3.0, 1.0, 1.0),
        ];
        for axis in axes.into_iter().flat_map(|a| [a, -a]) {
            let (u, v) = axis.normalize().any_orthonormal_pair();
            let mut corners: Vec<DVec3> =
                points.iter().map(|[x, y]| 1e6 + *x * u + *y * v).collect();
            let up = u.cross(v);
            // From some corners it is a fan, from others it is not.
            for _ in 0..points.len() {
                corners.rotate_left(1);
                let cut = cut(&corners);
                assert!(!cut.crosses);
                for [a, b, c] in cut.triangles {
                    let [along, across] = [b, c].map(|k| corners[k] - corners[a]);
                    assert!(along.cross(across).dot(up) > 0.1);
                }
            }
        }
    }

    #[test]
    fn what_crosses_itself_or_has_no_area_is_told() {
        let bow = [[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0]];
        assert_eq!(
            cut(&flat(&bow)),
            Cut {
                triangles: fan(4),
                crosses: true
            }
        );
        let line = [[0.0, 0.0], [1.0, 1.0], [3.0, 3.0], [2.0, 2.0]];
        assert_eq!(
            cut(&flat(&line)),
            Cut {
                triangles: fan(4),
                crosses: false
            }
        );
        assert_eq!(
            cut(&flat(&[[1.0, 1.0]; 5])),
            Cut {
                triangles: fan(5),
                crosses: false
            }
        );
        let knot = [[0.0, 0.0], [3.0, 3.0], [3.0, 0.0], [0.0, 1.0]];
        assert!(cut(&flat(&knot)).crosses);
    }

    /// A polygon around the origin: it does not cross itself, whatever its radii are.
    fn star_shaped(radii: &[f64]) -> Vec<DVec3> {
        let corner = |(i, r): (usize, &f64)| around(i as f64 / radii.len() as f64, *r);
        flat(&radii.iter().enumerate().map(corner).collect::<Vec<_>>())
    }

    proptest! {
        #[test]
        fn polygons_without_crossings_are_covered(
            radii in proptest::collection::vec(0.01f64..1.0, 4..200),
            turn in 0usize..200,
        ) {
            let mut corners = star_shaped(&radii);
            corners.rotate_left(turn % radii.len());
            covers(&corners);
        }

        #[test]
        fn any_corners_give_two_triangles_less(
            points in proptest::collection::vec(proptest::array::uniform3(-3i8..3), 3..60),
            exponent in -30i32..38,
        ) {
            let size = 10f64.powi(exponent);
            let corner = |p: &[i8; 3]| size * DVec3::from(p.map(f64::from));
            let corners: Vec<DVec3> = points.iter().map(corner).collect();
            let cut = cut(&corners);
            prop_assert_eq!(cut.triangles.len(), points.len() - 2);
            prop_assert!(cut.triangles.iter().flatten().all(|&i| i < points.len()));
        }
    }

    #[test]
    fn polygons_of_many_corners_take_no_time() {
        let count = 50_000;
        let mut random = Random(29);
        let mut unit = || random.bits() as f64 / u64::MAX as f64;
        let jagged: Vec<f64> = (0..count).map(|_| 0.1 + unit()).collect();
        let start = Instant::now();
        covers(&star_shaped(&jagged));
        let spikes: Vec<f64> = (0..count).map(|i| [0.2, 1.0][i % 2]).collect();
        covers(&star_shaped(&spikes));
        let scribble: Vec<[f64; 2]> = (0..count).map(|_| [unit(), unit()]).collect();
        assert!(cut(&flat(&scribble)).crosses);
        let time = start.elapsed();
        assert!(time < Duration::from_secs(10), "{time:?}");
    }
}
