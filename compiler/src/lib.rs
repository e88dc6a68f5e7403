//! The Impasto compiler: source text in, validated WGSL and what the renderer must know out.
//!
//! Data runs one way:
//!
//! ```text
//! text -> lexer -> parser -> ast -> sema -> ir -> closure -> passes -> codegen -> naga -> WGSL
//! ```
//!
//! The crate does no I/O (a [`Loader`] reads files for it), knows nothing of wgpu and keeps no
//! global state. Every function returns a value and diagnostics; no input makes it panic.
//!
//! ```
//! use impasto_compiler::{MaterialRequest, MemoryLoader, compile};
//!
//! let mut files = MemoryLoader::default();
//! files.add("clay.impasto", "use std::bsdf::diffuse;\nmaterial clay { surface = diffuse(0.6); }");
//! let compilation = compile(&[MaterialRequest::new("clay", "clay.impasto")], &mut files);
//! let program = compilation.program.expect("no errors");
//! assert!(program.wgsl(&[0]).contains("fn evaluate_clay("));
//! ```

use std::collections::{BTreeMap, BTreeSet};

pub mod abi;
pub mod ast;
pub mod closure;
pub mod codegen;
pub mod diag;
pub mod ir;
pub mod lexer;
pub mod ops;
pub mod parser;
pub mod partition;
pub mod passes;
pub mod sema;
pub mod source;

use abi::{Emission, MaterialInfo, TextureRef, TextureSpace};
use diag::{Code, Diagnostic};
use ir::{Function, Module};
use ops::Op;
use sema::Checker;
use source::{SourceMap, Span};

/// Reads files for the compiler.
pub trait Loader {
    /// The bytes of the file at `path`, a name from a request or an import.
    ///
    /// # Errors
    /// Why the file cannot be read, in words for people.
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String>;
}

/// Files kept in memory, for tests and tools.
#[derive(Clone, Debug, Default)]
pub struct MemoryLoader {
    files: BTreeMap<String, Vec<u8>>,
}

impl MemoryLoader {
    /// Adds a file.
    pub fn add(&mut self, path: impl Into<String>, text: impl Into<Vec<u8>>) {
        self.files.insert(path.into(), text.into());
    }
}

impl Loader for MemoryLoader {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        self.files
            .get(path)
            .cloned()
            .ok_or_else(|| "no such file".into())
    }
}

/// A material to compile: which, under what name, with which parameters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MaterialRequest {
    /// What the scene calls it.
    pub name: String,
    /// The file that defines it.
    pub file: String,
    /// Which material of the file; its only one when absent.
    pub material: Option<String>,
    /// Parameters that differ from their defaults: name, and value as source text.
    pub params: Vec<(String, String)>,
}

impl MaterialRequest {
    /// The only material of `file` with its defaults.
    pub fn new(name: impl Into<String>, file: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            file: file.into(),
            material: None,
            params: Vec::new(),
        }
    }
}

/// What compiling gave.
pub struct Compilation {
    /// The texts that diagnostics point into.
    pub sources: SourceMap,
    /// Everything that was found, in order of discovery.
    pub diagnostics: Vec<Diagnostic>,
    /// The program, unless there were errors.
    pub program: Option<Program>,
}

/// What checking one file gave.
pub struct Checked {
    /// The texts that diagnostics point into.
    pub sources: SourceMap,
    /// Everything that was found.
    pub diagnostics: Vec<Diagnostic>,
    /// Names of the materials that the file defines.
    pub materials: Vec<String>,
    /// The IR of everything that the file defines and reaches.
    pub ir: Module,
    /// Its materials, before layering is lowered.
    pub checked: Vec<ir::Material>,
}

/// Compiled materials.
#[derive(Clone, Debug)]
pub struct Program {
    module: Module,
    names: codegen::Names,
    core: closure::Core,
    materials: Vec<CompiledMaterial>,
    /// Textures that some material may read, as indices of `module.textures`.
    textures: BTreeSet<usize>,
    /// Which lookups occur: with and without color conversion.
    spaces: BTreeSet<TextureSpace>,
    /// Line of each span that generated code mentions, by file.
    sources: SourceMap,
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
}

