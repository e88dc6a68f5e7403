//! Where a geometry file is placed: the transform of a `[[geometry]]` entry, and its `placements`,
//! listed in the scene or in a file of their own. `docs/scenes.md` describes both.

use std::path::Path;

use glam::{DVec3, Vec3};
use toml::de::DeValue;

use super::Transform;
use super::animation::{Moment, mix_places, turntable};
use super::description::MaterialName;
use super::document::{Table, Value, list};
use crate::error::{Excerpt, SceneError};
use crate::input;

/// Most placements of one entry, and of a scene.
pub(super) const MAX_PLACEMENTS: usize = 1 << 24;

/// What makes a transform useless, and what to do.
const SINGULAR: &str = "flattens what it places";
const SINGULAR_HINT: &str =
    "no direction may be scaled to nothing, or a million times less than another";

/// Where a geometry file is placed, relative to its entry.
#[derive(Default)]
pub(super) struct Places {
    pub(super) list: Vec<Place>,
    /// The materials that some of them name.
    pub(super) materials: Vec<MaterialName>,
}

/// One of them.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub(super) transform: Transform,
    /// Index into [`Places::materials`], of those that do not use the entry's own.
    pub(super) material: Option<usize>,
}

/// What an entry says of its places.
pub(super) enum PlacesSpec {
    Listed(Places),
    /// The name of a file, and where the scene says it.
    File(String, Box<Excerpt>),
}

impl Places {
    /// A single place, where the entry itself is.
    fn here() -> Places {
        Places {
            list: vec![Place {
                transform: Transform::default(),
                material: None,
            }],
            materials: Vec::new(),
        }
    }

    /// The index of the material called `name`, whose error `missing` makes if it is not there.
    fn material(&mut self, name: &str, missing: impl FnOnce(String) -> SceneError) -> usize {
        let known = self.materials.iter().position(|m| m.name == name);
        known.unwrap_or_else(|| {
            self.materials.push(MaterialName {
                name: name.to_owned(),
                missing: missing(format!("no material is called `{name}`")),
            });
            self.materials.len() - 1
        })
    }
}

/// The transform that a table's keys describe.
pub(super) fn transform(table: &mut Table, moment: Moment) -> Result<Transform, SceneError> {
    let matrix = table.get("matrix");
    let parts = ["scale", "rotate", "translate"].map(|key| table.get(key));
    let [scale_value, rotate_value, translate_value] = &parts;
    let mut keys = Moment::keys(table, "a placed object")?;
    let transform = match &matrix {
        Some(_) if keys.is_some() || parts.iter().any(Option::is_some) => {
            let error = table.error("`matrix` leaves no room for `scale`, `rotate` or `translate`");
            return Err(error.hint("write either the matrix or its parts"));
        }
        Some(rows) => {
            Transform::from_rows(rows.array("twelve finite numbers: three rows of four")?)
        }
        None => {
            let vector = |value: &Option<Value>| {
                value
                    .as_ref()
                    .map_or(Ok(DVec3::ZERO), |value| value.place())
            };
            let given = scale_value.as_ref().map_or(Ok(Vec3::ONE), scale)?;
            let mix = |a: &Vec3, b: &Vec3, t: f64| a.lerp(*b, t as f32);
            let scale = moment.keyed(&mut keys, "scale", scale, mix, given)?;
            let mut keyed = |name, value| {
                let given = vector(value)?;
                moment.keyed(&mut keys, name, Value::place, mix_places, given)
            };
            let rotate = keyed("rotate", rotate_value)?.as_vec3();
            let translate = keyed("translate", translate_value)?;
            Transform::new(scale, rotate, Vec3::ZERO).moved(translate)
        }
    };
    keys.map_or(Ok(()), Table::finish)?;
    let turn = turntable(table, moment, transform.translation)?;
    let transform = transform.then(&turn);
    if transform.is_invertible() {
        return Ok(transform);
    }
    let error = match matrix {
        Some(rows) => rows.error(format!("the matrix {SINGULAR}")),
        None => table.error(format!("the scale {SINGULAR}")),
    };
    Err(error.hint(SINGULAR_HINT))
}

/// A factor, or one an axis. Negative ones mirror.
fn scale(value: &Value) -> Result<Vec3, SceneError> {
    let scale = match value.item() {
        DeValue::Array(_) => value.vector().ok(),
        _ => value.float().ok().map(Vec3::splat),
    };
    let scale = scale.filter(|s| s.to_array().iter().all(|&v| v != 0.0));
    scale.ok_or_else(|| value.mismatch("a number or [x, y, z], none of them 0"))
}

/// The `placements` of an entry: a list, or the name of a file.
pub(super) fn places(table: &mut Table, moment: Moment) -> Result<PlacesSpec, SceneError> {
    let Some(value) = table.get("placements") else {
        return Ok(PlacesSpec::Listed(Places::here()));
    };
    if let DeValue::String(file) = value.item() {
        return Ok(PlacesSpec::File(
            file.as_ref().to_owned(),
            Box::new(value.excerpt()),
        ));
    }
    let expected = "a list of tables, or the name of a file";
    let mut places = Places::default();
    for mut table in value.list_of_tables("a placement", expected)? {
        let transform = transform(&mut table, moment)?;
        let material = match table.get("material") {
            Some(value) => Some(places.material(value.string()?, |m| value.error(m))),
            None => None,
        };
        table.finish()?;
        places.list.push(Place {
            transform,
            material,
        });
    }
    if places.list.is_empty() {
        return Err(value.mismatch("a list with something in it"));
    }
    Ok(PlacesSpec::Listed(places))
}

