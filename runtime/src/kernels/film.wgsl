// Sums of radiance in 96-bit fixed point. Integer sums do not depend on their order, so neither
// does a picture depend on how its paths were scheduled, nor on how its samples were parted.
//
// A unit is 2^-24, and a sample is at most 2^32, which is 2^56 units: not even 2^32 samples can
// wrap a sum. The highest word is touched only when the one below it overflows.

const FILM_LIMIT: f32 = 0x1p32;

// `place` is pixel, sample and vertex.
fn film_add(place: vec3<u32>, radiance: vec3<f32>) {
    let pixel = place.x;
    var sample = radiance;
    if !is_light(sample) {
        count_dropped(DROPPED_AT_FILM, is_finite(sample), DROPPED_BY_RADIANCE, place);
        sample = vec3<f32>(0.0);
    }
    if any(sample > vec3<f32>(FILM_LIMIT)) {
        atomicAdd(&counters[COUNTER_FILM_CLAMPED], 1u);
        sample = min(sample, vec3<f32>(FILM_LIMIT));
    }
    film_add_channel(0u, pixel, sample.x);
    film_add_channel(1u, pixel, sample.y);
    film_add_channel(2u, pixel, sample.z);
#if sample_outputs
    record_sample(pixel, sample);
#endif
    atomicAdd(&film[FILM_COUNT_PLANE * PIXELS + pixel], 1u);
}

// The value's units are split exactly at 2^32, which is 256.
fn film_add_channel(channel: u32, pixel: u32, value: f32) {
    let multiples = floor(value * 0x1p-8);
    let low = u32(round((value - multiples * 0x1p8) * 0x1p24));
    let plane = 3u * channel * PIXELS + pixel;
    let high = u32(multiples) + film_carry(plane, low);
    if high != 0u {
        let top = film_carry(plane + PIXELS, high);
        if top != 0u {
            atomicAdd(&film[plane + 2u * PIXELS], top);
        }
    }
}

// Adds to a word; what it carries to the next.
fn film_carry(word: u32, value: u32) -> u32 {
    let before = atomicAdd(&film[word], value);
    return select(0u, 1u, before > 0xffffffffu - value);
}
