//! Names and groups by which outputs of a film tell objects and lights apart; nothing else asks for them.

use std::collections::BTreeMap;
use std::path::Path;

use super::formats::Geometry;
use super::{Placement, Scene};

/// Names of objects, and groups of lights. Lists may be shorter than what they are of, which then has no label.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Labels {
    /// The names that [`Mesh::objects`](super::Mesh::objects) of the world's mesh are indices into.
    pub objects: Vec<String>,
    /// The same for each of [`Scene::objects`]: what its file calls its parts.
    pub parts: Vec<Vec<String>>,
    /// For each of [`Scene::placements`] which copy of its file it is, from 0.
    pub copies: Vec<u32>,
    /// The group of each of [`Scene::lights`].
    pub lights: Vec<Option<String>>,
    /// The group of the environment.
    pub environment: Option<String>,
    /// The group of the light of each of [`Scene::materials`].
    pub materials: Vec<Option<String>>,
}

impl Labels {
    /// How many names a placement has.
    fn parts_of(&self, placement: &Placement) -> usize {
        let parts = self.parts.get(placement.object as usize);
        parts.map_or(1, Vec::len)
    }
}

impl Scene {
    /// The names of all objects: those of the world, those of the parts of every placement, and those of quad
    /// lights.
    pub(crate) fn object_names(&self) -> Vec<String> {
        let mut names = self.labels.objects.clone();
        for (index, placement) in self.placements.iter().enumerate() {
            let object = placement.object as usize;
            let file = self.objects.get(object).map_or("", |o| &o.name);
            let copy = self.labels.copies.get(index).copied().unwrap_or(0);
            match self.labels.parts.get(object) {
                Some(parts) => names.extend(parts.iter().map(|part| name(file, part, copy))),
                None => names.push(name(file, "", copy)),
            }
        }
        names
    }

    /// For each name of [`Scene::object_names`] the index of its place.
    pub(crate) fn places_of_objects(&self) -> Vec<u32> {
        let mut places = self.object_places.clone();
        // Lights are at no place of an entry.
        places.resize(self.labels.objects.len(), 0);
        for placement in &self.placements {
            let parts = self.labels.parts_of(placement);
            places.extend(std::iter::repeat_n(placement.place, parts));
        }
        places
    }

    /// The index of the first name of each placement.
    pub(crate) fn first_objects(&self) -> Vec<u32> {
        let mut next = self.labels.objects.len();
        let placed = self.placements.iter().map(|placement| {
            let first = next;
            next += self.labels.parts_of(placement);
            first as u32
        });
        placed.collect()
    }
}

/// What a geometry file calls its parts, and which of them each triangle is of: an object, or a group that lies in
/// none. Triangles of neither are of a part without a name.
pub(super) fn parts(geometry: &Geometry) -> (Vec<String>, Vec<u32>) {
    const NOBODY: u32 = u32::MAX;
    let mut names: Vec<String> = Vec::new();
    let mut by_name: BTreeMap<&str, u32> = BTreeMap::new();
    let mut index = |name| {
        *by_name.entry(name).or_insert_with(|| {
            names.push(name.to_owned());
            names.len() as u32 - 1
        })
    };
    let mut of_triangle = vec![NOBODY; geometry.triangles.len()];
    for part in geometry.parts.iter().filter(|p| !p.triangles.is_empty()) {
        let triangles = of_triangle.get_mut(part.triangles.clone());
        let free = triangles.into_iter().flatten().filter(|t| **t == NOBODY);
        let part = index(part.name.as_str());
        free.for_each(|triangle| *triangle = part);
    }
    if of_triangle.contains(&NOBODY) {
        let nameless = index("");
        let free = of_triangle.iter_mut().filter(|t| **t == NOBODY);
        free.for_each(|triangle| *triangle = nameless);
    }
    (names, of_triangle)
}

/// The name of a part of a geometry file, of which this is a copy: `models/lamp/bulb.002`.
pub(super) fn name(file: &str, part: &str, copy: u32) -> String {
    let stem = Path::new(file).with_extension("");
    let mut name = stem.to_string_lossy().replace('\\', "/");
    if !part.is_empty() {
        name = format!("{name}/{part}");
    }
    if copy > 0 {
        name += &format!(".{copy:03}");
    }
    name
}
