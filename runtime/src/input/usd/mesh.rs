//! Meshes as USD has them: faces of any number of corners, and values by mesh, face, point or corner.

use std::collections::BTreeSet;

use openusd::sdf::{Path, Value};

use super::model::{By, Mesh, Primvar};
use super::values;
use super::walk::{Above, Walk};

/// What texture coordinates are called where no material says it.
const COORDINATES: [&str; 4] = ["st", "UVMap", "st0", "map1"];
const SECOND: [&str; 3] = ["st1", "UVMap1", "map2"];

type Checked<T = ()> = Result<T, String>;

impl Walk<'_> {
    /// The mesh of a prim, as it is bent by its skeleton.
    pub(super) fn mesh(
        &mut self,
        path: &Path,
        here: &Above,
        material: Option<usize>,
    ) -> Checked<Mesh> {
        let reader = self.reader;
        let wrong = |what: String| format!("the mesh `{path}` cannot be read: {what}");
        let points = reader.vectors(path, "points")?.unwrap_or_default();
        let counts = reader.counts(path, "faceVertexCounts")?.unwrap_or_default();
        let corners = reader
            .counts(path, "faceVertexIndices")?
            .unwrap_or_default();
        let all: u64 = counts.iter().map(|c| u64::from(*c)).sum();
        if all != corners.len() as u64 {
            return Err(wrong(format!(
                "its faces have {all} corners, but there are {}",
                corners.len()
            )));
        }
        if let Some(most) = corners
            .iter()
            .max()
            .filter(|most| **most as usize >= points.len())
        {
            return Err(wrong(format!(
                "a corner is at point {most} of {}",
                points.len()
            )));
        }
        if points.iter().any(|p| !p.is_finite()) {
            return Err(wrong("a point is no number".into()));
        }
        let mut mesh = Mesh {
            points,
            counts,
            corners,
            holes: reader
                .counts(path, "holeIndices")?
                .unwrap_or_default()
                .into_iter()
                .collect(),
            is_left_handed: reader.token(path, "orientation")?.as_deref() == Some("leftHanded"),
            moves: ["points", "faceVertexIndices", "normals", "primvars:normals"]
                .iter()
                .any(|n| reader.varies(path, n)),
            ..Mesh::default()
        };
        self.normals(path, &mut mesh)?;
        self.coordinates(path, &mut mesh, material)?;
        self.subsets(path, &mut mesh)?;
        self.bend(path, here, &mut mesh)?;
        Ok(mesh)
    }

    fn normals(&mut self, path: &Path, mesh: &mut Mesh) -> Checked {
        let normals = self.primvar(path, "primvars:normals", values::vectors)?;
        mesh.normals = match normals {
            Some(normals) => Some(normals),
            None => self.primvar(path, "normals", values::vectors)?,
        };
        let scheme = self.reader.token(path, "subdivisionScheme")?;
        let is_smooth = scheme.is_none_or(|scheme| scheme != "none");
        if is_smooth && mesh.normals.is_none() {
            mesh.normals = Some(smooth(mesh));
            self.warn(
                "meshes that are to be subdivided are shown as they are, with smooth normals"
                    .into(),
            );
        }
        Ok(())
    }

    fn coordinates(&mut self, path: &Path, mesh: &mut Mesh, material: Option<usize>) -> Checked {
        let named = material.map(|m| self.coordinates_of(m)).unwrap_or_default();
        for (index, usual) in [&COORDINATES[..], &SECOND[..]].into_iter().enumerate() {
            let asked = named.get(index).map(String::as_str);
            for name in asked.into_iter().chain(usual.iter().copied()) {
                let found = self.primvar(path, &format!("primvars:{name}"), values::pairs)?;
                if found.is_some() {
                    mesh.uvs[index] = found;
                    break;
                }
            }
        }
        Ok(())
    }

    /// Faces with a material of their own.
    fn subsets(&mut self, path: &Path, mesh: &mut Mesh) -> Checked {
        let stage = self.reader.stage;
        let names = stage.prim(path.clone()).child_names();
        let names = names.map_err(|e| format!("`{path}` cannot be read: {e:#}"))?;
        for name in names {
            let subset = path.append_path(name.as_str()).map_err(|e| e.to_string())?;
            let kind = stage.prim(subset.clone()).type_name().ok().flatten();
            let is_of_faces = self
                .reader
                .token(&subset, "elementType")?
                .is_none_or(|t| t == "face");
            if kind.is_none_or(|kind| kind.as_str() != "GeomSubset") || !is_of_faces {
                continue;
            }
            let Some((bound, _)) = self.binding(&subset)? else {
                continue;
            };
            let faces = self.reader.counts(&subset, "indices")?.unwrap_or_default();
            if let Some(most) = faces
                .iter()
                .max()
                .filter(|most| **most as usize >= mesh.counts.len())
            {
                return Err(format!(
                    "`{subset}` has face {most} of {}",
                    mesh.counts.len()
                ));
            }
            let material = self.material(&bound)?;
            mesh.subsets.push((material, faces));
        }
        Ok(())
    }

    /// Values of a primvar, by what it says that they are for.
    pub(super) fn primvar<T>(
        &mut self,
        path: &Path,
        name: &str,
        read: impl Fn(Value) -> Option<Vec<T>>,
    ) -> Checked<Option<Primvar<T>>> {
        let reader = self.reader;
        let Some(values) = reader.value(path, name)?.and_then(read) else {
            return Ok(None);
        };
        let indices = match name.strip_prefix("primvars:") {
            Some(_) => {
                let name = format!("{name}:indices");
                let is_there = reader.value(path, &name)?.is_some();
                if is_there {
                    reader.counts(path, &name)?
                } else {
                    None
                }
            }
            None => None,
        };
        let by = match reader.field(path, name, "interpolation").as_deref() {
            Some("uniform") => By::Face,
            Some("vertex" | "varying") => By::Point,
            Some("faceVarying") => By::Corner,
            Some(_) => By::Mesh,
            // Normals that are no primvar are at points.
            None if name == "normals" => By::Point,
            None => By::Mesh,
        };
        Ok((!values.is_empty()).then_some(Primvar {
            values,
            indices,
            by,
        }))
    }
}

/// Normals at points: those of faces there, weighed by their area.
pub(super) fn smooth(mesh: &Mesh) -> Primvar<glam::Vec3> {
    let mut normals = vec![glam::Vec3::ZERO; mesh.points.len()];
    let mut start = 0;
    let at = |corner: u32| mesh.points[corner as usize];
    for (face, count) in mesh.counts.iter().enumerate() {
        let corners = &mesh.corners[start..start + *count as usize];
        start += *count as usize;
        if mesh.holes.contains(&(face as u32)) || corners.len() < 3 {
            continue;
        }
        let first = at(corners[0]);
        let areas = corners[1..]
            .windows(2)
            .map(|pair| (at(pair[0]) - first).cross(at(pair[1]) - first));
        let mut normal: glam::Vec3 = areas.sum();
        if mesh.is_left_handed {
            normal = -normal;
        }
        let here: BTreeSet<u32> = corners.iter().copied().collect();
        here.into_iter()
            .for_each(|corner| normals[corner as usize] += normal);
    }
    Primvar {
        values: normals,
        indices: None,
        by: By::Point,
    }
}
