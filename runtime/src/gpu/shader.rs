//! From WGSL text to a pipeline: validation first, so that no defect of code generation reaches a driver.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

use naga::valid::ModuleInfo;
use wgpu::naga;

use super::kept::{Built, Kept, Key};
use super::{Gpu, spirv};
use crate::error::RuntimeError;
use crate::kernels::validate::validate;
use crate::world::bvh;

/// Pipelines of kernels that were built before, by their text, which also says what they bind: what is
/// rendered again with another seed or number of samples is not compiled again.
#[derive(Debug, Default)]
pub(crate) struct Pipelines(Mutex<HashMap<String, wgpu::ComputePipeline>>);

/// Most pipelines that are kept; beyond it all are forgotten.
const MOST_KEPT: usize = 256;

impl Pipelines {
    fn locked(&self) -> MutexGuard<'_, HashMap<String, wgpu::ComputePipeline>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn get(&self, wgsl: &str) -> Option<wgpu::ComputePipeline> {
        self.locked().get(wgsl).cloned()
    }

    fn keep(&self, wgsl: &str, pipeline: &wgpu::ComputePipeline) {
        let mut kept = self.locked();
        if kept.len() >= MOST_KEPT {
            kept.clear();
        }
        kept.insert(wgsl.to_owned(), pipeline.clone());
    }
}

/// A kernel that is to become a pipeline.
#[derive(Clone, Copy)]
struct Wanted<'a> {
    kernel: &'a str,
    layout: &'a wgpu::BindGroupLayout,
    /// Does workgroup memory begin as zeros?
    zero_workgroup: bool,
}

impl Gpu {
    /// The pipeline of one kernel, whose entry point is `main`. What wgpu has to say against it comes
    /// through [`Gpu::check`].
    pub(crate) fn pipeline(
        &self,
        kernel: &str,
        wgsl: &str,
        layout: &wgpu::BindGroupLayout,
    ) -> Result<wgpu::ComputePipeline, RuntimeError> {
        if let Some(known) = self.pipelines.get(wgsl) {
            return Ok(known);
        }
        let wanted = Wanted {
            kernel,
            layout,
            zero_workgroup: self.checked || !bvh::shares_stack(wgsl),
        };
        let way = u8::from(self.checked);
        let kept = self.kept.as_deref().filter(|_| self.takes_spirv());
        let kept = kept.map(|kept| (kept, kept.key(wgsl, way)));
        if let Some(pipeline) = kept.and_then(|(kept, key)| self.built_before(wanted, kept, key)) {
            self.pipelines.keep(wgsl, &pipeline);
            return Ok(pipeline);
        }
        let (module, info) = validate(kernel, wgsl)?;
        let build = || Ok(self.build_pipeline(wanted, (&module, &info), kept));
        Ok(match self.guarded(build) {
            Ok(pipeline) => {
                self.pipelines.keep(wgsl, &pipeline);
                pipeline
            }
            // Once more, so that whoever listens hears of it.
            Err(_) => self.build_pipeline(wanted, (&module, &info), None),
        })
    }

    /// The pipeline of what an earlier start has built, if that is there and the driver takes it.
    fn built_before(
        &self,
        wanted: Wanted<'_>,
        kept: &Kept,
        key: Key,
    ) -> Option<wgpu::ComputePipeline> {
        let built = kept.load(key)?;
        let build = || {
            let module = self.passthrough(wanted.kernel, built.workgroup, &built.module);
            let cache = self.cache(&built.binary);
            Ok((self.of_module(wanted, &module, cache.as_ref()), cache))
        };
        let (pipeline, cache) = self.guarded(build).ok()?;
        // Another driver makes something else of the module.
        let binary = cache.and_then(|cache| cache.get_data());
        if let Some(binary) = binary.filter(|binary| *binary != built.binary) {
            kept.store(key, &Built { binary, ..built });
        }
        Some(pipeline)
    }

