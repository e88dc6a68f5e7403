//! Names of a document as names of Impasto: legal, each its own, and none that means something else there.

use std::collections::{HashMap, HashSet};
use std::sync::OnceLock;

/// Words and names that every source has, besides those that the library defines.
const TAKEN: &str = "material bsdf delta edf fn struct const private use as param let var if else for in while limit \
    break continue when true false bool int float uint length angle vec2 vec3 vec4 point vector normal color mat2 mat3 \
    texture medium none layer mix abs sign floor ceil round fract sqrt inverse_sqrt exp exp2 log log2 sin cos tan asin \
    acos atan atan2 pow min max step mod clamp smoothstep saturate transpose determinant inverse dot cross distance \
    normalize reflect select luminance max_component min_component srgb hash unit_float image image_data image_alpha \
    filter_width gradient fill count position geometric_normal tangent uv uv1 vertex_color view facing object_position \
    object_normal object_scale instance_id exterior_ior time frame instance_random object_from_world world_from_object \
    surface emission interior opacity nm um mm cm m km deg rad std";

/// Does the name mean something in every source, or may a source import it?
fn is_taken(name: &str) -> bool {
    static NAMES: OnceLock<HashSet<&'static str>> = OnceLock::new();
    let names = NAMES.get_or_init(|| {
        let defined = impasto_stdlib::files().iter().flat_map(|file| {
            file.text.lines().filter_map(|line| {
                let line = line.strip_prefix("private ").unwrap_or(line);
                let line = line.strip_prefix("delta ").unwrap_or(line);
                let (word, rest) = line.split_once(' ')?;
                let defines = matches!(
                    word,
                    "fn" | "bsdf" | "edf" | "struct" | "const" | "material"
                );
                let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_');
                defines.then(|| &rest[..end.unwrap_or(rest.len())])
            })
        });
        TAKEN.split_whitespace().chain(defined).collect()
    });
    names.contains(name)
}

/// The names of one source, or of one material in it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Names {
    used: HashMap<String, u32>,
}

impl Names {
    /// A name of its own that is like `wanted`; where it means something already, `suffix` tells what it is here.
    pub fn unique(&mut self, wanted: &str, suffix: &str) -> String {
        let mut name = legal(wanted, suffix);
        if is_taken(&name) {
            name = format!("{name}_{suffix}");
        }
        if !self.used.contains_key(&name) {
            self.used.insert(name.clone(), 1);
            return name;
        }
        loop {
            let count = self.used.entry(name.clone()).or_insert(1);
            *count += 1;
            let next = format!("{name}_{count}");
            if !self.used.contains_key(&next) && !is_taken(&next) {
                self.used.insert(next.clone(), 1);
                return next;
            }
        }
    }

    /// Keeps a name for something else.
    pub fn keep(&mut self, name: &str) {
        self.used.entry(name.to_owned()).or_insert(1);
    }
}

/// Letters, digits and underscores; anything else becomes an underscore.
fn legal(wanted: &str, suffix: &str) -> String {
    let mut name = String::new();
    for c in wanted.chars().take(60) {
        let c = if c.is_ascii_alphanumeric() { c } else { '_' };
        if c != '_' || !name.ends_with('_') {
            name.push(c);
        }
    }
    let name = name.trim_matches('_');
    match name.chars().next() {
        None => suffix.to_owned(),
        Some(first) if first.is_ascii_digit() => format!("{suffix}_{name}"),
        Some(_) => name.to_owned(),
    }
}

/// Did a person give this name to a node? Programs name nodes after their category and a number.
pub(crate) fn is_given(name: &str, category: &str) -> bool {
    let plain = |text: &str| text.to_ascii_lowercase().replace('_', "");
    let stem = name.trim_end_matches(|c: char| c.is_ascii_digit() || c == '_');
    let stem = plain(stem);
    let stem = stem
        .strip_prefix("node")
        .or(stem.strip_prefix("nmtlx"))
        .unwrap_or(&stem);
    let category = plain(category);
    if stem.is_empty() || matches!(stem, "n" | "t" | "m") {
        return false;
    }
    let bare = stem.strip_prefix('n').unwrap_or(stem);
    let kinds = [
        "", "float", "color3", "color4", "vector2", "vector3", "vector4", "color", "integer",
    ];
    let bare_category = category.trim_end_matches(|c: char| c.is_ascii_digit());
    !kinds.iter().any(|kind| {
        [stem, bare].iter().any(|stem| {
            let stem = stem.strip_suffix(kind).unwrap_or(stem);
            !stem.is_empty() && (stem == category || stem == bare_category)
                || stem.is_empty() && !kind.is_empty()
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_legal_and_their_own() {
        let mut names = Names::default();
        for (wanted, name) in [
            ("scale_xyz", "scale_xyz"),
            ("scale_xyz", "scale_xyz_2"),
            ("scale_xyz_2", "scale_xyz_2_2"),
            ("sin", "sin_value"),
            ("Karo 1/ä", "Karo_1"),
            ("7up", "value_7up"),
            ("", "value"),
            ("ggx_albedo", "ggx_albedo"),
            ("perlin", "perlin_value"),
        ] {
            assert_eq!(names.unique(wanted, "value"), name);
        }
    }

    #[test]
    fn names_that_programs_give_are_told_from_those_of_people() {
        for (name, category, given) in [
            ("node_multiply_5", "multiply", false),
            ("node_tiledimage_float_7", "tiledimage", false),
            ("node_color_11", "constant", false),
            ("add1", "add", false),
            ("N_mtlxmult", "multiply", true),
            ("combine3_1", "combine3", false),
            ("image_color", "tiledimage", true),
            ("scale_noise", "multiply", true),
            ("sum", "add", true),
        ] {
            assert_eq!(is_given(name, category), given, "{name}");
        }
    }
}
