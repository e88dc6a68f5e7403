// A triangle whose material emits the same radiance everywhere on its front side.

fn sample_mesh_light(pick: LightPick, position: vec3<f32>) -> LightSample {
    let triangle = triangle_vertices(light_table[2u * pick.light].w);
    // Uniform on the triangle: Turk, Graphics Gems 1990.
    let root = sqrt(pick.u.x);
    let b = root * (1.0 - pick.u.y);
    let c = root * pick.u.y;
    let point = triangle.a + b * (triangle.b - triangle.a) + c * (triangle.c - triangle.a);
    return sample_area(pick, position, point, triangle_normal(triangle), triangle_area(triangle));
}

fn mesh_light_hit(light: u32, primitive: u32, t: f32, direction: vec3<f32>, bsdf_pdf: f32) -> vec3<f32> {
    let triangle = triangle_vertices(primitive);
    let cosine = -dot(direction, triangle_normal(triangle));
    return area_hit(light, t, cosine, triangle_area(triangle), bsdf_pdf);
}
