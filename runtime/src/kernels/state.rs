//! A path's state: the one table of its fields, and the WGSL that is derived from it.
//!
//! A field is one `vec4<u32>` in memory. Much of it matters for a part of an iteration only: from where a ray
//! was cast until what it hit is known, from the choice of a light until the material has answered. So a
//! field may have several uses, each a name with components of its own, for the words mean one
//! thing here and another there. Stages reach a use through `load_USE(slot)` and `store_USE(slot, value)` only.
//! In the wavefront these access a structure of arrays or an array of structures (Laine et al. 2013,
//! section 4.3); in the megakernel the same names access private variables.

use std::fmt::Write;

use crate::kernels::stages::StageId::{
    self, BinExtension, BinShadow, Extension, Logic, Material, NewPath, Shadow,
};
use crate::technique::StateLayout;
use crate::world::needs::{ALWAYS, Need, Needs, When, when};

/// Bytes that every field takes.
pub(crate) const FIELD_BYTES: u64 = 16;

/// A component's type in WGSL.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Type {
    U32,
    F32,
    Vec3,
    Words,
}

impl Type {
    fn wgsl(self) -> &'static str {
        match self {
            Type::U32 => "u32",
            Type::F32 => "f32",
            Type::Vec3 => "vec3<f32>",
            Type::Words => "vec4<u32>",
        }
    }

    /// How many of a field's four words it takes.
    fn words(self) -> usize {
        match self {
            Type::U32 | Type::F32 => 1,
            Type::Vec3 => 3,
            Type::Words => 4,
        }
    }

    /// The same number of words as unsigned integers.
    fn words_type(self) -> &'static str {
        match self {
            Type::U32 | Type::F32 => "u32",
            Type::Vec3 => "vec3<u32>",
            Type::Words => "vec4<u32>",
        }
    }
}

/// One field of a path's state: four words, which exist if one of their uses does.
#[derive(Debug)]
pub(crate) struct Field {
    /// What the words mean, in the order of an iteration.
    pub uses: &'static [Use],
}

/// A meaning of a field's words.
#[derive(Debug)]
pub(crate) struct Use {
    /// Its name; the WGSL structure is `Path` and the name in camel case. No two that exist
    /// in a scene are called the same.
    pub name: &'static str,
    /// Its components, four words in all.
    pub components: &'static [(&'static str, Type)],
    /// When it exists.
    pub need: When,
    /// The stages that may load it.
    pub readers: &'static [StageId],
    /// The stages that may store it.
    pub writers: &'static [StageId],
}

/// Shadow rays, where they are part of the path's state.
pub(crate) const SLOT_SHADOWS: When = When {
    all: &[Need::ShadowRays],
    none: &[Need::Requests],
};
/// Those that may begin on another side of a surface than extension rays.
pub(crate) const OWN_SHADOW_ORIGINS: When = When {
    all: &[Need::ShadowRays, Need::CrossingShadows],
    none: &[Need::Requests],
};
/// Those that do not.
const SHARED_ORIGINS: When = When {
    all: &[Need::ShadowRays],
    none: &[Need::Requests, Need::CrossingShadows],
};
/// Where light may be turned on its way, which casting rays then tells.
const TURNING: When = when(&[Need::Scattering]);
/// Where it goes straight on.
const STRAIGHT: When = When {
    all: &[],
    none: &[Need::Scattering],
};
/// Shadow rays, wherever they are.
const SHADOW_RAYS: When = when(&[Need::ShadowRays]);

/// Cones of rays that see what they meet, where casting rays does not change them.
const CONES: When = When {
    all: &[Need::RayCones],
    none: &[Need::Overlap, Need::Scattering],
};
/// Those that boundaries of hidden media widen on the way.
const CROSSING_CONES: When = when(&[Need::RayCones, Need::Overlap]);
/// Those that only light which is turned on the way widens.
const TURNING_CONES: When = When {
    all: &[Need::RayCones, Need::Scattering],
    none: &[Need::Overlap],
};

use Type::{F32, U32, Vec3, Words};

const CONE: &[(&str, Type)] = &[
    ("width", F32),
    ("spread", F32),
    ("unused0", U32),
    ("unused1", U32),
];

