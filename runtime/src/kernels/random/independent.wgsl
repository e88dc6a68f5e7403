// Independent random numbers: a hash of everything that they depend on.

fn random_bits(pixel: u32, sample: u32, draw: u32) -> vec4<u32> {
    return pcg4d(vec4<u32>(pixel, sample, draw, run.seed));
}
