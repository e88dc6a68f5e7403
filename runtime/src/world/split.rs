//! What of a scene is rendered in the world and what as placed objects.
//!
//! The loader has shared what is worth sharing. Here the triangles of objects that are light
//! sources leave them again: each is a row of the light table, at its own place in the world.

use std::borrow::Cow;
use std::collections::BTreeSet;

use glam::{DMat3, DVec3, Vec3};
use impasto_compiler::abi::{Emission, InstanceInfo};

use crate::error::SceneError;
use crate::scene::{MAX_TRIANGLES, Mesh, NO_MATERIAL, Object, Placement, Scene};
use crate::technique::Copies;

/// The geometry of a scene as it is rendered.
#[derive(Clone, Debug)]
pub struct Split<'s> {
    /// Triangles in the world.
    pub world: Cow<'s, Mesh>,
    /// Objects that are placed somewhere.
    pub objects: Vec<Cow<'s, Mesh>>,
    /// Where; `object` is an index into [`Split::objects`].
    pub placements: Vec<Placement>,
    /// The first name of each of them among those of [`Scene`]'s objects.
    pub first_objects: Vec<u32>,
    /// The box around everything: least and greatest coordinates.
    pub bounds: [Vec3; 2],
}

/// How many triangles a scene has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GeometryCounts {
    /// Triangles that are stored.
    pub triangles: u64,
    /// References of acceleration structures to them: more than triangles where large ones are in several leaves.
    pub references: u64,
    /// Triangles that rays can hit: those of an object count once for each of its placements.
    pub placed_triangles: u64,
    /// Objects that are stored once and placed any number of times.
    pub objects: u64,
    /// Placements of objects.
    pub placements: u64,
}

impl<'s> Split<'s> {
    /// Divides `scene`, whose bindings compiled to `instances`.
    ///
    /// # Errors
    /// So much has to be copied that no buffer holds it.
    pub fn new(
        scene: &'s Scene,
        instances: &[InstanceInfo],
        copies: Copies,
    ) -> Result<Split<'s>, SceneError> {
        let lit = lit_slots(scene, instances);
        let flat = |object: usize, slot: u32| {
            copies == Copies::Flat || lit[object].get(slot as usize) == Some(&true)
        };
        check_copies(scene, &flat)?;
        let is_whole = |object: usize| {
            let mesh = &scene.objects[object].mesh;
            !mesh.materials.iter().any(|&slot| flat(object, slot))
        };
        let mut split = Split {
            world: Cow::Borrowed(&scene.mesh),
            objects: Vec::new(),
            placements: Vec::new(),
            first_objects: Vec::new(),
            bounds: [Vec3::ZERO; 2],
        };
        let first_objects = scene.first_objects();
        for (index, object) in scene.objects.iter().enumerate() {
            let mesh = &object.mesh;
            let placed = scene.placements.iter().zip(first_objects.iter().copied());
            let placed = placed.filter(|(p, _)| p.object == index as u32);
            if is_whole(index) {
                split.push(Cow::Borrowed(mesh), placed);
                continue;
            }
            let world = split.world.to_mut();
            world.spell_out();
            for (placement, first) in placed.clone() {
                let emits = |t: usize| flat(index, mesh.materials[t]);
                let Placement {
                    transform,
                    materials,
                    ..
                } = placement;
                world.push_copy(mesh, emits, transform, materials, first);
            }
            split.push(
                Cow::Owned(mesh.filtered(|t| !flat(index, mesh.materials[t]))),
                placed,
            );
        }
        if let Cow::Owned(world) = &mut split.world {
            world.simplify();
        }
        split.bounds = split.find_bounds();
        Ok(split)
    }

    fn push<'a>(
        &mut self,
        mesh: Cow<'s, Mesh>,
        placed: impl Iterator<Item = (&'a Placement, u32)>,
    ) {
        let object = self.objects.len() as u32;
        let before = self.placements.len();
        if !mesh.is_empty() {
            for (placement, first) in placed {
                self.placements.push(Placement {
                    object,
                    ..placement.clone()
                });
                self.first_objects.push(first);
            }
        }
        if self.placements.len() > before {
            self.objects.push(mesh);
        }
    }

    /// How much there is of all that.
    pub fn counts(&self) -> GeometryCounts {
        let of_objects = self.objects.iter().map(|o| o.len() as u64);
        let placed = self.placements.iter();
        let placed = placed.map(|p| self.objects[p.object as usize].len() as u64);
        let world = self.world.len() as u64;
        let triangles = world + of_objects.sum::<u64>();
        GeometryCounts {
            triangles,
            references: triangles,
            placed_triangles: world + placed.sum::<u64>(),
            objects: self.objects.len() as u64,
            placements: self.placements.len() as u64,
        }
    }

    fn find_bounds(&self) -> [Vec3; 2] {
        let boxes: Vec<[Vec3; 2]> = self.objects.iter().map(|o| o.bounds()).collect();
        let placed = self.placements.iter();
        let placed = placed.filter_map(|p| Some(placed_bounds(boxes.get(p.object as usize)?, p)));
        let world = (!self.world.is_empty()).then(|| self.world.bounds());
        let all = world.into_iter().chain(placed);
        let union = |[a, b]: [Vec3; 2], [c, d]: [Vec3; 2]| [a.min(c), b.max(d)];
        all.reduce(union).unwrap_or_default()
    }
}