    fn build_pipeline(
        &self,
        wanted: Wanted<'_>,
        (module, info): (&naga::Module, &ModuleInfo),
        kept: Option<(&Kept, Key)>,
    ) -> wgpu::ComputePipeline {
        let written = self.uncontracted((module, info), wanted.zero_workgroup);
        let Some((workgroup, words)) = written else {
            let module = self.shader_module(wanted.kernel, module);
            return self.of_module(wanted, &module, None);
        };
        let module = self.passthrough(wanted.kernel, workgroup, &words);
        let cache = kept.and_then(|_| self.cache(&[]));
        let pipeline = self.of_module(wanted, &module, cache.as_ref());
        if let Some((kept, key)) = kept {
            let binary = cache.and_then(|cache| cache.get_data());
            let built = Built {
                workgroup,
                module: words,
                binary: binary.unwrap_or_default(),
            };
            kept.store(key, &built);
        }
        pipeline
    }

    fn of_module(
        &self,
        wanted: Wanted<'_>,
        module: &wgpu::ShaderModule,
        cache: Option<&wgpu::PipelineCache>,
    ) -> wgpu::ComputePipeline {
        let compilation_options = wgpu::PipelineCompilationOptions {
            zero_initialize_workgroup_memory: wanted.zero_workgroup,
            ..Default::default()
        };
        let layout = self
            .device
            .create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(wanted.kernel),
                bind_group_layouts: &[Some(wanted.layout)],
                immediate_size: 0,
            });
        self.device
            .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(wanted.kernel),
                layout: Some(&layout),
                module,
                entry_point: Some("main"),
                compilation_options,
                cache,
            })
    }

    /// What a driver made of a kernel before, for it to take up; nothing where it tells nothing.
    #[allow(unsafe_code)]
    fn cache(&self, binary: &[u8]) -> Option<wgpu::PipelineCache> {
        let features = self.device.features();
        if !features.contains(wgpu::Features::PIPELINE_CACHE) {
            return None;
        }
        let descriptor = wgpu::PipelineCacheDescriptor {
            label: None,
            data: Some(binary).filter(|binary| !binary.is_empty()),
            // What another driver wrote is left out.
            fallback: true,
        };
        // SAFETY: the bytes are what `get_data` gave, by a fingerprint.
        Some(unsafe { self.device.create_pipeline_cache(&descriptor) })
    }

    /// Does the GPU take modules as they are written here?
    fn takes_spirv(&self) -> bool {
        let features = self.device.features();
        features.contains(wgpu::Features::PASSTHROUGH_SHADERS)
            && self.adapter.get_info().backend == wgpu::Backend::Vulkan
    }

    /// The module whose arithmetic is rounded as it is written, where the GPU takes one, and the size of its workgroups.
    fn uncontracted(
        &self,
        (module, info): (&naga::Module, &ModuleInfo),
        zero_workgroup: bool,
    ) -> Option<([u32; 3], Vec<u32>)> {
        if !self.takes_spirv() {
            return None;
        }
        let kind = spirv::Kind {
            checked: self.checked,
            zero_workgroup,
        };
        let words = spirv::write(module, info, kind, &bvh::is_traversal).ok()?;
        let entry = module.entry_points.first()?;
        Some((entry.workgroup_size, words))
    }

    #[allow(unsafe_code)]
    fn passthrough(&self, kernel: &str, [x, y, z]: [u32; 3], words: &[u32]) -> wgpu::ShaderModule {
        let descriptor = wgpu::ShaderModuleDescriptorPassthrough {
            label: Some(kernel),
            entry_points: Cow::Owned(vec![wgpu::PassthroughShaderEntryPoint {
                name: "main".into(),
                workgroup_size: (x, y, z),
            }]),
            spirv: Some(Cow::Borrowed(words)),
            ..Default::default()
        };
        // SAFETY: naga wrote the module, of text that it validated, and what was added are decorations of results; one that
        // an earlier start has kept is the same by its fingerprint. Why checks are left out is said below.
        unsafe { self.device.create_shader_module_passthrough(descriptor) }
    }

    /// Of what was parsed to be validated: wgpu would parse the text again, which takes longer than to
    /// copy the module.
    #[allow(unsafe_code)]
    fn shader_module(&self, kernel: &str, module: &naga::Module) -> wgpu::ShaderModule {
        let descriptor = wgpu::ShaderModuleDescriptor {
            label: Some(kernel),
            source: wgpu::ShaderSource::Naga(Cow::Owned(module.clone())),
        };
        if self.checked {
            return self.device.create_shader_module(descriptor);
        }
        let checks = wgpu::ShaderRuntimeChecks::unchecked();
        // SAFETY: the text is generated, not the user's. Its indices are slots and items that
        // are compared with the pool's size, primitives from the hierarchy that was built
        // over them, and pixels of a path that was begun inside the picture. Loops are bounded:
        // the language demands a bound of every loop and traversal descends a finite tree.
        // Divisors are constants or guarded.
        unsafe { self.device.create_shader_module_trusted(descriptor, checks) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::GpuOptions;

    /// A product and a sum, each rounded: 1 + 2^-12 squared is a tie between 1 + 2^-11 and its neighbour, so that a sum
    /// that took the product unrounded would be 2^-24 off. And a sum that a difference does not undo.
    const WGSL: &str = "
        @group(0) @binding(3) var<storage, read_write> values: array<f32>;
        @group(0) @binding(7) var<storage, read> factors: array<f32>;
        fn scaled(x: f32, y: f32, z: f32) -> f32 {
            return x * y + z;
        }
        fn absorbed(x: f32, y: f32) -> f32 {
            return (x + y) - x;
        }
        @compute @workgroup_size(4)
        fn main(@builtin(global_invocation_id) id: vec3<u32>) {
            let x = factors[id.x];
            if id.x % 2u == 0u {
                values[id.x] = scaled(x, x, -(1.0 + 0.00048828125));
            } else {
                values[id.x] = absorbed(x, x * 1e-9);
            }
        }";

    #[test]
    fn arithmetic_is_rounded_as_it_is_written() {
        for checked in [false, true] {
            let gpu = Gpu::new(&GpuOptions {
                checked,
                ..GpuOptions::default()
            })
            .unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(computed(&gpu, 1.0 + 1.0 / 4096.0), [0.0; 4], "{checked}");
            // And bindings are where they should be.
            let product = 4.0 - 1.000_488_3;
            assert_eq!(computed(&gpu, 2.0), [product, 0.0, product, 0.0]);
        }
    }

    /// What the kernel makes of four equal factors.
    fn computed(gpu: &Gpu, factor: f32) -> [f32; 4] {
        let storage = |binding, read_only| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage { read_only },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let layout = gpu
            .device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: None,
                entries: &[storage(7, true), storage(3, false)],
            });
        let pipeline = gpu
            .pipeline("test", WGSL, &layout)
            .unwrap_or_else(|e| panic!("{e}"));
        let buffer = |usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: 16,
                usage,
                mapped_at_creation: false,
            })
        };
        let storage = wgpu::BufferUsages::STORAGE;
        let values = buffer(storage | wgpu::BufferUsages::COPY_SRC);
        let factors = buffer(storage | wgpu::BufferUsages::COPY_DST);
        let read = buffer(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
        gpu.queue
            .write_buffer(&factors, 0, bytemuck::cast_slice(&[factor; 4]));
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &layout,
            entries: &[entry(3, &values), entry(7, &factors)],
        });
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(1, 1, 1);
        drop(pass);
        encoder.copy_buffer_to_buffer(&values, 0, &read, 0, 16);
        let index = gpu.queue.submit([encoder.finish()]);
        let take = |bytes: &[u8]| bytemuck::pod_read_unaligned(bytes);
        gpu.read(&read, index, 16, take)
            .unwrap_or_else(|e| panic!("{e}"))
    }

    fn entry(binding: u32, buffer: &wgpu::Buffer) -> wgpu::BindGroupEntry<'_> {
        wgpu::BindGroupEntry {
            binding,
            resource: buffer.as_entire_binding(),
        }
    }
}