/// Compiles materials into one program.
///
/// Materials are numbered as in `requests`. There is a program only if there is no error;
/// warnings do not count.
pub fn compile(requests: &[MaterialRequest], loader: &mut dyn Loader) -> Compilation {
    let mut checker = Checker::new(loader);
    let program = compile_all(&mut checker, requests);
    let program = program.filter(|_| !diag::has_errors(&checker.diagnostics));
    drop_unsure(&mut checker.diagnostics);
    Compilation {
        program,
        sources: checker.sources,
        diagnostics: checker.diagnostics,
    }
}

/// Checks everything that a file defines, and compiles each of its materials with defaults.
pub fn check(path: &str, loader: &mut dyn Loader) -> Checked {
    let mut checker = Checker::new(loader);
    let mut materials = Vec::new();
    let mut checked = Vec::new();
    // First, so that the ABI's structs get their names before the file's own.
    let builder = ProgramBuilder::new(&mut checker);
    if let Some(module) = checker.load(path) {
        checker.check_items(module);
        let ast = checker.ast(module);
        for (index, item) in ast.items.iter().enumerate() {
            if let ast::ItemKind::Material(_) = item.kind {
                materials.push(item.name.node.clone());
                checked.extend(checker.material(module, index));
            }
        }
    }
    if !diag::has_errors(&checker.diagnostics) {
        generate_all(&mut checker, builder, &checked);
    }
    drop_unsure(&mut checker.diagnostics);
    let Checker {
        sources,
        diagnostics,
        ir,
        ..
    } = checker;
    Checked {
        sources,
        diagnostics,
        materials,
        ir,
        checked,
    }
}

/// Drops the warnings that an error may be the cause of: what did not check uses nothing.
fn drop_unsure(diagnostics: &mut Vec<Diagnostic>) {
    if diag::has_errors(diagnostics) {
        diagnostics.retain(|d| d.code != Code::Unused);
    }
}

/// Takes checked materials through the rest of the compiler, for the errors found only there.
fn generate_all(
    checker: &mut Checker,
    mut builder: Option<ProgramBuilder>,
    materials: &[ir::Material],
) {
    for m in materials {
        let values: Vec<ir::Const> = m.params.iter().map(|p| p.default.clone()).collect();
        if let Some(builder) = &mut builder {
            builder.add(checker, m.clone(), &m.name, &values);
        }
    }
    if let Some(program) = builder.map(|b| b.finish(checker)) {
        validate(checker, &program);
    }
}

fn compile_all(checker: &mut Checker, requests: &[MaterialRequest]) -> Option<Program> {
    let mut builder = ProgramBuilder::new(checker)?;
    let mut known: BTreeMap<(String, usize), Option<ir::Material>> = BTreeMap::new();
    for request in requests {
        let Some(module) = checker.load(&request.file) else {
            continue;
        };
        let Some(index) = checker.find_material(module, request.material.as_deref()) else {
            continue;
        };
        let material = known
            .entry((request.file.clone(), index))
            .or_insert_with(|| checker.material(module, index));
        let Some(material) = material.clone() else {
            continue;
        };
        let origin = format!("material `{}`", request.name);
        if let Some(values) = checker.parameter_values(module, &material, &request.params, &origin)
        {
            builder.add(checker, material, &request.name, &values);
        }
    }
    if diag::has_errors(&checker.diagnostics) {
        return None;
    }
    let program = builder.finish(checker);
    validate(checker, &program);
    Some(program)
}

/// Has naga check the code of all materials together.
fn validate(checker: &mut Checker, program: &Program) {
    let all: Vec<usize> = (0..program.materials.len()).collect();
    if let Err(problem) = codegen::validate(&program.wgsl(&all)) {
        checker
            .diagnostics
            .push(Diagnostic::without_span(Code::InvalidWgsl, problem));
    }
}

/// Collects lowered materials.
struct ProgramBuilder {
    core: closure::Core,
    materials: Vec<CompiledMaterial>,
    names: BTreeMap<String, u32>,
    textures: BTreeSet<usize>,
}

