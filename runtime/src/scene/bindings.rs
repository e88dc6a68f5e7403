//! Which material each name of an OBJ file gets.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use impasto_compiler::diag::nearest;

use super::MaterialBinding;
use super::description::{MaterialName, MaterialSpec, ParamSpec};
use super::document::list;
use crate::error::SceneError;

/// The name whose binding serves every name without one of its own.
const WILDCARD: &str = "*";

/// The MTL values that an OBJ file's materials have.
#[derive(Default)]
pub(super) struct Library {
    /// By material name: the folder of its MTL file relative to the scene, and the values.
    pub(super) materials: BTreeMap<String, (PathBuf, tobj::Material)>,
    /// The first MTL file that could not be read.
    pub(super) missing: Option<SceneError>,
}

/// Resolves names to materials, merging those that turn out to be the same.
pub(super) struct Bindings<'d> {
    specs: &'d [MaterialSpec],
    used: Vec<bool>,
    resolved: Vec<MaterialBinding>,
    by_content: HashMap<Content, u32>,
}

/// What makes two bindings the same material: file, item, parameters and how they are compiled.
type Content = (String, Option<String>, Vec<(String, String)>, bool);

impl<'d> Bindings<'d> {
    pub(super) fn new(specs: &'d [MaterialSpec]) -> Self {
        Bindings {
            specs,
            used: vec![false; specs.len()],
            resolved: Vec::new(),
            by_content: HashMap::new(),
        }
    }

    /// Indices of the materials of an OBJ file's faces, for each name it uses; those of
    /// `override_by` for all, if it is given.
    pub(super) fn resolve(
        &mut self,
        path: &Path,
        override_by: Option<&MaterialName>,
        names: &[String],
        library: &Library,
    ) -> Result<Vec<u32>, SceneError> {
        let specs = match override_by {
            Some(material) => vec![self.overriding(material)?; names.len()],
            None => self.of_names(path, names)?,
        };
        if let Some(missing) = &library.missing {
            let needs_it = |&&spec: &&usize| self.specs[spec].reads_mtl();
            if let Some(&spec) = specs.iter().find(needs_it) {
                let reader = &self.specs[spec].name;
                let hint = format!("the material `{reader}` of the scene reads its values");
                return Err(missing.clone().hint(hint));
            }
        }
        let each = specs.iter().zip(names);
        Ok(each
            .map(|(&spec, name)| self.instantiate(spec, name, library))
            .collect())
    }

    /// Indices of the materials that the camera is in. Nothing else need use them.
    pub(super) fn of_camera(&mut self, media: &[MaterialName]) -> Result<Vec<u32>, SceneError> {
        let index = |medium: &MaterialName| match self.find(&medium.name) {
            Some(spec) => Ok(self.instantiate(spec, &medium.name, &Library::default())),
            None => {
                let hint = self.suggestion(&medium.name);
                Err(medium.missing.clone().hint(hint))
            }
        };
        media.iter().map(index).collect()
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
        self.specs.iter().position(|spec| spec.name == name)
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

    fn of_names(&self, path: &Path, names: &[String]) -> Result<Vec<usize>, SceneError> {
        let wildcard = self.find(WILDCARD);
        let found: Vec<Option<usize>> = names.iter().map(|n| self.find(n).or(wildcard)).collect();
        let missing = names.iter().zip(&found).filter(|(_, spec)| spec.is_none());
        let missing: Vec<&str> = missing.map(|(name, _)| name.as_str()).collect();
        match missing[..] {
            [] => Ok(found.into_iter().flatten().collect()),
            [""] => {
                let message = "faces without `usemtl` have no material";
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
    fn instantiate(&mut self, spec: usize, name: &str, library: &Library) -> u32 {
        self.used[spec] = true;
        let spec = &self.specs[spec];
        let mtl = library.materials.get(name);
        let params: Vec<(String, String)> = spec
            .params
            .iter()
            .filter_map(|(key, value)| Some((key.clone(), value.source(mtl)?)))
            .collect();
        let content = (spec.file.clone(), spec.material.clone(), params, spec.bake);
        if let Some(&known) = self.by_content.get(&content) {
            return known;
        }
        let index = self.resolved.len() as u32;
        self.by_content.insert(content.clone(), index);
        let (file, material, params, bake) = content;
        self.resolved.push(MaterialBinding {
            name: self.unique_name(spec, name),
            file,
            material,
            params,
            bake,
        });
        index
    }

    /// The binding's name; for the wildcard, the name it stands for, or that of its file.
    fn unique_name(&self, spec: &MaterialSpec, name: &str) -> String {
        let stem = Path::new(&spec.file).file_stem().and_then(|s| s.to_str());
        let name = match spec.name.as_str() {
            WILDCARD if spec.reads_mtl() && !name.is_empty() => name,
            WILDCARD => stem.unwrap_or("material"),
            own => own,
        };
        let taken = |candidate: &str| self.resolved.iter().any(|m| m.name == candidate);
        let numbered = (2..).map(|i| format!("{name}_{i}"));
        let mut candidates = std::iter::once(name.to_owned()).chain(numbered);
        candidates.find(|c| !taken(c)).unwrap_or_default()
    }
}

impl MaterialSpec {
    /// Does some parameter come from the MTL file?
    fn reads_mtl(&self) -> bool {
        self.params
            .iter()
            .any(|(_, p)| matches!(p, ParamSpec::Mtl(_)))
    }
}

impl ParamSpec {
    fn source(&self, mtl: Option<&(PathBuf, tobj::Material)>) -> Option<String> {
        match self {
            ParamSpec::Source(text) => Some(text.clone()),
            ParamSpec::Mtl(value) => {
                let folder = mtl.map_or(Path::new(""), |(folder, _)| folder);
                value.source(mtl.map(|(_, material)| material), folder)
            }
        }
    }
}
