//! What the manual of scene files says of each key.
//!
//! The manual (docs/scenes.md) is the one place where keys are described. The rows of its tables are read, under the
//! headings that name their sections.

use std::sync::OnceLock;

/// The manual.
const TEXT: &str = include_str!("../../../docs/scenes.md");

/// What the manual says of a key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Key {
    /// The section: `camera`, `geometry`, `materials`; empty at the top.
    pub section: String,
    /// The key.
    pub name: String,
    /// Its default, as the manual writes it.
    pub default: String,
    /// What it is, as Markdown.
    pub about: String,
}

/// Sections that are lists of tables, `[[lights]]`.
pub const LISTS: [&str; 2] = ["geometry", "lights"];

/// Every key, in the order of the manual.
pub fn keys() -> &'static [Key] {
    static KEYS: OnceLock<Vec<Key>> = OnceLock::new();
    KEYS.get_or_init(|| read(TEXT))
}

/// The sections, in the order of the manual.
pub fn sections() -> Vec<&'static str> {
    let mut sections: Vec<&str> = Vec::new();
    for key in keys() {
        if !key.section.is_empty() && !sections.contains(&key.section.as_str()) {
            sections.push(&key.section);
        }
    }
    sections
}

/// The keys of a section.
pub fn keys_of(section: &str) -> impl Iterator<Item = &'static Key> {
    keys().iter().filter(move |key| key.section == section)
}

fn read(text: &str) -> Vec<Key> {
    let mut keys: Vec<Key> = Vec::new();
    let mut section = None::<String>;
    let mut in_table = false;
    for line in text.lines() {
        if let Some(heading) = line
            .strip_prefix("## ")
            .or_else(|| line.strip_prefix("### "))
        {
            section = spans(heading).next().map(|span| {
                let inside = span.trim_matches(['[', ']']);
                inside.split('.').next().unwrap_or(inside).to_owned()
            });
            // A heading of a key at the top names no table.
            if let Some(name) = section.clone().filter(|_| !heading.contains('[')) {
                section = (name == "placements").then_some(name);
            }
            continue;
        }
        if !line.starts_with('|') {
            in_table = false;
            continue;
        }
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        let [first, default, about] = cells.as_slice() else {
            continue;
        };
        if first.starts_with("key") && *default == "default" {
            in_table = true;
            if let Some(named) = spans(first).next() {
                section = Some(named.trim_matches(['[', ']']).to_owned());
            }
            continue;
        }
        if !in_table || first.starts_with("---") {
            continue;
        }
        let Some(section) = &section else { continue };
        for span in spans(first) {
            let (section, name) = match span.split_once('.') {
                Some((section, name)) => (section, name),
                None => (section.as_str(), span),
            };
            let known = |k: &Key| k.section == section && k.name == name;
            match keys.iter_mut().find(|k| known(k)) {
                // Kinds of lights have keys of one name.
                Some(key) => key.about += &format!("\n\n{about}"),
                None => keys.push(Key {
                    section: section.to_owned(),
                    name: name.to_owned(),
                    default: (*default).to_owned(),
                    about: (*about).to_owned(),
                }),
            }
        }
    }
    keys
}

fn spans(cell: &str) -> impl Iterator<Item = &str> {
    cell.split('`').skip(1).step_by(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_section_has_its_keys() {
        for (section, names) in [
            ("camera", &["position", "look_at", "fov", "turntable"][..]),
            ("film", &["width", "height"]),
            ("integrator", &["max_depth", "roulette_start"]),
            (
                "geometry",
                &["file", "obj", "gltf", "placements", "material"],
            ),
            (
                "materials",
                &["file", "material", "params", "bake", "group"],
            ),
            (
                "lights",
                &["kind", "corner", "radiance", "irradiance", "group"],
            ),
            ("environment", &["file", "color", "rotate", "group"]),
            ("animation", &["frames_per_second", "interpolation"]),
        ] {
            for name in names {
                let found = keys_of(section).any(|k| k.name == *name);
                assert!(
                    found,
                    "docs/scenes.md has no row for `{name}` of [{section}]"
                );
            }
        }
    }
}
