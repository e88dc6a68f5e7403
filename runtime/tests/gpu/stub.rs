//! Worlds of a few lines of WGSL: a room of six walls with a plate in it, and materials whose
//! albedo is exact.

use std::ops::ControlFlow;
use std::sync::OnceLock;

use glam::Vec3;
use impasto_compiler::abi::{Emission, Input, InputSet, InstanceInfo, MaterialInfo, Table};
use impasto_compiler::partition::{Plan, PlanInputs, Strategy};
use impasto_runtime::cpu::{Cpu, CpuOptions};
use impasto_runtime::device::DeviceRef;
use impasto_runtime::gpu::{Gpu, GpuOptions};
use impasto_runtime::options::RenderOptions;
use impasto_runtime::render::{Renderer, Rendering};
use impasto_runtime::scene::Camera;
use impasto_runtime::wgsl::{BufferData, ShaderPart};
use impasto_runtime::world::GeometryCounts;
use impasto_runtime::world::SceneParts;
use impasto_runtime::world::camera::CameraFrame;
use impasto_runtime::world::lights::Lights;
use impasto_runtime::world::media::Media;
use impasto_runtime::world::surface::Surface;
use impasto_runtime::world::{MaterialSource, World};

pub fn gpu() -> &'static Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    GPU.get_or_init(|| match Gpu::new(&GpuOptions::default()) {
        Ok(gpu) => gpu,
        Err(error) => panic!("these tests need a GPU: {error}"),
    })
}

pub fn cpu() -> &'static Cpu {
    static CPU: OnceLock<Cpu> = OnceLock::new();
    CPU.get_or_init(|| Cpu::new(&CpuOptions::default()).unwrap_or_else(|error| panic!("{error}")))
}

/// A device, and how it divides materials into kernels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Way {
    /// A GPU with a kernel a material.
    Wavefront,
    /// A GPU with one kernel for whole paths.
    Megakernel,
    /// The processor, which has one kernel.
    Processor,
}

impl Way {
    pub const ALL: [Self; 3] = [Self::Wavefront, Self::Megakernel, Self::Processor];

    pub fn device(self) -> DeviceRef<'static> {
        match self {
            Self::Wavefront | Self::Megakernel => gpu().into(),
            Self::Processor => cpu().into(),
        }
    }

    pub fn strategy(self) -> Strategy {
        match self {
            Self::Wavefront => Strategy::OWN,
            Self::Megakernel | Self::Processor => Strategy::MEGA,
        }
    }
}

/// What a stub material does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Lambertian reflection of an albedo.
    Diffuse(f32),
    /// The same, but sampling fails half of the time (and weighs twice when it does not).
    Failing(f32),
    /// Lambertian, and emits a radiance that is known only when evaluated.
    Glowing(f32, f32),
    /// A perfect mirror.
    Mirror,
    /// Lambertian, but every result is NaN.
    Broken,
    /// Lambertian, but for an assignment to a member of its `sample`.
    Wrong(&'static str),
    /// Lambertian, and emits a NaN that is known only when evaluated.
    GlowingWrong,
}

/// A list of stub materials.
pub struct Materials {
    kinds: Vec<Kind>,
    infos: Vec<MaterialInfo>,
}

pub fn materials(kinds: &[Kind]) -> Materials {
    let info = |(index, kind): (usize, &Kind)| MaterialInfo {
        name: format!("m{index}"),
        delta_only: *kind == Kind::Mirror,
        crosses: false,
        walks: false,
        transmissive: false,
        varying_emission: matches!(kind, Kind::Glowing(..) | Kind::GlowingWrong),
        inputs: InputSet::of(&[Input::Normal]),
        textures: Vec::new(),
        lobes: 1,
    };
    Materials {
        kinds: kinds.to_vec(),
        infos: kinds.iter().enumerate().map(info).collect(),
    }
}

/// `material_of` where every material has one instance, in their order.
pub const IDENTITY: &str = "fn material_of(instance: u32) -> u32 { return instance; }\n";

/// One instance a material.
pub fn each_once(materials: &[MaterialInfo]) -> Vec<InstanceInfo> {
    let instance = |(material, info): (usize, &MaterialInfo)| InstanceInfo {
        name: info.name.clone(),
        material,
        emission: if info.varying_emission {
            Emission::Varying
        } else {
            Emission::None
        },
        medium: None,
    };
    materials.iter().enumerate().map(instance).collect()
}

