//! The source that a document becomes: what it imports, helper functions, pictures, materials.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::ops::Range;

use impasto_compiler::format::format;
use impasto_compiler::source::FileId;

use crate::error::{ImportError, Warning};
use crate::files::{Files, joined};
use crate::imported::Texture;
use crate::mtlx::helpers::{self, HELPERS};
use crate::mtlx::names::Names;
use crate::mtlx::origin::{Mark, Traced};

/// The longest source that the compiler reads.
const MOST_BYTES: usize = 1 << 20;
/// The folder for pictures, beside the source.
const TEXTURES: &str = "textures";

/// A source while it is written.
#[derive(Default)]
pub(crate) struct SourceText {
    /// Names of materials and helpers.
    pub names: Names,
    /// Definitions of the library that may be used, by the name that the source has for them.
    imports: BTreeMap<String, (String, String)>,
    textures: BTreeMap<String, Texture>,
    written: HashSet<String>,
    /// What to say where a picture is missing.
    pub named: BTreeMap<String, Warning>,
    pub warnings: Vec<Warning>,
    warned: HashSet<String>,
    materials: Vec<Traced>,
    /// The folder that the source is read in, where pictures stay where they are.
    in_place: Option<String>,
}

impl SourceText {
    pub fn new(in_place: Option<String>) -> Self {
        let mut names = Names::default();
        for helper in HELPERS {
            names.keep(helper.name);
        }
        Self {
            names,
            in_place,
            ..Self::default()
        }
    }

    /// Warns, once.
    pub fn warn(&mut self, warning: Warning) {
        if self.warned.insert(warning.to_string()) {
            self.warnings.push(warning);
        }
    }

    /// The text with `@folder::name` and `#helper` as plain names, which the source then has.
    pub fn names_in(&mut self, template: &str) -> String {
        let mut text = String::with_capacity(template.len());
        let mut rest = template;
        while let Some(at) = rest.find(['@', '#']) {
            text.push_str(&rest[..at]);
            let is_import = rest[at..].starts_with('@');
            rest = &rest[at + 1..];
            let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == ':' && is_import;
            let end = rest.find(|c| !is_part(c)).unwrap_or(rest.len());
            // A colon behind a name belongs to what follows.
            let end = rest[..end].trim_end_matches(':').len();
            let path = &rest[..end];
            rest = &rest[end..];
            let Some((folder, name)) = path.split_once("::").filter(|_| is_import) else {
                text.push_str(path);
                continue;
            };
            // A bsdf and an edf have this name.
            let local = match (folder, name) {
                ("edf", "generalized_schlick") => "generalized_schlick_edf",
                _ => name,
            };
            self.imports
                .insert(local.to_owned(), (folder.to_owned(), name.to_owned()));
            text.push_str(local);
        }
        text.push_str(rest);
        text
    }

    /// The path that the source names for a picture that the file at `base` calls `name`.
    ///
    /// # Errors
    /// It lies outside of the document's folder, and may not: the reason.
    pub fn texture(
        &mut self,
        base: &str,
        name: &str,
        allow_outside: bool,
    ) -> Result<Texture, String> {
        let (found, inside) = joined(base, name);
        if !inside && !allow_outside {
            return Err(format!(
                "`{name}` lies outside of the folder of the document"
            ));
        }
        if let Some(texture) = self.textures.get(&found) {
            return Ok(texture.clone());
        }
        if let Some(folder) = &self.in_place {
            let written = found.strip_prefix(folder.as_str()).unwrap_or(&found);
            let written = written.to_owned();
            let texture = Texture {
                exists: true,
                found: found.clone(),
                written,
            };
            self.textures.insert(found, texture.clone());
            return Ok(texture);
        }
        let file = found
            .rsplit_once('/')
            .map_or(found.as_str(), |(_, file)| file);
        let file: String = file
            .chars()
            .filter(|c| !c.is_control() && *c != '"')
            .collect();
        let (stem, extension) = file.rsplit_once('.').unwrap_or((&file, ""));
        let mut written = format!("{TEXTURES}/{file}");
        let mut count = 1;
        while !self.written.insert(written.to_ascii_lowercase()) {
            count += 1;
            written = format!("{TEXTURES}/{stem}_{count}.{extension}");
        }
        let texture = Texture {
            exists: true,
            found: found.clone(),
            written,
        };
        self.textures.insert(found, texture.clone());
        Ok(texture)
    }

