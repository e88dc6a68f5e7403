//! Scenes for the experiment on partitions (`cargo xtask partition`): mixes of 1 to 64 materials that differ in
//! what materials cost, in their shares, and in whether neighbouring paths hit the same.
//!
//! Little else happens in them: some thousand triangles, one light. `index.json` lists them:
//! `[{"name": .., "scene": .., "about": .., "hits": "random", "shares": "even", "materials": [..]}]`.

mod materials;
mod places;

use std::fmt::Write as _;

use super::{GeneratedFile, crossover, model_files};
use places::PLACES;
#[cfg(test)]
pub(crate) use places::{booths, room};

/// Where everything is written.
pub(crate) const FOLDER: &str = "examples/mixes/generated";

/// What paths that are neighbours hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Hits {
    /// Whatever it is, one independently of the other.
    Random,
    /// Mostly the same.
    Coherent,
}

/// How the surface is shared out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shares {
    /// As much for each.
    Even,
    /// Each has less than the one before.
    Skewed,
}

/// A scene.
struct Mix {
    name: &'static str,
    about: &'static str,
    hits: Hits,
    shares: Shares,
    /// Names: of files in `materials/`, of generated materials, or `kinds N`, the first N of 64.
    materials: &'static str,
}

const fn mix(
    name: &'static str,
    hits: Hits,
    shares: Shares,
    about: &'static str,
    materials: &'static str,
) -> Mix {
    Mix {
        name,
        about,
        hits,
        shares,
        materials,
    }
}

use Hits::{Coherent, Random};
use Shares::{Even, Skewed};

/// All mixes. Most have a material that no other has, so that a model can be tried on what it has
/// not seen.
const MIXES: [Mix; 23] = [
    mix("cheap_1", Random, Even, "one cheap material", "mtl"),
    mix(
        "paint_1",
        Random,
        Even,
        "one expensive material",
        "car_paint",
    ),
    mix("loop_1", Random, Even, "one loop", "julia"),
    mix(
        "unlike_2",
        Random,
        Skewed,
        "a cheap and an expensive one",
        "matte asphalt",
    ),
    mix(
        "loop_2",
        Random,
        Even,
        "a loop and a cheap one",
        "mandelbrot_wall mtl",
    ),
    mix(
        "stones_3",
        Random,
        Even,
        "3 expensive ones",
        "marble sidewalk voronoi_floor",
    ),
    mix(
        "stones_3c",
        Coherent,
        Even,
        "3 expensive ones",
        "marble sidewalk voronoi_floor",
    ),
    mix(
        "lobes_3",
        Random,
        Skewed,
        "many lobes, no patterns",
        "lacquer alloy velvet",
    ),
    mix(
        "cheap_4",
        Random,
        Even,
        "4 cheap ones",
        "matte plastic gold two_layer",
    ),
    mix(
        "cheap_4c",
        Coherent,
        Skewed,
        "4 cheap ones",
        "dots weave mirror plastic",
    ),
    mix(
        "loops_4",
        Random,
        Even,
        "4 loops",
        "julia march newton collatz",
    ),
    mix(
        "each_5",
        Random,
        Skewed,
        "one of each",
        "two_layer spectral wood hashes newton",
    ),
    mix(
        "each_5c",
        Coherent,
        Even,
        "one of each",
        "gold wide hammered lacquer march",
    ),
    mix(
        "loops_6",
        Random,
        Skewed,
        "2 loops and 4 cheap ones",
        "matte gold mtl dots mandelbrot_wall march",
    ),
    mix(
        "loops_6c",
        Coherent,
        Even,
        "2 loops and 4 cheap ones",
        "mtl weave two_layer mirror collatz julia",
    ),
    mix(
        "dear_6",
        Random,
        Even,
        "6 expensive ones",
        "car_paint marble asphalt wood hammered cells",
    ),
    mix(
        "dear_6c",
        Coherent,
        Skewed,
        "6 expensive ones",
        "fbm_16 cells wide voronoi_floor spectral sidewalk",
    ),
    mix(
        "cheap_8",
        Random,
        Even,
        "8 cheap ones",
        "matte plastic gold two_layer mtl dots weave mirror",
    ),
    mix(
        "unlike_8",
        Random,
        Skewed,
        "5 cheap and 3 expensive ones",
        "mtl matte gold weave two_layer car_paint wood fbm_8",
    ),
    mix(
        "unlike_8c",
        Coherent,
        Even,
        "5 cheap and 3 expensive ones",
        "plastic dots mirror weave matte marble asphalt cells",
    ),
    mix(
        "many_12",
        Random,
        Skewed,
        "12 of all sorts",
        "mtl matte gold plastic checker_tiles brushed_metal velvet car_paint marble fbm_4 newton hashes",
    ),
    mix("kinds_32", Random, Even, "32 of middling cost", "kinds 32"),
    mix(
        "kinds_64c",
        Coherent,
        Even,
        "64 of middling cost",
        "kinds 64",
    ),
];

