//! Which material each pixel of a picture sees first, found on the host; and what lies at one of them.
//!
//! Rays go where the camera's do, from the centre of its lens, through four places of a pixel; the material
//! that most of them meet is the pixel's. Placed objects are not copied: a ray is taken to where they are.

use std::ops::Deref;

use glam::{DVec3, Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::ray::{INVALID_ID, Ray, RayHit};
use obvhs::triangle::Triangle;
use rayon::prelude::*;

use crate::scene::{Camera, Mesh, NO_MATERIAL, Placement, Scene, Transform};
use crate::world::bvh;
use crate::world::camera::CameraFrame;

/// Where rays go through a pixel, in parts of its sides.
const PLACES: [(f32, f32); 4] = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)];

/// What lies at a pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    /// The index into [`Scene::materials`]; `None` for a light.
    pub material: Option<u32>,
    /// The object's name.
    pub object: String,
    /// The point, in the scene's coordinates.
    pub position: Vec3,
    /// Its distance along the camera's view, in metres.
    pub depth: f32,
    /// The least and greatest corner of the object, in the scene's coordinates.
    pub bounds: [Vec3; 2],
}

/// The least and greatest corner of the object that a ray met.
fn bounds(scene: &Scene, met: &Met) -> [Vec3; 2] {
    let placement = met.placement.and_then(|index| scene.placements.get(index));
    let mesh = match placement {
        None => &scene.mesh,
        Some(placement) => match scene.objects.get(placement.object as usize) {
            Some(object) => &object.mesh,
            None => return [Vec3::ZERO; 2],
        },
    };
    let corners = mesh.positions.iter().enumerate();
    let of_it = corners.filter(|(i, _)| mesh.objects.get(*i).copied().unwrap_or(0) == met.part);
    let placed = of_it
        .flat_map(|(_, corners)| corners)
        .map(|corner| placement.map_or(*corner, |placement| placement.transform.point(*corner)));
    placed.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], p| {
        [low.min(p), high.max(p)]
    })
}

/// The value that occurs most often, the first of several.
fn most_frequent(found: [Option<u32>; 4]) -> Option<u32> {
    let count = |value: &Option<u32>| found.iter().filter(|f| *f == value).count();
    let mut best = found[0];
    for value in found {
        if count(&value) > count(&best) {
            best = value;
        }
    }
    best
}

/// What can be asked of a scene, in a picture of its size from any camera. To make it takes trees over all geometry; the
/// scene is held by reference or shared.
pub struct FirstHits<S> {
    scene: S,
    /// Over the triangles of the scene's own mesh, and of each object's.
    world: Bvh2,
    objects: Vec<Bvh2>,
    /// Over the placements.
    upper: Bvh2,
    /// From the world to each placement's object.
    inverses: Vec<Inverse>,
    /// The first name of each placement.
    firsts: Vec<u32>,
}

/// What a ray meets first.
struct Met {
    /// How far along the ray.
    t: f32,
    /// The index into [`Scene::materials`], or [`NO_MATERIAL`].
    material: u32,
    /// The index among the names of objects.
    object: u32,
    /// Which object of its mesh that is.
    part: u32,
    /// The placement, if it is one.
    placement: Option<usize>,
}

/// A hit: how far along the ray, and the index of the triangle in its mesh.
struct Hit {
    t: f32,
    triangle: u32,
}

/// The way back from where an object is placed.
struct Inverse {
    matrix: glam::DMat3,
    translation: DVec3,
}

impl<S: Deref<Target = Scene> + Sync> FirstHits<S> {
    /// Prepares a scene.
    pub fn new(scene: S) -> Self {
        let objects = scene.objects.par_iter();
        let objects = objects.map(|object| tree(&object.mesh)).collect();
        let boxes: Vec<Aabb> = scene
            .placements
            .iter()
            .map(|p| placed_box(&scene, p))
            .collect();
        let inverse = |p: &Placement| Inverse {
            matrix: p.transform.matrix.inverse(),
            translation: p.transform.translation,
        };
        Self {
            world: tree(&scene.mesh),
            objects,
            upper: bvh::binary_tree(&boxes),
            inverses: scene.placements.iter().map(inverse).collect(),
            firsts: scene.first_objects(),
            scene,
        }
    }

