//! Compiles the functions of a kernel, several at a time, and brings them to memory that may run.

use std::sync::Arc;
use std::time::{Duration, Instant};

use cranelift_codegen::control::ControlPlane;
use cranelift_codegen::ir::Function as Text;
use cranelift_codegen::isa::{OwnedTargetIsa, TargetIsa};
use cranelift_codegen::settings::{self, Configurable};
use cranelift_codegen::{CodegenError, Context};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use cranelift_jit::{JITBuilder, JITModule};
use cranelift_module::{FuncId, Linkage, Module, ModuleError, ModuleReloc};
use rayon::prelude::*;

use super::constants::Constants;
use super::emit::{self, Emitter, Shared};
use super::host::Answer;
use super::layout::{self, Layout};
use super::run::MOST_INPUTS;
use crate::code::{Code, Function, Input, Scalar};
use crate::error::KernelError;
use crate::plan::Plan;

/// A kernel as machine code.
#[derive(Debug)]
pub(crate) struct Kernel {
    pub(super) main: *const u8,
    pub(super) layout: Layout,
    /// Module-scope variables at the beginning of an invocation.
    pub(super) private: Vec<u32>,
    /// What the entry point is given.
    pub(super) inputs: Vec<Input>,
    pub(crate) workgroup: u32,
    /// By buffer: its name, and the bytes it must have at least.
    pub(super) buffers: Vec<(String, u64)>,
    /// What building took.
    pub(crate) statistics: Statistics,
    /// Tables that the code refers to.
    _constants: Arc<Constants>,
    /// The memory that the code is in.
    memory: Option<Memory>,
}

/// What it took to build a kernel.
#[derive(Clone, Copy, Debug, Default)]
pub struct Statistics {
    /// Functions that were compiled on their own.
    pub functions: usize,
    /// Bytes of machine code.
    pub bytes: usize,
    /// How long it took.
    pub time: Duration,
}

/// Code in memory, which is given back when nothing can run it any more.
struct Memory(JITModule);

impl std::fmt::Debug for Memory {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("code")
    }
}

// SAFETY: what a kernel points to is code and tables that never change once it is built.
#[allow(unsafe_code)]
unsafe impl Send for Kernel {}
// SAFETY: as above.
#[allow(unsafe_code)]
unsafe impl Sync for Kernel {}

impl Drop for Kernel {
    #[allow(unsafe_code)]
    fn drop(&mut self) {
        if let Some(module) = self.memory.take() {
            // SAFETY: the code runs only within `Kernel::run`, which borrows the kernel.
            unsafe { module.0.free_memory() };
        }
    }
}

/// A function's machine code.
struct Compiled {
    id: FuncId,
    bytes: Vec<u8>,
    alignment: u64,
    relocations: Vec<ModuleReloc>,
}

impl Kernel {
    /// Compiles `code`. By hook, `answers` are called in place of functions that the host answers.
    ///
    /// # Errors
    /// If the code has what is not known here, the processor is none that code can be made for, or there is no
    /// memory for code.
    pub(crate) fn build(code: &Code, answers: &[Option<Answer>]) -> Result<Self, KernelError> {
        let begin = Instant::now();
        if code.inputs.len() > MOST_INPUTS {
            return Err(KernelError::unsupported(
                "entry point of so many arguments",
                "main",
            ));
        }
        let isa = isa()?;
        let constants = Arc::new(Constants::default());
        let plan = Plan::new(code);
        let layout = Layout::of(code, answers.len());
        let shared = Shared {
            code,
            plan: &plan,
            layout,
            constants: &constants,
            answers,
            host: isa.default_call_conv(),
        };
        let names = cranelift_module::default_libcall_names();
        let mut module = JITModule::new(JITBuilder::with_isa(isa.clone(), names));
        let own = own_functions(code, &plan);
        // The numbers that calls name functions by are their indices, with the entry point behind them.
        for index in 0..=code.functions.len() {
            // Profilers show these names.
            let function = code.functions.get(index).and_then(Option::as_ref);
            let name = format!("{} {index}", function.unwrap_or(&code.main).name);
            let signature = cranelift_codegen::ir::Signature::new(isa.default_call_conv());
            let id = module.declare_function(&name, Linkage::Local, &signature);
            let id = id.map_err(|e| memory(&e))?;
            debug_assert_eq!(id.as_u32() as usize, index);
        }
        let compiled = own
            .par_iter()
            .map(|(index, function)| compile(&shared, isa.as_ref(), *index, function));
        let compiled: Vec<Compiled> = compiled.collect::<Result<_, _>>()?;
        let main = FuncId::from_u32(code.functions.len() as u32);
        let mut statistics = Statistics::default();
        for Compiled {
            id,
            bytes,
            alignment,
            relocations,
        } in &compiled
        {
            statistics.functions += 1;
            statistics.bytes += bytes.len();
            let defined = module.define_function_bytes(*id, *alignment, bytes, relocations);
            defined.map_err(|e| memory(&e))?;
        }
        module.finalize_definitions().map_err(|e| memory(&e))?;
        let main = module.get_finalized_function(main);
        statistics.time = begin.elapsed();
        let least = layout::least_bytes(code);
        Ok(Self {
            main,
            layout,
            private: code.private.iter().map(word).collect(),
            inputs: code.inputs.clone(),
            workgroup: code.workgroup,
            buffers: code.buffers.iter().cloned().zip(least).collect(),
            statistics,
            _constants: constants,
            memory: Some(Memory(module)),
        })
    }
}

