// Lights with a surface: density by solid angle of a point chosen uniformly on it, and the
// emission a path runs into.

// Light from `point` on a surface of the given area and unit normal on the emitting side.
fn sample_area(pick: LightPick, position: vec3<f32>, point: vec3<f32>, normal: vec3<f32>, area: f32) -> LightSample {
    let to_light = point - position;
    let scale = max_abs_component(to_light);
    if !(scale > 1e-30) {
        return no_light_sample();
    }
    let scaled = to_light / scale;
    let distance = scale * length(scaled);
    let wi = normalize(scaled);
    let cosine = -dot(wi, normal);
    let pdf = pick.probability * area_density(distance, cosine, area);
    if !(pdf > 0.0) {
        return no_light_sample();
    }
    // Up to a point just off the surface, on the side that is lit. At grazing angles that point is
    // hardly nearer, and rounding moves where the ray meets the surface by its units in the last place
    // over the cosine. Never by more than that: what is close before a light far away shades it.
    let slack = clamp(1e-6 / cosine, 2e-6, 1e-4);
    let reach = dot(offset_origin(point, normal) - position, wi) * (1.0 - slack);
    return LightSample(wi, reach, light_radiance(pick.light) / pdf, pdf);
}

// Weighted emission of a surface that a ray of length t meets at the given cosine.
fn area_hit(light: u32, t: f32, cosine: f32, area: f32, bsdf_pdf: f32) -> vec3<f32> {
    if !(cosine > 0.0) {
        return vec3<f32>(0.0);
    }
#if mis
    let pdf = light_probability(light) * area_density(t, cosine, area);
    return scattering_weight(bsdf_pdf, pdf) * light_radiance(light);
#else
    return light_radiance(light);
#endif
}

// Density by solid angle; 0 behind the surface and where it would not be finite.
fn area_density(distance: f32, cosine: f32, area: f32) -> f32 {
    // Multiplied in an order that neither tiny nor huge scenes overflow.
    let seen = cosine * (area / distance);
    return select(0.0, distance / max(seen, 1e-30), seen > 1e-30);
}
