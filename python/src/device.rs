//! Devices, each opened once.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use impasto::cache;
use impasto::runtime::gpu::{Environment, KernelFolder, Selector};
use impasto::{Choice, CpuOptions, Device, DeviceOptions, GpuOptions};

use crate::error::Failure;

/// What is asked for: `None`, `cpu`, `gpu` or what `--gpu` takes; and threads of the processor.
pub(crate) type Wanted = (Option<String>, Option<usize>);

/// Devices that are open, by what was asked for.
static OPEN: Mutex<BTreeMap<Wanted, Arc<Device>>> = Mutex::new(BTreeMap::new());

/// Most devices that are kept open.
const MOST_OPEN: usize = 16;

/// The device that is asked for. A GPU that was lost is not kept: `forget` it.
pub(crate) fn open(wanted: &Wanted) -> Result<Arc<Device>, Failure> {
    let mut open = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(device) = open.get(wanted) {
        return Ok(device.clone());
    }
    let device = Arc::new(Device::open(&options(wanted)?)?);
    if open.len() >= MOST_OPEN {
        open.clear();
    }
    open.insert(wanted.clone(), device.clone());
    Ok(device)
}

/// Opens it anew the next time.
pub(crate) fn forget(wanted: &Wanted) {
    let mut open = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
    open.remove(wanted);
}

/// What a device is asked to do; one that fails is opened anew the next time.
pub(crate) fn with<T>(
    wanted: &Wanted,
    work: impl FnOnce(&Device) -> Result<T, Failure>,
) -> Result<T, Failure> {
    let device = open(wanted)?;
    let done = work(&device);
    if let Err(Failure::Device(_, true)) = &done {
        forget(wanted);
    }
    done
}

fn options((name, threads): &Wanted) -> Result<DeviceOptions, Failure> {
    let gpu = GpuOptions {
        environment: Environment::of_process(),
        // A folder that cannot be written only costs time.
        kernels: cache::folder("kernels").map(|path| KernelFolder { path, warn: |_| () }),
        ..GpuOptions::default()
    };
    let (choice, gpu) = match name.as_deref() {
        None => (Choice::Best, gpu),
        Some("cpu") => (Choice::Cpu, gpu),
        Some("gpu") => (Choice::Gpu, gpu),
        Some(selector) => {
            let adapter: Selector = selector.parse().map_err(Failure::Value)?;
            let adapter = Some(adapter);
            (Choice::Gpu, GpuOptions { adapter, ..gpu })
        }
    };
    if choice == Choice::Gpu && threads.is_some() {
        return Err(Failure::Value(
            "`threads` are those of the processor, and `device` chooses a GPU".into(),
        ));
    }
    // Whoever says how many threads means the processor.
    let choice = match threads {
        Some(_) => Choice::Cpu,
        None => choice,
    };
    Ok(DeviceOptions {
        choice,
        gpu,
        cpu: CpuOptions {
            threads: *threads,
            ..CpuOptions::default()
        },
    })
}
