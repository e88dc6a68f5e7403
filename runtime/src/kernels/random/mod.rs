//! Random numbers: which draws a path makes, what dimensions of a sequence they get, and how a
//! seed enters them.
//!
//! A draw gives four words at once, as a function of (pixel, sample, draw, seed); the functions
//! are `kernels/random.wgsl` and a file a sampler beside it.

use crate::technique::Sampler;
use crate::wgsl;
use crate::wgsl::{BufferData, ShaderPart};
use crate::world::World;
use crate::world::needs::{Need, Needs};

mod sobol;

/// Draws made once for a path, by their name in WGSL.
const PATH_DRAWS: [&str; 1] = [
    // Position in the pixel (y, z), position on the lens (x, w).
    "DRAW_CAMERA",
];

/// Draws made at every vertex of a path.
const VERTEX_DRAWS: [&str; 2] = [
    // Of a light: its choice (x) and the point on it (y, z), in the material stage; survival (w), in the logic stage.
    "DRAW_LIGHT",
    // In the material stage: lobe (x), direction (y, z), choices within the lobe (w).
    "DRAW_SCATTERING",
];

/// The numbers x, y, z and w of a draw in the order in which they get dimensions: where few are
/// left, those that directions and points are made of come first, and lie side by side.
const LANES: [usize; 4] = [1, 2, 0, 3];

/// What of its draws a scene uses.
#[derive(Clone, Copy, Debug)]
pub struct Demand {
    /// A lens that points are sampled on.
    pub lens: bool,
    /// A material of several lobes, of which one is chosen.
    pub lobes: bool,
    /// Lights that are sampled.
    pub lights: bool,
    /// More than one light to choose from.
    pub light_choice: bool,
    /// The segment from whose end on a path may be ended at random.
    pub roulette_start: u32,
    /// Longest path in segments.
    pub max_depth: u32,
}

impl Demand {
    /// What a world that needs `natural` by itself asks of random numbers: what is forced gets no
    /// dimension, which would change the others'.
    pub(crate) fn of(world: &World, natural: Needs) -> Self {
        Self {
            lens: natural.has(Need::Lens),
            lobes: natural.has(Need::LobeChoice),
            lights: natural.has(Need::ShadowRays),
            light_choice: natural.has(Need::LightChoice),
            roulette_start: world.roulette_start,
            max_depth: world.max_depth,
        }
    }

    /// For every draw in turn, which of its numbers are used.
    fn draws(self) -> impl Iterator<Item = [bool; 4]> {
        let vertices = 1..=self.max_depth;
        let at_vertex = move |vertex| {
            let goes_on = vertex < self.max_depth;
            let lit = self.lights && goes_on;
            let ends = vertex >= self.roulette_start;
            let logic = [lit && self.light_choice, lit, lit, ends];
            [logic, [goes_on && self.lobes, goes_on, goes_on, goes_on]]
        };
        let camera = [self.lens, true, true, self.lens];
        [camera].into_iter().chain(vertices.flat_map(at_vertex))
    }

    /// The dimensions of the first draws: those whose numbers all get one.
    fn dimensions(self) -> Vec<[Option<usize>; 4]> {
        let mut next = 0;
        let mut all = Vec::new();
        for used in self.draws() {
            if next + used.iter().filter(|u| **u).count() > sobol::DIMENSIONS {
                break;
            }
            let mut dimensions = [None; 4];
            for lane in LANES.into_iter().filter(|lane| used[*lane]) {
                dimensions[lane] = Some(next);
                next += 1;
            }
            all.push(dimensions);
        }
        all
    }
}

/// Random numbers of one sampler for a scene: `random_bits`, `random_numbers`, `unit_numbers` and
/// `vertex_draw`. Needs the uniform `run` with its hashed `seed`.
pub fn part(sampler: Sampler, demand: Demand) -> ShaderPart {
    let mut wgsl = constants();
    wgsl += include_str!("../random.wgsl");
    let table = match sampler {
        Sampler::Independent => {
            wgsl += include_str!("independent.wgsl");
            Vec::new()
        }
        Sampler::Sobol => {
            let draws = demand.dimensions();
            wgsl += &wgsl::constant_u32("SOBOL_DRAWS", draws.len() as u32);
            wgsl += include_str!("sobol.wgsl");
            let of_draw = |d| sobol::tables(d, |point, index| point(index));
            draws.into_iter().flat_map(of_draw).collect()
        }
        Sampler::Owen => {
            wgsl += include_str!("owen.wgsl");
            owen_table()
        }
    };
    let table =
        (!table.is_empty()).then(|| BufferData::new("random_table", "array<vec4<u32>>", &table));
    ShaderPart {
        wgsl,
        buffers: table.into_iter().collect(),
    }
}

