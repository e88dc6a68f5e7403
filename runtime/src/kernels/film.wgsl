// Sums of radiance in 64-bit fixed point. Integer sums do not depend on their order, so
// neither does a picture depend on how its paths were scheduled.
//
// A unit is 2^-24. The limit of a single sample is such that even `samples` of the largest
// stay below 2^64 units, so a sum cannot wrap.

fn film_add(pixel: u32, radiance: vec3<f32>) {
    let limit = 0x1p39 / f32(run.samples);
    var sample = radiance;
    if !is_light(sample) {
        atomicAdd(&counters[COUNTER_FILM_NONFINITE], 1u);
        sample = vec3<f32>(0.0);
    }
    if any(sample > vec3<f32>(limit)) {
        atomicAdd(&counters[COUNTER_FILM_CLAMPED], 1u);
        sample = min(sample, vec3<f32>(limit));
    }
    film_add_channel(0u, pixel, sample.x);
    film_add_channel(1u, pixel, sample.y);
    film_add_channel(2u, pixel, sample.z);
    atomicAdd(&film[FILM_COUNT_PLANE * PIXELS + pixel], 1u);
}

// The value's units are split exactly at 2^32, which is 256.
fn film_add_channel(channel: u32, pixel: u32, value: f32) {
    let multiples = floor(value * 0x1p-8);
    let low = u32(round((value - multiples * 0x1p8) * 0x1p24));
    let plane = 2u * channel * PIXELS + pixel;
    let before = atomicAdd(&film[plane], low);
    let carry = select(0u, 1u, before > 0xffffffffu - low);
    let high = u32(multiples) + carry;
    if high != 0u {
        atomicAdd(&film[plane + PIXELS], high);
    }
}
