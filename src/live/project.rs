//! What is shown, described for a window: bindings, parameters with their values, and what can be asked for.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use impasto_compiler::interface::{self, MaterialInterface, ParamInterface, Value};
use impasto_compiler::ir::Const;
use impasto_compiler::partition::{Requires, STRATEGIES, Strategy};
use impasto_compiler::{ParameterValue, Program};
use impasto_runtime::film::outputs::OUTPUTS;
use impasto_runtime::scene::{MaterialBinding, Scene};
use impasto_viewer::engine::{Binding, Param, ParamId, Project};
use toml_edit::TableLike;

use crate::files::FileLoader;

/// What is known of a scene and its materials without their code.
#[derive(Clone, Debug, Default)]
pub(super) struct Described {
    /// The project as it is written.
    pub project: Project,
    /// Parameters that can be set.
    pub settable: BTreeSet<ParamId>,
}

/// Describes a scene as its file has it, without anything that was set.
pub(super) fn describe(path: &Path, is_scene: bool, scene: &Scene) -> Described {
    let text = if is_scene {
        std::fs::read_to_string(path).unwrap_or_default()
    } else {
        String::new()
    };
    let keys = Keys::of(&text);
    let mut files: BTreeMap<&str, Vec<MaterialInterface>> = BTreeMap::new();
    let mut loader = FileLoader::new(&scene.base);
    let mut settable = BTreeSet::new();
    let mut bindings = Vec::new();
    for binding in &scene.materials {
        let of_file = files
            .entry(&binding.file)
            .or_insert_with(|| interface::interface(&binding.file, &mut loader).materials);
        let material = match &binding.material {
            Some(name) => of_file.iter().find(|m| m.name == *name),
            None => of_file.first(),
        };
        let described = bound(binding, material, &keys);
        let of = |param: &Param| ParamId {
            binding: binding.name.clone(),
            param: param.interface.name.clone(),
        };
        let free = |p: &&Param| p.interface.settable && !p.is_animated;
        settable.extend(described.params.iter().filter(free).map(of));
        bindings.push(described);
    }
    let mesh = scene.mesh.bounds();
    let project = Project {
        name: scene.name.clone(),
        path: path.to_owned(),
        is_scene,
        camera: Some(scene.camera),
        bounds: (!scene.mesh.is_empty()).then(|| mesh.map(|corner| corner.to_array())),
        size: [scene.film.width, scene.film.height],
        bindings,
        outputs: OUTPUTS
            .iter()
            .map(|output| (output.name.to_owned(), output.what.to_owned()))
            .collect(),
        own_layers: super::survey::own_layers(),
        strategies: strategies(),
        frames: keys.frames,
    };
    Described { project, settable }
}

fn strategies() -> Vec<(String, String)> {
    let measured = |name: &str| {
        let strategy = Strategy::parse(name);
        strategy.is_ok_and(|s| s.requires() == Requires::Measurements)
    };
    let rows = STRATEGIES.iter().filter(|row| !measured(row.name));
    rows.map(|row| {
        let name = match row.number {
            Some(_) => format!("{}=", row.name),
            None => row.name.to_owned(),
        };
        (name, row.help.to_owned())
    })
    .collect()
}

fn bound(binding: &MaterialBinding, material: Option<&MaterialInterface>, keys: &Keys) -> Binding {
    let written = |name: &str| {
        let mut params = binding.params.iter();
        params
            .find(|(n, _)| n == name)
            .map(|(_, value)| value.clone())
    };
    let param = |interface: &ParamInterface| Param {
        written: written(&interface.name),
        value: interface.default.clone(),
        is_set: false,
        is_animated: keys.has(&binding.name, &interface.name),
        interface: interface.clone(),
    };
    Binding {
        name: binding.name.clone(),
        file: binding.file.clone(),
        material: material.map_or_else(
            || binding.material.clone().unwrap_or_default(),
            |m| m.name.clone(),
        ),
        docs: material.map_or_else(String::new, |m| m.docs.clone()),
        params: material.map_or_else(Vec::new, |m| m.params.iter().map(param).collect()),
    }
}

