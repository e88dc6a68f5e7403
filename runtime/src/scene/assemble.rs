//! From entries and geometry files to what a scene consists of: triangles in the world, and objects
//! with their placements. Both give the same picture; this file decides which is which.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;

use super::MAX_TRIANGLES;
use super::bindings::Bindings;
use super::description::{Description, GeometrySpec, SourceName};
use super::duplicates::{self, Removed};
use super::formats::{self, Format};
use super::load::{Source, Sources};
use super::mesh::{Repairs, check_reach};
use super::origin::{self, Extent};
use super::placements::{self, Places, PlacesSpec};
use super::{Labels, Light, MaterialBinding, Mesh, Object, Placement, Transform, labels};
use crate::error::SceneError;

/// Copies of a geometry file are shared if that saves so many triangles. Below, one level of
/// hierarchy is faster than two (docs/measurements.md), and memory no concern.
const SHARE_FROM: usize = 1 << 20;

/// What the `[[geometry]]` and `[[lights]]` of a scene come to.
pub(super) struct Assembled {
    /// Where the coordinates of everything else count from.
    pub(super) origin: DVec3,
    pub(super) mesh: Mesh,
    pub(super) objects: Vec<Object>,
    pub(super) placements: Vec<Placement>,
    pub(super) places: Vec<Transform>,
    pub(super) object_places: Vec<u32>,
    pub(super) materials: Vec<MaterialBinding>,
    pub(super) camera_media: Vec<u32>,
    pub(super) lights: Vec<Light>,
    pub(super) labels: Labels,
}

/// Puts together what `description` of the scene at `path` says of `sources`, by the names that
/// its entries use. `formats` are those that geometry can have.
pub(super) fn assemble(
    path: &Path,
    formats: &[Format],
    description: &Description,
    sources: Sources<'_, '_>,
    warnings: &mut Vec<String>,
) -> Result<Assembled, SceneError> {
    let base = path.parent().unwrap_or(Path::new(""));
    let files = place_files(base, &description.geometry)?;
    let entries: Vec<Entry> = description
        .geometry
        .iter()
        .zip(&files)
        .map(|(spec, file)| Entry {
            spec,
            source: sources.of(spec),
            places: match (&spec.places, file) {
                (PlacesSpec::Listed(places), _) | (_, Some(places)) => places,
                (PlacesSpec::File(..), None) => &NOWHERE,
            },
        })
        .collect();
    let mut assembly = Assembly {
        path,
        formats,
        bindings: Bindings::new(&description.materials),
        copies: copies(&entries),
        origin: origin(&entries, description),
        object_sources: Vec::new(),
        object_origins: Vec::new(),
        mesh: Mesh::default(),
        objects: Vec::new(),
        placements: Vec::new(),
        places: Vec::new(),
        object_places: Vec::new(),
        labels: Labels::default(),
        seen: BTreeMap::new(),
        warnings,
    };
    for entry in &entries {
        assembly.push(entry)?;
    }
    let lights = description.lights.iter();
    let lights: Vec<Light> = lights.map(|l| l.seen_from(assembly.origin)).collect();
    for (index, light) in lights.iter().enumerate() {
        let object = assembly.labels.objects.len() as u32;
        if assembly.mesh.push_light(light, index as u32, object) {
            let name = format!("lights/{}", index + 1);
            assembly.labels.objects.push(name);
        }
    }
    assembly.finish(description, lights)
}

/// Where the coordinates of a scene of these entries count from.
fn origin(entries: &[Entry], description: &Description) -> DVec3 {
    let mut extents: BTreeMap<&str, Extent> = BTreeMap::new();
    let mut all = Extent::default();
    for Entry {
        spec,
        source,
        places,
    } in entries
    {
        let of_file = extents
            .entry(&spec.file)
            .or_insert_with(|| Extent::of(&source.geometry));
        for place in &places.list {
            all.add_placed(of_file, &spec.transform.then(&place.transform));
        }
    }
    let corners = description.lights.iter().flat_map(|l| l.corners());
    corners.for_each(|corner| all.add(corner));
    origin::of(&all)
}

