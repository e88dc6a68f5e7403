//! The scene that a glTF file shows, as the text of a scene file.

use std::collections::BTreeMap;
use std::fmt::Write;

use glam::{DMat4, DVec3};

use super::lights::Light;
use super::{ALL, Model, Pose};
use crate::input::shown::{self, COLUMNS, Extent, FOV, array, matrix, quoted, view};

/// Frames of a second, in the keys of cameras and lights that move, and most of them.
const RATE: f64 = 24.0;
const MOST_FRAMES: usize = 10_000;

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
            let listed = format!("{prefix}placements/{mesh}.txt");
            let file = format!("{prefix}meshes/{mesh}.gltf");
            write(
                shown::geometry(&file, places, &listed)
                    .trim_end()
                    .to_owned()
                    + "\n",
            );
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
        let mut text = String::from(shown::PLACES);
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
    extent: Extent,
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
        let mut within = Extent::default();
        within.take_in(low);
        within.take_in(high);
        for corner in within.corners() {
            self.extent.take_in(transform.transform_point3(corner));
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
                    .for_each(|place| self.extent.take_in(place));
            }
        }
    }

    fn write_camera(&self, model: &Model, text: &mut String) {
        let (centre, _) = self.extent.reach();
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
            None => (self.extent.view(), FOV, None),
        };
        let [position, look_at, up] = view.map(array);
        let rows = shown::rows(shape);
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

    fn write_lights(&self, model: &Model, text: &mut String) {
        if self.lights.is_empty() {
            text.push_str(shown::LIGHT);
            return;
        }
        let (_, radius) = self.extent.reach();
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
