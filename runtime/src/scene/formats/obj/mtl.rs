//! MTL files, which say what the materials of OBJ files look like: the classic statements, and those that
//! programs added for physically based materials.
//!
//! They are read here and not by tobj, which tells no line numbers and panics on colors of one component.

use std::collections::BTreeMap;
use std::path::Path;

use impasto_compiler::ParameterValue;

use crate::error::SceneError;
use crate::input;
use crate::scene::formats::{FileMaterial, FileValue, Warning};

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
    value("Ps", &[]),
    value("Pc", &[]),
    value("Pcr", &[]),
    value("aniso", &[]),
    value("anisor", &[]),
    value("bm", &[1.0]),
    value("map_Kd", &[]),
    value("map_Ks", &[]),
    value("map_Ke", &[]),
    value("map_Ns", &[]),
    value("map_d", &[]),
    value("map_Pr", &[]),
    value("map_Pm", &[]),
    value("map_Ps", &[]),
    value("map_Bump", &[]),
    value("norm", &[]),
];

const COLORS: [&str; 3] = ["Kd", "Ks", "Ke"];
const NUMBERS: [&str; 10] = [
    "Ns", "Ni", "d", "Pr", "Pm", "Ps", "Pc", "Pcr", "aniso", "anisor",
];
const PICTURES: [&str; 10] = [
    "map_Kd", "map_Ks", "map_Ke", "map_Ns", "map_d", "map_Pr", "map_Pm", "map_Ps", "map_Bump",
    "norm",
];
/// The same by other names.
const OTHER_NAMES: [(&str, &str); 4] = [
    ("bump", "map_Bump"),
    ("map_bump", "map_Bump"),
    ("map_Disp", "disp"),
    ("map_disp", "disp"),
];
/// What would change a picture, but has no counterpart here. `Ka`, `illum` and the like would not.
const UNUSED: [&str; 7] = [
    "Tf", "decal", "disp", "map_Pc", "map_Pcr", "map_refl", "refl",
];

const fn value(name: &'static str, fallback: &'static [f64]) -> FileValue {
    FileValue { name, fallback }
}

/// What an MTL file says.
#[derive(Debug, Default)]
pub(super) struct Mtl {
    pub(super) materials: Vec<FileMaterial>,
    pub(super) warnings: Vec<Warning>,
}

/// Reads the MTL file `name`, which is relative to the folder `base` of the scene.
pub(super) fn load(base: &Path, name: &Path) -> Result<Mtl, SceneError> {
    let path = &base.join(name);
    let bytes = input::read(path).map_err(|e| {
        SceneError::in_file(
            path,
            format!("cannot read the MTL file: {}", input::reason(&e)),
        )
    })?;
    let folder = name.parent().unwrap_or(Path::new(""));
    let mut reader = Reader::new(folder);
    let text = String::from_utf8_lossy(&bytes);
    for (index, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        reader
            .line(index + 1, line)
            .map_err(|message| SceneError::in_file(path, message).line(index + 1))?;
    }
    Ok(Mtl {
        warnings: reader.warnings(name),
        materials: reader.materials,
    })
}

/// What the lines up to some line say.
struct Reader<'f> {
    /// Where the pictures are.
    folder: &'f Path,
    materials: Vec<FileMaterial>,
    /// What is not used, with the line that has it first.
    unused: BTreeMap<String, usize>,
}

impl<'f> Reader<'f> {
    fn new(folder: &'f Path) -> Self {
        Reader {
            folder,
            materials: Vec::new(),
            unused: BTreeMap::new(),
        }
    }

