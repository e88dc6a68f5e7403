//! What a scene file says, before any file that it names is read. `docs/scenes.md` describes the
//! format.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DVec3, Vec3};
use impasto_compiler::diag::nearest;
use impasto_compiler::{ParameterValue, Written};
use toml::de::DeValue;

use super::animation::{Animation, Moment, mix_places, mix_values, turntable};
use super::document::{Document, Table, Value, list, number, numbers};
use super::formats::{self, FileValue, Format};
use super::placements::{self, PlacesSpec};
use super::{
    Camera, FilmSettings, GivenParam, Integrator, Light, LightReader, MAX_NESTED, Transform,
};
use crate::error::{Excerpt, SceneError};

/// Pixels a side of the largest film.
const MAX_FILM: u32 = 16_384;
/// Longest path that can be asked for.
const MAX_DEPTH: u32 = 65_535;

pub(super) struct Description<'f> {
    pub(super) name: Option<String>,
    pub(super) camera: CameraSpec,
    /// Materials whose interiors the camera is in, outermost first.
    pub(super) camera_media: Vec<MaterialName>,
    pub(super) film: FilmSettings,
    pub(super) integrator: Integrator,
    pub(super) geometry: Vec<GeometrySpec<'f>>,
    pub(super) materials: Vec<MaterialSpec>,
    pub(super) lights: Vec<LightSpec>,
    pub(super) environment: Option<EnvironmentSpec>,
    pub(super) animation: Animation,
}

/// The camera, and where it is and looks at in the world.
pub(super) struct CameraSpec {
    camera: Camera,
    position: DVec3,
    look_at: DVec3,
}

impl CameraSpec {
    /// The camera in coordinates that count from `origin`.
    pub(super) fn seen_from(&self, origin: DVec3) -> Camera {
        Camera {
            position: (self.position - origin).as_vec3(),
            look_at: (self.look_at - origin).as_vec3(),
            ..self.camera
        }
    }
}

/// A light, and where in the world it is if it has a place.
pub(super) struct LightSpec {
    light: Light,
    place: Option<DVec3>,
    /// The group that it is in.
    pub(super) group: Option<String>,
}

impl LightSpec {
    /// The light in coordinates that count from `origin`.
    pub(super) fn seen_from(&self, origin: DVec3) -> Light {
        match self.place {
            Some(place) => self.light.put_at((place - origin).as_vec3()),
            None => self.light.clone(),
        }
    }

    /// The corners of a light with a surface.
    pub(super) fn corners(&self) -> Vec<DVec3> {
        self.place
            .map_or_else(Vec::new, |place| self.light.corners(place))
    }
}

/// The name of a material where something uses it.
#[derive(Clone)]
pub(super) struct MaterialName {
    pub(super) name: String,
    /// The error for a material of that name that does not exist, without hint.
    pub(super) missing: SceneError,
}

/// A `[[geometry]]` entry.
pub(super) struct GeometrySpec<'f> {
    pub(super) file: String,
    pub(super) format: &'f Format,
    /// Where the scene names the file.
    pub(super) named: Excerpt,
    /// Where its second texture coordinates are.
    pub(super) uv1: Option<SecondUvs<'f>>,
    /// From the geometry file to where its places count from.
    pub(super) transform: Transform,
    /// Material of all its faces, whatever the file says.
    pub(super) material: Option<MaterialName>,
    pub(super) places: PlacesSpec,
    /// Is it stored once for all of its places? Decided by size if not said.
    pub(super) share: Option<bool>,
}

/// A file of the same triangles, whose texture coordinates are the second of another.
pub(super) struct SecondUvs<'f> {
    pub(super) file: String,
    pub(super) named: Excerpt,
    pub(super) format: &'f Format,
}

/// What geometry is read from: a file, and the one with its second texture coordinates.
pub(super) type SourceName = (String, Option<String>);

impl GeometrySpec<'_> {
    /// What it is read from.
    pub(super) fn source(&self) -> SourceName {
        let second = self.uv1.as_ref().map(|second| second.file.clone());
        (self.file.clone(), second)
    }
}

