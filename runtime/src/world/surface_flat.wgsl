// Shading normals of a scene without vertex normals.

fn hit_normal(primitive: u32, uv: vec2<f32>) -> vec3<f32> {
    return hit_geometric_normal(primitive);
}
