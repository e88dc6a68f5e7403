//! From prims to a [`Model`]: which of them are shown, where, and with which materials.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use glam::{DMat4, DQuat, DVec3};
use openusd::sdf::{Path, Specifier, Value};
use openusd::usd::Stage;

use super::arcs::Arcs;
use super::model::{Mesh, Model, Placed};
use super::values::{self, Reader};
use super::{shade, solids};
use crate::input::names::Unique;

/// Prims that are visited, those of instances each time; how deep they lie; and places of instances.
const MOST_PRIMS: usize = 200_000;
const DEEPEST: usize = 256;
pub(super) const MOST_PLACES: usize = 2_000_000;

/// Prims that would be shown if they were read.
const NOT_READ: [&str; 12] = [
    "BasisCurves",
    "NurbsCurves",
    "NurbsPatch",
    "HermiteCurves",
    "Points",
    "TetMesh",
    "Volume",
    "ParticleField3DGaussianSplat",
    "GeometryLight",
    "PortalLight",
    "PluginLight",
    "GenerativeProcedural",
];

type Checked<T = ()> = Result<T, String>;

/// What a prim has from those above.
#[derive(Clone)]
pub(super) struct Above {
    /// Where the prim is.
    pub(super) world: DMat4,
    pub(super) moves: bool,
    pub(super) is_visible: bool,
    /// Is it of a purpose that is rendered? None until somebody says.
    pub(super) purpose: Option<bool>,
    /// Its material, and whether that is stronger than those below.
    pub(super) material: Option<(Path, bool)>,
    pub(super) skeleton: Option<Path>,
    pub(super) animation: Option<Path>,
    pub(super) depth: usize,
}

/// A model that grows.
pub(super) struct Walk<'s> {
    pub(super) reader: Reader<'s>,
    arcs: Arcs,
    pub(super) model: Model,
    /// Meshes by path and material.
    meshes: HashMap<(String, Option<usize>), usize>,
    materials: HashMap<String, usize>,
    /// What scenes call materials, and what their sources are called.
    pub(super) names: Unique,
    pub(super) sources_named: Unique,
    /// What texture coordinates are called that materials read, by their number.
    pub(super) coordinates: Vec<Vec<String>>,
    visited: usize,
    /// Where prototypes of instances come from: their path, and the one that is counted in its place.
    sources: Vec<(String, String)>,
    not_read: BTreeMap<String, usize>,
    warned: BTreeSet<String>,
    /// What brings a stage to metres with y up.
    pub(super) upright: DMat4,
    pub(super) takes_camera: bool,
    /// Did Blender write it?
    pub(super) is_of_blender: bool,
}

