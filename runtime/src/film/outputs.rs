//! The table of outputs: what a film can hold beside the picture itself (arbitrary output variables).
//!
//! Everything else follows from a row: the planes of the film, the text that kernels record it with, how parts
//! of a render merge, the channels of an OpenEXR file, what `impasto render --help` lists and the table of
//! docs/outputs.md. An output is added by adding its row.

use impasto_compiler::diag::nearest;

/// One output.
#[derive(Debug)]
pub struct Output {
    /// What `--aov` calls it.
    pub name: &'static str,
    /// What it is, for the manual.
    pub what: &'static str,
    /// Its channels in an OpenEXR file; of ids the name of the Cryptomatte.
    pub channels: &'static [&'static str],
    /// How the values of samples are put together.
    pub kind: Kind,
    /// Where paths record it.
    pub at: At,
    /// Its value in WGSL: a number, or a vector of as many as there are channels; of ids a number above 0. What it
    /// may mention depends on `at` (see `kernels/outputs.rs`).
    pub value: &'static str,
    /// Of an output of materials the value of what has none, such as a quad light; nothing is recorded there if
    /// it is empty.
    pub bare: &'static str,
    /// What a kernel must have to compute the value.
    pub asks: &'static [Ask],
}

/// How the values of samples are put together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// The exact mean of values, cut to lie between two limits.
    Mean(Of, f32, f32),
    /// The share of samples that record it.
    Share,
    /// The smallest of values above 0; 0 if there is none.
    Nearest,
    /// The most frequent ids, each with the share of samples that record it.
    Ids,
    /// The variance of the mean of values, of which the squares are summed.
    Variance,
    /// How many samples there are, which the film counts anyway.
    Samples,
}

/// What a sum is divided by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Of {
    /// The samples of the pixel: those that record nothing count as 0, as black does in the picture.
    Samples,
    /// Those of them that met a surface (`alpha`).
    Hits,
}

/// Where paths record an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum At {
    /// Where a camera ray has met a surface.
    FirstHit,
    /// Where the material there is evaluated.
    Material,
    /// Where a sample is added to the film.
    Sample,
    /// Where light is gathered: a layer for each group of lights.
    Light,
}

/// What a kernel must have to compute an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ask {
    /// Places in the world.
    Position,
    /// The normals of corners.
    Normals,
    /// The texture coordinates of corners.
    Uvs,
    /// Which object a triangle is of.
    Objects,
    /// Functions of materials that say how they look, which the compiler writes if it is asked to.
    Looks,
}

/// The largest magnitude that sums are made for, as of radiance.
pub const LIMIT: f32 = 4_294_967_296.0;
/// Words of an exact sum.
pub(crate) const SUM_WORDS: usize = 3;
/// Ids that a pixel can tell apart: two ranks for each of four layers of channels.
pub const ID_SLOTS: usize = 8;