/// A `[materials.NAME]` entry.
pub(super) struct MaterialSpec {
    pub(super) name: String,
    pub(super) file: String,
    pub(super) material: Option<String>,
    pub(super) params: Vec<(String, ParamSpec)>,
    /// Do keys give some of them?
    pub(super) has_keys: bool,
    pub(super) bake: bool,
    /// The group that its light is in, if it emits.
    pub(super) group: Option<String>,
    /// Where all this is said.
    pub(super) written: Arc<Written>,
}

/// Where a parameter's value comes from.
pub(super) enum ParamSpec {
    /// The scene itself.
    Given(ParameterValue),
    /// What the geometry file says of the material that the binding is used for.
    OfFile(&'static FileValue),
}

/// The `[environment]` table.
pub(super) struct EnvironmentSpec {
    pub(super) source: EnvironmentSpecSource,
    pub(super) scale: f32,
    pub(super) rotate: f32,
    pub(super) sample: bool,
    /// The group that it is in.
    pub(super) group: Option<String>,
}

pub(super) enum EnvironmentSpecSource {
    File(String, Excerpt),
    Color(Vec3),
}

impl<'f> Description<'f> {
    /// Reads a scene whose geometry is of some of the given formats, with `readers` for its lights, as it is at a
    /// `frame`.
    pub(super) fn read(
        document: &Document,
        formats: &'f [Format],
        readers: &[LightReader],
        frame: f64,
    ) -> Result<Description<'f>, SceneError> {
        let parsed = document.parse()?;
        let mut root = Table::new(document, "the scene", &parsed);
        let name = root.get("name").map(|v| v.string().map(str::to_owned));
        let animation = Animation::read(&mut root)?;
        let smooth = animation.smooth;
        let moment = Moment { frame, smooth };
        let (camera, camera_media) = camera(&mut root, moment)?;
        let description = Description {
            name: name.transpose()?,
            camera,
            camera_media,
            film: film(&mut root)?,
            integrator: integrator(&mut root)?,
            geometry: geometry(&mut root, formats, moment)?,
            materials: materials(&mut root, formats, moment)?,
            lights: lights(&mut root, readers, moment)?,
            environment: environment(&mut root)?,
            animation,
        };
        root.finish()?;
        Ok(description)
    }

    /// Puts values into the parameters of bindings.
    ///
    /// # Errors
    /// If there is no binding of a name.
    pub(super) fn give(&mut self, given: &[GivenParam]) -> Result<(), SceneError> {
        for GivenParam {
            binding,
            param,
            value,
            origin,
        } in given
        {
            let Some(spec) = self.materials.iter_mut().find(|m| m.name == *binding) else {
                let names = || self.materials.iter().map(|m| m.name.as_str());
                let message = format!("{origin}: the scene has no material `{binding}`");
                let hint = match nearest(binding, names()) {
                    Some(near) => format!("did you mean `{near}`?"),
                    None => format!("its materials are {}", list(names())),
                };
                return Err(SceneError::new(message).hint(hint));
            };
            spec.params.retain(|(name, _)| name != param);
            let value = ParameterValue::From(origin.clone(), Box::new(value.clone()));
            spec.params.push((param.clone(), ParamSpec::Given(value)));
        }
        Ok(())
    }

    /// The files that it names, materials apart.
    pub(super) fn files(&self, base: &Path) -> Vec<PathBuf> {
        let geometry = self.geometry.iter().map(|entry| &entry.file);
        let second = self.geometry.iter().filter_map(|entry| entry.uv1.as_ref());
        let geometry = geometry.chain(second.map(|second| &second.file));
        let places = self
            .geometry
            .iter()
            .filter_map(|entry| match &entry.places {
                PlacesSpec::File(file, _) => Some(file),
                PlacesSpec::Listed(_) => None,
            });
        let environment = self.environment.iter().filter_map(|e| match &e.source {
            EnvironmentSpecSource::File(file, _) => Some(file),
            EnvironmentSpecSource::Color(_) => None,
        });
        let all = geometry.chain(places).chain(environment);
        all.map(|file| base.join(file)).collect()
    }
}