    /// For each pixel, row by row, the index into [`Scene::materials`] of what it sees first; `None` where that is a
    /// light, or what surrounds everything.
    pub fn materials(&self, camera: &Camera) -> Vec<Option<u32>> {
        let (width, height) = self.size();
        let frame = CameraFrame::new(camera, width as f32 / height as f32);
        let seen = |pixel: u32| {
            let found = PLACES.map(|(x, y)| {
                let place = [(pixel % width) as f32 + x, (pixel / width) as f32 + y];
                self.material(frame.position, self.toward(&frame, place))
            });
            most_frequent(found)
        };
        (0..width * height).into_par_iter().map(seen).collect()
    }

    /// What the middle of a pixel shows; `None` where that is what surrounds everything, or no pixel.
    pub fn at(&self, camera: &Camera, [column, row]: [u32; 2]) -> Option<Seen> {
        let (width, height) = self.size();
        if column >= width || row >= height {
            return None;
        }
        let frame = CameraFrame::new(camera, width as f32 / height as f32);
        let place = [column as f32 + 0.5, row as f32 + 0.5];
        let direction = self.toward(&frame, place).normalize_or_zero();
        let met = self.meets(frame.position, direction)?;
        let names = self.scene.object_names();
        Some(Seen {
            material: Some(met.material).filter(|m| *m != NO_MATERIAL),
            object: names.get(met.object as usize).cloned().unwrap_or_default(),
            position: frame.position + met.t * direction,
            depth: met.t * direction.dot(frame.forward),
            bounds: bounds(&self.scene, &met),
        })
    }

    /// The way from the camera through a place of the picture, in columns and rows; of any length.
    fn toward(&self, frame: &CameraFrame, [column, row]: [f32; 2]) -> Vec3 {
        let (width, height) = self.size();
        let across = 2.0 * column / width as f32 - 1.0;
        let up = 1.0 - 2.0 * row / height as f32;
        frame.forward + across * frame.right + up * frame.up
    }

    /// Columns and rows.
    fn size(&self) -> (u32, u32) {
        (self.scene.film.width, self.scene.film.height)
    }

    /// The material that a ray meets first.
    fn material(&self, origin: Vec3, direction: Vec3) -> Option<u32> {
        let met = self.meets(origin, direction.normalize_or_zero())?;
        Some(met.material).filter(|m| *m != NO_MATERIAL)
    }

    /// What a ray of a unit direction meets first.
    fn meets(&self, origin: Vec3, direction: Vec3) -> Option<Met> {
        let mut ray = Ray::new_inf(origin.into(), direction.into());
        let mut first = None;
        let mesh = &self.scene.mesh;
        if let Some(hit) = closest(mesh, &self.world, &ray) {
            ray.tmax = hit.t;
            let part = mesh.objects.get(hit.triangle as usize).copied();
            first = Some(Met {
                t: hit.t,
                material: *mesh.materials.get(hit.triangle as usize)?,
                object: part.unwrap_or(0),
                part: part.unwrap_or(0),
                placement: None,
            });
        }
        let meet = |ray: &Ray, place: usize| {
            let index = self.upper.primitive_indices[place] as usize;
            let Some(met) = self.meet(ray, index) else {
                return f32::INFINITY;
            };
            let t = met.t;
            if t < ray.tmax {
                first = Some(met);
            }
            t
        };
        self.upper.ray_traverse(ray, &mut RayHit::none(), meet);
        first
    }

    /// Where a ray meets a placement, and what.
    fn meet(&self, ray: &Ray, index: usize) -> Option<Met> {
        let placement = &self.scene.placements[index];
        let tree = self.objects.get(placement.object as usize)?;
        let mesh = &self.scene.objects.get(placement.object as usize)?.mesh;
        let inverse = &self.inverses[index];
        let origin = Vec3::from(ray.origin).as_dvec3() - inverse.translation;
        let direction = inverse.matrix * Vec3::from(ray.direction).as_dvec3();
        // Boxes are met by unit directions.
        let scale = direction.length();
        let local = Ray::new(
            Vec3A::from((inverse.matrix * origin).as_vec3()),
            Vec3A::from((direction / scale).as_vec3()),
            0.0,
            (f64::from(ray.tmax) * scale) as f32,
        );
        let hit = closest(mesh, tree, &local)?;
        let own = *mesh.materials.get(hit.triangle as usize)?;
        let part = mesh.objects.get(hit.triangle as usize).copied();
        Some(Met {
            t: (f64::from(hit.t) / scale) as f32,
            material: placement
                .materials
                .get(own as usize)
                .copied()
                .unwrap_or(NO_MATERIAL),
            object: self.firsts.get(index).copied().unwrap_or(0) + part.unwrap_or(0),
            part: part.unwrap_or(0),
            placement: Some(index),
        })
    }
}