/// The same with the values that a program has, of which some were set.
pub(super) fn with_values(
    written: &Project,
    program: &Program,
    set: &BTreeMap<ParamId, ParameterValue>,
) -> Project {
    let mut project = written.clone();
    for (index, binding) in project.bindings.iter_mut().enumerate() {
        let values: BTreeMap<&str, &Const> = program.parameters(index).collect();
        for param in &mut binding.params {
            if let Some(value) = values.get(param.interface.name.as_str()) {
                param.value = match program
                    .texture(value)
                    .filter(|_| param.interface.ty == "texture")
                {
                    Some(path) => Value::Text(path.to_owned()),
                    None => Value::of(value),
                };
            }
            let id = ParamId {
                binding: binding.name.clone(),
                param: param.interface.name.clone(),
            };
            param.is_set = set
                .get(&id)
                .is_some_and(|value| param.written.as_ref() != Some(value));
        }
    }
    project
}

/// What keys of a scene move.
#[derive(Default)]
struct Keys {
    params: BTreeSet<(String, String)>,
    /// First and last frame that there is a key of.
    frames: Option<[u32; 2]>,
}

impl Keys {
    /// Of the text of a scene that was read without errors; none of another.
    fn of(text: &str) -> Self {
        let Ok(document) = text.parse::<toml_edit::Document<String>>() else {
            return Self::default();
        };
        let mut keys = Self::default();
        let mut frames = Vec::new();
        gather(document.as_table(), &mut frames);
        if let (Some(first), Some(last)) = (frames.iter().min(), frames.iter().max()) {
            keys.frames = Some([*first, *last]);
        }
        let materials = document.get("materials").and_then(|m| m.as_table_like());
        for (binding, item) in materials.into_iter().flat_map(|m| m.iter()) {
            let of = item.get("keys").and_then(|k| k.as_table_like());
            for (param, _) in of.into_iter().flat_map(|k| k.iter()) {
                keys.params.insert((binding.to_owned(), param.to_owned()));
            }
        }
        keys
    }

    fn has(&self, binding: &str, param: &str) -> bool {
        let pair = (binding.to_owned(), param.to_owned());
        self.params.contains(&pair)
    }
}

/// The frames of all keys and turntables.
fn gather(table: &dyn TableLike, frames: &mut Vec<u32>) {
    let frame = |value: &toml_edit::Value| {
        let whole = value.as_integer().map(|i| i as f64);
        let frame = whole.or_else(|| value.as_float())?;
        // Conversion saturates.
        Some(frame as u32)
    };
    for (name, item) in table.iter() {
        let inner = item.as_table_like();
        match name {
            "keys" => {
                for (_, list) in inner.into_iter().flat_map(|keys| keys.iter()) {
                    let pairs = list.as_array().into_iter().flatten();
                    let firsts = pairs.filter_map(|pair| pair.as_array()?.get(0));
                    frames.extend(firsts.filter_map(frame));
                }
            }
            "turntable" => {
                let count = inner.and_then(|turn| turn.get("frames")?.as_value());
                if let Some(count) = count.and_then(frame) {
                    frames.extend([1, count.max(1)]);
                }
            }
            _ => {
                let several = item.as_array_of_tables().into_iter().flatten();
                let several = several.map(|table| table as &dyn TableLike);
                several.chain(inner).for_each(|table| gather(table, frames));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_say_which_parameters_move_and_when() {
        let keys = Keys::of(
            "[camera]\nkeys = { position = [[3, [0, 0, 0]], [40.0, [1, 0, 0]]] }\n\
             [materials.wall]\nfile = \"a\"\nkeys = { tint = [[1, 0.5], [9, 1]] }\n\
             [[geometry]]\nfile = \"a.obj\"\nturntable = { frames = 48 }\n",
        );
        assert_eq!(keys.frames, Some([1, 48]));
        assert!(keys.has("wall", "tint") && !keys.has("wall", "other"));
        assert_eq!(Keys::of("[camera]\nfov = 3").frames, None);
        assert_eq!(Keys::of("[camera").frames, None);
    }
}