fn camera(root: &mut Table, moment: Moment) -> Result<(CameraSpec, Vec<MaterialName>), SceneError> {
    let hint = "add a [camera] table with `position`, `look_at` and `fov`";
    let value = root.require("camera").map_err(|e| e.or_hint(hint))?;
    let mut table = value.table("[camera]")?;
    let mut keys = Moment::keys(&mut table, "[camera]")?;
    let mut place = |table: &mut Table, name: &'static str| {
        let given = table.require(name)?.place()?;
        moment.keyed(&mut keys, name, Value::place, mix_places, given)
    };
    let position = place(&mut table, "position")?;
    let look_at = place(&mut table, "look_at")?;
    let turn = turntable(&mut table, moment, look_at)?;
    let (position, look_at) = (turn.place(position), turn.place(look_at));
    let up = optional(&mut table, "up", Value::vector, Vec3::Y)?;
    let mix = |a: &Vec3, b: &Vec3, t: f64| a.lerp(*b, t as f32);
    let up = moment.keyed(&mut keys, "up", Value::vector, mix, up)?;
    let fov = table.require("fov")?;
    let angle = |v: &Value| {
        let expected = "an angle in degrees between 0 and 180";
        v.float_where(expected, |v| v > 0.0 && v < 180.0)
    };
    let mix = |a: &f32, b: &f32, t: f64| (f64::from(*a) * (1.0 - t) + f64::from(*b) * t) as f32;
    let fov = moment.keyed(&mut keys, "fov", angle, mix, angle(&fov)?)?;
    let aperture = |v: &Value| v.float_where("a diameter, 0 or more", |v| v >= 0.0);
    let given = optional(&mut table, "aperture", aperture, 0.0)?;
    let aperture = moment.keyed(&mut keys, "aperture", aperture, mix, given)?;
    let focus = |v: &Value| v.float_where("a distance above 0", |v| v > 0.0);
    let distance = position.distance(look_at) as f32;
    let given = optional(&mut table, "focus", focus, distance)?;
    let focus = moment.keyed(&mut keys, "focus", focus, mix, given)?;
    keys.map_or(Ok(()), Table::finish)?;
    let media = table.get("medium").map(|v| camera_media(&v)).transpose()?;
    let spec = CameraSpec {
        camera: Camera {
            position: Vec3::ZERO,
            look_at: (look_at - position).as_vec3(),
            up,
            fov,
            aperture,
            focus,
        },
        position,
        look_at,
    };
    if spec.camera.look_at == Vec3::ZERO {
        return Err(table
            .error("[camera] looks at its own position")
            .hint("`position` and `look_at` must differ"));
    }
    if spec.camera.basis()[0] == Vec3::ZERO {
        return Err(table
            .error("`up` of [camera] is zero or along the view")
            .hint("choose an `up` that is not parallel to `look_at` - `position`"));
    }
    table.finish()?;
    Ok((spec, media.unwrap_or_default()))
}

/// One name, or several from the outermost medium inwards.
fn camera_media(value: &Value) -> Result<Vec<MaterialName>, SceneError> {
    let expected = format!("the name of a material, or an array of at most {MAX_NESTED}");
    let names: Option<Vec<&str>> = match value.item() {
        DeValue::Array(items) => items.iter().map(|i| i.get_ref().as_str()).collect(),
        item => item.as_str().map(|name| vec![name]),
    };
    let names = names.filter(|names| names.len() <= MAX_NESTED);
    let names = names.ok_or_else(|| value.mismatch(&expected))?;
    let medium = |name: &str| MaterialName {
        name: name.to_owned(),
        missing: value.error(format!("no material is called `{name}`")),
    };
    Ok(names.into_iter().map(medium).collect())
}

fn film(root: &mut Table) -> Result<FilmSettings, SceneError> {
    let mut film = FilmSettings {
        width: 1024,
        height: 768,
    };
    if let Some(value) = root.get("film") {
        let mut table = value.table("[film]")?;
        film.width = table.require("width")?.integer(1..=MAX_FILM)?;
        film.height = table.require("height")?.integer(1..=MAX_FILM)?;
        table.finish()?;
    }
    Ok(film)
}

