//! What renders: a GPU by wgpu, or the processor by its own code. The renderer asks a device and what is
//! built for it by the same calls; `gpu` and `cpu` answer.

mod memory;
mod work;

use std::fmt;

use impasto_compiler::partition::{Plan, Strategy};

use crate::cpu::{Cpu, CpuOptions};
use crate::error::RuntimeError;
use crate::gpu::{DeviceInfo, Gpu, GpuOptions};
use crate::technique::{Append, CameraRays, Technique};
use crate::world::{MaterialSource, World};

pub(crate) use work::{Submission, Work};

/// How to choose and open a device.
#[derive(Clone, Debug, Default)]
pub struct DeviceOptions {
    /// Which.
    pub choice: Choice,
    /// How to open a GPU.
    pub gpu: GpuOptions,
    /// How to use the processor.
    pub cpu: CpuOptions,
}

/// Which device renders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Choice {
    /// A GPU if there is one that is no software, else the processor.
    #[default]
    Best,
    /// A GPU, which may be software.
    Gpu,
    /// The processor.
    Cpu,
}

/// An open device.
#[derive(Debug)]
pub enum Device {
    /// A GPU.
    Gpu(Box<Gpu>),
    /// The processor.
    Cpu(Cpu),
}

/// A device that somebody else keeps open.
#[derive(Clone, Copy, Debug)]
pub enum DeviceRef<'d> {
    /// A GPU.
    Gpu(&'d Gpu),
    /// The processor.
    Cpu(&'d Cpu),
}

/// What bounds the sizes of buffers and dispatches.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// Bytes of a buffer.
    pub buffer_bytes: u64,
    /// Threads of a workgroup.
    pub workgroup_threads: u32,
    /// Bytes that a workgroup shares.
    pub workgroup_bytes: u32,
    /// Workgroups in the first dimension of a dispatch.
    pub row_groups: u32,
}

impl Device {
    /// Opens a device.
    ///
    /// # Errors
    /// If there is none of that kind, several are meant, or it cannot be opened.
    pub fn open(options: &DeviceOptions) -> Result<Self, RuntimeError> {
        Self::open_noting(options, &mut |_| ())
    }

    /// The same; `note` is given the lines that say what users should know of the choice.
    ///
    /// # Errors
    /// As [`Device::open`].
    pub fn open_noting(
        options: &DeviceOptions,
        note: &mut dyn FnMut(&str),
    ) -> Result<Self, RuntimeError> {
        let device = |gpu| Device::Gpu(Box::new(gpu));
        let cpu = || Ok(Device::Cpu(Cpu::new(&options.cpu)?));
        match options.choice {
            Choice::Gpu => Gpu::new_noting(&options.gpu, note).map(device),
            Choice::Cpu => cpu(),
            Choice::Best => match Gpu::new_hardware(&options.gpu, note)? {
                Some(gpu) => Ok(device(gpu)),
                // A driver in software is the next best where no code can be made.
                None => {
                    cpu().or_else(|error| Gpu::new(&options.gpu).map(device).map_err(|_| error))
                }
            },
        }
    }

    /// All devices that there are: GPUs, best first, and the processor where it can render.
    pub fn found() -> Vec<DeviceInfo> {
        let cpu = Cpu::new(&CpuOptions::default());
        let cpu = cpu.ok().map(|cpu| cpu.info());
        Gpu::found().into_iter().chain(cpu).collect()
    }

    /// What the device is and can do.
    pub fn info(&self) -> DeviceInfo {
        DeviceRef::from(self).info()
    }

    /// Whether it renders by [`Device::strategy`] in place of another.
    pub fn replaces(&self, strategy: &str) -> bool {
        DeviceRef::from(self).replaces(strategy)
    }

    /// The same of a plan.
    pub fn replaces_plan(&self, plan: &Plan) -> bool {
        DeviceRef::from(self).replaces_plan(plan)
    }

    /// The strategy by which materials share kernels unless another is asked for.
    pub fn strategy(&self) -> Strategy {
        DeviceRef::from(self).strategy()
    }

    /// The GPU, for what only GPUs do.
    ///
    /// # Errors
    /// If it is the processor.
    pub fn gpu(&self, what: &'static str) -> Result<&Gpu, RuntimeError> {
        match self {
            Device::Gpu(gpu) => Ok(gpu),
            Device::Cpu(_) => Err(RuntimeError::NeedsGpu(what)),
        }
    }
}

impl<'d> From<&'d Device> for DeviceRef<'d> {
    fn from(device: &'d Device) -> Self {
        match device {
            Device::Gpu(gpu) => DeviceRef::Gpu(gpu),
            Device::Cpu(cpu) => DeviceRef::Cpu(cpu),
        }
    }
}

