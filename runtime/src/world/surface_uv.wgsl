// Texture coordinates, three pairs a primitive in vertex_uvs.

fn hit_uv(primitive: u32, uv: vec2<f32>) -> vec2<f32> {
#if placed
    let corner = corners_of(primitive);
    let a = vertex_uvs[corner.x];
    let b = vertex_uvs[corner.y];
    let c = vertex_uvs[corner.z];
#else
    let a = vertex_uvs[3u * primitive];
    let b = vertex_uvs[3u * primitive + 1u];
    let c = vertex_uvs[3u * primitive + 2u];
#endif
    return a + uv.x * (b - a) + uv.y * (c - a);
}

// Unit direction in which the first texture coordinate grows; zero where there is none.
fn hit_tangent(primitive: u32) -> vec3<f32> {
    let triangle = triangle_vertices(primitive);
#if placed
    let corner = corners_of(primitive);
    let a = vertex_uvs[corner.x];
    let duv1 = vertex_uvs[corner.y] - a;
    let duv2 = vertex_uvs[corner.z] - a;
#else
    let a = vertex_uvs[3u * primitive];
    let duv1 = vertex_uvs[3u * primitive + 1u] - a;
    let duv2 = vertex_uvs[3u * primitive + 2u] - a;
#endif
    let determinant = duv1.x * duv2.y - duv1.y * duv2.x;
    let tangent = ((triangle.b - triangle.a) * duv2.y - (triangle.c - triangle.a) * duv1.y)
        * sign(determinant);
    let longest = max_abs_component(tangent);
    if !(longest > 1e-37) {
        return vec3<f32>(0.0);
    }
    return normalize(tangent / longest);
}
#if uv_widths

// How the texture coordinates change along a vector in the plane of the triangle.
fn hit_uv_change(primitive: u32, along: vec3<f32>) -> vec2<f32> {
    let corner = attribute_corners(primitive);
    let way = barycentric_change(primitive, along);
    let a = vertex_uvs[corner.x];
    return way.x * (vertex_uvs[corner.y] - a) + way.y * (vertex_uvs[corner.z] - a);
}
#endif