/// The places of entries that name a file of them.
fn place_files(base: &Path, geometry: &[GeometrySpec]) -> Result<Vec<Option<Places>>, SceneError> {
    let read = |spec: &GeometrySpec| match &spec.places {
        PlacesSpec::File(name, named) => placements::read_file(&base.join(name))
            .map(Some)
            .map_err(|e| e.named_at(named)),
        PlacesSpec::Listed(_) => Ok(None),
    };
    geometry.iter().map(read).collect()
}

static NOWHERE: Places = Places {
    list: Vec::new(),
    materials: Vec::new(),
};

/// An entry with the files that it names.
struct Entry<'d> {
    spec: &'d GeometrySpec<'d>,
    source: &'d Source<'d>,
    places: &'d Places,
}

/// How often each geometry file is placed by entries that leave the choice to us.
fn copies<'d>(entries: &[Entry<'d>]) -> BTreeMap<&'d str, usize> {
    let mut copies = BTreeMap::new();
    for entry in entries.iter().filter(|e| e.spec.share.is_none()) {
        *copies.entry(entry.spec.file.as_str()).or_default() += entry.places.list.len();
    }
    copies
}

/// A scene that grows by entries.
struct Assembly<'d, 'w> {
    path: &'d Path,
    formats: &'d [Format],
    bindings: Bindings<'d>,
    copies: BTreeMap<&'d str, usize>,
    origin: DVec3,
    /// What each object was read from.
    object_sources: Vec<SourceName>,
    /// Where the coordinates of each object count from, in its geometry file.
    object_origins: Vec<DVec3>,
    mesh: Mesh,
    objects: Vec<Object>,
    placements: Vec<Placement>,
    places: Vec<Transform>,
    object_places: Vec<u32>,
    labels: Labels,
    /// How often each geometry file was placed so far.
    seen: BTreeMap<&'d str, u32>,
    warnings: &'w mut Vec<String>,
}

