//! The GPU: finding an adapter, opening a device, and learning of its errors.
//!
//! wgpu reports errors through callbacks that panic by default. Here they are collected, and
//! `Gpu::check` turns the first into a [`RuntimeError`].

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use crate::error::RuntimeError;

mod adapters;
mod info;
mod kept;
mod memory;
mod nvidia;
pub(crate) mod resources;
pub(crate) mod schedule;
pub mod selection;
pub(crate) mod shader;
mod spirv;
pub(crate) mod statistics;
pub(crate) mod submission;
mod timing;
pub(crate) mod work;

pub use info::{DeviceIds, DeviceInfo};
pub use kept::KernelFolder;
pub use selection::{Environment, Selector, Several};
pub use statistics::KernelStatistics;
pub use timing::Timing;

use adapters::{Adapters, Found};

/// How to choose and open a GPU.
#[derive(Clone, Debug, Default)]
pub struct GpuOptions {
    /// Which; if `None`, the first that the environment leaves, the fastest kind of adapter before others.
    pub adapter: Option<Selector>,
    /// What the environment says of GPUs. By default it says nothing; a program that schedulers start wants
    /// [`Environment::of_process`].
    pub environment: Environment,
    /// Keeps wgpu's bounds checks and loop bounds in the kernels: slower, for finding defects.
    pub checked: bool,
    /// Lets wgpu check the arguments of indirect dispatches, which the prepare kernels are known to
    /// keep within limits: slower, for finding defects and for measuring what it costs.
    pub validate_indirect: bool,
    /// How finely to time kernels; coarser if the GPU cannot.
    pub timing: Timing,
    /// Where kernels that were built are kept for the next start; if `None`, nowhere.
    pub kernels: Option<KernelFolder>,
}

/// An open GPU; copies are of the same.
#[derive(Clone, Debug)]
pub struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) adapter: wgpu::Adapter,
    ids: DeviceIds,
    pub(crate) checked: bool,
    pub(crate) timing: Timing,
    failure: Arc<Failure>,
    pipelines: Arc<shader::Pipelines>,
    kept: Option<Arc<kept::Kept>>,
}

/// What went wrong on a device.
#[derive(Debug, Default)]
struct Failure {
    /// The first error that nobody was told yet.
    first: Mutex<Option<RuntimeError>>,
    /// Why the device is lost, if it is: whatever is asked of it from then on fails for that reason.
    lost: OnceLock<String>,
}

impl Failure {
    fn keep_first(&self, error: RuntimeError) {
        let mut first = self.first.lock().unwrap_or_else(PoisonError::into_inner);
        first.get_or_insert(error);
    }

    fn take(&self) -> Option<RuntimeError> {
        let mut first = self.first.lock().unwrap_or_else(PoisonError::into_inner);
        first.take()
    }
}

/// Features that are used where they exist; nothing requires one.
pub(crate) const USED_FEATURES: wgpu::Features = wgpu::Features::TIMESTAMP_QUERY
    .union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS)
    .union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_PASSES)
    .union(wgpu::Features::PASSTHROUGH_SHADERS)
    .union(SUBGROUPS);

/// What kernels need to work together within a subgroup.
const SUBGROUPS: wgpu::Features = wgpu::Features::SUBGROUP.union(wgpu::Features::SUBGROUP_BARRIER);

impl Gpu {
    /// Opens a GPU, which may be software, with every limit as high as its driver allows.
    ///
    /// # Errors
    /// If none fits, several do, or it cannot be opened.
    pub fn new(options: &GpuOptions) -> Result<Self, RuntimeError> {
        Self::new_noting(options, &mut |_| ())
    }

    /// The same; `note` is given the lines that say what users should know of the choice.
    ///
    /// # Errors
    /// As [`Gpu::new`].
    pub fn new_noting(
        options: &GpuOptions,
        note: &mut dyn FnMut(&str),
    ) -> Result<Self, RuntimeError> {
        let adapters = Adapters::of_machine(options.validate_indirect);
        let found = adapters.choose(options, note)?;
        match found.or_else(|| adapters.software()) {
            Some(found) => Self::open(found, options),
            None => Err(RuntimeError::NoAdapter {
                wanted: None,
                found: Vec::new(),
                hint: "",
            }),
        }
    }