impl MaterialSource for Materials {
    fn infos(&self) -> Vec<MaterialInfo> {
        self.infos.clone()
    }

    fn instances(&self) -> Vec<InstanceInfo> {
        each_once(&self.infos)
    }

    fn tables(&self) -> Vec<Table> {
        Vec::new()
    }

    fn lookup_wgsl(&self) -> String {
        IDENTITY.to_string()
    }

    fn wgsl(&self, members: &[usize]) -> String {
        let mut evaluation = String::new();
        let mut emission = String::new();
        for &member in members {
            let glows = self.kinds[member] == Kind::GlowingWrong;
            let call = match self.kinds[member] {
                Kind::Wrong(assignment) => {
                    evaluation += &format!(
                        "case {member}u: {{ var sample = diffuse(0.5, n, wo, wl, u); {assignment}; return sample; }}\n"
                    );
                    continue;
                }
                Kind::GlowingWrong => "diffuse(0.5, n, wo, wl, u)".to_string(),
                Kind::Diffuse(a) | Kind::Glowing(a, _) => format!("diffuse({a:?}, n, wo, wl, u)"),
                Kind::Failing(a) => format!("failing({a:?}, n, wo, wl, u)"),
                Kind::Mirror => "mirror(n, wo)".to_string(),
                Kind::Broken => "diffuse(sqrt(-1.0 - u.x), n, wo, wl, u)".to_string(),
            };
            evaluation += &format!("case {member}u: {{ return {call}; }}\n");
            if glows {
                emission +=
                    &format!("case {member}u: {{ return vec3<f32>(sqrt(-2.0 - wo.x)); }}\n");
            }
            if let Kind::Glowing(_, radiance) = self.kinds[member] {
                emission += &format!("case {member}u: {{ return vec3<f32>({radiance:?}); }}\n");
            }
        }
        let mut text = MATERIALS.replace("CASES", &evaluation);
        if !emission.is_empty() {
            text += &EMISSION.replace("CASES", &emission);
        }
        text
    }
}

const EMISSION: &str = "
fn material_emission(material: u32, point: SurfacePoint, wo: vec3<f32>) -> vec3<f32> {
    switch material {
        CASES
        default: { return vec3<f32>(0.0); }
    }
}
";

const MATERIALS: &str = "
struct SurfacePoint { position: vec3<f32>, normal: vec3<f32>, geometric_normal: vec3<f32>, tangent: vec3<f32>, uv: vec2<f32>, exterior_ior: f32 }
struct MaterialSample {
    wi: vec3<f32>,
    pdf: f32,
    throughput: vec3<f32>,
    light_pdf: f32,
    light_throughput: vec3<f32>,
    transmitted: f32
}

fn diffuse(albedo: f32, n: vec3<f32>, wo: vec3<f32>, wl: vec3<f32>, u: vec4<f32>) -> MaterialSample {
    let up = select(-n, n, dot(n, wo) > 0.0);
    let across = normalize(select(cross(up, vec3<f32>(1.0, 0.0, 0.0)), cross(up, vec3<f32>(0.0, 1.0, 0.0)), abs(up.x) > 0.5));
    let angle = 6.2831853 * u.z;
    let r = sqrt(u.y);
    let wi = normalize(r * (cos(angle) * across + sin(angle) * cross(up, across)) + sqrt(1.0 - u.y) * up);
    let pdf = max(dot(up, wi), 1e-6) / 3.14159265;
    let light_pdf = max(dot(up, wl), 0.0) / 3.14159265;
    return MaterialSample(wi, pdf, vec3<f32>(albedo), light_pdf, vec3<f32>(albedo * light_pdf), 0.0);
}

fn failing(albedo: f32, n: vec3<f32>, wo: vec3<f32>, wl: vec3<f32>, u: vec4<f32>) -> MaterialSample {
    var sample = diffuse(albedo, n, wo, wl, u);
    sample.pdf *= 0.5;
    sample.light_pdf *= 0.5;
    sample.throughput = select(vec3<f32>(0.0), 2.0 * sample.throughput, u.x < 0.5);
    return sample;
}

fn mirror(n: vec3<f32>, wo: vec3<f32>) -> MaterialSample {
    let none = vec3<f32>(0.0);
    return MaterialSample(reflect(-wo, n), 0.0, vec3<f32>(1.0), 0.0, none, 0.0);
}

