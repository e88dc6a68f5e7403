//! Spheres, cubes and the like as meshes.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};
use openusd::sdf::Path;

use super::model::{By, Mesh, Primvar};
use super::walk::Walk;

/// Faces around an axis, and from pole to pole.
const AROUND: u32 = 64;
const DOWN: u32 = 32;

/// A mesh of the solid at a prim, whose axis is turned to where it says.
pub(super) fn solid(walk: &mut Walk<'_>, path: &Path, kind: &str) -> Result<Mesh, String> {
    let reader = walk.reader;
    let number =
        |name: &str, default: f64| Ok::<f32, String>(reader.number(path, name, default)? as f32);
    let names = [
        "radius",
        "height",
        "size",
        "width",
        "length",
        "radiusTop",
        "radiusBottom",
    ];
    let moves = names.iter().any(|name| reader.varies(path, name));
    let mut mesh = match kind {
        "Sphere" => {
            let radius = number("radius", 1.0)?;
            turned(&arc(Vec2::new(0.0, -radius), Vec2::ZERO, 0.0..PI, DOWN))
        }
        "Cube" => cube(number("size", 2.0)?),
        "Plane" => plane(number("width", 2.0)?, number("length", 2.0)?),
        "Cylinder" | "Cylinder_1" => {
            let both = number("radius", 1.0)?;
            let (bottom, top) = (
                number("radiusBottom", both.into())?,
                number("radiusTop", both.into())?,
            );
            let half = 0.5 * number("height", 2.0)?;
            frustum(bottom, top, half)
        }
        "Cone" => frustum(number("radius", 1.0)?, 0.0, 0.5 * number("height", 2.0)?),
        _ => {
            let both = number("radius", 0.5)?;
            let (bottom, top) = (
                number("radiusBottom", both.into())?,
                number("radiusTop", both.into())?,
            );
            let half = 0.5 * number("height", 1.0)?;
            let mut outline = arc(
                Vec2::new(0.0, -bottom),
                Vec2::new(0.0, -half),
                0.0..0.5 * PI,
                DOWN / 2,
            );
            outline.extend(arc(
                Vec2::new(0.0, -top),
                Vec2::new(0.0, half),
                0.5 * PI..PI,
                DOWN / 2,
            ));
            turned(&outline)
        }
    };
    let axis = reader.token(path, "axis")?;
    let turn = move |v: &mut Vec3| {
        *v = match axis.as_deref() {
            Some("X") => Vec3::new(v.z, v.x, v.y),
            Some("Y") => Vec3::new(v.y, v.z, v.x),
            _ => *v,
        }
    };
    mesh.points.iter_mut().for_each(&turn);
    if let Some(normals) = &mut mesh.normals {
        normals.values.iter_mut().for_each(&turn);
    }
    mesh.is_left_handed = reader.token(path, "orientation")?.as_deref() == Some("leftHanded");
    mesh.moves = moves;
    if mesh.points.iter().any(|p| !p.is_finite()) {
        return Err(format!("the size of `{path}` is no number"));
    }
    Ok(mesh)
}

/// Points of an outline: how far from the axis and how high, with its normals.
type Outline = Vec<(Vec2, Vec2)>;

/// An arc about a centre that begins at its lowest point.
fn arc(lowest: Vec2, centre: Vec2, angles: std::ops::Range<f32>, steps: u32) -> Outline {
    let radius = -lowest.y;
    let at = |step: u32| {
        let angle = angles.start + (angles.end - angles.start) * step as f32 / steps as f32;
        let way = Vec2::new(angle.sin().max(0.0), -angle.cos());
        (centre + radius * way, way)
    };
    (0..=steps).map(at).collect()
}

fn frustum(bottom: f32, top: f32, half: f32) -> Mesh {
    let slope = Vec2::new(2.0 * half, bottom - top).normalize_or(Vec2::X);
    let low = [
        (Vec2::new(0.0, -half), -Vec2::Y),
        (Vec2::new(bottom, -half), -Vec2::Y),
    ];
    let side = [
        (Vec2::new(bottom, -half), slope),
        (Vec2::new(top, half), slope),
    ];
    let high = [
        (Vec2::new(top, half), Vec2::Y),
        (Vec2::new(0.0, half), Vec2::Y),
    ];
    let mut mesh = turned(&low);
    append(&mut mesh, turned(&side));
    if top > 0.0 {
        append(&mut mesh, turned(&high));
    }
    mesh
}

