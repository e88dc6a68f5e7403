//! The buffers of a render and how kernels bind them.

use crate::error::RuntimeError;
use crate::gpu::Gpu;
use crate::kernels::compose::{Access, OWN_BUFFERS, RUN_MEMBERS};
use crate::kernels::layout::Layout;
use crate::kernels::layout::RAY_BUFFERS;
use crate::kernels::modules::{Composer, Kernel};
use crate::kernels::order;
use crate::kernels::queues::Scalar;
use crate::kernels::random;
use crate::options::RenderOptions;
use crate::world::needs::Need;

/// Every buffer, by the index that kernels bind it at.
#[derive(Clone, Debug)]
pub(crate) struct Resources {
    buffers: Vec<wgpu::Buffer>,
}

/// The buffers whose size depends on a plan's kernels.
const OF_PLAN: [&str; 3] = ["queues", "counters", "arguments"];

/// The indices of the runtime's own buffers that the host touches.
fn own(name: &str) -> usize {
    // Every name given here is in the table, which a test asserts.
    OWN_BUFFERS
        .iter()
        .position(|(n, ..)| *n == name)
        .unwrap_or(0)
}

impl Resources {
    /// Makes the runtime's buffers and uploads the scene's.
    pub(crate) fn new(
        gpu: &Gpu,
        composer: &Composer<'_>,
        options: &RenderOptions,
    ) -> Result<Self, RuntimeError> {
        let mut buffers = Vec::new();
        for (name, _, access) in OWN_BUFFERS {
            buffers.push(own_buffer(gpu, composer, name, access));
        }
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
        let resources = Self { buffers };
        resources.set_run(gpu, options);
        if let Some(pixels) = &options.pixels {
            resources.set_pixels(gpu, pixels);
        }
        Ok(resources)
    }

    /// The buffers of another plan for the same world: its own queues with what belongs to them, and
    /// all else that these have.
    pub(crate) fn for_plan(&self, gpu: &Gpu, composer: &Composer<'_>) -> Self {
        let mut buffers = self.buffers.clone();
        for (buffer, (name, _, access)) in buffers.iter_mut().zip(OWN_BUFFERS) {
            if OF_PLAN.contains(&name) {
                *buffer = own_buffer(gpu, composer, name, access);
            }
        }
        Self { buffers }
    }

    /// Writes the settings that kernels read.
    pub(crate) fn set_run(&self, gpu: &Gpu, options: &RenderOptions) {
        let words = run_words(options);
        let run = &self.buffers[own("run")];
        gpu.queue.write_buffer(run, 0, bytemuck::cast_slice(&words));
    }

    /// Writes which pixels are rendered.
    pub(crate) fn set_pixels(&self, gpu: &Gpu, pixels: &[u32]) {
        let list = &self.buffers[own("pixel_list")];
        gpu.queue
            .write_buffer(list, 0, bytemuck::cast_slice(pixels));
    }

    pub(crate) fn arguments(&self) -> &wgpu::Buffer {
        &self.buffers[own("arguments")]
    }

    /// One of the runtime's own buffers, such as `state`.
    pub(crate) fn buffer(&self, name: &str) -> &wgpu::Buffer {
        &self.buffers[own(name)]
    }

    pub(crate) fn counters(&self) -> &wgpu::Buffer {
        &self.buffers[own("counters")]
    }

    /// Empties pool, counters and film, so that a render starts anew.
    pub(crate) fn clear(&self, gpu: &Gpu) {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        for name in ["state", "counters", "film"] {
            encoder.clear_buffer(&self.buffers[own(name)], 0, None);
        }
        gpu.queue.submit([encoder.finish()]);
    }

    /// Makes the pool take up samples again when every path of a pass is done. What the film
    /// and the other counters hold stays.
    pub(crate) fn begin_pass(&self, gpu: &Gpu, options: &RenderOptions, layout: &Layout) {
        self.set_run(gpu, options);
        for scalar in [Scalar::NextPixel, Scalar::NextSample] {
            let at = layout.counters.index(scalar);
            gpu.queue
                .write_buffer(self.counters(), 4 * at as u64, &[0; 4]);
        }
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.clear_buffer(&self.buffers[own("state")], 0, None);
        gpu.queue.submit([encoder.finish()]);
    }