fn evaluate_material(material: u32, point: SurfacePoint, wo: vec3<f32>, wl: vec3<f32>, u: vec4<f32>) -> MaterialSample {
    let n = point.normal;
    switch material {
        CASES
        default: { return mirror(n, wo); }
    }
}
";

/// How light reaches a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Strategies {
    /// Scattered rays that happen to hit lights.
    Scattering,
    /// Samples of lights, but for what the camera sees.
    Sampling,
    /// Both, weighted.
    Both,
}

/// The room: walls at -1 and 1 on each axis, primitive `2 axis + (1 if at +1)`, and a plate
/// (6) in the middle of it. Barycentrics are the two coordinates on the wall.
pub struct Room {
    pub walls: bool,
    pub plate: bool,
    /// Radiance of the walls that emit.
    pub radiance: f32,
    /// Which walls emit.
    pub emitters: Vec<u32>,
    /// Radiance of what is seen beyond, if there are no walls.
    pub sky: f32,
    pub strategies: Strategies,
    pub max_depth: u32,
    pub roulette_start: u32,
    pub width: u32,
    pub height: u32,
    /// The material of each wall and of the plate.
    pub materials: [u32; 7],
    /// Materials that the room says are on none of these.
    pub unbound: Vec<usize>,
}

impl Default for Room {
    fn default() -> Self {
        Self {
            walls: true,
            plate: false,
            radiance: 1.0,
            emitters: (0..6).collect(),
            sky: 0.0,
            strategies: Strategies::Both,
            max_depth: 16,
            roulette_start: 1000,
            width: 24,
            height: 16,
            materials: [0; 7],
            unbound: Vec::new(),
        }
    }
}

const GEOMETRY: &str = "
fn primitive_instance(primitive: u32) -> u32 { return wall_materials[primitive]; }
";

const TRAVERSAL: &str = "
struct Hit { t: f32, u: f32, v: f32, primitive: u32 }

fn trace_closest(origin: vec3<f32>, direction: vec3<f32>, t_max: f32, skip: u32) -> Hit {
    var best = Hit(t_max, 0.0, 0.0, 0xffffffffu);
    if HAS_WALLS {
        for (var axis = 0u; axis < 3u; axis++) {
            let d = direction[axis];
            if abs(d) > 1e-9 {
                let face = 2u * axis + select(0u, 1u, d > 0.0);
                let t = (sign(d) - origin[axis]) / d;
                if face != skip && t > 0.0 && t < best.t {
                    let p = origin + t * direction;
                    best = Hit(t, p[(axis + 1u) % 3u], p[(axis + 2u) % 3u], face);
                }
            }
        }
    }
    if HAS_PLATE && skip != 6u && abs(direction.y) > 1e-9 {
        let t = -origin.y / direction.y;
        let p = origin + t * direction;
        if t > 0.0 && t < best.t && abs(p.x) < 0.5 && abs(p.z) < 0.5 {
            best = Hit(t, p.z, p.x, 6u);
        }
    }
    return best;
}

fn trace_any(origin: vec3<f32>, direction: vec3<f32>, t_max: f32, skip: u32) -> bool {
    return trace_closest(origin, direction, t_max, skip).primitive != 0xffffffffu;
}
";

const SURFACE: &str = "
fn hit_position(primitive: u32, uv: vec2<f32>) -> vec3<f32> {
    let axis = select(primitive / 2u, 1u, primitive == 6u);
    var p = vec3<f32>(0.0);
    p[axis] = select(select(-1.0, 1.0, primitive % 2u == 1u), 0.0, primitive == 6u);
    p[(axis + 1u) % 3u] = uv.x;
    p[(axis + 2u) % 3u] = uv.y;
    return p;
}
fn hit_geometric_normal(primitive: u32) -> vec3<f32> {
    if primitive == 6u { return vec3<f32>(0.0, 1.0, 0.0); }
    var n = vec3<f32>(0.0);
    n[primitive / 2u] = select(1.0, -1.0, primitive % 2u == 1u);
    return n;
}
fn hit_normal(primitive: u32, uv: vec2<f32>) -> vec3<f32> { return hit_geometric_normal(primitive); }
fn hit_uv(primitive: u32, uv: vec2<f32>) -> vec2<f32> { return uv; }
fn hit_tangent(primitive: u32) -> vec3<f32> { return vec3<f32>(0.0); }
fn offset_origin(position: vec3<f32>, normal: vec3<f32>) -> vec3<f32> { return position + 1e-5 * normal; }
";

