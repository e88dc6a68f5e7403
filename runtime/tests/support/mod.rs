//! Runs pieces of WGSL on the first Vulkan device, so that tests see what kernels compute.
//!
//! There is no skipping: a machine without a driver fails, since a test that does not run says
//! nothing. Debian's `mesa-vulkan-drivers` brings a software device.
#![allow(dead_code)] // each test binary uses its part

pub(crate) mod light_scenes;
pub(crate) mod points;
pub(crate) mod worlds;

use std::collections::BTreeMap;
use std::sync::{Mutex, OnceLock, PoisonError};

use impasto_runtime::wgsl::ShaderPart;
use wgpu::util::DeviceExt;

/// One word of input or output of [`run`].
pub(crate) type Row = [u32; 4];

const WORKGROUP: usize = 64;

struct Gpu {
    device: wgpu::Device,
    queue: wgpu::Queue,
}

fn gpu() -> &'static Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    GPU.get_or_init(|| pollster::block_on(open()))
}

async fn open() -> Gpu {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let options = wgpu::RequestAdapterOptions::default();
    let adapter = instance.request_adapter(&options).await;
    let adapter = adapter.expect("these tests need a Vulkan device (mesa-vulkan-drivers will do)");
    let descriptor = wgpu::DeviceDescriptor {
        required_limits: adapter.limits(),
        ..Default::default()
    };
    let opened = adapter.request_device(&descriptor).await;
    let (device, queue) = opened.expect("the device opens");
    Gpu { device, queue }
}

/// Evaluates `body`, the WGSL body of `fn evaluate(i: u32)`, for every `i < count`.
///
/// It reads `input: array<vec4<u32>>` and writes `result: array<vec4<u32>>` of `rows` rows.
pub(crate) fn run(
    parts: &[&ShaderPart],
    body: &str,
    input: &[Row],
    count: usize,
    rows: usize,
) -> Vec<Row> {
    let gpu = gpu();
    let code = assemble(parts, body, count);
    let pipeline = pipeline(gpu, code);

    let size = (rows * size_of::<Row>()) as u64;
    let result = buffer(
        gpu,
        size,
        wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
    );
    let mapped = buffer(
        gpu,
        size,
        wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
    );
    let mut bound = vec![storage(gpu, bytemuck::cast_slice(input)), result.clone()];
    let scene_buffers = parts.iter().flat_map(|p| &p.buffers);
    bound.extend(scene_buffers.map(|b| storage(gpu, &b.bytes)));
    let bindings: Vec<_> = bound.iter().enumerate().map(bind_entry).collect();
    let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &bindings,
    });

    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.dispatch_workgroups(count.div_ceil(WORKGROUP).min(65_535) as u32, 1, 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&result, 0, &mapped, 0, size);
    gpu.queue.submit([encoder.finish()]);

    mapped.map_async(wgpu::MapMode::Read, .., |r| {
        r.expect("the result can be read")
    });
    gpu.device
        .poll(wgpu::PollType::wait_indefinitely())
        .expect("the device answers");
    let view = mapped.get_mapped_range(..).expect("the result is mapped");
    bytemuck::cast_slice(&view).to_vec()
}

/// The pipeline of a module. What asks again finds it made.
fn pipeline(gpu: &Gpu, code: String) -> wgpu::ComputePipeline {
    static MADE: Mutex<BTreeMap<String, wgpu::ComputePipeline>> = Mutex::new(BTreeMap::new());
    let made = || MADE.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(pipeline) = made().get(&code) {
        return pipeline.clone();
    }
    let source = wgpu::ShaderSource::Wgsl(code.as_str().into());
    let descriptor = wgpu::ShaderModuleDescriptor {
        label: None,
        source,
    };
    let module = gpu.device.create_shader_module(descriptor);
    let descriptor = wgpu::ComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &module,
        entry_point: Some("main"),
        compilation_options: Default::default(),
        cache: None,
    };
    let pipeline = gpu.device.create_compute_pipeline(&descriptor);
    made().insert(code, pipeline.clone());
    pipeline
}

