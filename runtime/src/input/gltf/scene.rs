//! The scene that a glTF file shows, as the text of a scene file.

use std::collections::BTreeMap;
use std::fmt::Write;

use glam::{DMat4, DVec3};

use super::lights::Light;
use super::{ALL, Model, Pose};

/// Vertical field of view of a camera that the file does not have, in degrees.
const FOV: f64 = 35.0;

/// How much wider than everything the picture is.
const MARGIN: f64 = 1.1;

/// Frames of a second, in the keys of cameras and lights that move, and most of them.
const RATE: f64 = 24.0;
const MOST_FRAMES: usize = 10_000;

/// More places of a mesh than this are in a file of their own, which is faster to read than a list.
const LISTED: usize = 10_000;

/// Columns and rows of the picture, the rows for a camera that does not say its shape.
const COLUMNS: u32 = 1024;
const ROWS: u32 = 768;

impl Model {
    /// The text of a scene file, in which names of meshes begin with `prefix`.
    pub(super) fn scene(&self, prefix: &str) -> String {
        let pose = Pose::new(self, 0.0);
        let mut seen = Seen::default();
        // What is wrong with nodes is told where the geometry is read, which the scene then names whole.
        let visited = pose.visit(&mut |node, transform| seen.node(&pose, node, transform));
        let name = self.path.file_stem().unwrap_or_default().to_string_lossy();
        let mut text = format!("name = {}\n", quoted(&name));
        seen.write_camera(self, &mut text);
        let mut write = |line: String| {
            text.push_str(&line);
            text.push('\n');
        };
        if visited.is_err() || seen.meshes.is_empty() && seen.nodes.is_empty() {
            let all = quoted(&format!("{prefix}{ALL}"));
            write(format!("[[geometry]]\nfile = {all}\n"));
        }
        for (mesh, places) in &seen.meshes {
            let places: Vec<String> = places.iter().map(matrix).collect();
            let file = quoted(&format!("{prefix}meshes/{mesh}.gltf"));
            write(format!("[[geometry]]\nfile = {file}"));
            match &places[..] {
                [one] => write(format!("matrix = [{one}]\n")),
                all if all.len() > LISTED => {
                    let file = quoted(&format!("{prefix}placements/{mesh}.txt"));
                    write(format!("placements = {file}\n"));
                }
                all => {
                    let all: Vec<String> = all
                        .iter()
                        .map(|m| format!("  {{ matrix = [{m}] }},\n"))
                        .collect();
                    write(format!("placements = [\n{}]\n", all.concat()));
                }
            }
        }
        for node in &seen.nodes {
            let file = quoted(&format!("{prefix}nodes/{node}.gltf"));
            write(format!("[[geometry]]\nfile = {file}\n"));
        }
        for (name, source) in self.material_names.iter().zip(&self.source_names) {
            write(format!("[materials.{}]", quoted(name)));
            write(format!("file = \"{source}.impasto\"\n"));
        }
        write("[materials.\"*\"]\nfile = \"std::surface::gltf_pbr\"\n".into());
        seen.write_lights(self, &mut text);
        text
    }
}

impl Model {
    /// Where nodes put the mesh of that number, as a file of places.
    pub(super) fn placements(&self, mesh: usize) -> String {
        let mut text = String::from("m00 m01 m02 m03 m10 m11 m12 m13 m20 m21 m22 m23\n");
        // What is wrong with nodes is told where the geometry is read.
        let _ = Pose::new(self, 0.0).visit(&mut |node, transform| {
            let is_it = node.mesh().is_some_and(|own| own.index() == mesh);
            if is_it && !self.has_shape_of_its_own(node) {
                text.push_str(&matrix(transform));
                text.push('\n');
            }
        });
        text
    }
}

/// What nodes show.
#[derive(Default)]
struct Seen {
    /// Where meshes are, by their number.
    meshes: BTreeMap<usize, Vec<DMat4>>,
    /// Nodes whose meshes move or are bent.
    nodes: Vec<usize>,
    bounds: Option<[DVec3; 2]>,
    camera: Option<Seeing>,
    lights: Vec<Light>,
}

