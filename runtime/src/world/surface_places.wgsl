// The places of objects: which entry or placement of the scene a primitive is of.

fn hit_place(primitive: u32) -> u32 {
#if placed
    let place = place_of(primitive);
    let own = placement_places[place.placement];
    if own != NO_PLACE {
        return own;
    }
    // Triangles in the world come first, each with a place of its own.
    return triangle_places[place.triangle];
#else
    return triangle_places[primitive];
#endif
}
#if spaces

// place_spaces holds six words a place:
//     0..2  the rows of the matrix from vectors of the world to those of the object; .w the translation to the world
//     3..5  the columns of its inverse; .w of the first how many metres a unit of the object takes
const SPACE_WORDS: u32 = 6u;

// About the translation, since the difference of near places is exact.
fn hit_object_position(primitive: u32, uv: vec2<f32>) -> vec3<f32> {
    let first = SPACE_WORDS * hit_place(primitive);
    let x = place_spaces[first];
    let y = place_spaces[first + 1u];
    let z = place_spaces[first + 2u];
    let way = hit_position(primitive, uv) - vec3<f32>(x.w, y.w, z.w);
    return vec3<f32>(dot(x.xyz, way), dot(y.xyz, way), dot(z.xyz, way));
}

fn hit_object_scale(primitive: u32) -> f32 {
    return place_spaces[SPACE_WORDS * hit_place(primitive) + 3u].w;
}

fn hit_object_from_world(primitive: u32) -> mat3x3<f32> {
    let first = SPACE_WORDS * hit_place(primitive);
    let x = place_spaces[first];
    let y = place_spaces[first + 1u];
    let z = place_spaces[first + 2u];
    return mat3x3<f32>(
        vec3<f32>(x.x, y.x, z.x),
        vec3<f32>(x.y, y.y, z.y),
        vec3<f32>(x.z, y.z, z.z)
    );
}

fn hit_world_from_object(primitive: u32) -> mat3x3<f32> {
    let first = SPACE_WORDS * hit_place(primitive) + 3u;
    return mat3x3<f32>(place_spaces[first].xyz, place_spaces[first + 1u].xyz, place_spaces[first + 2u].xyz);
}
#endif
