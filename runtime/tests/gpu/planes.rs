//! Worlds of planes across the z axis, filled with media: what passes a stack of layers at right
//! angles is known in closed form.

use glam::Vec3;
use impasto_compiler::abi::{Emission, Input, InputSet, InstanceInfo, MaterialInfo, Medium, Table};
use impasto_compiler::partition::{Plan, PlanInputs, Strategy};
use impasto_runtime::device::DeviceRef;
use impasto_runtime::options::RenderOptions;
use impasto_runtime::render::{Renderer, Rendering};
use impasto_runtime::scene::Camera;
use impasto_runtime::wgsl::{BufferData, ShaderPart};
use impasto_runtime::world::GeometryCounts;
use impasto_runtime::world::SceneParts;
use impasto_runtime::world::camera::CameraFrame;
use impasto_runtime::world::lights::Lights;
use impasto_runtime::world::media::Media;
use impasto_runtime::world::surface;
use impasto_runtime::world::{MaterialSource, World};
use std::ops::ControlFlow;

use crate::gpu::stub::{IDENTITY, cpu, gpu};

/// What a solid's surface does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Surface {
    /// Reflects and refracts by Fresnel's equations, between its medium and the one outside.
    Smooth,
    /// Lets light pass straight, and changes no medium.
    Window,
    /// Lambertian reflection of an albedo.
    Diffuse(f32),
    /// Lambertian transmission of an albedo.
    Translucent(f32),
    /// Emits a radiance and reflects nothing.
    Glow(f32),
}

/// A material, its only instance and what fills it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solid {
    pub surface: Surface,
    pub medium: Option<Medium>,
}

impl Solid {
    pub fn smooth(absorption: [f32; 3], ior: f32, priority: u32) -> Solid {
        Solid {
            surface: Surface::Smooth,
            medium: Some(Medium {
                absorption,
                ior,
                priority,
                ..Medium::AIR
            }),
        }
    }

    pub fn empty(surface: Surface) -> Solid {
        Solid {
            surface,
            medium: None,
        }
    }
}

pub struct Solids(pub Vec<Solid>);

impl MaterialSource for Solids {
    fn infos(&self) -> Vec<MaterialInfo> {
        let info = |(index, solid): (usize, &Solid)| {
            let crosses = matches!(
                solid.surface,
                Surface::Smooth | Surface::Window | Surface::Translucent(_)
            );
            let discrete = matches!(solid.surface, Surface::Smooth | Surface::Window);
            MaterialInfo {
                name: format!("s{index}"),
                delta_only: discrete || matches!(solid.surface, Surface::Glow(_)),
                crosses,
                walks: false,
                transmissive: crosses && solid.medium.is_some(),
                varying_emission: matches!(solid.surface, Surface::Glow(_)),
                inputs: match solid.surface {
                    Surface::Smooth => InputSet::of(&[Input::ExteriorIor]),
                    _ => InputSet::default(),
                },
                textures: Vec::new(),
                lobes: 1,
            }
        };
        self.0.iter().enumerate().map(info).collect()
    }

    fn instances(&self) -> Vec<InstanceInfo> {
        let instance = |(material, solid): (usize, &Solid)| InstanceInfo {
            name: format!("s{material}"),
            material,
            emission: match solid.surface {
                Surface::Glow(_) => Emission::Varying,
                _ => Emission::None,
            },
            medium: solid.medium,
        };
        self.0.iter().enumerate().map(instance).collect()
    }

    fn tables(&self) -> Vec<Table> {
        Vec::new()
    }

    fn lookup_wgsl(&self) -> String {
        IDENTITY.to_string()
    }

