//! Answers the ray casts of kernels by the caster of the host.

use std::ffi::c_void;
use std::sync::Arc;

use impasto_cpu::{Answer, Cell};

use crate::world::KernelParts;
use crate::world::bvh::{Caster, Rays};

/// The functions of kernels that are answered, and who answers them.
pub(super) const ANSWERED: [(&str, Answer); 2] = [
    (
        "trace_closest",
        Answer {
            one: closest,
            eight: closest_of_eight,
        },
    ),
    (
        "trace_any",
        Answer {
            one: any,
            eight: any_of_eight,
        },
    ),
];

/// What answers are given along.
#[derive(Clone)]
pub(crate) struct Casts(Arc<Caster>);

impl std::fmt::Debug for Casts {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("casts")
    }
}

impl Casts {
    /// Into a world; `None` where casts are left to kernels.
    pub(crate) fn new(parts: &KernelParts) -> Option<Self> {
        Some(Self(Arc::new(Caster::new(&parts.geometry, &parts.bvh)?)))
    }

    /// The same as an address.
    pub(super) fn data(&self) -> *const c_void {
        Arc::as_ptr(&self.0).cast()
    }
}

/// A ray as the words of the arguments: origin, direction, limit, and what is skipped.
type Words = [u32; 8];

fn ray(words: &Words) -> ([f32; 3], [f32; 3], f32, u32) {
    let at = |i: usize| f32::from_bits(words[i]);
    (
        [at(0), at(1), at(2)],
        [at(3), at(4), at(5)],
        at(6),
        words[7],
    )
}

/// # Safety
/// `data` is a caster, and there are words for the arguments and for a hit.
#[allow(unsafe_code)]
unsafe extern "C" fn closest(data: *const c_void, arguments: *const u32, result: *mut u32) {
    // SAFETY: as above.
    let (caster, words) = unsafe { (&*data.cast::<Caster>(), &*arguments.cast::<Words>()) };
    let (origin, direction, t_max, skip) = ray(words);
    let hit = caster.closest(origin, direction, t_max, skip);
    let found = [hit.t, hit.u, hit.v].map(f32::to_bits);
    // SAFETY: as above.
    unsafe { *result.cast::<[u32; 4]>() = [found[0], found[1], found[2], hit.primitive] };
}

/// # Safety
/// `data` is a caster, and there are words for the arguments and for a bool.
#[allow(unsafe_code)]
unsafe extern "C" fn any(data: *const c_void, arguments: *const u32, result: *mut u32) {
    // SAFETY: as above.
    let (caster, words) = unsafe { (&*data.cast::<Caster>(), &*arguments.cast::<Words>()) };
    let (origin, direction, t_max, skip) = ray(words);
    // SAFETY: as above.
    unsafe { *result = u32::from(caster.any(origin, direction, t_max, skip)) };
}

/// The bits of a mask.
fn bits(mask: &Cell) -> u32 {
    let lanes = (0..).zip(&mask.0);
    lanes.fold(0, |bits, (lane, word)| bits | (word & 1) << lane)
}

/// # Safety
/// `data` is a caster, and there are cells for a mask, the arguments and a hit.
#[allow(unsafe_code)]
unsafe extern "C" fn closest_of_eight(data: *const c_void, cells: *mut Cell) {
    // SAFETY: as above.
    let (caster, cells) = unsafe { (&*data.cast::<Caster>(), &mut *cells.cast::<[Cell; 13]>()) };
    let [mask, rays @ .., t, u, v, primitive] = cells;
    let hits = caster.closest_of(bytemuck::cast_ref::<[Cell; 8], Rays<8>>(rays), bits(mask));
    for (lane, hit) in hits.iter().enumerate() {
        t.0[lane] = hit.t.to_bits();
        u.0[lane] = hit.u.to_bits();
        v.0[lane] = hit.v.to_bits();
        primitive.0[lane] = hit.primitive;
    }
}

/// # Safety
/// `data` is a caster, and there are cells for a mask, the arguments and a bool.
#[allow(unsafe_code)]
unsafe extern "C" fn any_of_eight(data: *const c_void, cells: *mut Cell) {
    // SAFETY: as above.
    let (caster, cells) = unsafe { (&*data.cast::<Caster>(), &mut *cells.cast::<[Cell; 10]>()) };
    let [mask, rays @ .., found] = cells;
    let hits = caster.any_of(bytemuck::cast_ref::<[Cell; 8], Rays<8>>(rays), bits(mask));
    for (lane, found) in found.0.iter_mut().enumerate() {
        *found = hits >> lane & 1;
    }
}
