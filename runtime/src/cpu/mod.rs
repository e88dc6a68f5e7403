//! The processor as a device: the kernels that GPUs run as machine code, on all cores.
//!
//! Where eight paths run at a time, paths that hit the same material should do so together: each material has
//! a kernel, as on GPUs. Where one runs, there is one kernel, since queues would only take time.

mod casts;
mod work;

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use impasto_compiler::partition::{Form, Organisation, Plan, Requires, Strategy};
use impasto_cpu::KernelError;
pub use impasto_cpu::Width;
use impasto_cpu::native;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error::RuntimeError;
use crate::gpu::DeviceInfo;
use crate::kernels::modules::{Extent, Kernel, Sizes};
use crate::kernels::validate::validate;
use crate::world::{MaterialSource, World};

pub(crate) use casts::Casts;
pub(crate) use work::{Groups, Step, Work};

/// How to use the processor.
#[derive(Clone, Debug, Default)]
pub struct CpuOptions {
    /// Threads that render; one for each core if `None`.
    pub threads: Option<usize>,
    /// Paths that a thread takes at a time.
    pub width: Width,
}

/// The most threads that may be asked for.
pub const MOST_THREADS: usize = 1024;
/// Bytes of the stack of a thread.
const STACK_BYTES: usize = 16 << 20;
/// Most kernels that are kept; beyond it all are forgotten.
const MOST_KEPT: usize = 64;

/// The processor.
#[derive(Debug)]
pub struct Cpu {
    threads: Arc<ThreadPool>,
    /// Those that make machine code: a render that goes on meanwhile does not wait for them.
    compilers: ThreadPool,
    width: Width,
    /// Kernels that were built before, by their text and whether their ray casts are answered.
    kernels: Mutex<HashMap<(String, bool), Arc<impasto_cpu::Kernel>>>,
}

