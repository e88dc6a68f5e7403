//! Asking Vulkan drivers for the statistics of kernels, by `VK_KHR_pipeline_executable_properties`.
//!
//! A pipeline must be made for being asked, on a device with the extension, and wgpu makes neither. So
//! a second device of the same GPU builds each kernel again, for nothing but the answer; rendering knows
//! nothing of it.
#![allow(unsafe_code)]

use ash::{khr, vk};
use wgpu::hal::api::Vulkan;
use wgpu::naga::back::spv;

use super::KernelStatistics;
use crate::gpu::Gpu;
use crate::kernels::buffers::Access;
use crate::kernels::compose::Binding;

/// A device of its own, on which kernels are built to be asked.
pub(crate) struct Statistics<'g> {
    device: ash::Device,
    executables: khr::pipeline_executable_properties::Device,
    /// The instance that the device is of lives as long as this.
    _gpu: &'g Gpu,
}

impl<'g> Statistics<'g> {
    /// `None` if the driver does not have the extension, or is none of Vulkan.
    pub(crate) fn open(gpu: &'g Gpu) -> Option<Self> {
        // SAFETY: the adapter is looked at while `gpu` holds it, and nothing of it is destroyed.
        let adapter = unsafe { gpu.adapter.as_hal::<Vulkan>() }?;
        let name = khr::pipeline_executable_properties::NAME;
        let capabilities = adapter.physical_device_capabilities();
        if !capabilities.supports_extension(name) {
            return None;
        }
        let instance = adapter.shared_instance().raw_instance();
        let queues = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(0)
            .queue_priorities(&[1.0])];
        let extensions = [name.as_ptr()];
        let mut feature = vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default()
            .pipeline_executable_info(true);
        let descriptor = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_extension_names(&extensions)
            .push_next(&mut feature);
        // SAFETY: the physical device is of this instance; every device has queue family 0, which
        // wgpu itself relies on; the extension is there, and brings the feature with it. What the
        // descriptor points to lives until after the call.
        let device =
            unsafe { instance.create_device(adapter.raw_physical_device(), &descriptor, None) };
        let device = device.ok()?;
        let executables = khr::pipeline_executable_properties::Device::new(instance, &device);
        Some(Self {
            device,
            executables,
            _gpu: gpu,
        })
    }

    /// What the driver says of a kernel; `None` if it cannot be built here.
    pub(crate) fn of(
        &self,
        name: &str,
        wgsl: &str,
        bindings: &[Binding],
    ) -> Option<KernelStatistics> {
        let words = spirv(name, wgsl)?;
        let entries: Vec<_> = bindings.iter().map(descriptor).collect();
        let set = vk::DescriptorSetLayoutCreateInfo::default().bindings(&entries);
        let code = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: the code is valid SPIR-V, which naga wrote of a module that it validated. Every object
        // is of this device, is used before it is destroyed, and destroyed once.
        unsafe {
            let set = self.device.create_descriptor_set_layout(&set, None).ok()?;
            let sets = [set];
            let layout = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
            let layout = self.device.create_pipeline_layout(&layout, None).ok();
            let module = self.device.create_shader_module(&code, None).ok();
            let found = layout
                .zip(module)
                .and_then(|(layout, module)| self.built(layout, module));
            // Destroying nothing is allowed.
            self.device
                .destroy_shader_module(module.unwrap_or_default(), None);
            self.device
                .destroy_pipeline_layout(layout.unwrap_or_default(), None);
            self.device.destroy_descriptor_set_layout(set, None);
            found
        }
    }

    /// Builds a pipeline, asks for it and destroys it.
    ///
    /// # Safety
    /// Layout and module are of this device and fit together; the entry point is `main`.
    unsafe fn built(
        &self,
        layout: vk::PipelineLayout,
        module: vk::ShaderModule,
    ) -> Option<KernelStatistics> {
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(c"main");
        let descriptor = vk::ComputePipelineCreateInfo::default()
            .flags(vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR)
            .stage(stage)
            .layout(layout);
        let cache = vk::PipelineCache::null();
        // SAFETY: as the caller promises; the feature that the flag asks for is enabled.
        let pipelines = unsafe {
            self.device
                .create_compute_pipelines(cache, &[descriptor], None)
        };
        let pipeline = *pipelines.ok()?.first()?;
        let executable = vk::PipelineExecutableInfoKHR::default()
            .pipeline(pipeline)
            .executable_index(0);
        // SAFETY: the pipeline was made to be asked, and a compute pipeline has one executable.
        let statistics = unsafe {
            self.executables
                .get_pipeline_executable_statistics(&executable)
        };
        let found = statistics.ok().map(|all| read(&all));
        // SAFETY: it is not used any more.
        unsafe { self.device.destroy_pipeline(pipeline, None) };
        found
    }
}