    /// Puts words into the film.
    pub(crate) fn write_film(&self, gpu: &Gpu, words: &[u32]) {
        let film = &self.buffers[own("film")];
        gpu.queue.write_buffer(film, 0, bytemuck::cast_slice(words));
    }

    /// The words of the film.
    pub(crate) fn read_film(&self, gpu: &Gpu) -> Result<Vec<u32>, RuntimeError> {
        let film = &self.buffers[own("film")];
        let staging = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("film readback"),
            size: film.size(),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(film, 0, &staging, 0, film.size());
        let index = gpu.queue.submit([encoder.finish()]);
        gpu.read(&staging, index, film.size(), |bytes| {
            bytemuck::pod_collect_to_vec(bytes)
        })
    }

    pub(crate) fn bind_group_layout(
        &self,
        gpu: &Gpu,
        kernel: &Kernel,
    ) -> Result<wgpu::BindGroupLayout, RuntimeError> {
        let name = &kernel.recipe.name;
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
            label: Some(&kernel.recipe.name),
            layout,
            entries: &entries,
        })
    }
}

fn own_buffer(gpu: &Gpu, composer: &Composer<'_>, name: &str, access: Access) -> wgpu::Buffer {
    let storage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
    let usage = match access {
        Access::Uniform => wgpu::BufferUsages::UNIFORM,
        _ if name == "arguments" => storage | wgpu::BufferUsages::INDIRECT,
        _ => storage,
    };
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(name),
        size: own_bytes(name, composer).max(16).next_multiple_of(4),
        usage: usage | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

fn own_bytes(name: &str, composer: &Composer<'_>) -> u64 {
    let layout = &composer.layout;
    let pool = u64::from(composer.sizes.pool);
    let queues = layout.counters.queues as u64;
    let pixels = u64::from(composer.world.width) * u64::from(composer.world.height);
    match name {
        "run" => 4 * RUN_MEMBERS.len() as u64,
        "state" => pool * layout.path_bytes(),
        "queues" => 4 * pool * layout.queue_words(),
        "bins" if layout.needs.has(Need::Order) => order::bytes(composer.technique.ray_order),
        "bins" => 0,
        "counters" => 4 * layout.counters.len() as u64,
        "arguments" => 12 * queues,
        "queue_table" if composer.queue_table => 4 * composer.materials.len() as u64,
        "queue_table" => 0,
        // Any choice of pixels fits.
        "pixel_list" if layout.needs.has(Need::SomePixels) => 4 * pixels,
        "pixel_list" => 0,
        name if RAY_BUFFERS.iter().any(|(buffer, ..)| *buffer == name) => {
            pool * layout.ray_bytes(name)
        }
        _ => 4 * pixels * composer.world.outputs.layers.planes() as u64,
    }
}

/// The uniform `run`, member by member.
pub(crate) fn run_words(options: &RenderOptions) -> [u32; RUN_MEMBERS.len()] {
    RUN_MEMBERS.map(|member| match member {
        "seed" => random::hash_seed(options.seed),
        "first_sample" => options.first_sample,
        "samples" => options.samples,
        "pixels" => options
            .pixels
            .as_ref()
            .map_or(0, |pixels| pixels.len() as u32),
        _ => 0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_are_told_a_hashed_seed_the_range_of_samples_and_how_many_pixels() {
        let options = RenderOptions {
            seed: 4,
            first_sample: 5,
            samples: 6,
            pixels: Some([3, 9].into()),
            ..RenderOptions::default()
        };
        assert_eq!(run_words(&options), [random::hash_seed(4), 5, 6, 2, 0]);
        assert_eq!(
            RUN_MEMBERS,
            ["seed", "first_sample", "samples", "pixels", "none"]
        );
    }
}
