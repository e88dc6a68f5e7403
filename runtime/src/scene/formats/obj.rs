//! OBJ files: triangles with the names of their materials.
//!
//! tobj parses them, from a normalised copy: by itself it tells no line numbers, takes polylines
//! for faces, invents normals for faces that lack them, and fails on some legal files.

use std::collections::HashMap;
use std::fmt::Write;
use std::io::Read;
use std::path::{Path, PathBuf};

use glam::{DVec2, DVec3, Vec3};
use impasto_compiler::ParameterValue;

use super::{FileMaterial, Format, Geometry, Part, Triangle, Warning, counted, polygon};
use crate::error::SceneError;
use crate::image_file::srgb_to_linear;
use crate::input;

mod mtl;

/// The row of OBJ files.
pub(super) const FORMAT: Format = Format {
    name: "OBJ",
    extensions: &["obj"],
    read,
    without_material: "faces without `usemtl`",
    values: mtl::VALUES,
    values_of: "an MTL file",
};

/// Reads an OBJ file and cuts its faces into triangles.
fn read(base: &Path, name: &str, _: f64) -> Result<Geometry, SceneError> {
    let path = &base.join(name);
    if let Some(other) = other_format(name) {
        let error = SceneError::in_file(path, format!("{other} files are not read"));
        return Err(error.hint("export the geometry as OBJ, PLY, glTF or USD"));
    }
    let bytes = input::read(path).map_err(|e| {
        SceneError::in_file(
            path,
            format!("cannot read the OBJ file: {}", input::reason(&e)),
        )
    })?;
    if bytes.contains(&0) {
        let error = SceneError::in_file(path, "the OBJ file is binary or in UTF-16");
        return Err(error.hint("save it as UTF-8 or ASCII text"));
    }
    let text = String::from_utf8_lossy(&bytes);
    let mut scan = Scan::new(path, text.len());
    for (index, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        scan.line(index + 1, line)?;
    }
    scan.check_ranges()?;
    scan.parts.retain(|part| !part.triangles.is_empty());
    if scan.attributes.is_empty() {
        return Err(SceneError::in_file(path, "the OBJ file has no faces")
            .hint("is it complete? faces are lines that start with `f`"));
    }
    let (triangles, crossing_faces) = parse(&scan)
        .map_err(|e| SceneError::in_file(path, format!("the OBJ file cannot be read: {e}")))?;
    let mut library = Library::load(base, name, &scan.mtl_files);
    let of_faces = |name: String| FileMaterial {
        values: library.materials.remove(&name).unwrap_or_default(),
        name,
    };
    Ok(Geometry {
        triangles,
        materials: scan.materials.into_iter().map(of_faces).collect(),
        parts: scan.parts,
        missing: library.missing,
        libraries: library.files,
        moves: false,
        warnings: [
            counted(
                "faces of fewer than three corners, left out",
                scan.degenerate_faces,
            ),
            counted(
                "faces that cross themselves, cut into triangles that overlap",
                crossing_faces,
            ),
        ]
        .into_iter()
        .flatten()
        .chain(library.warnings)
        .collect(),
    })
}

/// The format of geometry that the extension of `name` tells, if it is one that nothing here reads.
fn other_format(name: &str) -> Option<&'static str> {
    let extension = Path::new(name).extension()?.to_str()?.to_ascii_lowercase();
    Some(match extension.as_str() {
        "fbx" => "FBX",
        "usd" | "usda" | "usdc" | "usdz" => "USD",
        "stl" => "STL",
        "abc" => "Alembic",
        "blend" => "Blender",
        _ => return None,
    })
}