impl<'d> From<&'d Gpu> for DeviceRef<'d> {
    fn from(gpu: &'d Gpu) -> Self {
        DeviceRef::Gpu(gpu)
    }
}

impl<'d> From<&'d Cpu> for DeviceRef<'d> {
    fn from(cpu: &'d Cpu) -> Self {
        DeviceRef::Cpu(cpu)
    }
}

impl DeviceRef<'_> {
    /// What the device is and can do.
    pub fn info(self) -> DeviceInfo {
        match self {
            DeviceRef::Gpu(gpu) => gpu.info(),
            DeviceRef::Cpu(cpu) => cpu.info(),
        }
    }

    /// Whether kernels may use subgroup operations and barriers.
    pub(crate) fn has_subgroups(self) -> bool {
        match self {
            DeviceRef::Gpu(gpu) => gpu.has_subgroups(),
            DeviceRef::Cpu(_) => false,
        }
    }

    /// Lanes of its largest subgroups.
    pub(crate) fn subgroup_size(self) -> u32 {
        match self {
            DeviceRef::Gpu(gpu) => gpu.subgroup_size(),
            DeviceRef::Cpu(_) => 1,
        }
    }

    /// What this device can do of a technique.
    pub(crate) fn technique(self, wanted: Technique) -> Technique {
        let possible = wanted.within(self.has_subgroups());
        match self {
            DeviceRef::Gpu(_) => possible,
            // Threads of a workgroup come one after another, and wait for nobody. Nor does anybody wait for the next iteration.
            DeviceRef::Cpu(_) => Technique {
                append: Append::Thread,
                camera_rays: match possible.camera_rays {
                    CameraRays::Auto => CameraRays::AtOnce,
                    asked => asked,
                },
                ..possible
            },
        }
    }

    /// Whether it renders by [`Device::strategy`] in place of another, of which it cannot have the kernels, or
    /// which follows a model of GPUs' times.
    pub fn replaces(self, strategy: &str) -> bool {
        match self {
            DeviceRef::Gpu(_) => false,
            DeviceRef::Cpu(cpu) => Strategy::parse(strategy).is_ok_and(|s| cpu.replaces(s)),
        }
    }

    /// The same of a plan.
    pub fn replaces_plan(self, plan: &Plan) -> bool {
        match self {
            DeviceRef::Gpu(_) => false,
            DeviceRef::Cpu(cpu) => cpu.replaces_plan(plan),
        }
    }

    /// The strategy by which materials share kernels unless another is asked for.
    pub fn strategy(self) -> Strategy {
        match self {
            DeviceRef::Gpu(_) => Strategy::AUTO,
            DeviceRef::Cpu(cpu) => cpu.strategy(),
        }
    }

    /// The plan that takes the place of one that cannot run here.
    pub(crate) fn plan(self, wanted: &Plan, world: &World, source: &dyn MaterialSource) -> Plan {
        match self {
            DeviceRef::Gpu(_) => wanted.clone(),
            DeviceRef::Cpu(cpu) => cpu.plan(wanted, world, source),
        }
    }

    /// What bounds the sizes of buffers and dispatches.
    pub(crate) fn limits(self) -> Limits {
        match self {
            DeviceRef::Gpu(gpu) => {
                let limits = gpu.device.limits();
                let binding = limits.max_storage_buffer_binding_size;
                Limits {
                    buffer_bytes: limits.max_buffer_size.min(binding),
                    workgroup_threads: limits
                        .max_compute_invocations_per_workgroup
                        .min(limits.max_compute_workgroup_size_x),
                    workgroup_bytes: limits.max_compute_workgroup_storage_size,
                    row_groups: limits.max_compute_workgroups_per_dimension.min(65_535),
                }
            }
            DeviceRef::Cpu(_) => Limits {
                buffer_bytes: memory::bytes(),
                workgroup_threads: 1024,
                workgroup_bytes: 0,
                row_groups: u32::MAX,
            },
        }
    }

    /// Fails if a storage buffer of `bytes` for `what` is more than a kernel can bind.
    pub(crate) fn check_binding_size(self, what: &str, bytes: u64) -> Result<(), RuntimeError> {
        match self {
            DeviceRef::Gpu(gpu) => gpu.check_binding_size(what, bytes),
            DeviceRef::Cpu(_) if bytes <= memory::bytes() => Ok(()),
            DeviceRef::Cpu(_) => Err(RuntimeError::LimitTooSmall {
                limit: "memory",
                has: memory::bytes(),
                needs: bytes,
                what: format!("{what} (in bytes)"),
                hint: "use a smaller scene or picture",
            }),
        }
    }
}

impl fmt::Display for DeviceRef<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.info().fmt(f)
    }
}
