// An environment of the same radiance in all directions, sampled uniformly.

// 1 / (4 pi)
const ENVIRONMENT_PDF: f32 = 0.07957747;

fn sample_environment(pick: LightPick, position: vec3<f32>) -> LightSample {
    let z = 1.0 - 2.0 * pick.u.x;
    let r = 2.0 * sqrt(pick.u.x * (1.0 - pick.u.x));
    let phi = 6.2831855 * pick.u.y;
    let pdf = pick.probability * ENVIRONMENT_PDF;
    return LightSample(vec3<f32>(r * cos(phi), r * sin(phi), z), FAR_AWAY, ENVIRONMENT_RADIANCE / pdf, pdf);
}

fn environment_escape(direction: vec3<f32>, bsdf_pdf: f32) -> vec3<f32> {
#if mis
    let pdf = light_probability(ENVIRONMENT_LIGHT) * ENVIRONMENT_PDF;
    return scattering_weight(bsdf_pdf, pdf) * ENVIRONMENT_RADIANCE;
#else
    return ENVIRONMENT_RADIANCE;
#endif
}
