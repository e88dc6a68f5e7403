//! From WGSL text to a pipeline: validation first, so that no defect of code generation reaches a driver.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

use wgpu::naga;

use super::Gpu;
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
        let (module, _) = validate(kernel, wgsl)?;
        let build = || Ok(self.build_pipeline(kernel, wgsl, &module, layout));
        Ok(match self.guarded(build) {
            Ok(pipeline) => {
                self.pipelines.keep(wgsl, &pipeline);
                pipeline
            }
            // Once more, so that whoever listens hears of it.
            Err(_) => self.build_pipeline(kernel, wgsl, &module, layout),
        })
    }

    fn build_pipeline(
        &self,
        kernel: &str,
        wgsl: &str,
        module: &naga::Module,
        layout: &wgpu::BindGroupLayout,
    ) -> wgpu::ComputePipeline {
        let module = self.shader_module(kernel, module);
        let compilation_options = wgpu::PipelineCompilationOptions {
            zero_initialize_workgroup_memory: self.checked || !bvh::shares_stack(wgsl),
            ..Default::default()
        };
        let layout = self
            .device
            .create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(kernel),
                bind_group_layouts: &[Some(layout)],
                immediate_size: 0,
            });
        self.device
            .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(kernel),
                layout: Some(&layout),
                module: &module,
                entry_point: Some("main"),
                compilation_options,
                cache: None,
            })
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
