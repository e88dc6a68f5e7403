//! MTL files, which say what the materials of OBJ files look like.

use std::path::Path;

use impasto_compiler::ParameterValue;

use crate::error::SceneError;
use crate::input;
use crate::scene::formats::{FileMaterial, FileValue};

/// The values that are read, by their keys in MTL files.
pub(super) const VALUES: &[FileValue] = &[
    value("Kd", &[0.8; 3]),
    value("Ks", &[0.0; 3]),
    value("Ke", &[0.0; 3]),
    value("Ns", &[10.0]),
    value("Ni", &[1.5]),
    value("d", &[1.0]),
    value("Pr", &[]),
    value("Pm", &[]),
    value("map_Kd", &[]),
    value("map_Ks", &[]),
    value("map_Ke", &[]),
    value("map_Ns", &[]),
    value("map_d", &[]),
    value("map_Pr", &[]),
    value("map_Pm", &[]),
    value("map_Bump", &[]),
    value("norm", &[]),
];

/// Numbers that tobj does not know, as it leaves them.
const NUMBERS: [&str; 2] = ["Pr", "Pm"];
/// The same of pictures.
const PICTURES: [&str; 8] = [
    "map_Ks", "map_Ke", "map_Ns", "map_d", "map_Pr", "map_Pm", "map_Bump", "norm",
];

const fn value(name: &'static str, fallback: &'static [f64]) -> FileValue {
    FileValue { name, fallback }
}

/// Reads the materials of the MTL file `name`, which is relative to the folder `base` of the scene.
pub(super) fn load(base: &Path, name: &Path) -> Result<Vec<FileMaterial>, SceneError> {
    let path = &base.join(name);
    let bytes = input::read(path).map_err(|e| {
        SceneError::in_file(
            path,
            format!("cannot read the MTL file: {}", input::reason(&e)),
        )
    })?;
    let text = normalise(path, &String::from_utf8_lossy(&bytes))?;
    let (materials, _) = tobj::load_mtl_buf(&mut text.as_bytes())
        .map_err(|e| SceneError::in_file(path, format!("not a valid MTL file: {e}")))?;
    let folder = name.parent().unwrap_or(Path::new(""));
    Ok(materials.into_iter().map(|m| read(m, folder)).collect())
}

/// What a material says, with its pictures in `folder`.
fn read(material: tobj::Material, folder: &Path) -> FileMaterial {
    let color = |name, value: Option<[f64; 3]>| {
        value.map(|rgb| (name, ParameterValue::Floats(rgb.to_vec())))
    };
    let float = |name, value: Option<f64>| value.map(|x| (name, ParameterValue::Float(x)));
    let picture = |name, file: Option<String>| {
        let path = folder.join(file?).to_str()?.to_owned();
        Some((name, ParameterValue::Texture(path)))
    };
    let other = |name: &str| {
        material
            .unknown_param
            .get(&format!("other_{name}"))
            .cloned()
    };
    let numbers = NUMBERS.map(|name| float(name, other(name).and_then(|x| x.parse().ok())));
    let pictures = PICTURES.map(|name| picture(name, other(name)));
    let values = [
        color("Kd", material.diffuse),
        color("Ks", material.specular),
        color("Ke", material.emissive),
        float("Ns", material.shininess),
        float("Ni", material.optical_density),
        float("d", material.dissolve),
        picture("map_Kd", material.diffuse_texture),
    ];
    FileMaterial {
        name: material.name,
        values: values
            .into_iter()
            .chain(numbers)
            .chain(pictures)
            .flatten()
            .collect(),
    }
}

