//! Completion, hover, definitions, colors and checks of scene files.

use std::ops::Range;
use std::path::{Path, PathBuf};

use impasto_compiler::diag::nearest;
use impasto_compiler::interface::{self, Interface, MaterialInterface, ParamInterface};
use impasto_compiler::{Loader, library_text};
use impasto_runtime::world;

use super::cursor::{Part, SceneCursor, cursor};
use super::manual::{self, Key};
use super::outline::{BindingAt, SceneOutline, outline};
use crate::documents;
use crate::material::colors::{self, Swatch};
use crate::material::completion::{Proposal, ProposalKind};
use crate::material::symbols;

/// A scene file that is open.
pub struct Scene<'a> {
    /// Its path.
    pub path: &'a Path,
    /// Its text.
    pub text: &'a str,
    /// Reads materials, relative to its folder.
    pub loader: &'a mut dyn Loader,
}

/// What is wrong with a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Where.
    pub place: Range<usize>,
    /// What.
    pub message: String,
    /// Is it no more than a warning?
    pub is_warning: bool,
    /// What may be meant by what stands there.
    pub instead: Option<String>,
}

impl Scene<'_> {
    /// The folder that its paths are relative to.
    fn base(&self) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).to_path_buf()
    }

    /// The materials of a file that it names.
    fn interface(&mut self, file: &str) -> Interface {
        interface::interface(file, self.loader)
    }

    /// The material of a binding.
    fn material(&mut self, binding: &BindingAt) -> Option<MaterialInterface> {
        let file = binding.file.as_ref()?.value.clone();
        let mut materials = self.interface(&file).materials;
        let own = file.rsplit("::").next().unwrap_or_default().to_owned();
        let wanted = |m: &MaterialInterface| match &binding.material {
            Some(name) => m.name == name.value,
            None => m.name == own,
        };
        let index = match materials.iter().position(wanted) {
            Some(index) => index,
            None if materials.len() == 1 && binding.material.is_none() => 0,
            None => return None,
        };
        Some(materials.swap_remove(index))
    }

    /// What is wrong that can be told without reading geometry.
    pub fn problems(&mut self) -> Vec<Problem> {
        let outline = outline(self.text);
        let mut found: Vec<Problem> = outline
            .errors
            .iter()
            .map(|(place, message)| error(place.clone(), format!("not valid TOML: {message}")))
            .collect();
        if found.is_empty()
            && let Err(wrong) = world::check_text(self.path, self.text)
        {
            found.push(self.of_error(&wrong));
        }
        self.missing_files(&outline, &mut found);
        for binding in &outline.bindings {
            self.check_binding(binding, &mut found);
        }
        let names: Vec<&str> = outline.bindings.iter().map(|b| &*b.name.value).collect();
        for asked in &outline.asked {
            if names.contains(&&*asked.value) || asked.value == "-" {
                continue;
            }
            let message = format!("there is no `[materials.{}]`", asked.value);
            let instead = nearest(&asked.value, names.iter().copied()).map(str::to_owned);
            found.push(Problem {
                instead,
                ..error(asked.place.clone(), message)
            });
        }
        found
    }

    fn missing_files(&self, outline: &SceneOutline, found: &mut Vec<Problem>) {
        let of_materials = outline.bindings.iter().filter_map(|b| b.file.as_ref());
        for file in outline.files.iter().chain(of_materials) {
            let path = self.base().join(&file.value);
            if library_text(&file.value).is_some() || path.exists() {
                continue;
            }
            let folder = path.parent().unwrap_or(Path::new("."));
            let extension = path.extension().map(|e| e.to_string_lossy().into_owned());
            let beside = documents::names(folder, extension.as_deref().unwrap_or_default());
            let (prefix, name) = match file.value.rsplit_once('/') {
                Some((prefix, name)) => (format!("{prefix}/"), name),
                None => (String::new(), file.value.as_str()),
            };
            let near = nearest(name, beside.iter().map(String::as_str));
            let instead = near.map(|near| format!("{prefix}{near}"));
            let message = format!("there is no file `{}`", file.value);
            found.push(Problem {
                instead,
                ..error(file.place.clone(), message)
            });
        }
    }

    fn check_binding(&mut self, binding: &BindingAt, found: &mut Vec<Problem>) {
        let Some(file) = &binding.file else { return };
        if let Some(Err(message)) = library_text(&file.value) {
            found.push(error(file.place.clone(), message));
            return;
        }
        let interface = self.interface(&file.value);
        let names: Vec<&str> = interface.materials.iter().map(|m| &*m.name).collect();
        if let Some(material) = &binding.material
            && !names.is_empty()
            && !names.contains(&&*material.value)
        {
            let message = format!("`{}` has no material `{}`", file.value, material.value);
            let instead = nearest(&material.value, names.iter().copied()).map(str::to_owned);
            found.push(Problem {
                instead,
                ..error(material.place.clone(), message)
            });
            return;
        }
        let Some(material) = self.material(binding) else {
            return;
        };
        for param in &binding.params {
            let known: Vec<&str> = material.params.iter().map(|p| &*p.name).collect();
            if known.contains(&&*param.name.value) {
                continue;
            }
            let (name, material) = (&param.name.value, &material.name);
            let message = format!("material `{material}` has no parameter `{name}`");
            let instead = nearest(name, known.iter().copied()).map(str::to_owned);
            found.push(Problem {
                instead,
                ..error(param.name.place.clone(), message)
            });
        }
    }

    /// A problem that loading found, at its place in the text.
    pub fn of_error(&self, wrong: &impasto_runtime::error::SceneError) -> Problem {
        let place = wrong.excerpt.as_ref().filter(|e| e.path == self.path);
        let place = place.map_or(0..first_line(self.text), |excerpt| {
            let line = lines(self.text).nth(excerpt.line - 1).unwrap_or(0..0);
            let text = &self.text[line.clone()];
            let byte = |column: usize| {
                let at = text
                    .char_indices()
                    .nth(column)
                    .map_or(text.len(), |(i, _)| i);
                line.start + at
            };
            let first = excerpt.column - 1;
            byte(first)..byte(first + excerpt.width)
        });
        let hint = wrong.hint.as_ref();
        let hint = hint.map_or(String::new(), |hint| format!("\nhint: {hint}"));
        let other = wrong.path.as_ref().filter(|p| *p != self.path);
        let file = other.map_or(String::new(), |p| format!("{}: ", p.display()));
        let meant = hint
            .split_once("did you mean `")
            .and_then(|(_, rest)| rest.split_once('`'));
        Problem {
            instead: meant.map(|(name, _)| name.to_owned()),
            ..error(place, format!("{file}{}{hint}", wrong.message))
        }
    }

    /// What can be written at byte `at`, and the bytes that it takes the place of.
    pub fn complete(&mut self, at: usize) -> (Range<usize>, Vec<Proposal>) {
        let cursor = cursor(self.text, at);
        let list = match &cursor.part {
            Part::Nothing => Vec::new(),
            Part::Header => headers(),
            Part::Key => self.keys(&cursor),
            Part::Value { key, quoted } => self.values(&cursor, key, *quoted),
        };
        (cursor.word, list)
    }

    fn binding(&self, cursor: &SceneCursor) -> Option<BindingAt> {
        let [section, name] = cursor.section.as_slice() else {
            return None;
        };
        let bindings = outline(self.text).bindings;
        let mut of_name = bindings.into_iter().filter(|b| b.name.value == *name);
        of_name.next().filter(|_| section == "materials")
    }

    fn keys(&mut self, cursor: &SceneCursor) -> Vec<Proposal> {
        let section = cursor.section.first().map_or("", String::as_str);
        let is_params = cursor
            .inside
            .last()
            .is_some_and(|k| k == "params" || k == "keys");
        if section == "materials" && is_params {
            let binding = self.binding(cursor);
            let set = binding.as_ref().map_or(Vec::new(), |b| {
                b.params.iter().map(|p| p.name.value.clone()).collect()
            });
            let material = binding.and_then(|b| self.material(&b));
            let params = material.map_or(Vec::new(), |m| m.params);
            return params
                .iter()
                .filter(|p| p.settable && !set.contains(&p.name))
                .map(param)
                .collect();
        }
        let section = if cursor.inside.last().is_some_and(|k| k == "placements") {
            "geometry"
        } else {
            section
        };
        manual::keys_of(section)
            .map(key)
            .chain(top(section))
            .collect()
    }

    fn values(&mut self, cursor: &SceneCursor, key: &str, quoted: bool) -> Vec<Proposal> {
        let section = cursor.section.first().map_or("", String::as_str);
        let text = |value: &str, kind, detail: &str| {
            let written = if quoted {
                value.to_owned()
            } else {
                format!("\"{value}\"")
            };
            proposal(value, kind, &written, detail)
        };
        let is_params = cursor.inside.last().is_some_and(|k| k == "params");
        match (section, key) {
            ("materials", name) if is_params => {
                let binding = self.binding(cursor);
                let material = binding.and_then(|b| self.material(&b));
                let params = material.map_or(Vec::new(), |m| m.params);
                let found = params.iter().find(|p| p.name == name);
                found.map_or(Vec::new(), |p| values_of(p, quoted))
            }
            ("materials", "file") => {
                let mut list = self.files(cursor, &["impasto"], quoted);
                for entry in symbols::library() {
                    if entry.item.kind == ProposalKind::Material {
                        let module = format!("std::{}::{}", entry.file.folder, entry.file.name);
                        list.push(text(&module, ProposalKind::Module, "of the library"));
                    }
                }
                list
            }
            ("materials", "material") => {
                let file = self.binding(cursor).and_then(|b| b.file);
                let interface = file.map(|f| self.interface(&f.value));
                let materials = interface.map_or(Vec::new(), |i| i.materials);
                let names = materials.iter();
                names
                    .map(|m| text(&m.name, ProposalKind::Material, ""))
                    .collect()
            }
            ("geometry", "material") => {
                let bindings = outline(self.text).bindings;
                let names = bindings.iter();
                names
                    .map(|b| text(&b.name.value, ProposalKind::Material, ""))
                    .collect()
            }
            ("geometry", "file" | "obj" | "gltf" | "uv1") => {
                const GEOMETRY: [&str; 8] =
                    ["obj", "ply", "gltf", "glb", "usd", "usda", "usdc", "usdz"];
                self.files(cursor, &GEOMETRY, quoted)
            }
            ("environment", "file") => self.files(cursor, &["exr", "hdr", "png", "jpg"], quoted),
            ("lights", "kind") => ["quad", "distant"]
                .map(|k| text(k, ProposalKind::Keyword, ""))
                .to_vec(),
            ("animation", "interpolation") => ["linear", "smooth"]
                .map(|k| text(k, ProposalKind::Keyword, ""))
                .to_vec(),
            (_, "bake" | "two_sided" | "sample" | "share") if !quoted => ["true", "false"]
                .map(|k| proposal(k, ProposalKind::Keyword, k, ""))
                .to_vec(),
            _ => Vec::new(),
        }
    }

    /// Files and folders at the path that is being written.
    fn files(&self, cursor: &SceneCursor, extensions: &[&str], quoted: bool) -> Vec<Proposal> {
        let (folder, _) = cursor.prefix.rsplit_once('/').unwrap_or(("", ""));
        let here = self.base().join(folder);
        let full = |name: &str| {
            if folder.is_empty() {
                name.to_owned()
            } else {
                format!("{folder}/{name}")
            }
        };
        let files = extensions.iter().flat_map(|e| documents::names(&here, e));
        let entries = std::fs::read_dir(&here).into_iter().flatten().flatten();
        let folders = entries.take(4096).filter(|e| e.path().is_dir());
        let mut folders: Vec<String> = folders
            .filter_map(|e| e.file_name().into_string().ok())
            .filter(|name| !name.starts_with('.'))
            .map(|name| full(&name) + "/")
            .collect();
        folders.push(full("../"));
        let files = files.map(|name| full(&name)).chain(folders);
        let one = |path: String| {
            let written = if quoted {
                path.clone()
            } else {
                format!("\"{path}\"")
            };
            proposal(&path, ProposalKind::File, &written, "")
        };
        files.map(one).collect()
    }

    /// Markdown for what byte `at` is in, and the bytes that it is about.
    pub fn hover(&mut self, at: usize) -> Option<(String, Range<usize>)> {
        let cursor = cursor(self.text, at);
        let word = self.text.get(cursor.word.clone())?.to_owned();
        let section = cursor.section.first().map_or("", String::as_str).to_owned();
        let outline = outline(self.text);
        for binding in &outline.bindings {
            let touches = |place: &Range<usize>| place.start <= at && at <= place.end;
            let param = binding.params.iter().find(|p| touches(&p.name.place));
            if let Some(found) = param {
                let material = self.material(binding)?;
                let of_name = |p: &&ParamInterface| p.name == found.name.value;
                let param = material.params.iter().find(of_name)?;
                return Some((param_text(&material, param), found.name.place.clone()));
            }
            let files = binding.file.iter().chain(&binding.material);
            if let Some(file) = files.into_iter().find(|f| touches(&f.place)) {
                let material = self.material(binding)?;
                return Some((material_text(&material), file.place.clone()));
            }
        }
        let key = match &cursor.part {
            Part::Key => word,
            Part::Header => {
                let mut keys = manual::keys_of(&section).peekable();
                keys.peek()?;
                let names: Vec<String> = keys.map(|k| format!("`{}`", k.name)).collect();
                let text = format!("**[{section}]**\n\nkeys: {}", names.join(", "));
                return Some((text, cursor.word));
            }
            _ => return None,
        };
        let found = manual::keys_of(&section).find(|k| k.name == key)?;
        Some((key_text(found), cursor.word))
    }

    /// The file, and the name in it if there is one, that byte `at` leads to.
    pub fn definition(&self, at: usize) -> Option<Target> {
        let outline = outline(self.text);
        let touches = |place: &Range<usize>| place.start <= at && at <= place.end;
        for binding in &outline.bindings {
            let Some(file) = &binding.file else { continue };
            let target = |material: Option<String>, param: Option<String>| Target::Material {
                file: file.value.clone(),
                material,
                param,
            };
            let material = binding.material.as_ref().map(|m| m.value.clone());
            if touches(&file.place) || binding.material.as_ref().is_some_and(|m| touches(&m.place))
            {
                return Some(target(material, None));
            }
            if let Some(param) = binding.params.iter().find(|p| touches(&p.name.place)) {
                return Some(target(material, Some(param.name.value.clone())));
            }
        }
        let asked = outline.asked.iter().find(|a| touches(&a.place));
        if let Some(asked) = asked {
            let binding = outline
                .bindings
                .iter()
                .find(|b| b.name.value == asked.value)?;
            return Some(Target::Here(binding.name.place.clone()));
        }
        let file = outline.files.iter().find(|f| touches(&f.place))?;
        Some(Target::File(self.base().join(&file.value)))
    }

    /// The colors of parameters: `[r, g, b]` of linear light, and expressions of the language.
    pub fn swatches(&mut self) -> Vec<Swatch> {
        let mut found = Vec::new();
        for binding in outline(self.text).bindings {
            let lists = binding.params.iter().any(|p| p.numbers.is_some());
            let material = if lists { self.material(&binding) } else { None };
            for param in &binding.params {
                let of_name = |p: &&ParamInterface| p.name == param.name.value && p.ty == "color";
                let is_color = material
                    .as_ref()
                    .is_some_and(|m| m.params.iter().any(|p| of_name(&p)));
                if let (Some([r, g, b]), true) = (param.numbers.as_deref(), is_color) {
                    found.push(Swatch {
                        place: param.value.clone(),
                        srgb: [*r, *g, *b].map(colors::encoded),
                        is_encoded: false,
                    });
                    continue;
                }
                let text = self.text.get(param.value.clone()).unwrap_or_default();
                found.extend(
                    colors::swatches(text.trim_matches('"'))
                        .into_iter()
                        .map(|s| {
                            let offset = param.value.start + text.find(|c| c != '"').unwrap_or(0);
                            Swatch {
                                place: s.place.start + offset..s.place.end + offset,
                                ..s
                            }
                        }),
                );
            }
        }
        found
    }

    /// Where it binds a material of a file: the bytes of the material's name, and those of a parameter of it.
    pub fn uses(
        &self,
        file: &str,
        material: &str,
        param: Option<&str>,
        is_only: bool,
    ) -> Vec<Range<usize>> {
        let mut found = Vec::new();
        for binding in outline(self.text).bindings {
            let path = binding
                .file
                .as_ref()
                .map(|f| documents::normal(&self.base().join(&f.value)));
            if path.as_deref() != Some(file) {
                continue;
            }
            let named = binding.material.as_ref().filter(|m| m.value == material);
            let is_it = named.is_some() || (binding.material.is_none() && is_only);
            match (param, is_it) {
                (None, _) => found.extend(named.map(|m| m.place.clone())),
                (Some(param), true) => {
                    let of_name = binding.params.iter().filter(|p| p.name.value == param);
                    found.extend(of_name.map(|p| p.name.place.clone()));
                }
                (Some(_), false) => {}
            }
        }
        found
    }
}

