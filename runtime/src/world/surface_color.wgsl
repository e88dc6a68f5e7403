// The colors of corners, three a primitive in vertex_colors: linear RGB in half precision.

fn hit_color(primitive: u32, uv: vec2<f32>) -> vec3<f32> {
    let corner = attribute_corners(primitive);
    let a = vertex_color_of(corner.x);
    return a + uv.x * (vertex_color_of(corner.y) - a) + uv.y * (vertex_color_of(corner.z) - a);
}
#if color_widths

// How they change along a vector in the plane of the triangle.
fn hit_color_change(primitive: u32, along: vec3<f32>) -> vec3<f32> {
    let corner = attribute_corners(primitive);
    let way = barycentric_change(primitive, along);
    let a = vertex_color_of(corner.x);
    return way.x * (vertex_color_of(corner.y) - a) + way.y * (vertex_color_of(corner.z) - a);
}
#endif

fn vertex_color_of(corner: u32) -> vec3<f32> {
    let packed = vertex_colors[corner];
    return vec3<f32>(unpack2x16float(packed.x), unpack2x16float(packed.y).x);
}
