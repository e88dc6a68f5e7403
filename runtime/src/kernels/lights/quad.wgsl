// A parallelogram: two triangles in the mesh. The first has the corner, the end of the first edge
// and the opposite corner, and stands for both: the area is twice its own.

// Does the back emit as well?
fn is_two_sided(light: u32) -> bool {
    return light_table[2u * light + 1u].w == 1u;
}

fn sample_quad_light(pick: LightPick, position: vec3<f32>) -> LightSample {
    let triangle = triangle_vertices(light_table[2u * pick.light].w);
    let point = triangle.a + pick.u.x * (triangle.b - triangle.a) + pick.u.y * (triangle.c - triangle.b);
    let front = triangle_normal(triangle);
    let back_seen = is_two_sided(pick.light) && dot(position - point, front) < 0.0;
    let normal = select(front, -front, back_seen);
    return sample_area(pick, position, point, normal, 2.0 * triangle_area(triangle));
}

fn quad_light_hit(light: u32, primitive: u32, t: f32, direction: vec3<f32>, bsdf_pdf: f32) -> vec3<f32> {
    let triangle = triangle_vertices(primitive);
    let cosine = -dot(direction, triangle_normal(triangle));
    let facing = select(cosine, abs(cosine), is_two_sided(light));
    return area_hit(light, t, facing, 2.0 * triangle_area(triangle), bsdf_pdf);
}