/// The whole module; every buffer is kept in the bind group by a reference to its length.
fn assemble(parts: &[&ShaderPart], body: &str, count: usize) -> String {
    let mut code = String::from(
        "@group(0) @binding(0) var<storage, read> input: array<vec4<u32>>;\n\
         @group(0) @binding(1) var<storage, read_write> result: array<vec4<u32>>;\n",
    );
    let mut uses = String::from("let kept = arrayLength(&input)");
    for (i, b) in parts.iter().flat_map(|p| &p.buffers).enumerate() {
        let (binding, name, ty) = (i + 2, b.name, b.wgsl_type);
        code += &format!("@group(0) @binding({binding}) var<storage, read> {name}: {ty};\n");
        uses += &format!(" + arrayLength(&{name})");
    }
    for part in parts {
        code += &part.wgsl;
    }
    let lanes = parts.iter().any(|part| part.wgsl.contains("walk_lane"));
    let set_lane = if lanes { "walk_lane = lane;" } else { "" };
    code += &format!(
        "const WORKGROUP_SIZE: u32 = {WORKGROUP}u;\nfn evaluate(i: u32) {{\n{body}\n}}\n\
         @compute @workgroup_size({WORKGROUP}) fn main(\
         @builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, \
         @builtin(local_invocation_index) lane: u32) {{\n\
         {set_lane}\n{uses};\nif kept == 0u {{ return; }}\n\
         for (var i = id.x; i < {count}u; i += groups.x * {WORKGROUP}u) {{ evaluate(i); }}\n}}\n"
    );
    code
}

fn buffer(gpu: &Gpu, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size,
        usage,
        mapped_at_creation: false,
    })
}

fn storage(gpu: &Gpu, bytes: &[u8]) -> wgpu::Buffer {
    let contents = if bytes.is_empty() { &[0; 16] } else { bytes };
    gpu.device
        .create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: None,
            contents,
            usage: wgpu::BufferUsages::STORAGE,
        })
}

fn bind_entry((i, buffer): (usize, &wgpu::Buffer)) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry {
        binding: i as u32,
        resource: buffer.as_entire_binding(),
    }
}

/// Floats as a row.
pub(crate) fn row(values: [f32; 4]) -> Row {
    values.map(f32::to_bits)
}

/// A row as floats.
pub(crate) fn floats(row: Row) -> [f32; 4] {
    row.map(f32::from_bits)
}

/// No primitive, and what a ray that skips none says.
pub(crate) const MISS: u32 = u32::MAX;

/// A ray as tests cast it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    pub(crate) origin: glam::Vec3,
    pub(crate) direction: glam::Vec3,
    pub(crate) t_max: f32,
    pub(crate) skip: u32,
}

impl Ray {
    pub(crate) fn new(origin: glam::Vec3, direction: glam::Vec3) -> Ray {
        Ray {
            origin,
            direction: direction.as_dvec3().normalize().as_vec3(),
            t_max: 3e38,
            skip: MISS,
        }
    }
}

/// Rays as input of [`run`], two rows each, which [`CAST`] casts.
pub(crate) fn ray_rows(rays: &[Ray]) -> Vec<Row> {
    let rows = |r: &Ray| {
        let [x, y, z] = r.direction.to_array().map(f32::to_bits);
        [row(r.origin.extend(r.t_max).to_array()), [x, y, z, r.skip]]
    };
    rays.iter().flat_map(rows).collect()
}

/// WGSL that casts the ray of thread `i`: the nearest `hit`, and whether there is `any`.
pub(crate) const CAST: &str = "
        let o = bitcast<vec4<f32>>(input[2u * i]);
        let d = input[2u * i + 1u];
        let direction = bitcast<vec3<f32>>(d.xyz);
        let hit = trace_closest(o.xyz, direction, o.w, d.w);
        let any = trace_any(o.xyz, direction, o.w, d.w);
";

/// A small generator for test inputs: PCG, O'Neill 2014.
pub(crate) struct Random(u64);

impl Random {
    /// The sequence numbered `seed`.
    pub(crate) fn new(seed: u64) -> Self {
        let mut random = Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        random.bits();
        random
    }

    /// 32 random bits.
    pub(crate) fn bits(&mut self) -> u32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let shifted = (((self.0 >> 18) ^ self.0) >> 27) as u32;
        shifted.rotate_right((self.0 >> 59) as u32)
    }

    /// Uniform in [0, 1), with 24 bits, as kernels draw it.
    pub(crate) fn uniform(&mut self) -> f32 {
        (self.bits() >> 8) as f32 / (1 << 24) as f32
    }

    /// Uniform in [low, high).
    pub(crate) fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.uniform()
    }

    /// Uniform in the cube [low, high)^3.
    pub(crate) fn point(&mut self, low: f32, high: f32) -> glam::Vec3 {
        [(); 3].map(|_| self.range(low, high)).into()
    }

    /// A uniformly distributed unit vector.
    pub(crate) fn direction(&mut self) -> glam::Vec3 {
        let z = self.range(-1.0, 1.0);
        let phi = self.range(0.0, std::f32::consts::TAU);
        let r = (1.0 - z * z).max(0.0).sqrt();
        glam::Vec3::new(r * phi.cos(), r * phi.sin(), z)
    }
}