    fn line(&mut self, number: usize, line: &str) -> Result<(), String> {
        let line = line.split('#').next().unwrap_or_default().trim();
        let (written, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        let mut others = OTHER_NAMES.iter();
        let key = others
            .find(|(other, _)| *other == written)
            .map_or(written, |(_, key)| key);
        let malformed =
            |expected: &str| format!("`{written}` must be followed by {expected}, not `{rest}`");
        if key == "newmtl" {
            if rest.is_empty() {
                return Err(malformed("a name"));
            }
            self.materials.push(FileMaterial {
                name: rest.to_owned(),
                ..FileMaterial::default()
            });
        } else if UNUSED.contains(&key) {
            self.unused(number, format!("`{key}`"));
        } else if COLORS.contains(&key) {
            if rest.starts_with("spectral") || rest.starts_with("xyz") {
                // Legal and rare; the fallback stands for them.
                self.unused(number, format!("`{key}` as a spectrum or CIE XYZ"));
            } else {
                let rgb = color(rest).ok_or_else(|| malformed("three finite numbers"))?;
                self.set(key, ParameterValue::Floats(rgb.to_vec()));
            }
        } else if key == "Tr" || NUMBERS.contains(&key) {
            let last = rest.split_whitespace().last().and_then(finite);
            let value = last.ok_or_else(|| malformed("a finite number"))?;
            match key {
                "Tr" => self.set("d", ParameterValue::Float(1.0 - value)),
                _ => self.set(key, ParameterValue::Float(value)),
            }
        } else if PICTURES.contains(&key) {
            let picture = picture(rest).ok_or_else(|| malformed("a file"))?;
            self.picture(number, key, &picture);
        }
        Ok(())
    }

    fn picture(&mut self, number: usize, key: &str, picture: &Picture) {
        for option in &picture.unused {
            self.unused(number, format!("the option `{option}` of `{key}`"));
        }
        if let Some(height) = picture.height {
            self.set("bm", ParameterValue::Float(height));
        }
        if let Some(file) = self.folder.join(&picture.file).to_str() {
            self.set(key, ParameterValue::Texture(file.to_owned()));
        }
    }

    /// Sets a value of the last material. Of several the last counts.
    fn set(&mut self, key: &str, value: ParameterValue) {
        let name = VALUES.iter().find(|value| value.name == key);
        let (Some(FileValue { name, .. }), Some(material)) = (name, self.materials.last_mut())
        else {
            return;
        };
        material.values.retain(|(known, _)| known != name);
        material.values.push((name, value));
    }

    fn unused(&mut self, line: usize, what: String) {
        self.unused.entry(what).or_insert(line);
    }

    /// Tells each thing that is not used once.
    fn warnings(&self, name: &Path) -> Vec<Warning> {
        let warning = |(what, line): (&String, &usize)| Warning {
            line: None,
            message: format!("{}:{line}: {what} is not used", name.display()),
        };
        self.unused.iter().map(warning).collect()
    }
}

fn finite(word: &str) -> Option<f64> {
    word.parse().ok().filter(|v: &f64| (*v as f32).is_finite())
}

/// Three components, or one that stands for all.
fn color(text: &str) -> Option<[f64; 3]> {
    let values: Option<Vec<f64>> = text.split_whitespace().map(finite).collect();
    match values?[..] {
        [grey] => Some([grey; 3]),
        [r, g, b] => Some([r, g, b]),
        _ => None,
    }
}

/// What a `map_` line says.
#[derive(Debug, Default)]
struct Picture {
    /// The file, with forward slashes.
    file: String,
    /// What its heights are multiplied by: the number of `-bm`.
    height: Option<f64>,
    /// The options that have no effect and should.
    unused: Vec<&'static str>,
}

/// Options of `map_` lines whose default is no effect, with how many words follow at most.
const OPTIONS: [(&str, usize); 9] = [
    ("-o", 3),
    ("-s", 3),
    ("-t", 3),
    ("-mm", 2),
    ("-clamp", 1),
    ("-cc", 1),
    ("-boost", 1),
    ("-imfchan", 1),
    ("-type", 1),
];

/// Reads the options and the file of a `map_` line.
fn picture(text: &str) -> Option<Picture> {
    let mut picture = Picture::default();
    let mut rest = text;
    while let Some(option) = rest
        .split_whitespace()
        .next()
        .filter(|word| word.starts_with('-'))
    {
        rest = rest[option.len()..].trim_start();
        let known = OPTIONS.iter().find(|(name, _)| *name == option);
        let most = known.map_or(1, |(_, most)| *most);
        let mut values = Vec::new();
        for taken in 0..most {
            let word = rest.split_whitespace().next()?;
            if taken > 0 && finite(word).is_none() {
                break;
            }
            values.push(word);
            rest = rest[word.len()..].trim_start();
        }
        match known {
            _ if option == "-bm" => picture.height = values.first().copied().and_then(finite),
            Some((name, _)) if !is_default(name, &values) => picture.unused.push(name),
            _ => {}
        }
    }
    // A quote would end the Impasto string that the name becomes.
    let usable = !rest.is_empty() && !rest.contains('"');
    picture.file = rest.replace('\\', "/");
    usable.then_some(picture)
}

/// Do the values of an option say what holds without it?
fn is_default(option: &str, values: &[&str]) -> bool {
    let are = |number: f64| values.iter().all(|word| finite(word) == Some(number));
    match option {
        "-o" | "-t" | "-boost" => are(0.0),
        "-s" => are(1.0),
        "-mm" => values.iter().map(|w| finite(w)).eq([Some(0.0), Some(1.0)]),
        "-clamp" | "-cc" => values == ["off"],
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Reader<'_> {
        let mut reader = Reader::new(Path::new("tex"));
        for (index, line) in text.lines().enumerate() {
            reader.line(index + 1, line).expect(line);
        }
        reader
    }

    /// The values of a material under `keys`, as text.
    fn values(material: &FileMaterial, keys: &[&str]) -> Vec<String> {
        let value = |key: &&str| VALUES.iter().find(|v| v.name == *key).expect(key);
        let text = |value: &FileValue| value.of(Some(material)).map(|v| v.to_string());
        let texts = keys.iter().map(|key| text(value(key)).unwrap_or_default());
        texts.collect()
    }

    #[test]
    fn every_form_of_a_value_is_read() {
        let reader = read(
            "Kd 9\nnewmtl a b\nKd 0.5\nKs 0.1 0.2 0.3 # shiny\nKe spectral x.rfl\nNs 12\nTr 0.25\n\
             map_Kd -s 2 2 -clamp on -o 0.5 wood\\old oak.png\nillum 2\nPr 0.3\nPm 1\n\
             bump -bm 0.5 dents.png\nmap_Pr rough.png\nnewmtl plain\n",
        );
        let keys = [
            "Kd", "Ks", "Ke", "Ns", "Ni", "d", "Pr", "Pm", "map_Kd", "map_Ks",
        ];
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
        ];
        assert_eq!(reader.materials[0].name, "a b");
        assert_eq!(values(&reader.materials[0], &keys), expected);
        let pictures = ["map_Pr", "map_Bump", "bm"];
        let expected = ["\"tex/rough.png\"", "\"tex/dents.png\"", "0.5"];
        assert_eq!(values(&reader.materials[0], &pictures), expected);
        let plain = values(&reader.materials[1], &["Kd", "map_Kd", "Pr", "bm"]);
        assert_eq!(plain, ["color(0.8, 0.8, 0.8)", "", "", "1.0"]);
    }