impl ProgramBuilder {
    fn new(checker: &mut Checker) -> Option<Self> {
        let core = closure::Core {
            valid_normal: checker.core_function("valid_normal")?,
            frame: checker.core_function("frame")?,
            to_local: checker.core_function("to_local")?,
            to_world: checker.core_function("to_world")?,
            transport_valid: checker.core_function("transport_valid")?,
            surface_point: checker.core_struct("SurfacePoint")?,
            material_sample: checker.core_struct("MaterialSample")?,
        };
        Some(Self {
            core,
            materials: Vec::new(),
            names: BTreeMap::from([("material".to_owned(), 1)]),
            textures: BTreeSet::new(),
        })
    }

    /// Lowers a material with the given parameter values.
    fn add(
        &mut self,
        checker: &mut Checker,
        mut material: ir::Material,
        name: &str,
        values: &[ir::Const],
    ) {
        let module = &checker.ir;
        passes::bake(&mut material.body, values);
        passes::fold_body(module, &mut material.body);
        let lobes = material
            .surface
            .map_or(Vec::new(), |root| closure::lobes(&material, root));
        if lobes.len() > closure::MAX_LOBES {
            let message = format!("`{}` has {} lobes", material.name, lobes.len());
            let many = Diagnostic::new(Code::TooManyLobes, material.span, message)
                .expected(format!("at most {}", closure::MAX_LOBES));
            checker.diagnostics.push(many);
            return;
        }
        let name = codegen::unique_material_name(&mut self.names, name);
        let mut evaluate = closure::evaluate(module, &self.core, &material, &name, &lobes);
        passes::run(module, &mut evaluate);
        let mut emission = closure::emission(module, &self.core, &material, &name);
        if let Some(f) = &mut emission {
            passes::run(module, f);
        }
        let kind = closure::emission_kind(module, emission.as_ref());
        let transmissive = closure::transmissive(module, &material, &lobes);
        let (delta_only, lobe_count) = (closure::delta_only(module, &lobes), lobes.len());
        if let Some(problem) = too_large(module, &evaluate, &material) {
            checker.diagnostics.push(problem);
            return;
        }
        let read = texture_values(&material, values, &checker.literal_textures);
        self.textures.extend(read.iter().copied());
        let varying = emission.as_ref().filter(|_| kind == Emission::Varying);
        let functions: Vec<&Function> = std::iter::once(&evaluate).chain(varying).collect();
        let inputs = codegen::inputs(&module.structs, &functions);
        let info = MaterialInfo {
            name,
            delta_only,
            transmissive,
            emission: kind,
            inputs,
            textures: read,
            lobes: lobe_count,
        };
        self.materials.push(CompiledMaterial {
            info,
            evaluate,
            emission,
        });
    }

    fn finish(mut self, checker: &mut Checker) -> Program {
        let mut module = checker.ir.clone();
        for i in 0..module.functions.len() {
            let mut f = module.functions[i].clone();
            passes::run(&module, &mut f);
            module.functions[i] = f;
        }
        let spaces = texture_spaces(&module, &self.materials);
        if spaces.is_empty() {
            self.textures.clear();
        }
        let mut program = Program {
            names: codegen::Names::new(
                &module,
                &checker.sources,
                &[self.core.surface_point, self.core.material_sample],
            ),
            module,
            core: self.core,
            materials: self.materials,
            textures: self.textures,
            spaces,
            sources: checker.sources.clone(),
        };
        program.resolve_texture_slots();
        program
    }
}

/// Textures that a material may read: its texture parameters, and those its file names.
fn texture_values(
    material: &ir::Material,
    values: &[ir::Const],
    literal: &BTreeSet<usize>,
) -> Vec<usize> {
    let params = material
        .params
        .iter()
        .zip(values)
        .filter(|(p, _)| p.surface_type == "texture");
    let given = params.filter_map(|(_, v)| match v {
        ir::Const::Int(t) => usize::try_from(*t).ok(),
        _ => None,
    });
    given
        .chain(literal.iter().copied())
        .collect::<BTreeSet<_>>()
        .into_iter()
        .collect()
}

