//! Casts sets of rays by one technique, with the shells that the wavefront's kernels have.

use std::time::{Duration, Instant};

use super::sets::{Ray, SurfaceHit};
use crate::error::RuntimeError;
use crate::gpu::schedule::{Schedule, Size, Step};
use crate::gpu::submission::Submission;
use crate::gpu::{Gpu, Timing};
use crate::kernels::shells::{Consumed, EntryPoint, FetchShell, Fetched};
use crate::render::pool;
use crate::scene::Scene;
use crate::technique::{Leaves, RayFetch, Technique};
use crate::wgsl;
use crate::wgsl::ShaderPart;
use crate::wgsl::template::template;
use crate::world::bvh::{self, Bvh};
use crate::world::surface::geometry_part;

/// Casts before those that are timed, on a GPU. A processor is awake, having built the kernel.
const WARM_UP: Duration = Duration::from_millis(200);

/// The buffers of a kernel beside the scene's: name, type, access.
const BUFFERS: [(&str, &str, &str); 4] = [
    ("rays", "array<vec4<u32>>", "read"),
    ("hits", "array<vec4<u32>>", "read_write"),
    ("queues", "array<u32>", "read"),
    ("counters", "array<atomic<u32>>", "read_write"),
];
/// Words of `counters`: the queue's length, and how much of it was fetched, in another line of
/// the cache.
const COUNTERS: u64 = 128;
const FETCHED: u32 = 64;

/// What a cast found, and how long it took each time.
pub(super) struct Cast {
    pub hits: Vec<Option<SurfaceHit>>,
    pub seconds: Vec<f64>,
}

/// Everything of a technique that does not depend on the rays.
pub(super) struct Caster<'g> {
    gpu: &'g Gpu,
    technique: Technique,
    parts: [ShaderPart; 2],
    scene_buffers: Vec<wgpu::Buffer>,
    /// The triangle of each reference, and the primitive of each triangle.
    order: Vec<u32>,
    primitives: Vec<u32>,
}

impl<'g> Caster<'g> {
    pub(super) fn new(
        gpu: &'g Gpu,
        scene: &Scene,
        bvh: &Bvh,
        technique: &Technique,
    ) -> Result<Self, RuntimeError> {
        let order = bvh.order().to_vec();
        let primitives = bvh::primitives(&order, scene.mesh.len());
        let no_lights = vec![u32::MAX; scene.mesh.len()];
        let geometry = geometry_part(&scene.mesh, &order, &no_lights, &[]);
        let parts = [geometry, bvh.part(technique)];
        let mut scene_buffers = Vec::new();
        for data in parts.iter().flat_map(|part| &part.buffers) {
            let size = data.bytes.len() as u64;
            gpu.check_binding_size(&format!("the scene's buffer `{}`", data.name), size)?;
            scene_buffers.push(upload(gpu, data.name, &data.bytes));
        }
        Ok(Self {
            gpu,
            technique: *technique,
            parts,
            scene_buffers,
            order,
            primitives,
        })
    }

    /// Casts `rays` for some time, and then `repetitions` times by the clock.
    pub(super) fn cast(
        &self,
        rays: &[Ray],
        any_hit: bool,
        repetitions: u32,
    ) -> Result<Cast, RuntimeError> {
        let count = rays.len() as u32;
        let words: Vec<[u32; 4]> = rays.iter().flat_map(|ray| self.pack(ray)).collect();
        self.gpu
            .check_binding_size("the rays", 32 * u64::from(count))?;
        let identity: Vec<u32> = (0..count).collect();
        let mut start = vec![0u32; COUNTERS as usize];
        start[0] = count;
        let counters = upload(self.gpu, "counters", bytemuck::cast_slice(&start));
        let own = [
            upload(self.gpu, "rays", bytemuck::cast_slice(&words)),
            upload(self.gpu, "hits", &vec![0; 16 * rays.len()]),
            upload(self.gpu, "queues", bytemuck::cast_slice(&identity)),
            counters.clone(),
        ];
        let step = self.step(&own, count, any_hit)?;
        let schedule = Schedule {
            steps: vec![step],
            arguments: counters.clone(),
            timing: self.gpu.timing.min(Timing::AroundPass),
        };
        let cast = || {
            self.gpu
                .queue
                .write_buffer(&counters, 0, bytemuck::cast_slice(&start));
            self.run(&schedule, &counters)
        };
        // Some drivers finish building a kernel when it first runs; and a GPU that was idle, as while
        // a tree was built, takes its time to get up to speed.
        let begin = Instant::now();
        cast()?;
        let warms_up = repetitions > 0 && !self.gpu.is_software();
        while warms_up && begin.elapsed() < WARM_UP {
            cast()?;
        }
        let seconds: Result<_, _> = (0..repetitions).map(|_| cast()).collect();
        let seconds: Vec<f64> = seconds?;
        let hits = self.read(&own[1])?;
        Ok(Cast { hits, seconds })
    }

    fn run(&self, schedule: &Schedule, counters: &wgpu::Buffer) -> Result<f64, RuntimeError> {
        let queries = schedule.timing.queries(1);
        let mut submission = Submission::new(self.gpu, COUNTERS as usize, queries)?;
        let begin = Instant::now();
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        schedule.record(&mut encoder, 1, submission.queries());
        submission.copy(&mut encoder, counters, queries);
        submission.submit(self.gpu, encoder, 1);
        let done = submission.wait(self.gpu, schedule)?;
        Ok(match schedule.timing {
            Timing::None => begin.elapsed().as_secs_f64(),
            _ => done.seconds,
        })
    }

