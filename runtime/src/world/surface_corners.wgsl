// The corners of a primitive in buffers of what corners have, and how what they have changes over the triangle.

fn attribute_corners(primitive: u32) -> vec3<u32> {
#if placed
    return corners_of(primitive);
#else
    return 3u * primitive + vec3<u32>(0u, 1u, 2u);
#endif
}
#if corner_widths

// How the barycentric coordinates of b and c change along a vector in the plane of the triangle; they do not
// where it has no area.
fn barycentric_change(primitive: u32, along: vec3<f32>) -> vec2<f32> {
    let triangle = triangle_vertices(primitive);
    let e1 = triangle.b - triangle.a;
    let e2 = triangle.c - triangle.a;
    // Scaled first, so that squares stay in range.
    let longest = max(max_abs_component(e1), max_abs_component(e2));
    let area = cross(e1 / longest, e2 / longest);
    let squared = dot(area, area);
    if !(squared > 1e-30) {
        return vec2<f32>(0.0);
    }
    let way = along / longest;
    let u = dot(cross(way, e2 / longest), area) / squared;
    let v = dot(cross(e1 / longest, way), area) / squared;
    return vec2<f32>(u, v);
}
#endif
