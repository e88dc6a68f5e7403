//! PLY files: what scanners and programs for meshes write.
//!
//! The header says which numbers follow, so the format has as many forms as writers. The reader is our own:
//! ply-rs, the crate for them, calls a setter by name for each number or fills a map of names for each vertex.
//! It takes negative counts for huge ones, and its errors say no place.

use std::path::Path;

use glam::{DVec3, Vec2, Vec3};
use impasto_compiler::ParameterValue;
use rayon::prelude::*;

use self::body::{Ascii, Binary, Body, Entry, entries};
use self::header::{Element, Encoding, Header, Scalar};
use super::{FileMaterial, FileValue, Format, Geometry, Triangle, Warning, counted, polygon};
use crate::error::SceneError;
use crate::image_file::srgb_to_linear;
use crate::input;

mod body;
mod header;
#[cfg(test)]
mod tests;

/// The row of PLY files.
pub(super) const FORMAT: Format = Format {
    name: "PLY",
    extensions: &["ply"],
    read,
    without_material: "the triangles of PLY files",
    values: &[FileValue {
        name: PICTURE,
        fallback: &[],
    }],
    values_of: "a PLY file",
};

/// The value that is the picture of a mesh, as comments of MeshLab and CloudCompare name it.
const PICTURE: &str = "TextureFile";

/// The sets of names that properties go by.
const PLACE: [[&str; 3]; 1] = [["x", "y", "z"]];
const NORMAL: [[&str; 3]; 1] = [["nx", "ny", "nz"]];
const COLOR: [[&str; 3]; 3] = [
    ["red", "green", "blue"],
    ["diffuse_red", "diffuse_green", "diffuse_blue"],
    ["r", "g", "b"],
];
const UV: [[&str; 2]; 4] = [
    ["u", "v"],
    ["s", "t"],
    ["texture_u", "texture_v"],
    ["texture_s", "texture_t"],
];
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];
const CORNER_UVS: [&str; 1] = ["texcoord"];

/// Reads a PLY file and cuts its faces into triangles.
fn read(base: &Path, name: &str, _: f64) -> Result<Geometry, SceneError> {
    let path = &base.join(name);
    let bytes = input::read(path).map_err(|e| {
        let message = format!("cannot read the PLY file: {}", input::reason(&e));
        SceneError::in_file(path, message)
    })?;
    decode(path, name, &bytes)
}

/// What the bytes of the file `name` at `path` say.
fn decode(path: &Path, name: &str, bytes: &[u8]) -> Result<Geometry, SceneError> {
    let header = Header::read(path, bytes)?;
    let mut contents = Contents::new(path);
    match header.encoding {
        Encoding::Ascii => contents.read(&header, Ascii::new(&header, bytes)),
        Encoding::LittleEndian => contents.read(&header, Binary::<false>::new(&header, bytes)),
        Encoding::BigEndian => contents.read(&header, Binary::<true>::new(&header, bytes)),
    }?;
    let (triangles, crossing) = contents.triangles();
    let several = header.pictures.len().saturating_sub(1);
    let warnings = [
        header.unknown,
        counted(
            "faces of fewer than three corners, left out",
            contents.degenerate,
        ),
        counted(
            "faces that cross themselves, cut into triangles that overlap",
            crossing,
        ),
        counted(
            "pictures (`TextureFile`) after the first, not used",
            several,
        ),
        contents.oddity,
    ];
    let named = header.pictures.first();
    let picture = named.and_then(|file| picture(name, file));
    Ok(Geometry {
        triangles,
        materials: vec![FileMaterial {
            name: String::new(),
            values: picture.into_iter().collect(),
        }],
        warnings: warnings.into_iter().flatten().collect(),
        ..Geometry::default()
    })
}

/// The value that is the picture `file` of the mesh in the file `name`.
fn picture(name: &str, file: &str) -> Option<(&'static str, ParameterValue)> {
    let folder = Path::new(name).parent().unwrap_or(Path::new(""));
    let path = folder.join(file.replace('\\', "/"));
    Some((PICTURE, ParameterValue::Texture(path.to_str()?.to_owned())))
}

