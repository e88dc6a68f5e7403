// Sobol points, the same for all pixels, XORed with a random word a pixel and dimension (Laine,
// Karras and Aila 2013, section 4). The host decides which draws have dimensions: the first ones,
// below SOBOL_DRAWS. Those after are independent, as is usual where dimensions run out.
//
// random_table has four tables a draw, one for each byte of the sample's index; a point is the
// XOR of what they say of its bytes. Sample indices of neighbouring threads are alike, and the
// first byte is all that differs below 256 samples.

// Stands for the sample in the hash of a scramble, which all samples of a pixel share.
const EVERY_SAMPLE: u32 = 0xffffffffu;

fn random_bits(pixel: u32, sample: u32, draw: u32) -> vec4<u32> {
    if draw >= SOBOL_DRAWS {
        return pcg4d(vec4<u32>(pixel, sample, draw, run.seed));
    }
    return pcg4d(vec4<u32>(pixel, EVERY_SAMPLE, draw, run.seed)) ^ sobol_point(sample, draw);
}

fn sobol_point(sample: u32, draw: u32) -> vec4<u32> {
    let first = 1024u * draw;
    var point = random_table[first + (sample & 0xffu)];
    if sample >= 0x100u {
        point ^= random_table[first + 256u + ((sample >> 8u) & 0xffu)];
    }
    if sample >= 0x10000u {
        point ^= random_table[first + 512u + ((sample >> 16u) & 0xffu)]
            ^ random_table[first + 768u + (sample >> 24u)];
    }
    return point;
}
