//! References of a tree's leaves to triangles, of which a large one may have several.
//!
//! Triangles are stored once for each reference, in the order of leaves. Only one of the references to a triangle
//! is a primitive: the first. Hits name it whichever reference was met, and so what a ray skips, lights, surfaces
//! and outputs know nothing of the others. These say which one it is where a primitive says which light it is, a
//! word that a cast loads with a corner and that nobody else asks a further reference for.

use crate::world::lights::NO_LIGHT;

/// What the word of the light is more than a primitive in a further reference to it.
const FURTHER: u32 = 1 << 31;

/// The primitive of each of some triangles, given the triangle of each reference.
pub(crate) fn primitives(order: &[u32], triangles: usize) -> Vec<u32> {
    let mut primitives = vec![0; triangles];
    for (reference, &triangle) in (0..order.len() as u32).zip(order).rev() {
        primitives[triangle as usize] = reference;
    }
    primitives
}

/// The word of the light of a reference, if its primitive has an index in the table of lights.
pub(crate) fn light_word(reference: u32, primitive: u32, light: u32) -> u32 {
    if reference == primitive {
        light
    } else {
        FURTHER | primitive
    }
}

/// The primitive of a reference, of which these are the corners as kernels read them: `primitive_of` of the WGSL.
pub(super) fn primitive_of(reference: u32, corners: &[[u32; 4]; 3]) -> u32 {
    let light = corners[1][3];
    if light >= FURTHER && light != NO_LIGHT {
        light & !FURTHER
    } else {
        reference
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_reference_is_the_primitive_and_the_others_name_it() {
        let order = [2, 0, 2, 1, 0, 2];
        let primitives = primitives(&order, 3);
        assert_eq!(primitives, [1, 3, 0]);
        for light in [0, 5, NO_LIGHT] {
            for (reference, triangle) in (0..).zip(order) {
                let primitive = primitives[triangle as usize];
                let word = light_word(reference, primitive, light);
                assert_eq!(reference == primitive, word == light);
                assert_eq!(
                    primitive_of(reference, &[[7; 4], [7, 7, 7, word], [7; 4]]),
                    primitive
                );
            }
        }
    }
}