/// Words of a file for messages, which may be no text and of any length.
fn shown(word: &[u8]) -> String {
    const LONGEST: usize = 40;
    let start = String::from_utf8_lossy(&word[..word.len().min(LONGEST)]);
    let start: String = start.chars().filter(|c| !c.is_control()).collect();
    let rest = if word.len() > LONGEST { "..." } else { "" };
    start + rest
}

/// What is read of a file. Faces may come before the vertices that they use.
#[derive(Debug)]
struct Contents<'p> {
    path: &'p Path,
    /// How many vertices the header promises.
    count: usize,
    vertices: Corners,
    /// Indices of vertices, face after face.
    corners: Vec<u32>,
    /// Where each face ends in `corners`.
    ends: Vec<usize>,
    /// Texture coordinates of each of `corners`, in files that give them to faces; it may be too short.
    corner_uvs: Vec<Option<Vec2>>,
    /// The color of each face, in files that give them to faces; it may be too short.
    face_colors: Vec<Option<Vec3>>,
    /// Faces of fewer than three corners.
    degenerate: usize,
    /// What is odd after the header.
    oddity: Option<Warning>,
}

/// What vertices have; a list is empty if they have no such thing.
#[derive(Debug, Default)]
struct Corners {
    places: Vec<DVec3>,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    colors: Vec<Vec3>,
}

impl<'p> Contents<'p> {
    fn new(path: &'p Path) -> Self {
        Contents {
            path,
            count: 0,
            vertices: Corners::default(),
            corners: Vec::new(),
            ends: Vec::new(),
            corner_uvs: Vec::new(),
            face_colors: Vec::new(),
            degenerate: 0,
            oddity: None,
        }
    }

    fn read(&mut self, header: &Header, mut body: impl Body) -> Result<(), SceneError> {
        self.check(header)?;
        for element in &header.elements {
            match element.name {
                "vertex" => self.vertices(element, &mut body),
                "face" => self.faces(element, &mut body),
                "tristrips" => self.strips(element, &mut body),
                _ => entries(&mut body, self.path, element, |_, _| Ok(())),
            }?;
        }
        self.oddity = body.oddity();
        if self.ends.is_empty() {
            return Err(self.no_faces());
        }
        Ok(())
    }

    /// Fails if the header has nothing that can be rendered.
    fn check(&mut self, header: &Header) -> Result<(), SceneError> {
        let error = |message: &str| Err(SceneError::in_file(self.path, message));
        for name in ["vertex", "face", "tristrips"] {
            let same = header
                .elements
                .iter()
                .filter(|element| element.name == name);
            if same.count() > 1 {
                return error(&format!("the header has two elements `{name}`"));
            }
        }
        let Some(vertices) = header.element("vertex") else {
            return error("the header has no element `vertex`");
        };
        if vertices.numbers(&PLACE).is_none() {
            return error("the vertices lack one of the properties `x`, `y` and `z`");
        }
        if u32::try_from(vertices.count).is_err() {
            return error("the PLY file has more than 2^32 vertices");
        }
        self.count = vertices.count;
        let faces = ["face", "tristrips"].map(|name| header.element(name));
        let mut faces = faces
            .into_iter()
            .flatten()
            .filter(|e| e.count > 0)
            .peekable();
        if faces.peek().is_none() {
            return Err(self.no_faces());
        }
        match faces.find(|element| element.list(&CORNERS).is_none()) {
            Some(Element { name, .. }) => error(&format!(
                "the element `{name}` has no list `vertex_indices`"
            )),
            None => Ok(()),
        }
    }

    fn no_faces(&self) -> SceneError {
        SceneError::in_file(self.path, "the PLY file has no faces")
            .hint("points alone are not rendered; a program such as MeshLab makes a mesh of them")
    }

    fn vertices(&mut self, element: &Element, body: &mut impl Body) -> Result<(), SceneError> {
        let (normal, uv) = (element.numbers(&NORMAL), element.numbers(&UV));
        let place = element.numbers(&PLACE).unwrap_or_default();
        let color = Color::of(element);
        let vertices = &mut self.vertices;
        entries(body, self.path, element, |index, entry| {
            let error = |what: &str| format!("the {what} of vertex {index} is not finite");
            let at = DVec3::from(place.map(|property| entry.number(property)));
            if !at.as_vec3().is_finite() {
                return Err(error("place"));
            }
            vertices.places.push(at);
            if let Some(normal) = normal {
                let normal = vec3(entry, normal).ok_or_else(|| error("normal"))?;
                vertices.normals.push(normal);
            }
            if let Some([u, v]) = uv {
                let uv = vec2(entry.number(u), entry.number(v));
                vertices
                    .uvs
                    .push(uv.ok_or_else(|| error("texture coordinate"))?);
            }
            if let Some(color) = &color {
                let color = color.read(entry).ok_or_else(|| error("color"))?;
                vertices.colors.push(color);
            }
            Ok(())
        })
    }