/// Evaluations of noise in the materials `fbm_N`.
const NOISES: [usize; 3] = [4, 8, 16];

/// Everything: two models, the materials that `materials/` has none of, and the scenes.
pub(crate) fn files() -> Vec<GeneratedFile> {
    let mut files = model_files(FOLDER, "room", &places::room());
    files.extend(model_files(FOLDER, "booths", &places::booths()));
    let mut push = |name: String, text: String| {
        files.push(GeneratedFile {
            path: format!("{FOLDER}/{name}"),
            bytes: text.into_bytes(),
        });
    };
    for (name, text) in generated_materials() {
        push(format!("{name}.impasto"), text);
    }
    for mix in &MIXES {
        push(format!("{}.toml", mix.name), scene(mix));
    }
    push("index.json".into(), index());
    files
}

/// The list of scenes, as JSON.
pub(crate) fn index() -> String {
    let entries: Vec<String> = MIXES.iter().map(entry).collect();
    format!("[\n{}\n]\n", entries.join(",\n"))
}

/// Names and texts of the materials beside the scenes.
fn generated_materials() -> Vec<(String, String)> {
    let mut out = materials::all();
    for n in NOISES {
        let name = format!("fbm_{n}");
        let text = crossover::noisy_material(&name, n);
        out.push((name, text));
    }
    for i in 0..64 {
        let name = format!("kind_{i:02}");
        let text = crossover::kind_material(&name, i);
        out.push((name, text));
    }
    out
}

impl Mix {
    /// Its materials by name.
    fn materials(&self) -> Vec<String> {
        let count = self
            .materials
            .strip_prefix("kinds ")
            .and_then(|n| n.parse().ok());
        match count {
            Some(n) => (0..n)
                .map(|k| format!("kind_{:02}", crossover::spread(k)))
                .collect(),
            None => self.materials.split(' ').map(String::from).collect(),
        }
    }

    /// How many of the places each material has: at least one.
    fn places(&self) -> Vec<usize> {
        let count = self.materials().len();
        let weight = |k: usize| match self.shares {
            Even => 1.0,
            Skewed => 1.0 / ((k + 1) * (k + 1)) as f64,
        };
        let total: f64 = (0..count).map(weight).sum();
        let spare = (PLACES.len() - count) as f64;
        let whole = |k: usize| 1 + (spare * weight(k) / total) as usize;
        let left = PLACES.len() - (0..count).map(whole).sum::<usize>();
        // Rounding down leaves fewer than there are materials; the first take one each.
        (0..count)
            .map(|k| whole(k) + usize::from(k < left))
            .collect()
    }
}

fn entry(mix: &Mix) -> String {
    format!(
        "  {{ \"name\": \"{name}\", \"scene\": \"{name}.toml\", \"about\": \"{}\", \"hits\": \"{}\", \
         \"shares\": \"{}\", \"materials\": [\"{}\"] }}",
        mix.about,
        match mix.hits {
            Random => "random",
            Coherent => "coherent",
        },
        match mix.shares {
            Even => "even",
            Skewed => "skewed",
        },
        mix.materials().join("\", \""),
        name = mix.name,
    )
}

/// The room has no opening. Paths in the booths are short, so that neighbours begin and end together.
const ROOM: &str =
    "camera = { position = [-1.75, 1.5, 1.8], look_at = [0.2, 1.35, -0.4], fov = 62.0 }
