//! What a device is and can do, for `impasto info` and for reports.

use serde::Serialize;

use super::USED_FEATURES;

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
    /// The limits that bound pictures and scenes, by their WebGPU names.
    pub limits: Vec<(&'static str, u64)>,
    /// The optional features that are used.
    pub features_used: Vec<String>,
    /// The optional features that would be used but are missing.
    pub features_missing: Vec<String>,
}

impl DeviceInfo {
    /// Of an adapter, which is opened with all limits and used features that it has.
    pub(super) fn new(adapter: &wgpu::Adapter) -> Self {
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
        writeln!(f, "  used     {}", list(&self.features_used))?;
        writeln!(f, "  missing  {}", list(&self.features_missing))?;
        for (name, value) in &self.limits {
            writeln!(f, "  {name} = {value}")?;
        }
        Ok(())
    }
}