/// Every field there is, in the order of memory. Those that follow each other in pairs are those that
/// stages access together.
pub(crate) const FIELDS: [Field; 11] = [
    Field {
        uses: &[
            // The extension ray: from the camera or the last vertex.
            Use {
                name: "ray_origin",
                components: &[("origin", Vec3), ("pixel", U32)],
                need: ALWAYS,
                readers: &[Logic, Material, BinExtension, Extension],
                writers: &[NewPath, Material],
            },
            // Where a light was sampled, the way to it: when that is asked for, where the ray began
            // is known no longer, since the hit says where the vertex is.
            Use {
                name: "light_direction",
                components: &[("direction", Vec3), ("pixel", U32)],
                need: SHADOW_RAYS,
                readers: &[Material],
                writers: &[Logic],
            },
            // Where no material is crossed, both rays begin at the same place.
            Use {
                name: "shadow_origin",
                components: &[("origin", Vec3), ("pixel", U32)],
                need: SHARED_ORIGINS,
                readers: &[BinShadow, Shadow],
                writers: &[Material],
            },
        ],
    },
    Field {
        uses: &[
            Use {
                name: "ray_direction",
                components: &[("direction", Vec3), ("sample", U32)],
                need: STRAIGHT,
                readers: &[Logic, Material, BinExtension, Extension],
                writers: &[NewPath, Material],
            },
            // Until the ray is cast, the direction in which it begins; then that in which it arrives.
            Use {
                name: "ray_direction",
                components: &[("direction", Vec3), ("sample", U32)],
                need: TURNING,
                readers: &[Logic, Material, BinExtension, Extension],
                writers: &[NewPath, Material, Extension],
            },
        ],
    },
    Field {
        uses: &[
            // What the extension ray hit: distance, barycentrics, primitive. Until the next is cast,
            // the primitive is the one that both kinds of ray start on.
            Use {
                name: "hit",
                components: &[("t", F32), ("u", F32), ("v", F32), ("primitive", U32)],
                need: ALWAYS,
                readers: &[Logic, Material, Extension],
                writers: &[NewPath, Logic, Extension],
            },
            // The shadow ray's direction, once the material has been evaluated at the hit.
            Use {
                name: "shadow_direction",
                components: &[("direction", Vec3), ("primitive", U32)],
                need: SLOT_SHADOWS,
                readers: &[BinShadow, Shadow],
                writers: &[Material],
            },
        ],
    },
    Field {
        uses: &[
            // The product of f |cos| / pdf so far (0: the path ends), and the density by solid angle
            // with which the extension ray was sampled (0: a discrete direction).
            Use {
                name: "throughput",
                components: &[("throughput", Vec3), ("bsdf_pdf", F32)],
                need: ALWAYS,
                readers: &[Logic, Material, Extension],
                writers: &[NewPath, Logic, Material, Extension],
            },
            // What is carried to the next vertex, and the density with which a light was
            // sampled there (0: a discrete light), once emission has been weighed by the former.
            Use {
                name: "carried",
                components: &[("throughput", Vec3), ("light_pdf", F32)],
                need: SHADOW_RAYS,
                readers: &[Material],
                writers: &[Logic],
            },
        ],
    },
    Field {
        // Radiance gathered so far; the flags are declared in `constants`.
        uses: &[
            Use {
                name: "radiance",
                components: &[("radiance", Vec3), ("flags", U32)],
                need: STRAIGHT,
                readers: &[Logic, Material],
                writers: &[NewPath, Logic, Material],
            },
            // Turns have random numbers by the vertex at which the ray was cast.
            Use {
                name: "radiance",
                components: &[("radiance", Vec3), ("flags", U32)],
                need: TURNING,
                readers: &[Logic, Material, Extension],
                writers: &[NewPath, Logic, Material],
            },
        ],
    },
    Field {
        uses: &[
            // The sample of a light: its radiance over its density, and how far it is.
            Use {
                name: "light",
                components: &[("radiance", Vec3), ("distance", F32)],
                need: SHADOW_RAYS,
                readers: &[Material],
                writers: &[Logic],
            },
            // What of it reaches the camera unless the shadow ray is blocked (then 0), and how far
            // that goes.
            Use {
                name: "contribution",
                components: &[("radiance", Vec3), ("distance", F32)],
                need: SHADOW_RAYS,
                readers: &[Logic, Shadow],
                writers: &[Material, Shadow],
            },
        ],
    },
    Field {
        // Where the shadow ray begins if that may be on another side than where the extension ray does.
        uses: &[Use {
            name: "shadow_origin",
            components: &[("origin", Vec3), ("pixel", U32)],
            need: OWN_SHADOW_ORIGINS,
            readers: &[BinShadow, Shadow],
            writers: &[Material],
        }],
    },
    Field {
        // The places of its rays in buffers of their own, where their results will be.
        uses: &[Use {
            name: "requests",
            components: &[
                ("extension", U32),
                ("shadow", U32),
                ("unused0", U32),
                ("unused1", U32),
            ],
            need: when(&[Need::Requests]),
            readers: &[Logic],
            writers: &[NewPath, Material],
        }],
    },
    Field {
        // The cone that its ray stands for: how wide it is where the ray begins, in metres, and by how
        // much a metre it widens; see docs/filtering.md.
        uses: &[
            Use {
                name: "cone",
                components: CONE,
                need: CONES,
                readers: &[Material],
                writers: &[NewPath, Material],
            },
            Use {
                name: "cone",
                components: CONE,
                need: CROSSING_CONES,
                readers: &[Material, Extension],
                writers: &[NewPath, Material, Extension],
            },
            Use {
                name: "cone",
                components: CONE,
                need: TURNING_CONES,
                readers: &[Material, Extension],
                writers: &[NewPath, Material, Extension],
            },
        ],
    },
    Field {
        // The group of the light that was sampled, until what it brings is gathered.
        uses: &[Use {
            name: "light_group",
            components: &[
                ("group", U32),
                ("unused0", U32),
                ("unused1", U32),
                ("unused2", U32),
            ],
            need: when(&[Need::LightGroups, Need::ShadowRays]),
            readers: &[Logic],
            writers: &[Logic],
        }],
    },
    Field {
        // The media it is in; see `kernels/media.wgsl`.
        uses: &[Use {
            name: "media",
            components: &[("stack", Words)],
            need: when(&[Need::Media]),
            readers: &[Logic, Material, Extension],
            writers: &[NewPath, Material, Extension],
        }],
    },
];

