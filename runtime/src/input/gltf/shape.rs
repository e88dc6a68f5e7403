//! How a mesh of a glTF file is bent: by morph targets, and by the joints of a skin. Rigid ones are where a matrix puts
//! them.

use glam::{DMat3, DMat4, DVec3, Vec3};
use gltf::{Mesh, Primitive, Semantic};

use super::Buffers;

/// The shape of a mesh in the world.
pub(crate) struct Shape {
    /// From the mesh to the world, where no skin says so.
    transform: DMat4,
    /// How much of each morph target there is.
    pub(super) weights: Vec<f64>,
    /// From the mesh to the world by joint, if there is a skin.
    pub(super) joints: Option<Vec<DMat4>>,
}

/// The corners of a primitive in the world.
pub(crate) struct Corners {
    pub(crate) places: Vec<DVec3>,
    /// Of any length; 0 where there is no direction.
    pub(crate) normals: Option<Vec<Vec3>>,
    /// By the corner, is what is there a mirror image? One for all, if they agree.
    mirrored: Vec<bool>,
}

impl Corners {
    pub(crate) fn is_mirrored(&self, corner: u32) -> bool {
        let all = self.mirrored.first().copied().unwrap_or(false);
        self.mirrored.get(corner as usize).copied().unwrap_or(all)
    }
}

impl Shape {
    /// A mesh as it is, where a matrix puts it.
    pub(crate) fn of_mesh(mesh: &Mesh<'_>, transform: &DMat4) -> Self {
        let weights = mesh.weights().unwrap_or_default();
        Self {
            transform: *transform,
            weights: weights.iter().copied().map(f64::from).collect(),
            joints: None,
        }
    }

    /// The corners of a primitive.
    ///
    /// # Errors
    /// What is wrong with them, in words.
    pub(crate) fn corners<'m>(
        &self,
        primitive: &Primitive<'m>,
        buffers: &Buffers<'m>,
    ) -> Result<Corners, String> {
        let positions = primitive.get(&Semantic::Positions);
        let positions = positions.ok_or("a primitive has no positions")?;
        let mut places = vectors(buffers.floats::<3>(&positions)?);
        let normals = primitive.get(&Semantic::Normals);
        let normals = normals.map(|a| buffers.floats::<3>(&a)).transpose()?;
        let mut normals = normals.map(vectors);
        self.morph(primitive, buffers, &mut places, normals.as_mut())?;
        if let Some(odd) = places.iter().position(|p| !p.is_finite()) {
            return Err(format!(
                "corner {odd} is at no place: a coordinate is no number"
            ));
        }
        let mirrored = match &self.joints {
            None => {
                let turn = Turn::of(&self.transform);
                let at = |p: &mut DVec3| *p = self.transform.transform_point3(*p);
                places.iter_mut().for_each(at);
                let normals = normals.iter_mut().flatten();
                normals.for_each(|n| *n = turn.normal(*n));
                vec![turn.is_mirrored]
            }
            Some(joints) => {
                let matrices = blended(joints, primitive, buffers, places.len())?;
                let mut mirrored = Vec::with_capacity(matrices.len());
                for (corner, matrix) in matrices.iter().enumerate() {
                    let turn = Turn::of(matrix);
                    places[corner] = matrix.transform_point3(places[corner]);
                    let normal = normals.as_mut().and_then(|n| n.get_mut(corner));
                    if let Some(normal) = normal {
                        *normal = turn.normal(*normal);
                    }
                    mirrored.push(turn.is_mirrored);
                }
                mirrored
            }
        };
        let single = |normals: Vec<DVec3>| normals.into_iter().map(|n| n.as_vec3()).collect();
        Ok(Corners {
            places,
            normals: normals.map(single),
            mirrored,
        })
    }

    /// Adds what each morph target moves.
    fn morph<'m>(
        &self,
        primitive: &Primitive<'m>,
        buffers: &Buffers<'m>,
        places: &mut [DVec3],
        mut normals: Option<&mut Vec<DVec3>>,
    ) -> Result<(), String> {
        let targets = primitive.morph_targets().enumerate();
        for ((number, target), weight) in targets.zip(&self.weights) {
            if *weight == 0.0 {
                continue;
            }
            let add = |to: &mut [DVec3], accessor| -> Result<(), String> {
                let moved = buffers.floats::<3>(&accessor)?;
                let (has, count) = (moved.len(), to.len());
                if has != count {
                    return Err(format!(
                        "morph target {number} has {has} corners, and the primitive {count}"
                    ));
                }
                let pairs = to.iter_mut().zip(vectors(moved));
                pairs.for_each(|(to, by)| *to += *weight * by);
                Ok(())
            };
            if let Some(accessor) = target.positions() {
                add(places, accessor)?;
            }
            if let (Some(normals), Some(accessor)) = (normals.as_deref_mut(), target.normals()) {
                add(normals, accessor)?;
            }
        }
        Ok(())
    }
}

fn vectors(numbers: Vec<[f32; 3]>) -> Vec<DVec3> {
    let vector = |n: [f32; 3]| Vec3::from(n).as_dvec3();
    numbers.into_iter().map(vector).collect()
}

/// What a matrix does to normals.
struct Turn {
    /// Its cofactors, which a matrix has that flattens, and which turn normals as its inverse would.
    cofactors: DMat3,
    is_mirrored: bool,
}

impl Turn {
    fn of(matrix: &DMat4) -> Self {
        let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|c| c.truncate());
        Self {
            cofactors: DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)),
            is_mirrored: x.dot(y.cross(z)) < 0.0,
        }
    }

    /// A normal, turned to the same side.
    fn normal(&self, normal: DVec3) -> DVec3 {
        let turned = (self.cofactors * normal).normalize_or_zero();
        if self.is_mirrored { -turned } else { turned }
    }
}

/// For each corner, the matrices of its joints by their weights.
fn blended<'m>(
    joints: &[DMat4],
    primitive: &Primitive<'m>,
    buffers: &Buffers<'m>,
    count: usize,
) -> Result<Vec<DMat4>, String> {
    let mut matrices = vec![DMat4::ZERO; count];
    let mut sums = vec![0.0f64; count];
    for set in 0.. {
        let of = |semantic| primitive.get(&semantic);
        let (Some(numbers), Some(weights)) =
            (of(Semantic::Joints(set)), of(Semantic::Weights(set)))
        else {
            break;
        };
        let numbers = buffers.whole::<4>(&numbers)?;
        let weights = buffers.floats::<4>(&weights)?;
        if numbers.len() < count || weights.len() < count {
            return Err(format!("joints or weights {set} are fewer than corners"));
        }
        for corner in 0..count {
            for (joint, weight) in numbers[corner].into_iter().zip(weights[corner]) {
                let weight = f64::from(weight);
                if !(weight.is_finite() && weight >= 0.0) {
                    return Err(format!("corner {corner} has a weight that is no share"));
                }
                let matrix = joints.get(joint as usize).ok_or_else(|| {
                    let most = joints.len();
                    format!("corner {corner} has joint {joint} of {most}")
                });
                if weight > 0.0 {
                    matrices[corner] += weight * *matrix?;
                    sums[corner] += weight;
                }
            }
        }
    }
    let first = joints.first().copied().unwrap_or(DMat4::IDENTITY);
    // Weights are shares of one. Those that are not are made so, and what has none follows the first joint.
    let shares = matrices.into_iter().zip(sums);
    Ok(shares
        .map(|(matrix, sum)| {
            if sum > 0.0 {
                matrix * (1.0 / sum)
            } else {
                first
            }
        })
        .collect())
}
