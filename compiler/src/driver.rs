//! Compiling from end to end: requests in, a program with diagnostics out.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::build::alike::{self, Requested};
use crate::build::{ProgramBuilder, Setting, constants};
use crate::diag::{self, Code, Diagnostic};
use crate::ir::{self, Module};
use crate::loader::Loader;
use crate::moment::Moment;
use crate::parameter_value::ParameterValue;
use crate::passes::MaterialState;
use crate::program::Program;
use crate::sema::{self, Checker, ModuleId};
use crate::source::SourceMap;
use crate::stages::{Progress, Stage};
use crate::written::Written;
use crate::{ast, codegen};

/// A material to compile: which, under what name, with which parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialRequest {
    /// What the scene calls it.
    pub name: String,
    /// The file that defines it.
    pub file: String,
    /// Which material of the file; its only one when absent.
    pub material: Option<String>,
    /// Parameters that differ from their defaults.
    pub params: Vec<(String, ParameterValue)>,
    /// Where the values of parameters go.
    pub parameters: Parameters,
    /// Does it have code of its own even among many materials, of which some are equal up to constants?
    pub apart: bool,
    /// When it is seen: then `time` and `frame` are in the table, unless all is in the code. Where nobody says, it is
    /// frame 0 for good.
    pub moment: Option<Moment>,
    /// Where a scene asks for it, if one does.
    pub written: Option<Arc<Written>>,
}

/// Where the values of an instance's parameters go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Parameters {
    /// Those on which all instances of the material agree into the code, the others into a table.
    #[default]
    Agreed,
    /// All into code of its own, which only instances with the same values share.
    Baked,
    /// All into the table: the code holds for any values.
    Table,
    /// All into the table, and the floats that its file and others beside it write as well, other than 0 and 1: editing
    /// one takes no other code.
    Open,
}

impl MaterialRequest {
    /// The only material of `file` with its defaults.
    pub fn new(name: impl Into<String>, file: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            file: file.into(),
            material: None,
            params: Vec::new(),
            parameters: Parameters::default(),
            apart: false,
            moment: None,
            written: None,
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
    /// Its tests.
    pub tests: Vec<sema::Test>,
}

/// Compiles materials into one program.
///
/// Requests are the program's instances, in their order. Those that ask for one material share
/// its code; parameters on which they agree become constants of it, the others are read from a
/// table. There is a program only if there is no error; warnings do not count.
pub fn compile(requests: &[MaterialRequest], loader: &mut dyn Loader) -> Compilation {
    compile_with_progress(requests, loader, Progress::silent())
}

/// [`compile`] with functions that say how materials look, for outputs of a film.
pub fn compile_with_looks(requests: &[MaterialRequest], loader: &mut dyn Loader) -> Compilation {
    compile_as(requests, loader, Progress::silent(), true)
}

/// Either of the two, which ends without a program, and without a diagnostic, soon after `stop` tells so.
pub fn compile_until(
    requests: &[MaterialRequest],
    loader: &mut dyn Loader,
    looks: bool,
    stop: &dyn Fn() -> bool,
) -> Compilation {
    compile_as(requests, loader, Progress::until(stop), looks)
}

/// [`compile`], which says the stage it is at.
pub fn compile_with_progress<'a>(
    requests: &[MaterialRequest],
    loader: &'a mut dyn Loader,
    progress: Progress<'a>,
) -> Compilation {
    compile_as(requests, loader, progress, false)
}

fn compile_as<'a>(
    requests: &[MaterialRequest],
    loader: &'a mut dyn Loader,
    progress: Progress<'a>,
    looks: bool,
) -> Compilation {
    let mut checker = Checker::with_progress(loader, progress);
    let program = compile_all(&mut checker, requests, looks);
    let program = program.filter(|_| !diag::has_errors(&checker.diagnostics));
    diag::drop_unsure(&mut checker.diagnostics);
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
    let (mut checked, mut tests) = (Vec::new(), Vec::new());
    // First, so that the ABI's structs get their names before the file's own.
    let builder = ProgramBuilder::new(&mut checker);
    if let Some(module) = checker.load(path) {
        (checked, tests) = checker.check_all(module);
        let ast = checker.ast(module);
        let all = ast.items.iter();
        let of_file = all.filter(|item| matches!(item.kind, ast::ItemKind::Material(_)));
        materials.extend(of_file.map(|item| item.name.node.clone()));
    }
    if !diag::has_errors(&checker.diagnostics) {
        generate_all(&mut checker, builder, &checked);
    }
    diag::drop_unsure(&mut checker.diagnostics);
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
        tests,
    }
}

/// Shows `look` each material when the pass `name` of [`crate::passes::PIPELINE`] has gone over it for
/// the first time, with the module that it calls into. What is wrong with the requests, [`compile`]
/// says.
pub fn after_pass(
    requests: &[MaterialRequest],
    loader: &mut dyn Loader,
    name: &str,
    mut look: impl FnMut(&Module, &MaterialState),
) {
    let mut checker = Checker::new(loader);
    let Some(mut builder) = ProgramBuilder::new(&mut checker) else {
        return;
    };
    for requested in requested(&mut checker, requests) {
        let settings: Vec<Setting> = requested.settings.into_iter().map(|(_, s)| s).collect();
        let state = builder.after_pass(&mut checker, requested.material, &settings, name);
        if let Some((module, state)) = state {
            look(module, &state);
        }
    }
}

