//! Validation of kernels, so that a defect of code generation is reported with the line it concerns.

use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{Module, front};

use crate::error::RuntimeError;

/// Parses and validates `wgsl`, the text of the kernel called `kernel`.
pub(crate) fn validate(kernel: &str, wgsl: &str) -> Result<(Module, ModuleInfo), RuntimeError> {
    let failure = |message| RuntimeError::Shader {
        kernel: kernel.to_string(),
        message,
    };
    let module = front::wgsl::parse_str(wgsl)
        .map_err(|e| failure(e.emit_to_string_with_path(wgsl, kernel)))?;
    let flags = ValidationFlags::all();
    // `unpack2x16float` is plain WGSL; naga asks for a capability for the sake of one driver.
    let capabilities = Capabilities::SHADER_FLOAT16_IN_FLOAT32
        | Capabilities::SUBGROUP
        | Capabilities::SUBGROUP_BARRIER;
    let info = Validator::new(flags, capabilities)
        .validate(&module)
        .map_err(|e| failure(e.emit_to_string_with_path(wgsl, kernel)))?;
    Ok((module, info))
}
