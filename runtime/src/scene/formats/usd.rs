//! USD files: all meshes of a stage where they are, one of them, or one in coordinates of its own.

use std::collections::BTreeMap;
use std::path::Path;

use glam::{DMat4, DVec3, Vec2, Vec3};

use super::polygon::{self, Cut};
use super::{FileMaterial, Format, Geometry, Part, Triangle, Warning, counted};
use crate::error::SceneError;
use crate::input;
use crate::input::usd::{self, Member, Mesh, Model, Placed};

/// The row of USD files.
pub(super) const FORMAT: Format = Format {
    name: "USD",
    extensions: &usd::EXTENSIONS,
    read,
    without_material: "meshes without a material",
    values: &[],
    values_of: "a USD file",
};

fn read(base: &Path, name: &str, seconds: f64) -> Result<Geometry, SceneError> {
    let path = base.join(name);
    match input::inside(&path, usd::is_named_so) {
        Some((file, member)) => {
            let missing = || SceneError::in_file(file, "the USD file has no such mesh");
            let member = Member::of_geometry(member).ok_or_else(missing)?;
            geometry(file, member, seconds)
        }
        None => geometry(&path, Member::All, seconds),
    }
}

/// The geometry of the file at `path`.
///
/// # Errors
/// What is wrong with the file.
fn geometry(path: &Path, member: Member, seconds: f64) -> Result<Geometry, SceneError> {
    // What stays is asked for at the start, where it is known already.
    let seconds = if matches!(member, Member::Mesh(_) | Member::Light(_)) {
        0.0
    } else {
        seconds
    };
    let model = Model::read(path, seconds)?;
    let missing =
        |what: &str, number| SceneError::in_file(path, format!("the file has no {what} {number}"));
    let mut reading = Reading {
        model: &model,
        known: BTreeMap::new(),
        geometry: Geometry::default(),
        crossing: 0,
        empty: 0,
    };
    let mut may_be_empty = false;
    match member {
        Member::Mesh(number) => {
            let mesh = model
                .meshes
                .get(number)
                .ok_or_else(|| missing("mesh", number))?;
            reading.mesh(mesh, &DMat4::IDENTITY);
            if number == 0 {
                reading
                    .geometry
                    .warnings
                    .extend(model.warnings.iter().map(|w| said(w)));
            }
        }
        Member::Prim(number) => {
            let placed = model
                .placed
                .get(number)
                .ok_or_else(|| missing("prim", number))?;
            may_be_empty = placed.moves;
            reading.placed(placed);
        }
        Member::Light(number) => {
            let triangles = model.lamp(number).ok_or_else(|| missing("light", number))?;
            let material = reading.material(None);
            reading
                .geometry
                .triangles
                .extend(triangles.iter().map(|positions| Triangle {
                    positions: *positions,
                    material,
                    ..Triangle::default()
                }));
        }
        Member::All => {
            model
                .placed
                .iter()
                .for_each(|placed| reading.placed(placed));
            may_be_empty = model.placed.iter().any(|placed| placed.moves);
            reading
                .geometry
                .warnings
                .extend(model.warnings.iter().map(|w| said(w)));
        }
    }
    let Reading {
        mut geometry,
        crossing,
        empty,
        ..
    } = reading;
    if geometry.triangles.is_empty() && !may_be_empty {
        return Err(SceneError::in_file(path, "the USD file has no triangles")
            .hint("curves, points and volumes are not rendered"));
    }
    geometry
        .warnings
        .extend(counted("faces that cross themselves", crossing));
    geometry
        .warnings
        .extend(counted("faces without an area, left out", empty));
    Ok(geometry)
}

fn said(message: &str) -> Warning {
    Warning {
        line: None,
        message: message.to_owned(),
    }
}

/// Geometry that grows.
struct Reading<'m> {
    model: &'m Model,
    /// Indices into [`Geometry::materials`].
    known: BTreeMap<Option<usize>, usize>,
    geometry: Geometry,
    /// Faces whose outline crosses itself.
    crossing: usize,
    /// Faces of which nothing is left.
    empty: usize,
}