/// Takes checked materials through the rest of the compiler, for the errors found only there.
fn generate_all(
    checker: &mut Checker,
    builder: Option<ProgramBuilder>,
    materials: &[ir::Material],
) {
    let Some(mut builder) = builder else { return };
    for m in materials {
        let defaults = m.params.iter().map(|p| p.default.clone()).collect();
        let setting = Setting {
            name: m.name.clone(),
            values: defaults,
            open: false,
            moving: Vec::new(),
        };
        builder.add(checker, m.clone(), &[setting]);
    }
    validate(checker, &builder.finish(checker));
}

fn compile_all(
    checker: &mut Checker,
    requests: &[MaterialRequest],
    looks: bool,
) -> Option<Program> {
    let mut builder = ProgramBuilder::new(checker)?.with_looks(looks);
    let requested = requested(checker, requests);
    if diag::has_errors(&checker.diagnostics) || checker.progress.is_stopped() {
        return None;
    }
    let requested = match alike::merged(requested) {
        Ok(requested) => requested,
        Err(too_many) => {
            checker.diagnostics.push(too_many);
            return None;
        }
    };
    let mut order = Vec::new();
    for Requested {
        material, settings, ..
    } in requested
    {
        if checker.progress.is_stopped() {
            return None;
        }
        let (places, settings): (Vec<usize>, Vec<Setting>) = settings.into_iter().unzip();
        builder.add(checker, material, &settings);
        order.extend(places);
    }
    if diag::has_errors(&checker.diagnostics) {
        return None;
    }
    builder.order_instances(&order);
    let program = builder.finish(checker);
    validate(checker, &program);
    Some(program)
}

/// The materials that requests ask for, in the order of their first requests.
fn requested(checker: &mut Checker, requests: &[MaterialRequest]) -> Vec<Requested> {
    let mut found: Vec<Requested> = Vec::new();
    let mut known: BTreeMap<(&str, usize), Option<ir::Material>> = BTreeMap::new();
    let mut places: BTreeMap<((&str, usize), bool, String), usize> = BTreeMap::new();
    for (place, request) in requests.iter().enumerate() {
        if checker.progress.is_stopped() {
            break;
        }
        let Some((module, index)) = asked_material(checker, request) else {
            continue;
        };
        let key = (request.file.as_str(), index);
        let material = known
            .entry(key)
            .or_insert_with(|| checker.material(module, index));
        let Some(material) = material else { continue };
        let origin = format!("material `{}`", request.name);
        let values = checker.parameter_values(
            module,
            material,
            &request.params,
            &origin,
            request.written.as_deref(),
        );
        let moment = request.moment.unwrap_or_default();
        let values = values.and_then(|v| checker.values_at(material, v, moment));
        let Some(mut values) = values else { continue };
        let parameters = request.parameters;
        // Requests for constants share code with those for the same constants.
        let baked = parameters == Parameters::Baked;
        let constants = if baked {
            format!("{values:?}")
        } else {
            String::new()
        };
        let key = (key, parameters == Parameters::Open, constants);
        let at = *places.entry(key).or_insert_with(|| {
            let mut material = material.clone();
            if parameters == Parameters::Open {
                constants::open(&mut checker.ir, &mut material);
            }
            found.push(Requested {
                material,
                apart: request.apart,
                settings: Vec::new(),
            });
            found.len() - 1
        });
        let written = &found[at].material.params[values.len()..];
        values.extend(written.iter().map(|constant| constant.default.clone()));
        let setting = Setting {
            name: request.name.clone(),
            values,
            open: matches!(parameters, Parameters::Table | Parameters::Open),
            moving: if baked || request.moment.is_none() {
                Vec::new()
            } else {
                let inputs = material
                    .params
                    .iter()
                    .enumerate()
                    .filter(|(_, p)| p.is_input);
                inputs.map(|(index, _)| index).collect()
            },
        };
        found[at].settings.push((place, setting));
    }
    found
}

/// The file and material that a request names; what is wrong with the names has the scene's place.
fn asked_material(checker: &mut Checker, request: &MaterialRequest) -> Option<(ModuleId, usize)> {
    let before = checker.diagnostics.len();
    let module = checker.load(&request.file);
    let found = module.and_then(|module| {
        let index = checker.find_material(module, request.material.as_deref())?;
        Some((module, index))
    });
    if let Some(written) = &request.written {
        let part = match (module, &written.material) {
            (Some(_), Some(name)) => Some(name),
            _ => written.file.as_ref(),
        };
        let new = &mut checker.diagnostics[before..];
        if let Some(part) = part {
            written.place(part, &mut checker.sources, new);
        }
    }
    found
}

/// Materials whose code is checked as one module. The memory that naga takes grows with it.
const CHECKED_TOGETHER: usize = 50;

/// Has naga check the code of all materials.
fn validate(checker: &mut Checker, program: &Program) {
    let all: Vec<usize> = (0..program.materials.len()).collect();
    for members in all.chunks(CHECKED_TOGETHER) {
        if checker.progress.is_stopped() {
            return;
        }
        checker.progress.enter(Stage::Generate);
        let text = codegen::complete(program, members, codegen::Target::Native);
        if let Err(problem) = codegen::validate_with_progress(&text, &mut checker.progress) {
            let deep = codegen::nested_too_deep(program, members);
            let rejected = || Diagnostic::without_span(Code::InvalidWgsl, problem);
            return checker.diagnostics.push(deep.unwrap_or_else(rejected));
        }
    }
}
