//! What a device is and can do, for `impasto info` and for reports.

use serde::Serialize;

use super::{USED_FEATURES, memory};

/// A device's identity and what Impasto uses of it. Sizes are in bytes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct DeviceInfo {
    /// The name of the adapter or processor, such as `NVIDIA H200`.
    pub name: String,
    /// The interface it is reached through: vulkan, metal, dx12, or native.
    pub backend: String,
    /// The driver's name and version, or what makes native code.
    pub driver: String,
    /// Discrete, integrated, virtual, software, processor or other.
    pub kind: &'static str,
    /// What chooses it; `None` for the processor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ids: Option<DeviceIds>,
    /// Bytes of memory that it has for itself, where it does and its driver tells.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory_bytes: Option<u64>,
    /// The limits that bound pictures and scenes, by their WebGPU names.
    pub limits: Vec<(&'static str, u64)>,
    /// The optional features that are used.
    pub features_used: Vec<String>,
    /// The optional features that would be used but are missing.
    pub features_missing: Vec<String>,
}

/// What tells a GPU from the others of its machine, as far as it is known.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct DeviceIds {
    /// Its number in the order of PCI addresses, from 0; devices without an address come last.
    pub index: usize,
    /// Its place on the PCI bus, such as `0000:00:06.0`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pci: Option<String>,
    /// The number of its device file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub minor: Option<u32>,
    /// Its UUID, as NVIDIA's tools print it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uuid: Option<String>,
    /// A [`Selector`](super::Selector) of it alone: its name, or what is unique where others have that name too.
    pub selector: String,
}

impl DeviceIds {
    /// What chooses it whatever the others are called: its PCI address, or else its index.
    pub fn id(&self) -> String {
        let pci = self.pci.as_ref().map(|pci| format!("pci:{pci}"));
        pci.unwrap_or_else(|| self.index.to_string())
    }

    /// Every way to choose it but by its name.
    pub fn all(&self) -> Vec<String> {
        let prefixed = |prefix: &str, id: Option<&String>| id.map(|id| format!("{prefix}:{id}"));
        let minor = self.minor.map(|minor| minor.to_string());
        let known = [
            Some(self.index.to_string()),
            prefixed("pci", self.pci.as_ref()),
            prefixed("minor", minor.as_ref()),
            prefixed("uuid", self.uuid.as_ref()),
        ];
        known.into_iter().flatten().collect()
    }
}

impl DeviceInfo {
    /// Of an adapter, which is opened with all limits and used features that it has.
    pub(super) fn new(adapter: &wgpu::Adapter, ids: DeviceIds) -> Self {
        let info = adapter.get_info();
        let limits = adapter.limits();
        let used = adapter.features() & USED_FEATURES;
        Self {
            name: info.name,
            backend: info.backend.to_string(),
            driver: [info.driver, info.driver_info].join(" ").trim().to_string(),
            kind: match info.device_type {
                wgpu::DeviceType::DiscreteGpu => "discrete",
                wgpu::DeviceType::IntegratedGpu => "integrated",
                wgpu::DeviceType::VirtualGpu => "virtual",
                wgpu::DeviceType::Cpu => "software",
                wgpu::DeviceType::Other => "other",
            },
            ids: Some(ids),
            memory_bytes: memory::bytes(adapter),
            limits: vec![
                ("max_buffer_size", limits.max_buffer_size),
                (
                    "max_storage_buffer_binding_size",
                    limits.max_storage_buffer_binding_size,
                ),
                (
                    "max_storage_buffers_per_shader_stage",
                    limits.max_storage_buffers_per_shader_stage.into(),
                ),
                (
                    "max_compute_workgroups_per_dimension",
                    limits.max_compute_workgroups_per_dimension.into(),
                ),
                (
                    "max_compute_invocations_per_workgroup",
                    limits.max_compute_invocations_per_workgroup.into(),
                ),
            ],
            features_used: names(used),
            features_missing: names(USED_FEATURES.difference(used)),
        }
    }
}

fn names(features: wgpu::Features) -> Vec<String> {
    features
        .iter_names()
        .map(|(name, _)| name.to_lowercase())
        .collect()
}

impl std::fmt::Display for DeviceInfo {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let list = |names: &[String]| match names {
            [] => "none".to_string(),
            names => names.join(", "),
        };
        writeln!(f, "{} ({}, {})", self.name, self.kind, self.backend)?;
        writeln!(f, "  driver   {}", self.driver)?;
        if let Some(ids) = &self.ids {
            writeln!(f, "  ids      {}", ids.all().join(", "))?;
        }
        if let Some(bytes) = self.memory_bytes {
            writeln!(f, "  memory   {:.1} GiB", bytes as f64 / f64::from(1 << 30))?;
        }
        writeln!(f, "  used     {}", list(&self.features_used))?;
        writeln!(f, "  missing  {}", list(&self.features_missing))?;
        for (name, value) in &self.limits {
            writeln!(f, "  {name} = {value}")?;
        }
        Ok(())
    }
}
