// Lights at infinity: a direction, or a disc of directions with uniform radiance.

struct DistantLight {
    axis: vec3<f32>,   // unit, towards the light
    value: vec3<f32>,  // radiance of the disc, or irradiance of a single direction
    sine2: f32,        // sin^2 of half the angular radius; 0 for a single direction
    pdf: f32           // density by solid angle of a uniform direction in the disc
}

fn sample_distant_light(pick: LightPick, position: vec3<f32>) -> LightSample {
    let light = distant_light(pick.light - FIRST_DISTANT_LIGHT);
#if disc_lights && directional_lights
    if !(light.sine2 > 0.0) {
        return LightSample(light.axis, FAR_AWAY, light.value / pick.probability, 0.0);
    }
#endif
#if disc_lights
    // h = (1 - cos theta) / 2 is uniform, and exact where the cosine is all but 1.
    let h = light.sine2 * pick.u.x;
    let sine = 2.0 * sqrt(h * (1.0 - h));
    let phi = 6.2831855 * pick.u.y;
    let frame = across(light.axis);
    let wi = (1.0 - 2.0 * h) * light.axis + sine * (cos(phi) * frame.x + sin(phi) * frame.y);
    let pdf = pick.probability * light.pdf;
    return LightSample(normalize(wi), FAR_AWAY, light.value / pdf, pdf);
#else
    return LightSample(light.axis, FAR_AWAY, light.value / pick.probability, 0.0);
#endif
}
#if disc_lights

fn distant_light_escape(direction: vec3<f32>, bsdf_pdf: f32) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var i = 0u; i < DISTANT_LIGHTS; i += 1u) {
        let light = distant_light(i);
        // The chord is 2 sin(theta / 2): no cosine that rounds to 1.
        let chord = direction - light.axis;
        if dot(chord, chord) < 4.0 * light.sine2 {
#if mis
            let pdf = light_probability(FIRST_DISTANT_LIGHT + i) * light.pdf;
            sum += scattering_weight(bsdf_pdf, pdf) * light.value;
#else
            sum += light.value;
#endif
        }
    }
    return sum;
}
#endif