    fn wgsl(&self, members: &[usize]) -> String {
        let (mut evaluation, mut emission) = (String::new(), String::new());
        for &member in members {
            let Solid { surface, medium } = self.0[member];
            let changes = f32::from(u8::from(medium.is_some()));
            let call = match surface {
                Surface::Smooth => {
                    let ior = medium.expect("a smooth solid is filled").ior;
                    format!("smooth_solid({ior:?}, point, wo, u)")
                }
                Surface::Window => {
                    "MaterialSample(-wo, 0.0, vec3<f32>(1.0), 0.0, vec3<f32>(0.0), 0.0)".into()
                }
                Surface::Diffuse(a) => format!("lambert({a:?}, 1.0, 0.0, point, wo, wl, u)"),
                Surface::Translucent(a) => {
                    format!("lambert({a:?}, -1.0, {changes:?}, point, wo, wl, u)")
                }
                Surface::Glow(r) => {
                    emission += &format!("case {member}u: {{ return vec3<f32>({r:?}); }}\n");
                    "MaterialSample(wo, 0.0, vec3<f32>(0.0), 0.0, vec3<f32>(0.0), 0.0)".into()
                }
            };
            evaluation += &format!("case {member}u: {{ return {call}; }}\n");
        }
        let mut text = MATERIALS.replace("CASES", &evaluation);
        if !emission.is_empty() {
            text += &EMISSION.replace("CASES", &emission);
        }
        text
    }
}

const EMISSION: &str = "
fn material_emission(instance: u32, point: SurfacePoint, wo: vec3<f32>) -> vec3<f32> {
    switch instance { CASES default: { return vec3<f32>(0.0); } }
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

fn smooth_solid(ior: f32, point: SurfacePoint, wo: vec3<f32>, u: vec4<f32>) -> MaterialSample {
    let outside = dot(point.geometric_normal, wo) > 0.0;
    let up = select(-point.geometric_normal, point.geometric_normal, outside);
    let ratio = select(ior / point.exterior_ior, point.exterior_ior / ior, outside);
    let c = dot(up, wo);
    let sine2 = ratio * ratio * (1.0 - c * c);
    var reflected = 1.0;
    if sine2 < 1.0 {
        let t = sqrt(1.0 - sine2);
        let s = (ratio * c - t) / (ratio * c + t);
        let p = (c - ratio * t) / (c + ratio * t);
        reflected = 0.5 * (s * s + p * p);
    }
    let mirrors = u.x < reflected;
    var wi = reflect(-wo, up);
    if !mirrors {
        wi = refract(-wo, up, ratio);
    }
    return MaterialSample(normalize(wi), 0.0, vec3<f32>(1.0), 0.0, vec3<f32>(0.0), select(1.0, 0.0, mirrors));
}

// A cosine lobe on the side of wo (1) or the other (-1).
fn lambert(albedo: f32, side: f32, changes: f32, point: SurfacePoint, wo: vec3<f32>, wl: vec3<f32>, u: vec4<f32>) -> MaterialSample {
    let up = side * select(-1.0, 1.0, dot(point.geometric_normal, wo) > 0.0) * point.geometric_normal;
    let angle = 6.2831853 * u.z;
    let r = sqrt(u.y);
    let wi = normalize(vec3<f32>(r * cos(angle), r * sin(angle), up.z * sqrt(1.0 - u.y)));
    let pdf = max(dot(up, wi), 1e-6) / 3.14159265;
    let light_pdf = max(dot(up, wl), 0.0) / 3.14159265;
    return MaterialSample(wi, pdf, vec3<f32>(albedo), light_pdf, vec3<f32>(albedo * light_pdf), changes);
}

fn evaluate_material(instance: u32, point: SurfacePoint, wo: vec3<f32>, wl: vec3<f32>, u: vec4<f32>) -> MaterialSample {
    switch instance {
        CASES
        default: { return MaterialSample(wo, 0.0, vec3<f32>(0.0), 0.0, vec3<f32>(0.0), 0.0); }
    }
}
";

/// One plane: where, whether the solid's outside is towards +z, and which solid it bounds.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    pub z: f32,
    pub outward: bool,
    pub solid: u32,
}

/// The two faces of a slab of `solid`.
pub fn slab(solid: u32, low: f32, high: f32) -> [Plane; 2] {
    [(low, false), (high, true)].map(|(z, outward)| Plane { z, outward, solid })
}

/// Light that samples can find.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// None.
    None,
    /// A point on the z axis with an intensity.
    Point(f32, f32),
    /// The sky.
    Sky,
}

