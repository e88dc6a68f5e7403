// Shading normals of a scene with vertex normals: vertex_normals[p] holds one octahedral normal
// a corner, and in .w whether the triangle has any.

fn hit_normal(primitive: u32, uv: vec2<f32>) -> vec3<f32> {
    let geometric = hit_geometric_normal(primitive);
#if placed
    let place = place_of(primitive);
    let row = vertex_normals[place.triangle];
    let packed = select(row, row.xzyw, is_mirrored(place.placement));
    let smooth_normal = (1.0 - uv.x - uv.y) * place_normal(place.placement, unpack_normal(packed.x))
        + uv.x * place_normal(place.placement, unpack_normal(packed.y))
        + uv.y * place_normal(place.placement, unpack_normal(packed.z));
#else
    let packed = vertex_normals[primitive];
    let smooth_normal = (1.0 - uv.x - uv.y) * unpack_normal(packed.x)
        + uv.x * unpack_normal(packed.y)
        + uv.y * unpack_normal(packed.z);
#endif
    // Zero and wild vertex normals leave the hemisphere of the geometric one.
    let usable = packed.w != 0u && dot(smooth_normal, geometric) > 1e-3;
    return normalize(select(geometric, smooth_normal, usable));
}

// Octahedral coordinates in two signed 16-bit fractions: Cigolle et al., "A Survey of Efficient
// Representations for Independent Unit Vectors" (2014).
fn unpack_normal(word: u32) -> vec3<f32> {
    let p = unpack2x16snorm(word);
    let z = 1.0 - abs(p.x) - abs(p.y);
    let folded = (1.0 - abs(p.yx)) * select(vec2<f32>(-1.0), vec2<f32>(1.0), p >= vec2<f32>(0.0));
    return normalize(vec3<f32>(select(folded, p, z >= 0.0), z));
}