    fn step(&self, own: &[wgpu::Buffer], count: u32, any_hit: bool) -> Result<Step, RuntimeError> {
        let sizes = pool::dispatch_sizes(self.gpu.into(), count, &self.technique)?;
        let persistent = self.technique.ray_fetch == RayFetch::Persistent;
        let mut text = self.declarations();
        text += &wgsl::constants_u32(&[
            ("POOL_SIZE", count),
            ("WORKGROUP_SIZE", sizes.workgroup),
            ("ROW_GROUPS", sizes.row_groups),
            ("NOTHING", u32::MAX),
            ("COUNTER_TAKEN", 0),
            ("CONSUMED_REGION", 0),
        ]);
        text.extend(self.parts.iter().map(|part| part.wgsl.as_str()));
        let flags = [("any_hit", any_hit), ("fetched", persistent)];
        text += &template!("../../kernels/rays.wgsl").wgsl(&flags);
        text += &self.shell(sizes.fetch_limit);
        let layout = self.layout();
        let buffers = own.iter().chain(&self.scene_buffers);
        let entries: Vec<_> = (0..)
            .zip(buffers)
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        let bind_group = self
            .gpu
            .device
            .create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("rays"),
                layout: &layout,
                entries: &entries,
            });
        let threads = if persistent { sizes.threads } else { count };
        let step = Step {
            name: "rays".into(),
            pipeline: self.gpu.pipeline("rays", &text, &layout)?,
            bind_group,
            size: Size::for_items(threads, sizes.workgroup, sizes.row_groups),
        };
        self.gpu.check()?;
        Ok(step)
    }

    /// The entry point: threads that fetch rays, or one thread a ray.
    fn shell(&self, fetch_limit: u32) -> String {
        let walk_lane = bvh::asks_for_lane(&self.parts[1]);
        match self.technique.ray_fetch {
            RayFetch::Persistent => FetchShell {
                casts: vec![Fetched {
                    name: "cast",
                    items: Consumed::unordered(0),
                }],
                counter: &format!("{FETCHED}u"),
                limit: fetch_limit,
                slots: true,
                together: self.technique.leaves == Leaves::Together,
                walk_lane,
            }
            .wgsl(),
            RayFetch::Thread => {
                let entry = EntryPoint {
                    walk_lane,
                    ..EntryPoint::of_slots_in_queue()
                };
                wgsl::constant_u32("CONSUMED_QUEUE", 0) + &entry.wgsl()
            }
        }
    }

    fn declarations(&self) -> String {
        let scene = self.parts.iter().flat_map(|part| &part.buffers);
        let scene = scene.map(|b| (b.name, b.wgsl_type, "read"));
        let all = (0..).zip(BUFFERS.into_iter().chain(scene));
        all.map(|(index, (name, ty, access))| {
            format!("@group(0) @binding({index}) var<storage, {access}> {name}: {ty};\n")
        })
        .collect()
    }

    fn layout(&self) -> wgpu::BindGroupLayout {
        let scene = self.scene_buffers.iter().map(|_| "read");
        let accesses = BUFFERS.iter().map(|(.., access)| *access).chain(scene);
        let entry = |(binding, access)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage {
                    read_only: access == "read",
                },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let entries: Vec<_> = (0..).zip(accesses).map(entry).collect();
        let descriptor = wgpu::BindGroupLayoutDescriptor {
            label: Some("rays"),
            entries: &entries,
        };
        self.gpu.device.create_bind_group_layout(&descriptor)
    }

    fn pack(&self, ray: &Ray) -> [[u32; 4]; 2] {
        let skip = ray.skip.and_then(|t| self.primitives.get(t as usize));
        let [x, y, z] = ray.direction.to_array().map(f32::to_bits);
        [
            ray.origin.extend(ray.t_max).to_array().map(f32::to_bits),
            [x, y, z, skip.copied().unwrap_or(u32::MAX)],
        ]
    }

    fn read(&self, hits: &wgpu::Buffer) -> Result<Vec<Option<SurfaceHit>>, RuntimeError> {
        let staging = self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("hits readback"),
            size: hits.size(),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(hits, 0, &staging, 0, hits.size());
        let index = self.gpu.queue.submit([encoder.finish()]);
        let words: Vec<[u32; 4]> = self.gpu.read(&staging, index, hits.size(), |bytes| {
            bytemuck::pod_collect_to_vec(bytes)
        })?;
        let hit = |[t, u, v, primitive]: [u32; 4]| {
            let triangle = self.order.get(primitive as usize)?;
            Some(SurfaceHit {
                t: f32::from_bits(t),
                uv: [f32::from_bits(u), f32::from_bits(v)],
                triangle: *triangle,
            })
        };
        Ok(words.into_iter().map(hit).collect())
    }
}

fn upload(gpu: &Gpu, label: &str, bytes: &[u8]) -> wgpu::Buffer {
    let size = (bytes.len() as u64).next_multiple_of(16).max(16);
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage: wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_DST
            | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let mut padded = bytes.to_vec();
    padded.resize(size as usize, 0);
    gpu.queue.write_buffer(&buffer, 0, &padded);
    buffer
}
