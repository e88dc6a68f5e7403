//! The uniform `run`: the settings that do not change a kernel's text.

use crate::kernels::random;
use crate::options::RenderOptions;

/// A member's name, and how its value follows from what was asked for.
type Member = (&'static str, fn(&RenderOptions) -> u32);

/// The members, all of type `u32`.
const MEMBERS: [Member; 5] = [
    ("seed", |options| random::hash_seed(options.seed)),
    ("first_sample", |options| options.first_sample),
    ("samples", |options| options.samples),
    ("pixels", |options| {
        let some = options.pixels.as_ref();
        some.map_or(0, |pixels| pixels.len() as u32)
    }),
    // Compilers do not know that it is 0.
    ("none", |_| 0),
];

/// The word that says how many samples of each pixel are taken.
pub(crate) const SAMPLES: usize = 2;

/// The words of the uniform.
pub(crate) type Words = [u32; MEMBERS.len()];

/// Its size.
pub(crate) const BYTES: u64 = size_of::<Words>() as u64;

/// Its words, a member each.
pub(crate) fn words(options: &RenderOptions) -> Words {
    MEMBERS.map(|(_, value)| value(options))
}

/// Its structure in WGSL.
pub(crate) fn declaration(name: &str) -> String {
    let members = MEMBERS.map(|(name, _)| format!("{name}: u32"));
    format!("struct {name} {{ {} }}\n", members.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_are_told_a_hashed_seed_the_range_of_samples_and_how_many_pixels() {
        let options = RenderOptions {
            seed: 4,
            first_sample: 5,
            samples: 6,
            pixels: Some([3, 9].into()),
            ..RenderOptions::default()
        };
        assert_eq!(words(&options), [random::hash_seed(4), 5, 6, 2, 0]);
        assert_eq!(MEMBERS[SAMPLES].0, "samples");
        assert_eq!(
            declaration("Run"),
            "struct Run { seed: u32, first_sample: u32, samples: u32, pixels: u32, none: u32 }\n"
        );
    }
}
