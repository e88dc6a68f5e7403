//! A path's state: the one table of its fields, and the WGSL that is derived from it.
//!
//! A field is one `vec4<u32>` in memory, a structure with named components in WGSL. Stages
//! reach it through `load_FIELD(slot)` and `store_FIELD(slot, value)` only. In the wavefront
//! these access a structure of arrays or an array of structures (Laine et al. 2013, section 4.3);
//! in the megakernel the same names access private variables.

use std::fmt::Write;

use crate::needs::{Need, Needs};
use crate::stages::StageId::{
    self, BinExtension, BinShadow, Extension, Logic, Material, NewPath, Shadow,
};
use crate::technique::StateLayout;

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

/// One field of a path's state.
#[derive(Debug)]
pub(crate) struct Field {
    /// Its name; the WGSL structure is `Path` and the name in camel case.
    pub name: &'static str,
    /// Its components, four words in all.
    pub components: &'static [(&'static str, Type)],
    /// When it exists.
    pub need: Need,
    /// The stages that may load it.
    pub readers: &'static [StageId],
    /// The stages that may store it.
    pub writers: &'static [StageId],
}

use Need::{Always, Media, Requests, ShadowRays, SlotShadows};
use Type::{F32, U32, Vec3, Words};

/// Every field there is, in the order of memory. Those that follow each other in pairs are those that
/// stages access together.
pub(crate) const FIELDS: [Field; 11] = [
    // The extension ray: from the camera or the last vertex.
    Field {
        name: "ray_origin",
        components: &[("origin", Vec3), ("pixel", U32)],
        need: Always,
        readers: &[Logic, Material, BinExtension, Extension],
        writers: &[NewPath, Material],
    },
    Field {
        name: "ray_direction",
        components: &[("direction", Vec3), ("sample", U32)],
        need: Always,
        readers: &[Logic, Material, BinExtension, Extension],
        writers: &[NewPath, Material],
    },
    // What it hit: distance, barycentrics, primitive. Until the next extension ray is cast,
    // the primitive is the one that both kinds of ray start on.
    Field {
        name: "hit",
        components: &[("t", F32), ("u", F32), ("v", F32), ("primitive", U32)],
        need: Always,
        readers: &[Logic, Material, Extension],
        writers: &[NewPath, Logic, Extension],
    },
    // The product of f |cos| / pdf so far (0: the path ends), and the density by solid angle
    // with which the extension ray was sampled (0: a discrete direction).
    Field {
        name: "throughput",
        components: &[("throughput", Vec3), ("bsdf_pdf", F32)],
        need: Always,
        readers: &[Logic, Material, Extension],
        writers: &[NewPath, Logic, Material, Extension],
    },
    // Radiance gathered so far; the flags are declared in `constants`.
    Field {
        name: "radiance",
        components: &[("radiance", Vec3), ("flags", U32)],
        need: Always,
        readers: &[Logic, Material],
        writers: &[NewPath, Logic, Material],
    },
    // The sample of a light: where it is, and the ray that asks whether it is seen.
    Field {
        name: "shadow_ray",
        components: &[("direction", Vec3), ("distance", F32)],
        need: ShadowRays,
        readers: &[Material, BinShadow, Shadow],
        writers: &[Logic, Material],
    },
    Field {
        name: "shadow_origin",
        components: &[("origin", Vec3), ("skip", U32)],
        need: SlotShadows,
        readers: &[BinShadow, Shadow],
        writers: &[Material],
    },
    // The path's throughput toward it (0: occluded), and the density with which the material
    // would have sampled that direction.
    Field {
        name: "light_throughput",
        components: &[("throughput", Vec3), ("bsdf_pdf", F32)],
        need: ShadowRays,
        readers: &[Logic],
        writers: &[Material, Shadow],
    },
    // Its radiance over its density, and the density (0: a discrete light).
    Field {
        name: "light_radiance",
        components: &[("radiance", Vec3), ("light_pdf", F32)],
        need: ShadowRays,
        readers: &[Logic],
        writers: &[Logic],
    },
    // The places of its rays in buffers of their own, where their results will be.
    Field {
        name: "requests",
        components: &[
            ("extension", U32),
            ("shadow", U32),
            ("unused0", U32),
            ("unused1", U32),
        ],
        need: Requests,
        readers: &[Logic],
        writers: &[NewPath, Material],
    },
    // The media it is in; see `kernels/media.wgsl`.
    Field {
        name: "media",
        components: &[("stack", Words)],
        need: Media,
        readers: &[Logic, Material, Extension],
        writers: &[NewPath, Material, Extension],
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
         const PATH_RETIRED: u32 = {}u;\n",
        bit(0) - 1,
        bit(0),
        bit(1),
        bit(2),
    )
}