impl Cpu {
    /// Starts its threads.
    ///
    /// # Errors
    /// If no code can be made for it or run, or it has not so many threads.
    pub fn new(options: &CpuOptions) -> Result<Self, RuntimeError> {
        native::check().map_err(|why| RuntimeError::NoNativeCode(why.to_string()))?;
        let threads = options.threads.unwrap_or_else(cores);
        if threads == 0 || threads > MOST_THREADS {
            return Err(RuntimeError::Setting {
                setting: "threads",
                value: threads.to_string(),
                expected: format!("1 to {MOST_THREADS}"),
            });
        }
        let pool = |what: &'static str, threads: usize| {
            let pool = ThreadPoolBuilder::new()
                .num_threads(threads)
                .stack_size(STACK_BYTES)
                .thread_name(move |index| format!("{what} {index}"))
                .build();
            pool.map_err(|e| RuntimeError::Threads {
                threads,
                reason: e.to_string(),
            })
        };
        Ok(Self {
            threads: Arc::new(pool("render", threads)?),
            compilers: pool("compile", threads.min(cores()))?,
            width: options.width,
            kernels: Mutex::default(),
        })
    }

    /// Threads that render.
    pub fn threads(&self) -> usize {
        self.threads.current_num_threads()
    }

    /// Whether eight paths run at a time, so that paths that do the same should do it together.
    pub fn is_wide(&self) -> bool {
        self.width == Width::Best && impasto_cpu::is_wide()
    }

    /// The strategy by which materials share kernels unless another is asked for.
    pub fn strategy(&self) -> Strategy {
        if self.is_wide() {
            Strategy::OWN
        } else {
            Strategy::MEGA
        }
    }

    /// Whether [`Cpu::strategy`] takes the place of another. The automatic one follows a model of GPUs' times;
    /// threads of a workgroup, which come one after another, cannot wait for each other, as those of kernels
    /// of several queues do; and one path at a time gains nothing by queues.
    pub(crate) fn replaces(&self, strategy: Strategy) -> bool {
        let is_of_gpus = strategy.requires() == Requires::Workload || strategy == Strategy::BINNED;
        strategy != Strategy::MEGA && (is_of_gpus || !self.is_wide())
    }

    /// The same of a plan.
    pub(crate) fn replaces_plan(&self, plan: &Plan) -> bool {
        let is_mega = plan.organisation == Organisation::Mega;
        let is_binned = plan.kernels.iter().any(|k| k.form == Form::Binned);
        let is_replaced = Strategy::parse(&plan.strategy).is_ok_and(|s| self.replaces(s));
        !is_mega && (is_replaced || is_binned || !self.is_wide())
    }

    /// The plan that takes the place of one that cannot run here.
    pub(crate) fn plan(&self, wanted: &Plan, world: &World, source: &dyn MaterialSource) -> Plan {
        if !self.replaces_plan(wanted) {
            return wanted.clone();
        }
        let names: Vec<String> = source.infos().into_iter().map(|m| m.name).collect();
        if self.is_wide() {
            Plan::own(&names, &world.parts.unbound)
        } else {
            Plan::mega(&names, &world.parts.unbound)
        }
    }

    /// What the processor is and can do.
    pub fn info(&self) -> DeviceInfo {
        let cores = cores();
        DeviceInfo {
            name: native::processor(),
            backend: "native".into(),
            driver: native::compiler(),
            kind: "processor",
            ids: None,
            memory_bytes: None,
            limits: vec![("threads", self.threads() as u64), ("cores", cores as u64)],
            features_used: native::features(),
            features_missing: Vec::new(),
        }
    }

    /// A kernel ready to run, whose ray casts `casts` answers if there are any.
    pub(crate) fn build(
        &self,
        kernel: &Kernel,
        sizes: Sizes,
        casts: Option<&Casts>,
    ) -> Result<Step, RuntimeError> {
        Ok(Step {
            name: kernel.desc.name.clone(),
            kernel: self.compiled(&kernel.desc.name, &kernel.wgsl, casts.is_some())?,
            hands_out: kernel.wgsl.contains("fn hand_out_work"),
            groups: match kernel.desc.source.extent(sizes) {
                Extent::Groups(groups) => Groups::Known(groups),
                Extent::Threads(count) => {
                    Groups::Known(count.div_ceil(sizes.workgroup_of(&kernel.desc)))
                }
                Extent::Queue(queue) => Groups::OfQueue(queue),
            },
        })
    }

    /// The threads that render.
    pub(crate) fn threads_that_render(&self) -> Arc<ThreadPool> {
        self.threads.clone()
    }

    /// The machine code of a kernel that casts no rays, unless it was built before.
    pub(crate) fn compiled_alone(
        &self,
        name: &str,
        wgsl: &str,
    ) -> Result<Arc<impasto_cpu::Kernel>, RuntimeError> {
        self.compiled(name, wgsl, false)
    }

    /// The machine code of a kernel, unless it was built before.
    fn compiled(
        &self,
        name: &str,
        wgsl: &str,
        casts: bool,
    ) -> Result<Arc<impasto_cpu::Kernel>, RuntimeError> {
        let key = (wgsl.to_owned(), casts);
        let kept = || self.kernels.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = kept().get(&key) {
            return Ok(known.clone());
        }
        let refused = |error: KernelError| match error {
            KernelError::Memory(_) | KernelError::Processor(_) => {
                RuntimeError::NoNativeCode(error.to_string())
            }
            other => RuntimeError::Shader {
                kernel: name.to_owned(),
                message: other.to_string(),
            },
        };
        let (module, info) = validate(name, wgsl)?;
        let answered = if casts { &casts::ANSWERED[..] } else { &[] };
        let names: Vec<&str> = answered.iter().map(|(name, _)| *name).collect();
        let hooks: Vec<usize> = (0..names.len()).collect();
        let code = impasto_cpu::lower(&module, &info, &names, &hooks).map_err(refused)?;
        let answers: Vec<_> = answered.iter().map(|(_, answer)| *answer).collect();
        let build = || impasto_cpu::Kernel::build(&code, &answers, work::is_alone, self.width);
        let built = Arc::new(self.compilers.install(build).map_err(refused)?);
        let mut kept = kept();
        if kept.len() >= MOST_KEPT {
            kept.clear();
        }
        kept.insert(key, built.clone());
        Ok(built)
    }
}

/// How many threads run at once.
fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}