impl Reading<'_> {
    fn placed(&mut self, placed: &Placed) {
        self.geometry.moves |= placed.moves;
        let mesh = &self.model.meshes[placed.mesh];
        for place in placed.places.iter().filter(|_| placed.is_visible) {
            self.mesh(mesh, place);
        }
    }

    fn mesh(&mut self, mesh: &Mesh, place: &DMat4) {
        let first = self.geometry.triangles.len();
        let is_mirrored = place.determinant() < 0.0;
        let is_turned = mesh.is_left_handed != is_mirrored;
        let across = across(place);
        let mut materials = vec![mesh.material; mesh.counts.len()];
        for (material, faces) in &mesh.subsets {
            faces
                .iter()
                .for_each(|face| materials[*face as usize] = *material);
        }
        let mut start = 0;
        for (face, count) in mesh.counts.iter().enumerate() {
            let corners = start..start + *count as usize;
            start = corners.end;
            if mesh.holes.contains(&(face as u32)) || corners.len() < 3 {
                continue;
            }
            let at = |corner: usize| {
                let point = mesh.points[mesh.corners[corner] as usize];
                place.transform_point3(point.as_dvec3())
            };
            let places: Vec<DVec3> = corners.clone().map(at).collect();
            let Cut { triangles, crosses } = polygon::cut(&places);
            self.crossing += usize::from(crosses);
            let material = self.material(materials[face]);
            for triangle in triangles {
                let [a, b, c] = triangle;
                let three = if is_turned { [a, c, b] } else { [a, b, c] };
                let positions = three.map(|i| places[i]);
                if (positions[1] - positions[0]).cross(positions[2] - positions[0]) == DVec3::ZERO {
                    self.empty += usize::from(corners.len() == 3);
                    continue;
                }
                let three = three.map(|i| corners.start + i);
                let flat = |index: usize| {
                    mesh.uvs[index]
                        .as_ref()
                        .and_then(|uvs| of_three(uvs, mesh, face, three))
                };
                let normals = mesh
                    .normals
                    .as_ref()
                    .and_then(|n| of_three(n, mesh, face, three));
                let triangle = Triangle {
                    positions,
                    normals: normals.map(|all| all.map(|n| turned(&across, n))),
                    uvs: flat(0).filter(are_numbers),
                    uvs1: flat(1).filter(are_numbers),
                    colors: mesh
                        .colors
                        .as_ref()
                        .and_then(|c| of_three(c, mesh, face, three)),
                    material,
                };
                self.geometry.triangles.push(triangle);
            }
        }
        let triangles = first..self.geometry.triangles.len();
        if !triangles.is_empty() {
            self.geometry.parts.push(Part {
                name: mesh.path.clone(),
                triangles,
            });
        }
    }

    fn material(&mut self, number: Option<usize>) -> usize {
        let next = self.geometry.materials.len();
        let index = *self.known.entry(number).or_insert(next);
        if index == next {
            let name = number
                .and_then(|n| self.model.materials.get(n))
                .map(|m| m.name.clone());
            self.geometry.materials.push(FileMaterial {
                name: name.unwrap_or_default(),
                values: Vec::new(),
            });
        }
        index
    }
}

fn are_numbers(all: &[Vec2; 3]) -> bool {
    all.iter().all(|v| v.is_finite())
}

/// What three corners have; none if one of them has nothing.
fn of_three<T: Copy>(
    values: &usd::Primvar<T>,
    mesh: &Mesh,
    face: usize,
    corners: [usize; 3],
) -> Option<[T; 3]> {
    let at = |corner: usize| values.at(face, corner, mesh.corners[corner]);
    Some([at(corners[0])?, at(corners[1])?, at(corners[2])?])
}

/// What turns normals with a mesh, mirrored ones too.
fn across(place: &DMat4) -> [DVec3; 3] {
    let [x, y, z] = [place.x_axis, place.y_axis, place.z_axis].map(|axis| axis.truncate());
    let sign = if place.determinant() < 0.0 { -1.0 } else { 1.0 };
    [sign * y.cross(z), sign * z.cross(x), sign * x.cross(y)]
}

fn turned(across: &[DVec3; 3], normal: Vec3) -> Vec3 {
    let n = normal.as_dvec3();
    let turned = n.x * across[0] + n.y * across[1] + n.z * across[2];
    turned.as_vec3()
}
