//! `impasto info`: the device that would render and the others, and the choice of it for all commands.

use clap::{Args, ValueEnum};
use impasto::cache;
use impasto::runtime::cpu::MOST_THREADS;
use impasto::runtime::gpu::{DeviceInfo, Environment, KernelFolder, Selector, Several};
use impasto::{Choice, CpuOptions, Device, DeviceOptions, Gpu, GpuOptions, RuntimeError, Width};
use serde::Serialize;

use super::{Failure, Global, Outcome, print};

/// Which device to use, and how.
#[derive(Args)]
pub(super) struct DeviceArgs {
    /// What renders; by default a GPU that is no software, or else the processor
    #[arg(long, value_enum, value_name = "KIND")]
    device: Option<Kind>,
    /// Let each thread of the processor take one path at a time, where it could take eight
    #[arg(long)]
    one_lane: bool,
    /// Render by so many threads of the processor; by default one for each core
    #[arg(long, value_name = "N", conflicts_with = "gpu", value_parser = clap::value_parser!(u32).range(1..=MOST_THREADS as i64))]
    threads: Option<u32>,
    #[command(flatten)]
    gpu: GpuArgs,
}

/// A kind of device.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// A GPU, which may be a driver in software
    Gpu,
    /// The processor, by native code
    Cpu,
}

/// Which GPU to use, and how.
#[derive(Args)]
pub(super) struct GpuArgs {
    /// Use this GPU: `pci:0000:00:06.0`, `uuid:GPU-...`, `minor:N`, its index from 0, or part of its name (see
    /// `impasto info`); by default what Slurm or CUDA_VISIBLE_DEVICES says, or else the most capable one
    #[arg(long, value_name = "GPU", allow_negative_numbers = true, value_parser = parse_selector)]
    gpu: Option<Selector>,
    /// Keep the checks of array bounds and loops in all kernels (slower); the processor always keeps them
    #[arg(long)]
    checked: bool,
    /// Let wgpu check the arguments of indirect dispatches (slower)
    #[arg(long)]
    validate_indirect: bool,
}

fn parse_selector(text: &str) -> Result<Selector, String> {
    text.parse()
}

impl DeviceArgs {
    /// Fails if the options contradict each other.
    pub(super) fn check(&self) -> Result<(), Failure> {
        let wrong = match (self.device, &self.gpu.gpu, self.threads) {
            (Some(Kind::Cpu), Some(_), _) => {
                "`--gpu` chooses a GPU, but `--device cpu` the processor"
            }
            (Some(Kind::Gpu), _, Some(_)) => {
                "`--threads` are those of the processor, but `--device gpu` chooses a GPU"
            }
            _ => return Ok(()),
        };
        Err(Failure::Error(format!(
            "{wrong}\n  hint: leave out one of the two"
        )))
    }

    /// The same as words, for processes that are to use the same device.
    pub(super) fn words(&self) -> Vec<String> {
        let mut words = Vec::new();
        words.extend(self.device.map(|kind| match kind {
            Kind::Gpu => "--device=gpu".to_owned(),
            Kind::Cpu => "--device=cpu".to_owned(),
        }));
        words.extend(self.one_lane.then(|| "--one-lane".to_owned()));
        words.extend(self.threads.map(|threads| format!("--threads={threads}")));
        words.extend(self.gpu.gpu.as_ref().map(|gpu| format!("--gpu={gpu}")));
        words.extend(self.gpu.checked.then(|| "--checked".to_owned()));
        words.extend(
            self.gpu
                .validate_indirect
                .then(|| "--validate-indirect".to_owned()),
        );
        words
    }

    /// Was the processor asked for?
    pub(super) fn is_cpu(&self) -> bool {
        self.device == Some(Kind::Cpu)
    }

    /// Which device is asked for; `warn` is told if kernels cannot be kept for the next start.
    pub(super) fn options(&self, warn: fn(&str)) -> DeviceOptions {
        DeviceOptions {
            choice: match self.device {
                None => Choice::Best,
                Some(Kind::Gpu) => Choice::Gpu,
                Some(Kind::Cpu) => Choice::Cpu,
            },
            gpu: self.gpu.options(warn),
            cpu: CpuOptions {
                threads: self.threads.map(|threads| threads as usize),
                width: if self.one_lane {
                    Width::One
                } else {
                    Width::Best
                },
            },
        }
    }

    /// The device that was asked for.
    pub(super) fn open(&self, global: &Global) -> Result<Device, Failure> {
        self.open_one(global, &mut |line| global.note(line))
    }

    fn open_one(&self, global: &Global, note: &mut dyn FnMut(&str)) -> Result<Device, Failure> {
        self.check()?;
        let options = self.options(global.warner());
        let device = Device::open_noting(&options, note).map_err(super::runtime)?;
        if let (Device::Gpu(gpu), Some(_)) = (&device, self.threads) {
            let name = gpu.info().name;
            note(&format!(
                "note: `--threads` is for the processor, and {name} renders; `--device cpu` chooses the processor"
            ));
        }
        Ok(device)
    }

