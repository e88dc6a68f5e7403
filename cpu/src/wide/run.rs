//! Builds kernels of eight lanes, and runs them.

use std::ffi::c_void;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use memmap2::{Mmap, MmapMut};
use naga::BuiltIn;

use super::asm::Assembler;
use super::assign;
use super::host::Answer;
use super::inst::Constant;
use super::memory::{CELL, Memory};
use super::translate::{self, Interface, Shared};
use crate::cell::Cell;
use crate::code::{Code, First, Function, Input, Ins, Node, Scalar};
use crate::error::KernelError;
use crate::native::{Buffer, Statistics, layout};
use crate::plan::{Plan, walk};

/// Invocations that run at a time.
pub(crate) const LANES: u32 = 8;

/// A kernel as machine code.
#[derive(Debug)]
pub(crate) struct Kernel {
    code: Mmap,
    entry: usize,
    memory: Memory,
    main: Interface,
    /// What the entry point is given.
    inputs: Vec<Input>,
    pub(crate) workgroup: u32,
    /// Module-scope variables at the beginning of an invocation, and where they lie.
    private: Vec<Cell>,
    private_at: i32,
    /// By buffer: its name, and the bytes it must have at least.
    buffers: Vec<(String, u64)>,
    /// What building took.
    pub statistics: Statistics,
}

/// Whether this machine's processor runs such code.
pub(crate) fn is_possible() -> bool {
    std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma")
}

impl Kernel {
    /// Compiles `code`. By hook, `answers` are called in place of functions that the host answers. By name,
    /// `is_alone` says whether a thread has a buffer for itself.
    ///
    /// # Errors
    /// If the code has what is not known here, or there is no memory for code.
    pub(crate) fn build(
        code: &Code,
        answers: &[Option<Answer>],
        is_alone: impl Fn(&str) -> bool,
    ) -> Result<Self, KernelError> {
        let begin = Instant::now();
        let plan = Plan::new(code);
        let mut memory = Memory::new(code.buffers.len(), answers.len());
        let mut asm = Assembler::default();
        let private = memory.cells(code.private.len());
        let mut interface = |function: &Function, asm: &mut Assembler| Interface {
            label: asm.label(),
            mask: memory.cell(),
            arguments: memory.cells(function.arguments as usize),
            result: memory.cells(function.result.len()),
        };
        let functions = code.functions.iter().enumerate();
        let interfaces = functions.map(|(index, function)| {
            let own = function
                .as_ref()
                .filter(|f| !plan.inline[index] && !f.answered);
            own.map(|function| interface(function, &mut asm))
        });
        let interfaces: Vec<Option<Interface>> = interfaces.collect();
        let main = interface(&code.main, &mut asm);
        let indexed = indexed(code);
        let alone: Vec<bool> = code.buffers.iter().map(|name| is_alone(name)).collect();
        let shared = Shared {
            code,
            plan: &plan,
            interfaces: &interfaces,
            private,
            indexed: &indexed,
            answers,
            alone: &alone,
        };
        let mut functions = 0;
        let own = code.functions.iter().zip(&interfaces);
        let own = own.filter_map(|(function, at)| Some((function.as_ref()?, at.as_ref()?)));
        for (function, interface) in own.chain([(&code.main, &main)]) {
            let is_main = std::ptr::eq(function, &code.main);
            let mut label = || asm.label();
            let text = translate::translate(
                &shared,
                &mut memory,
                &mut label,
                function,
                interface,
                is_main,
            )?;
            asm.bind(interface.label);
            if is_main {
                asm.enter();
            } else {
                asm.enter_function();
            }
            assign::encode(&mut asm, &mut memory, &text);
            if is_main {
                asm.leave();
            } else {
                asm.leave_function();
            }
            functions += 1;
        }
        let entry = asm.place(main.label).unwrap_or(0);
        let bytes = asm.finish();
        let executable = executable(&bytes).map_err(|e| KernelError::Memory(e.to_string()))?;
        Ok(Self {
            code: executable,
            entry,
            memory,
            main,
            inputs: code.inputs.clone(),
            workgroup: code.workgroup,
            private: code
                .private
                .iter()
                .map(|cell| Cell([word(cell); 8]))
                .collect(),
            private_at: private,
            buffers: code
                .buffers
                .iter()
                .cloned()
                .zip(layout::least_bytes(code))
                .collect(),
            statistics: Statistics {
                functions,
                bytes: bytes.len(),
                time: begin.elapsed(),
            },
        })
    }

    /// The names of the buffers that it binds, in the order in which they are given.
    pub(crate) fn buffers(&self) -> impl Iterator<Item = &str> {
        self.buffers.iter().map(|(name, _)| name.as_str())
    }
}

/// Memory that holds code and may run.
fn executable(bytes: &[u8]) -> std::io::Result<Mmap> {
    let mut memory = MmapMut::map_anon(bytes.len().max(1))?;
    memory[..bytes.len()].copy_from_slice(bytes);
    memory.make_exec()
}

fn word(cell: &Scalar) -> u32 {
    match *cell {
        Scalar::Float(x) => x.to_bits(),
        Scalar::Word(x) => x,
        Scalar::Bool(x) => 0u32.wrapping_sub(x.into()),
    }
}