/// The fields that exist, in the order of memory.
pub(crate) fn fields(needs: Needs) -> impl Iterator<Item = &'static Field> {
    FIELDS.iter().filter(move |f| needs.met(f.need))
}

/// Bytes a path takes in memory.
pub(crate) fn path_bytes(needs: Needs) -> u64 {
    fields(needs).count() as u64 * FIELD_BYTES
}

/// Bytes of state that `stage` loads and stores for a path, if it uses all of its fields.
pub(crate) fn traffic(needs: Needs, stage: StageId) -> [u64; 2] {
    let bytes = |touches: fn(&Field) -> &'static [StageId]| {
        let touched = fields(needs).filter(|f| touches(f).contains(&stage));
        touched.count() as u64 * FIELD_BYTES
    };
    [bytes(|f| f.readers), bytes(|f| f.writers)]
}

/// Where accessors find the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Storage {
    /// The buffer `state`.
    Memory(StateLayout),
    /// Private variables; a slot is ignored.
    Registers,
}

/// Structures and accessors for the fields that `stages` access; nothing else is declared, so
/// that a stage that reaches for a field it does not list fails validation.
pub(crate) fn accessors(needs: Needs, stages: &[StageId], storage: Storage) -> String {
    let mut out = String::new();
    let count = fields(needs).count();
    for (region, field) in fields(needs).enumerate() {
        let place = match storage {
            Storage::Memory(StateLayout::Arrays) => Some(format!("{region}u * POOL_SIZE + slot")),
            Storage::Memory(StateLayout::Pairs) => {
                let (first, half) = (region - region % 2, region % 2);
                Some(match first + 1 < count {
                    true => format!("{first}u * POOL_SIZE + 2u * slot + {half}u"),
                    false => format!("{first}u * POOL_SIZE + slot"),
                })
            }
            Storage::Memory(StateLayout::Structures) => {
                Some(format!("{count}u * slot + {region}u"))
            }
            Storage::Registers => None,
        };
        let read = field.readers.iter().any(|s| stages.contains(s));
        let written = field.writers.iter().any(|s| stages.contains(s));
        if !read && !written {
            continue;
        }
        out += &structure(field);
        if place.is_none() {
            let (name, ty) = (field.name, type_name(field));
            let _ = writeln!(out, "var<private> state_{name}: {ty};");
        }
        if read {
            out += &load(field, place.as_deref());
        }
        if written {
            out += &store(field, place.as_deref());
        }
    }
    out
}

fn type_name(field: &Field) -> String {
    let camel = field.name.split('_').map(|word| {
        let (first, rest) = word.split_at(1);
        first.to_uppercase() + rest
    });
    format!("Path{}", camel.collect::<String>())
}

fn structure(field: &Field) -> String {
    let member = |(name, ty): &(&str, Type)| format!("{name}: {}", ty.wgsl());
    let members: Vec<String> = field.components.iter().map(member).collect();
    format!("struct {} {{ {} }}\n", type_name(field), members.join(", "))
}