/// What something in a scene leads to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// A place in the scene itself.
    Here(Range<usize>),
    /// A file.
    File(PathBuf),
    /// A material of a file, or a parameter of it.
    Material {
        /// The file, as the scene names it.
        file: String,
        /// The material, if it is named.
        material: Option<String>,
        /// The parameter.
        param: Option<String>,
    },
}

fn error(place: Range<usize>, message: String) -> Problem {
    Problem {
        place,
        message,
        is_warning: false,
        instead: None,
    }
}

fn first_line(text: &str) -> usize {
    text.find('\n').unwrap_or(text.len())
}

/// The bytes of each line, without breaks.
fn lines(text: &str) -> impl Iterator<Item = Range<usize>> {
    let mut at = 0;
    text.split_inclusive('\n').map(move |line| {
        let start = at;
        at += line.len();
        start..start + line.trim_end_matches(['\n', '\r']).len()
    })
}

fn proposal(label: &str, kind: ProposalKind, written: &str, detail: &str) -> Proposal {
    Proposal {
        label: label.to_owned(),
        kind,
        snippet: written.replace('$', "\\$"),
        detail: detail.to_owned(),
        docs: String::new(),
        rank: 0,
        import: None,
    }
}

fn headers() -> Vec<Proposal> {
    let header = |section: &str| {
        let written = match section {
            "materials" => "materials.".to_owned(),
            section => section.to_owned(),
        };
        proposal(&written.clone(), ProposalKind::Module, &written, "")
    };
    manual::sections().into_iter().map(header).collect()
}