/// Planes seen along the z axis, all but at right angles.
pub struct Planes {
    pub planes: Vec<Plane>,
    /// Radiance of rays that escape to -z and to +z.
    pub sky: [f32; 2],
    pub light: Light,
    /// Where the camera is, and the solids it is in, outermost first.
    pub camera: f32,
    pub around: Vec<u32>,
    pub max_depth: u32,
}

impl Default for Planes {
    fn default() -> Self {
        Self {
            planes: Vec::new(),
            sky: [0.0, 1.0],
            light: Light::None,
            camera: -1.0,
            around: Vec::new(),
            max_depth: 200,
        }
    }
}

impl Planes {
    pub fn world(&self, solids: &Solids) -> World {
        let media = Media::build(&solids.infos(), &solids.instances(), &self.around);
        let media = media.unwrap_or_else(|e| panic!("{e}"));
        let word = |p: &Plane| media.of_instance.get(p.solid as usize).copied();
        let row = |p: &Plane| {
            let medium = word(p).unwrap_or(0);
            [p.z.to_bits(), u32::from(p.outward), p.solid, medium]
        };
        let rows: Vec<[u32; 4]> = self.planes.iter().map(row).collect();
        let (light, position, intensity) = match self.light {
            Light::None => (0, 0.0, 0.0),
            Light::Point(z, intensity) => (1, z, intensity),
            Light::Sky => (2, 0.0, 0.0),
        };
        let [back, front] = self.sky;
        let constants = format!(
            "const LIGHT: u32 = {light}u;\nconst POINT_Z: f32 = {position:?};\n\
             const INTENSITY: f32 = {intensity:?};\n\
             const SKY_BACK: f32 = {back:?};\nconst SKY_FRONT: f32 = {front:?};\n"
        );
        let count = format!("const PLANES: u32 = {}u;\n", rows.len());
        let camera = Camera {
            position: Vec3::Z * self.camera,
            look_at: Vec3::Z * (self.camera + 1.0),
            up: Vec3::Y,
            fov: 0.01,
            aperture: 0.0,
            focus: 1.0,
        };
        World {
            width: 16,
            height: 16,
            camera: CameraFrame::new(&camera, 1.0),
            max_depth: self.max_depth,
            roulette_start: 1000,
            outputs: Default::default(),
            parts: SceneParts {
                bounds: [Vec3::NEG_ONE, Vec3::ONE],
                geometry: ShaderPart {
                    wgsl: GEOMETRY.to_string(),
                    buffers: vec![BufferData::new("planes", "array<vec4<u32>>", &rows)],
                },
                bvh: text(count + TRAVERSAL),
                surface: surface::Surface::ByHand(text(SURFACE.to_string())),
                lights: Lights::ByHand {
                    part: text(constants + LIGHTS),
                    sampled: self.light != Light::None,
                    weighted: true,
                },
                media,
                texture: None,
                counts: GeometryCounts::default(),
                unbound: Vec::new(),
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

const GEOMETRY: &str = "
fn plane_z(primitive: u32) -> f32 { return bitcast<f32>(planes[primitive].x); }
fn primitive_instance(primitive: u32) -> u32 { return planes[primitive].z; }
fn primitive_medium(primitive: u32) -> u32 { return planes[primitive].w; }
";

const TRAVERSAL: &str = "
struct Hit { t: f32, u: f32, v: f32, primitive: u32 }

fn trace_closest(origin: vec3<f32>, direction: vec3<f32>, t_max: f32, skip: u32) -> Hit {
    var best = Hit(t_max, 0.0, 0.0, 0xffffffffu);
    for (var i = 0u; i < PLANES; i++) {
        let t = (plane_z(i) - origin.z) / direction.z;
        if i != skip && abs(direction.z) > 1e-6 && t > 0.0 && t < best.t {
            let p = origin + t * direction;
            best = Hit(t, p.x, p.y, i);
        }
    }
    return best;
}

fn trace_any(origin: vec3<f32>, direction: vec3<f32>, t_max: f32, skip: u32) -> bool {
    return trace_closest(origin, direction, t_max, skip).primitive != 0xffffffffu;
}
";

const SURFACE: &str = "
fn hit_position(primitive: u32, uv: vec2<f32>) -> vec3<f32> { return vec3<f32>(uv, plane_z(primitive)); }
fn hit_geometric_normal(primitive: u32) -> vec3<f32> {
    return vec3<f32>(0.0, 0.0, select(-1.0, 1.0, planes[primitive].y == 1u));
}
fn hit_normal(primitive: u32, uv: vec2<f32>) -> vec3<f32> { return hit_geometric_normal(primitive); }
fn hit_uv(primitive: u32, uv: vec2<f32>) -> vec2<f32> { return uv; }
fn hit_tangent(primitive: u32) -> vec3<f32> { return vec3<f32>(0.0); }
fn offset_origin(position: vec3<f32>, normal: vec3<f32>) -> vec3<f32> { return position + 1e-5 * normal; }
";

const LIGHTS: &str = "
const SKY_PDF: f32 = 0.07957747;

fn balance_of_squares(a: f32, b: f32) -> f32 { let r = b / a; return 1.0 / (1.0 + r * r); }

fn light_hit(primitive: u32, t: f32, direction: vec3<f32>, bsdf_pdf: f32) -> vec3<f32> { return vec3<f32>(0.0); }

fn sky(direction: vec3<f32>) -> vec3<f32> { return vec3<f32>(select(SKY_BACK, SKY_FRONT, direction.z > 0.0)); }

fn light_escape(direction: vec3<f32>, bsdf_pdf: f32) -> vec3<f32> {
    var weight = 1.0;
    if bsdf_pdf > 0.0 && LIGHT == 2u { weight = balance_of_squares(bsdf_pdf, SKY_PDF); }
    return weight * sky(direction);
}

struct LightSample { wi: vec3<f32>, distance: f32, radiance: vec3<f32>, pdf: f32 }

fn sample_light(position: vec3<f32>, bits: vec4<u32>) -> LightSample {
    let u = vec4<f32>(bits >> vec4<u32>(8u)) * 0x1p-24;
    if LIGHT == 2u {
        let z = 1.0 - 2.0 * u.y;
        let r = sqrt(1.0 - z * z);
        let wi = vec3<f32>(r * cos(6.2831853 * u.z), r * sin(6.2831853 * u.z), z);
        return LightSample(wi, 3.0e38, sky(wi) / SKY_PDF, SKY_PDF);
    }
    let to_light = vec3<f32>(0.0, 0.0, POINT_Z) - position;
    let distance = length(to_light);
    return LightSample(to_light / distance, distance, vec3<f32>(INTENSITY / (distance * distance)), 0.0);
}
";

pub fn planned(solids: &Solids, strategy: Strategy) -> Plan {
    let names: Vec<String> = solids.infos().into_iter().map(|m| m.name).collect();
    let plan = strategy.plan(&PlanInputs::of_names(&names));
    plan.unwrap_or_else(|e| panic!("{e}"))
}

/// A picture by the processor.
pub fn picture(planes: &Planes, solids: &Solids, samples: u32) -> Rendering {
    render_on(cpu().into(), planes, solids, Strategy::MEGA, samples)
}

pub fn render(planes: &Planes, solids: &Solids, strategy: Strategy, samples: u32) -> Rendering {
    render_on(gpu().into(), planes, solids, strategy, samples)
}

fn render_on(
    device: DeviceRef<'static>,
    planes: &Planes,
    solids: &Solids,
    strategy: Strategy,
    samples: u32,
) -> Rendering {
    let options = RenderOptions {
        samples,
        ..RenderOptions::default()
    };
    let plan = planned(solids, strategy);
    let mut renderer = Renderer::from_world(device, &planes.world(solids), solids, &plan, &options)
        .unwrap_or_else(|e| panic!("{e}"));
    let rendering = renderer.render(&mut |_| ControlFlow::Continue(()));
    let rendering = rendering.unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(rendering.report.nonfinite_samples, 0);
    rendering
}