/// The lines that matter here, in the one form that tobj reads; it knows no line numbers for
/// errors and panics on colors of one component.
fn normalise(path: &Path, text: &str) -> Result<String, SceneError> {
    let mut out = String::with_capacity(text.len());
    for (index, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default().trim();
        let (key, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        let error = |expected: &str| {
            let message = format!("`{key}` must be followed by {expected}, not `{rest}`");
            SceneError::in_file(path, message).line(index + 1)
        };
        match key {
            "newmtl" if rest.is_empty() => return Err(error("a name")),
            "newmtl" => out += &format!("newmtl {rest}\n"),
            // Spectra and CIE XYZ are legal and rare; the fallback stands for them.
            "Kd" | "Ks" | "Ke" if rest.starts_with("spectral") || rest.starts_with("xyz") => {}
            "Kd" | "Ks" | "Ke" => {
                let rgb = color(rest).ok_or_else(|| error("three finite numbers"))?;
                out += &format!("{key} {} {} {}\n", rgb[0], rgb[1], rgb[2]);
            }
            "Ns" | "Ni" | "d" | "Tr" | "Pr" | "Pm" => {
                let last = rest.split_whitespace().last().and_then(finite);
                let value = last.ok_or_else(|| error("a finite number"))?;
                match key {
                    "Tr" => out += &format!("d {}\n", 1.0 - value),
                    "Pr" | "Pm" => out += &format!("other_{key} {value}\n"),
                    _ => out += &format!("{key} {value}\n"),
                }
            }
            // The other names that programs write a bump map by.
            "bump" | "map_bump" => {
                let file = picture_name(rest).ok_or_else(|| error("a file"))?;
                out += &format!("other_map_Bump {file}\n");
            }
            "map_Kd" => {
                let file = picture_name(rest).ok_or_else(|| error("a file"))?;
                out += &format!("map_Kd {file}\n");
            }
            key if PICTURES.contains(&key) => {
                let file = picture_name(rest).ok_or_else(|| error("a file"))?;
                out += &format!("other_{key} {file}\n");
            }
            _ => {}
        }
    }
    Ok(out)
}

fn finite(word: &str) -> Option<f32> {
    word.parse().ok().filter(|v: &f32| v.is_finite())
}

/// Three components, or one that stands for all.
fn color(text: &str) -> Option<[f32; 3]> {
    let values: Option<Vec<f32>> = text.split_whitespace().map(finite).collect();
    match values?[..] {
        [grey] => Some([grey; 3]),
        [r, g, b] => Some([r, g, b]),
        _ => None,
    }
}

/// The file of a `map_` line, after its options, with forward slashes.
fn picture_name(text: &str) -> Option<String> {
    let mut rest = text;
    while let Some(option) = rest
        .split_whitespace()
        .next()
        .filter(|w| w.starts_with('-'))
    {
        rest = rest[option.len()..].trim_start();
        // -o, -s and -t take one to three numbers, -mm two words, all others one.
        let most = match option {
            "-o" | "-s" | "-t" => 3,
            "-mm" => 2,
            _ => 1,
        };
        for taken in 0..most {
            let word = rest.split_whitespace().next()?;
            if taken > 0 && finite(word).is_none() {
                break;
            }
            rest = rest[word.len()..].trim_start();
        }
    }
    // A quote would end the Impasto string that the name becomes.
    let usable = !rest.is_empty() && !rest.contains('"');
    usable.then(|| rest.replace('\\', "/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_of_a_value_is_read() {
        let text = "newmtl a b\nKd 0.5\nKs 0.1 0.2 0.3 # shiny\nKe spectral x.rfl\nNs 12\nTr 0.25\n\
                    map_Kd -s 2 2 -clamp on -o 0.5 wood\\old oak.png\nillum 2\nPr 0.3\nPm 1\n\
                    bump -bm 0.5 dents.png\nmap_Pr rough.png\nnewmtl plain\n";
        let text = normalise(Path::new("a.mtl"), text).expect("it is valid");
        let (materials, _) = tobj::load_mtl_buf(&mut text.as_bytes()).expect("tobj reads it");
        let materials: Vec<FileMaterial> = materials
            .into_iter()
            .map(|m| read(m, Path::new("tex")))
            .collect();
        assert_eq!(materials[0].name, "a b");
        let values = |material: &FileMaterial| -> Vec<String> {
            let values = VALUES.iter().map(|v| v.of(Some(material)));
            values
                .map(|v| v.map_or(String::new(), |v| v.to_string()))
                .collect()
        };
        let expected = [
            "color(0.5, 0.5, 0.5)",
            "color(0.1, 0.2, 0.3)",
            "color(0.0, 0.0, 0.0)",
            "12.0",
            "1.5",
            "0.75",
            "0.3",
            "1.0",
            "\"tex/wood/old oak.png\"",
            "",
            "",
            "",
            "",
            "\"tex/rough.png\"",
            "",
            "\"tex/dents.png\"",
            "",
        ];
        assert_eq!(values(&materials[0]), expected);
        let plain = values(&materials[1]);
        assert_eq!((&plain[0][..], &plain[8][..]), ("color(0.8, 0.8, 0.8)", ""));
    }
}