/// Bits of `flags` that count path segments; the rest are flags.
const DEPTH_BITS: u32 = 13;
/// The longest path that can be asked for, in segments. One number more is in use, by the
/// evaluation of a last vertex that only emits.
pub(crate) const MAX_DEPTH: u32 = (1 << DEPTH_BITS) - 2;

/// The WGSL constants that say what the bits of `flags` mean.
pub(crate) fn constants() -> String {
    let bit = |n: u32| 1u32 << (DEPTH_BITS + n);
    format!(
        "// Number of the path's extension ray, counted from 1.\n\
         const DEPTH_MASK: u32 = {}u;\n\
         // A light sample waits to be added.\n\
         const PATH_LIT: u32 = {}u;\n\
         const PATH_LIVE: u32 = {}u;\n\
         // No work is left for the slot.\n\
         const PATH_RETIRED: u32 = {}u;\n\
         // The path has ended; its first hit is asked how it looks.\n\
         const PATH_LOOKS: u32 = {}u;\n",
        bit(0) - 1,
        bit(0),
        bit(1),
        bit(2),
        bit(3),
    )
}

impl Field {
    /// The uses that exist.
    fn uses(&self, needs: Needs) -> impl Iterator<Item = &'static Use> {
        self.uses.iter().filter(move |u| needs.met(u.need))
    }

    /// Its name, that of its first use.
    fn name(&self) -> &'static str {
        self.uses.first().map_or("", |u| u.name)
    }
}

/// The fields that exist, in the order of memory.
pub(crate) fn fields(needs: Needs) -> impl Iterator<Item = &'static Field> {
    FIELDS
        .iter()
        .filter(move |f| f.uses(needs).next().is_some())
}

/// Bytes a path takes in memory.
pub(crate) fn path_bytes(needs: Needs) -> u64 {
    fields(needs).count() as u64 * FIELD_BYTES
}

/// Bytes of state that `stage` loads and stores for a path, if it accesses every field that it lists once.
pub(crate) fn traffic(needs: Needs, stage: StageId) -> [u64; 2] {
    let bytes = |stages: fn(&Use) -> &'static [StageId]| {
        let touched = fields(needs).filter(|f| f.uses(needs).any(|u| stages(u).contains(&stage)));
        touched.count() as u64 * FIELD_BYTES
    };
    [bytes(|u| u.readers), bytes(|u| u.writers)]
}

