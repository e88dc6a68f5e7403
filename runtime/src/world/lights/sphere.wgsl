// Spheres of triangles, in pairs that are mirror images through the centre. The buffer has for each light the
// primitives of one of each pair, those of the others, and the cone.

fn sample_sphere_light(pick: LightPick, position: vec3<f32>) -> LightSample {
    let first = (pick.light - FIRST_SPHERE_LIGHT) * SPHERE_WORDS;
    let pair = first + min(u32(pick.u.z * f32(SPHERE_PAIRS)), SPHERE_PAIRS - 1u);
    var triangle = triangle_vertices(sphere_lights[pair]);
    if !(dot(position - triangle.a, triangle_normal(triangle)) > 0.0) {
        triangle = triangle_vertices(sphere_lights[pair + SPHERE_PAIRS]);
    }
    // Uniform on the triangle: Turk, Graphics Gems 1990.
    let root = sqrt(pick.u.x);
    let b = root * (1.0 - pick.u.y);
    let c = root * pick.u.y;
    let point = triangle.a + b * (triangle.b - triangle.a) + c * (triangle.c - triangle.a);
    let area = f32(SPHERE_PAIRS) * triangle_area(triangle);
#if spot_lights
    var found = sample_area(pick, position, point, triangle_normal(triangle), area);
    found.radiance *= spot_share(pick.light, -found.wi);
    return found;
#else
    return sample_area(pick, position, point, triangle_normal(triangle), area);
#endif
}

fn sphere_light_hit(light: u32, primitive: u32, t: f32, direction: vec3<f32>, bsdf_pdf: f32) -> vec3<f32> {
    let triangle = triangle_vertices(primitive);
    let cosine = -dot(direction, triangle_normal(triangle));
    let area = f32(SPHERE_PAIRS) * triangle_area(triangle);
#if spot_lights
    return spot_share(light, -direction) * area_hit(light, t, cosine, area, bsdf_pdf);
#else
    return area_hit(light, t, cosine, area, bsdf_pdf);
#endif
}
#if spot_lights

// What a light shines of its radiance into a direction: all within the inner angle of its cone, nothing beyond the
// outer one. glTF, KHR_lights_punctual.
fn spot_share(light: u32, direction: vec3<f32>) -> f32 {
    let at = (light - FIRST_SPHERE_LIGHT) * SPHERE_WORDS + 2u * SPHERE_PAIRS;
    let axis = bitcast<vec3<f32>>(vec3<u32>(sphere_lights[at], sphere_lights[at + 1u], sphere_lights[at + 2u]));
    let outer = bitcast<f32>(sphere_lights[at + 3u]);
    let slope = bitcast<f32>(sphere_lights[at + 4u]);
    let share = saturate((dot(axis, direction) - outer) * slope);
    return share * share;
}
#endif
