// The choice of a light: Walker's alias method over light_table, two words a light: threshold,
// alias, probability, primitive (of lights with a surface); radiance (of the same) and a flag.

struct LightPick {
    light: u32,
    probability: f32,
    u: vec3<f32> // fresh uniform numbers in [0, 1)
}

fn pick_light(u: vec4<f32>) -> LightPick {
    let slot = min(u32(u.x * f32(LIGHT_COUNT)), LIGHT_COUNT - 1u);
    let choice = light_table[2u * slot];
    let threshold = bitcast<f32>(choice.x);
    let stays = u.w < threshold;
    let light = select(choice.y, slot, stays);
    return LightPick(light, light_probability(light), vec3<f32>(u.yz, renew(u.w, threshold)));
}

fn light_probability(light: u32) -> f32 {
    return bitcast<f32>(light_table[2u * light].z);
}

fn light_radiance(light: u32) -> vec3<f32> {
    return bitcast<vec3<f32>>(light_table[2u * light + 1u].xyz);
}

// A uniform number that was compared with a threshold, stretched to be uniform again.
fn renew(u: f32, threshold: f32) -> f32 {
    let below = u < threshold;
    let span = select(1.0 - threshold, threshold, below);
    return clamp(select(u - threshold, u, below) / max(span, 1e-30), 0.0, 0.99999994);
}
