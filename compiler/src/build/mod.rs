//! Makes a program of checked materials: walks each through the table of passes, and puts values
//! to its instances.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::abi::{Emission, Input, MaterialInfo};
use crate::closure::{self, Core, Excess};
use crate::codegen;
use crate::diag::Diagnostic;
use crate::ir::{self, Function, Module};
use crate::parameters::TableLayout;
use crate::passes::{self, MaterialState, Pass};
use crate::program::{CompiledMaterial, Instance, Names, Program, Recipe, unique};
use crate::sema::Checker;
use crate::stages::{Progress, Stage};

pub(crate) mod alike;
pub(crate) mod constants;
pub(crate) mod errors;
mod functions;
pub(crate) mod instances;
mod interior;
mod lookups;

use functions::{Functions, Size};
pub(crate) use instances::Setting;

/// Adds a warning unless one of its kind points there already.
fn note_once(diagnostics: &mut Vec<Diagnostic>, warning: Diagnostic) {
    let overlaps = |d: &Diagnostic| match (d.span, warning.span) {
        (Some(a), Some(b)) => {
            let (a_range, b_range) = (a.range(), b.range());
            a.file == b.file && a_range.start < b_range.end && b_range.start < a_range.end
        }
        _ => false,
    };
    if !diagnostics
        .iter()
        .any(|d| d.code == warning.code && overlaps(d))
    {
        diagnostics.push(warning);
    }
}

/// Collects lowered materials.
pub(crate) struct ProgramBuilder {
    core: Core,
    functions: Functions,
    materials: Vec<CompiledMaterial>,
    recipes: Vec<Arc<Recipe>>,
    instances: Vec<Instance>,
    names: BTreeMap<String, u32>,
    /// Are there functions that say how materials look?
    looks: bool,
}

impl ProgramBuilder {
    pub(crate) fn new(checker: &mut Checker) -> Option<Self> {
        let core = Core {
            valid_normal: checker.core_function("valid_normal")?,
            frame: checker.core_function("frame")?,
            to_local: checker.core_function("to_local")?,
            to_world: checker.core_function("to_world")?,
            transport_valid: checker.core_function("transport_valid")?,
            surface_point: checker.core_struct("SurfacePoint")?,
            material_sample: checker.core_struct("MaterialSample")?,
            transparent: None,
        };
        Some(Self {
            core,
            functions: Functions::default(),
            materials: Vec::new(),
            recipes: Vec::new(),
            instances: Vec::new(),
            names: BTreeMap::from([("material".to_owned(), 1)]),
            looks: false,
        })
    }

    /// Makes functions that say how materials look as well.
    pub(crate) fn with_looks(mut self, looks: bool) -> Self {
        self.looks = looks;
        self
    }

    /// What lowered code uses of the library.
    pub(crate) fn core(&self) -> Core {
        self.core
    }

    /// Lowers a material, with the given settings as its instances.
    pub(crate) fn add(
        &mut self,
        checker: &mut Checker,
        material: ir::Material,
        settings: &[Setting],
    ) {
        let Some(state) = self.start(checker, material, settings) else {
            return;
        };
        if let Err(problem) = self.lower(checker, state, settings) {
            checker.diagnostics.push(problem);
        }
    }

    /// What passes get of a material: cut out by its opacity, with what it calls at hand.
    fn start(
        &mut self,
        checker: &mut Checker,
        mut material: ir::Material,
        settings: &[Setting],
    ) -> Option<MaterialState> {
        if material.opacity.is_some() {
            let transparent = checker.library_closure("bsdf", "transparent")?;
            self.core.transparent = Some(transparent);
            closure::cut_out(&mut material, transparent);
        }
        self.functions.take_over(&checker.ir);
        let mut state = MaterialState::new(material, instances::agreed(settings));
        state.has_looks = self.looks;
        Some(state)
    }

    /// Takes a material through all passes.
    fn lower(
        &mut self,
        checker: &mut Checker,
        mut state: MaterialState,
        settings: &[Setting],
    ) -> Result<(), Diagnostic> {
        for rows in passes::steps() {
            self.step(rows, &mut state, &mut checker.progress)?;
        }
        let module = &self.functions.module;
        let textures = instances::textures(&state.material, settings, &checker.literal_textures);
        let instances = instances::instances(module, &state, settings, self.materials.len())?;
        let gained = settings
            .iter()
            .filter_map(|setting| self.gain(&state, setting))
            .next();
        checker.diagnostics.extend(gained);
        for bright in self.too_bright(&state, settings) {
            note_once(&mut checker.diagnostics, bright);
        }
        self.finish_material(state, textures, &instances);
        self.instances.extend(instances);
        Ok(())
    }

    /// A warning if a material whose look depends on the view gains light with the values of a setting.
    fn gain(&self, state: &MaterialState, setting: &Setting) -> Option<Diagnostic> {
        let module = &self.functions.module;
        let evaluate = state.functions.first()?;
        let inputs = codegen::inputs(&module.structs, &[evaluate]);
        let m = &state.material;
        let gain = inputs
            .has(Input::View)
            .then(|| closure::gain(module, &self.core, m, &setting.values))??;
        Some(errors::gains(m, gain))
    }