/// By cell of the module's variables: whether it is part of an array that is indexed by what is known only
/// when running.
fn indexed(code: &Code) -> Vec<bool> {
    let mut found = vec![false; code.private.len()];
    for function in code.functions.iter().flatten().chain([&code.main]) {
        walk(&function.body, &mut |node| {
            if let Node::Ins(Ins::Index {
                first: First::Private(cell),
                length,
                stride,
                ..
            }) = node
            {
                let cells = length.unwrap_or(1) * stride;
                let cells = *cell as usize..(cell + cells) as usize;
                found[cells].fill(true);
            }
        });
    }
    found
}

/// What one thread needs to run a kernel.
#[derive(Debug)]
pub(crate) struct Invocation {
    memory: Box<[Cell]>,
}

impl Invocation {
    /// Prepares to run `kernel` with its buffers, in the order that it names them. All loops end when `stop`
    /// is set, with whatever results.
    ///
    /// # Errors
    /// If a buffer is missing or smaller than what the kernel reads of it at known places.
    pub(crate) fn new(
        kernel: &Kernel,
        buffers: &[Arc<Buffer>],
        data: &[*const c_void],
        stop: &AtomicBool,
    ) -> Result<Self, KernelError> {
        let cells = (kernel.memory.end / CELL) as usize + 1;
        let mut memory = vec![Cell::default(); cells].into_boxed_slice();
        let mut address = |at: i32, address: u64| {
            let word = at as usize / 4;
            let words = memory.as_flattened_mut();
            words[word] = address as u32;
            words[word + 1] = (address >> 32) as u32;
        };
        address(kernel.memory.stop(), std::ptr::from_ref(stop) as u64);
        for (index, (name, least)) in kernel.buffers.iter().enumerate() {
            let buffer = buffers.get(index);
            let bytes = buffer.map_or(0, |b| 4 * b.words().len() as u64);
            let (Some(buffer), true) = (buffer, bytes >= *least && bytes < 1 << 33) else {
                return Err(KernelError::Bounds {
                    what: format!("the buffer `{name}` of {bytes} bytes"),
                    function: "main".into(),
                });
            };
            let at = kernel.memory.buffer(index as u32);
            address(at, buffer.words().as_ptr() as u64);
        }
        for (hook, data) in (0..).zip(data) {
            address(kernel.memory.data(hook), *data as u64);
        }
        let mut this = Self { memory };
        for (constant, at) in &kernel.memory.constants {
            let cell = match *constant {
                Constant::Bits(bits) => [bits; 8],
                Constant::Lane => [0, 1, 2, 3, 4, 5, 6, 7],
                Constant::Last { buffer, words } => {
                    let buffer = buffers.get(buffer as usize);
                    let all = buffer.map_or(0, |b| b.words().len()) as u32;
                    [all.saturating_sub(words); 8]
                }
            };
            this.put(*at, cell);
        }
        for (words, at) in &kernel.memory.tables {
            let first = *at as usize / 4;
            this.memory.as_flattened_mut()[first..first + words.len()].copy_from_slice(words);
        }
        Ok(this)
    }

    fn put(&mut self, at: i32, cell: [u32; 8]) {
        self.memory[(at / CELL) as usize] = Cell(cell);
    }

    /// Runs the entry point for some threads of a workgroup, from `first` on: at most [`LANES`].
    ///
    /// # Safety
    /// It was prepared for this kernel, what it was prepared with is still there, and what answers are given
    /// along is what they expect.
    #[allow(unsafe_code)]
    pub(crate) unsafe fn run(
        &mut self,
        kernel: &Kernel,
        group: [u32; 3],
        first: u32,
        threads: u32,
    ) {
        let lanes = [0, 1, 2, 3, 4, 5, 6, 7];
        let mask = lanes.map(|lane| 0u32.wrapping_sub((lane < threads).into()));
        self.put(kernel.main.mask, mask);
        let private = (kernel.private_at / CELL) as usize;
        self.memory[private..][..kernel.private.len()].copy_from_slice(&kernel.private);
        for (at, input) in (0..).zip(&kernel.inputs) {
            let axis = input.component as usize % 3;
            let from = |begin: u32| lanes.map(|lane| begin.wrapping_add(lane));
            let each = match input.built_in {
                Some(BuiltIn::WorkGroupId) => [group[axis]; 8],
                Some(BuiltIn::LocalInvocationIndex) => from(first),
                Some(BuiltIn::LocalInvocationId) if axis == 0 => from(first),
                Some(BuiltIn::GlobalInvocationId) if axis == 0 => {
                    from(group[0].wrapping_mul(kernel.workgroup).wrapping_add(first))
                }
                _ => [0; 8],
            };
            self.put(kernel.main.arguments + CELL * at, each);
        }
        let memory = self.memory.as_mut_ptr();
        // SAFETY: the entry point has one parameter, the memory of a thread, which is as the kernel's
        // `Memory` says; what it points to is there.
        unsafe {
            let main = kernel.code.as_ptr().add(kernel.entry);
            let main: unsafe extern "C" fn(*mut Cell) = std::mem::transmute(main);
            main(memory);
        }
    }
}

/// Cells as words.
trait Flattened {
    fn as_flattened_mut(&mut self) -> &mut [u32];
}

impl Flattened for [Cell] {
    fn as_flattened_mut(&mut self) -> &mut [u32] {
        bytemuck::cast_slice_mut(self)
    }
}