/// The first four dimensions, from a reversed index to reversed points.
fn owen_table() -> Vec<[u32; 4]> {
    let mut dimensions = [None; 4];
    for (dimension, lane) in LANES.into_iter().enumerate() {
        dimensions[lane] = Some(dimension);
    }
    sobol::tables(dimensions, |point, index| {
        point(index.reverse_bits()).reverse_bits()
    })
}

/// The WGSL constants of the tables of draws.
fn constants() -> String {
    let mut out = String::new();
    for names in [&PATH_DRAWS[..], &VERTEX_DRAWS[..]] {
        for (index, name) in names.iter().enumerate() {
            out += &wgsl::constant_u32(name, index as u32);
        }
    }
    out + &wgsl::constants_u32(&[
        ("DRAWS_PER_PATH", PATH_DRAWS.len() as u32),
        ("DRAWS_PER_VERTEX", VERTEX_DRAWS.len() as u32),
    ])
}

/// A seed as the kernels get it: a bijection that spreads nearby seeds and powers of two over
/// all bits, so that no seed is special. The finaliser of MurmurHash3 (Appleby 2008) over an
/// odd offset, since it maps 0 to 0.
pub fn hash_seed(seed: u32) -> u32 {
    let mut bits = seed.wrapping_add(0x9e37_79b9);
    bits = (bits ^ (bits >> 16)).wrapping_mul(0x85eb_ca6b);
    bits = (bits ^ (bits >> 13)).wrapping_mul(0xc2b2_ae35);
    bits ^ (bits >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEMAND: Demand = Demand {
        lens: false,
        lobes: true,
        lights: true,
        light_choice: true,
        roulette_start: 8,
        max_depth: 16,
    };

    #[test]
    fn seeds_that_differ_in_one_bit_hash_to_words_that_differ_in_many() {
        for bit in 0..32 {
            let changed = (hash_seed(0) ^ hash_seed(1 << bit)).count_ones();
            assert!((6..=26).contains(&changed), "bit {bit}: {changed} changed");
        }
        assert_ne!(hash_seed(0), 0);
    }

    #[test]
    fn dimensions_go_to_numbers_that_are_used() {
        let draws = DEMAND.dimensions();
        assert_eq!(draws[0], [None, Some(0), Some(1), None], "no lens");
        assert_eq!(draws[1], [Some(4), Some(2), Some(3), None], "no roulette");
        assert_eq!(draws[2], [Some(7), Some(5), Some(6), Some(8)]);
        // 2 of the camera and 7 a vertex: four vertices, and 2 left, too few for a light.
        assert_eq!(draws.len(), 1 + 2 * 4);

        let lens = Demand {
            lens: true,
            ..DEMAND
        };
        assert_eq!(lens.dimensions()[0], [Some(2), Some(0), Some(1), Some(3)]);
        let ending = Demand {
            roulette_start: 2,
            ..DEMAND
        };
        assert_eq!(ending.dimensions()[1][3], None);
        assert_eq!(ending.dimensions()[3][3], Some(12));
        let unlit = Demand {
            lights: false,
            light_choice: true,
            lobes: false,
            ..DEMAND
        };
        assert_eq!(unlit.dimensions()[1], [None; 4]);
        assert_eq!(unlit.dimensions()[2], [None, Some(2), Some(3), Some(4)]);
        let short = Demand {
            max_depth: 2,
            ..DEMAND
        };
        assert_eq!(
            short.dimensions().len(),
            1 + 2 * 2,
            "no more draws than the path has"
        );
        assert_eq!(short.dimensions()[3..], [[None; 4]; 2]);
    }

    #[test]
    fn no_dimension_is_given_twice_and_all_but_few_are_given() {
        for bits in 0..16 {
            let has = |bit: u32| bits >> bit & 1 == 1;
            let demand = Demand {
                lens: has(0),
                lobes: has(1),
                lights: has(2),
                light_choice: has(3),
                roulette_start: 3,
                max_depth: 100,
            };
            let mut given: Vec<usize> = demand
                .dimensions()
                .into_iter()
                .flatten()
                .flatten()
                .collect();
            given.sort_unstable();
            assert!(given.iter().copied().eq(0..given.len()), "{demand:?}");
            assert!(given.len() + 3 >= sobol::DIMENSIONS, "{demand:?}");
        }
    }

    #[test]
    fn a_sampler_without_tables_binds_none() {
        assert!(part(Sampler::Independent, DEMAND).buffers.is_empty());
        let bytes = |sampler| part(sampler, DEMAND).buffers[0].bytes.len();
        assert_eq!(bytes(Sampler::Owen), 16 << 10);
        assert_eq!(bytes(Sampler::Sobol), 9 * (16 << 10));
    }
}