/// Where accessors find the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Storage {
    /// The buffer `state`.
    Memory(StateLayout),
    /// Private variables; a slot is ignored.
    Registers,
}

/// Structures and accessors for the uses of fields that `stages` access; nothing else is declared, so
/// that a stage that reaches for what it does not list fails validation.
pub(crate) fn accessors(needs: Needs, stages: &[StageId], storage: Storage) -> String {
    let mut out = String::new();
    let count = fields(needs).count();
    for (region, field) in fields(needs).enumerate() {
        let place = place(field, region, count, storage);
        let mut accessed = String::new();
        for u in field.uses(needs) {
            let read = u.readers.iter().any(|s| stages.contains(s));
            let written = u.writers.iter().any(|s| stages.contains(s));
            if read || written {
                accessed += &structure(u);
            }
            if read {
                accessed += &load(u, &place);
            }
            if written {
                accessed += &store(u, &place);
            }
        }
        if !accessed.is_empty() && storage == Storage::Registers {
            let _ = writeln!(out, "var<private> {place}: vec4<u32>;");
        }
        out += &accessed;
    }
    out
}

/// Where the words of a field are, the `region`-th of `count`.
fn place(field: &Field, region: usize, count: usize, storage: Storage) -> String {
    match storage {
        Storage::Memory(StateLayout::Arrays) => format!("state[{region}u * POOL_SIZE + slot]"),
        Storage::Memory(StateLayout::Pairs) => {
            let (first, half) = (region - region % 2, region % 2);
            match first + 1 < count {
                true => format!("state[{first}u * POOL_SIZE + 2u * slot + {half}u]"),
                false => format!("state[{first}u * POOL_SIZE + slot]"),
            }
        }
        Storage::Memory(StateLayout::Structures) => format!("state[{count}u * slot + {region}u]"),
        Storage::Registers => format!("state_{}", field.name()),
    }
}

fn type_name(u: &Use) -> String {
    let camel = u.name.split('_').map(|word| {
        let (first, rest) = word.split_at(1);
        first.to_uppercase() + rest
    });
    format!("Path{}", camel.collect::<String>())
}

fn structure(u: &Use) -> String {
    let member = |(name, ty): &(&str, Type)| format!("{name}: {}", ty.wgsl());
    let members: Vec<String> = u.components.iter().map(member).collect();
    format!("struct {} {{ {} }}\n", type_name(u), members.join(", "))
}

/// Reads the words at `place`.
fn load(u: &Use, place: &str) -> String {
    let (name, ty) = (u.name, type_name(u));
    let mut first = 0;
    let part = |(_, component): &(&str, Type)| {
        let swizzle = &"xyzw"[first..first + component.words()];
        first += component.words();
        match component {
            Type::U32 | Type::Words => format!("words.{swizzle}"),
            _ => format!("bitcast<{}>(words.{swizzle})", component.wgsl()),
        }
    };
    let parts: Vec<String> = u.components.iter().map(part).collect();
    format!(
        "fn load_{name}(slot: u32) -> {ty} {{\n    \
         let words = {place};\n    \
         return {ty}({});\n}}\n",
        parts.join(", ")
    )
}