    fn faces(&mut self, element: &Element, body: &mut impl Body) -> Result<(), SceneError> {
        let corners = element.list(&CORNERS).unwrap_or_default();
        let uvs = element.list(&CORNER_UVS);
        let color = Color::of(element);
        entries(body, self.path, element, |index, entry| {
            let corners = entry.list(corners);
            if corners.len() < 3 {
                self.degenerate += 1;
                return Ok(());
            }
            let first = self.corners.len();
            for &corner in corners {
                let vertex = vertex(corner, self.count);
                self.corners
                    .push(vertex.ok_or_else(|| self.out_of_range("face", index, corner))?);
            }
            if let Some(uvs) = uvs {
                self.corner_uvs(first, index, entry.list(uvs))?;
            }
            if let Some(color) = &color {
                let color = color.read(entry);
                let color =
                    color.ok_or_else(|| format!("the color of face {index} is not finite"))?;
                self.face_colors.resize(self.ends.len(), None);
                self.face_colors.push(Some(color));
            }
            self.ends.push(self.corners.len());
            Ok(())
        })
    }

    /// Takes the texture coordinates of a face for its corners, which are those from `first` on. A face may
    /// have none.
    fn corner_uvs(&mut self, first: usize, face: usize, uvs: &[f64]) -> Result<(), String> {
        let corners = self.corners.len() - first;
        if uvs.is_empty() {
            return Ok(());
        }
        if uvs.len() != 2 * corners {
            let found = uvs.len();
            return Err(format!(
                "face {face} has {found} numbers in `texcoord`, but two for each of {corners} corners are needed"
            ));
        }
        self.corner_uvs.resize(first, None);
        for pair in uvs.chunks_exact(2) {
            let uv = vec2(pair[0], pair[1]);
            let error = || format!("the texture coordinate of face {face} is not finite");
            self.corner_uvs.push(Some(uv.ok_or_else(error)?));
        }
        Ok(())
    }

    /// Triangle strips: each index after the second makes a triangle with the two before it, and -1 begins
    /// the next strip. Every other triangle is the other way around.
    fn strips(&mut self, element: &Element, body: &mut impl Body) -> Result<(), SceneError> {
        let corners = element.list(&CORNERS).unwrap_or_default();
        entries(body, self.path, element, |index, entry| {
            let (mut last, mut is_odd) = ([None; 2], false);
            for &corner in entry.list(corners) {
                if corner == -1.0 {
                    (last, is_odd) = ([None; 2], false);
                    continue;
                }
                let vertex = vertex(corner, self.count);
                let c = vertex.ok_or_else(|| self.out_of_range("strip", index, corner))?;
                if let [Some(a), Some(b)] = last {
                    // Strips turn by triangles without area.
                    if a != b && b != c && c != a {
                        self.corners
                            .extend(if is_odd { [b, a, c] } else { [a, b, c] });
                        self.ends.push(self.corners.len());
                    }
                    is_odd = !is_odd;
                }
                last = [last[1], Some(c)];
            }
            Ok(())
        })
    }

    fn out_of_range(&self, what: &str, index: usize, corner: f64) -> String {
        let count = self.count;
        format!("{what} {index} uses vertex {corner}, but the file has {count}, counted from 0")
    }