    /// Opens GPUs that render together, each once.
    ///
    /// # Errors
    /// If one is not there, fits several, is listed twice, there are fewer than asked for, or one cannot be opened.
    pub fn several(
        several: &Several,
        options: &GpuOptions,
        note: &mut dyn FnMut(&str),
    ) -> Result<Vec<Self>, RuntimeError> {
        let adapters = Adapters::of_machine(options.validate_indirect);
        let found = adapters.choose_several(several, options, note)?;
        found
            .into_iter()
            .map(|found| Self::open(found, options))
            .collect()
    }

    /// Opens a GPU unless none was asked for, and there is none but software.
    ///
    /// # Errors
    /// As [`Gpu::new`].
    pub(crate) fn new_hardware(
        options: &GpuOptions,
        note: &mut dyn FnMut(&str),
    ) -> Result<Option<Self>, RuntimeError> {
        let found = Adapters::of_machine(options.validate_indirect).choose(options, note)?;
        found.map(|found| Self::open(found, options)).transpose()
    }

    fn open(Found { adapter, ids }: Found, options: &GpuOptions) -> Result<Self, RuntimeError> {
        // Asked for only where it serves: it changes nothing but the time of a start.
        let features = match options.kernels {
            Some(_) => USED_FEATURES | wgpu::Features::PIPELINE_CACHE,
            None => USED_FEATURES,
        };
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("impasto"),
            required_features: adapter.features() & features,
            required_limits: adapter.limits(),
            memory_hints: wgpu::MemoryHints::Performance,
            ..Default::default()
        };
        let request = pollster::block_on(adapter.request_device(&descriptor));
        let (device, queue) = request.map_err(|e| RuntimeError::DeviceRequest {
            adapter: adapter.get_info().name,
            reason: e.to_string(),
        })?;
        let failure = collect_errors(&device);
        let timing = options.timing.min(Timing::finest(device.features()));
        let kept = options.kernels.clone();
        let kept = kept.map(|folder| Arc::new(kept::Kept::new(folder, &adapter.get_info())));
        Ok(Self {
            device,
            queue,
            adapter,
            ids,
            checked: options.checked,
            timing,
            failure,
            pipelines: Arc::default(),
            kept,
        })
    }

    /// What wgpu has to say against what `work` does on this thread, which nobody else then hears of.
    pub(crate) fn guarded<T>(
        &self,
        work: impl FnOnce() -> Result<T, RuntimeError>,
    ) -> Result<T, RuntimeError> {
        let filters = [
            wgpu::ErrorFilter::Validation,
            wgpu::ErrorFilter::OutOfMemory,
            wgpu::ErrorFilter::Internal,
        ];
        let scopes = filters.map(|filter| self.device.push_error_scope(filter));
        let mut result = work();
        for scope in scopes.into_iter().rev() {
            if let Some(error) = pollster::block_on(scope.pop()) {
                result = Err(runtime_error(error));
            }
        }
        result
    }

    /// All GPUs that there are, best first.
    pub fn found() -> Vec<DeviceInfo> {
        let all = Adapters::of_machine(false).all();
        let info = |found: Found| DeviceInfo::new(&found.adapter, found.ids);
        all.into_iter().map(info).collect()
    }

    /// What the GPU is and can do.
    pub fn info(&self) -> DeviceInfo {
        DeviceInfo::new(&self.adapter, self.ids.clone())
    }

    /// Whether the "GPU" is the processor: smaller portions of work keep it responsive.
    pub(crate) fn is_software(&self) -> bool {
        self.adapter.get_info().device_type == wgpu::DeviceType::Cpu
    }

    /// Whether its memory is not the processor's.
    pub(crate) fn has_own_memory(&self) -> bool {
        self.adapter.get_info().device_type == wgpu::DeviceType::DiscreteGpu
    }

    /// Whether kernels may use subgroup operations and barriers.
    pub(crate) fn has_subgroups(&self) -> bool {
        self.device.features().contains(SUBGROUPS)
    }

    /// Lanes of its largest subgroups.
    pub fn subgroup_size(&self) -> u32 {
        self.adapter.get_info().subgroup_max_size
    }

    /// Gives the device up as a driver does that a kernel takes too long: all that is asked of it
    /// from now on fails. So that one can test what a render says then, and what it leaves.
    #[doc(hidden)]
    pub fn lose(&self) {
        self.device.destroy();
    }

    /// The first error since the device was opened, if there was any.
    pub(crate) fn check(&self) -> Result<(), RuntimeError> {
        let Some(error) = self.failure.take() else {
            return Ok(());
        };
        // A device that was given up refuses calls before it says that it is lost: only a poll that finds its queue empty
        // makes it say so (wgpu-core 30, `Device::maintain`).
        let _ = self.device.poll(wgpu::PollType::wait_indefinitely());
        let lost = self.failure.lost.get().cloned();
        Err(lost.map_or(error, RuntimeError::DeviceLost))
    }

    /// Fails if a storage buffer of `bytes` for `what` is more than a kernel can bind.
    pub(crate) fn check_binding_size(&self, what: &str, bytes: u64) -> Result<(), RuntimeError> {
        let limits = self.device.limits();
        let binding = limits.max_storage_buffer_binding_size;
        let (limit, has) = if limits.max_buffer_size < binding {
            ("max_buffer_size", limits.max_buffer_size)
        } else {
            ("max_storage_buffer_binding_size", binding)
        };
        if bytes <= has {
            return Ok(());
        }
        Err(RuntimeError::LimitTooSmall {
            limit,
            has,
            needs: bytes,
            what: format!("{what} (in bytes)"),
            hint: "use a smaller scene or picture, or another GPU (`--gpu`)",
        })
    }
}