fn integrator(root: &mut Table) -> Result<Integrator, SceneError> {
    let mut integrator = Integrator {
        max_depth: 16,
        roulette_start: 4,
    };
    if let Some(value) = root.get("integrator") {
        let mut table = value.table("[integrator]")?;
        let depth = |v: &Value| v.integer(1..=MAX_DEPTH);
        integrator.max_depth = optional(&mut table, "max_depth", depth, integrator.max_depth)?;
        let start = |v: &Value| v.integer(0..=MAX_DEPTH);
        integrator.roulette_start = optional(
            &mut table,
            "roulette_start",
            start,
            integrator.roulette_start,
        )?;
        table.finish()?;
    }
    Ok(integrator)
}

fn geometry<'f>(
    root: &mut Table,
    formats: &'f [Format],
    moment: Moment,
) -> Result<Vec<GeometrySpec<'f>>, SceneError> {
    let Some(value) = root.get("geometry") else {
        return Ok(Vec::new());
    };
    let named = |v: &Value| -> Result<Option<MaterialName>, SceneError> {
        let name = v.string()?.to_owned();
        let missing = v.error(format!("no material is called `{name}`"));
        Ok(Some(MaterialName { name, missing }))
    };
    let entry = |mut table: Table| {
        let (file, place, format) = geometry_file(&mut table, formats)?;
        let spec = GeometrySpec {
            file,
            named: place,
            format,
            uv1: second_uvs(&mut table, formats)?,
            transform: placements::transform(&mut table, moment)?,
            material: optional(&mut table, "material", named, None)?,
            places: placements::places(&mut table, moment)?,
            share: optional(&mut table, "share", |v| v.boolean().map(Some), None)?,
        };
        table.finish()?;
        Ok(spec)
    };
    value.tables("geometry")?.into_iter().map(entry).collect()
}

/// Keys beside `file` that name a geometry file. An extension that tells no other format is of the format of that
/// extension.
const FORMAT_KEYS: [&str; 2] = ["obj", "gltf"];

/// The file that an entry names, where it does, and its format.
fn geometry_file<'f>(
    table: &mut Table,
    formats: &'f [Format],
) -> Result<(String, Excerpt, &'f Format), SceneError> {
    let file = table.get("file").map(|value| (value, None));
    let named = FORMAT_KEYS.map(|key| {
        let format = formats::of_extension(formats, key);
        table.get(key).map(|value| (value, format))
    });
    let mut all = file.into_iter().chain(named.into_iter().flatten());
    let (value, otherwise) = match (all.next(), all.next()) {
        (Some(one), None) => one,
        (None, _) => return Err(no_file(table)),
        (Some(_), Some(_)) => {
            let message = "[[geometry]] needs one of `file`, `obj` and `gltf`";
            return Err(table.error(message));
        }
    };
    let name = value.string()?;
    match formats::of_file(formats, name).or(otherwise) {
        Some(format) => Ok((name.to_owned(), value.excerpt(), format)),
        None => Err(unreadable(&value, name, formats)),
    }
}

/// The error for an entry that names no file: one that says which key may be meant, if there is one.
fn no_file(table: &mut Table) -> SceneError {
    let keys = std::iter::once("file").chain(FORMAT_KEYS);
    let errors = keys.filter_map(|key| table.require(key).err());
    let mut errors: Vec<SceneError> = errors.collect();
    let meant = errors.iter().position(|error| error.hint.is_some());
    errors.swap_remove(meant.unwrap_or(0))
}

/// The file that an entry takes its second texture coordinates from.
fn second_uvs<'f>(
    table: &mut Table,
    formats: &'f [Format],
) -> Result<Option<SecondUvs<'f>>, SceneError> {
    let Some(value) = table.get("uv1") else {
        return Ok(None);
    };
    let file = value.string()?.to_owned();
    let Some(format) = formats::of_file(formats, &file) else {
        return Err(unreadable(&value, &file, formats));
    };
    let named = value.excerpt();
    Ok(Some(SecondUvs {
        file,
        named,
        format,
    }))
}

