//! `impasto info`: the GPU that would be rendered on.

use clap::Args;
use impasto::{Gpu, GpuOptions};

use super::{Failure, Global, Outcome, print};

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

impl GpuArgs {
    pub(super) fn open(&self) -> Result<Gpu, Failure> {
        let options = GpuOptions {
            adapter: self.gpu.clone(),
            checked: self.checked,
            validate_indirect: self.validate_indirect,
            ..GpuOptions::default()
        };
        Gpu::new(&options).map_err(|error| Failure::Error(error.to_string()))
    }
}

pub(super) fn run(args: &GpuArgs, global: &Global) -> Outcome {
    let info = args.open()?.info();
    if global.json() {
        print(&format!("{:#}\n", serde_json::json!(info)))
    } else {
        print(&info.to_string())
    }
}
