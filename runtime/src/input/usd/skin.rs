//! Meshes that are bent: by blend shapes, and by the joints of a skeleton. Linear, as glTF has it.

use std::collections::HashMap;

use glam::{DMat3, DMat4, DQuat, DVec3, Vec3};
use openusd::sdf::{Path, Value};

use super::model::{By, Mesh, Primvar};
use super::values::{self, Reader};
use super::walk::{Above, Walk};

type Checked<T = ()> = Result<T, String>;

impl Walk<'_> {
    /// Bends a mesh as its skeleton is at the time.
    pub(super) fn bend(&mut self, path: &Path, here: &Above, mesh: &mut Mesh) -> Checked {
        let animation = match (&here.animation, &here.skeleton) {
            (Some(own), _) => Some(own.clone()),
            (None, Some(skeleton)) => self
                .reader
                .targets(skeleton, "skel:animationSource")?
                .into_iter()
                .next(),
            _ => None,
        };
        if let Some(animation) = &animation {
            self.shapes(path, animation, mesh)?;
        }
        let Some(skeleton) = &here.skeleton else {
            return Ok(());
        };
        let indices = self.reader.counts(path, "primvars:skel:jointIndices")?;
        let weights = self
            .reader
            .value(path, "primvars:skel:jointWeights")?
            .and_then(values::floats);
        let (Some(indices), Some(weights)) = (indices, weights) else {
            return Ok(());
        };
        let wrong = |what: String| format!("the skin of `{path}` cannot be read: {what}");
        if indices.len() != weights.len() || indices.is_empty() {
            return Err(wrong(format!(
                "it has {} joints and {} weights",
                indices.len(),
                weights.len()
            )));
        }
        let is_rigid = self
            .reader
            .field(path, "primvars:skel:jointIndices", "interpolation")
            .as_deref()
            == Some("constant");
        let each = if is_rigid {
            indices.len()
        } else {
            indices.len() / mesh.points.len().max(1)
        };
        if each == 0 || !is_rigid && each * mesh.points.len() != indices.len() {
            return Err(wrong(format!(
                "{} joints do not go around {} points",
                indices.len(),
                mesh.points.len()
            )));
        }
        let pose = self.pose(skeleton, animation.as_ref())?;
        let names = tokens(&self.reader, path, "skel:joints")?;
        let own = |index: u32| -> Option<DMat4> {
            let name = if names.is_empty() {
                return pose.list.get(index as usize).copied();
            } else {
                names.get(index as usize)?
            };
            pose.list.get(*pose.known.get(name)?).copied()
        };
        let bind = self.reader.value(path, "primvars:skel:geomBindTransform")?;
        let bind = bind
            .as_ref()
            .and_then(values::matrix)
            .unwrap_or(DMat4::IDENTITY);
        // The mesh is placed by its own prim, and bent where the skeleton is.
        let back = here.world.inverse() * self.world(skeleton)?;
        let matrix = |point: usize| -> Option<DMat4> {
            let start = if is_rigid { 0 } else { point * each };
            let joints = indices[start..start + each]
                .iter()
                .zip(&weights[start..start + each]);
            let (mut sum, mut all) = (DMat4::ZERO, 0.0);
            for (joint, weight) in joints {
                if *weight > 0.0 {
                    sum += own(*joint)? * f64::from(*weight);
                    all += f64::from(*weight);
                }
            }
            let bent = if all > 0.0 {
                sum * (1.0 / all)
            } else {
                DMat4::IDENTITY
            };
            Some(back * bent * bind)
        };
        let matrices: Option<Vec<DMat4>> = (0..mesh.points.len()).map(matrix).collect();
        let matrices =
            matrices.ok_or_else(|| wrong("it names a joint that the skeleton has not".into()))?;
        for (point, matrix) in mesh.points.iter_mut().zip(&matrices) {
            *point = matrix.transform_point3(point.as_dvec3()).as_vec3();
        }
        if mesh.points.iter().any(|p| !p.is_finite()) {
            return Err(wrong("a point is no number".into()));
        }
        turn_normals(mesh, &matrices);
        mesh.moves |= pose.moves;
        Ok(())
    }

    /// Moves points by blend shapes.
    fn shapes(&mut self, path: &Path, animation: &Path, mesh: &mut Mesh) -> Checked {
        let own = tokens(&self.reader, path, "skel:blendShapes")?;
        if own.is_empty() {
            return Ok(());
        }
        let reader = self.reader;
        let order = tokens(&reader, animation, "blendShapes")?;
        let weights = reader
            .value(animation, "blendShapeWeights")?
            .and_then(values::floats)
            .unwrap_or_default();
        mesh.moves |= reader.varies(animation, "blendShapeWeights");
        let targets = reader.targets(path, "skel:blendShapeTargets")?;
        let mut is_bent = false;
        for (name, target) in own.iter().zip(&targets) {
            let weight = order
                .iter()
                .position(|o| o == name)
                .and_then(|at| weights.get(at));
            let weight = weight.copied().unwrap_or_default();
            if weight == 0.0 {
                continue;
            }
            let at = reader.counts(target, "pointIndices")?;
            let mut add = |list: &mut [Vec3], offsets: Vec<Vec3>| {
                for (index, offset) in offsets.into_iter().enumerate() {
                    let point = at
                        .as_ref()
                        .map_or(Some(index as u32), |at| at.get(index).copied());
                    if let Some(place) = point.and_then(|p| list.get_mut(p as usize)) {
                        *place += weight * offset;
                        is_bent = true;
                    }
                }
            };
            add(
                &mut mesh.points,
                reader.vectors(target, "offsets")?.unwrap_or_default(),
            );
            if let Some(normals) = mesh
                .normals
                .as_mut()
                .filter(|n| n.by == By::Point && n.indices.is_none())
            {
                add(
                    &mut normals.values,
                    reader.vectors(target, "normalOffsets")?.unwrap_or_default(),
                );
            }
        }
        if is_bent && mesh.points.iter().any(|p| !p.is_finite()) {
            return Err(format!(
                "a blend shape of `{path}` moves a point where no number is"
            ));
        }
        Ok(())
    }

    /// What each joint does to what is bound to it.
    fn pose(&self, skeleton: &Path, animation: Option<&Path>) -> Checked<Pose> {
        let reader = self.reader;
        let joints = tokens(&reader, skeleton, "joints")?;
        let matrices = |name: &str| -> Checked<Vec<DMat4>> {
            Ok(reader
                .value(skeleton, name)?
                .and_then(values::matrices)
                .unwrap_or_default())
        };
        let bind = matrices("bindTransforms")?;
        let mut local = matrices("restTransforms")?;
        if bind.len() != joints.len() {
            return Err(format!(
                "the skeleton `{skeleton}` has {} joints and {} bind transforms",
                joints.len(),
                bind.len()
            ));
        }
        let known: HashMap<String, usize> = joints
            .iter()
            .cloned()
            .enumerate()
            .map(|(at, name)| (name, at))
            .collect();
        let parents: Vec<Option<usize>> = joints.iter().map(|name| parent(name, &known)).collect();
        if local.len() != joints.len() {
            // Without a pose to rest in it is bound in the one it rests in.
            let each = bind.iter().zip(&parents);
            local = each
                .map(|(own, parent)| parent.map_or(*own, |p| bind[p].inverse() * *own))
                .collect();
        }
        let mut moves = false;
        if let Some(animation) = animation {
            let order = tokens(&reader, animation, "joints")?;
            let list = |name: &str| reader.value(animation, name);
            let translations = list("translations")?
                .and_then(values::vectors)
                .unwrap_or_default();
            let turns = list("rotations")?
                .and_then(values::rotations)
                .unwrap_or_default();
            let scales = list("scales")?
                .and_then(values::vectors)
                .unwrap_or_default();
            moves = ["translations", "rotations", "scales"]
                .iter()
                .any(|n| reader.varies(animation, n));
            for (index, name) in order.iter().enumerate() {
                let (Some(joint), Some(translation)) = (known.get(name), translations.get(index))
                else {
                    continue;
                };
                local[*joint] = DMat4::from_scale_rotation_translation(
                    scales.get(index).map_or(DVec3::ONE, |s| s.as_dvec3()),
                    turns.get(index).copied().unwrap_or(DQuat::IDENTITY),
                    translation.as_dvec3(),
                );
            }
        }
        let mut posed = vec![None; joints.len()];
        for joint in 0..joints.len() {
            // From the first joint above that is known down to this.
            let mut chain = vec![joint];
            while let Some(above) = parents[chain[chain.len() - 1]]
                && posed[above].is_none()
            {
                chain.push(above);
            }
            for joint in chain.into_iter().rev() {
                let above = parents[joint]
                    .and_then(|p| posed[p])
                    .unwrap_or(DMat4::IDENTITY);
                posed[joint] = Some(above * local[joint]);
            }
        }
        let all = posed.into_iter().zip(&bind);
        let list = all
            .map(|(posed, bind)| posed.unwrap_or(DMat4::IDENTITY) * inverse(bind))
            .collect();
        Ok(Pose { list, known, moves })
    }

    /// Where a prim is in the world.
    pub(super) fn world(&self, path: &Path) -> Checked<DMat4> {
        let mut world = DMat4::IDENTITY;
        let mut at = Some(path.clone());
        while let Some(prim) = at.filter(|prim| !prim.is_abs_root()) {
            let local = self.reader.local(&prim)?;
            world = local.matrix * world;
            if local.resets {
                break;
            }
            at = prim.parent();
        }
        Ok(self.upright * world)
    }
}