    /// Warnings of lobes that scatter more light than falls on them.
    fn too_bright(&self, state: &MaterialState, settings: &[Setting]) -> Vec<Diagnostic> {
        let (module, m) = (&self.functions.module, &state.material);
        let each = settings.iter().flat_map(|setting| {
            let excesses = closure::excesses(module, m, &setting.values);
            let warning = |e: Excess| errors::too_bright(m, &e, &setting.name);
            excesses.into_iter().map(warning)
        });
        each.collect()
    }

    /// Takes a material through passes that belong together, and before them what it calls.
    fn step(
        &mut self,
        rows: &[Pass],
        state: &mut MaterialState,
        progress: &mut Progress<'_>,
    ) -> Result<(), Diagnostic> {
        let callees = rows[0].callees(&self.functions.module, &self.core, &state.material);
        if !callees.is_empty() {
            progress.enter(Stage::Functions);
            self.functions.optimise(callees);
        }
        progress.enter(rows[0].stage());
        let walked = passes::apply(rows, &self.functions.module, &self.core, state)?;
        self.functions.effort += walked;
        if !rows[0].is_repeated() {
            return Ok(());
        }
        let sizes = state.functions.iter().map(|f| self.functions.size(f));
        let sizes: Vec<Size> = sizes.collect();
        let evaluate = sizes.first().map_or(0, |size| size.expanded);
        if evaluate > errors::MAX_SIZE {
            return Err(errors::too_large(&state.material, evaluate));
        }
        match sizes.iter().map(|size| size.longest).max() {
            Some(longest) if longest > errors::MAX_TEXT => {
                Err(errors::too_long_a_function(&state.material, longest))
            }
            _ => Ok(()),
        }
    }

    /// A material when the pass `name` has gone over it for the first time, with the module that it
    /// calls into; none if it does not get there, or has no surface to be lowered.
    pub(crate) fn after_pass(
        &mut self,
        checker: &mut Checker,
        material: ir::Material,
        settings: &[Setting],
        name: &str,
    ) -> Option<(&Module, MaterialState)> {
        let mut state = self.start(checker, material, settings)?;
        for rows in passes::steps() {
            let here = rows.iter().any(|pass| pass.name == name);
            if here && rows[0].is_repeated() {
                for f in &mut state.functions {
                    passes::run_until(&self.functions.module, f, name);
                }
            } else {
                self.step(rows, &mut state, &mut checker.progress).ok()?;
            }
            if here {
                break;
            }
        }
        let shown = state.functions.is_empty() || state.material.surface.is_some();
        shown.then_some((&self.functions.module, state))
    }

    /// Adds what became of a material, for the instances that it has.
    fn finish_material(
        &mut self,
        state: MaterialState,
        textures: Vec<usize>,
        instances: &[Instance],
    ) {
        let module = &self.functions.module;
        let varying = instances
            .iter()
            .any(|i| i.info.emission == Emission::Varying);
        let layout = TableLayout::new(&state.table());
        let name = unique(&mut self.names, &state.material.name);
        let emits = state.emission().is_some();
        let mut functions = state.functions;
        for f in &mut functions {
            f.name.clone_from(&name);
        }
        let unread = |at: usize| at == 1 && emits && !varying;
        let read = functions.iter().enumerate().filter(|(at, _)| !unread(*at));
        let read: Vec<&Function> = read.map(|(_, f)| f).collect();
        let lobes = closure::surface_lobes(&state.material);
        let crosses = closure::transmissive(module, &state.material, &lobes);
        let walks = closure::walks(module, &lobes);
        let info = MaterialInfo {
            name,
            delta_only: closure::delta_only(module, &lobes) && !walks,
            crosses,
            walks,
            transmissive: crosses && instances.iter().any(|i| i.info.medium.is_some()),
            varying_emission: varying,
            inputs: codegen::inputs(&module.structs, &read),
            textures,
            lobes: lobes.len(),
        };
        let mut functions = functions.into_iter();
        if let Some(evaluate) = functions.next() {
            self.recipes.push(Arc::new(Recipe {
                material: state.material,
                constants: state.constants,
                hoisted: state.hoisted,
            }));
            self.materials.push(CompiledMaterial {
                info,
                evaluate,
                emission: if emits { functions.next() } else { None },
                looks: closure::Looks::from_functions(functions),
                layout,
            });
        }
    }

    /// Puts the instance that was added as number `i` at `places[i]`.
    pub(crate) fn order_instances(&mut self, places: &[usize]) {
        let mut placed: Vec<(usize, Instance)> = places
            .iter()
            .copied()
            .zip(self.instances.drain(..))
            .collect();
        placed.sort_by_key(|(place, _)| *place);
        self.instances.extend(placed.into_iter().map(|(_, i)| i));
    }

    pub(crate) fn finish(mut self, checker: &Checker) -> Program {
        self.functions.take_over(&checker.ir);
        let mut row = 0;
        for instance in &mut self.instances {
            instance.row = row;
            row += self.materials[instance.info.material].layout.rows;
        }
        let Functions { module, effort, .. } = self.functions;
        let textures = lookups::slots(&module, &mut self.materials);
        Program {
            names: Names::new(
                &module,
                &checker.sources,
                &[self.core.surface_point, self.core.material_sample],
            ),
            module,
            core: self.core,
            materials: self.materials,
            recipes: self.recipes,
            instances: self.instances,
            textures,
            sources: checker.sources.clone(),
            effort,
            looks: self.looks,
        }
    }
}