    #[test]
    fn physically_based_values_are_read() {
        let reader = read(
            "newmtl a\nPs 0.1\nPc 0.2\nPcr 0.3\naniso 0.4\nanisor 0.5\nmap_Ke e.png\nmap_Pm m.png\n\
             map_Ps s.png\nmap_d d.png\nnorm n.png\nPc 0.9\n",
        );
        let keys = [
            "Ps", "Pc", "Pcr", "aniso", "anisor", "map_Ke", "map_Pm", "map_Ps", "map_d", "norm",
        ];
        let expected = [
            "0.1",
            "0.9",
            "0.3",
            "0.4",
            "0.5",
            "\"tex/e.png\"",
            "\"tex/m.png\"",
            "\"tex/s.png\"",
            "\"tex/d.png\"",
            "\"tex/n.png\"",
        ];
        assert_eq!(values(&reader.materials[0], &keys), expected);
        assert_eq!(reader.unused.len(), 0);
    }

    #[test]
    fn what_is_not_used_is_told_once() {
        let reader = read(
            "newmtl a\nKa 1 1 1\nillum 2\nmap_Kd -s 2 2 2 a.png\nmap_Disp d.png\nKe xyz 1 1 1\n\
             newmtl b\ndisp d.png\nmap_Kd -s 3 -o 0 0 0 -mm 0 1 -blendu on a.png\n\
             norm -clamp on n.png\nTf 1 1 0\nwhatever 3\n",
        );
        let warnings = reader.warnings(Path::new("m.mtl"));
        let told: Vec<&str> = warnings.iter().map(|w| &*w.message).collect();
        let expected = [
            "m.mtl:6: `Ke` as a spectrum or CIE XYZ is not used",
            "m.mtl:11: `Tf` is not used",
            "m.mtl:5: `disp` is not used",
            "m.mtl:10: the option `-clamp` of `norm` is not used",
            "m.mtl:4: the option `-s` of `map_Kd` is not used",
        ];
        assert_eq!(told, expected);
    }

    #[test]
    fn lines_without_their_values_are_errors() {
        let said = |line: &str| Reader::new(Path::new("")).line(1, line).expect_err(line);
        assert_eq!(
            said("newmtl "),
            "`newmtl` must be followed by a name, not ``"
        );
        let number = "must be followed by a finite number, not";
        assert_eq!(said("Pcr x"), format!("`Pcr` {number} `x`"));
        assert_eq!(said("Ns 1e39"), format!("`Ns` {number} `1e39`"));
        assert_eq!(
            said("bump -bm 1"),
            "`bump` must be followed by a file, not `-bm 1`"
        );
        let color = "`Kd` must be followed by three finite numbers, not `1 2`";
        assert_eq!(said("Kd 1 2"), color);
    }
}
