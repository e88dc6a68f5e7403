//! A path's state: its fields in `table`, and the WGSL that is derived from them in `accessors`.
//!
//! A field is one `vec4<u32>` in memory. Much of it matters for a part of an iteration only: from where a ray
//! was cast until what it hit is known, from the choice of a light until the material has answered. So a
//! field may have several uses, each a name with components of its own, for the words mean one
//! thing here and another there. Stages reach a use through `load_USE(slot)` and `store_USE(slot, value)` only,
//! and only if their rows list it.

mod accessors;
mod table;

pub(crate) use accessors::{Storage, accessors};
pub(crate) use table::{FIELDS, OWN_SHADOW_ORIGINS, SLOT_SHADOWS};

use crate::kernels::stages::Stage;
use crate::world::needs::{Needs, When};

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

/// One field of a path's state: four words, which exist if one of their uses does.
#[derive(Debug)]
pub(crate) struct Field {
    /// What the words mean, in the order of an iteration.
    pub uses: &'static [Use],
    /// The flag of `radiance` without which the words mean nothing between two stages, if one says so.
    pub flag: Option<&'static str>,
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
}

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
         const PATH_LOOKS: u32 = {}u;\n\
         // The path is below a surface: its ray walks there.\n\
         const PATH_BELOW: u32 = {}u;\n\
         // Of the status of a walk: it has left, or ended.\n\
         const BELOW_ENDED: u32 = 0x80000000u;\n",
        bit(0) - 1,
        bit(0),
        bit(1),
        bit(2),
        bit(3),
        bit(4),
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

/// The names of all uses; some have two.
pub(crate) fn names() -> impl Iterator<Item = &'static str> {
    FIELDS.iter().flat_map(|field| field.uses).map(|u| u.name)
}

/// Bytes a path takes in memory.
pub(crate) fn path_bytes(needs: Needs) -> u64 {
    fields(needs).count() as u64 * FIELD_BYTES
}

/// Bytes of state that `stage` loads and stores for a path, if it accesses every field that it lists once.
pub(crate) fn traffic(needs: Needs, stage: &Stage) -> [u64; 2] {
    let bytes = |touches: &dyn Fn(&Use) -> bool| {
        let touched = fields(needs).filter(|f| f.uses(needs).any(touches));
        touched.count() as u64 * FIELD_BYTES
    };
    [
        bytes(&|u| stage.loads(u.name, needs)),
        bytes(&|u| stage.stores(u.name, needs)),
    ]
}