/// Headers, where a key of the top could stand.
fn top(section: &str) -> Vec<Proposal> {
    if !section.is_empty() {
        return Vec::new();
    }
    let mut list = vec![proposal(
        "name",
        ProposalKind::Field,
        "name = ",
        "appears in reports",
    )];
    for section in manual::sections() {
        let header = match section {
            "materials" => "[materials.NAME]".to_owned(),
            list if manual::LISTS.contains(&list) => format!("[[{list}]]"),
            section => format!("[{section}]"),
        };
        list.push(proposal(&header, ProposalKind::Module, &header, ""));
    }
    list
}

fn key(key: &Key) -> Proposal {
    Proposal {
        docs: key_text(key),
        detail: key.default.replace('`', ""),
        ..proposal(
            &key.name,
            ProposalKind::Field,
            &format!("{} = ", key.name),
            "",
        )
    }
}

fn key_text(key: &Key) -> String {
    let default = match key.default.as_str() {
        "" => String::new(),
        default => format!("\n\nDefault: {default}"),
    };
    format!(
        "**{}** of [{}]\n\n{}{default}",
        key.name, key.section, key.about
    )
}

fn param(param: &ParamInterface) -> Proposal {
    let default = match param.ty.as_str() {
        "float" | "int" | "bool" => param.default_text.clone(),
        "texture" => param.default_text.clone(),
        _ => format!("\"{}\"", param.default_text.replace('"', "")),
    };
    Proposal {
        snippet: format!(
            "{} = ${{1:{}}}",
            param.name,
            default.replace(['$', '}'], "")
        ),
        detail: format!("{} = {}", param.ty, param.default_text),
        docs: described(param),
        ..proposal(&param.name, ProposalKind::Parameter, &param.name, "")
    }
}

