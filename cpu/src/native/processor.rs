//! What this machine's processor is, and whether code can be made for it and run.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::build::{Kernel, isa};
use super::run::{Buffer, Invocation};
use crate::error::KernelError;
use crate::lower;

/// Makes and runs a small kernel.
///
/// # Errors
/// If that is not possible: on other processors than those the compiler knows, or where the system does not
/// let code run that a process made.
pub fn check() -> Result<(), KernelError> {
    let text = "@group(0) @binding(0) var<storage, read_write> x: array<u32>;
        @compute @workgroup_size(1) fn main() { x[0] = 1u; }";
    let defect = |what: &dyn std::fmt::Display| KernelError::unsupported(&what.to_string(), "main");
    let module = naga::front::wgsl::parse_str(text).map_err(|e| defect(&e))?;
    let flags = naga::valid::ValidationFlags::all();
    let mut validator = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty());
    let info = validator.validate(&module).map_err(|e| defect(&e))?;
    let kernel = Kernel::build(&lower(&module, &info, &[], &[])?, &[])?;
    let (buffer, stop) = (Arc::new(Buffer::new(4)), AtomicBool::new(false));
    let mut invocation = Invocation::new(&kernel, std::slice::from_ref(&buffer), &[], &stop)?;
    // SAFETY: all of it is here, and nobody answers.
    #[allow(unsafe_code)]
    unsafe {
        invocation.run(&kernel, [0; 3], 0);
    }
    match buffer.read()[0] {
        1 => Ok(()),
        _ => Err(KernelError::Processor(
            "code does not do what it says".into(),
        )),
    }
}

/// The processor's name, as far as the system tells.
pub fn processor() -> String {
    let told = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let named = told.lines().find_map(|line| {
        let (key, value) = line.split_once(':')?;
        (key.trim() == "model name").then(|| value.trim().to_owned())
    });
    named.unwrap_or_else(|| format!("{} processor", std::env::consts::ARCH))
}

/// What makes the code.
pub fn compiler() -> String {
    format!("cranelift {}", cranelift_codegen::VERSION)
}

/// The processor's abilities that code uses.
pub fn features() -> Vec<String> {
    let Ok(isa) = isa() else {
        return Vec::new();
    };
    let flags = isa.isa_flags();
    let used = flags.iter().filter(|flag| flag.as_bool() == Some(true));
    used.map(|flag| flag.name.trim_start_matches("has_").to_owned())
        .collect()
}
