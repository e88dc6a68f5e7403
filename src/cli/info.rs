//! `impasto info`: the device that would render, and the choice of it for all commands.

use clap::{Args, ValueEnum};
use impasto::{Choice, CpuOptions, Device, DeviceOptions, Gpu, GpuOptions};

use super::{Failure, Global, Outcome, print};

/// Which device to use, and how.
#[derive(Args)]
pub(super) struct DeviceArgs {
    /// What renders; by default a GPU that is no software, or else the processor
    #[arg(long, value_enum, value_name = "KIND")]
    device: Option<Kind>,
    /// Use as many threads of the processor; by default one for each core
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    #[command(flatten)]
    gpu: GpuArgs,
}

/// A kind of device.
#[derive(Clone, Copy, ValueEnum)]
enum Kind {
    /// A GPU, which may be a driver in software
    Gpu,
    /// The processor, by native code
    Cpu,
}

/// Which GPU to use, and how.
#[derive(Args)]
pub(super) struct GpuArgs {
    /// Use the GPU whose name contains this; by default the most capable one
    #[arg(long, value_name = "NAME")]
    gpu: Option<String>,
    /// Keep the checks of array bounds and loops in all kernels (slower)
    #[arg(long)]
    checked: bool,
    /// Let wgpu check the arguments of indirect dispatches (slower)
    #[arg(long)]
    validate_indirect: bool,
}

impl DeviceArgs {
    pub(super) fn open(&self) -> Result<Device, Failure> {
        let options = DeviceOptions {
            choice: match self.device {
                None => Choice::Best,
                Some(Kind::Gpu) => Choice::Gpu,
                Some(Kind::Cpu) => Choice::Cpu,
            },
            gpu: self.gpu.options(),
            cpu: CpuOptions {
                threads: self.threads,
                ..CpuOptions::default()
            },
        };
        Device::open(&options).map_err(|error| Failure::Error(error.to_string()))
    }
}

impl GpuArgs {
    fn options(&self) -> GpuOptions {
        GpuOptions {
            adapter: self.gpu.clone(),
            checked: self.checked,
            validate_indirect: self.validate_indirect,
            ..GpuOptions::default()
        }
    }

    pub(super) fn open(&self) -> Result<Gpu, Failure> {
        Gpu::new(&self.options()).map_err(|error| Failure::Error(error.to_string()))
    }
}

pub(super) fn run(args: &DeviceArgs, global: &Global) -> Outcome {
    let info = args.open()?.info();
    if global.json() {
        print(&format!("{:#}\n", serde_json::json!(info)))
    } else {
        print(&info.to_string())
    }
}