/// Every output, in the order of the film's planes.
pub static OUTPUTS: [Output; 12] = [
    Output {
        name: "alpha",
        what: "the share of samples whose camera ray meets a surface",
        channels: &["A"],
        kind: Kind::Share,
        at: At::FirstHit,
        value: "",
        bare: "",
        asks: &[],
    },
    Output {
        name: "albedo",
        what: "what the material scatters in all of the light from the camera's direction; 0 for lights without a material",
        channels: &["albedo.R", "albedo.G", "albedo.B"],
        kind: Kind::Mean(Of::Samples, 0.0, 1.0),
        at: At::Material,
        value: "material_albedo(instance, point, wo)",
        bare: "",
        asks: &[Ask::Looks],
    },
    Output {
        name: "normal",
        what: "the shading normal in the world, bumps included, on the side that is seen",
        channels: &["N.X", "N.Y", "N.Z"],
        kind: Kind::Mean(Of::Samples, -1.0, 1.0),
        at: At::Material,
        value: "facing(point.geometric_normal, -wo) * material_normal(instance, point, wo)",
        bare: "facing(geometric, way) * normal",
        asks: &[Ask::Normals, Ask::Looks],
    },
    Output {
        name: "geometric_normal",
        what: "the normal of the triangle in the world, on the side that is seen",
        channels: &["Ng.X", "Ng.Y", "Ng.Z"],
        kind: Kind::Mean(Of::Samples, -1.0, 1.0),
        at: At::FirstHit,
        value: "facing(geometric, way) * geometric",
        bare: "",
        asks: &[],
    },
    Output {
        name: "position",
        what: "the place in the world in metres, the mean of samples that meet a surface",
        channels: &["P.X", "P.Y", "P.Z"],
        kind: Kind::Mean(Of::Hits, -LIMIT, LIMIT),
        at: At::FirstHit,
        value: "place",
        bare: "",
        asks: &[Ask::Position],
    },
    Output {
        name: "depth",
        what: "the distance in metres along the camera's view, the nearest of all samples; 0 if none meets a surface",
        channels: &["Z"],
        kind: Kind::Nearest,
        at: At::FirstHit,
        value: "dot(position - camera.position, camera.forward)",
        bare: "",
        asks: &[],
    },
    Output {
        name: "uv",
        what: "texture coordinates, the mean of samples that meet a surface",
        channels: &["uv.U", "uv.V"],
        kind: Kind::Mean(Of::Hits, -LIMIT, LIMIT),
        at: At::FirstHit,
        value: "hit_uv(hit.primitive, corners)",
        bare: "",
        asks: &[Ask::Uvs],
    },
    Output {
        name: "material",
        what: "a Cryptomatte of materials, by the names that the scene binds",
        channels: &["CryptoMaterial"],
        kind: Kind::Ids,
        at: At::FirstHit,
        // Of what has no material 0, which is no id.
        value: "instance + 1u",
        bare: "",
        asks: &[],
    },
    Output {
        name: "object",
        what: "a Cryptomatte of objects, by the names of OBJ files, the objects or groups in them, and their placements",
        channels: &["CryptoObject"],
        kind: Kind::Ids,
        at: At::FirstHit,
        value: "primitive_object(hit.primitive) + 1u",
        bare: "",
        asks: &[Ask::Objects],
    },
    Output {
        name: "samples",
        what: "how many samples the pixel has",
        channels: &["samples.Y"],
        kind: Kind::Samples,
        at: At::Sample,
        value: "",
        bare: "",
        asks: &[],
    },
    Output {
        name: "variance",
        what: "the variance of the pixel's mean, as if its samples were independent; values above 65536 count as that",
        channels: &["variance.R", "variance.G", "variance.B"],
        kind: Kind::Variance,
        at: At::Sample,
        value: "radiance * radiance",
        bare: "",
        asks: &[],
    },
    Output {
        name: LIGHT_GROUP,
        what: "the share of the picture that comes from the lights of a group; those without one are in the group `default`",
        channels: &["light_GROUP.R", "light_GROUP.G", "light_GROUP.B"],
        kind: Kind::Mean(Of::Samples, 0.0, LIMIT),
        at: At::Light,
        value: "light",
        bare: "",
        asks: &[],
    },
];

/// What the name of the output of a light group, and of each of its channels, begins with.
pub(crate) const GROUP_PREFIX: &str = "light_";
/// How the table writes the output of a light group.
pub const LIGHT_GROUP: &str = "light_GROUP";
/// Asks for the outputs of all light groups.
pub const ALL_GROUPS: &str = "lights";
/// The group of lights that the scene puts in none.
pub const DEFAULT_GROUP: &str = "default";

impl Output {
    /// Its row, by the name that `--aov` knows it by.
    pub fn named(name: &str) -> Option<&'static Output> {
        let plain = OUTPUTS.iter().find(|o| o.name == name && o.at != At::Light);
        plain.or_else(|| {
            let is_group = group_of(name).is_some();
            OUTPUTS.iter().find(|o| o.at == At::Light && is_group)
        })
    }

    /// Whether there is something to record at a point of a path; of what has no material that is at the first hit.
    pub(crate) fn is_recorded_at(&self, at: At) -> bool {
        let bare = at == At::FirstHit && !self.bare.is_empty();
        !matches!(self.kind, Kind::Samples) && (self.at == at || bare)
    }

    /// Planes of the film: words of a pixel.
    pub(crate) fn planes(&self) -> usize {
        match self.kind {
            Kind::Mean(..) | Kind::Variance => SUM_WORDS * self.channels.len(),
            Kind::Share | Kind::Nearest => 1,
            // Ids with their counts, and how many samples found no room.
            Kind::Ids => 2 * ID_SLOTS + 1,
            Kind::Samples => 0,
        }
    }

    /// The range of its values, for the manual.
    pub fn range(&self) -> String {
        match self.kind {
            Kind::Mean(_, low, high) if low == -LIMIT && high == LIMIT => "-2^32 to 2^32".into(),
            Kind::Mean(_, low, LIMIT) => format!("{low} to 2^32"),
            Kind::Mean(_, low, high) => format!("{low} to {high}"),
            Kind::Share => "0 to 1".into(),
            Kind::Nearest => "above 0".into(),
            Kind::Ids => format!("{ID_SLOTS} ids a pixel"),
            Kind::Variance => "0 to 2^32".into(),
            Kind::Samples => "0 to 2^32 - 1".into(),
        }
    }
}