/// A tree over the triangles of a mesh.
fn tree(mesh: &Mesh) -> Bvh2 {
    let boxes: Vec<Aabb> = mesh.positions.iter().map(bvh::bounds).collect();
    bvh::binary_tree(&boxes)
}

/// Which triangle of a mesh a ray meets first.
fn closest(mesh: &Mesh, tree: &Bvh2, ray: &Ray) -> Option<Hit> {
    let order = &tree.primitive_indices;
    let meet = |ray: &Ray, place: usize| {
        let [v0, v1, v2] = mesh.positions[order[place] as usize].map(Vec3A::from);
        Triangle { v0, v1, v2 }.intersect(ray)
    };
    let mut hit = RayHit::none();
    tree.ray_traverse(*ray, &mut hit, meet);
    let found = hit.primitive_id != INVALID_ID;
    found.then(|| Hit {
        t: hit.t,
        triangle: order[hit.primitive_id as usize],
    })
}

/// A box around an object where it is placed.
fn placed_box(scene: &Scene, placement: &Placement) -> Aabb {
    let object = scene.objects.get(placement.object as usize);
    let [low, high] = object.map_or([Vec3::ZERO; 2], |o| o.mesh.bounds());
    let corner = |i: u32| {
        let pick = |bit: u32, low: f32, high: f32| if i >> bit & 1 == 1 { high } else { low };
        let corner = Vec3::new(
            pick(0, low.x, high.x),
            pick(1, low.y, high.y),
            pick(2, low.z, high.z),
        );
        let transform: &Transform = &placement.transform;
        Vec3A::from(transform.point(corner))
    };
    let corners = (0..8).map(corner);
    let start = Aabb::new(Vec3A::INFINITY, Vec3A::NEG_INFINITY);
    corners.fold(start, |b, p| Aabb::new(b.min.min(p), b.max.max(p)))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::scene::{Camera, FilmSettings, Integrator, Object};

    /// A square of the plane z = `z`, from -1 to 1 in x and y but for what `right` leaves out.
    fn square(z: f32, left: f32, material: u32) -> Mesh {
        let corner = |x, y| Vec3::new(x, y, z);
        let [a, b, c, d] = [
            corner(left, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(left, 1.0),
        ];
        Mesh {
            positions: vec![[a, b, c], [a, c, d]],
            materials: vec![material; 2],
            lights: vec![None; 2],
            ..Mesh::default()
        }
    }

    /// An orthogonal view of -1..1 would be squares; the camera is far away with a narrow field.
    fn scene(mesh: Mesh) -> Scene {
        Scene {
            name: String::new(),
            base: Default::default(),
            origin: Default::default(),
            camera: Camera {
                position: Vec3::new(0.0, 0.0, 10.0),
                look_at: Vec3::ZERO,
                up: Vec3::Y,
                fov: 2.0 * 0.2f32.atan().to_degrees(),
                aperture: 0.0,
                focus: 1.0,
            },
            camera_media: Vec::new(),
            film: FilmSettings {
                width: 4,
                height: 4,
            },
            integrator: Integrator {
                max_depth: 1,
                roulette_start: 1,
            },
            mesh,
            objects: Vec::new(),
            placements: Vec::new(),
            places: Vec::new(),
            object_places: Vec::new(),
            materials: Vec::new(),
            lights: Vec::new(),
            environment: None,
            labels: Default::default(),
            warnings: Vec::new(),
        }
    }

    fn materials(scene: &Scene) -> Vec<Option<u32>> {
        FirstHits::new(scene).materials(&scene.camera)
    }

    /// The picture reaches from -2 to 2, so that a pixel is a unit wide.
    #[test]
    fn pixels_see_what_is_nearest() {
        let mut mesh = square(0.0, -1.0, 7);
        let near = square(1.0, 0.0, 9);
        mesh.positions.extend(near.positions);
        mesh.materials.extend(near.materials);
        let seen = materials(&scene(mesh));
        let none = None;
        let expected = [
            [none; 4],
            [none, Some(7), Some(9), none],
            [none, Some(7), Some(9), none],
            [none; 4],
        ];
        assert_eq!(seen, expected.concat());
    }

    #[test]
    fn lights_are_no_material() {
        let mut mesh = square(0.0, -1.0, 7);
        let light = square(1.0, 0.0, NO_MATERIAL);
        mesh.positions.extend(light.positions);
        mesh.materials.extend(light.materials);
        let seen = materials(&scene(mesh));
        assert_eq!(seen[4..8], [None, Some(7), None, None]);
    }

    /// An object that is placed before a wall, half as large as it was made, and behind it, twice as large.
    /// Distances are those of the world, not of the object.
    #[test]
    fn placements_are_seen_where_they_are() {
        let mut scene = scene(square(0.0, -1.0, 3));
        let mut mesh = square(0.0, 0.0, 1);
        mesh.positions.iter_mut().flatten().for_each(|p| *p *= 2.0);
        scene.objects = vec![Object {
            name: String::new(),
            mesh,
        }];
        let place = |scale: f32, z: f32, materials: [u32; 2]| Placement {
            object: 0,
            transform: Transform::new(Vec3::splat(scale), Vec3::ZERO, Vec3::new(0.0, 0.0, z)),
            materials: Arc::from(materials),
            place: 0,
        };
        scene.placements = vec![place(0.5, 0.5, [0, 5]), place(2.0, -0.5, [0, 6])];
        let seen = materials(&scene);
        let expected = [
            [None, None, Some(6), Some(6)],
            [None, Some(3), Some(5), Some(6)],
            [None, Some(3), Some(5), Some(6)],
            [None, None, Some(6), Some(6)],
        ];
        assert_eq!(seen, expected.concat());
    }

    /// Every corner of an object's box may be the outermost where the object is turned: a box that lacks
    /// one cuts off what lies there.
    #[test]
    fn the_box_of_a_turned_object_has_all_of_its_corners() {
        for i in 0..8u8 {
            // An object that fills its box at one corner, turned so that this corner looks to the right.
            let sign = |bit: u8| if i >> bit & 1 == 1 { 1.0f32 } else { -1.0 };
            let tip = Vec3::new(sign(0), sign(1), sign(2));
            let turn = glam::DQuat::from_rotation_arc(
                tip.as_dvec3().normalize(),
                DVec3::new(1.0, 0.0, 0.0),
            );
            let mut scene = scene(Mesh::default());
            scene.objects = vec![Object {
                name: String::new(),
                mesh: Mesh {
                    positions: vec![[tip, -tip, -tip]],
                    materials: vec![0],
                    lights: vec![None],
                    ..Mesh::default()
                },
            }];
            let mut transform = Transform::new(Vec3::ONE, Vec3::ZERO, Vec3::ZERO);
            transform.matrix = glam::DMat3::from_quat(turn);
            scene.placements = vec![Placement {
                object: 0,
                transform,
                materials: Arc::from([0]),
                place: 0,
            }];
            let found = placed_box(&scene, &scene.placements[0]);
            let reach = 3f32.sqrt();
            assert!((found.max.x - reach).abs() < 1e-5, "{tip}: {}", found.max);
            // The opposite corner looks to the left.
            assert!((found.min.x + reach).abs() < 1e-5, "{tip}: {}", found.min);
        }
    }

    #[test]
    fn the_majority_of_a_pixel_counts_and_the_first_of_equals() {
        assert_eq!(most_frequent([Some(1), Some(2), Some(2), None]), Some(2));
        assert_eq!(most_frequent([Some(1), None, None, Some(1)]), Some(1));
        assert_eq!(most_frequent([None, Some(1), Some(1), None]), None);
    }
}