    /// Adds a material.
    pub fn add(&mut self, material: Traced) {
        self.materials.push(material);
    }

    /// The pictures that the text names, with a warning of each that is missing.
    pub fn textures(&mut self, text: &str, files: &mut dyn Files) -> Vec<Texture> {
        let used = self.textures.values();
        let used = used.filter(|t| text.contains(&format!("\"{}\"", t.written)));
        let mut textures: Vec<Texture> = used.cloned().collect();
        for texture in &mut textures {
            texture.exists = texture.found.contains("<UDIM>") || files.exists(&texture.found);
            if let Some(warning) = self.named.get(&texture.found).filter(|_| !texture.exists) {
                self.warn(warning.clone());
            }
        }
        textures
    }

    /// The whole source, formatted, and where its parts come from.
    ///
    /// # Errors
    /// It is too long.
    pub fn finished(&mut self, path: &str, header: &str) -> Result<Finished, ImportError> {
        let materials = self.materials.iter();
        let mut words: HashSet<String> = materials.flat_map(|m| words(&m.text)).collect();
        // Helpers that materials use, and those that they use themselves; the last first.
        let mut texts = Vec::new();
        for helper in HELPERS.iter().rev() {
            if words.contains(helper.name) {
                for (folder, name) in helpers::imports(helper) {
                    self.imports
                        .insert(name.to_owned(), (folder.to_owned(), name.to_owned()));
                }
                let text = helpers::text(helper);
                words.extend(self::words(text));
                texts.push(text.to_owned());
            }
        }
        texts.reverse();
        let mut folders: BTreeMap<&str, BTreeSet<String>> = BTreeMap::new();
        for (local, (folder, name)) in &self.imports {
            if words.contains(local) {
                let import = if local == name {
                    name.clone()
                } else {
                    format!("{name} as {local}")
                };
                folders.entry(folder).or_default().insert(import);
            }
        }
        let mut text = format!("{header}\n");
        for (folder, names) in folders {
            let names: Vec<String> = names.into_iter().collect();
            match names.as_slice() {
                [name] => text.push_str(&format!("use std::{folder}::{name};\n")),
                names => text.push_str(&format!("use std::{folder}::{{{}}};\n", names.join(", "))),
            }
        }
        let mut whole = Traced::new(text);
        let helpers = texts.into_iter().map(Traced::new);
        for part in helpers.chain(self.materials.iter().cloned()) {
            whole.text.push('\n');
            whole.push(&part);
        }
        let too_long = || {
            let message = "the source would have more than 1 MiB, which the compiler does not read";
            ImportError::new(path, message).hint("import fewer materials at once")
        };
        if whole.text.len() > MOST_BYTES {
            return Err(too_long());
        }
        let formatted = format(FileId(0), &whole.text).map_err(|reason| {
            let message =
                format!("the source cannot be formatted, a defect of the importer: {reason:?}");
            ImportError::new(path, message)
        })?;
        if formatted.len() > MOST_BYTES {
            Err(too_long())
        } else {
            let marks = whole.moved(&formatted);
            Ok((formatted, marks))
        }
    }
}

/// A source, and where its parts come from.
type Finished = (String, Vec<(Range<usize>, Mark)>);

/// The words of a text that are no fields and stand in no string.
pub(crate) fn words(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut word = String::new();
    let mut before = ' ';
    let mut quoted = false;
    for c in text.chars().chain([' ']) {
        if c == '"' {
            quoted = !quoted;
        }
        if !quoted && (c.is_ascii_alphanumeric() || c == '_') {
            word.push(c);
            continue;
        }
        if !word.is_empty() {
            let whole = std::mem::take(&mut word);
            if before != '.' {
                found.push(whole);
            }
        }
        before = c;
    }
    found
}
