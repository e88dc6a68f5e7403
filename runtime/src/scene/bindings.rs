//! Which material of the scene each material name of a geometry file gets.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use impasto_compiler::ParameterValue;
use impasto_compiler::diag::nearest;

use super::MaterialBinding;
use super::description::{MaterialName, MaterialSpec, ParamSpec};
use super::document::list;
use super::formats::FileMaterial;
use super::load::Source;
use crate::error::SceneError;

/// The name whose binding serves every name without one of its own.
const WILDCARD: &str = "*";

/// Resolves names to materials, merging those that turn out to be the same.
pub(super) struct Bindings<'d> {
    specs: &'d [MaterialSpec],
    used: Vec<bool>,
    resolved: Vec<MaterialBinding>,
    groups: Vec<Option<String>>,
    by_content: HashMap<Content, u32>,
    by_name: HashMap<&'d str, usize>,
    taken: HashSet<String>,
    /// For each name that several bindings ask for the next number to try.
    next_number: HashMap<String, usize>,
}

/// What makes two bindings the same material: file, item, parameters as text, how they are compiled, and the group
/// of their light.
type Content = (
    String,
    Option<String>,
    Vec<(String, String)>,
    bool,
    Option<String>,
);

impl<'d> Bindings<'d> {
    pub(super) fn new(specs: &'d [MaterialSpec]) -> Self {
        Bindings {
            specs,
            used: vec![false; specs.len()],
            resolved: Vec::new(),
            groups: Vec::new(),
            by_content: HashMap::new(),
            // The first of equal names.
            by_name: specs
                .iter()
                .enumerate()
                .rev()
                .map(|(i, s)| (s.name.as_str(), i))
                .collect(),
            taken: HashSet::new(),
            next_number: HashMap::new(),
        }
    }

    /// Indices of the materials of a geometry file's triangles, for each material it uses; those of
    /// `override_by` for all, if it is given.
    pub(super) fn resolve(
        &mut self,
        source: &Source,
        override_by: Option<&MaterialName>,
    ) -> Result<Vec<u32>, SceneError> {
        let materials = &source.geometry.materials;
        let specs = match override_by {
            Some(material) => vec![self.overriding(material)?; materials.len()],
            None => self.of_names(source)?,
        };
        if let Some(missing) = &source.geometry.missing {
            let needs_it = |&&spec: &&usize| self.specs[spec].reads_files();
            if let Some(&spec) = specs.iter().find(needs_it) {
                let reader = &self.specs[spec].name;
                let hint = format!("the material `{reader}` of the scene reads its values");
                return Err(missing.clone().hint(hint));
            }
        }
        let each = specs.iter().zip(materials);
        Ok(each
            .map(|(&spec, material)| self.instantiate(spec, &material.name, Some(material)))
            .collect())
    }

    /// Indices of the materials that the camera is in. Nothing else need use them.
    pub(super) fn of_camera(&mut self, media: &[MaterialName]) -> Result<Vec<u32>, SceneError> {
        let index = |medium: &MaterialName| match self.find(&medium.name) {
            Some(spec) => Ok(self.instantiate(spec, &medium.name, None)),
            None => {
                let hint = self.suggestion(&medium.name);
                Err(medium.missing.clone().hint(hint))
            }
        };
        media.iter().map(index).collect()
    }

    /// The groups that the light of each material is in.
    pub(super) fn groups(&self) -> Vec<Option<String>> {
        self.groups.clone()
    }

    /// The materials in order of first use.
    pub(super) fn finish(self, warnings: &mut Vec<String>) -> Vec<MaterialBinding> {
        for (spec, used) in self.specs.iter().zip(self.used) {
            if !used && spec.name != WILDCARD {
                warnings.push(format!("nothing uses the material `{}`", spec.name));
            }
        }
        self.resolved
    }

    fn find(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }

    fn overriding(&self, material: &MaterialName) -> Result<usize, SceneError> {
        let error = || {
            material
                .missing
                .clone()
                .hint(self.suggestion(&material.name))
        };
        self.find(&material.name).ok_or_else(error)
    }