/// What the MTL files of an OBJ file say.
#[derive(Default)]
struct Library {
    /// The values of materials by name. Of materials with one name the last counts.
    materials: HashMap<String, Vec<(&'static str, ParameterValue)>>,
    /// The first MTL file that could not be read.
    missing: Option<SceneError>,
    /// What is odd in those that could be.
    warnings: Vec<Warning>,
    /// All of them.
    files: Vec<PathBuf>,
}

impl Library {
    /// The files that the `mtllib` lines of the OBJ file `name` say. A line may name several, or one
    /// with spaces.
    fn load(base: &Path, name: &str, lines: &[String]) -> Library {
        let folder = Path::new(name).parent().unwrap_or(Path::new(""));
        let mut library = Library::default();
        for line in lines {
            let whole = [line.as_str()];
            let is_one = base.join(folder).join(line).exists();
            let several: Vec<&str> = line.split_whitespace().collect();
            for file in if is_one { &whole[..] } else { &several[..] } {
                library.files.push(base.join(folder).join(file));
                match mtl::load(base, &folder.join(file)) {
                    Ok(mtl) => {
                        let named = mtl.materials.into_iter().map(|m| (m.name, m.values));
                        library.materials.extend(named);
                        library.warnings.extend(mtl.warnings);
                    }
                    Err(error) => library.missing = library.missing.or(Some(error)),
                }
            }
        }
        library
    }
}

/// The three lists that faces index, in the order of indices in `1/2/3`.
const LISTS: [&str; 3] = ["vertex", "texture coordinate", "normal"];

/// The color of vertices that have none in a file in which others have.
const WHITE: &str = " 1 1 1";

/// What a pass over the lines finds.
struct Scan<'p> {
    path: &'p Path,
    /// `v`, `vt` and `vn` lines; faces may come before what they use.
    vertices: String,
    /// `usemtl` lines with an index of `materials`, and `f` lines with absolute indices.
    faces: String,
    counts: [usize; 3],
    /// Do the `v` lines of `vertices` have colors?
    colored: bool,
    /// The largest index into each list, and the line that has it.
    largest: [(usize, usize); 3],
    /// For each triangle whether all corners have texture coordinates and normals.
    attributes: Vec<[bool; 2]>,
    materials: Vec<String>,
    /// What `usemtl` said last, and whether `faces` says so.
    current: String,
    current_written: bool,
    mtl_files: Vec<String>,
    /// What `o` and `g` lines name.
    parts: Vec<Part>,
    /// The object and the group that faces belong to, as indices into `parts`.
    open: [Option<usize>; 2],
    /// Faces with fewer than three corners, which are left out.
    degenerate_faces: usize,
}

impl<'p> Scan<'p> {
    /// Of a file of so many bytes, of which either list may take nearly all. What they do not use is never touched.
    fn new(path: &'p Path, bytes: usize) -> Self {
        Scan {
            path,
            vertices: String::with_capacity(bytes),
            faces: String::with_capacity(bytes),
            counts: [0; 3],
            colored: false,
            largest: [(0, 0); 3],
            attributes: Vec::new(),
            materials: Vec::new(),
            current: String::new(),
            current_written: false,
            mtl_files: Vec::new(),
            parts: Vec::new(),
            open: [None; 2],
            degenerate_faces: 0,
        }
    }

    fn error(&self, line: usize, message: impl Into<String>) -> SceneError {
        SceneError::in_file(self.path, message).line(line)
    }