/// The first camera.
struct Seeing {
    node: usize,
    transform: DMat4,
    /// Its vertical field of view in degrees.
    fov: f64,
    /// Its width in heights.
    shape: Option<f64>,
}

impl Seen {
    fn node<'m>(&mut self, pose: &Pose<'m>, node: &gltf::Node<'m>, transform: &DMat4) {
        if let Some(mesh) = node.mesh() {
            if pose.model.has_shape_of_its_own(node) {
                self.nodes.push(node.index());
                self.grow_bent(pose, node, &mesh, transform);
            } else {
                let places = self.meshes.entry(mesh.index()).or_default();
                places.push(*transform);
                for primitive in mesh.primitives() {
                    self.grow(&primitive, transform);
                }
            }
        }
        if let (None, Some(camera)) = (&self.camera, node.camera()) {
            let perspective = match camera.projection() {
                gltf::camera::Projection::Perspective(perspective) => Some(perspective),
                gltf::camera::Projection::Orthographic(_) => None,
            };
            self.camera = perspective.map(|p| Seeing {
                node: node.index(),
                transform: *transform,
                fov: f64::from(p.yfov()).to_degrees(),
                shape: p.aspect_ratio().map(f64::from),
            });
        }
        if let Some(light) = node.light() {
            self.lights
                .push(Light::new(node.index(), transform, &light));
        }
    }

    /// Grows by the box that the positions of a primitive are in, which every file tells.
    fn grow(&mut self, primitive: &gltf::Primitive<'_>, transform: &DMat4) {
        let Some(positions) = primitive.get(&gltf::Semantic::Positions) else {
            return;
        };
        let corner = |value: Option<gltf::json::Value>| {
            let value = value?;
            let at = |i: usize| value.get(i)?.as_f64();
            Some(DVec3::new(at(0)?, at(1)?, at(2)?))
        };
        let (Some(low), Some(high)) = (corner(positions.min()), corner(positions.max())) else {
            return;
        };
        for i in 0..8 {
            let pick = |bit: u32, low: f64, high: f64| if i >> bit & 1 == 0 { low } else { high };
            let corner = DVec3::new(
                pick(0, low.x, high.x),
                pick(1, low.y, high.y),
                pick(2, low.z, high.z),
            );
            self.take_in(transform.transform_point3(corner));
        }
    }

    /// Grows by the corners of a mesh that may be bent; of one that cannot be read, somebody else says why.
    fn grow_bent<'m>(
        &mut self,
        pose: &Pose<'m>,
        node: &gltf::Node<'m>,
        mesh: &gltf::Mesh<'m>,
        transform: &DMat4,
    ) {
        let Ok(shape) = pose.shape(node, mesh, transform) else {
            return;
        };
        for primitive in mesh.primitives() {
            if let Ok(corners) = shape.corners(&primitive, &pose.buffers) {
                corners
                    .places
                    .into_iter()
                    .for_each(|place| self.take_in(place));
            }
        }
    }

    fn take_in(&mut self, place: DVec3) {
        if place.is_finite() {
            let [a, b] = self.bounds.unwrap_or([place; 2]);
            self.bounds = Some([a.min(place), b.max(place)]);
        }
    }

    /// The centre of everything, and how far it reaches from there.
    fn extent(&self) -> (DVec3, f64) {
        let [low, high] = self.bounds.unwrap_or([-DVec3::ONE, DVec3::ONE]);
        let radius = 0.5 * low.distance(high);
        let radius = if radius > 0.0 { radius } else { 1.0 };
        (0.5 * (low + high), radius)
    }

    fn write_camera(&self, model: &Model, text: &mut String) {
        let (centre, radius) = self.extent();
        let mut moving = None;
        let (view, fov, shape) = match &self.camera {
            Some(camera) => {
                let position = camera.transform.w_axis.truncate();
                let forward = -camera.transform.z_axis.truncate().normalize_or(DVec3::Z);
                let distance = (centre - position).dot(forward);
                let distance = if distance > 0.0 { distance } else { 1.0 };
                let part = |i: usize| move |m: &DMat4| view(m, distance)[i];
                let places = [("position", part(0)), ("look_at", part(1)), ("up", part(2))];
                moving = keys(model, camera.node, &places);
                (view(&camera.transform, distance), camera.fov, camera.shape)
            }
            None => {
                let direction = DVec3::new(0.55, 0.4, 1.0).normalize();
                let distance = self.distance(direction, radius);
                let view = [centre + distance * direction, centre, DVec3::Y];
                (view, FOV, None)
            }
        };
        let [position, look_at, up] = view.map(array);
        let rows = shape.filter(|s| (0.01..100.0).contains(s));
        let rows = rows.map_or(ROWS, |s| (f64::from(COLUMNS) / s).round().max(1.0) as u32);
        if moving.is_some() || self.lights.iter().any(|light| light.moves(model)) {
            let _ = write!(text, "\n[animation]\nframes_per_second = {RATE}\n");
        }
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "\n[camera]\nposition = {position}\nlook_at = {look_at}\nup = {up}\nfov = {:?}\n{}\n\
             [film]\nwidth = {COLUMNS}\nheight = {rows}\n\n",
            fov.clamp(0.1, 179.0),
            moving.unwrap_or_default(),
        );
    }

    /// How far from the centre, in this direction, one sees everything in a square picture with a margin.
    fn distance(&self, direction: DVec3, radius: f64) -> f64 {
        let right = DVec3::Y.cross(direction).normalize();
        let up = direction.cross(right);
        let slope = (0.5 * FOV).to_radians().tan();
        let half = self
            .bounds
            .map_or(DVec3::splat(radius), |[low, high]| 0.5 * (high - low));
        let corners = (0..8).map(|i| {
            let sign = |bit: u32| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let corner = half * DVec3::new(sign(0), sign(1), sign(2));
            let across = corner.dot(right).abs().max(corner.dot(up).abs());
            corner.dot(direction) + MARGIN * across / slope
        });
        corners.fold(radius, f64::max)
    }

    fn write_lights(&self, model: &Model, text: &mut String) {
        if self.lights.is_empty() {
            // Like a photographer's: a soft light from above and behind the camera, and a bright room.
            text.push_str(
                "[environment]\ncolor = 0.4\n\n\
                 [[lights]]\nkind = \"distant\"\nto_light = [0.4, 0.9, 0.6]\nirradiance = 1.5\nangle = 20\n",
            );
            return;
        }
        let (_, radius) = self.extent();
        for light in &self.lights {
            light.write(model, radius, text);
        }
    }
}