    fn of_names(&self, source: &Source) -> Result<Vec<usize>, SceneError> {
        let path = &source.path;
        let names = || source.geometry.materials.iter().map(|m| m.name.as_str());
        let wildcard = self.find(WILDCARD);
        let found: Vec<Option<usize>> = names().map(|n| self.find(n).or(wildcard)).collect();
        let missing = names().zip(&found).filter(|(_, spec)| spec.is_none());
        let missing: Vec<&str> = missing.map(|(name, _)| name).collect();
        match missing[..] {
            [] => Ok(found.into_iter().flatten().collect()),
            [""] => {
                let message = format!("{} have no material", source.format.without_material);
                Err(SceneError::in_file(path, message).hint(
                    "add `material = \"...\"` to its [[geometry]], or bind everything with [materials.\"*\"]",
                ))
            }
            _ => {
                let named = missing.iter().copied().filter(|n| !n.is_empty());
                let message = format!("the scene binds no material to {}", list(named.clone()));
                let first = named.clone().next().unwrap_or_default();
                Err(SceneError::in_file(path, message).hint(self.suggestion(first)))
            }
        }
    }

    fn suggestion(&self, name: &str) -> String {
        let names = self
            .specs
            .iter()
            .map(|s| s.name.as_str())
            .filter(|n| *n != WILDCARD);
        match nearest(name, names) {
            Some(best) => format!("there is [materials.{best:?}]; is that what is meant?"),
            None => {
                format!("add [materials.{name:?}], or bind all other names with [materials.\"*\"]")
            }
        }
    }

    /// The index of the material that `spec` is for faces of `name`.
    /// `material` is what the geometry file says of it.
    fn instantiate(&mut self, spec: usize, name: &str, material: Option<&FileMaterial>) -> u32 {
        self.used[spec] = true;
        let spec = &self.specs[spec];
        let params = spec.values(material);
        let texts = params.iter().map(|(key, v)| (key.clone(), v.to_string()));
        let (file, item) = (spec.file.clone(), spec.material.clone());
        let group = spec.group.clone();
        let (own_file, own_item) = (file.clone(), item.clone());
        let content = (own_file, own_item, texts.collect(), spec.bake, group);
        if let Some(&known) = self.by_content.get(&content) {
            return known;
        }
        let index = self.resolved.len() as u32;
        self.by_content.insert(content, index);
        self.groups.push(spec.group.clone());
        let name = self.unique_name(spec, name);
        self.resolved.push(MaterialBinding {
            name,
            file,
            material: item,
            params,
            bake: spec.bake,
            has_keys: spec.has_keys,
            written: Some(spec.written.clone()),
        });
        index
    }

    /// The binding's name; for the wildcard, the name it stands for, or that of its file.
    fn unique_name(&mut self, spec: &MaterialSpec, name: &str) -> String {
        let stem = Path::new(&spec.file).file_stem().and_then(|s| s.to_str());
        let name = match spec.name.as_str() {
            WILDCARD if spec.reads_files() && !name.is_empty() => name,
            WILDCARD => stem.unwrap_or("material"),
            own => own,
        };
        if self.taken.insert(name.to_owned()) {
            return name.to_owned();
        }
        // Numbers below the next one are taken, and stay so.
        let next = self.next_number.entry(name.to_owned()).or_insert(2);
        loop {
            let numbered = format!("{name}_{next}");
            *next += 1;
            if self.taken.insert(numbered.clone()) {
                return numbered;
            }
        }
    }
}

impl MaterialSpec {
    /// Does some parameter get a value that geometry files give?
    fn reads_files(&self) -> bool {
        let mut params = self.params.iter();
        params.any(|(_, value)| matches!(value, ParamSpec::OfFile(_)))
    }

    /// The values of its parameters where it is bound to `material` of a geometry file.
    fn values(&self, material: Option<&FileMaterial>) -> Vec<(String, ParameterValue)> {
        let value = |spec: &ParamSpec| match spec {
            ParamSpec::Given(value) => Some(value.clone()),
            ParamSpec::OfFile(value) => value.of(material),
        };
        let params = self.params.iter();
        params
            .filter_map(|(name, spec)| Some((name.clone(), value(spec)?)))
            .collect()
    }
}
