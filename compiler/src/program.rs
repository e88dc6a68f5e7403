//! A compiled program: materials as code, instances as values, and what the renderer must know of
//! both; and the builder that takes checked materials there.
//!
//! Instances of one material share its code. A parameter on which all of them agree is a constant
//! in it; what depends on nothing but the others is computed here, once an
//! instance, and read by the kernel from the parameter table (see [`crate::parameters`]).

use std::collections::{BTreeMap, BTreeSet};

use crate::abi::{
    self, Emission, InstanceInfo, Lookups, MaterialInfo, Table, TextureRef, TextureSpace,
};
use crate::codegen::{self, Target};
use crate::diag::{Code, Diagnostic};
use crate::ir::{
    self, ClosureDefId, Const, ExprKind, Function, FunctionId, Methods, Module, Type, walk,
};
use crate::parameters::Layout;
use crate::passes::{self, Hoisted, Widths};
use crate::sema::Checker;
use crate::source::{SourceMap, Span};
use crate::stages::{Progress, Stage};
use crate::{closure, interior};

mod lookups;

/// Compiled materials and their instances.
#[derive(Clone, Debug)]
pub struct Program {
    pub(crate) module: Module,
    pub(crate) names: codegen::Names,
    pub(crate) core: closure::Core,
    pub(crate) materials: Vec<CompiledMaterial>,
    instances: Vec<Instance>,
    /// Textures that some material may read and how, by index of `module.textures`, in the order of
    /// their slots.
    textures: Vec<lookups::Slot>,
    /// Line of each span that generated code mentions, by file.
    sources: SourceMap,
    effort: u64,
}

/// A material with its functions.
#[derive(Clone, Debug)]
pub struct CompiledMaterial {
    /// What the renderer must know.
    pub info: MaterialInfo,
    /// `(point, wo, wl, u) -> MaterialSample`
    pub evaluate: Function,
    /// `(point, wo) -> radiance`, when it emits.
    pub emission: Option<Function>,
    /// Where the values lie that both functions read of the rows of an instance.
    pub layout: Layout,
}

/// An instance of a material.
#[derive(Clone, Debug)]
pub struct Instance {
    /// What the renderer must know.
    pub info: InstanceInfo,
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

    /// The materials with their functions, for interpreters and analyses.
    pub fn compiled(&self) -> &[CompiledMaterial] {
        &self.materials
    }

    /// The IR of the functions that materials call.
    pub fn ir(&self) -> &Module {
        &self.module
    }

    /// Statements that the passes walked to make the program: what it took to compile, in a
    /// number that does not depend on the machine.
    pub fn effort(&self) -> u64 {
        self.effort
    }

