//! Other values for the parameters of a program whose code stays: what a hand that drags a slider asks for many times
//! a second. Only what the host computes of parameters is computed again; no file is read, nothing is checked but
//! the values, and no text is written.

use crate::abi::Emission;
use crate::build::{errors, instances};
use crate::diag::{Code, Diagnostic};
use crate::driver::MaterialRequest;
use crate::ir::Const;
use crate::loader::MemoryLoader;
use crate::parameter_value::ParameterValue;
use crate::program::{Instance, Program};
use crate::sema::{Checker, ModuleId};
use crate::source::SourceMap;

/// Why the code of a program does not hold for some values.
pub enum Unfit {
    /// The values are wrong: what is to be said of them, and the texts that it points into.
    Wrong(SourceMap, Vec<Diagnostic>),
    /// It takes other code, for a reason to be told after "since".
    Code(String),
}

/// The name of the file that values are evaluated in. It is empty, so that they know the library and nothing of the
/// material's file.
const SCOPE: &str = "values.impasto";

/// The same code for the same materials, whose instances have the values that `requests` give them: one request for
/// each instance, in their order, as those that the program was compiled from.
///
/// Values that a material's code has as constants, textures, and emission that no kernel expects take other
/// code, as do expressions over names of the material's own file. Warnings about values are the compiler's to
/// give.
///
/// # Errors
/// [`Unfit`].
pub fn with_values(program: &Program, requests: &[MaterialRequest]) -> Result<Program, Unfit> {
    if requests.len() != program.instances.len() {
        return Err(code("there are more or fewer materials than before"));
    }
    let mut files = MemoryLoader::default();
    files.add(SCOPE, "");
    let mut checker = Checker::new(&mut files);
    // Diagnostics point to where parameters are declared.
    checker.sources = program.sources.clone();
    let Some(scope) = checker.load(SCOPE) else {
        return Err(code("values cannot be evaluated"));
    };
    let mut next = program.clone();
    for (index, request) in requests.iter().enumerate() {
        let old = &program.instances[index];
        let parameters = parameters(&mut checker, scope, program, old, request)?;
        if parameters != old.parameters {
            next.instances[index] = instance(&mut checker, program, old, request, &parameters)?;
        }
    }
    settle(program, next)
}

fn code(why: impl Into<String>) -> Unfit {
    Unfit::Code(why.into())
}

/// All that was found wrong.
fn wrong(checker: &mut Checker) -> Unfit {
    let found = std::mem::take(&mut checker.diagnostics);
    Unfit::Wrong(checker.sources.clone(), found)
}

/// The values of an instance's parameters.
fn parameters(
    checker: &mut Checker,
    scope: ModuleId,
    program: &Program,
    old: &Instance,
    request: &MaterialRequest,
) -> Result<Vec<Const>, Unfit> {
    let recipe = &program.recipes[old.info.material];
    let material = &recipe.material;
    let origin = format!("material `{}`", request.name);
    let written = request.written.as_deref();
    let given = checker.parameter_values(scope, material, &request.params, &origin, written);
    let given = given
        .and_then(|values| checker.values_at(material, values, request.moment.unwrap_or_default()));
    let Some(mut values) = given else {
        // What is wrong with an expression may be that it names what only the material's file knows.
        let is_range = |d: &Diagnostic| d.code == Code::OutOfRange;
        let is_text = |(_, value): &(String, ParameterValue)| {
            matches!(value.origin().1, ParameterValue::Text(_))
        };
        if request.params.iter().any(is_text) && !checker.diagnostics.iter().all(is_range) {
            return Err(code("an expression needs its material's file"));
        }
        return Err(wrong(checker));
    };
    for (index, param) in material.params.iter().enumerate() {
        let before = &old.parameters[index];
        if param.name.contains(' ') {
            // A constant in which materials that share code differ.
            values[index] = before.clone();
        }
        if param.surface_type == "texture" {
            let is_given = request.params.iter().any(|(name, _)| *name == param.name);
            let textures = is_given.then_some(&checker.ir.textures);
            let now = texture(textures.unwrap_or(&program.module.textures), &values[index]);
            if now != texture(&program.module.textures, before) {
                return Err(code(format!("`{}` is another texture", param.name)));
            }
            values[index] = before.clone();
        }
        let fixed = recipe.constants.get(index).and_then(Option::as_ref);
        if fixed.is_some_and(|fixed| *fixed != values[index]) {
            return Err(code(format!("`{}` is a constant of the code", param.name)));
        }
    }
    Ok(values)
}

/// The file of a texture.
fn texture<'t>(textures: &'t [String], index: &Const) -> Option<&'t str> {
    let Const::Int(index) = index else {
        return None;
    };
    let index = usize::try_from(*index).ok()?;
    textures.get(index).map(String::as_str)
}

fn instance(
    checker: &mut Checker,
    program: &Program,
    old: &Instance,
    request: &MaterialRequest,
    parameters: &[Const],
) -> Result<Instance, Unfit> {
    let number = old.info.material;
    let (recipe, compiled) = (&program.recipes[number], &program.materials[number]);
    let parts = (
        &recipe.material,
        &recipe.hoisted[..],
        compiled.emission.as_ref(),
    );
    let name = old.info.name.clone();
    let made = instances::instance(&program.module, parts, name, parameters, number);
    let made = made.map_err(|_| {
        let too_long = errors::too_long(&recipe.material, &request.name);
        checker.diagnostics.push(too_long);
        // Its place is in the material's file.
        Unfit::Wrong(
            program.sources.clone(),
            std::mem::take(&mut checker.diagnostics),
        )
    })?;
    Ok(Instance {
        row: old.row,
        ..made
    })
}

/// What all instances of a material share, as far as it follows from their values.
fn settle(program: &Program, mut next: Program) -> Result<Program, Unfit> {
    for (number, material) in next.materials.iter_mut().enumerate() {
        let of = |i: &&mut Instance| i.info.material == number;
        instances::share_emission(next.instances.iter_mut().filter(of));
        let own = || next.instances.iter().filter(|i| i.info.material == number);
        let varies = own().any(|i| i.info.emission == Emission::Varying);
        if varies != program.materials[number].info.varying_emission {
            let name = &material.info.name;
            return Err(code(format!("the emission of `{name}` is of another kind")));
        }
        let info = &mut material.info;
        info.transmissive = info.crosses && own().any(|i| i.info.medium.is_some());
    }
    Ok(next)
}