impl Kernel {
    /// The names of the buffers that it binds, in the order in which they are given.
    pub(crate) fn buffers(&self) -> impl Iterator<Item = &str> {
        self.buffers.iter().map(|(name, _)| name.as_str())
    }
}

/// The functions that are compiled on their own, by their index; the entry point has the last.
fn own_functions<'c>(code: &'c Code, plan: &Plan) -> Vec<(usize, &'c Function)> {
    let functions = code.functions.iter().enumerate();
    let own = functions.filter_map(|(index, function)| {
        let function = function.as_ref()?;
        (!plan.inline[index] && !function.answered).then_some((index, function))
    });
    own.chain([(code.functions.len(), &code.main)]).collect()
}

/// This machine's processor, with all that it can do.
pub(super) fn isa() -> Result<OwnedTargetIsa, KernelError> {
    let processor = |e: &dyn std::fmt::Display| KernelError::Processor(e.to_string());
    let mut flags = settings::builder();
    for (name, value) in [
        ("opt_level", "speed"),
        ("use_colocated_libcalls", "false"),
        ("is_pic", "false"),
        (
            "enable_verifier",
            if cfg!(debug_assertions) {
                "true"
            } else {
                "false"
            },
        ),
        ("unwind_info", "false"),
    ] {
        flags.set(name, value).map_err(|e| processor(&e))?;
    }
    let builder = cranelift_native::builder().map_err(|e| processor(&e))?;
    let isa = builder.finish(settings::Flags::new(flags));
    isa.map_err(|e| processor(&e))
}

fn compile(
    shared: &Shared<'_>,
    isa: &dyn TargetIsa,
    index: usize,
    function: &Function,
) -> Result<Compiled, KernelError> {
    let mut context = FunctionBuilderContext::new();
    let is_main = index == shared.code.functions.len();
    let none = vec![false; function.arguments as usize];
    let convention = if is_main {
        shared.host
    } else {
        cranelift_codegen::isa::CallConv::Fast
    };
    let signature = emit::signature(function, &none, convention);
    let mut text = Text::with_name_signature(emit::name(index), signature);
    let builder = FunctionBuilder::new(&mut text, &mut context);
    let builder = Emitter::translate(shared, function, builder)?;
    builder.finalize(isa.frontend_config());
    let mut context = Context::for_function(text);
    let unsupported = |e: &CodegenError| {
        KernelError::unsupported(&format!("code that compiles ({e})"), &function.name)
    };
    context
        .compile(isa, &mut ControlPlane::default())
        .map_err(|e| unsupported(&e.inner))?;
    let compiled = context.compiled_code();
    let compiled = compiled.ok_or_else(|| KernelError::unsupported("code", &function.name))?;
    let id = FuncId::from_u32(index as u32);
    let relocations = compiled.buffer.relocs().iter();
    Ok(Compiled {
        id,
        bytes: compiled.code_buffer().to_vec(),
        alignment: u64::from(compiled.buffer.alignment).max(16),
        relocations: relocations
            .map(|r| ModuleReloc::from_mach_reloc(r, &context.func, id))
            .collect(),
    })
}

fn memory(error: &ModuleError) -> KernelError {
    KernelError::Memory(error.to_string())
}

fn word(cell: &Scalar) -> u32 {
    match *cell {
        Scalar::Float(x) => x.to_bits(),
        Scalar::Word(x) => x,
        Scalar::Bool(x) => x.into(),
    }
}