fn unreadable(value: &Value, name: &str, formats: &[Format]) -> SceneError {
    value
        .error(format!("`{name}` is in no format that is read here"))
        .hint(format!(
            "geometry is read from {}, told by the extension",
            formats::readable(formats)
        ))
}

fn materials(
    root: &mut Table,
    formats: &[Format],
    moment: Moment,
) -> Result<Vec<MaterialSpec>, SceneError> {
    let Some(value) = root.get("materials") else {
        return Ok(Vec::new());
    };
    let table = value.table("[materials]")?;
    let text: Arc<str> = value.source().0.into();
    let entries = table.named().into_iter();
    entries
        .map(|(name, value)| material(name, &value, &text, formats, moment))
        .collect()
}

fn material(
    name: &str,
    value: &Value,
    text: &Arc<str>,
    formats: &[Format],
    moment: Moment,
) -> Result<MaterialSpec, SceneError> {
    let title = format!("[materials.{name:?}]");
    let mut table = value.table(&title)?;
    let file = table.require("file")?;
    let item = table.get("material");
    let mut written = Written {
        path: value.source().1.display().to_string(),
        text: text.clone(),
        file: Some(file.range()),
        material: item.as_ref().map(Value::range),
        params: Vec::new(),
    };
    let file = file.string()?.to_owned();
    let item = item.map(|v| v.string().map(str::to_owned));
    let bake = optional(&mut table, "bake", Value::boolean, false)?;
    let group = group(&mut table)?;
    let mut params = Vec::new();
    if let Some(value) = table.get("params") {
        let entries = value.table(format!("{title} params"))?.named();
        for (key, value) in entries {
            params.push((key.to_owned(), param(&value, formats)?));
            written.params.push(value.written(key));
        }
    }
    let keys = Moment::keys(&mut table, &title)?;
    let has_keys = keys.is_some();
    for (key, value) in keys.map(|keys| keys.named()).unwrap_or_default() {
        let given = keyed_param(&value, formats, moment)?;
        params.retain(|(name, _)| name != key);
        params.push((key.to_owned(), ParamSpec::Given(given)));
        written.params.retain(|param| param.name != key);
        written.params.push(value.written(key));
    }
    table.finish()?;
    Ok(MaterialSpec {
        name: name.to_owned(),
        file,
        material: item.transpose()?,
        params,
        has_keys,
        bake,
        group,
        written: Arc::new(written),
    })
}

/// The name of a group of lights, which is part of a channel's name.
fn group(table: &mut Table) -> Result<Option<String>, SceneError> {
    let name = |value: &Value| {
        let name = value.string()?;
        let fits = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        if !name.is_empty() && name.chars().all(fits) {
            Ok(Some(name.to_owned()))
        } else {
            Err(value.mismatch("a name of letters, digits, `_` and `-`"))
        }
    };
    optional(table, "group", name, None)
}

/// The value of a parameter with keys.
fn keyed_param(
    value: &Value,
    formats: &[Format],
    moment: Moment,
) -> Result<ParameterValue, SceneError> {
    let read = |item: &Value| match param(item, formats)? {
        ParamSpec::Given(given) => Ok(given),
        ParamSpec::OfFile(_) => Err(item.mismatch("a value that does not come from a file")),
    };
    moment.of_keys(value, read, |a, b, t| {
        mix_values(a, b, t).ok_or_else(|| {
            let message = format!("there is nothing between `{a}` and `{b}`");
            let hint = "keys are numbers, arrays of as many numbers, or constant expressions";
            value.error(message).hint(hint)
        })
    })
}

