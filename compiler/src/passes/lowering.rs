//! Makes functions of a material's closures.

use crate::closure::{self, Core};
use crate::diag::{Code, Diagnostic};
use crate::ir::{Function, MAX_LOBES, Material, Module};

/// What a material scatters as a function, and what it emits if it does.
pub fn lowering(
    module: &Module,
    core: &Core,
    material: &Material,
) -> Result<Vec<Function>, Diagnostic> {
    // Counted before they are listed: a tree that shares closures can have any number.
    let roots = material.surface.into_iter().chain(material.emission);
    let counts = roots.map(|root| closure::lobe_count(material, root));
    let most = counts.max().unwrap_or(0);
    if most > MAX_LOBES {
        return Err(too_many_lobes(material, most));
    }
    let lobes = closure::surface_lobes(material);
    let name = &material.name;
    let evaluate = closure::evaluate(module, core, material, name, &lobes);
    let emission = closure::emission(module, core, material, name);
    Ok(std::iter::once(evaluate).chain(emission).collect())
}

/// A material with more lobes than it may have.
fn too_many_lobes(material: &Material, count: usize) -> Diagnostic {
    let message = format!("`{}` has {count} lobes", material.name);
    Diagnostic::new(Code::TooManyLobes, material.span, message)
        .expected(format!("at most {MAX_LOBES}"))
}