    /// Fails if the options contradict each other or the choice of several GPUs.
    pub(super) fn check_several(&self, several: Option<&Several>) -> Result<(), Failure> {
        self.check()?;
        if several.is_some() && self.is_cpu() {
            return Err(Failure::Error(
                "`--gpus` chooses GPUs, but `--device cpu` the processor\n  hint: leave out one of the two"
                    .into(),
            ));
        }
        Ok(())
    }

    /// The devices that were asked for: several GPUs, or one device.
    pub(super) fn open_all(
        &self,
        several: Option<&Several>,
        global: &Global,
    ) -> Result<Vec<Device>, Failure> {
        self.open_noting(several, global, &mut |line| global.note(line))
    }

    /// The same, and what there is to say of their choice goes to `note`.
    pub(super) fn open_noting(
        &self,
        several: Option<&Several>,
        global: &Global,
        note: &mut dyn FnMut(&str),
    ) -> Result<Vec<Device>, Failure> {
        let Some(several) = several else {
            return Ok(vec![self.open_one(global, note)?]);
        };
        self.check_several(Some(several))?;
        let gpus = Gpu::several(several, &self.gpu.options(global.warner()), note);
        let gpus = gpus.map_err(super::runtime)?;
        Ok(gpus
            .into_iter()
            .map(|gpu| Device::Gpu(Box::new(gpu)))
            .collect())
    }

    /// A GPU, software or not, for what needs one.
    pub(super) fn open_gpu(&self, what: &'static str, global: &Global) -> Result<Gpu, Failure> {
        self.check()?;
        match self.device {
            Some(Kind::Cpu) => Err(super::runtime(impasto::RuntimeError::NeedsGpu(what))),
            _ => self.gpu.open(what, global),
        }
    }
}

impl GpuArgs {
    fn options(&self, warn: fn(&str)) -> GpuOptions {
        GpuOptions {
            adapter: self.gpu.clone(),
            environment: Environment::of_process(),
            checked: self.checked,
            validate_indirect: self.validate_indirect,
            kernels: cache::folder("kernels").map(|path| KernelFolder { path, warn }),
            ..GpuOptions::default()
        }
    }

    /// The GPU, for what needs one.
    pub(super) fn open(&self, what: &'static str, global: &Global) -> Result<Gpu, Failure> {
        let needed = |error: RuntimeError| {
            Failure::new(format!("{what} needs a GPU: {error}"), error.is_transient())
        };
        let mut note = |line: &str| global.note(line);
        Gpu::new_noting(&self.options(global.warner()), &mut note).map_err(needed)
    }
}

/// As a shell takes it.
fn quoted(text: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || ":.-_".contains(c);
    if text.chars().all(is_plain) {
        text.to_owned()
    } else {
        format!("\"{text}\"")
    }
}

/// What is printed as JSON: the device that would render, and the others.
#[derive(Serialize)]
struct Devices {
    #[serde(flatten)]
    device: DeviceInfo,
    others: Vec<Other>,
}

/// A device that would not render.
#[derive(Serialize)]
struct Other {
    #[serde(flatten)]
    device: DeviceInfo,
    /// The options that choose it.
    options: String,
}

pub(super) fn run(args: &DeviceArgs, global: &Global) -> Outcome {
    let device = args.open(global)?.info();
    let mut others = Device::found();
    let identity = |info: &DeviceInfo| {
        let index = info.ids.as_ref().map(|ids| ids.index);
        (index, info.name.clone(), info.backend.clone())
    };
    let same = |other: &DeviceInfo| identity(other) == identity(&device);
    if let Some(at) = others.iter().position(same) {
        others.remove(at);
    }
    let others = others.into_iter().map(|device| Other {
        options: match &device.ids {
            None => "--device cpu".into(),
            Some(ids) => format!("--gpu {}", quoted(&ids.selector)),
        },
        device,
    });
    let devices = Devices {
        others: others.collect(),
        device,
    };
    if global.json() {
        print(&format!("{:#}\n", serde_json::json!(devices)))
    } else {
        print(&text(&devices))
    }
}

/// The device that would render with all that is known of it, and a line for each of the others.
fn text(devices: &Devices) -> String {
    let mut out = devices.device.to_string();
    if !devices.others.is_empty() {
        out += "other devices, and what chooses them\n";
    }
    for Other { device, options } in &devices.others {
        out += &format!(
            "  {} ({}, {}): {options}\n",
            device.name, device.kind, device.backend
        );
        if let Some(ids) = &device.ids {
            out += &format!(
                "    ids {}; driver {}\n",
                ids.all().join(", "),
                device.driver
            );
        }
    }
    out
}
