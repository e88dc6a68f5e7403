//! The rays of the benchmark.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::RayOptions;
use crate::scene::{Mesh, Scene};
use crate::world::camera::CameraFrame;

/// How far rays start off a surface, relative to the largest coordinate of the point.
const OFFSET: f32 = 1.0 / (1 << 17) as f32;

/// A ray, whose `skip` is the triangle of the mesh that it starts on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    pub origin: Vec3,
    pub direction: Vec3,
    pub t_max: f32,
    pub skip: Option<u32>,
}

/// Where a ray hit which triangle of the mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfaceHit {
    pub t: f32,
    pub uv: [f32; 2],
    pub triangle: u32,
}

/// The kinds of rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SetKind {
    /// From the camera.
    Primary,
    /// Scattered where those hit.
    Diffuse,
    /// Scattered again.
    Diffuse2,
    /// From where the last ones hit to where others did.
    Shadow,
}

/// Rays, and what the default technique says they hit.
#[derive(Debug)]
pub(super) struct RaySet {
    pub kind: SetKind,
    pub rays: Vec<Ray>,
    pub hits: Vec<Option<SurfaceHit>>,
}

impl SetKind {
    pub(super) const ALL: [SetKind; 4] = [
        SetKind::Primary,
        SetKind::Diffuse,
        SetKind::Diffuse2,
        SetKind::Shadow,
    ];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            SetKind::Primary => "primary",
            SetKind::Diffuse => "diffuse",
            SetKind::Diffuse2 => "diffuse2",
            SetKind::Shadow => "shadow",
        }
    }

    pub(super) fn any_hit(self) -> bool {
        self == SetKind::Shadow
    }
}

/// The rays of a kind, given the sets before it.
pub(super) fn make(
    kind: SetKind,
    scene: &Scene,
    options: &RayOptions,
    sets: &[RaySet],
) -> Vec<Ray> {
    let mut random = Random(u64::from(options.seed) << 8 | kind as u64);
    let Some(last) = sets.last() else {
        return primary(scene, options.size);
    };
    let points = points(&scene.mesh, last);
    let scatter = |point: &Point| {
        let direction = point.scatter(random.uniform(), random.uniform());
        point.ray(direction, 3e38)
    };
    match kind {
        SetKind::Primary => Vec::new(),
        SetKind::Diffuse | SetKind::Diffuse2 => points.iter().map(scatter).collect(),
        SetKind::Shadow => shadows(&points, &mut random),
    }
}

/// Whether two hits of a ray are not the same.
pub(super) fn differ(a: &Option<SurfaceHit>, b: &Option<SurfaceHit>, kind: SetKind) -> bool {
    match (a, b) {
        // Of several that block a ray, any may be found.
        (Some(_), Some(_)) if kind.any_hit() => false,
        (Some(a), Some(b)) => (a.t - b.t).abs() > 1e-4 * a.t.abs(),
        (None, None) => false,
        _ => true,
    }
}

fn primary(scene: &Scene, (width, height): (u32, u32)) -> Vec<Ray> {
    let frame = CameraFrame::new(&scene.camera, width as f32 / height as f32);
    let ray = |(x, y): (u32, u32)| {
        let across = (x as f32 + 0.5) / width as f32 * 2.0 - 1.0;
        let up = 1.0 - (y as f32 + 0.5) / height as f32 * 2.0;
        let direction = frame.forward + across * frame.right + up * frame.up;
        Ray {
            origin: frame.position,
            direction: direction.normalize(),
            t_max: 3e38,
            skip: None,
        }
    };
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    pixels.map(ray).collect()
}

/// A point of a surface, on the side that a ray came from.
struct Point {
    position: Vec3,
    normal: Vec3,
    triangle: u32,
}

fn points(mesh: &Mesh, set: &RaySet) -> Vec<Point> {
    let point = |(ray, hit): (&Ray, &Option<SurfaceHit>)| {
        let hit = (*hit)?;
        let [a, b, c] = *mesh.positions.get(hit.triangle as usize)?;
        let [u, v] = hit.uv;
        let normal = (b - a).cross(c - a).try_normalize()?;
        let normal = if normal.dot(ray.direction) > 0.0 {
            -normal
        } else {
            normal
        };
        let position = a + u * (b - a) + v * (c - a);
        Some(Point {
            position: position + OFFSET * position.abs().max_element() * normal,
            normal,
            triangle: hit.triangle,
        })
    };
    set.rays.iter().zip(&set.hits).filter_map(point).collect()
}

/// From each point to another one, a little short of it.
fn shadows(points: &[Point], random: &mut Random) -> Vec<Ray> {
    let ray = |from: &Point| {
        let to = points.get(random.below(points.len()))?;
        let way = to.position - from.position;
        let direction = way.try_normalize()?;
        Some(from.ray(direction, 0.999 * way.length()))
    };
    points.iter().filter_map(ray).collect()
}

impl Point {
    fn ray(&self, direction: Vec3, t_max: f32) -> Ray {
        Ray {
            origin: self.position,
            direction,
            t_max,
            skip: Some(self.triangle),
        }
    }

    /// A direction with a density proportional to its cosine (Malley's method).
    fn scatter(&self, u: f32, v: f32) -> Vec3 {
        let (x, y) = self.normal.any_orthonormal_pair();
        let (sin, cos) = (std::f32::consts::TAU * v).sin_cos();
        let radius = u.sqrt();
        let up = (1.0 - u).max(0.0).sqrt();
        (radius * cos * x + radius * sin * y + up * self.normal).normalize()
    }
}

/// A small generator: SplitMix64, Steele, Lea and Flood 2014.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    fn uniform(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1 << 24) as f32
    }

    fn below(&mut self, count: usize) -> usize {
        (self.bits() % count.max(1) as u64) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_scattered_by_their_cosine() {
        let mut random = Random(1);
        let point = Point {
            position: Vec3::ZERO,
            normal: Vec3::new(0.6, 0.0, -0.8),
            triangle: 0,
        };
        let cosines = (0..10_000).map(|_| {
            let direction = point.scatter(random.uniform(), random.uniform());
            assert!((direction.length() - 1.0).abs() < 1e-5);
            direction.dot(point.normal)
        });
        let cosines: Vec<f32> = cosines.collect();
        assert!(cosines.iter().all(|c| *c > -1e-5));
        // The mean is 2/3, with a standard error of 0.0024.
        let mean = cosines.iter().sum::<f32>() / cosines.len() as f32;
        assert!((mean - 2.0 / 3.0).abs() < 0.01, "{mean}");
    }

    #[test]
    fn hits_differ_by_distance_and_shadows_by_whether_there_is_one() {
        let hit = |t| {
            Some(SurfaceHit {
                t,
                uv: [0.0; 2],
                triangle: 0,
            })
        };
        for kind in SetKind::ALL {
            assert!(differ(&hit(1.0), &None, kind) && differ(&None, &hit(1.0), kind));
            assert!(!differ(&None, &None, kind) && !differ(&hit(1.0), &hit(1.00001), kind));
        }
        assert!(differ(&hit(1.0), &hit(1.01), SetKind::Diffuse));
        assert!(!differ(&hit(1.0), &hit(1.01), SetKind::Shadow));
    }
}