impl<'s> Walk<'s> {
    pub(super) fn new(reader: Reader<'s>, arcs: Arcs, model: Model) -> Self {
        let metres = metadata(reader.stage, "metersPerUnit")
            .as_ref()
            .and_then(values::number);
        // Without a word of it, USD is in centimetres.
        let metres = metres.filter(|m| *m > 0.0 && m.is_finite()).unwrap_or(0.01);
        let axis = metadata(reader.stage, "upAxis")
            .as_ref()
            .and_then(values::text);
        let writer = metadata(reader.stage, "documentation")
            .as_ref()
            .and_then(values::text);
        let turn = match axis.as_deref() {
            Some("Z") => DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2),
            _ => DQuat::IDENTITY,
        };
        Self {
            reader,
            arcs,
            model,
            meshes: HashMap::new(),
            materials: HashMap::new(),
            names: Unique::default(),
            sources_named: Unique::default(),
            coordinates: Vec::new(),
            visited: 0,
            sources: Vec::new(),
            not_read: BTreeMap::new(),
            warned: BTreeSet::new(),
            upright: DMat4::from_scale_rotation_translation(
                DVec3::splat(metres),
                turn,
                DVec3::ZERO,
            ),
            takes_camera: true,
            is_of_blender: writer.is_some_and(|text| text.starts_with("Blender")),
        }
    }

    /// The model of the whole stage.
    pub(super) fn whole(mut self) -> Checked<Model> {
        let above = Above {
            world: self.upright,
            moves: false,
            is_visible: true,
            purpose: None,
            material: None,
            skeleton: None,
            animation: None,
            depth: 0,
        };
        self.children(&Path::abs_root(), &above)?;
        for (kind, count) in &self.not_read {
            let warning = format!("prims of the type `{kind}`, which are not rendered: {count}");
            self.model.warnings.push(warning);
        }
        Ok(self.model)
    }

    pub(super) fn warn(&mut self, text: String) {
        if self.warned.len() < 100 && self.warned.insert(text.clone()) {
            self.model.warnings.push(text);
        }
    }

    /// Fails if too much is composed into a prim, or too many are visited.
    fn enter(&mut self, path: &Path) -> Checked {
        self.visited += 1;
        if self.visited > MOST_PRIMS {
            return Err(format!(
                "the file has more than {MOST_PRIMS} prims, instances counted each time"
            ));
        }
        let text = path.as_str();
        let source = self.sources.iter().rev().find_map(|(prototype, instance)| {
            let rest = text.strip_prefix(prototype.as_str())?;
            (rest.is_empty() || rest.starts_with('/')).then(|| format!("{instance}{rest}"))
        });
        self.arcs.check(source.as_deref().unwrap_or(text))
    }

    fn children(&mut self, path: &Path, above: &Above) -> Checked {
        let names = if path.is_abs_root() {
            self.reader.stage.root_prims()
        } else {
            self.reader.stage.prim(path.clone()).child_names()
        };
        let names = names.map_err(|e| format!("`{path}` cannot be read: {e:#}"))?;
        for name in names {
            let child = path.append_path(name.as_str());
            let child = child.map_err(|e| format!("`{path}` has a child without a name: {e:#}"))?;
            self.prim(&child, above)?;
        }
        Ok(())
    }

    pub(super) fn prim(&mut self, path: &Path, above: &Above) -> Checked {
        self.enter(path)?;
        let prim = self.reader.stage.prim(path.clone());
        let is_shown = prim
            .is_active()
            .map_err(|e| format!("`{path}` cannot be read: {e:#}"))?
            && matches!(
                prim.specifier()
                    .map_err(|e| format!("`{path}` cannot be read: {e:#}"))?,
                Some(Specifier::Def)
            );
        if !is_shown {
            return Ok(());
        }
        if above.depth > DEEPEST {
            return Err(format!(
                "prims lie more than {DEEPEST} deep within each other at `{path}`"
            ));
        }
        let kind = prim
            .type_name()
            .map_err(|e| format!("`{path}` cannot be read: {e:#}"))?;
        let kind = kind.as_ref().map_or("", |kind| kind.as_str()).to_owned();
        let here = self.below(path, &kind, above)?;
        if here.purpose == Some(false) {
            return Ok(());
        }
        match kind.as_str() {
            // Nothing in it is shown where it stands.
            "Material" | "Shader" | "NodeGraph" | "GeomSubset" | "Skeleton" | "SkelAnimation"
            | "BlendShape" => {
                return Ok(());
            }
            "PointInstancer" => return self.instancer(path, &here),
            "Mesh" | "Sphere" | "Cube" | "Cylinder" | "Cylinder_1" | "Cone" | "Capsule"
            | "Capsule_1" | "Plane" => {
                self.surface(path, &kind, &here)?;
            }
            "Camera" if self.model.camera.is_none() && self.takes_camera => {
                self.camera(path, &here)?;
            }
            "DistantLight" | "SphereLight" | "RectLight" | "DiskLight" | "CylinderLight"
            | "DomeLight" | "DomeLight_1"
                if here.is_visible =>
            {
                self.light(path, &kind, &here)?;
            }
            kind if NOT_READ.contains(&kind) => {
                *self.not_read.entry(kind.to_owned()).or_default() += 1;
            }
            _ => {}
        }
        if !prim
            .is_instance()
            .map_err(|e| format!("`{path}` cannot be read: {e:#}"))?
        {
            return self.children(path, &here);
        }
        let prototype = prim
            .prototype()
            .map_err(|e| format!("`{path}` cannot be read: {e:#}"))?;
        let Some(prototype) = prototype else {
            return self.children(path, &here);
        };
        // What is composed there is what is composed here.
        self.sources
            .push((prototype.as_str().to_owned(), path.as_str().to_owned()));
        let done = self.children(&prototype, &here);
        self.sources.pop();
        done
    }

    /// What a prim hands down.
    fn below(&mut self, path: &Path, kind: &str, above: &Above) -> Checked<Above> {
        let mut here = above.clone();
        here.depth += 1;
        let local = self.reader.local(path)?;
        let parent = if local.resets {
            self.upright
        } else {
            above.world
        };
        here.world = parent * local.matrix;
        here.moves = local.varies || above.moves && !local.resets;
        if self.reader.token(path, "visibility")?.as_deref() == Some("invisible") {
            here.is_visible = false;
        }
        here.moves |= self.reader.varies(path, "visibility");
        // Only drawable prims and what is above them have purposes; each may say its own where none was said above.
        if here.purpose.is_none() || kind == "Scope" || kind == "Xform" {
            let purpose = self.reader.token(path, "purpose")?;
            match purpose.as_deref() {
                Some("default" | "render") => here.purpose = Some(true),
                Some("proxy" | "guide") => here.purpose = Some(false),
                _ => {}
            }
        }
        if let Some(bound) = self.binding(path)? {
            let is_settled = matches!(above.material, Some((_, true)));
            if !is_settled {
                here.material = Some(bound);
            }
        }
        for (name, place) in [
            ("skel:skeleton", &mut here.skeleton),
            ("skel:animationSource", &mut here.animation),
        ] {
            if let Some(target) = self.reader.targets(path, name)?.into_iter().next() {
                *place = Some(target);
            }
        }
        Ok(here)
    }

    /// The material that is bound at a prim, and whether it is stronger than those below.
    pub(super) fn binding(&mut self, path: &Path) -> Checked<Option<(Path, bool)>> {
        for name in ["material:binding:full", "material:binding"] {
            let targets = self.reader.targets(path, name)?;
            if let Some(target) = targets.into_iter().next() {
                let strength = self.reader.field(path, name, "bindMaterialAs");
                return Ok(Some((
                    target,
                    strength.as_deref() == Some("strongerThanDescendants"),
                )));
            }
        }
        Ok(None)
    }

    /// The number of a material in the model; none if there is none at that path.
    pub(super) fn material(&mut self, path: &Path) -> Checked<Option<usize>> {
        if let Some(known) = self.materials.get(path.as_str()) {
            return Ok(Some(*known));
        }
        self.enter(path)?;
        let kind = self.reader.stage.prim(path.clone()).type_name();
        if kind
            .ok()
            .flatten()
            .is_none_or(|kind| kind.as_str() != "Material")
        {
            self.warn(format!("the material `{path}` is bound, but is not there"));
            return Ok(None);
        }
        let material = shade::material(self, path)?;
        let number = self.model.materials.len();
        self.model.materials.push(material);
        self.materials.insert(path.as_str().to_owned(), number);
        Ok(Some(number))
    }

    fn surface(&mut self, path: &Path, kind: &str, here: &Above) -> Checked {
        let material = match &here.material {
            Some((path, _)) => self.material(path)?,
            None => None,
        };
        let key = (path.as_str().to_owned(), material);
        let mesh = match self.meshes.get(&key) {
            Some(known) => *known,
            None => {
                let mut mesh = if kind == "Mesh" {
                    self.mesh(path, here, material)?
                } else {
                    solids::solid(self, path, kind)?
                };
                mesh.path = path.as_str().to_owned();
                mesh.material = material;
                self.colors(path, &mut mesh)?;
                self.model.meshes.push(mesh);
                self.meshes.insert(key, self.model.meshes.len() - 1);
                self.model.meshes.len() - 1
            }
        };
        self.place(mesh, vec![here.world], here)
    }

    fn place(&mut self, mesh: usize, places: Vec<DMat4>, here: &Above) -> Checked {
        let all: usize = self
            .model
            .placed
            .iter()
            .map(|p| p.places.len())
            .sum::<usize>()
            * usize::from(places.len() > 1);
        if all + places.len() > MOST_PLACES {
            return Err(format!("the file has more than {MOST_PLACES} instances"));
        }
        let moves = here.moves || self.model.meshes[mesh].moves;
        self.model.placed.push(Placed {
            mesh,
            places,
            moves,
            is_visible: here.is_visible,
        });
        Ok(())
    }

    /// The colors of a mesh: what it says, else the grey that USD has for it.
    fn colors(&mut self, path: &Path, mesh: &mut Mesh) -> Checked {
        mesh.colors = self.primvar(path, "primvars:displayColor", |value| {
            values::vectors(value)
        })?;
        if mesh.colors.is_none() && mesh.material.is_none() {
            mesh.colors = Some(super::model::Primvar {
                values: vec![glam::Vec3::splat(0.18)],
                ..Default::default()
            });
        }
        Ok(())
    }
}

/// Metadata of the stage.
pub(super) fn metadata(stage: &Stage, name: &str) -> Option<Value> {
    stage.stage_metadata(name).ok().flatten()
}