impl<'d> Assembly<'d, '_> {
    fn push(&mut self, entry: &Entry<'d>) -> Result<(), SceneError> {
        let materials = self.materials(entry)?;
        let repairs = if self.is_shared(entry) {
            self.place(entry, &materials)?
        } else {
            self.copy(entry, &materials)?
        };
        self.warn(entry, repairs);
        if self.stored() > MAX_TRIANGLES {
            return Err(self.too_many_triangles());
        }
        Ok(())
    }

    fn is_shared(&self, entry: &Entry) -> bool {
        let copies = self.copies.get(entry.spec.file.as_str()).copied();
        let saved = copies.unwrap_or(0).saturating_sub(1) as u64;
        let triangles = entry.source.geometry.triangles.len() as u64;
        let is_worth_it = saved * triangles >= SHARE_FROM as u64;
        entry.spec.share.unwrap_or(is_worth_it)
    }

    fn stored(&self) -> usize {
        let objects = self.objects.iter().map(|o| o.mesh.len());
        self.mesh.len() + objects.sum::<usize>()
    }

    /// The materials of each place.
    fn materials(&mut self, entry: &Entry) -> Result<Vec<Arc<[u32]>>, SceneError> {
        let Entry {
            spec,
            source,
            places,
        } = entry;
        let mut known: BTreeMap<Option<usize>, Arc<[u32]>> = BTreeMap::new();
        let mut each = Vec::with_capacity(places.list.len());
        for place in &places.list {
            if let Some(list) = known.get(&place.material) {
                each.push(Arc::clone(list));
                continue;
            }
            let own = place.material.map(|index| &places.materials[index]);
            let name = own.or(spec.material.as_ref());
            let list: Arc<[u32]> = self.bindings.resolve(source, name)?.into();
            known.insert(place.material, Arc::clone(&list));
            each.push(list);
        }
        Ok(each)
    }

    /// Adds the triangles of every place to those in the world.
    fn copy(&mut self, entry: &Entry<'d>, materials: &[Arc<[u32]>]) -> Result<Repairs, SceneError> {
        let Source { path, geometry, .. } = entry.source;
        let copies = entry.places.list.len();
        let total = (copies as u64).saturating_mul(geometry.triangles.len() as u64);
        if total > MAX_TRIANGLES as u64 {
            return Err(self.too_many_triangles());
        }
        let mut repairs = Repairs::default();
        let (names, of_triangle) = labels::parts(geometry);
        for (place, materials) in entry.places.list.iter().zip(materials) {
            let transform = self.transform(entry, &place.transform)?;
            let copy = self.next_copy(entry);
            let first = self.labels.objects.len() as u32;
            let named = |part: &String| labels::name(&entry.spec.file, part, copy);
            self.labels.objects.extend(names.iter().map(named));
            let place = self.next_place(&transform);
            let places = std::iter::repeat_n(place, names.len());
            self.object_places.extend(places);
            let object = |triangle: usize| first + of_triangle[triangle];
            let (mesh, origin) = (&mut self.mesh, self.origin);
            repairs += mesh.push_geometry(path, geometry, &transform, origin, materials, object)?;
        }
        Ok(repairs)
    }

    /// The number of a place, which is the next.
    fn next_place(&mut self, transform: &Transform) -> u32 {
        self.places.push(*transform);
        self.places.len() as u32 - 1
    }

    /// Which copy of its geometry file is the next of an entry.
    fn next_copy(&mut self, entry: &Entry<'d>) -> u32 {
        let seen = self.seen.entry(entry.spec.file.as_str()).or_default();
        *seen += 1;
        *seen - 1
    }

    /// Places the entry's object.
    fn place(
        &mut self,
        entry: &Entry<'d>,
        materials: &[Arc<[u32]>],
    ) -> Result<Repairs, SceneError> {
        let (object, repairs) = self.object(entry)?;
        if self.placements.len() + materials.len() > placements::MAX_PLACEMENTS {
            return Err(placements::too_many(self.path));
        }
        let mesh = &self.objects[object as usize].mesh;
        if mesh.is_empty() {
            return Ok(repairs);
        }
        let corners = mesh.positions.iter().flatten();
        let largest = corners.fold(0.0f32, |m, p| m.max(p.abs().max_element()));
        for (place, materials) in entry.places.list.iter().zip(materials) {
            let transform = self.transform(entry, &place.transform)?;
            let place = self.next_place(&transform);
            let columns = transform.matrix.abs();
            let transform = transform.before(self.object_origins[object as usize]);
            let reach = columns * DVec3::splat(largest.into()) + transform.translation.abs();
            let error = |message| SceneError::in_file(&entry.source.path, message);
            check_reach("the geometry", reach.max_element(), error)?;
            self.placements.push(Placement {
                object,
                transform: transform.moved(-self.origin),
                materials: Arc::clone(materials),
                place,
            });
            let copy = self.next_copy(entry);
            self.labels.copies.push(copy);
        }
        Ok(repairs)
    }

    /// The object of the entry's geometry file, and what was done to it if it is new.
    fn object(&mut self, entry: &Entry) -> Result<(u32, Repairs), SceneError> {
        let name = &entry.spec.file;
        let of = entry.spec.source();
        if let Some(known) = self.object_sources.iter().position(|o| *o == of) {
            return Ok((known as u32, Repairs::default()));
        }
        let Source { path, geometry, .. } = entry.source;
        let slots: Vec<u32> = (0..geometry.materials.len() as u32).collect();
        let mut mesh = Mesh::default();
        let at = origin::of(&Extent::of(geometry));
        let (names, of_triangle) = labels::parts(geometry);
        let part = |triangle: usize| of_triangle[triangle];
        let home = Transform::default();
        let repairs = mesh.push_geometry(path, geometry, &home, at, &slots, part)?;
        mesh.simplify();
        let removed = duplicates::remove_triangles(&mut mesh, &[], &Labels::default());
        self.counted(name, "triangles", removed.triangles);
        let name = name.clone();
        self.objects.push(Object { name, mesh });
        self.object_sources.push(of);
        self.object_origins.push(at);
        self.labels.parts.push(names);
        Ok((self.objects.len() as u32 - 1, repairs))
    }

    /// From the geometry file to the world.
    fn transform(&self, entry: &Entry, place: &Transform) -> Result<Transform, SceneError> {
        let transform = entry.spec.transform.then(place);
        if transform.is_invertible() {
            return Ok(transform);
        }
        let file = &entry.spec.file;
        let message =
            format!("the transforms of `{file}` and of its placement flatten it together");
        Err(SceneError::in_file(self.path, message).hint("scale less unevenly"))
    }

    fn warn(&mut self, entry: &Entry, repairs: Repairs) {
        let file = &entry.spec.file;
        let geometry = &entry.source.geometry;
        let mut counted = |what: &str, count: usize| {
            if count > 0 {
                self.warnings.push(format!("{file}: {what}: {count}"));
            }
        };
        counted("triangles without area, left out", repairs.degenerate);
        counted(
            "triangles wound against their normals, turned over",
            repairs.flipped,
        );
        let of_file = geometry.warnings.iter().map(|w| w.text(file));
        self.warnings.extend(of_file);
        if let Some(missing) = &geometry.missing {
            let warning = format!("{}; no material needs it", missing.clone());
            self.warnings.push(warning);
        }
    }

    fn finish(
        mut self,
        description: &Description,
        lights: Vec<Light>,
    ) -> Result<Assembled, SceneError> {
        if self.mesh.is_empty() && self.placements.is_empty() {
            return Err(self.no_triangle(description.geometry.is_empty()));
        }
        self.mesh.simplify();
        self.labels.lights = description.lights.iter().map(|l| l.group.clone()).collect();
        self.remove_duplicates(&lights);
        let camera_media = self.bindings.of_camera(&description.camera_media)?;
        let environment = description.environment.as_ref();
        self.labels.environment = environment.and_then(|e| e.group.clone());
        self.labels.materials = self.bindings.groups();
        Ok(Assembled {
            origin: self.origin,
            mesh: self.mesh,
            objects: self.objects,
            placements: self.placements,
            places: self.places,
            object_places: self.object_places,
            materials: self.bindings.finish(self.warnings),
            camera_media,
            lights,
            labels: self.labels,
        })
    }

    /// Leaves one of what is in one place several times.
    fn remove_duplicates(&mut self, lights: &[Light]) {
        let Removed { triangles, lights } =
            duplicates::remove_triangles(&mut self.mesh, lights, &self.labels);
        let copies = &mut self.labels.copies;
        let placements = duplicates::remove_placements(&mut self.placements, copies);
        self.counted("the scene", "triangles", triangles);
        self.counted("the scene", "lights", lights);
        self.counted("the scene", "placements", placements);
    }

    fn counted(&mut self, place: &str, what: &str, count: usize) {
        if count > 0 {
            let warning =
                format!("{place}: {what} that are where equal ones are, left out: {count}");
            self.warnings.push(warning);
        }
    }

    fn too_many_triangles(&self) -> SceneError {
        let message = format!("the scene stores more than {MAX_TRIANGLES} triangles");
        let formats = formats::names(self.formats);
        SceneError::in_file(self.path, message).hint(format!(
            "copies of one {formats} file are stored once unless `share = false` says otherwise"
        ))
    }

    /// A scene of nothing, because it names no geometry or because that has no extent.
    fn no_triangle(&self, names_none: bool) -> SceneError {
        if names_none {
            let error = SceneError::in_file(self.path, "the scene has no geometry");
            return error.hint("add a [[geometry]] entry with `obj = \"file.obj\"`");
        }
        let formats = formats::names(self.formats);
        let message =
            format!("the scene has no geometry: no face of its {formats} files has an area");
        let hint = "all corners of a face lie on a line, or too near for single precision";
        SceneError::in_file(self.path, message).hint(hint)
    }
}
