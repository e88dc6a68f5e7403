//! Evaluation on a GPU.

use super::kernel::{ROW, Text, WORKGROUP};
use crate::error::RuntimeError;
use crate::gpu::Gpu;

/// What the kernel is called in errors and captures.
const NAME: &str = "evaluate";

/// The kernel's pipeline, with the buffers that it reads beside what is given.
#[derive(Debug)]
pub(super) struct Dispatched {
    gpu: Gpu,
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
    buffers: Vec<wgpu::Buffer>,
    width: usize,
}

impl Dispatched {
    pub(super) fn new(gpu: &Gpu, text: Text) -> Result<Self, RuntimeError> {
        let mut buffers = Vec::new();
        for data in &text.buffers {
            let what = format!("the material's buffer `{}`", data.name);
            gpu.check_binding_size(&what, data.bytes.len() as u64)?;
            buffers.push(uploaded(gpu, data.name, &data.bytes));
        }
        let layout = layout(gpu, 2 + buffers.len() as u32);
        let pipeline = gpu.pipeline(NAME, &text.wgsl, &layout)?;
        gpu.check()?;
        Ok(Self {
            gpu: gpu.clone(),
            layout,
            pipeline,
            buffers,
            width: text.width,
        })
    }

    /// Evaluates what `words` give, into as many numbers as there is room for.
    pub(super) fn run(&self, words: &[u32], out: &mut [f32]) -> Result<(), RuntimeError> {
        let gpu = &self.gpu;
        gpu.check_binding_size("what is given of the items", 4 * words.len() as u64)?;
        let given = uploaded(gpu, "given", bytemuck::cast_slice(words));
        let size = 4 * out.len() as u64;
        let found = buffer(gpu, "found", size, wgpu::BufferUsages::STORAGE);
        let staging = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("found, read back"),
            size: found.size(),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let bound = [&given, &found].into_iter().chain(&self.buffers);
        let entries: Vec<_> = (0..)
            .zip(bound)
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(NAME),
            layout: &self.layout,
            entries: &entries,
        });
        let items = (out.len() / self.width) as u32;
        let groups = items.div_ceil(WORKGROUP);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(groups.min(ROW), groups.div_ceil(ROW), 1);
        drop(pass);
        encoder.copy_buffer_to_buffer(&found, 0, &staging, 0, found.size());
        let index = gpu.queue.submit([encoder.finish()]);
        gpu.read(&staging, index, staging.size(), |bytes| {
            let words = bytes.chunks_exact(4);
            for (number, word) in out.iter_mut().zip(words) {
                *number = bytemuck::pod_read_unaligned(word);
            }
        })
    }
}

fn layout(gpu: &Gpu, buffers: u32) -> wgpu::BindGroupLayout {
    let entry = |binding| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            // The second is what is found.
            ty: wgpu::BufferBindingType::Storage {
                read_only: binding != 1,
            },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    let entries: Vec<_> = (0..buffers).map(entry).collect();
    let descriptor = wgpu::BindGroupLayoutDescriptor {
        label: Some(NAME),
        entries: &entries,
    };
    gpu.device.create_bind_group_layout(&descriptor)
}

fn buffer(gpu: &Gpu, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: size.next_multiple_of(16).max(16),
        usage: usage | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    })
}

fn uploaded(gpu: &Gpu, label: &str, bytes: &[u8]) -> wgpu::Buffer {
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
    let buffer = buffer(gpu, label, bytes.len() as u64, usage);
    let whole = bytes.len() / 4 * 4;
    gpu.queue.write_buffer(&buffer, 0, &bytes[..whole]);
    buffer
}