    /// The triangles, and how many faces cross themselves.
    fn triangles(&self) -> (Vec<Triangle>, usize) {
        let faces = self.ends.len();
        if self.corners.len() == 3 * faces {
            let color = |face: usize| self.face_colors.get(face).copied().flatten();
            let triangle = |face| self.triangle([0, 1, 2].map(|k| 3 * face + k), color(face));
            return ((0..faces).into_par_iter().map(triangle).collect(), 0);
        }
        let mut triangles = Vec::with_capacity(self.corners.len() - 2 * self.ends.len());
        let mut crossing = 0;
        let mut first = 0;
        for (face, &end) in self.ends.iter().enumerate() {
            let color = self.face_colors.get(face).copied().flatten();
            if end - first == 3 {
                triangles.push(self.triangle([first, first + 1, first + 2], color));
            } else {
                let outline: Vec<DVec3> = (first..end).map(|corner| self.place(corner)).collect();
                let cut = polygon::cut(&outline);
                crossing += usize::from(cut.crosses);
                let each = cut.triangles.into_iter();
                triangles.extend(each.map(|t| self.triangle(t.map(|k| first + k), color)));
            }
            first = end;
        }
        (triangles, crossing)
    }

    /// Where the corner with an index into `corners` is.
    fn place(&self, corner: usize) -> DVec3 {
        self.vertices.places[self.corners[corner] as usize]
    }

    /// The triangle of three of `corners`, of a face of this color.
    fn triangle(&self, corners: [usize; 3], color: Option<Vec3>) -> Triangle {
        let vertices = corners.map(|corner| self.corners[corner] as usize);
        let own = corners.map(|corner| self.corner_uvs.get(corner).copied().flatten());
        let own = match own {
            [Some(a), Some(b), Some(c)] => Some([a, b, c]),
            _ => None,
        };
        let colors = of_vertices(&self.vertices.colors, vertices);
        Triangle {
            positions: vertices.map(|vertex| self.vertices.places[vertex]),
            normals: of_vertices(&self.vertices.normals, vertices),
            uvs: own.or_else(|| of_vertices(&self.vertices.uvs, vertices)),
            uvs1: None,
            colors: colors.or(color.map(|color| [color; 3])),
            material: 0,
        }
    }
}

/// What three vertices have of a list, which may be empty.
fn of_vertices<T: Copy>(list: &[T], vertices: [usize; 3]) -> Option<[T; 3]> {
    (!list.is_empty()).then(|| vertices.map(|vertex| list[vertex]))
}

/// The index that a number of a list is, if there are so many vertices.
fn vertex(corner: f64, count: usize) -> Option<u32> {
    let is_index = corner >= 0.0 && corner < count as f64 && corner.fract() == 0.0;
    is_index.then_some(corner as u32)
}

fn vec2(x: f64, y: f64) -> Option<Vec2> {
    Some(Vec2::new(x as f32, y as f32)).filter(|v| v.is_finite())
}

fn vec3(entry: &Entry, properties: [usize; 3]) -> Option<Vec3> {
    let [x, y, z] = properties.map(|property| entry.number(property) as f32);
    Some(Vec3::new(x, y, z)).filter(|v| v.is_finite())
}

/// Three properties that are a color. Whole numbers are in sRGB, as programs show them; those with a fraction
/// are linear, as programs compute with them.
#[derive(Debug)]
struct Color {
    properties: [usize; 3],
    /// The linear value of each whole number, from black to white; empty for numbers with a fraction.
    linear: Vec<f32>,
}

impl Color {
    /// The color of the entries of an element, if they have one.
    fn of(element: &Element) -> Option<Color> {
        let properties = element.numbers(&COLOR)?;
        let white = match element.properties[properties[0]].scalar {
            Scalar::Float32 | Scalar::Float64 => None,
            Scalar::Uint16 => Some(u16::MAX),
            // Types of more bits than needed hold what fits in eight.
            _ => Some(255),
        };
        let linear = |white: u16| {
            let value = |shown: u16| srgb_to_linear(f64::from(shown) / f64::from(white)) as f32;
            (0..=white).map(value).collect()
        };
        Some(Color {
            properties,
            linear: white.map(linear).unwrap_or_default(),
        })
    }

    /// The color of an entry, linear RGB, if it is finite.
    fn read(&self, entry: &Entry) -> Option<Vec3> {
        if self.linear.is_empty() {
            return vec3(entry, self.properties);
        }
        // The conversion saturates.
        let linear = |value: f64| self.linear[(value as usize).min(self.linear.len() - 1)];
        let channels = self
            .properties
            .map(|property| linear(entry.number(property)));
        Some(Vec3::from(channels))
    }
}
