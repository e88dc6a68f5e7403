// Importance sampling of an environment map: a row, then a texel in it, by alias tables with
// thresholds in 16 bits (environment_alias: one word a texel, then one a row; threshold in the low
// half, alias in the high), then a direction uniform by solid angle in the texel.

fn sample_environment(pick: LightPick, position: vec3<f32>) -> LightSample {
    let y = pick_slot(pick.u.y, ENVIRONMENT_HEIGHT, pick.u.z, ENVIRONMENT_WIDTH * ENVIRONMENT_HEIGHT);
    let x = pick_slot(pick.u.x, ENVIRONMENT_WIDTH, y.renewed, y.index * ENVIRONMENT_WIDTH);
    let pdf = pick.probability * environment_texels[y.index * ENVIRONMENT_WIDTH + x.index].w;
    if !(pdf > 0.0) {
        return no_light_sample();
    }
    // h = (1 - cos theta) / 2 measured from the nearer pole is uniform by solid angle.
    let lower = 2u * y.index >= ENVIRONMENT_HEIGHT;
    let row = select(y.index, ENVIRONMENT_HEIGHT - 1u - y.index, lower);
    let low = pole_height(f32(row));
    let h = low + (pole_height(f32(row) + 1.0) - low) * y.within;
    let sine = 2.0 * sqrt(h * (1.0 - h));
    let cosine = select(1.0 - 2.0 * h, 2.0 * h - 1.0, lower);
    let u = (f32(x.index) + x.within) / f32(ENVIRONMENT_WIDTH);
    let v = atan2(sqrt(h), sqrt(1.0 - h)) * 0.63661975;
    let phi = 6.2831855 * (u - 0.5);
    let map_direction = vec3<f32>(sine * sin(phi), cosine, -sine * cos(phi));
    let wi = turn_about_y(map_direction, -ENVIRONMENT_SINE, ENVIRONMENT_COSINE);
    let radiance = environment_radiance(vec2<f32>(u, select(v, 1.0 - v, lower)));
    return LightSample(normalize(wi), FAR_AWAY, radiance / pdf, pdf);
}

// sin^2(theta / 2) at the upper edge of a row, which is (1 - cos theta) / 2 without cancellation.
fn pole_height(row: f32) -> f32 {
    let s = sin(1.5707964 * row / f32(ENVIRONMENT_HEIGHT));
    return s * s;
}

struct SlotPick {
    index: u32,
    within: f32,  // uniform in [0, 1)
    renewed: f32  // the number that decided for or against the alias, uniform again
}

fn pick_slot(u: f32, count: u32, decision: f32, first: u32) -> SlotPick {
    let place = u * f32(count);
    let slot = min(u32(place), count - 1u);
    let entry = environment_alias[first + slot];
    let threshold = f32(entry & 0xffffu) / 65536.0;
    // Compared as integers are: the table's probabilities are exact multiples of 2^-16.
    let stays = floor(decision * 65536.0) < f32(entry & 0xffffu);
    return SlotPick(select(entry >> 16u, slot, stays), fract(place), renew(decision, threshold));
}

// A uniform number that was compared with a threshold, stretched to be uniform again.
fn renew(u: f32, threshold: f32) -> f32 {
    let below = u < threshold;
    let span = select(1.0 - threshold, threshold, below);
    return clamp(select(u - threshold, u, below) / max(span, 1e-30), 0.0, 0.99999994);
}

fn environment_escape(direction: vec3<f32>, bsdf_pdf: f32) -> vec3<f32> {
    let uv = environment_uv(direction);
#if mis
    let column = min(u32(uv.x * f32(ENVIRONMENT_WIDTH)), ENVIRONMENT_WIDTH - 1u);
    let row = min(u32(uv.y * f32(ENVIRONMENT_HEIGHT)), ENVIRONMENT_HEIGHT - 1u);
    let pdf = light_probability(ENVIRONMENT_LIGHT) * environment_texels[row * ENVIRONMENT_WIDTH + column].w;
    return scattering_weight(bsdf_pdf, pdf) * environment_radiance(uv);
#else
    return environment_radiance(uv);
#endif
}