/// An outline around the z axis.
fn turned(outline: &[(Vec2, Vec2)]) -> Mesh {
    let mut mesh = Mesh::default();
    let (mut normals, mut uvs) = (Vec::new(), Vec::new());
    let last = outline.len().saturating_sub(1).max(1) as f32;
    for (row, (at, normal)) in outline.iter().enumerate() {
        for column in 0..=AROUND {
            let turn = column as f32 / AROUND as f32;
            let (sin, cos) = (TAU * turn).sin_cos();
            let around = |v: Vec2| Vec3::new(v.x * cos, v.x * sin, v.y);
            mesh.points.push(around(*at));
            normals.push(around(*normal));
            uvs.push(Vec2::new(turn, row as f32 / last));
        }
    }
    for row in 0..outline.len().saturating_sub(1) as u32 {
        for column in 0..AROUND {
            let a = row * (AROUND + 1) + column;
            let b = a + AROUND + 1;
            mesh.counts.push(4);
            mesh.corners.extend([a, a + 1, b + 1, b]);
        }
    }
    mesh.normals = Some(at_points(normals));
    mesh.uvs[0] = Some(at_points(uvs));
    mesh
}

fn cube(size: f32) -> Mesh {
    let mut mesh = Mesh::default();
    for (axis, sign) in [
        (0, -1.0),
        (0, 1.0),
        (1, -1.0),
        (1, 1.0),
        (2, -1.0),
        (2, 1.0),
    ] {
        let normal = sign * Vec3::AXES[axis];
        let u = Vec3::AXES[(axis + 1) % 3];
        append(
            &mut mesh,
            quad(0.5 * size * normal, size * u, size * normal.cross(u)),
        );
    }
    mesh
}

/// A plane in x and y whose front is up; length is along y.
fn plane(width: f32, length: f32) -> Mesh {
    quad(Vec3::ZERO, width * Vec3::X, length * Vec3::Y)
}

fn quad(centre: Vec3, u: Vec3, v: Vec3) -> Mesh {
    let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
    let normal = u.cross(v).normalize_or(Vec3::Z);
    Mesh {
        points: corners
            .iter()
            .map(|(a, b)| centre + (a - 0.5) * u + (b - 0.5) * v)
            .collect(),
        counts: vec![4],
        corners: vec![0, 1, 2, 3],
        normals: Some(at_points(vec![normal; 4])),
        uvs: [Some(at_points(corners.map(Vec2::from).to_vec())), None],
        ..Mesh::default()
    }
}

fn at_points<T>(values: Vec<T>) -> Primvar<T> {
    Primvar {
        values,
        indices: None,
        by: By::Point,
    }
}

/// Adds another mesh with the same kinds of values.
fn append(mesh: &mut Mesh, other: Mesh) {
    let first = mesh.points.len() as u32;
    mesh.points.extend(other.points);
    mesh.counts.extend(other.counts);
    mesh.corners.extend(other.corners.iter().map(|c| c + first));
    match (&mut mesh.normals, other.normals) {
        (Some(own), Some(more)) => own.values.extend(more.values),
        (own, more) => *own = more,
    }
    let [uvs, _] = other.uvs;
    match (&mut mesh.uvs[0], uvs) {
        (Some(own), Some(more)) => own.values.extend(more.values),
        (own, more) => *own = more,
    }
}

/// The triangles of an outline around an axis with so few faces, for lamps.
pub(super) fn coarse(kind: &str, radius: f32, length: f32) -> Vec<[Vec3; 3]> {
    let steps = 16;
    let ring = |at: Vec2, step: u32| {
        let (sin, cos) = (TAU * step as f32 / steps as f32).sin_cos();
        Vec3::new(at.x * cos, at.x * sin, at.y)
    };
    let outline: Vec<Vec2> = match kind {
        "sphere" => arc(Vec2::new(0.0, -radius), Vec2::ZERO, 0.0..PI, steps / 2)
            .into_iter()
            .map(|(at, _)| at)
            .collect(),
        "disk" => vec![Vec2::new(0.0, 0.0), Vec2::new(radius, 0.0)],
        _ => vec![
            Vec2::new(radius, -0.5 * length),
            Vec2::new(radius, 0.5 * length),
        ],
    };
    let mut triangles = Vec::new();
    for pair in outline.windows(2) {
        for step in 0..steps {
            let [a, b] = [ring(pair[0], step), ring(pair[0], step + 1)];
            let [c, d] = [ring(pair[1], step + 1), ring(pair[1], step)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    triangles.retain(|[a, b, c]| (*b - *a).cross(*c - *a).length_squared() > 0.0);
    triangles
}
