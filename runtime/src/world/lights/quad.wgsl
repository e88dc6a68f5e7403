// A parallelogram: two triangles in the mesh. The first has the corner, the end of the first edge
// and the opposite corner, and stands for both: the area is twice its own.

#if two_sided_lights
// Does the back emit as well?
fn is_two_sided(light: u32) -> bool {
    return light_table[2u * light + 1u].w == 1u;
}

#endif
fn sample_quad_light(pick: LightPick, position: vec3<f32>) -> LightSample {
    let triangle = triangle_vertices(light_table[2u * pick.light].w);
    let point = triangle.a + pick.u.x * (triangle.b - triangle.a) + pick.u.y * (triangle.c - triangle.b);
#if two_sided_lights
    let front = triangle_normal(triangle);
    let back_seen = is_two_sided(pick.light) && dot(position - point, front) < 0.0;
    let normal = select(front, -front, back_seen);
#else
    let normal = triangle_normal(triangle);
#endif
    return sample_area(pick, position, point, normal, 2.0 * triangle_area(triangle));
}

fn quad_light_hit(light: u32, primitive: u32, t: f32, direction: vec3<f32>, bsdf_pdf: f32) -> vec3<f32> {
    let triangle = triangle_vertices(primitive);
#if two_sided_lights
    let front = -dot(direction, triangle_normal(triangle));
    let cosine = select(front, abs(front), is_two_sided(light));
#else
    let cosine = -dot(direction, triangle_normal(triangle));
#endif
    return area_hit(light, t, cosine, 2.0 * triangle_area(triangle), bsdf_pdf);
}
