#if placed
// Triangles in the space of their objects, in the order of the leaves of the objects' trees; the
// world's own are an object, too. triangles[3t + k] is corner k in .xyz; .w of corner 0 is a row of
// the placement's materials, of corner 1 the light.
#else
// The scene's triangles, in the order of the BVH's leaves: a primitive is an index into it. Where the BVH refers to
// a triangle several times, it is there as often, and the first one is the primitive.
// triangles[3p + k] is corner k in .xyz; .w of corner 0 is the instance of a material, of corner 1
// the light, of corner 2 the medium.
#endif

struct Triangle {
    a: vec3<f32>,
    b: vec3<f32>,
    c: vec3<f32>
}

#if !placed
fn triangle_vertices(primitive: u32) -> Triangle {
    return Triangle(
        bitcast<vec3<f32>>(triangles[3u * primitive].xyz),
        bitcast<vec3<f32>>(triangles[3u * primitive + 1u].xyz),
        bitcast<vec3<f32>>(triangles[3u * primitive + 2u].xyz)
    );
}

// What the scene binds to the primitive: an instance of a material; NOTHING for a quad light.
fn primitive_instance(primitive: u32) -> u32 {
    return triangles[3u * primitive].w;
}

// Index into the light table; beyond it for primitives that are no sampled light.
fn primitive_light(primitive: u32) -> u32 {
    return triangles[3u * primitive + 1u].w;
}

// The medium that the primitive bounds; 0 for what is thin-walled or opaque.
fn primitive_medium(primitive: u32) -> u32 {
    return triangles[3u * primitive + 2u].w;
}
#endif

// The vector area b - a cross c - a, scaled to unit length. Scaling the edges first keeps the
// squares of very small and very large triangles in range.
fn triangle_normal(triangle: Triangle) -> vec3<f32> {
    let e1 = triangle.b - triangle.a;
    let e2 = triangle.c - triangle.a;
    let longest = max(max_abs_component(e1), max_abs_component(e2));
    return normalize(cross(e1 / longest, e2 / longest));
}

fn triangle_area(triangle: Triangle) -> f32 {
    let e1 = triangle.b - triangle.a;
    let e2 = triangle.c - triangle.a;
    let longest = max(max_abs_component(e1), max_abs_component(e2));
    return 0.5 * length(cross(e1 / longest, e2 / longest)) * longest * longest;
}

fn max_abs_component(v: vec3<f32>) -> f32 {
    return max(abs(v.x), max(abs(v.y), abs(v.z)));
}

struct Across {
    x: vec3<f32>,
    y: vec3<f32>
}

// Two unit vectors at right angles to z and to each other: Duff et al., "Building an Orthonormal
// Basis, Revisited" (2017).
fn across(z: vec3<f32>) -> Across {
    let side = select(-1.0, 1.0, z.z >= 0.0);
    let a = -1.0 / (side + z.z);
    let b = z.x * z.y * a;
    return Across(
        vec3<f32>(1.0 + side * z.x * z.x * a, side * b, -side * z.x),
        vec3<f32>(b, side + z.y * z.y * a, -z.y)
    );
}
