// An environment map that is found by chance only.

fn environment_escape(direction: vec3<f32>, bsdf_pdf: f32) -> vec3<f32> {
    return environment_radiance(environment_uv(direction));
}
