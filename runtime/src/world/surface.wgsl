// What a material sees of a hit: recomputed from the primitive and its barycentric coordinates
// (of corners b and c), which is more exact than going t along the ray.

fn hit_position(primitive: u32, uv: vec2<f32>) -> vec3<f32> {
    let triangle = triangle_vertices(primitive);
    return triangle.a + uv.x * (triangle.b - triangle.a) + uv.y * (triangle.c - triangle.a);
}

// Unit normal of the side from which the corners are counter-clockwise.
fn hit_geometric_normal(primitive: u32) -> vec3<f32> {
    return triangle_normal(triangle_vertices(primitive));
}

// A ray's origin moved off the surface it leaves, to the side `normal` points to, so that
// rounding leaves it on that side. After Waechter and Binder, "A Fast and Robust Method for
// Avoiding Self-Intersection" (2019), with distances relative to the coordinates and to the
// scene in place of absolute ones, so that scaling a scene does not change its picture.
fn offset_origin(position: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    let distance = max(ORIGIN_OFFSET * max_abs_component(position), ORIGIN_OFFSET_FLOOR);
    return position + distance * normal;
}
