
// What arrives of a single disc light along a ray that leaves the scene.
fn distant_light_share(index: u32, direction: vec3<f32>, bsdf_pdf: f32) -> vec3<f32> {
    let light = distant_light(index);
    let chord = direction - light.axis;
    if !(dot(chord, chord) < 4.0 * light.sine2) {
        return vec3<f32>(0.0);
    }
#if mis
    let pdf = light_probability(FIRST_DISTANT_LIGHT + index) * light.pdf;
    return scattering_weight(bsdf_pdf, pdf) * light.value;
#else
    return light.value;
#endif
}
