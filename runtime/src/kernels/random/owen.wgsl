// Owen-scrambled Sobol points in four dimensions, shuffled anew for every pixel and draw. Source:
// Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020, after Laine and Karras, "Stratified
// Sampling for Stochastic Transparency", 2011.
//
// A nested uniform scramble flips each digit by a hash of the digits above it. On words whose bits
// are reversed, arithmetic whose carries run upwards is just that. random_table therefore takes
// the bytes of a reversed index and gives reversed points: four tables, one a byte.

const EVERY_SAMPLE: u32 = 0xffffffffu;

fn random_bits(pixel: u32, sample: u32, draw: u32) -> vec4<u32> {
    let seeds = pcg4d(vec4<u32>(pixel, EVERY_SAMPLE, draw, run.seed));
    let index = nested_scramble(vec4<u32>(reverseBits(sample)), vec4<u32>(spread(seeds.x ^ seeds.w))).x;
    let point = random_table[index & 0xffu]
        ^ random_table[256u + ((index >> 8u) & 0xffu)]
        ^ random_table[512u + ((index >> 16u) & 0xffu)]
        ^ random_table[768u + (index >> 24u)];
    return reverseBits(nested_scramble(point, seeds));
}

// The permutation of reversed words with the constants of Vegdahl, "Building a Better LK Hash", 2021.
fn nested_scramble(reversed: vec4<u32>, seed: vec4<u32>) -> vec4<u32> {
    var v = reversed;
    v ^= v * 0x3d20adeau;
    v += seed;
    v *= (seed >> vec4<u32>(16u)) | vec4<u32>(1u);
    v ^= v * 0x05526c56u;
    v ^= v * 0x53a22864u;
    return v;
}

// The finaliser of MurmurHash3 (Appleby 2008).
fn spread(word: u32) -> u32 {
    var bits = (word ^ (word >> 16u)) * 0x85ebca6bu;
    bits = (bits ^ (bits >> 13u)) * 0xc2b2ae35u;
    return bits ^ (bits >> 16u);
}
