// The second set of texture coordinates, three pairs a primitive in vertex_uvs1.

fn hit_uv1(primitive: u32, uv: vec2<f32>) -> vec2<f32> {
    let corner = attribute_corners(primitive);
    let a = vertex_uvs1[corner.x];
    return a + uv.x * (vertex_uvs1[corner.y] - a) + uv.y * (vertex_uvs1[corner.z] - a);
}
#if uv1_widths

// How they change along a vector in the plane of the triangle.
fn hit_uv1_change(primitive: u32, along: vec3<f32>) -> vec2<f32> {
    let corner = attribute_corners(primitive);
    let way = barycentric_change(primitive, along);
    let a = vertex_uvs1[corner.x];
    return way.x * (vertex_uvs1[corner.y] - a) + way.y * (vertex_uvs1[corner.z] - a);
}
#endif