/// Reads the word of `state` at `place`, or the private variable.
fn load(field: &Field, place: Option<&str>) -> String {
    let (name, ty) = (field.name, type_name(field));
    let Some(place) = place else {
        return format!("fn load_{name}(slot: u32) -> {ty} {{ return state_{name}; }}\n");
    };
    let mut first = 0;
    let part = |(_, component): &(&str, Type)| {
        let swizzle = &"xyzw"[first..first + component.words()];
        first += component.words();
        match component {
            Type::U32 | Type::Words => format!("words.{swizzle}"),
            _ => format!("bitcast<{}>(words.{swizzle})", component.wgsl()),
        }
    };
    let parts: Vec<String> = field.components.iter().map(part).collect();
    format!(
        "fn load_{name}(slot: u32) -> {ty} {{\n    \
         let words = state[{place}];\n    \
         return {ty}({});\n}}\n",
        parts.join(", ")
    )
}

/// Writes the word of `state` at `place`, or the private variable.
fn store(field: &Field, place: Option<&str>) -> String {
    let (name, ty) = (field.name, type_name(field));
    let Some(place) = place else {
        return format!("fn store_{name}(slot: u32, value: {ty}) {{ state_{name} = value; }}\n");
    };
    let part = |(component, ty): &(&str, Type)| match ty {
        Type::U32 | Type::Words => format!("value.{component}"),
        _ => format!("bitcast<{}>(value.{component})", ty.words_type()),
    };
    let parts: Vec<String> = field.components.iter().map(part).collect();
    format!(
        "fn store_{name}(slot: u32, value: {ty}) {{\n    \
         state[{place}] = vec4<u32>({});\n}}\n",
        parts.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use wgpu::naga;

    const EVERYTHING: Needs = Needs {
        shadow_rays: true,
        requests: false,
        media: true,
        absorption: true,
        overlap: true,
        varying_emission: true,
        order: true,
    };
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
        let requests = Needs {
            requests: true,
            ..EVERYTHING
        };
        for needs in [EVERYTHING, requests] {
            let text = format!(
                "const POOL_SIZE: u32 = 1u;\n\
                 @group(0) @binding(0) var<storage, read_write> state: array<vec4<u32>>;\n{}",
                accessors(needs, &EVERY_STAGE, Storage::Memory(StateLayout::Arrays))
            );
            let (module, _) = crate::gpu::shader::validate("state", &text).expect("valid WGSL");
            let mut layouter = naga::proc::Layouter::default();
            layouter.update(module.to_ctx()).expect("a layout");
            for field in fields(needs) {
                check_layout(field, &module, &layouter);
            }
        }
    }

    fn check_layout(field: &Field, module: &naga::Module, layouter: &naga::proc::Layouter) {
        let (handle, ty) = module
            .types
            .iter()
            .find(|(_, ty)| ty.name.as_deref() == Some(&type_name(field)))
            .expect("the field's structure");
        assert_eq!(
            u64::from(layouter[handle].size),
            FIELD_BYTES,
            "{}",
            field.name
        );
        let naga::TypeInner::Struct { members, .. } = &ty.inner else {
            panic!("{} is no structure", field.name);
        };
        let mut words = 0;
        for ((name, ty), member) in field.components.iter().zip(members) {
            assert_eq!(member.name.as_deref(), Some(*name));
            assert_eq!(member.offset as usize, words * 4, "{}.{name}", field.name);
            words += ty.words();
        }
        assert_eq!(words * 4, FIELD_BYTES as usize);
    }

    #[test]
    fn a_scene_without_sampled_lights_stores_no_shadow_rays() {
        assert_eq!(path_bytes(Needs::default()), 80);
        assert_eq!(path_bytes(EVERYTHING), 160);
        let text = accessors(
            Needs::default(),
            &EVERY_STAGE,
            Storage::Memory(StateLayout::Arrays),
        );
        assert!(!text.contains("shadow"), "{text}");
        assert!(!text.contains("media"), "{text}");
    }

    /// A stage listed as a reader or writer that does not access the field would make kernels
    /// carry code they do not use, and the table a lie.
    #[test]
    fn stages_access_every_field_that_lists_them() {
        for stage in &crate::stages::STAGES {
            for field in &FIELDS {
                for (access, listed) in [("load", field.readers), ("store", field.writers)] {
                    let call = format!("{access}_{}(", field.name);
                    let calls = stage.body.contains(&call);
                    assert_eq!(calls, listed.contains(&stage.id), "{}: {call}", stage.name);
                }
            }
        }
    }
}
