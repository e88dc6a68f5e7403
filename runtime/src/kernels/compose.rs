//! The text of one kernel: constants, accessors of path state, the parts that its stages name
//! in the stage table, the stage functions, and the shell with the entry point.
//!
//! Buffers are declared if the text mentions them, so that a kernel binds what it uses and
//! nothing else.

use impasto_compiler::abi::{InputSet, MATERIAL_OF};

use crate::film;
use crate::kernels::buffers::{Access, BUFFERS, BufferId};
use crate::kernels::camera;
use crate::kernels::cones;
use crate::kernels::modules::{Composer, Kernel, KernelDesc};
use crate::kernels::order;
use crate::kernels::outputs;
use crate::kernels::profile;
use crate::kernels::run;
use crate::kernels::stages::{Part, Stage};
use crate::kernels::state::{self, Storage};
use crate::kernels::surface_point;
use crate::kernels::tiles;
use crate::wgsl;
use crate::wgsl::template::{Flag, template};
use crate::wgsl::text::{mentions, predicate, reachable, without_comments};
use crate::wgsl::{BufferData, ShaderPart};
use crate::world::camera::wgsl as camera_rays;
use crate::world::media;
use crate::world::needs::Need;

/// A buffer as a kernel binds it, in group 0.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Binding {
    /// The index, the same in all kernels of a plan.
    pub index: u32,
    /// The WGSL variable.
    pub name: &'static str,
    /// What kernels may do with it.
    pub access: Access,
}

