//! MTL files: the values of their materials that a scene can bind to parameters.

use std::path::Path;

use super::description::{array_source, float_source};
use crate::error::SceneError;

/// A value of an MTL material, written `$Kd` and so on in a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MtlValue {
    Kd,
    Ks,
    Ke,
    Ns,
    Ni,
    D,
    MapKd,
}

impl MtlValue {
    pub(super) const ALL: [MtlValue; 7] = [
        MtlValue::Kd,
        MtlValue::Ks,
        MtlValue::Ke,
        MtlValue::Ns,
        MtlValue::Ni,
        MtlValue::D,
        MtlValue::MapKd,
    ];

    /// The key in MTL files.
    pub(super) fn name(self) -> &'static str {
        match self {
            MtlValue::Kd => "Kd",
            MtlValue::Ks => "Ks",
            MtlValue::Ke => "Ke",
            MtlValue::Ns => "Ns",
            MtlValue::Ni => "Ni",
            MtlValue::D => "d",
            MtlValue::MapKd => "map_Kd",
        }
    }

    /// The value in `mtl` as an Impasto constant expression, or what stands for a value that is
    /// not given. `None` leaves the parameter at its default. Pictures are resolved against
    /// `folder`, that of the MTL file.
    pub(super) fn source(self, mtl: Option<&tobj::Material>, folder: &Path) -> Option<String> {
        let color = |value: Option<[f64; 3]>, missing| array_source(&value.unwrap_or([missing; 3]));
        let float = |value: Option<f64>, missing| float_source(value.unwrap_or(missing) as f32);
        Some(match self {
            MtlValue::Kd => color(mtl.and_then(|m| m.diffuse), 0.8),
            MtlValue::Ks => color(mtl.and_then(|m| m.specular), 0.0),
            MtlValue::Ke => color(mtl.and_then(|m| m.emissive), 0.0),
            MtlValue::Ns => float(mtl.and_then(|m| m.shininess), 10.0),
            MtlValue::Ni => float(mtl.and_then(|m| m.optical_density), 1.5),
            MtlValue::D => float(mtl.and_then(|m| m.dissolve), 1.0),
            MtlValue::MapKd => {
                let file = mtl?.diffuse_texture.as_ref()?;
                format!("\"{}\"", folder.join(file).to_str()?)
            }
        })
    }
}

/// Reads the materials of an MTL file.
pub(super) fn load(path: &Path) -> Result<Vec<tobj::Material>, SceneError> {
    let bytes = std::fs::read(path)
        .map_err(|e| SceneError::in_file(path, format!("cannot read the MTL file: {e}")))?;
    let text = normalise(path, &String::from_utf8_lossy(&bytes))?;
    let (materials, _) = tobj::load_mtl_buf(&mut text.as_bytes())
        .map_err(|e| SceneError::in_file(path, format!("not a valid MTL file: {e}")))?;
    Ok(materials)
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
            "Ns" | "Ni" | "d" | "Tr" => {
                let last = rest.split_whitespace().last().and_then(finite);
                let value = last.ok_or_else(|| error("a finite number"))?;
                match key {
                    "Tr" => out += &format!("d {}\n", 1.0 - value),
                    _ => out += &format!("{key} {value}\n"),
                }
            }
            "map_Kd" => {
                let file = picture_name(rest).ok_or_else(|| error("a file"))?;
                out += &format!("map_Kd {file}\n");
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
                    map_Kd -s 2 2 -clamp on -o 0.5 wood\\old oak.png\nillum 2\nnewmtl plain\n";
        let text = normalise(Path::new("a.mtl"), text).expect("it is valid");
        let (materials, _) = tobj::load_mtl_buf(&mut text.as_bytes()).expect("tobj reads it");
        let source =
            |value: MtlValue, m: usize| value.source(Some(&materials[m]), Path::new("tex"));
        assert_eq!(materials[0].name, "a b");
        let first: Vec<_> = MtlValue::ALL
            .map(|v| source(v, 0).unwrap_or_default())
            .into();
        let expected = [
            "color(0.5, 0.5, 0.5)",
            "color(0.1, 0.2, 0.3)",
            "color(0.0, 0.0, 0.0)",
            "12.0",
            "1.5",
            "0.75",
            "\"tex/wood/old oak.png\"",
        ];
        assert_eq!(first, expected);
        assert_eq!(
            source(MtlValue::Kd, 1).as_deref(),
            Some("color(0.8, 0.8, 0.8)")
        );
        assert_eq!(source(MtlValue::MapKd, 1), None);
    }
}
