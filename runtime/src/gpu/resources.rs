//! The buffers of a render and how kernels bind them.

use std::sync::{Arc, Mutex, PoisonError};

use rayon::prelude::*;

use crate::error::RuntimeError;
use crate::gpu::Gpu;
use crate::kernels::buffers::{Access, BUFFERS, Buffer, BufferId, Cleared, Owner, Reader};
use crate::kernels::camera;
use crate::kernels::layout::PlanLayout;
use crate::kernels::modules::{Composer, Kernel};
use crate::kernels::queues::Scalar;
use crate::kernels::run;
use crate::options::RenderOptions;

/// Every buffer, by the index that kernels bind it at.
#[derive(Clone, Debug)]
pub(crate) struct Resources {
    buffers: Vec<wgpu::Buffer>,
    /// What the film is read through, once it was: whoever looks at it often does not wait for memory each time.
    staging: Arc<Mutex<Option<wgpu::Buffer>>>,
}

impl Resources {
    /// Makes the runtime's buffers and uploads the scene's.
    pub(crate) fn new(
        gpu: &Gpu,
        composer: &Composer<'_>,
        options: &RenderOptions,
    ) -> Result<Self, RuntimeError> {
        let own = BUFFERS
            .iter()
            .map(|buffer| own_buffer(gpu, composer, buffer));
        let mut buffers: Vec<wgpu::Buffer> = own.collect();
        for data in composer.scene_buffers() {
            // A binding cannot be empty; what is not there is never read.
            let size = (data.bytes.len() as u64).next_multiple_of(16).max(16);
            gpu.check_binding_size(&format!("the scene's buffer `{}`", data.name), size)?;
            let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(data.name),
                size,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            let mut bytes = data.bytes.to_vec();
            bytes.resize(size as usize, 0);
            gpu.queue.write_buffer(&buffer, 0, &bytes);
            buffers.push(buffer);
        }
        gpu.check()?;
        let resources = Self {
            buffers,
            staging: Arc::default(),
        };
        resources.set_run(gpu, options);
        resources.set_camera(gpu, &composer.camera());
        if let Some(pixels) = &options.pixels {
            resources.set_pixels(gpu, pixels);
        }
        Ok(resources)
    }

    /// The buffers of another plan for the same world: its own queues with what belongs to them, and
    /// all else that these have.
    pub(crate) fn for_plan(&self, gpu: &Gpu, composer: &Composer<'_>) -> Self {
        let mut buffers = self.buffers.clone();
        for (buffer, row) in buffers.iter_mut().zip(&BUFFERS) {
            if row.owner == Owner::Plan {
                *buffer = own_buffer(gpu, composer, row);
            }
        }
        Self {
            buffers,
            staging: self.staging.clone(),
        }
    }

    /// Writes the settings that kernels read.
    pub(crate) fn set_run(&self, gpu: &Gpu, options: &RenderOptions) {
        let words = run::words(options);
        let buffer = self.buffer(BufferId::Run);
        gpu.queue
            .write_buffer(buffer, 0, bytemuck::cast_slice(&words));
    }

    /// Writes from where the picture is seen.
    pub(crate) fn set_camera(&self, gpu: &Gpu, words: &camera::Words) {
        let buffer = self.buffer(BufferId::Camera);
        gpu.queue
            .write_buffer(buffer, 0, bytemuck::cast_slice(words));
    }

    /// Writes the scene's buffer at a place among those of its parts and tables.
    pub(crate) fn set_scene_buffer(&self, gpu: &Gpu, place: usize, bytes: &[u8]) {
        let Some(buffer) = self.buffers.get(BUFFERS.len() + place) else {
            return;
        };
        let mut bytes = bytes.to_vec();
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        gpu.queue.write_buffer(buffer, 0, &bytes);
    }

    /// Writes which pixels are rendered.
    pub(crate) fn set_pixels(&self, gpu: &Gpu, pixels: &[u32]) {
        let list = self.buffer(BufferId::PixelList);
        gpu.queue
            .write_buffer(list, 0, bytemuck::cast_slice(pixels));
    }

    pub(crate) fn arguments(&self) -> &wgpu::Buffer {
        self.buffer(BufferId::Arguments)
    }

    /// One of the runtime's own buffers.
    pub(crate) fn buffer(&self, id: BufferId) -> &wgpu::Buffer {
        &self.buffers[id.index()]
    }

    pub(crate) fn counters(&self) -> &wgpu::Buffer {
        self.buffer(BufferId::Counters)
    }

    /// Empties pool, counters and film, so that a render starts anew.
    pub(crate) fn clear(&self, gpu: &Gpu) {
        self.clear_those(gpu, |cleared| cleared >= Cleared::ByRender);
    }

    fn clear_those(&self, gpu: &Gpu, some: impl Fn(Cleared) -> bool) {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        for row in BUFFERS.iter().filter(|row| some(row.cleared)) {
            encoder.clear_buffer(self.buffer(row.id), 0, None);
        }
        gpu.queue.submit([encoder.finish()]);
    }

