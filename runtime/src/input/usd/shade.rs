//! Materials of a stage as MaterialX documents: networks of UsdShade are networks of MaterialX, whose nodes have other
//! names here and there. What nodes mean, the importer of MaterialX knows.

use impasto_import::{Files, Options};
use openusd::sdf::{AssetPath, Path};

use self::network::Network;
use super::model::{Made, Material};
use super::walk::Walk;
use crate::input::names;

mod network;

/// The material of what has none: the color that the geometry says.
pub(super) const BARE: &str = "display_color";

type Checked<T = ()> = Result<T, String>;

/// The material at a path, which is one.
pub(super) fn material(walk: &mut Walk<'_>, path: &Path) -> Checked<Material> {
    let name = walk
        .names
        .name(path.name().unwrap_or("material").to_owned());
    let source = walk.sources_named.name(names::identifier(&name, &[BARE]));
    let metres = walk.upright.x_axis.length();
    let mut made = None;
    let mut coordinates = Vec::new();
    for output in ["outputs:mtlx:surface", "outputs:surface"] {
        let mut network = Network::new(walk);
        let Some(found) = network.document(path, output, &source).transpose() else {
            continue;
        };
        let read = network.coordinates;
        let found = found.and_then(|text| imported(&name, &source, &text, metres));
        match (&made, found) {
            (None | Some(Err(_)), Ok(found)) => {
                if let Some(Err(why)) = &made {
                    let why: &String = why;
                    let first = why.lines().next().unwrap_or_default().to_owned();
                    walk.warn(format!(
                        "the material `{path}` is that of `{output}`: {first}"
                    ));
                }
                (made, coordinates) = (Some(Ok(found)), read);
                break;
            }
            (None, Err(why)) => (made, coordinates) = (Some(Err(why)), read),
            _ => {}
        }
    }
    if made.is_none() {
        bare(walk, path);
    }
    walk.coordinates.push(coordinates);
    Ok(Material {
        name,
        source,
        made: made.transpose(),
    })
}

/// Warns of a material that no network is known of.
fn bare(walk: &mut Walk<'_>, path: &Path) {
    let properties = walk.reader.stage.prim(path.clone()).property_names();
    let properties = properties.unwrap_or_default();
    let context = |name: &str| {
        let rest = name.strip_prefix("outputs:")?;
        rest.strip_suffix(":surface").map(str::to_owned)
    };
    let others: Vec<String> = properties
        .iter()
        .filter_map(|p| context(p.as_str()))
        .collect();
    let why = if others.is_empty() {
        "it has no surface".to_owned()
    } else {
        format!("it is for {} alone", others.join(", "))
    };
    walk.warn(format!(
        "the material `{path}` is replaced by the color of the geometry: {why}"
    ));
}

/// What a document becomes, whose lengths are in units of so many metres.
fn imported(name: &str, source: &str, document: &str, metres: f64) -> Result<Made, String> {
    let path = format!("{source}.mtlx");
    let options = Options {
        metres_per_unit: Some(metres),
        unchecked: true,
        in_place: true,
        ..Options::default()
    };
    let imported = impasto_import::import(&path, &mut Within(document), &options);
    let imported = imported.map_err(|errors| {
        let said = errors.into_iter().map(|mut error| {
            // Lines are of a document that nobody has.
            error.line = None;
            error.path = format!("material `{name}`");
            error.to_string()
        });
        said.collect::<Vec<_>>().join("\n")
    })?;
    let text = imported.in_place();
    let first = imported.materials.into_iter().next();
    let within = first.map_or_else(|| source.to_owned(), |(name, _)| name);
    Ok(Made { text, within })
}

/// A document that names pictures of the file.
struct Within<'d>(&'d str);

impl Files for Within<'_> {
    fn read(&mut self, path: &str, _most: usize) -> Result<Vec<u8>, String> {
        if path.ends_with(".mtlx") {
            Ok(self.0.as_bytes().to_vec())
        } else {
            Err("no such file".into())
        }
    }

    fn exists(&mut self, _path: &str) -> bool {
        true
    }
}

impl Walk<'_> {
    /// What the texture coordinates are called that a material reads, at most two.
    pub(super) fn coordinates_of(&self, material: usize) -> Vec<String> {
        self.coordinates.get(material).cloned().unwrap_or_default()
    }

    /// The number of a picture; none if it is not there.
    pub(super) fn picture(&mut self, asset: &AssetPath) -> Option<usize> {
        let Some(resolved) = asset.resolved_path() else {
            self.warn(format!(
                "there is no picture `{}`, or it may not be read",
                asset.as_str()
            ));
            return None;
        };
        let known = self.model.pictures.iter().position(|own| own == resolved);
        Some(known.unwrap_or_else(|| {
            self.model.pictures.push(resolved.to_owned());
            self.model.pictures.len() - 1
        }))
    }
}