/// Columns that hold numbers, in the order of [`Line::numbers`], and what they are if left out.
const COLUMNS: [(&str, f64); 22] = [
    ("x", 0.0),
    ("y", 0.0),
    ("z", 0.0),
    ("rx", 0.0),
    ("ry", 0.0),
    ("rz", 0.0),
    ("sx", 1.0),
    ("sy", 1.0),
    ("sz", 1.0),
    ("scale", 1.0),
    ("m00", 1.0),
    ("m01", 0.0),
    ("m02", 0.0),
    ("m03", 0.0),
    ("m10", 0.0),
    ("m11", 1.0),
    ("m12", 0.0),
    ("m13", 0.0),
    ("m20", 0.0),
    ("m21", 0.0),
    ("m22", 1.0),
    ("m23", 0.0),
];
/// The first column of a matrix.
const MATRIX: usize = 10;
/// The column of names. A dash in it leaves the entry's material.
const MATERIAL: &str = "material";

/// Reads a file of places: a line that names the columns, then a line a place.
pub(super) fn read_file(path: &Path) -> Result<Places, SceneError> {
    let bytes = input::read(path).map_err(|e| {
        SceneError::in_file(
            path,
            format!("cannot read the placements: {}", input::reason(&e)),
        )
    })?;
    let text = String::from_utf8(bytes)
        .map_err(|_| SceneError::in_file(path, "the placements are not UTF-8 text"))?;
    let lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    let mut lines = lines
        .map(|(index, line)| (index + 1, line.split('#').next().unwrap_or_default()))
        .filter(|(_, line)| words(line).next().is_some());
    let mut places = Places::default();
    if let Some((number, line)) = lines.next() {
        let header = Header::read(path, number, line)?;
        for (number, line) in lines {
            let place = header.place(path, number, line, &mut places)?;
            places.list.push(place);
            if places.list.len() > MAX_PLACEMENTS {
                return Err(too_many(path));
            }
        }
    }
    if places.list.is_empty() {
        return Err(SceneError::in_file(path, "the file places nothing").hint(
            "its first line names columns, such as `x y z ry scale`; then each line is a place",
        ));
    }
    Ok(places)
}

/// The error for more placements than there can be.
pub(super) fn too_many(path: &Path) -> SceneError {
    let message = format!("there are more than {MAX_PLACEMENTS} placements");
    SceneError::in_file(path, message).hint("make objects of several copies, and place those")
}

fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c: char| c.is_whitespace() || c == ',')
        .filter(|word| !word.is_empty())
}

/// What each column holds: an index into [`COLUMNS`], or none for the material.
struct Header {
    columns: Vec<Option<usize>>,
    has_matrix: bool,
}

impl Header {
    fn read(path: &Path, number: usize, line: &str) -> Result<Header, SceneError> {
        let error = |message: String| SceneError::in_file(path, message).line(number);
        let mut columns = Vec::new();
        for word in words(line) {
            let column = COLUMNS.iter().position(|(name, _)| *name == word);
            if column.is_none() && word != MATERIAL {
                let known = COLUMNS[..MATRIX].iter().map(|(name, _)| *name);
                let known = list(known.chain([MATERIAL]));
                return Err(
                    error(format!("`{word}` is no column of placements")).hint(format!(
                        "the first line names columns: {known}, or m00 to m23"
                    )),
                );
            }
            if columns.contains(&column) {
                return Err(error(format!("the column `{word}` is there twice")));
            }
            columns.push(column);
        }
        let of_matrix = |range: std::ops::Range<usize>| {
            columns
                .iter()
                .flatten()
                .filter(|&&c| range.contains(&c))
                .count()
        };
        let (parts, entries) = (of_matrix(0..MATRIX), of_matrix(MATRIX..COLUMNS.len()));
        if entries > 0 && (parts > 0 || entries < COLUMNS.len() - MATRIX) {
            return Err(error(
                "a matrix needs all of m00 to m23, and nothing beside them".into(),
            ));
        }
        Ok(Header {
            columns,
            has_matrix: entries > 0,
        })
    }

    /// The place that a line describes.
    fn place(
        &self,
        path: &Path,
        number: usize,
        line: &str,
        places: &mut Places,
    ) -> Result<Place, SceneError> {
        let error = |message: String| SceneError::in_file(path, message).line(number);
        let found = words(line).count();
        if found != self.columns.len() {
            let expected = self.columns.len();
            return Err(error(format!(
                "the line has {found} values for {expected} columns"
            )));
        }
        let mut numbers = COLUMNS.map(|(_, default)| default);
        let mut material = None;
        for (column, word) in self.columns.iter().zip(words(line)) {
            match column {
                Some(column) => {
                    let value = word.parse().ok();
                    let value = value.filter(|v: &f64| (*v as f32).is_finite());
                    let name = COLUMNS[*column].0;
                    let message =
                        || error(format!("`{word}` in column `{name}` is no finite number"));
                    numbers[*column] = value.ok_or_else(message)?;
                }
                None if word == "-" => {}
                None => material = Some(places.material(word, error)),
            }
        }
        let transform = self.transform(&numbers);
        if !transform.is_invertible() {
            return Err(error(format!("the line {SINGULAR}")).hint(SINGULAR_HINT));
        }
        Ok(Place {
            transform,
            material,
        })
    }

    fn transform(&self, numbers: &[f64; COLUMNS.len()]) -> Transform {
        let [x, y, z, rx, ry, rz, sx, sy, sz, scale, rows @ ..] = *numbers;
        if self.has_matrix {
            return Transform::from_rows(rows);
        }
        let scale = scale * DVec3::new(sx, sy, sz);
        let rotate = DVec3::new(rx, ry, rz);
        Transform::new(scale.as_vec3(), rotate.as_vec3(), Vec3::ZERO).moved(DVec3::new(x, y, z))
    }
}