/// The group whose output has a name.
pub(crate) fn group_of(name: &str) -> Option<&str> {
    name.strip_prefix(GROUP_PREFIX).filter(|g| !g.is_empty())
}

/// Names that `--aov` takes, as far as they do not depend on the scene.
pub fn names() -> impl Iterator<Item = &'static str> {
    OUTPUTS.iter().map(|o| o.name).chain([ALL_GROUPS])
}

/// Do any outputs ask for functions of materials that say how they look?
pub fn ask_for_looks(names: &[String]) -> bool {
    let outputs = names.iter().filter_map(|name| Output::named(name));
    outputs.into_iter().any(|o| o.asks.contains(&Ask::Looks))
}

/// Fails, in words, if there is no output of that name whatever the scene.
///
/// # Errors
/// Names what exists, and what is nearest.
pub fn check_name(name: &str) -> Result<(), String> {
    if name == ALL_GROUPS || (name != LIGHT_GROUP && Output::named(name).is_some()) {
        return Ok(());
    }
    let all: Vec<&str> = names().collect();
    let near = nearest(name, all.iter().copied().filter(|n| *n != LIGHT_GROUP));
    let near = near.map_or(String::new(), |near| format!("did you mean `{near}`? "));
    Err(format!(
        "there is no output called `{name}`\n  hint: {near}there are {}",
        all.join(", ")
    ))
}

/// The table of outputs as docs/outputs.md has it.
pub fn manual() -> String {
    let mut out = String::from("| `--aov` | channels | what | range |\n|---|---|---|---|\n");
    for output in &OUTPUTS {
        let channels = match output.kind {
            Kind::Ids => (0..ID_SLOTS / 2)
                .map(|layer| format!("`{}{layer:02}.RGBA`", output.channels[0]))
                .collect::<Vec<_>>(),
            _ => output.channels.iter().map(|c| format!("`{c}`")).collect(),
        };
        out += &format!(
            "| `{}` | {} | {} | {} |\n",
            output.name,
            channels.join(", "),
            output.what,
            output.range()
        );
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_names_are_answered_with_the_nearest() {
        for output in OUTPUTS.iter().filter(|o| o.at != At::Light) {
            assert_eq!(check_name(output.name), Ok(()));
        }
        assert_eq!(check_name("lights"), Ok(()));
        assert_eq!(check_name("light_key"), Ok(()));
        let error = check_name("albeddo").expect_err("unknown");
        assert!(error.contains("`albeddo`"), "{error}");
        assert!(error.contains("did you mean `albedo`"), "{error}");
        for name in names() {
            assert!(error.contains(name), "{name}: {error}");
        }
        assert!(check_name("light_").is_err());
        assert!(check_name("light_GROUP").is_err());
    }

    /// What a row must be for everything that is derived from it.
    #[test]
    fn every_row_is_whole() {
        for (at, output) in OUTPUTS.iter().enumerate() {
            let name = output.name;
            assert!(OUTPUTS[..at].iter().all(|o| o.name != name), "{name}");
            assert!((1..=3).contains(&output.channels.len()), "{name}");
            assert!(!output.what.is_empty(), "{name}");
            let silent = matches!(output.kind, Kind::Share | Kind::Samples);
            assert_eq!(output.value.is_empty(), silent, "{name}");
            assert!(
                output.bare.is_empty() || output.at == At::Material,
                "{name}"
            );
            let of_looks = output.asks.contains(&Ask::Looks);
            assert_eq!(of_looks, output.at == At::Material, "{name}");
            if let Kind::Mean(_, low, high) = output.kind {
                assert!(low < high && low >= -LIMIT && high <= LIMIT, "{name}");
            }
        }
    }
}
