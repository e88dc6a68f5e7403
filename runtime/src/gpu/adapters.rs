//! The adapters of this machine, and the one that renders: what drivers tell of each, put into the terms in which one
//! is chosen (`selection`).

use std::path::Path;

use super::selection::{Chosen, Described, PciAddress, Several, select, select_all};
use super::{DeviceIds, GpuOptions, memory, nvidia, selection};
use crate::error::RuntimeError;

/// The number by which devices say that they are NVIDIA's.
const NVIDIA: u32 = 0x10de;

/// All adapters of a machine, and what is known of each.
pub(super) struct Adapters {
    found: Vec<wgpu::Adapter>,
    described: Vec<Described>,
}

/// An adapter that was found.
#[derive(Clone, Debug)]
pub(super) struct Found {
    pub(super) adapter: wgpu::Adapter,
    pub(super) ids: DeviceIds,
}

impl Adapters {
    /// The most capable kind first; equal kinds in the driver's order.
    pub(super) fn of_machine(validate_indirect: bool) -> Self {
        let found = adapters(validate_indirect);
        let cards = nvidia::cards(Path::new(nvidia::ROOT));
        let described = found.iter().map(|adapter| described(adapter, &cards));
        Self {
            described: described.collect(),
            found,
        }
    }

    /// All of them.
    pub(super) fn all(self) -> Vec<Found> {
        let ids = selection::ids(&self.described);
        let pairs = self.found.into_iter().zip(ids);
        pairs.map(|(adapter, ids)| Found { adapter, ids }).collect()
    }

    /// The one that renders; `None` if none was asked for, and there is none but software.
    pub(super) fn choose(
        &self,
        options: &GpuOptions,
        note: &mut dyn FnMut(&str),
    ) -> Result<Option<Found>, RuntimeError> {
        let selector = options.adapter.as_ref();
        let Chosen { adapters, notes } = select(selector, &options.environment, &self.described)?;
        notes.iter().for_each(|line| note(line));
        Ok(adapters.first().and_then(|place| self.at(*place)))
    }

    /// Those that render together.
    pub(super) fn choose_several(
        &self,
        several: &Several,
        options: &GpuOptions,
        note: &mut dyn FnMut(&str),
    ) -> Result<Vec<Found>, RuntimeError> {
        let Chosen { adapters, notes } =
            select_all(several, &options.environment, &self.described)?;
        notes.iter().for_each(|line| note(line));
        Ok(adapters
            .into_iter()
            .filter_map(|place| self.at(place))
            .collect())
    }

    /// The first driver in software.
    pub(super) fn software(&self) -> Option<Found> {
        let is_software = |d: &Described| d.rank >= Described::SOFTWARE;
        self.at(self.described.iter().position(is_software)?)
    }

    fn at(&self, place: usize) -> Option<Found> {
        Some(Found {
            adapter: self.found.get(place)?.clone(),
            ids: selection::ids(&self.described).get(place)?.clone(),
        })
    }
}

fn described(adapter: &wgpu::Adapter, cards: &[nvidia::Card]) -> Described {
    let info = adapter.get_info();
    let pci = PciAddress::parse(&info.device_pci_bus_id);
    let card = pci.and_then(|pci| cards.iter().find(|card| card.pci == pci));
    let is_nvidia = info.vendor == NVIDIA;
    let uuid = card.and_then(|card| card.uuid.clone());
    Described {
        rank: rank(info.device_type),
        is_nvidia,
        pci,
        minor: card.and_then(|card| card.minor),
        // Vulkan's is the same for these GPUs; in a container the files may be missing.
        uuid: uuid.or_else(|| memory::uuid(adapter).filter(|_| is_nvidia)),
        name: info.name,
        backend: info.backend.to_string(),
    }
}

fn rank(kind: wgpu::DeviceType) -> u8 {
    match kind {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => Described::SOFTWARE,
    }
}

fn adapters(validate_indirect: bool) -> Vec<wgpu::Adapter> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    // No debug layers unless the environment asks for them (`WGPU_VALIDATION`, `WGPU_DEBUG`),
    // and no validation of indirect arguments unless it is asked for: those come from the prepare
    // kernels alone, which divide a queue's length, at most the pool, into rows within the
    // limits, and checking them again costs more than the dispatch itself.
    descriptor.flags = wgpu::InstanceFlags::ALLOW_UNDERLYING_NONCOMPLIANT_ADAPTER.with_env();
    if validate_indirect {
        descriptor.flags |= wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL;
    }
    let instance = wgpu::Instance::new(descriptor);
    let mut adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    adapters.sort_by_key(|adapter| rank(adapter.get_info().device_type));
    adapters
}
