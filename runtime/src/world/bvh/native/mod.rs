//! Ray casts by the processor: what `trace_closest` and `trace_any` of the WGSL find, found by native code.
//!
//! It reads the buffers that kernels bind, walks the same wide tree in the same order, and rounds as the text says,
//! without fused operations: its hits have the bits of a kernel that does the same. obvhs can walk such a tree, too,
//! a triangle at a time; for rays that are scattered that is about half as fast (tests/native/speed.rs measures both).
//!
//! `tree` holds what is walked, `walk` walks it, `slabs` and `triangles` are the tests of nodes and triangles,
//! written in the `lanes` of an instruction set. Rays may come in eights, since what is done once a ray is then done
//! for eight at once; they walk one after another, for they part ways soon.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod lanes;
mod slabs;
mod tree;
mod triangles;
mod walk;

use bytemuck::{Pod, Zeroable};

use crate::wgsl::ShaderPart;

/// Stands for no primitive: in a hit, and for a ray that skips none.
pub const NO_PRIMITIVE: u32 = u32::MAX;

/// What a ray hits, as the `Hit` of the WGSL.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Hit {
    /// How far along the ray; `t_max` on a miss.
    pub t: f32,
    /// The barycentric coordinate of corner b.
    pub u: f32,
    /// The barycentric coordinate of corner c.
    pub v: f32,
    /// [`NO_PRIMITIVE`] on a miss.
    pub primitive: u32,
}

/// Rays: a word of each in a row.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct Rays<const N: usize> {
    /// By axis.
    pub origins: [[f32; N]; 3],
    /// By axis; unit vectors.
    pub directions: [[f32; N]; 3],
    /// How far they reach.
    pub t_max: [f32; N],
    /// Which primitive each goes through.
    pub skip: [u32; N],
}

// SAFETY: they are 64 words, without anything between them or behind.
#[allow(unsafe_code)]
unsafe impl Zeroable for Rays<8> {}
// SAFETY: the same.
#[allow(unsafe_code)]
unsafe impl Pod for Rays<8> {}

impl<const N: usize> Rays<N> {
    /// A ray in all lanes.
    pub fn of_one(origin: [f32; 3], direction: [f32; 3], t_max: f32, skip: u32) -> Self {
        Self {
            origins: origin.map(|x| [x; N]),
            directions: direction.map(|x| [x; N]),
            t_max: [t_max; N],
            skip: [skip; N],
        }
    }

    #[inline(always)]
    fn origin(&self, lane: usize) -> [f32; 3] {
        self.origins.map(|values| values[lane])
    }

    #[inline(always)]
    fn direction(&self, lane: usize) -> [f32; 3] {
        self.directions.map(|values| values[lane])
    }
}

/// The instructions that rays are cast with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instructions {
    /// Those that every processor has.
    Portable,
    /// AVX2 of x86.
    #[cfg(target_arch = "x86_64")]
    Avx2,
}

/// Casts rays into a world on the processor that it was made on.
pub struct Caster {
    trees: tree::Trees,
    instructions: Instructions,
}

impl Caster {
    /// Of a scene's parts `geometry` and `bvh`. None if their tree is not the wide one, since casts through others
    /// are left to kernels.
    pub fn new(geometry: &ShaderPart, bvh: &ShaderPart) -> Option<Self> {
        let instructions = Instructions::Portable;
        #[cfg(target_arch = "x86_64")]
        let instructions = if avx2::is_there() {
            Instructions::Avx2
        } else {
            instructions
        };
        Some(Self {
            trees: tree::Trees::new(geometry, bvh)?,
            instructions,
        })
    }

    /// The same with the instructions that every processor has.
    pub fn portable(self) -> Self {
        Self {
            instructions: Instructions::Portable,
            ..self
        }
    }

    /// The instructions that it casts with.
    pub fn instructions(&self) -> Instructions {
        self.instructions
    }

    /// The nearest hit with 0 < t < `t_max` on another primitive than `skip`; `direction` is a unit vector. Rays
    /// that are no rays hit nothing.
    pub fn closest(&self, origin: [f32; 3], direction: [f32; 3], t_max: f32, skip: u32) -> Hit {
        let [hit] = self.closest_of(&Rays::of_one(origin, direction, t_max, skip), 1);
        hit
    }

    /// Is there any such hit?
    pub fn any(&self, origin: [f32; 3], direction: [f32; 3], t_max: f32, skip: u32) -> bool {
        self.any_of(&Rays::<1>::of_one(origin, direction, t_max, skip), 1) != 0
    }

    /// [`Caster::closest`] of the rays that have a bit in `lanes`; of others there is no hit.
    pub fn closest_of<const N: usize>(&self, rays: &Rays<N>, lanes: u32) -> [Hit; N] {
        self.cast::<false, N>(rays, lanes)
    }

    /// [`Caster::any`] of the rays that have a bit in `lanes`: bits of those that hit something.
    pub fn any_of<const N: usize>(&self, rays: &Rays<N>, lanes: u32) -> u32 {
        let hits = self.cast::<true, N>(rays, lanes);
        let bits = (0..).zip(&hits);
        bits.fold(0, |bits, (lane, hit)| {
            bits | u32::from(hit.primitive != NO_PRIMITIVE) << lane
        })
    }

    #[inline(always)]
    fn cast<const ANY: bool, const N: usize>(&self, rays: &Rays<N>, lanes: u32) -> [Hit; N] {
        match self.instructions {
            Instructions::Portable => portable::<ANY, N>(&self.trees, rays, lanes),
            #[cfg(target_arch = "x86_64")]
            #[allow(unsafe_code)]
            // SAFETY: it is chosen where these instructions are.
            Instructions::Avx2 => unsafe { avx2::cast::<ANY, N>(&self.trees, rays, lanes) },
        }
    }
}

fn portable<const ANY: bool, const N: usize>(
    trees: &tree::Trees,
    rays: &Rays<N>,
    lanes: u32,
) -> [Hit; N] {
    walk::cast::<lanes::Portable, ANY, N>(trees, rays, lanes)
}
