// Objects and where they are placed. A primitive is a number that stands for one triangle of one
// placement: placements have ranges of them, of whole blocks of 2^BLOCK_SHIFT, and
// placement_blocks tells whose a block is.
//
// Corners are placed when they are read, so that all that is computed with them, the
// intersection of rays included, happens in the world as in a scene without objects.
//
// placements holds seven words a placement, those from 3 on for traversal as well:
//     0..2  the rows of the matrix to the world; .w the translation
//     3..5  the rows of its inverse; .w what primitives exceed their triangles by (modulo
//           2^32), the root of the object's tree, and its first row of placement_materials
//     6     the sums of the rows of the inverse (of magnitudes); .w how far the object reaches from
//           the ends of its translation, negative if it is mirrored

const PLACEMENT_WORDS: u32 = 7u;

// Where a primitive is stored.
struct Place {
    placement: u32,
    triangle: u32
}

fn place_of(primitive: u32) -> Place {
    let placement = placement_blocks[primitive >> BLOCK_SHIFT];
    return Place(placement, primitive - placements[PLACEMENT_WORDS * placement + 3u].w);
}

fn is_mirrored(placement: u32) -> bool {
    return bitcast<f32>(placements[PLACEMENT_WORDS * placement + 6u].w) < 0.0;
}

fn triangle_vertices(primitive: u32) -> Triangle {
    let place = place_of(primitive);
    return placed_triangle(place.placement, place.triangle);
}

fn placed_triangle(placement: u32, triangle: u32) -> Triangle {
    let a = place_point(placement, bitcast<vec3<f32>>(triangles[3u * triangle].xyz));
    let b = place_point(placement, bitcast<vec3<f32>>(triangles[3u * triangle + 1u].xyz));
    let c = place_point(placement, bitcast<vec3<f32>>(triangles[3u * triangle + 2u].xyz));
    // A mirror image goes round the other way.
    let mirrored = is_mirrored(placement);
    return Triangle(a, select(b, c, mirrored), select(c, b, mirrored));
}

// The indices of a primitive's corners, as triangle_vertices orders them.
fn corners_of(primitive: u32) -> vec3<u32> {
    let place = place_of(primitive);
    let swap = select(0u, 1u, is_mirrored(place.placement));
    return 3u * place.triangle + vec3<u32>(0u, 1u + swap, 2u - swap);
}

fn place_point(placement: u32, p: vec3<f32>) -> vec3<f32> {
    let x = bitcast<vec4<f32>>(placements[PLACEMENT_WORDS * placement]);
    let y = bitcast<vec4<f32>>(placements[PLACEMENT_WORDS * placement + 1u]);
    let z = bitcast<vec4<f32>>(placements[PLACEMENT_WORDS * placement + 2u]);
    return vec3<f32>(dot(x.xyz, p) + x.w, dot(y.xyz, p) + y.w, dot(z.xyz, p) + z.w);
}

// The unit normal of a surface that has the unit normal n in its object: times the transpose of
// the inverse.
fn place_normal(placement: u32, n: vec3<f32>) -> vec3<f32> {
    let x = bitcast<vec3<f32>>(placements[PLACEMENT_WORDS * placement + 3u].xyz);
    let y = bitcast<vec3<f32>>(placements[PLACEMENT_WORDS * placement + 4u].xyz);
    let z = bitcast<vec3<f32>>(placements[PLACEMENT_WORDS * placement + 5u].xyz);
    let normal = n.x * x + n.y * y + n.z * z;
    return normalize(normal / max_abs_component(normal));
}

// The row of placement_materials for a triangle.
fn material_row(place: Place) -> u32 {
    return placements[PLACEMENT_WORDS * place.placement + 5u].w + triangles[3u * place.triangle].w;
}

// What the scene binds to the primitive: an instance of a material; NOTHING for a quad light.
fn primitive_instance(primitive: u32) -> u32 {
    return placement_materials[material_row(place_of(primitive))].x;
}

// Index into the light table; beyond it for primitives that are no sampled light.
fn primitive_light(primitive: u32) -> u32 {
    return triangles[3u * place_of(primitive).triangle + 1u].w;
}

// The medium that the primitive bounds; 0 for what is thin-walled or opaque.
fn primitive_medium(primitive: u32) -> u32 {
    return placement_materials[material_row(place_of(primitive))].y;
}