    /// Makes the pool take up samples again when every path of a pass is done. What the film
    /// and the other counters hold stays.
    pub(crate) fn begin_pass(&self, gpu: &Gpu, options: &RenderOptions, layout: &PlanLayout) {
        self.set_run(gpu, options);
        for scalar in [Scalar::NextPixel, Scalar::NextSample] {
            let at = layout.counters.index(scalar);
            gpu.queue
                .write_buffer(self.counters(), 4 * at as u64, &[0; 4]);
        }
        self.clear_those(gpu, |cleared| cleared == Cleared::ByPass);
    }

    /// Puts words into the film.
    pub(crate) fn write_film(&self, gpu: &Gpu, words: &[u32]) {
        let film = self.buffer(BufferId::Film);
        gpu.queue.write_buffer(film, 0, bytemuck::cast_slice(words));
    }

    /// Empties the film alone.
    pub(crate) fn clear_film(&self, gpu: &Gpu) {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.clear_buffer(self.buffer(BufferId::Film), 0, None);
        gpu.queue.submit([encoder.finish()]);
    }

    /// The words of the film.
    pub(crate) fn read_film(&self, gpu: &Gpu) -> Result<Vec<u32>, RuntimeError> {
        let film = self.buffer(BufferId::Film);
        let mut kept = self.staging.lock().unwrap_or_else(PoisonError::into_inner);
        // One that could not be read is not used again.
        let staging = kept.take().unwrap_or_else(|| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("film readback"),
                size: film.size(),
                usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        });
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(film, 0, &staging, 0, film.size());
        let index = gpu.queue.submit([encoder.finish()]);
        let words = gpu.read(&staging, index, film.size(), words_of)?;
        *kept = Some(staging);
        Ok(words)
    }

    pub(crate) fn bind_group_layout(
        &self,
        gpu: &Gpu,
        kernel: &Kernel,
    ) -> Result<wgpu::BindGroupLayout, RuntimeError> {
        let name = &kernel.desc.name;
        let storage = kernel
            .bindings
            .iter()
            .filter(|b| b.access != Access::Uniform);
        let needs = storage.count() as u64;
        let has = gpu.device.limits().max_storage_buffers_per_shader_stage;
        if needs > u64::from(has) {
            return Err(RuntimeError::LimitTooSmall {
                limit: "max_storage_buffers_per_shader_stage",
                has: has.into(),
                needs,
                what: format!("the kernel `{name}` (in buffers)"),
                hint: "use a plan with smaller kernels (`--strategy wavefront`), or another GPU",
            });
        }
        let entries: Vec<_> = kernel
            .bindings
            .iter()
            .map(|binding| wgpu::BindGroupLayoutEntry {
                binding: binding.index,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer {
                    ty: match binding.access {
                        Access::Uniform => wgpu::BufferBindingType::Uniform,
                        access => wgpu::BufferBindingType::Storage {
                            read_only: access == Access::Read,
                        },
                    },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            })
            .collect();
        let descriptor = wgpu::BindGroupLayoutDescriptor {
            label: Some(name),
            entries: &entries,
        };
        Ok(gpu.device.create_bind_group_layout(&descriptor))
    }

    pub(crate) fn bind_group(
        &self,
        gpu: &Gpu,
        kernel: &Kernel,
        layout: &wgpu::BindGroupLayout,
    ) -> wgpu::BindGroup {
        let entry = |index: u32| {
            let buffer = self.buffers.get(index as usize)?;
            Some(wgpu::BindGroupEntry {
                binding: index,
                resource: buffer.as_entire_binding(),
            })
        };
        let entries: Vec<_> = kernel
            .bindings
            .iter()
            .filter_map(|b| entry(b.index))
            .collect();
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(&kernel.desc.name),
            layout,
            entries: &entries,
        })
    }
}

fn own_buffer(gpu: &Gpu, composer: &Composer<'_>, buffer: &Buffer) -> wgpu::Buffer {
    let storage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
    let kernels = match buffer.access {
        Access::Uniform => wgpu::BufferUsages::UNIFORM,
        Access::Read | Access::ReadWrite => storage,
    };
    let others = match buffer.reader {
        Reader::Host => wgpu::BufferUsages::empty(),
        Reader::Dispatches => wgpu::BufferUsages::INDIRECT,
    };
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(buffer.name),
        // A binding cannot be empty; what a plan does without is never bound.
        size: buffer.bytes(composer).max(16).next_multiple_of(4),
        usage: kernels | others | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// Bytes that a thread takes at a time, at least: whole pages of a processor.
const AT_ONCE: usize = 1 << 16;

/// Words of a mapped buffer. New memory costs more to take than to fill, so threads take it together.
fn words_of(bytes: &[u8]) -> Vec<u32> {
    let pieces = bytes.par_chunks_exact(4).with_min_len(AT_ONCE / 4);
    let word = |piece: &[u8]| piece.try_into().map_or(0, u32::from_ne_bytes);
    pieces.map(word).collect()
}