impl Composer<'_> {
    /// Writes the text of the kernel that comes `index`-th in an iteration.
    pub(crate) fn compose(&self, index: usize, desc: KernelDesc) -> Kernel {
        let (stages, members) = (&desc.stages, &desc.members);
        let storage = if !self.layout.wavefront {
            Storage::Registers
        } else if desc.holds {
            Storage::Held(self.technique.state)
        } else {
            Storage::Memory(self.technique.state)
        };
        let mut text = self.constants(&desc);
        text += &state::accessors(self.layout.needs, stages, storage);
        let mut parts: Vec<Part> = stages
            .iter()
            .flat_map(|stage| stage.parts_in(self.layout.needs))
            .collect();
        parts.sort_unstable();
        parts.dedup();
        for part in parts {
            text += &self.part(part, members);
        }
        for stage in stages {
            text += &self.body(stage, members);
        }
        text += &desc.shell;
        if mentions(&without_comments(&text), MATERIAL_OF) {
            text += &self.source.lookup_wgsl();
        }
        if self.technique.profile {
            text = profile::instrument(&text) + &self.profile_constants(index);
        }
        let text = reachable(&text);
        let (declarations, bindings) = self.declarations(&text);
        Kernel {
            desc,
            wgsl: declarations + &text,
            bindings,
        }
    }

    /// A stage's text in a kernel that evaluates `members`.
    pub(crate) fn body(&self, stage: &Stage, members: &[usize]) -> String {
        stage.body.wgsl(&self.flags(stage, members))
    }

    /// The conditions of a stage's text.
    fn flags(&self, stage: &Stage, members: &[usize]) -> Vec<Flag> {
        let needs = self.needs_in(stage, members);
        let derived = [
            ("slot_shadows", needs.met(state::SLOT_SHADOWS)),
            ("own_shadow_origins", needs.met(state::OWN_SHADOW_ORIGINS)),
            ("fetched", self.fetches(stage)),
            ("wavefront", self.layout.wavefront),
        ];
        needs.flags().chain(derived).collect()
    }

    fn constants(&self, desc: &KernelDesc) -> String {
        let (world, sizes) = (self.world, self.sizes);
        let mut out = wgsl::constants_u32(&[
            ("POOL_SIZE", sizes.pool),
            ("WORKGROUP_SIZE", sizes.workgroup_of(desc)),
            ("ROW_GROUPS", sizes.row_groups),
            ("PIXELS", world.width * world.height),
            ("TILE_WIDTH", tiles::TILE[0]),
            ("TILE_HEIGHT", tiles::TILE[1]),
            ("MAX_DEPTH", world.max_depth),
            ("ROULETTE_START", world.roulette_start),
            ("NOTHING", u32::MAX),
            ("FILM_COUNT_PLANE", film::COUNT_PLANE as u32),
        ]);
        if self.layout.needs.has(Need::Media) {
            let [a, b, c, d] = world.parts.media.camera;
            out += &format!("const CAMERA_MEDIA = vec4<u32>({a}u, {b}u, {c}u, {d}u);\n");
        }
        if self.layout.needs.has(Need::RayCones) {
            out += &cones::constants();
        }
        out + &self.layout.counters.constants() + &state::constants()
    }

    fn profile_constants(&self, kernel: usize) -> String {
        wgsl::constants_u32(&[
            ("COUNTER_LANES", self.layout.counters.lanes(kernel) as u32),
            ("SUBGROUP_SIZE", self.subgroup_size),
        ])
    }

    fn part(&self, part: Part, members: &[usize]) -> String {
        let (world, parts) = (self.world, self.parts);
        match part {
            Part::Random => self.random.wgsl.clone(),
            Part::Camera => {
                let lens = self.layout.needs.has(Need::Lens);
                camera_rays(world.width, world.height, lens)
            }
            Part::Film => {
                let flags: Vec<Flag> = self.layout.needs.flags().collect();
                template!("film.wgsl").wgsl(&flags)
            }
            Part::Numbers => include_str!("numbers.wgsl").to_string(),
            Part::Geometry => parts.geometry.wgsl.clone(),
            Part::Surface => parts.surface.wgsl.clone(),
            Part::Mis => crate::world::lights::mis().wgsl,
            Part::Lights => parts.lights.wgsl.clone(),
            Part::Media => text(parts.media.as_ref()),
            Part::Order => order::bins(self.technique.ray_order, world.parts.bounds),
            Part::Flights => media::flights(self.layout.needs),
            Part::Traversal => parts.bvh.wgsl.clone(),
            Part::Materials => self.materials(members),
            Part::Roulette => include_str!("roulette.wgsl").to_string(),
            Part::Fates => self.fates(),
            Part::Outputs => {
                let layers = &world.outputs.layers;
                text(parts.outputs.as_ref()) + &outputs::text(layers, self.layout.needs)
            }
        }
    }

    /// Generated code for `members`, what it reads, and how its surface point is filled.
    fn materials(&self, members: &[usize]) -> String {
        let infos = self.infos(members);
        let textured = infos.iter().any(|m| !m.textures.is_empty());
        let mut out = text(self.parts.texture.as_ref().filter(|_| textured));
        out += &self.source.wgsl(members);
        let needs = self.needs_of(members);
        if needs.has(Need::VaryingEmission) && infos.iter().all(|m| !m.varying_emission) {
            out += NO_EMISSION;
        }
        let seen = infos
            .iter()
            .map(|m| m.inputs)
            .fold(InputSet::default(), InputSet::or);
        out += &surface_point::text(needs, seen);
        out + &dropped_row(members)
    }

    /// What the logic stage must know of every material that paths can hit, as functions of an instance.
    fn fates(&self) -> String {
        let (infos, planned) = (self.materials, self.planned());
        let smooth = |i: usize| !infos[i].delta_only;
        let emits = |i: usize| infos[i].varying_emission;
        predicate("scatters_sampled_light", &planned, smooth)
            + &predicate("needs_last_evaluation", &planned, emits)
    }

    /// Declarations of the buffers that `text` mentions.
    fn declarations(&self, text: &str) -> (String, Vec<Binding>) {
        let code = without_comments(text);
        let scene = self.scene_buffers();
        let scene = scene.map(|b| (b.name, b.wgsl_type, Access::Read));
        let mut out = String::new();
        let mut bindings = Vec::new();
        let own = BUFFERS.iter().map(|b| (b.name, b.wgsl_type, b.access));
        for (index, (name, ty, access)) in own.chain(scene).enumerate() {
            if !mentions(&code, name) {
                continue;
            }
            let space = match access {
                Access::Uniform => {
                    out += &uniform(name, ty);
                    "uniform"
                }
                Access::Read => "storage, read",
                Access::ReadWrite => "storage, read_write",
            };
            out += &format!("@group(0) @binding({index}) var<{space}> {name}: {ty};\n");
            bindings.push(Binding {
                index: index as u32,
                name,
                access,
            });
        }
        (out, bindings)
    }

    /// The buffers of all parts of the scene, and the tables of its materials.
    pub(crate) fn scene_buffers(&self) -> impl Iterator<Item = &BufferData> {
        self.read_parts()
            .flat_map(|part| &part.buffers)
            .chain(self.tables)
    }

    /// The words of the uniform `camera`.
    pub(crate) fn camera(&self) -> camera::Words {
        let world = self.world;
        camera::words(&world.camera, world.width, world.height)
    }

    /// Random numbers and the parts of the scene.
    pub(crate) fn read_parts(&self) -> impl Iterator<Item = &ShaderPart> {
        std::iter::once(self.random).chain(self.parts.all())
    }
}

/// The structure of the uniform of a name.
fn uniform(name: &str, ty: &str) -> String {
    if name == BufferId::Camera.row().name {
        camera::declaration(ty)
    } else {
        run::declaration(ty)
    }
}

/// The text of a part that is there if it is needed.
fn text(part: Option<&ShaderPart>) -> String {
    part.map_or_else(String::new, |part| part.wgsl.clone())
}

/// The function that gives the row that samples of an instance are counted in if they are dropped.
fn dropped_row(members: &[usize]) -> String {
    let row = match members {
        [sole] => format!("{sole}u"),
        _ => format!("{MATERIAL_OF}(instance)"),
    };
    format!("fn dropped_row(instance: u32) -> u32 {{ return {row}; }}\n")
}

/// The emission of materials of which none has any that varies, where it is asked for nevertheless.
const NO_EMISSION: &str = "fn material_emission(instance: u32, point: SurfacePoint, wo: vec3<f32>) -> vec3<f32> {\n    \
                           return vec3<f32>(0.0);\n}\n";
