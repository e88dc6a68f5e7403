//! Checks text that was generated.

use crate::closure::Looks;
use crate::diag::{Code, Diagnostic};
use crate::ir::{Function, walk};
use crate::program::{CompiledMaterial, Program};
use crate::stages::{Progress, Stage};

/// Checks a module's text with naga, as every kernel that includes it will be checked.
///
/// # Errors
/// What naga says, with the place in the text.
pub fn validate(wgsl: &str) -> Result<(), String> {
    validate_with_progress(wgsl, &mut Progress::silent())
}

/// [`validate`], which says the stage it is at.
pub(crate) fn validate_with_progress(
    wgsl: &str,
    progress: &mut Progress<'_>,
) -> Result<(), String> {
    progress.enter(Stage::ReadBack);
    let module = naga::front::wgsl::parse_str(wgsl).map_err(|e| e.emit_to_string(wgsl))?;
    progress.enter(Stage::Validate);
    let flags = naga::valid::ValidationFlags::all();
    let mut validator = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty());
    validator
        .validate(&module)
        .map(|_| ())
        .map_err(|e| e.emit_to_string(wgsl))
}

/// The first function of some materials whose blocks lie deeper within each other than WGSL
/// allows, as the error to report.
pub(crate) fn nested_too_deep<'p>(program: &'p Program, members: &[usize]) -> Option<Diagnostic> {
    let own = members.iter().map(|&m| &program.materials[m]);
    let looks = |m: &'p CompiledMaterial| m.looks.iter().flat_map(Looks::functions);
    let own = own.flat_map(|m| {
        std::iter::once(&m.evaluate)
            .chain(&m.emission)
            .chain(looks(m))
    });
    let deep = |f: &&Function| walk::nesting(&f.body) > walk::MAX_NESTING;
    let f = program.module.functions.iter().chain(own).find(deep)?;
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