film = { width = 1024, height = 1024 }
geometry = [{ obj = \"room.obj\" }]

[[lights]]
kind = \"quad\"
corner = [-0.8, 2.98, -0.8]
u = [1.6, 0.0, 0.0]
v = [0.0, 0.0, 1.6]
radiance = [14.0, 13.2, 12.0]
";

const BOOTHS: &str =
    "camera = { position = [0.0, 0.0, 8.0], look_at = [0.0, 0.0, 0.0], fov = 28.0 }
film = { width = 1024, height = 1024 }
integrator = { max_depth = 6 }
geometry = [{ obj = \"booths.obj\" }]

[environment]
color = [0.2, 0.22, 0.25]

[[lights]]
kind = \"quad\"
corner = [-2.0, -2.0, 9.0]
u = [0.0, 4.0, 0.0]
v = [4.0, 0.0, 0.0]
radiance = [40.0, 38.0, 35.0]
";

/// The text of a scene: each material has a run of neighbouring places.
fn scene(mix: &Mix) -> String {
    let setting = match mix.hits {
        Random => ROOM,
        Coherent => BOOTHS,
    };
    let mut out = format!(
        "# Generated by `cargo xtask scenes mixes`: {}.\n\nname = \"{}\"\n\n{setting}\n[materials]\n",
        mix.about, mix.name
    );
    let mut places = PLACES.iter();
    for (material, count) in mix.materials().iter().zip(mix.places()) {
        for place in places.by_ref().take(count) {
            let params = match material.as_str() {
                "mtl" => tint(place),
                _ => String::new(),
            };
            let _ = writeln!(out, "{place} = {{ file = \"{}\"{params} }}", file(material));
        }
    }
    out
}

/// Values that differ from place to place, as those of a material library do: what all bindings agree on would
/// become part of the code.
fn tint(place: &str) -> String {
    let number: u32 = place.trim_start_matches('s').parse().unwrap_or(0);
    let level = |step: u32| 0.2 + 0.01 * f64::from(number * step % 64);
    format!(
        ", params = {{ kd = [{:.2}, {:.2}, {:.2}], ks = [{ks:.3}, {ks:.3}, {ks:.3}], ns = {} }}",
        level(1),
        level(5),
        level(11),
        10 + 3 * number,
        ks = 0.2 * level(3),
    )
}

/// Where a material is, as a scene names it.
fn file(material: &str) -> String {
    match generated_materials()
        .iter()
        .any(|(name, _)| name == material)
    {
        true => format!("{material}.impasto"),
        false => format!("../../../materials/{material}.impasto"),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::shell;

    #[test]
    fn every_place_of_a_scene_has_a_material_that_is_there() {
        for mix in &MIXES {
            let text = scene(mix);
            let bound = text.lines().filter(|line| line.contains("file = "));
            assert_eq!(bound.count(), PLACES.len(), "{}", mix.name);
            assert_eq!(
                mix.places().iter().sum::<usize>(),
                PLACES.len(),
                "{}",
                mix.name
            );
            let made = generated_materials();
            for material in mix.materials() {
                let committed = format!("materials/{material}.impasto");
                let known = shell::root().join(committed).exists();
                let generated = made.iter().any(|(name, _)| *name == material);
                assert!(known != generated, "{material} of {}", mix.name);
            }
        }
    }

    #[test]
    fn shares_are_what_they_are_called() {
        for mix in &MIXES {
            let places = mix.places();
            let (most, least) = (places.iter().max(), places.iter().min());
            let most = *most.expect("materials");
            let least = *least.expect("materials");
            match mix.shares {
                Even => assert!(most - least <= 1, "{}: {places:?}", mix.name),
                Skewed => assert!(
                    most > 2 * least && places.is_sorted_by(|a, b| a >= b),
                    "{places:?}"
                ),
            }
        }
    }

    #[test]
    fn the_mixes_cover_what_the_experiment_is_about() {
        let names: BTreeSet<&str> = MIXES.iter().map(|mix| mix.name).collect();
        assert_eq!(names.len(), MIXES.len());
        let small = |mix: &&Mix| mix.materials().len() <= 8;
        assert!(MIXES.iter().filter(small).count() >= 14);
        for hits in [Random, Coherent] {
            let sizes = MIXES
                .iter()
                .filter(|m| m.hits == hits)
                .map(|m| m.materials().len());
            let sizes: BTreeSet<usize> = sizes.collect();
            assert!(
                sizes.len() >= 5 && sizes.contains(&6) && sizes.contains(&8),
                "{hits:?}: {sizes:?}"
            );
        }
        let distinct: BTreeSet<String> = MIXES
            .iter()
            .filter(small)
            .flat_map(Mix::materials)
            .collect();
        assert!(distinct.len() >= 24, "{distinct:?}");
    }
}