const LIGHTS: &str = "
fn balance_of_squares(a: f32, b: f32) -> f32 { let r = b / a; return 1.0 / (1.0 + r * r); }

fn emits(primitive: u32) -> bool { return ((EMITTERS >> primitive) & 1u) == 1u; }

// Density by solid angle of a point on an emitting wall, seen from a distance under a cosine.
fn wall_pdf(distance: f32, cosine: f32) -> f32 {
    return distance * distance / (4.0 * f32(EMITTER_COUNT) * max(cosine, 1e-6));
}

fn light_hit(primitive: u32, t: f32, direction: vec3<f32>, bsdf_pdf: f32) -> vec3<f32> {
    let cosine = -dot(direction, hit_geometric_normal(primitive));
    if !emits(primitive) || cosine <= 0.0 { return vec3<f32>(0.0); }
    var weight = 1.0;
    if bsdf_pdf > 0.0 && STRATEGIES == 1u { weight = 0.0; }
    if bsdf_pdf > 0.0 && STRATEGIES == 2u { weight = balance_of_squares(bsdf_pdf, wall_pdf(t, cosine)); }
    return vec3<f32>(weight * RADIANCE);
}

fn light_escape(direction: vec3<f32>, bsdf_pdf: f32) -> vec3<f32> {
    var weight = 1.0;
    if bsdf_pdf > 0.0 && STRATEGIES == 1u { weight = 0.0; }
    if bsdf_pdf > 0.0 && STRATEGIES == 2u { weight = balance_of_squares(bsdf_pdf, 1.0 / 12.566371); }
    return vec3<f32>(weight * SKY);
}

struct LightSample { wi: vec3<f32>, distance: f32, radiance: vec3<f32>, pdf: f32 }

fn sample_light(position: vec3<f32>, bits: vec4<u32>) -> LightSample {
    let u = vec4<f32>(bits >> vec4<u32>(8u)) * 0x1p-24;
    if SKY > 0.0 {
        let z = 1.0 - 2.0 * u.y;
        let r = sqrt(1.0 - z * z);
        let wi = vec3<f32>(r * cos(6.2831853 * u.z), r * sin(6.2831853 * u.z), z);
        let pdf = 1.0 / 12.566371;
        return LightSample(wi, 3.0e38, vec3<f32>(SKY / pdf), select(0.0, pdf, STRATEGIES == 2u));
    }
    var wanted = u32(u.x * f32(EMITTER_COUNT));
    var wall = 0u;
    for (var i = 0u; i < 6u; i++) {
        if emits(i) {
            if wanted == 0u { wall = i; break; }
            wanted--;
        }
    }
    let to_light = hit_position(wall, 2.0 * u.yz - 1.0) - position;
    let distance = length(to_light);
    let wi = to_light / max(distance, 1e-9);
    let cosine = -dot(wi, hit_geometric_normal(wall));
    let pdf = wall_pdf(distance, cosine);
    if cosine <= 1e-4 || pdf <= 0.0 { return LightSample(wi, distance, vec3<f32>(0.0), 0.0); }
    return LightSample(wi, distance, vec3<f32>(RADIANCE / pdf), select(0.0, pdf, STRATEGIES == 2u));
}
";

impl Room {
    /// The room without sampled light.
    pub fn scattering(self) -> Self {
        Self {
            strategies: Strategies::Scattering,
            ..self
        }
    }

    pub fn world(&self) -> World {
        let emitters = if self.walls {
            self.emitters.as_slice()
        } else {
            &[]
        };
        let bits: u32 = emitters.iter().map(|wall| 1 << wall).sum();
        let constants = format!(
            "const EMITTERS: u32 = {bits}u;\nconst EMITTER_COUNT: u32 = {}u;\n\
             const RADIANCE: f32 = {:?};\nconst SKY: f32 = {:?};\nconst STRATEGIES: u32 = {}u;\n",
            emitters.len().max(1),
            self.radiance,
            self.sky,
            self.strategies as u32
        );
        let geometry = format!(
            "const HAS_WALLS: bool = {};\nconst HAS_PLATE: bool = {};\n",
            self.walls, self.plate
        );
        let camera = Camera {
            position: Vec3::new(0.1, 0.6, 0.8),
            look_at: Vec3::ZERO,
            up: Vec3::Y,
            fov: 57.0,
            aperture: 0.0,
            focus: 1.0,
        };
        World {
            width: self.width,
            height: self.height,
            camera: CameraFrame::new(&camera, self.width as f32 / self.height as f32),
            max_depth: self.max_depth,
            roulette_start: self.roulette_start,
            outputs: Default::default(),
            parts: SceneParts {
                geometry: ShaderPart {
                    wgsl: GEOMETRY.to_string(),
                    buffers: vec![BufferData::new(
                        "wall_materials",
                        "array<u32>",
                        &self.materials,
                    )],
                },
                bvh: text(geometry + TRAVERSAL),
                bounds: [Vec3::NEG_ONE, Vec3::ONE],
                surface: Surface::ByHand(text(SURFACE.to_string())),
                lights: Lights::ByHand {
                    part: text(constants + LIGHTS),
                    sampled: self.strategies != Strategies::Scattering,
                    weighted: self.strategies == Strategies::Both,
                },
                media: Media::default(),
                texture: None,
                counts: GeometryCounts::default(),
                unbound: self.unbound.clone(),
            },
        }
    }
}

