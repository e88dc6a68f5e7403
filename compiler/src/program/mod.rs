//! A compiled program: materials as code, instances as values, and what the renderer must know of
//! both. `build` makes it, [`crate::codegen`] writes its text.
//!
//! Instances of one material share its code. A parameter on which all of them agree is a constant
//! in it; what depends on nothing but the others is computed on the host, once an instance, and read
//! by the kernel from the parameter table (see [`crate::parameters`]).

use std::sync::Arc;

use crate::abi::{self, InstanceInfo, Lookups, MaterialInfo, Table, TextureRef, TextureSpace};
use crate::closure;
use crate::ir::{Const, Function, Material, Module};
use crate::parameters::TableLayout;
use crate::passes::Hoisted;
use crate::source::{SourceMap, Span};

mod names;

pub use names::{Names, identifier, unique};

/// Compiled materials and their instances.
#[derive(Clone, Debug)]
pub struct Program {
    pub(crate) module: Module,
    pub(crate) names: Names,
    pub(crate) core: closure::Core,
    pub(crate) materials: Vec<CompiledMaterial>,
    /// What instances of each are made by.
    pub(crate) recipes: Vec<Arc<Recipe>>,
    pub(crate) instances: Vec<Instance>,
    /// Textures that some material may read and how, in the order of their slots.
    pub(crate) textures: Vec<Slot>,
    /// Line of each span that generated code mentions, by file.
    pub(crate) sources: SourceMap,
    pub(crate) effort: u64,
    pub(crate) looks: bool,
}

/// A texture as it is read: its index in `module.textures`, in which space, and by which lookups.
pub(crate) type Slot = (usize, TextureSpace, Lookups);

/// A material with its functions.
#[derive(Clone, Debug)]
pub struct CompiledMaterial {
    /// What the renderer must know.
    pub info: MaterialInfo,
    /// `(point, wo, wl, u) -> MaterialSample`
    pub evaluate: Function,
    /// `(point, wo) -> radiance`, when it emits.
    pub emission: Option<Function>,
    /// How it looks, if the program was compiled with that.
    pub looks: Option<closure::Looks>,
    /// Where the values lie that its functions read of the rows of an instance.
    pub layout: TableLayout,
}

/// What the values of a material's instances are computed by.
#[derive(Clone, Debug)]
pub(crate) struct Recipe {
    /// The material as passes left it.
    pub material: Material,
    /// The values of its parameters that are constants of its code.
    pub constants: Vec<Option<Const>>,
    /// What the host computes for each instance.
    pub hoisted: Vec<Hoisted>,
}

/// An instance of a material.
#[derive(Clone, Debug)]
pub struct Instance {
    /// What the renderer must know.
    pub info: InstanceInfo,
    /// The values of the material's parameters.
    pub(crate) parameters: Vec<Const>,
    /// What it has in the parameter table.
    pub values: Vec<Const>,
    /// Its first row in the parameter table.
    pub row: u32,
}

impl Program {
    /// What the renderer must know of each material, in the order of their first requests.
    pub fn materials(&self) -> impl ExactSizeIterator<Item = &MaterialInfo> {
        self.materials.iter().map(|m| &m.info)
    }

    /// As [`Program::materials`], copied.
    pub fn infos(&self) -> Vec<MaterialInfo> {
        self.materials().cloned().collect()
    }

    /// The instances, in the order of the requests.
    pub fn instances(&self) -> &[Instance] {
        &self.instances
    }

    /// The values of an instance's parameters by their names, in the order in which they are declared; without those
    /// that only callers give.
    pub fn parameters(&self, instance: usize) -> impl Iterator<Item = (&str, &Const)> {
        let instance = self.instances.get(instance);
        let own = instance.into_iter().flat_map(|instance| {
            let params = &self.recipes[instance.info.material].material.params;
            params.iter().zip(&instance.parameters)
        });
        let own = own.filter(|(param, _)| !param.is_input && !param.name.contains(' '));
        own.map(|(param, value)| (param.name.as_str(), value))
    }

