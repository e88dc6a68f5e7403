//! Small functions that some nodes need and the library has not: their texts go into the sources that use them.
//!
//! Each is a file of Impasto of its own, and may use the library.

/// A helper: the name that sources call, and the file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Helper {
    pub name: &'static str,
    pub file: &'static str,
}

macro_rules! helpers {
    ($($name:literal),* $(,)?) => {
        /// All helpers, sorted by name. None uses another.
        pub(crate) const HELPERS: &[Helper] = &[
            $(Helper { name: $name, file: include_str!(concat!("helpers/", $name, ".impasto")) }),*
        ];
    };
}

helpers!(
    "disjoint_over",
    "fractal_sum",
    "ggx_anisotropy",
    "ggx_roughness",
    "height_normal",
    "hsv_adjusted",
    "moved_then_scaled",
    "ramp_stops",
    "reflectance_ior",
    "refracted",
    "rotated_about",
    "scaled_normal_map",
    "side_weights",
    "unified_noise",
    "usd_preview_surface",
);

/// The helper of a name.
pub(crate) fn find(name: &str) -> Option<&'static Helper> {
    HELPERS.iter().find(|helper| helper.name == name)
}

/// What a helper imports from the library, as folders and names.
pub(crate) fn imports(helper: &Helper) -> Vec<(&'static str, &'static str)> {
    let lines = helper
        .file
        .lines()
        .filter_map(|line| line.strip_prefix("use std::"));
    let paths = lines.filter_map(|line| line.strip_suffix(';')?.split_once("::"));
    paths
        .flat_map(|(folder, names)| {
            let names = names.trim_matches(['{', '}']).split(',');
            names.map(move |name| (folder, name.trim()))
        })
        .collect()
}

/// The text of a helper without what the source says at its head.
pub(crate) fn text(helper: &Helper) -> &'static str {
    let mut rest = helper.file;
    while rest.starts_with("//!") || rest.starts_with("use ") || rest.starts_with('\n') {
        rest = rest.split_once('\n').map_or("", |(_, rest)| rest);
    }
    rest
}
