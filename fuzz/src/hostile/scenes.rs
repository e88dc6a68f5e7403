//! Scenes with changed lines: wrong types, numbers that are too large or none, names of files that are not
//! there or lead back to the scene.

use crate::Random;
use crate::mutate::{mutate, revalue};

/// Values to put in the place of others.
const VALUES: &[&str] = &[
    "0",
    "-0.0",
    "1",
    "-1",
    "1e308",
    "-1e308",
    "1e-320",
    "nan",
    "inf",
    "-inf",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "-9223372036854775808",
    "3.4e38",
    "true",
    "\"\"",
    "\"x\"",
    "[]",
    "{}",
    "[0, 0, 0]",
    "[1e38, 1e38, 1e38]",
    "[nan, nan, nan]",
    "[inf, 0, 0]",
    "[1, 2]",
    "[1, 2, 3, 4]",
    "[[1, 2, 3]]",
    "[0, 1, \"x\"]",
    "1979-05-27",
    "\"scene.toml\"",
    "\".\"",
    "\"..\"",
    "\"/\"",
    "\"/dev/null\"",
    "\"/dev/zero\"",
    "\"missing.obj\"",
    "\"missing.impasto\"",
    "\"scene.toml\\u0000\"",
    "\"$Kd\"",
    "\"$missing\"",
    "{ file = \"scene.toml\" }",
    "\"*\"",
    "[1e30, 1e30, 1e30]",
    "1e12",
    "65536",
    "[0.0, 0.0, 1e-30]",
    "180",
    "179.99999999",
    "1e-30",
];

/// Keys and heads of tables of scenes.
const WORDS: &[&str] = &[
    "[camera]",
    "[film]",
    "[integrator]",
    "[environment]",
    "[[geometry]]",
    "[[lights]]",
    "[materials.\"*\"]",
    "[materials.x]",
    "[[placements]]",
    "position",
    "look_at",
    "up",
    "fov",
    "width",
    "height",
    "max_depth",
    "obj",
    "gltf",
    "file",
    "material",
    "params",
    "kind",
    "corner",
    "u",
    "v",
    "radiance",
    "direction",
    "color",
    "scale",
    "rotate",
    "translate",
    "transform",
    "group",
    "sample",
    "placements",
    "quad",
    "distant",
    "share",
    "=",
    "[",
    "]",
    "{",
    "}",
    ",",
    "\"",
    "\"\"\"",
    "'",
    "#",
    ".",
    "\n",
];

/// A scene with one to six changes.
pub(super) fn mutated(random: &mut Random, scene: &[u8], others: &[Vec<u8>]) -> Vec<u8> {
    match random.below(8) {
        0 => return mutate(random, scene, others, WORDS),
        1..6 => return revalue(random, scene, VALUES),
        _ => {}
    }
    let text = String::from_utf8_lossy(scene).into_owned();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for _ in 0..=random.below(2) {
        let at = random.below(lines.len());
        let Some(line) = lines.get(at).cloned() else {
            break;
        };
        match random.below(8) {
            0..5 => {
                let value = random.one(VALUES).unwrap_or_default();
                if let Some((key, _)) = line.split_once('=') {
                    lines[at] = format!("{key}= {value}");
                } else if !line.starts_with('[') {
                    let key = random.one(WORDS).unwrap_or_default();
                    lines.insert(at, format!("{key} = {value}"));
                }
            }
            5 => drop(lines.remove(at)),
            6 => lines.insert(random.below(lines.len() + 1), line),
            _ => {
                let other = &others[random.below(others.len())];
                let other = String::from_utf8_lossy(other).into_owned();
                let taken: Vec<&str> = other.lines().collect();
                let line = random.one(&taken).unwrap_or_default().to_owned();
                lines.insert(at, line);
            }
        }
    }
    (lines.join("\n") + "\n").into_bytes()
}