/// Writes the words at `place`.
fn store(u: &Use, place: &str) -> String {
    let (name, ty) = (u.name, type_name(u));
    let part = |(component, ty): &(&str, Type)| match ty {
        Type::U32 | Type::Words => format!("value.{component}"),
        _ => format!("bitcast<{}>(value.{component})", ty.words_type()),
    };
    let parts: Vec<String> = u.components.iter().map(part).collect();
    format!(
        "fn store_{name}(slot: u32, value: {ty}) {{\n    \
         {place} = vec4<u32>({});\n}}\n",
        parts.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use wgpu::naga;

    const EVERYTHING: Needs = Needs::of_rows(&[
        Need::ShadowRays,
        Need::CrossingShadows,
        Need::Media,
        Need::Absorption,
        Need::Overlap,
        Need::Order,
        Need::RayCones,
    ]);
    const EVERY_STAGE: [StageId; 7] = [
        Logic,
        NewPath,
        Material,
        BinShadow,
        Shadow,
        BinExtension,
        Extension,
    ];

    /// naga lays a field's structure out on exactly the words that the accessors pack.
    #[test]
    fn fields_fill_four_words_as_naga_lays_them_out() {
        let requests = EVERYTHING.with(Need::Requests);
        let shared = EVERYTHING.without(Need::CrossingShadows);
        for needs in [EVERYTHING, requests, shared] {
            let text = format!(
                "const POOL_SIZE: u32 = 1u;\n\
                 @group(0) @binding(0) var<storage, read_write> state: array<vec4<u32>>;\n{}",
                accessors(needs, &EVERY_STAGE, Storage::Memory(StateLayout::Arrays))
            );
            let (module, _) = crate::gpu::shader::validate("state", &text).expect("valid WGSL");
            let mut layouter = naga::proc::Layouter::default();
            layouter.update(module.to_ctx()).expect("a layout");
            for u in fields(needs).flat_map(|f| f.uses(needs)) {
                check_layout(u, &module, &layouter);
            }
        }
    }

    fn check_layout(u: &Use, module: &naga::Module, layouter: &naga::proc::Layouter) {
        let (handle, ty) = module
            .types
            .iter()
            .find(|(_, ty)| ty.name.as_deref() == Some(&type_name(u)))
            .expect("the use's structure");
        assert_eq!(u64::from(layouter[handle].size), FIELD_BYTES, "{}", u.name);
        let naga::TypeInner::Struct { members, .. } = &ty.inner else {
            panic!("{} is no structure", u.name);
        };
        let mut words = 0;
        for ((name, ty), member) in u.components.iter().zip(members) {
            assert_eq!(member.name.as_deref(), Some(*name));
            assert_eq!(member.offset as usize, words * 4, "{}.{name}", u.name);
            words += ty.words();
        }
        assert_eq!(words * 4, FIELD_BYTES as usize);
    }

    /// A stage that stores one use and one that loads another of the same field mean the same words, so
    /// components that both have must be at the same place.
    #[test]
    fn uses_of_a_field_agree_on_what_they_share() {
        let offset = |u: &Use, name: &str| {
            let before = u.components.iter().take_while(|(n, _)| *n != name);
            before.map(|(_, ty)| ty.words()).sum::<usize>()
        };
        for field in &FIELDS {
            for (a, b) in field
                .uses
                .iter()
                .flat_map(|a| field.uses.iter().map(move |b| (a, b)))
            {
                for shared in a.components.iter().filter(|c| b.components.contains(c)) {
                    assert_eq!(offset(a, shared.0), offset(b, shared.0), "{}", a.name);
                }
            }
        }
    }

    #[test]
    fn a_scene_without_sampled_lights_stores_no_shadow_rays() {
        assert_eq!(path_bytes(Needs::default()), 80);
        let lit = Needs::of_rows(&[Need::ShadowRays]);
        assert_eq!(path_bytes(lit), 96);
        assert_eq!(path_bytes(EVERYTHING), 144);
        let text = accessors(
            Needs::default(),
            &EVERY_STAGE,
            Storage::Memory(StateLayout::Arrays),
        );
        assert!(!text.contains("shadow"), "{text}");
        assert!(!text.contains("media"), "{text}");
        assert!(!text.contains("cone"), "{text}");
    }

    /// A stage listed as a reader or writer that does not access the words would make kernels
    /// carry code they do not use, and the table a lie.
    #[test]
    fn stages_access_every_use_that_lists_them() {
        let all = || FIELDS.iter().flat_map(|f| f.uses);
        for stage in &crate::kernels::stages::STAGES {
            for u in all() {
                for (access, stages) in [("load", readers as fn(&Use) -> _), ("store", writers)] {
                    let call = format!("{access}_{}(", u.name);
                    let of_name = all().filter(|other| other.name == u.name);
                    let listed = of_name
                        .map(stages)
                        .any(|s: &[StageId]| s.contains(&stage.id));
                    let calls = stage.body.text.contains(&call);
                    assert_eq!(calls, listed, "{}: {call}", stage.name);
                }
            }
        }
    }

    fn readers(u: &Use) -> &'static [StageId] {
        u.readers
    }

    fn writers(u: &Use) -> &'static [StageId] {
        u.writers
    }
}