/// The lookups that occur in materials and what they call.
fn texture_spaces(module: &Module, materials: &[CompiledMaterial]) -> BTreeSet<TextureSpace> {
    let own = materials
        .iter()
        .flat_map(|m| std::iter::once(&m.evaluate).chain(&m.emission));
    let all = own
        .chain(&module.functions)
        .flat_map(|f| codegen::evaluated(f).into_iter().map(move |id| f.expr(id)));
    all.filter_map(|e| match e.kind {
        ir::ExprKind::Op(Op::Image, _) => Some(TextureSpace::Color),
        ir::ExprKind::Op(Op::ImageData, _) => Some(TextureSpace::Data),
        _ => None,
    })
    .collect()
}

/// Most expressions of a material after its calls are put in line, as a GPU driver does.
const MAX_SIZE: u64 = 400_000;

/// Reports a material whose calls multiply beyond what a driver can compile.
fn too_large(module: &Module, f: &Function, material: &ir::Material) -> Option<Diagnostic> {
    let mut sizes: Vec<u64> = Vec::new();
    let size = |f: &Function, sizes: &[u64]| {
        codegen::evaluated(f).into_iter().fold(0u64, |n, id| {
            let inner = match f.expr(id).kind {
                ir::ExprKind::Call(callee, _) => sizes.get(callee.index()).copied().unwrap_or(0),
                _ => 1,
            };
            n.saturating_add(inner)
        })
    };
    for f in &module.functions {
        let n = size(f, &sizes);
        sizes.push(n);
    }
    let total = size(f, &sizes);
    (total > MAX_SIZE).then(|| {
        let message = format!("`{}` grows to {total} operations once its calls are expanded", material.name);
        Diagnostic::new(Code::TooLarge, material.span, message)
            .expected(format!("at most {MAX_SIZE}"))
            .hint("call functions in a loop instead of writing the calls out, or share results with `let`")
    })
}

impl Program {
    /// What the renderer must know of each material, in the order of the requests.
    pub fn materials(&self) -> impl ExactSizeIterator<Item = &MaterialInfo> {
        self.materials.iter().map(|m| &m.info)
    }

    /// As [`Program::materials`], copied.
    pub fn infos(&self) -> Vec<MaterialInfo> {
        self.materials().cloned().collect()
    }

    /// The materials with their functions, for interpreters and analyses.
    pub fn compiled(&self) -> &[CompiledMaterial] {
        &self.materials
    }

    /// The IR of the functions that materials call.
    pub fn ir(&self) -> &Module {
        &self.module
    }

    /// The textures to provide; a texture's position is its slot.
    pub fn textures(&self) -> Vec<TextureRef> {
        let both = |&t: &usize| self.spaces.iter().map(move |&space| (t, space));
        let slots = self.textures.iter().flat_map(both);
        slots
            .map(|(t, space)| TextureRef {
                path: self.module.textures[t].clone(),
                space,
            })
            .collect()
    }

    /// The WGSL of some materials: structs, the functions they reach, one function a material,
    /// `evaluate_material`, and `material_emission` if some emission varies.
    pub fn wgsl(&self, members: &[usize]) -> String {
        codegen::module(self, members)
    }

    /// The first slot of texture `t`.
    fn first_slot(&self, t: usize) -> u32 {
        let rank = self.textures.iter().take_while(|&&x| x < t).count();
        (rank * self.spaces.len().max(1)) as u32
    }

    /// What a kind of lookup adds to the first slot.
    fn slot_offset(&self, op: Op) -> u32 {
        u32::from(op == Op::ImageData && self.spaces.len() > 1)
    }

    fn resolve_texture_slots(&mut self) {
        for i in 0..self.materials.len() {
            let read = std::mem::take(&mut self.materials[i].info.textures);
            let per_texture = self.spaces.len();
            let slots = read
                .iter()
                .filter(|t| self.textures.contains(t))
                .flat_map(|&t| {
                    let first = self.first_slot(t) as usize;
                    first..first + per_texture
                });
            self.materials[i].info.textures = slots.collect();
        }
    }

    /// `car_paint.impasto:12`: where a span is, without folders, which differ between machines.
    fn origin(&self, span: Span) -> String {
        let text = self.sources.file_line(span);
        match text.rsplit_once('/') {
            Some((_, name)) if !text.starts_with("std/") => name.to_owned(),
            _ => text,
        }
    }
}