fn text(wgsl: String) -> ShaderPart {
    ShaderPart {
        wgsl,
        buffers: Vec::new(),
    }
}

/// A plan by a strategy for stub materials.
pub fn plan(strategy: Strategy, materials: &Materials) -> Plan {
    let names: Vec<String> = materials.infos.iter().map(|m| m.name.clone()).collect();
    let plan = strategy.plan(&PlanInputs::of_names(&names));
    plan.unwrap_or_else(|e| panic!("{e}"))
}

pub fn samples(samples: u32) -> RenderOptions {
    RenderOptions {
        samples,
        ..RenderOptions::default()
    }
}

pub fn render_plan(
    world: &World,
    materials: &Materials,
    plan: &Plan,
    options: &RenderOptions,
) -> Rendering {
    rendered(gpu().into(), world, materials, plan, options)
}

pub fn render_on(
    way: Way,
    world: &World,
    materials: &Materials,
    options: &RenderOptions,
) -> Rendering {
    let plan = plan(way.strategy(), materials);
    rendered(way.device(), world, materials, &plan, options)
}

fn rendered(
    device: DeviceRef<'static>,
    world: &World,
    materials: &Materials,
    plan: &Plan,
    options: &RenderOptions,
) -> Rendering {
    let mut renderer = Renderer::from_world(device, world, materials, plan, options)
        .unwrap_or_else(|e| panic!("{e}"));
    let rendering = renderer
        .render(&mut |_| ControlFlow::Continue(()))
        .unwrap_or_else(|e| panic!("{e}"));
    let pixels = u64::from(world.width) * u64::from(world.height);
    assert_eq!(rendering.report.paths, pixels * u64::from(options.samples));
    assert!(rendering.film.samples.iter().all(|n| *n == options.samples));
    assert_eq!(rendering.report.queue_overflow, 0);
    rendering
}

/// Renders on the processor.
pub fn picture(world: &World, materials: &Materials, options: &RenderOptions) -> Rendering {
    render_on(Way::Processor, world, materials, options)
}

/// Renders with one kernel a material.
pub fn render(world: &World, materials: &Materials, options: &RenderOptions) -> Rendering {
    render_plan(world, materials, &plan(Strategy::OWN, materials), options)
}

/// Mean of the first channel over all pixels, and its standard error from their spread.
pub fn mean(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let values: Vec<f64> = values.into_iter().collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

pub fn red(rendering: &Rendering) -> impl Iterator<Item = f64> {
    rendering.film.pixels.iter().map(|p| f64::from(p[0]))
}

/// Fails if the picture's mean is not `expected`, by a Z-test at four standard errors (one
/// false alarm in 16,000); seeds are fixed, so a pass stays a pass.
#[track_caller]
pub fn assert_mean(rendering: &Rendering, expected: f64) {
    let (mean, error) = mean(red(rendering));
    let z = (mean - expected) / error.max(1e-6 * expected.abs());
    assert!(
        z.abs() < 4.0,
        "mean {mean} +- {error}, expected {expected}: z = {z}"
    );
}

/// Fails if two independent renders do not estimate the same picture.
#[track_caller]
pub fn assert_same_picture(a: &Rendering, b: &Rendering) {
    let (mean, error) = mean(red(a).zip(red(b)).map(|(a, b)| a - b));
    let z = mean / error.max(1e-9);
    assert!(z.abs() < 4.0, "mean difference {mean} +- {error}: z = {z}");
}
