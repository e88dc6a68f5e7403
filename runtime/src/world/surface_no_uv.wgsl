// Texture coordinates of a scene that has none, or whose materials read none.

fn hit_uv(primitive: u32, uv: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(0.0);
}

fn hit_tangent(primitive: u32) -> vec3<f32> {
    return vec3<f32>(0.0);
}

fn hit_uv_change(primitive: u32, along: vec3<f32>) -> vec2<f32> {
    return vec2<f32>(0.0);
}