impl Drop for Statistics<'_> {
    fn drop(&mut self) {
        // SAFETY: everything that was made of it is destroyed, and it has no work.
        unsafe { self.device.destroy_device(None) };
    }
}

/// The code that renders give the driver, as naga writes it: bindings keep their numbers, and arithmetic may be
/// contracted.
fn spirv(name: &str, wgsl: &str) -> Option<Vec<u32>> {
    let (module, info) = crate::kernels::validate::validate(name, wgsl).ok()?;
    let options = crate::gpu::spirv::options(false);
    let entry = spv::PipelineOptions {
        shader_stage: wgpu::naga::ShaderStage::Compute,
        entry_point: "main".into(),
    };
    spv::write_vec(&module, &info, &options, Some(&entry)).ok()
}

fn descriptor(binding: &Binding) -> vk::DescriptorSetLayoutBinding<'static> {
    let kind = match binding.access {
        Access::Uniform => vk::DescriptorType::UNIFORM_BUFFER,
        Access::Read | Access::ReadWrite => vk::DescriptorType::STORAGE_BUFFER,
    };
    vk::DescriptorSetLayoutBinding::default()
        .binding(binding.index)
        .descriptor_type(kind)
        .descriptor_count(1)
        .stage_flags(vk::ShaderStageFlags::COMPUTE)
}

fn read(all: &[vk::PipelineExecutableStatisticKHR<'_>]) -> KernelStatistics {
    let mut found = KernelStatistics::default();
    for statistic in all {
        let (Ok(name), Some(value)) = (statistic.name_as_c_str(), number(statistic)) else {
            continue;
        };
        let name = name.to_string_lossy().to_lowercase();
        match name.as_str() {
            "register count" | "vgprs" | "registers" => {
                found.registers = u32::try_from(value).ok();
            }
            "binary size" | "code size" => found.binary_bytes = Some(value),
            "stack size" | "scratch size" => found.stack_bytes = Some(value),
            _ => {}
        }
    }
    found
}

fn number(statistic: &vk::PipelineExecutableStatisticKHR<'_>) -> Option<u64> {
    use vk::PipelineExecutableStatisticFormatKHR as Format;
    let value = statistic.value;
    // SAFETY: the format says which of the union's fields was written; all are plain numbers.
    unsafe {
        match statistic.format {
            Format::UINT64 => Some(value.u64),
            Format::INT64 => u64::try_from(value.i64).ok(),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn statistic(name: &str, value: u64) -> vk::PipelineExecutableStatisticKHR<'static> {
        let mut statistic = vk::PipelineExecutableStatisticKHR::default();
        for (to, from) in statistic.name.iter_mut().zip(name.bytes()) {
            *to = from as std::ffi::c_char;
        }
        statistic.format = vk::PipelineExecutableStatisticFormatKHR::UINT64;
        statistic.value.u64 = value;
        statistic
    }

    #[test]
    fn what_drivers_call_things_is_understood() {
        let all = [
            statistic("Register Count", 32),
            statistic("Binary Size", 37_000),
            statistic("Stack Size", 16),
            statistic("Local Memory Size", 1),
        ];
        let expected = KernelStatistics {
            registers: Some(32),
            binary_bytes: Some(37_000),
            stack_bytes: Some(16),
        };
        assert_eq!(read(&all), expected);
        let mut odd = statistic("Register Count", 1);
        odd.format = vk::PipelineExecutableStatisticFormatKHR::FLOAT64;
        assert_eq!(read(&[odd]), KernelStatistics::default());
    }

    #[test]
    fn kernels_become_spirv() {
        let wgsl = "@group(0) @binding(3) var<storage, read_write> a: array<u32>;\n\
                    @compute @workgroup_size(64)\n\
                    fn main(@builtin(global_invocation_id) id: vec3<u32>) { a[id.x] += 1u; }\n";
        let words = spirv("test", wgsl).expect("it is valid");
        assert_eq!(words[0], 0x0723_0203);
        assert_eq!(spirv("test", "fn main() { nonsense }"), None);
    }
}
