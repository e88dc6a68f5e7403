//! The WGSL through which stages reach the state of paths. In the wavefront it accesses a structure of arrays or
//! an array of structures (Laine et al. 2013, section 4.3); in the megakernel the same names access private
//! variables.

use std::fmt::Write;

use super::{Field, Type, Use, fields};
use crate::kernels::stages::{STAGES, Stage, Work};
use crate::technique::StateLayout;
use crate::world::needs::Needs;

/// Where accessors find the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Storage {
    /// The buffer `state`.
    Memory(StateLayout),
    /// Private variables; a slot is ignored.
    Registers,
    /// The buffer, of which a path's words are held in private variables from `take_up`, or from when it begins, until
    /// `put_down`, which may be at another slot.
    Held(StateLayout),
}

/// Structures and accessors for the uses of fields that `stages` access; nothing else is declared, so
/// that a stage that reaches for what it does not list fails validation.
pub(crate) fn accessors(needs: Needs, stages: &[&Stage], storage: Storage) -> String {
    let mut out = String::new();
    let count = fields(needs).count();
    for (region, field) in fields(needs).enumerate() {
        let holds = match storage {
            Storage::Memory(_) => false,
            Storage::Registers => true,
            Storage::Held(_) => moves(field, needs, stages),
        };
        let place = match storage {
            Storage::Memory(layout) | Storage::Held(layout) if !holds => {
                place(region, count, layout)
            }
            _ => held(field),
        };
        let mut accessed = String::new();
        for u in field.uses(needs) {
            let read = stages.iter().any(|s| s.loads(u.name, needs));
            let written = stages.iter().any(|s| s.stores(u.name, needs));
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
        // What moves is held even if no stage here asks for it.
        if holds && (storage != Storage::Registers || !accessed.is_empty()) {
            let _ = writeln!(out, "var<private> {place}: vec4<u32>;");
        }
        out += &accessed;
    }
    if let Storage::Held(layout) = storage {
        out += &moving(needs, stages, layout);
    }
    out
}

/// Whether a field goes with a path from the slot where `stages` found it to the one where those find it that they ask
/// for: these load it, or they leave something in it. The places of rays are known, and stored, after the move.
fn moves(field: &Field, needs: Needs, stages: &[&Stage]) -> bool {
    let left = |u: &Use| stages.iter().any(|s| s.stores(u.name, needs)) && u.name != "requests";
    let mut uses = field.uses(needs);
    uses.any(|u| is_awaited(u, needs, stages) || left(u))
}

/// Whether a stage loads a use that `stages` ask for. One that begins a path asks for nothing that was.
fn is_awaited(u: &Use, needs: Needs, stages: &[&Stage]) -> bool {
    let asked = |s: &&Stage| stages.iter().any(|by| s.work.from().contains(&by.name));
    let next = STAGES.iter().filter(asked).filter(|s| needs.met(s.need));
    let mut next = next.filter(|s| !matches!(s.work, Work::Begin { .. }));
    next.any(|s| s.loads(u.name, needs))
}

/// `take_up`, which reads what moves, and `put_down`, which writes it. Words that mean nothing are left alone. All
/// threads of a workgroup must have taken up their paths before one puts its own down.
fn moving(needs: Needs, stages: &[&Stage], layout: StateLayout) -> String {
    let count = fields(needs).count();
    // Of a path that began and is over, that is all there is to know.
    let begins = stages.iter().any(|s| matches!(s.work, Work::Begin { .. }));
    let (mut take, mut put) = (String::new(), String::new());
    let moved = fields(needs).enumerate();
    for (region, field) in moved.filter(|(_, field)| moves(field, needs, stages)) {
        let (held, place) = (held(field), place(region, count, layout));
        let line = |to: &str, from: &str| match field.flag {
            None => format!("    {to} = {from};\n"),
            Some(flag) => {
                format!("    if (load_radiance(slot).flags & {flag}) != 0u {{ {to} = {from}; }}\n")
            }
        };
        let is_loaded =
            |u: &Use| is_awaited(u, needs, stages) || stages.iter().any(|s| s.loads(u.name, needs));
        if field.uses(needs).any(is_loaded) {
            take += &line(&held, &place);
        }
        if begins && field.uses(needs).any(|u| u.name == "radiance") {
            let is_over = "(load_radiance(slot).flags & PATH_LIVE) == 0u";
            put = format!("    {place} = {held};\n    if {is_over} {{ return; }}\n{put}");
        } else {
            put += &line(&place, &held);
        }
    }
    format!("fn take_up(slot: u32) {{\n{take}}}\n\nfn put_down(slot: u32) {{\n{put}}}\n")
}

/// The variable that holds the words of a field.
fn held(field: &Field) -> String {
    format!("state_{}", field.name())
}

/// Where the words of a field are in the buffer, the `region`-th of `count`.
fn place(region: usize, count: usize, layout: StateLayout) -> String {
    match layout {
        StateLayout::Arrays => format!("state[{region}u * POOL_SIZE + slot]"),
        StateLayout::Pairs => {
            let (first, half) = (region - region % 2, region % 2);
            if first + 1 < count {
                format!("state[{first}u * POOL_SIZE + 2u * slot + {half}u]")
            } else {
                format!("state[{first}u * POOL_SIZE + slot]")
            }
        }
        StateLayout::Structures => format!("state[{count}u * slot + {region}u]"),
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

#[cfg(test)]
mod tests {
    use wgpu::naga;

    use super::*;
    use crate::kernels::stages::STAGES;
    use crate::kernels::state::{FIELD_BYTES, FIELDS, path_bytes};
    use crate::world::needs::Need;

    const EVERYTHING: Needs = Needs::of_rows(&[
        Need::ShadowRays,
        Need::CrossingShadows,
        Need::Media,
        Need::Absorption,
        Need::Overlap,
        Need::Order,
        Need::RayCones,
    ]);
    /// naga lays a field's structure out on exactly the words that the accessors pack.
    #[test]
    fn fields_fill_four_words_as_naga_lays_them_out() {
        let requests = EVERYTHING.with(Need::Requests);
        let shared = EVERYTHING.without(Need::CrossingShadows);
        for needs in [EVERYTHING, requests, shared] {
            let text = format!(
                "const POOL_SIZE: u32 = 1u;\n\
                 @group(0) @binding(0) var<storage, read_write> state: array<vec4<u32>>;\n{}",
                accessors(needs, &every_stage(), Storage::Memory(StateLayout::Arrays))
            );
            let (module, _) =
                crate::kernels::validate::validate("state", &text).expect("valid WGSL");
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
            &every_stage(),
            Storage::Memory(StateLayout::Arrays),
        );
        assert!(!text.contains("shadow"), "{text}");
        assert!(!text.contains("media"), "{text}");
        assert!(!text.contains("cone"), "{text}");
    }

    fn every_stage() -> Vec<&'static Stage> {
        STAGES.iter().collect()
    }
}