fn described(param: &ParamInterface) -> String {
    let mut text = param.docs.clone();
    let unit = param.unit.map_or((1.0, ""), |u| (u.size, u.name));
    let number = |x: f32| {
        format!("{} {}", (f64::from(x) / unit.0) as f32, unit.1)
            .trim()
            .to_owned()
    };
    if let Some([low, high]) = param.hard {
        text += &format!("\n\nRange: `{} .. {}`", number(low), number(high));
    }
    text += &format!("\n\nDefault: `{}`", param.default_text);
    text.trim().to_owned()
}

fn param_text(material: &MaterialInterface, param: &ParamInterface) -> String {
    let head = format!(
        "```impasto\nparam {}: {} = {}\n```",
        param.name, param.ty, param.default_text
    );
    format!(
        "{head}\n\n{}\n\n*parameter of `{}`*",
        described(param),
        material.name
    )
}

fn material_text(material: &MaterialInterface) -> String {
    let params: Vec<String> = material
        .params
        .iter()
        .filter(|p| p.settable)
        .map(|p| format!("- `{}: {} = {}`", p.name, p.ty, p.default_text))
        .collect();
    format!(
        "```impasto\nmaterial {}\n```\n\n{}\n\n{}",
        material.name,
        material.docs,
        params.join("\n")
    )
}

fn values_of(param: &ParamInterface, quoted: bool) -> Vec<Proposal> {
    let text = |value: String| {
        let written = if quoted {
            value.clone()
        } else {
            format!("\"{value}\"")
        };
        proposal(&value, ProposalKind::Constant, &written, "default")
    };
    let plain = |value: &str| proposal(value, ProposalKind::Constant, value, "");
    match (param.ty.as_str(), quoted) {
        ("bool", false) => vec![plain("true"), plain("false")],
        ("float" | "int", false) => vec![plain(&param.default_text)],
        _ => vec![text(param.default_text.replace('"', ""))],
    }
}
