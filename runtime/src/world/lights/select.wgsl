// The choice of a light: Walker's alias method over light_table, two rows of words a light:
// threshold (of 2^32), alias, probability, primitive (of lights with a surface); radiance (of the
// same) and a flag.
//
// The choice is made in integers: among a million lights, 24 bits would leave some with a tenth
// more than the probability that is said of them.

struct LightPick {
    light: u32,
    probability: f32,
    u: vec3<f32> // fresh uniform numbers in [0, 1)
}

fn pick_light(bits: vec4<u32>) -> LightPick {
    let point = vec2<f32>(bits.yz >> vec2<u32>(8u)) * 0x1p-24;
#if light_choice
    let place = light_place(bits);
    let choice = light_table[2u * place.x];
    let stays = place.y < choice.x;
    let light = select(choice.y, place.x, stays);
    return LightPick(light, light_probability(light), vec3<f32>(point, renew_word(place.y, choice.x)));
#else
    return LightPick(0u, light_probability(0u), vec3<f32>(point, 0.0));
#endif
}

// A slot of the table, and a number in it as a fraction of 2^32. The number that decides has 56
// bits: x, and the low bytes of the others, which those do not use themselves.
fn light_place(bits: vec4<u32>) -> vec2<u32> {
    let low = (bits.y << 24u) | ((bits.z & 0xffu) << 16u) | ((bits.w & 0xffu) << 8u);
    let rest = bits.x * LIGHT_COUNT;
    let within = rest + multiply_high(low, LIGHT_COUNT);
    let carry = select(0u, 1u, within < rest);
    return vec2<u32>(multiply_high(bits.x, LIGHT_COUNT) + carry, within);
}

// The upper word of a product.
fn multiply_high(a: u32, b: u32) -> u32 {
    let low = (a & 0xffffu) * (b & 0xffffu);
    let first = (a >> 16u) * (b & 0xffffu) + (low >> 16u);
    let second = (a & 0xffffu) * (b >> 16u) + (first & 0xffffu);
    return (a >> 16u) * (b >> 16u) + (first >> 16u) + (second >> 16u);
}

// A fraction of 2^32 that was compared with a threshold, stretched to be uniform in [0, 1) again.
fn renew_word(fraction: u32, threshold: u32) -> f32 {
    let below = fraction < threshold;
    let span = select(0x1p32 - f32(threshold), f32(threshold), below);
    let above = fraction - select(threshold, 0u, below);
    return min(f32(above) / max(span, 1.0), 0.99999994);
}

fn light_probability(light: u32) -> f32 {
    return bitcast<f32>(light_table[2u * light].z);
}

fn light_radiance(light: u32) -> vec3<f32> {
    return bitcast<vec3<f32>>(light_table[2u * light + 1u].xyz);
}