    fn line(&mut self, number: usize, line: &str) -> Result<(), SceneError> {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.ends_with('\\') {
            let error = self.error(
                number,
                "the line goes on in the next, which is not supported",
            );
            return Err(error.hint("join lines that end in `\\`"));
        }
        let (key, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        match key {
            "v" => self.vertex(number, "v", 0, rest, 3),
            "vt" => self.vertex(number, "vt", 1, rest, 1),
            "vn" => self.vertex(number, "vn", 2, rest, 3),
            "f" => self.face(number, rest),
            "usemtl" => {
                self.current = rest.trim().to_owned();
                self.current_written = false;
                Ok(())
            }
            "o" | "g" => {
                self.part(key, rest.trim());
                Ok(())
            }
            "mtllib" => {
                self.mtl_files.push(rest.trim().replace('\\', "/"));
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Begins an object, which ends the last one and its group, or a group.
    fn part(&mut self, key: &str, name: &str) {
        let index = Some(self.parts.len());
        self.open = match key {
            "o" => [index, None],
            _ => [self.open[0], index],
        };
        let first = self.attributes.len();
        self.parts.push(Part {
            name: name.to_owned(),
            triangles: first..first,
        });
    }

    /// A line of at least `needed` numbers. A fourth number of `v` divides the others, and three more are a
    /// color; third texture coordinates are left out.
    fn vertex(
        &mut self,
        line: usize,
        key: &str,
        list: usize,
        rest: &str,
        needed: usize,
    ) -> Result<(), SceneError> {
        self.counts[list] += 1;
        let what = || format!("{} {}", LISTS[list], self.counts[list]);
        let mut words = [""; 6];
        for (place, word) in words.iter_mut().zip(rest.split_whitespace()) {
            *place = word;
        }
        let has_weight = key == "v" && !words[3].is_empty() && words[4].is_empty();
        let has_color = key == "v" && !words[5].is_empty();
        let kept = match key {
            "vt" => 2,
            _ if has_color => 6,
            _ => 3,
        };
        let read = kept + usize::from(has_weight);
        let mut values = [0.0f64; 6];
        for (found, word) in words[..read].iter().enumerate() {
            if word.is_empty() && found < needed {
                let message = format!("{} has {found} of {needed} numbers", what());
                return Err(self.error(line, message).hint("is the file complete?"));
            }
            let word = if word.is_empty() { "0" } else { word };
            values[found] = word.parse().map_err(|_| {
                let message = format!("{} has `{word}` where a number should be", what());
                self.error(line, message)
            })?;
        }
        let weight = if has_weight { values[3] } else { 1.0 };
        let is_finite = |v: &f64| ((v / weight) as f32).is_finite();
        if !values[..kept].iter().all(is_finite) {
            return Err(self.error(line, format!("{} is not finite: {}", what(), rest.trim())));
        }
        if has_color && !self.colored {
            self.color_before();
        }
        self.vertices += key;
        for (word, value) in words[..kept].iter().zip(values) {
            self.vertices.push(' ');
            match word {
                _ if has_weight => self.vertices += &(value / weight).to_string(),
                &"" => self.vertices.push('0'),
                word => self.vertices += word,
            }
        }
        if key == "v" && self.colored && !has_color {
            self.vertices += WHITE;
        }
        self.vertices.push('\n');
        Ok(())
    }

    /// Gives the vertices before the first one with a color white, since tobj wants all or none.
    fn color_before(&mut self) {
        self.colored = true;
        let mut vertices = String::with_capacity(2 * self.vertices.len());
        for line in self.vertices.lines() {
            vertices += line;
            if line.starts_with("v ") {
                vertices += WHITE;
            }
            vertices.push('\n');
        }
        self.vertices = vertices;
    }

    fn face(&mut self, line: usize, rest: &str) -> Result<(), SceneError> {
        let start = self.faces.len();
        self.write_material();
        self.faces.push('f');
        let (mut corners, mut has) = (0, [true; 2]);
        for word in rest.split_whitespace() {
            let corner = self.corner(line, word)?;
            corners += 1;
            has[0] &= corner[1].is_some();
            has[1] &= corner[2].is_some();
            self.faces.push(' ');
            if corner.iter().all(Option::is_some) && !word.contains('-') {
                self.faces += word;
                continue;
            }
            for (index, separator) in corner.iter().zip(["/", "/", ""]) {
                if let Some(index) = index {
                    let _ = write!(self.faces, "{index}");
                }
                self.faces += separator;
            }
        }
        self.faces.push('\n');
        if corners < 3 {
            self.faces.truncate(start);
            self.current_written = false;
            self.degenerate_faces += 1;
            return Ok(());
        }
        self.attributes
            .extend(std::iter::repeat_n(has, corners - 2));
        for part in self.open.into_iter().flatten() {
            self.parts[part].triangles.end = self.attributes.len();
        }
        Ok(())
    }

    /// Tells tobj the material of what follows, unless it knows.
    fn write_material(&mut self) {
        if self.current_written {
            return;
        }
        let known = self.materials.iter().position(|m| *m == self.current);
        let index = known.unwrap_or(self.materials.len());
        if known.is_none() {
            self.materials.push(self.current.clone());
        }
        let _ = writeln!(self.faces, "usemtl {index}");
        self.current_written = true;
    }

    /// The absolute indices, from 1, of `1/2/3`, `1//3`, `1/2` or `1`.
    fn corner(&mut self, line: usize, word: &str) -> Result<[Option<usize>; 3], SceneError> {
        let mut indices = [None; 3];
        for (list, text) in word.split('/').enumerate() {
            let malformed = || {
                let message = format!("`{word}` is no corner of a face");
                self.error(line, message)
                    .hint("corners are written 1, 1/2, 1//3 or 1/2/3")
            };
            if list > 2 || (list == 0 && text.is_empty()) {
                return Err(malformed());
            }
            if text.is_empty() {
                continue;
            }
            let index: i64 = text.parse().map_err(|_| malformed())?;
            let count = self.counts[list];
            let absolute = match index {
                1.. => usize::try_from(index).ok(),
                _ => usize::try_from(count as i64 + 1 + index)
                    .ok()
                    .filter(|&i| i > 0 && index < 0),
            };
            let Some(absolute) = absolute else {
                return Err(self.out_of_range(line, list, index, count));
            };
            if absolute > self.largest[list].0 {
                self.largest[list] = (absolute, line);
            }
            indices[list] = Some(absolute);
        }
        Ok(indices)
    }

    fn out_of_range(&self, line: usize, list: usize, index: i64, count: usize) -> SceneError {
        let what = LISTS[list];
        let message = format!("the face uses {what} {index}, but the file has {count}");
        self.error(line, message)
            .hint("indices start at 1; negative ones count back from the latest")
    }

    fn check_ranges(&self) -> Result<(), SceneError> {
        for (list, &(index, line)) in self.largest.iter().enumerate() {
            let count = self.counts[list];
            if index > count {
                return Err(self.out_of_range(line, list, index as i64, count));
            }
        }
        Ok(())
    }
}

/// The triangles, and how many faces cross themselves.
fn parse(scan: &Scan) -> Result<(Vec<Triangle>, usize), tobj::LoadError> {
    // The library is made up: it has a material for each index that `faces` uses.
    let names = 0..scan.materials.len();
    let lists = scan.vertices.as_bytes().chain(scan.faces.as_bytes());
    let mut text = b"mtllib all\n".chain(lists);
    let (models, _) = tobj::load_obj_buf(&mut text, &tobj::LoadOptions::default(), |_| {
        let material = |i: usize| tobj::Material {
            name: i.to_string(),
            ..tobj::Material::default()
        };
        let by_name = names.clone().map(|i| (i.to_string(), i)).collect();
        Ok((names.clone().map(material).collect(), by_name))
    })?;
    let mut triangles = Vec::with_capacity(scan.attributes.len());
    let mut crossing = 0;
    for mesh in models.iter().map(|m| &m.mesh) {
        let mut first = 0;
        let mut push = |corners: [usize; 3]| {
            let [has_uv, has_normal] = scan.attributes[triangles.len()];
            triangles.push(triangle(mesh, corners, has_uv, has_normal));
        };
        // Without arities all faces are triangles.
        let faces = match mesh.face_arities.len() {
            0 => mesh.indices.len() / 3,
            faces => faces,
        };
        for face in 0..faces {
            let count = mesh
                .face_arities
                .get(face)
                .map_or(3, |&count| count as usize);
            let corners = first..first + count;
            first += count;
            if count == 3 {
                push([corners.start, corners.start + 1, corners.start + 2]);
                continue;
            }
            let corner = |k: usize| position(mesh, k);
            let cut = polygon::cut(&corners.clone().map(corner).collect::<Vec<_>>());
            crossing += usize::from(cut.crosses);
            let each = cut.triangles.into_iter();
            each.for_each(|triangle| push(triangle.map(|k| corners.start + k)));
        }
    }
    Ok((triangles, crossing))
}

/// Where the corner numbered `k` of a mesh is.
fn position(mesh: &tobj::Mesh, k: usize) -> DVec3 {
    DVec3::from_slice(&mesh.positions[3 * mesh.indices[k] as usize..])
}

/// The triangle of three corners of a mesh.
fn triangle(mesh: &tobj::Mesh, corners: [usize; 3], has_uv: bool, has_normal: bool) -> Triangle {
    let normal = |k: usize| {
        let first = 3 * mesh.normal_indices[k] as usize;
        DVec3::from_slice(&mesh.normals[first..]).as_vec3()
    };
    let pair = |k: usize| {
        let first = 2 * mesh.texcoord_indices[k] as usize;
        DVec2::from_slice(&mesh.texcoords[first..]).as_vec2()
    };
    // Programs write the colors that they show, which are in sRGB.
    let color = |k: usize| {
        let first = 3 * mesh.indices[k] as usize;
        let shown = mesh.vertex_color.get(first..first + 3);
        shown.map_or(Vec3::ONE, |c| {
            DVec3::from_slice(c).map(srgb_to_linear).as_vec3()
        })
    };
    Triangle {
        positions: corners.map(|k| position(mesh, k)),
        normals: has_normal.then(|| corners.map(normal)),
        uvs: has_uv.then(|| corners.map(pair)),
        uvs1: None,
        colors: (!mesh.vertex_color.is_empty()).then(|| corners.map(color)),
        material: mesh.material_id.unwrap_or_default(),
    }
}