/// Makes the device put its first error where `Gpu::check` finds it.
fn collect_errors(device: &wgpu::Device) -> Arc<Failure> {
    let failure = Arc::new(Failure::default());
    let on_error = failure.clone();
    device.on_uncaptured_error(Arc::new(move |error| {
        on_error.keep_first(runtime_error(error));
    }));
    let on_loss = failure.clone();
    device.set_device_lost_callback(move |reason, message| {
        let message = on_loss.lost.get_or_init(|| message).clone();
        // Who gave it up knows.
        if reason != wgpu::DeviceLostReason::Destroyed {
            on_loss.keep_first(RuntimeError::DeviceLost(message));
        }
    });
    failure
}

fn runtime_error(error: wgpu::Error) -> RuntimeError {
    match error {
        wgpu::Error::OutOfMemory { source } => RuntimeError::OutOfMemory(source.to_string()),
        other => RuntimeError::Validation(other.to_string()),
    }
}

impl Gpu {
    /// Waits for a submission and reports what went wrong until then.
    pub(crate) fn wait(&self, submission: wgpu::SubmissionIndex) -> Result<(), RuntimeError> {
        let waited = self.device.poll(wgpu::PollType::Wait {
            submission_index: Some(submission),
            timeout: None,
        });
        self.check()?;
        waited.map_err(|e| RuntimeError::DeviceLost(e.to_string()))?;
        Ok(())
    }

    /// Waits for a submission, then gives the first `size` bytes of the mapped `buffer` to
    /// `take` and unmaps it.
    pub(crate) fn read<T>(
        &self,
        buffer: &wgpu::Buffer,
        submission: wgpu::SubmissionIndex,
        size: u64,
        take: impl FnOnce(&[u8]) -> T,
    ) -> Result<T, RuntimeError> {
        buffer.map_async(wgpu::MapMode::Read, 0..size, |_| {});
        self.wait(submission)?;
        let view = buffer.get_mapped_range(0..size);
        let view = view.map_err(|e| RuntimeError::DeviceLost(e.to_string()))?;
        let taken = take(&view);
        drop(view);
        buffer.unmap();
        Ok(taken)
    }
}