    /// The textures to provide; a texture's position is its slot.
    pub fn textures(&self) -> Vec<TextureRef> {
        let texture = |&(t, space, lookups): &lookups::Slot| TextureRef {
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

    /// The WGSL of some materials: structs, the functions they reach, one function a material,
    /// `evaluate_material`, and `material_emission` if some emission varies.
    pub fn wgsl(&self, members: &[usize]) -> String {
        codegen::module(self, members)
    }

    /// The WGSL of `material_of`, which kernels need to sort instances by material.
    pub fn lookup_wgsl(&self) -> String {
        codegen::lookup(self)
    }

    /// The WGSL of all materials as a module of its own, with declarations of all that a kernel
    /// would provide.
    pub fn complete_wgsl(&self, target: Target) -> String {
        let all: Vec<usize> = (0..self.materials.len()).collect();
        codegen::complete(self, &all, target)
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

    /// The first function of some materials whose blocks lie deeper within each other than WGSL
    /// allows, as the error to report.
    pub(crate) fn nested_too_deep(&self, members: &[usize]) -> Option<Diagnostic> {
        let own = members.iter().map(|&m| &self.materials[m]);
        let own = own.flat_map(|m| std::iter::once(&m.evaluate).chain(&m.emission));
        let deep = |f: &&Function| walk::nesting(&f.body) > walk::MAX_NESTING;
        let f = self.module.functions.iter().chain(own).find(deep)?;
        let message = format!("the blocks of `{}` nest too deeply", f.name);
        Some(
            Diagnostic::new(Code::NestedTooDeep, f.span, message)
                .expected(format!(
                    "at most {} blocks within each other",
                    walk::MAX_NESTING
                ))
                .hint("move inner blocks to a function"),
        )
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

/// Values for a material's parameters, and who wants them.
#[derive(Clone, Debug)]
pub(crate) struct Setting {
    /// The instance's name.
    pub name: String,
    /// A value for every parameter.
    pub values: Vec<Const>,
    /// Must the code hold for other values as well?
    pub open: bool,
}

/// Collects lowered materials.
pub(crate) struct ProgramBuilder {
    core: closure::Core,
    /// The checker's module with its functions optimised, as far as materials needed them yet.
    module: Module,
    /// Expressions of each function with its calls put in line; none if it is as it was checked.
    sizes: Vec<Option<u64>>,
    /// Statements that passes walked.
    effort: u64,
    materials: Vec<CompiledMaterial>,
    instances: Vec<Instance>,
    names: BTreeMap<String, u32>,
}

impl ProgramBuilder {
    pub(crate) fn new(checker: &mut Checker) -> Option<Self> {
        let core = closure::Core {
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
            module: Module::default(),
            sizes: Vec::new(),
            effort: 0,
            materials: Vec::new(),
            instances: Vec::new(),
            names: BTreeMap::from([("material".to_owned(), 1)]),
        })
    }

    /// What lowered code uses of the library.
    pub(crate) fn core(&self) -> closure::Core {
        self.core
    }

    /// Lowers a material, with the given settings as its instances.
    pub(crate) fn add(
        &mut self,
        checker: &mut Checker,
        mut material: ir::Material,
        settings: &[Setting],
    ) {
        if self.prepare(checker, &mut material, settings).is_none() {
            return;
        }
        let lowered = match self.lower(&material, &mut checker.progress) {
            Ok(lowered) => lowered,
            Err(problem) => return checker.diagnostics.push(problem),
        };
        let read = texture_values(&material, settings, &checker.literal_textures);
        match self.instances(&material, &lowered, settings) {
            Ok(instances) => self.instances.extend(instances),
            Err(problem) => return checker.diagnostics.push(problem),
        }
        self.finish_material(&material, lowered, read, settings.len());
    }

    /// Makes of a material what is lowered: cut out by its opacity, with the values on which all
    /// settings agree as constants, without the closures that cannot show.
    fn prepare(
        &mut self,
        checker: &mut Checker,
        material: &mut ir::Material,
        settings: &[Setting],
    ) -> Option<()> {
        if material.opacity.is_some() {
            let transparent = checker.library_closure("bsdf", "transparent")?;
            self.core.transparent = Some(transparent);
            closure::cut_out(material, transparent);
        }
        self.take_over(&checker.ir);
        checker.progress.enter(Stage::Functions);
        let called: Vec<FunctionId> = material.body.calls().collect();
        self.optimise(called);
        checker.progress.enter(Stage::Lower);
        passes::bake(&mut material.body, &agreed(settings));
        passes::fold_body(&self.module, &mut material.body);
        match passes::widths(&self.module, &mut material.body) {
            Widths::None => {}
            Widths::Computed => passes::fold_body(&self.module, &mut material.body),
            Widths::TooLarge(call) => {
                checker.diagnostics.push(too_wide(material, call));
                return None;
            }
        }
        // First what weights decide, so that the methods of lobes without weight stay untouched.
        passes::prune_weights(&self.module, material);
        checker.progress.enter(Stage::Functions);
        self.optimise(self.methods(material, |m| match *m {
            Methods::Bsdf { albedo, .. } => vec![albedo],
            Methods::Edf { emit } => vec![emit],
        }));
        checker.progress.enter(Stage::Lower);
        passes::prune(&self.module, material);
        checker.progress.enter(Stage::Functions);
        self.optimise(self.core.functions().to_vec());
        self.optimise(self.methods(material, Methods::functions));
        checker.progress.enter(Stage::Lower);
        Some(())
    }

    /// Methods of the closures that a material's outputs are made of.
    fn methods(
        &self,
        material: &ir::Material,
        wanted: impl Fn(&Methods) -> Vec<FunctionId>,
    ) -> Vec<FunctionId> {
        let lobes = material.closures.iter().filter_map(|c| match c {
            ir::Closure::Lobe(lobe) => Some(lobe.def),
            _ => None,
        });
        let defs: BTreeSet<ClosureDefId> = lobes.collect();
        let methods = |id: ClosureDefId| wanted(&self.module.closures[id.index()].methods);
        defs.into_iter().flat_map(methods).collect()
    }

    /// A material's evaluate function as the passes get it, and the module that it calls into.
    pub(crate) fn before_passes(
        &mut self,
        checker: &mut Checker,
        mut material: ir::Material,
        settings: &[Setting],
    ) -> Option<(&Module, Function)> {
        self.prepare(checker, &mut material, settings)?;
        let lobes = closure::lobes(&material, material.surface?);
        let f = closure::evaluate(&self.module, &self.core, &material, &material.name, &lobes);
        Some((&self.module, f))
    }

    /// Takes over what was checked since the last material.
    fn take_over(&mut self, checked: &Module) {
        let extent = |m: &Module| {
            [
                m.structs.len(),
                m.closures.len(),
                m.textures.len(),
                m.functions.len(),
            ]
        };
        if extent(&self.module) == extent(checked) {
            return;
        }
        self.module.structs.clone_from(&checked.structs);
        self.module.closures.clone_from(&checked.closures);
        self.module.textures.clone_from(&checked.textures);
        let known = self.module.functions.len();
        let new = &checked.functions[known..];
        self.module.functions.extend_from_slice(new);
        self.sizes.resize(self.module.functions.len(), None);
    }

    /// Runs the passes over functions and all they call, unless that is done.
    fn optimise(&mut self, wanted: Vec<FunctionId>) {
        let mut pending = wanted;
        let mut found = BTreeSet::new();
        while let Some(id) = pending.pop() {
            if self.sizes[id.index()].is_none() && found.insert(id) {
                pending.extend(self.module.functions[id.index()].calls());
            }
        }
        // Callees stand before their callers.
        for id in found {
            let mut f = self.module.functions[id.index()].clone();
            self.effort += passes::run_callee(&self.module, &mut f);
            self.sizes[id.index()] = Some(self.size(&f));
            self.module.functions[id.index()] = f;
        }
    }

    /// Expressions of a function with its calls put in line.
    fn size(&self, f: &Function) -> u64 {
        f.evaluated().into_iter().fold(0u64, |n, id| {
            let inner = match f.expr(id).kind {
                ExprKind::Call(callee, _) => self.sizes[callee.index()].unwrap_or(0),
                _ => 1,
            };
            n.saturating_add(inner)
        })
    }

    /// The functions of a material whose agreed parameters are constants.
    fn lower(
        &mut self,
        material: &ir::Material,
        progress: &mut Progress<'_>,
    ) -> Result<Lowered, Diagnostic> {
        let module = &self.module;
        // Counted before they are listed: a tree that shares closures can have any number.
        let roots = material.surface.into_iter().chain(material.emission);
        let counts = roots.map(|root| closure::lobe_count(material, root));
        let most = counts.max().unwrap_or(0);
        if most > closure::MAX_LOBES {
            return Err(too_many_lobes(material, most));
        }
        let lobes = material
            .surface
            .map_or(Vec::new(), |root| closure::lobes(material, root));
        let mut evaluate = closure::evaluate(module, &self.core, material, &material.name, &lobes);
        progress.enter(Stage::Passes);
        self.effort += passes::run(module, &mut evaluate);
        let mut emission = closure::emission(module, &self.core, material, &material.name);
        if let Some(f) = &mut emission {
            self.effort += passes::run(module, f);
        }
        let size = self.size(&evaluate);
        if size > MAX_SIZE {
            return Err(too_large(material, size));
        }
        let crosses = closure::transmissive(module, material, &lobes);
        let mut hoisted = vec![passes::hoist(module, &mut evaluate)];
        if let Some(f) = &mut emission {
            let own = passes::hoist(module, f);
            shift_table(f, hoisted[0].values.len() as u32);
            hoisted.push(own);
        }
        Ok(Lowered {
            evaluate,
            emission,
            hoisted,
            crosses,
            delta_only: closure::delta_only(module, &lobes),
            lobes: lobes.len(),
        })
    }

    /// The instances of the next material.
    fn instances(
        &self,
        material: &ir::Material,
        lowered: &Lowered,
        settings: &[Setting],
    ) -> Result<Vec<Instance>, Diagnostic> {
        let mut instances = Vec::with_capacity(settings.len());
        for setting in settings {
            let mut table = Vec::new();
            for part in &lowered.hoisted {
                let values = part.evaluate(&self.module, &setting.values);
                table.extend(values.map_err(|_| too_long(material, &setting.name))?);
            }
            let medium = interior::medium(&self.module, material, &setting.values);
            let medium = medium.map_err(|_| too_long(material, &setting.name))?;
            let emission =
                closure::emission_kind(&self.module, lowered.emission.as_ref(), &table);
            instances.push(Instance {
                info: InstanceInfo {
                    name: setting.name.clone(),
                    material: self.materials.len(),
                    emission,
                    medium,
                },
                values: table,
                row: 0,
            });
        }
        // Where one instance must be evaluated as it is hit, the code for it is there for all.
        if instances
            .iter()
            .any(|i| i.info.emission == Emission::Varying)
        {
            let emitting = instances
                .iter_mut()
                .filter(|i| i.info.emission != Emission::None);
            emitting.for_each(|i| i.info.emission = Emission::Varying);
        }
        Ok(instances)
    }

    fn finish_material(
        &mut self,
        material: &ir::Material,
        lowered: Lowered,
        textures: Vec<usize>,
        instances: usize,
    ) {
        let own = &self.instances[self.instances.len() - instances..];
        let varying = own.iter().any(|i| i.info.emission == Emission::Varying);
        let name = codegen::unique_material_name(&mut self.names, &material.name);
        let types: Vec<Type> = lowered.hoisted.iter().flat_map(Hoisted::types).collect();
        let (mut evaluate, mut emission) = (lowered.evaluate, lowered.emission);
        evaluate.name.clone_from(&name);
        emission.iter_mut().for_each(|f| f.name.clone_from(&name));
        let read_by = emission.as_ref().filter(|_| varying);
        let functions: Vec<&Function> = std::iter::once(&evaluate).chain(read_by).collect();
        let info = MaterialInfo {
            name,
            delta_only: lowered.delta_only,
            crosses: lowered.crosses,
            transmissive: lowered.crosses && own.iter().any(|i| i.info.medium.is_some()),
            varying_emission: varying,
            inputs: codegen::inputs(&self.module.structs, &functions),
            textures,
            lobes: lowered.lobes,
        };
        self.materials.push(CompiledMaterial {
            info,
            evaluate,
            emission,
            layout: Layout::new(&types),
        });
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
        self.take_over(&checker.ir);
        let mut row = 0;
        for instance in &mut self.instances {
            instance.row = row;
            row += self.materials[instance.info.material].layout.rows;
        }
        let textures = lookups::slots(&self.module, &mut self.materials);
        Program {
            names: codegen::Names::new(
                &self.module,
                &checker.sources,
                &[self.core.surface_point, self.core.material_sample],
            ),
            module: self.module,
            core: self.core,
            materials: self.materials,
            instances: self.instances,
            textures,
            sources: checker.sources.clone(),
            effort: self.effort,
        }
    }
}

/// A material's functions with what was found out on the way.
struct Lowered {
    evaluate: Function,
    emission: Option<Function>,
    /// What the host computes for `evaluate`, then for `emission`.
    hoisted: Vec<Hoisted>,
    crosses: bool,
    delta_only: bool,
    lobes: usize,
}

/// Makes room for `first` values of the table before those of a function.
fn shift_table(f: &mut Function, first: u32) {
    for e in &mut f.exprs {
        if let ExprKind::TableValue(i) = &mut e.kind {
            *i += first;
        }
    }
}

/// The values of the parameters on which all settings agree for good.
fn agreed(settings: &[Setting]) -> Vec<Option<Const>> {
    let Some((first, others)) = settings.split_first() else {
        return Vec::new();
    };
    let same = |(i, value): (usize, &Const)| {
        let agree = others.iter().all(|s| s.values.get(i) == Some(value));
        (agree && !settings.iter().any(|s| s.open)).then(|| value.clone())
    };
    first.values.iter().enumerate().map(same).collect()
}

/// Textures that a material may read: its texture parameters, and those its file names.
fn texture_values(
    material: &ir::Material,
    settings: &[Setting],
    literal: &BTreeSet<usize>,
) -> Vec<usize> {
    let textures: BTreeSet<usize> = settings
        .iter()
        .flat_map(|s| material.params.iter().zip(&s.values))
        .filter(|(p, _)| p.surface_type == "texture")
        .filter_map(|(_, v)| match v {
            Const::Int(t) => usize::try_from(*t).ok(),
            _ => None,
        })
        .chain(literal.iter().copied())
        .collect();
    textures.into_iter().collect()
}

/// Most expressions of a material after its calls are put in line, as a GPU driver does.
const MAX_SIZE: u64 = 400_000;

/// A material with more lobes than it may have.
fn too_many_lobes(material: &ir::Material, count: usize) -> Diagnostic {
    let message = format!("`{}` has {count} lobes", material.name);
    Diagnostic::new(Code::TooManyLobes, material.span, message)
        .expected(format!("at most {}", closure::MAX_LOBES))
}

/// A material whose calls multiply beyond what a driver can compile.
fn too_large(material: &ir::Material, size: u64) -> Diagnostic {
    let message = format!(
        "`{}` grows to {size} operations once its calls are expanded",
        material.name
    );
    Diagnostic::new(Code::TooLarge, material.span, message)
        .expected(format!("at most {MAX_SIZE}"))
        .hint("call functions in a loop instead of writing the calls out, or share results with `let`")
}

/// A material whose widths depend on too much.
fn too_wide(material: &ir::Material, call: Span) -> Diagnostic {
    let message = format!(
        "what the widths of `{}` depend on grows too large",
        material.name
    );
    Diagnostic::new(Code::TooLarge, call, message)
        .expected("`filter_width` of what takes few operations")
        .hint("ask for the width of the coordinate, and pass it to the function as an argument")
}

/// A material whose parameters take too long to work with.
fn too_long(material: &ir::Material, instance: &str) -> Diagnostic {
    let message = format!("what depends only on the parameters of `{instance}` takes too long");
    Diagnostic::new(Code::TooLarge, material.span, message)
        .expected(format!("at most {} operations", passes::HOIST_FUEL))
        .hint("shorten loops whose length depends on a parameter")
}
