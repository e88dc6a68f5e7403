//! What samplers give: the very bits that the papers' formulas give, and the evenness that those
//! are for.

use std::collections::BTreeSet;

use crate::gpu::stub::{Kind, Room, materials, picture, red};
use crate::support::{Row, run};
use impasto_runtime::kernels::random::{self, Demand, hash_seed};
use impasto_runtime::options::RenderOptions;
use impasto_runtime::technique::{Choice, Sampler, Technique};
use impasto_runtime::wgsl::ShaderPart;

/// Everything that a path may draw.
const DEMAND: Demand = Demand {
    lens: true,
    lobes: true,
    lights: true,
    light_choice: true,
    roulette_start: 2,
    max_depth: 100,
};

/// Draws of a sequence: the camera's, the logic stage's at vertex 1 and the material stage's.
const DRAWS: [u32; 3] = [0, 1, 2];

/// Pixel, sample and draw.
type Question = [u32; 3];

/// What the kernel draws for each question.
fn draw(sampler: Sampler, seed: u32, questions: &[Question]) -> Vec<Row> {
    let mut part = random::part(sampler, DEMAND);
    let hashed = hash_seed(seed);
    part.wgsl += &format!("struct Run {{ seed: u32 }}\nvar<private> run: Run = Run({hashed}u);\n");
    let input: Vec<Row> = questions.iter().map(|&[p, s, d]| [p, s, d, 0]).collect();
    let body = "result[i] = random_bits(input[i].x, input[i].y, input[i].z);";
    run(&[&part], body, &input, input.len(), input.len())
}

/// One pixel's numbers of a draw for samples `first..first + count`.
pub fn samples_of(sampler: Sampler, pixel: u32, draws: u32, first: u32, count: u32) -> Vec<Row> {
    let question = |i: u32| [pixel, first.wrapping_add(i), draws];
    let questions: Vec<Question> = (0..count).map(question).collect();
    draw(sampler, 5, &questions)
}

const SEQUENCES: [Sampler; 2] = [Sampler::Owen, Sampler::Sobol];