    /// The file of a texture that is a parameter's value, as the source or scene names it.
    pub fn texture(&self, value: &Const) -> Option<&str> {
        let Const::Int(texture) = value else {
            return None;
        };
        let texture = usize::try_from(*texture).ok()?;
        self.module.textures.get(texture).map(String::as_str)
    }

    /// The file and the line, from 1, where a material is defined.
    pub fn place(&self, material: usize) -> Option<(String, u32)> {
        let span = self
            .sources
            .known(self.recipes.get(material)?.material.span);
        let file = self.sources.file(span.file).name.clone();
        Some((file, self.sources.line_column(span).0 as u32))
    }

    /// The materials with their functions, for interpreters and analyses.
    pub fn compiled(&self) -> &[CompiledMaterial] {
        &self.materials
    }

    /// The IR of the functions that materials call.
    pub fn ir(&self) -> &Module {
        &self.module
    }

    /// Whether it was compiled with functions that say how materials look.
    pub fn has_looks(&self) -> bool {
        self.looks
    }

    /// Statements that the passes walked to make the program: what it took to compile, in a
    /// number that does not depend on the machine.
    pub fn effort(&self) -> u64 {
        self.effort
    }

    /// The textures to provide; a texture's position is its slot.
    pub fn textures(&self) -> Vec<TextureRef> {
        let texture = |&(t, space, lookups): &Slot| TextureRef {
            path: self.module.textures[t].clone(),
            space,
            lookups,
        };
        self.textures.iter().map(texture).collect()
    }

    /// What all lookups need together.
    pub fn lookups(&self) -> Lookups {
        let all = self.textures.iter().map(|slot| slot.2);
        all.fold(Lookups::default(), Lookups::and)
    }

    /// The buffers that the code reads; none if every material has one instance.
    pub fn tables(&self) -> Vec<Table> {
        let mut tables = Vec::new();
        if self.has_instance_table() {
            let rows = self.instances.iter();
            let words = rows.flat_map(|i| [i.info.material as u32, i.row]).collect();
            tables.push(Table {
                name: abi::INSTANCES,
                wgsl_type: "array<vec2<u32>>",
                words,
            });
        }
        let parameters: Vec<u32> = self
            .instances
            .iter()
            .flat_map(|i| self.row_words(i))
            .collect();
        if !parameters.is_empty() {
            tables.push(Table {
                name: abi::PARAMETERS,
                wgsl_type: "array<vec4<u32>>",
                words: parameters,
            });
        }
        tables
    }

    /// Must the material of an instance, or where its parameters lie, be looked up?
    pub(crate) fn has_instance_table(&self) -> bool {
        let mut materials = self.instances.iter().enumerate();
        materials.any(|(i, instance)| instance.info.material != i)
            || self.materials.iter().any(|m| m.layout.rows > 0)
    }

    /// The words of an instance in the parameter table.
    fn row_words(&self, instance: &Instance) -> Vec<u32> {
        self.materials[instance.info.material]
            .layout
            .pack(&instance.values)
    }

    /// The slot of texture `t` read in one way; the first where it is not read so.
    pub(crate) fn slot(&self, t: usize, space: TextureSpace) -> u32 {
        let found = self.textures.iter().position(|s| (s.0, s.1) == (t, space));
        found.unwrap_or(0) as u32
    }

    /// The texts that the program was made of.
    pub(crate) fn sources(&self) -> &SourceMap {
        &self.sources
    }

    /// `car_paint.impasto:12`: where a span is, without folders, which differ between machines.
    pub(crate) fn origin(&self, span: Span) -> String {
        let text = self.sources.file_line(span);
        match text.rsplit_once('/') {
            Some((_, name)) if !text.starts_with("std/") => name.to_owned(),
            _ => text,
        }
    }
}
