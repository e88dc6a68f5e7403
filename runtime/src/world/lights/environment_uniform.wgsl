// An environment of the same radiance in all directions, found by chance only.

fn environment_escape(direction: vec3<f32>, bsdf_pdf: f32) -> vec3<f32> {
    return ENVIRONMENT_RADIANCE;
}
