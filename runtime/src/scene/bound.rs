//! What a scene binds, as the compiler is asked for it, and what its triangles bind of that: paths can hit no other.

use impasto_compiler::abi::InstanceInfo;
use impasto_compiler::{MaterialRequest, Parameters};

use super::{Mesh, NO_MATERIAL, Scene};

impl Scene {
    /// The materials that it binds, as the compiler is asked for them.
    pub fn requests(&self) -> Vec<MaterialRequest> {
        let bindings = self.materials.iter().cloned();
        bindings
            .map(|binding| MaterialRequest {
                apart: false,
                moment: None,
                name: binding.name,
                file: binding.file,
                material: binding.material,
                params: binding.params,
                written: binding.written,
                parameters: match (binding.bake, binding.has_keys) {
                    (_, true) => Parameters::Table,
                    (true, false) => Parameters::Baked,
                    (false, false) => Parameters::Agreed,
                },
            })
            .collect()
    }

    /// The indices, ascending, of those of `materials` materials that no triangle binds, when the
    /// scene's bindings compiled to `instances` of them. Such a material needs no kernel: it fills
    /// what the camera is in, or nothing at all.
    pub fn unbound(&self, materials: usize, instances: &[InstanceInfo]) -> Vec<usize> {
        let bindings = self.bindings_in_use(instances.len());
        let bound = instances.iter().zip(bindings).filter(|(_, used)| *used);
        let mut free = vec![true; materials];
        for (instance, _) in bound {
            if let Some(free) = free.get_mut(instance.material) {
                *free = false;
            }
        }
        (0..materials).filter(|m| free[*m]).collect()
    }

    /// Whether some triangle binds each of the first `count` materials of the scene.
    fn bindings_in_use(&self, count: usize) -> Vec<bool> {
        let mut used = vec![false; count];
        let mut mark = |binding: u32| {
            if let Some(used) = used.get_mut(binding as usize) {
                *used = true;
            }
        };
        in_mesh(&self.mesh).into_iter().for_each(&mut mark);
        let objects: Vec<Vec<u32>> = self.objects.iter().map(|o| in_mesh(&o.mesh)).collect();
        for placement in &self.placements {
            let own = objects.get(placement.object as usize);
            let own = own.into_iter().flatten();
            own.filter_map(|material| placement.materials.get(*material as usize))
                .for_each(|binding| mark(*binding));
        }
        used
    }
}

/// The materials of a mesh's triangles, each once.
fn in_mesh(mesh: &Mesh) -> Vec<u32> {
    let mut found = mesh.materials.clone();
    found.dedup();
    found.sort_unstable();
    found.dedup();
    found.retain(|material| *material != NO_MATERIAL);
    found
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use impasto_compiler::abi::Emission;

    use super::*;
    use crate::scene::{Camera, FilmSettings, Integrator, Object, Placement, Transform};

    fn mesh(materials: &[u32]) -> Mesh {
        Mesh {
            materials: materials.to_vec(),
            ..Mesh::default()
        }
    }

    /// Bindings 0 to 5; 0 and 1 on triangles, an object with two materials of which a placement binds
    /// the second to 3, and 4 only where the object has no triangle.
    fn scene() -> Scene {
        let place = |materials: &[u32]| Placement {
            object: 0,
            transform: Transform::default(),
            materials: Arc::from(materials),
            place: 0,
        };
        Scene {
            name: String::new(),
            base: Default::default(),
            origin: glam::DVec3::ZERO,
            camera: Camera {
                position: glam::Vec3::ZERO,
                look_at: glam::Vec3::X,
                up: glam::Vec3::Y,
                fov: 60.0,
                aperture: 0.0,
                focus: 1.0,
            },
            camera_media: vec![5],
            film: FilmSettings {
                width: 1,
                height: 1,
            },
            integrator: Integrator {
                max_depth: 1,
                roulette_start: 1,
            },
            mesh: mesh(&[1, 0, 0, NO_MATERIAL, 1]),
            objects: vec![Object {
                name: String::new(),
                mesh: mesh(&[1, 1]),
            }],
            placements: vec![place(&[4, 3]), place(&[4, 1])],
            places: Vec::new(),
            object_places: Vec::new(),
            materials: Vec::new(),
            lights: Vec::new(),
            environment: None,
            labels: Default::default(),
            warnings: Vec::new(),
        }
    }

    #[test]
    fn what_no_triangle_binds_is_unbound() {
        let instance = |material| InstanceInfo {
            name: String::new(),
            material,
            emission: Emission::None,
            medium: None,
        };
        let of = |materials: [usize; 6]| scene().unbound(6, &materials.map(instance));
        assert_eq!(of([0, 1, 2, 3, 4, 5]), [2, 4, 5]);
        // A material with several instances is bound if one of them is.
        assert_eq!(of([0, 1, 1, 3, 3, 5]), [2, 4, 5]);
        assert_eq!(of([2, 2, 0, 4, 4, 5]), [0, 1, 3, 5]);
    }
}