impl Scene {
    /// The scene with every object copied to where it is placed.
    ///
    /// # Errors
    /// No buffer holds that much.
    pub fn flattened(&self) -> Result<Cow<'_, Scene>, SceneError> {
        if self.placements.is_empty() {
            return Ok(Cow::Borrowed(self));
        }
        let split = Split::new(self, &[], Copies::Flat)?;
        Ok(Cow::Owned(Scene {
            mesh: split.world.into_owned(),
            objects: Vec::new(),
            placements: Vec::new(),
            ..self.clone()
        }))
    }

    /// The triangles of the world, and copies of some placements, evenly chosen: about `limit`
    /// triangles of them, but a copy at least of each object with each list of materials.
    pub fn sampled(&self, limit: usize) -> Cow<'_, Mesh> {
        let size = |p: &Placement| self.objects[p.object as usize].mesh.len();
        let total: usize = self.placements.iter().map(size).sum();
        let mut mesh = Cow::Borrowed(&self.mesh);
        let mut seen = BTreeSet::new();
        let (mut passed, mut taken) = (0, 0);
        for (placement, first) in self.placements.iter().zip(self.first_objects()) {
            passed += size(placement);
            let is_new = seen.insert((placement.object, &placement.materials));
            let due = passed as f64 * (limit as f64 / total as f64).min(1.0);
            if is_new || taken as f64 + 0.5 * size(placement) as f64 <= due {
                taken += size(placement);
                let mesh = mesh.to_mut();
                mesh.spell_out();
                let Placement {
                    object,
                    transform,
                    materials,
                    ..
                } = placement;
                let object = &self.objects[*object as usize].mesh;
                mesh.push_copy(object, |_| true, transform, materials, first);
            }
        }
        if let Cow::Owned(mesh) = &mut mesh {
            mesh.simplify();
        }
        mesh
    }
}

/// Fails if the triangles of objects that are to be copied are too many.
fn check_copies(scene: &Scene, flat: &impl Fn(usize, u32) -> bool) -> Result<(), SceneError> {
    let copied = |(index, object): (usize, &Object)| {
        let slots = object.mesh.materials.iter();
        slots.filter(|slot| flat(index, **slot)).count() as u64
    };
    let of_objects: Vec<u64> = scene.objects.iter().enumerate().map(copied).collect();
    let placed = scene.placements.iter();
    let total: u64 = placed.map(|p| of_objects[p.object as usize]).sum();
    if total + scene.mesh.len() as u64 <= MAX_TRIANGLES as u64 {
        return Ok(());
    }
    let message = format!("copying its objects would make the scene {total} triangles larger");
    Err(SceneError::new(message).hint(format!(
        "at most {MAX_TRIANGLES} can be stored; objects are copied with `--copies flat`, and where \
         they are lights"
    )))
}

/// For each material of each object whether it is a light source in some placement.
fn lit_slots(scene: &Scene, instances: &[InstanceInfo]) -> Vec<Vec<bool>> {
    let is_lit = |material: u32| {
        let instance = instances.get(material as usize);
        instance.is_some_and(|i| matches!(i.emission, Emission::Uniform(_)))
    };
    let mut lit: Vec<Vec<bool>> = vec![Vec::new(); scene.objects.len()];
    for placement in &scene.placements {
        let slots = &mut lit[placement.object as usize];
        slots.resize(placement.materials.len().max(slots.len()), false);
        for (slot, &material) in slots.iter_mut().zip(placement.materials.iter()) {
            *slot |= material != NO_MATERIAL && is_lit(material);
        }
    }
    lit
}

/// A box around a placed box, in world space.
fn placed_bounds([low, high]: &[Vec3; 2], placement: &Placement) -> [Vec3; 2] {
    let (low, high) = (low.as_dvec3(), high.as_dvec3());
    let (center, half) = (0.5 * (low + high), 0.5 * (high - low));
    let center = placement.transform.matrix * center + placement.transform.translation;
    let half: DVec3 = DMat3::abs(&placement.transform.matrix) * half;
    [(center - half).as_vec3(), (center + half).as_vec3()]
}