/// A parameter's value, or where it comes from.
fn param(value: &Value, formats: &[Format]) -> Result<ParamSpec, SceneError> {
    let given = match value.item() {
        DeValue::Boolean(b) => ParameterValue::Bool(*b),
        DeValue::Integer(i) if i.radix() == 10 => integer(i.as_str()),
        item @ DeValue::Float(_) => {
            ParameterValue::Float(number(item).ok_or_else(|| value.mismatch("a finite number"))?)
        }
        item @ DeValue::Array(_) => {
            let components = numbers(item).filter(|n| (2..=4).contains(&n.len()));
            let components = components.ok_or_else(|| value.mismatch("2 to 4 finite numbers"))?;
            ParameterValue::Floats(components)
        }
        DeValue::String(text) => match text.strip_prefix('$') {
            Some(key) => return file_value(key, value, formats).map(ParamSpec::OfFile),
            None if text.trim().is_empty() => {
                return Err(value.mismatch("an Impasto expression, such as \"0.6 mm\""));
            }
            None => text.trim().into(),
        },
        _ => return Err(value.mismatch("a number, true, false, an array of numbers or a string")),
    };
    Ok(ParamSpec::Given(given))
}

/// A decimal integer. What the language does not write as one, such as `+3`, stays text, which it
/// will refuse.
fn integer(text: &str) -> ParameterValue {
    let value = text.parse().ok();
    let value = value.filter(|v: &i64| v.to_string() == text);
    value.map_or_else(|| text.into(), ParameterValue::Int)
}

/// The value of that name which geometry files give materials.
fn file_value(
    key: &str,
    value: &Value,
    formats: &[Format],
) -> Result<&'static FileValue, SceneError> {
    let all = || formats.iter().flat_map(|f| f.values);
    all().find(|v| v.name == key).ok_or_else(|| {
        let giving = formats.iter().filter(|f| !f.values.is_empty());
        let sources: Vec<&str> = giving.map(|f| f.values_of).collect();
        let known: Vec<String> = all().map(|v| format!("${}", v.name)).collect();
        value
            .error(format!("`${key}` is no value of {}", sources.join(" or ")))
            .hint(format!("there are {}", known.join(", ")))
    })
}

fn lights(
    root: &mut Table,
    readers: &[LightReader],
    moment: Moment,
) -> Result<Vec<LightSpec>, SceneError> {
    let Some(value) = root.get("lights") else {
        return Ok(Vec::new());
    };
    let light = |mut table: Table| {
        moment.hold(&mut table, "[[lights]]")?;
        let kind = table.require("kind")?;
        let group = group(&mut table)?;
        let name = kind.string()?;
        let Some(reader) = readers.iter().find(|reader| reader.kind == name) else {
            let kinds = readers.iter().map(|reader| format!("{:?}", reader.kind));
            let kinds: Vec<String> = kinds.collect();
            return Err(kind.mismatch(&kinds.join(" or ")));
        };
        let (light, place) = (reader.read)(&mut table)?;
        table.finish()?;
        let spec = LightSpec {
            light,
            place,
            group,
        };
        Ok(spec)
    };
    value.tables("lights")?.into_iter().map(light).collect()
}

fn environment(root: &mut Table) -> Result<Option<EnvironmentSpec>, SceneError> {
    let Some(value) = root.get("environment") else {
        return Ok(None);
    };
    let mut table = value.table("[environment]")?;
    let source = match (table.get("file"), table.get("color")) {
        (Some(file), None) => {
            EnvironmentSpecSource::File(file.string()?.to_owned(), file.excerpt())
        }
        (None, Some(color)) => EnvironmentSpecSource::Color(color.rgb()?),
        _ => return Err(table.error("[environment] needs either `file` or `color`")),
    };
    let is_map = matches!(source, EnvironmentSpecSource::File(..));
    let scale = |v: &Value| v.float_where("a number, 0 or more", |v| v >= 0.0);
    let spec = EnvironmentSpec {
        source,
        scale: optional(&mut table, "scale", scale, 1.0)?,
        rotate: optional(&mut table, "rotate", Value::float, 0.0)?,
        sample: optional(&mut table, "sample", Value::boolean, is_map)?,
        group: group(&mut table)?,
    };
    table.finish()?;
    Ok(Some(spec))
}

/// The value of an optional key as `read` reads it, or `default`.
pub(crate) fn optional<'d, T>(
    table: &mut Table<'d>,
    key: &'static str,
    read: impl Fn(&Value<'d>) -> Result<T, SceneError>,
    default: T,
) -> Result<T, SceneError> {
    table.get(key).map_or(Ok(default), |value| read(&value))
}