/// A skeleton at a time.
struct Pose {
    list: Vec<DMat4>,
    /// Joints by name.
    known: HashMap<String, usize>,
    moves: bool,
}

/// The joint above: `a/b` of `a/b/c`, or the next above that there is.
fn parent(name: &str, known: &HashMap<String, usize>) -> Option<usize> {
    let mut rest = name;
    loop {
        rest = &rest[..rest.rfind('/')?];
        if let Some(at) = known.get(rest) {
            return Some(*at);
        }
    }
}

fn inverse(matrix: &DMat4) -> DMat4 {
    if matrix.determinant() == 0.0 {
        DMat4::IDENTITY
    } else {
        matrix.inverse()
    }
}

/// Turns normals at points or corners with the points.
fn turn_normals(mesh: &mut Mesh, matrices: &[DMat4]) {
    let Some(normals) = &mesh.normals else {
        return;
    };
    let turned = |point: u32, normal: Vec3| {
        let matrix = DMat3::from_mat4(matrices[point as usize]);
        // Of the directions across, by which flattened and mirrored ones have a normal too.
        let across = DMat3::from_cols(
            matrix.y_axis.cross(matrix.z_axis),
            matrix.z_axis.cross(matrix.x_axis),
            matrix.x_axis.cross(matrix.y_axis),
        );
        (across * normal.as_dvec3()).as_vec3().normalize_or_zero()
    };
    let by_point = normals.by == By::Point || normals.by == By::Mesh;
    let count = if by_point {
        mesh.points.len()
    } else {
        mesh.corners.len()
    };
    let faces: Vec<usize> = mesh
        .counts
        .iter()
        .enumerate()
        .flat_map(|(f, c)| (0..*c).map(move |_| f))
        .collect();
    let each = (0..count).map(|index| {
        let (face, point) = if by_point {
            (0, index as u32)
        } else {
            (faces[index], mesh.corners[index])
        };
        let normal = normals.at(face, index, point)?;
        Some(turned(point, normal))
    });
    let values: Option<Vec<Vec3>> = each.collect();
    let by = if by_point { By::Point } else { By::Corner };
    mesh.normals = values.map(|values| Primvar {
        values,
        indices: None,
        by,
    });
}

/// A list of words.
fn tokens(reader: &Reader<'_>, path: &Path, name: &str) -> Checked<Vec<String>> {
    Ok(match reader.value(path, name)? {
        Some(Value::TokenVec(all)) => all.iter().map(|t| t.as_str().to_owned()).collect(),
        Some(Value::StringVec(all)) => all,
        _ => Vec::new(),
    })
}