/// The lines with what is said of a node at each frame; none if it stays where it is, or nobody can tell.
pub(super) fn keys<F: Fn(&DMat4) -> DVec3>(
    model: &Model,
    node: usize,
    places: &[(&str, F)],
) -> Option<String> {
    if !model.motion.moves(node) {
        return None;
    }
    let last = model.motion.last(node, &model.buffers()).ok()?;
    let frames = ((last * RATE).ceil() as usize).min(MOST_FRAMES - 1);
    let mut lists = vec![String::new(); places.len()];
    for frame in 0..=frames {
        let pose = Pose::new(model, frame as f64 / RATE);
        let world = pose.world(&model.node(node)?).ok()?;
        for (list, (_, place)) in lists.iter_mut().zip(places) {
            let _ = write!(list, "[{frame}, {}], ", array(place(&world)));
        }
    }
    let named = places.iter().zip(&lists);
    let lines = named.map(|((name, _), list)| {
        let list = list.trim_end_matches(", ");
        format!("keys.{name} = [{list}]\n")
    });
    Some(lines.collect())
}

/// Where a camera is, where it looks at so far away, and what is up.
fn view(transform: &DMat4, distance: f64) -> [DVec3; 3] {
    let position = transform.w_axis.truncate();
    let forward = -transform.z_axis.truncate().normalize_or(DVec3::Z);
    let up = transform.y_axis.truncate().normalize_or(DVec3::Y);
    [position, position + distance * forward, up]
}

pub(super) fn array(v: DVec3) -> String {
    format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z)
}

/// The upper three rows of a matrix.
fn matrix(m: &DMat4) -> String {
    let rows = [m.row(0), m.row(1), m.row(2)];
    let numbers = rows.iter().flat_map(|row| row.to_array());
    let numbers: Vec<String> = numbers.map(|x| format!("{x:?}")).collect();
    numbers.join(", ")
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}
