//! The one table of the runtime's own buffers. How kernels declare and bind them, how large they are and
//! when they are emptied follows from it; a buffer more is a row more.

use crate::kernels::layout::PlanLayout;
use crate::kernels::modules::Composer;
use crate::kernels::{camera, order, run};
use crate::world::needs::Need;

/// What kernels may do with a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Access {
    Uniform,
    Read,
    ReadWrite,
}

/// Who reads a buffer beside kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reader {
    /// The host alone.
    Host,
    /// Dispatches, whose sizes are in it.
    Dispatches,
}

/// What a buffer is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Owner {
    /// A world: all plans that render it share the buffer.
    World,
    /// A plan, on whose kernels the size depends.
    Plan,
}

/// When a buffer is emptied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Cleared {
    /// Never: kernels or the host write what is read.
    Never,
    /// When a render begins.
    ByRender,
    /// When a render begins, and each of its passes.
    ByPass,
}

/// How large a buffer is; nothing of what a plan does without is bound.
#[derive(Clone, Copy)]
pub(crate) enum Size {
    /// So many bytes for each path of the pool, which are part of what a path takes.
    OfPath(fn(&PlanLayout) -> u64),
    /// So many bytes in all.
    InAll(fn(&Composer<'_>) -> u64),
}

/// A buffer of the table.
pub(crate) struct Buffer {
    /// Which.
    pub id: BufferId,
    /// The WGSL variable.
    pub name: &'static str,
    /// Its WGSL type.
    pub wgsl_type: &'static str,
    /// What kernels may do with it.
    pub access: Access,
    /// Who reads it beside them.
    pub reader: Reader,
    /// What it is made for.
    pub owner: Owner,
    /// When it is emptied.
    pub cleared: Cleared,
    /// How large it is.
    size: Size,
}

/// Declares the buffers in the order in which kernels bind them.
macro_rules! buffers {
    ($($(#[$about:meta])+ $id:ident, $name:literal, $ty:literal, $access:ident, $reader:ident, $owner:ident,
       $cleared:ident, $size:expr;)+) => {
        /// The runtime's own buffers.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub(crate) enum BufferId {
            $($(#[$about])+ $id,)+
        }

        /// Every buffer, at the index of its id.
        pub(crate) const BUFFERS: [Buffer; [$(BufferId::$id),+].len()] = [$(Buffer {
            id: BufferId::$id,
            name: $name,
            wgsl_type: $ty,
            access: Access::$access,
            reader: Reader::$reader,
            owner: Owner::$owner,
            cleared: Cleared::$cleared,
            size: $size,
        }),+];
    };
}

use Size::{InAll, OfPath};

buffers! {
    /// The settings that do not change a kernel's text.
    Run, "run", "Run", Uniform, Host, World, Never, InAll(|_| run::BYTES);
    /// From where the picture is seen.
    Camera, "camera", "Camera", Uniform, Host, World, Never, InAll(|_| camera::BYTES);
    /// The state of paths.
    State, "state", "array<vec4<u32>>", ReadWrite, Host, World, ByPass, OfPath(PlanLayout::path_bytes);
    /// What stages ask of each other.
    Queues, "queues", "array<u32>", ReadWrite, Host, Plan, Never,
        InAll(|of| 4 * u64::from(of.sizes.pool) * of.layout.queue_words());
    /// Lengths of queues, and what is counted.
    Counters, "counters", "array<atomic<u32>>", ReadWrite, Host, Plan, ByRender,
        InAll(|of| 4 * of.layout.counters.len() as u64);
    /// The sums of the picture.
    Film, "film", "array<atomic<u32>>", ReadWrite, Host, World, ByRender,
        InAll(|of| 4 * of.pixels() * of.world.outputs.layers.planes() as u64);
    /// How many workgroups the kernel of each queue gets.
    Arguments, "arguments", "array<u32>", ReadWrite, Dispatches, Plan, Never,
        InAll(|of| ARGUMENT_BYTES * of.layout.counters.queues as u64);
    /// The counting sort of rays.
    Bins, "bins", "array<atomic<u32>>", ReadWrite, Host, World, Never,
        InAll(|of| of.if_needed(Need::Order, order::bytes(of.technique.ray_order)));
    /// Rays in the order of requests, which else are part of the state.
    ExtensionRays, "extension_rays", "array<vec4<u32>>", ReadWrite, Host, World, Never,
        OfPath(|layout| layout.if_requested(&[], 32));
    /// What they hit.
    ExtensionHits, "extension_hits", "array<vec4<u32>>", ReadWrite, Host, World, Never,
        OfPath(|layout| layout.if_requested(&[], 16));
    /// The same of shadow rays.
    ShadowRays, "shadow_rays", "array<vec4<u32>>", ReadWrite, Host, World, Never,
        OfPath(|layout| layout.if_requested(&[Need::ShadowRays], 32));
    /// Whether they were blocked.
    ShadowResults, "shadow_results", "array<u32>", ReadWrite, Host, World, Never,
        OfPath(|layout| layout.if_requested(&[Need::ShadowRays], 4));
    /// The queue of each material, where it is no part of kernels' text.
    QueueTable, "queue_table", "array<u32>", Read, Host, World, Never,
        InAll(|of| if of.queue_table { 4 * of.materials.len() as u64 } else { 0 });
    /// Those that are rendered, where not all are: there is room for any choice.
    PixelList, "pixel_list", "array<u32>", Read, Host, World, Never,
        InAll(|of| of.if_needed(Need::SomePixels, 4 * of.pixels()));
}

/// Bytes of the arguments of an indirect dispatch: groups along three axes.
pub(crate) const ARGUMENT_BYTES: u64 = 12;

impl BufferId {
    /// Its row in the table.
    pub(crate) fn row(self) -> &'static Buffer {
        &BUFFERS[self.index()]
    }

    /// The index at which kernels bind it.
    pub(crate) fn index(self) -> usize {
        self as usize
    }
}

impl Buffer {
    /// Its size for the kernels that are composed; 0 if they have no use for it.
    pub(crate) fn bytes(&self, of: &Composer<'_>) -> u64 {
        match self.size {
            OfPath(bytes) => u64::from(of.sizes.pool) * bytes(&of.layout),
            InAll(bytes) => bytes(of),
        }
    }
}

impl PlanLayout {
    /// Bytes of memory that a path takes; a megakernel has its state in registers.
    pub(crate) fn memory(&self) -> u64 {
        let of_path = |buffer: &Buffer| match buffer.size {
            OfPath(bytes) => bytes(self),
            InAll(_) => 0,
        };
        BUFFERS.iter().map(of_path).sum()
    }

    /// `bytes` if rays are in buffers of their own, and all of some rows are on.
    fn if_requested(&self, rows: &[Need], bytes: u64) -> u64 {
        let exists = |need: &Need| self.needs.has(*need);
        if exists(&Need::Requests) && rows.iter().all(exists) {
            bytes
        } else {
            0
        }
    }
}

impl Composer<'_> {
    fn pixels(&self) -> u64 {
        u64::from(self.world.width) * u64::from(self.world.height)
    }

    /// `bytes` if a row is on.
    fn if_needed(&self, need: Need, bytes: u64) -> u64 {
        if self.layout.needs.has(need) {
            bytes
        } else {
            0
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn buffers_have_names_of_their_own_and_are_where_their_ids_say() {
        let names: BTreeSet<&str> = BUFFERS.iter().map(|b| b.name).collect();
        assert_eq!(names.len(), BUFFERS.len());
        for (index, buffer) in BUFFERS.iter().enumerate() {
            assert_eq!(buffer.id.index(), index, "{}", buffer.name);
        }
    }
}