fn pcg4d(mut v: Row) -> Row {
    v = v.map(|x| x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    let round = |v: &mut Row| {
        for (to, a, b) in [(0, 1, 3), (1, 2, 0), (2, 0, 1), (3, 1, 2)] {
            v[to] = v[to].wrapping_add(v[a].wrapping_mul(v[b]));
        }
    };
    round(&mut v);
    v = v.map(|x| x ^ (x >> 16));
    round(&mut v);
    v
}

/// An Owen scramble by its definition: a digit is flipped by what the digits above it say, here
/// as carries of the reversed word (Burley 2020; constants of Vegdahl 2021).
fn owen(word: u32, seed: u32) -> u32 {
    let mut v = word.reverse_bits();
    v ^= v.wrapping_mul(0x3d20_adea);
    v = v.wrapping_add(seed);
    v = v.wrapping_mul((seed >> 16) | 1);
    v ^= v.wrapping_mul(0x0552_6c56);
    v ^= v.wrapping_mul(0x53a2_2864);
    v.reverse_bits()
}

/// The sum of what the table says of each bit of an index.
fn sum_of_bits(table: &[Row], index: u32) -> Row {
    let mut sum = [0; 4];
    for bit in (0..32).filter(|bit| index >> bit & 1 == 1) {
        let entry = table[256 * (bit / 8) + (1 << (bit % 8))];
        sum = [0, 1, 2, 3].map(|lane| sum[lane] ^ entry[lane]);
    }
    sum
}

fn reference(sampler: Sampler, part: &ShaderPart, seed: u32, question: Question) -> Row {
    let [pixel, sample, draw] = question;
    let seed = hash_seed(seed);
    let hashed = |sample| pcg4d([pixel, sample, draw, seed]);
    let table = part.buffers.first().map_or(&[][..], |b| &b.bytes);
    let table: Vec<Row> = bytemuck::pod_collect_to_vec(table);
    let seeds = hashed(u32::MAX);
    match sampler {
        Sampler::Independent => hashed(sample),
        Sampler::Sobol => match table.chunks(1024).nth(draw as usize) {
            None => hashed(sample),
            Some(table) => {
                let point = sum_of_bits(table, sample);
                [0, 1, 2, 3].map(|lane| point[lane] ^ seeds[lane])
            }
        },
        Sampler::Owen => {
            // The finaliser of MurmurHash3 is `hash_seed` without its offset.
            let shuffle = hash_seed((seeds[0] ^ seeds[3]).wrapping_sub(0x9e37_79b9));
            let index = owen(sample, shuffle).reverse_bits();
            let point = sum_of_bits(&table, index);
            [0, 1, 2, 3].map(|lane| owen(point[lane].reverse_bits(), seeds[lane]))
        }
    }
}

#[test]
fn kernels_give_the_bits_of_the_formulas() {
    let samples = [
        0,
        1,
        2,
        255,
        256,
        65_535,
        65_536,
        70_000,
        1 << 24,
        u32::MAX - 1,
    ];
    let mut questions = Vec::new();
    for pixel in [0, 1, 2, 1023, 1 << 20, (1 << 29) - 1] {
        for sample in samples {
            questions.extend([0, 1, 2, 3, 8, 9, 10, 31, 199].map(|draw| [pixel, sample, draw]));
        }
    }
    for (sampler, name, _) in Sampler::ALL {
        let part = random::part(*sampler, DEMAND);
        for seed in [0, 1, 1 << 31] {
            for (question, found) in questions.iter().zip(draw(*sampler, seed, &questions)) {
                let expected = reference(*sampler, &part, seed, *question);
                assert_eq!(found, expected, "{name}, seed {seed}: {question:?}");
            }
        }
    }
}

/// Do 2^k points have one in each of 2^k strata?
fn is_stratified(values: impl Iterator<Item = u32>, k: u32) -> bool {
    let mut strata: Vec<u64> = values.map(|v| u64::from(v) >> (32 - k)).collect();
    strata.sort_unstable();
    strata.into_iter().eq(0..1 << k)
}

#[test]
fn scrambled_sequences_are_stratified_in_every_aligned_block() {
    for sampler in SEQUENCES {
        for (pixel, first) in [(0, 0), (77, 0), (5, 70_144), (9, u32::MAX - 511)] {
            for draw in DRAWS {
                let rows = samples_of(sampler, pixel, draw, first, 512);
                for k in 0..=9 {
                    for block in rows.chunks(1 << k) {
                        // No roulette at the first vertex: nothing is owed to w there.
                        for lane in 0..if draw == 1 { 3 } else { 4 } {
                            let lanes = block.iter().map(|row| row[lane]);
                            let place = format!("{sampler:?} {pixel} {first} {draw} {lane}");
                            assert!(is_stratified(lanes, k), "{place}: 2^{k}");
                        }
                    }
                }
            }
        }
    }
}

/// The best pair of every draw of the Owen sampler, and the first of the Sobol sampler, have one of
/// 2^k points in each box of volume 2^-k.
#[test]
fn the_best_pairs_are_stratified_in_boxes_of_every_shape() {
    let sobol = [(Sampler::Sobol, 0)];
    let owen = [0, 1, 2, 30, 1001].map(|draw| (Sampler::Owen, draw));
    for (sampler, draw) in sobol.into_iter().chain(owen) {
        let rows = samples_of(sampler, 3, draw, 1024, 256);
        for k in 0..=8 {
            for a in 0..=k {
                for block in rows.chunks(1 << k) {
                    let mut cells: Vec<u64> = block
                        .iter()
                        .map(|row| {
                            let [y, z] = [row[1], row[2]].map(u64::from);
                            (y >> (32 - a)) << (k - a) | z >> (32 - (k - a))
                        })
                        .collect();
                    cells.sort_unstable();
                    let b = k - a;
                    assert!(
                        cells.into_iter().eq(0..1 << k),
                        "{sampler:?} {draw}: 2^{a} x 2^{b}"
                    );
                }
            }
        }
    }
}

#[test]
fn seventy_thousand_samples_differ_in_the_bits_that_numbers_have() {
    for (sampler, name, _) in Sampler::ALL {
        for draw in [0, 2, 60] {
            let rows = samples_of(*sampler, 4, draw, 0, 70_000);
            let numbers: BTreeSet<Row> = rows.iter().map(|row| row.map(|v| v >> 8)).collect();
            assert_eq!(numbers.len(), rows.len(), "{name}, draw {draw}");
        }
    }
}

#[test]
fn all_ones_are_below_one() {
    let part = random::part(Sampler::Independent, DEMAND);
    let part = ShaderPart {
        wgsl: part.wgsl + "struct Run { seed: u32 }\nvar<private> run: Run = Run(0u);\n",
        ..part
    };
    let body = "result[i] = bitcast<vec4<u32>>(unit_numbers(input[i]));";
    let ends = [[u32::MAX; 4], [0; 4]];
    let found = run(&[&part], body, &ends, 2, 2);
    assert_eq!(found[0].map(f32::from_bits), [1.0 - f32::powi(2.0, -24); 4]);
    assert_eq!(found[1].map(f32::from_bits), [0.0; 4]);
}

/// Numbers in all lanes of many pixels at one sample.
pub fn over_pixels(sampler: Sampler, seed: u32, sample: u32, draw_index: u32) -> Vec<[f64; 4]> {
    let questions: Vec<Question> = (0..PIXELS).map(|p| [p, sample, draw_index]).collect();
    let rows = draw(sampler, seed, &questions);
    rows.iter()
        .map(|row| row.map(|v| f64::from(v) / f64::powi(2.0, 32) - 0.5))
        .collect()
}

const PIXELS: u32 = 1 << 14;

/// The correlation of two lists of numbers that are uniform in [-0.5, 0.5).
pub fn correlation(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (sum, count) = pairs.fold((0.0, 0.0), |(sum, count), (a, b)| {
        (sum + a * b, count + 1.0)
    });
    12.0 * sum / count
}

/// Six standard errors of a correlation: some thousands are tested.
const BOUND: f64 = 6.0 / 128.0;

#[test]
fn pixels_lanes_draws_and_seeds_are_uncorrelated() {
    for (sampler, name, _) in Sampler::ALL {
        let of = |seed, draw| over_pixels(*sampler, seed, 1, draw);
        let base = of(0, 0);
        for lane in 0..4 {
            for distance in [1, 2, 3, 16, 64, 256, 1024] {
                let pairs = base.iter().zip(&base[distance..]);
                let r = correlation(pairs.map(|(a, b)| (a[lane], b[lane])));
                assert!(
                    r.abs() < BOUND,
                    "{name}: lane {lane}, pixels at {distance}: {r}"
                );
            }
            for other in 0..lane {
                let r = correlation(base.iter().map(|v| (v[lane], v[other])));
                assert!(r.abs() < BOUND, "{name}: lanes {lane} and {other}: {r}");
            }
        }
        let others = [
            (0, 1),
            (0, 2),
            (0, 40),
            (1, 0),
            (2, 0),
            (1 << 16, 0),
            (1 << 31, 0),
        ];
        for (seed, draw) in others {
            let other = of(seed, draw);
            for lane in 0..4 {
                let r = correlation(base.iter().zip(&other).map(|(a, b)| (a[lane], b[lane])));
                assert!(
                    r.abs() < BOUND,
                    "{name}: seed {seed}, draw {draw}, lane {lane}: {r}"
                );
            }
        }
    }
}

/// Whatever the sample, its number is uniform over pixels: only then is the mean right.
#[test]
fn every_sample_is_uniform_over_pixels() {
    const BINS: usize = 64;
    for (sampler, name, _) in Sampler::ALL {
        for sample in [0, 1, 2, 3, 255, 65_536, u32::MAX - 1] {
            for draw in [0, 2] {
                let values = over_pixels(*sampler, 9, sample, draw);
                for lane in 0..4 {
                    let mut counts = [0.0f64; BINS];
                    for value in &values {
                        counts[((value[lane] + 0.5) * BINS as f64) as usize] += 1.0;
                    }
                    let expected = f64::from(PIXELS) / BINS as f64;
                    let chi2: f64 = counts
                        .iter()
                        .map(|c| (c - expected).powi(2) / expected)
                        .sum();
                    // 63 degrees of freedom: 63 +- 11.2.
                    let place = format!("{name}: sample {sample}, draw {draw}, lane {lane}");
                    assert!(chi2 < 63.0 + 6.0 * 11.2, "{place}: chi^2 {chi2}");
                }
            }
        }
    }
}

/// Light of the ceiling on diffuse walls, by both strategies: a picture for each of some seeds.
fn pictures(sampler: Sampler, seeds: std::ops::Range<u32>, samples: u32) -> Vec<Vec<f64>> {
    let room = Room {
        emitters: vec![3],
        radiance: 3.0,
        max_depth: 2,
        width: 16,
        height: 12,
        ..Room::default()
    };
    let picture = |seed| {
        let options = RenderOptions {
            samples,
            seed,
            technique: Technique {
                sampler,
                ..Technique::default()
            },
            ..RenderOptions::default()
        };
        let surfaces = materials(&[Kind::Diffuse(0.5)]);
        red(&picture(&room.world(), &surfaces, &options)).collect()
    };
    seeds.map(picture).collect()
}

/// What sequences are for: light that varies smoothly converges faster than 1/n, to the same.
#[test]
fn sequences_converge_faster_than_independent_numbers() {
    let truth = pictures(Sampler::Independent, 1..2, 1 << 15).remove(0);
    let error = |sampler, samples| {
        let pictures = pictures(sampler, 2..6, samples);
        let squares = pictures.iter().flat_map(|p| p.iter().zip(&truth));
        squares.map(|(a, b)| (a - b).powi(2)).sum::<f64>()
    };
    let gain = |sampler, samples| error(Sampler::Independent, samples) / error(sampler, samples);
    for sampler in SEQUENCES {
        let (few, many) = (gain(sampler, 16), gain(sampler, 256));
        assert!(few > 4.0, "{sampler:?}: {few} at 16 samples");
        assert!(
            many > 10.0 && many > 1.5 * few,
            "{sampler:?}: {few} at 16 samples, {many} at 256"
        );
    }
}

/// What a path decides from one draw must not tell anything about what it decides from another.
#[test]
fn no_draw_of_a_path_is_used_for_two_purposes() {
    let part = random::part(Sampler::Independent, DEMAND);
    let run_of = "struct Run { seed: u32 }\nvar<private> run: Run = Run(1u);\n";
    let part = ShaderPart {
        wgsl: part.wgsl + run_of,
        ..part
    };
    let vertices: Vec<Row> = (1..=DEMAND.max_depth).map(|v| [v, 0, 0, 0]).collect();
    let body = "let v = input[i].x;
        result[i] = vec4<u32>(DRAW_CAMERA, vertex_draw(v, DRAW_LIGHT), vertex_draw(v, DRAW_SCATTERING), 0u);";
    let rows = run(&[&part], body, &vertices, vertices.len(), vertices.len());
    let of_vertices = rows
        .iter()
        .flat_map(|&[_, logic, scattering, _]| [logic, scattering]);
    let all: Vec<u32> = of_vertices.chain([rows[0][0]]).collect();
    let different: BTreeSet<u32> = all.iter().copied().collect();
    assert_eq!(different.len(), all.len(), "{all:?}");
}
