// Ray casts through two levels: a tree over placements, and below each the tree of its object.
//
// Nodes of an object are tested in its own space, against the ray brought there. Its triangles
// are placed and tested in the world, so that what is hit, how far away and by which rounding
// does not depend on the level: no ray passes between triangles of a placement that share an
// edge, and a ray skips the triangle that it starts on as it does elsewhere.

const NO_PLACEMENT: u32 = 0xffffffffu;

// Tests the next of walk.leaves, of which there must be one: a triangle, or in the upper tree
// placements, which are entered one after the other.
fn visit_triangle(walk: ptr<function, Walk>) {
    if (*walk).placement == NO_PLACEMENT {
        (*walk).places = (*walk).leaves;
        (*walk).leaves = vec2<u32>(0u);
        (*walk).outer = (*walk).group;
        (*walk).stack_floor = (*walk).stacked;
        enter_placement(walk);
        return;
    }
    let bit = firstLeadingBit((*walk).leaves.y);
    (*walk).leaves.y &= ~(1u << bit);
    let placement = (*walk).placement;
    let triangle = (*walk).leaves.x + bit;
#if split
    let tuv = intersect_triangle(placed_triangle(placement, triangle), (*walk).frame);
    if !(tuv.x > 0.0 && tuv.x < (*walk).hit.t) {
        return;
    }
    let primitive = primitive_of(triangle) + placements[PLACEMENT_WORDS * placement + 3u].w;
#else
    let primitive = triangle + placements[PLACEMENT_WORDS * placement + 3u].w;
    let tuv = intersect_triangle(placed_triangle(placement, triangle), (*walk).frame);
#endif
    if primitive != (*walk).skip && tuv.x > 0.0 && tuv.x < (*walk).hit.t {
        (*walk).hit = Hit(tuv.x, tuv.y, tuv.z, primitive);
    }
}

// Is there another node, in the tree that is walked or in one that is left to walk?
fn take_next(walk: ptr<function, Walk>) -> bool {
    if take_in_tree(walk) {
        return true;
    }
    if (*walk).placement == NO_PLACEMENT {
        return false;
    }
    if (*walk).places.y != 0u {
        enter_placement(walk);
        return true;
    }
    (*walk).placement = NO_PLACEMENT;
    (*walk).group = (*walk).outer;
    // Casts begin with an empty stack.
    (*walk).stack_floor = 0u;
    set_slabs(walk, (*walk).frame.origin, (*walk).frame.z, vec3<f32>(0.0));
    return take_in_tree(walk);
}

// Goes on with the tree of the next of walk.places, of which there must be one. The ray keeps
// its parameter: its direction is as long as the transform makes it.
fn enter_placement(walk: ptr<function, Walk>) {
    let bit = firstLeadingBit((*walk).places.y);
    (*walk).places.y &= ~(1u << bit);
    let placement = (*walk).places.x + bit;
    (*walk).placement = placement;
    let first = PLACEMENT_WORDS * placement;
    let translation = bitcast<vec3<f32>>(vec3<u32>(
        placements[first].w, placements[first + 1u].w, placements[first + 2u].w));
    let x = bitcast<vec3<f32>>(placements[first + 3u].xyz);
    let y = bitcast<vec3<f32>>(placements[first + 4u].xyz);
    let z = bitcast<vec3<f32>>(placements[first + 5u].xyz);
    let sums = bitcast<vec4<f32>>(placements[first + 6u]);
    let offset = (*walk).frame.origin - translation;
    let along = (*walk).frame.z;
    // Rounding moves the ray by some units in the last place of its distance from the far end of
    // the object, times what the inverse makes of them; and corners by some of where they are.
    let reach = length(offset) + abs(sums.w);
    set_slabs(
        walk,
        vec3<f32>(dot(x, offset), dot(y, offset), dot(z, offset)),
        vec3<f32>(dot(x, along), dot(y, along), dot(z, along)),
        BVH_SLACK * reach * sums.xyz
    );
    start_nodes(walk, placements[first + 4u].w);
}

// Makes boxes be tested against the ray from `origin`, all of them wider by `padding`.
fn set_slabs(walk: ptr<function, Walk>, origin: vec3<f32>, direction: vec3<f32>, padding: vec3<f32>) {
    let size = max_abs_component(direction);
    let inverse = safe_inverse(direction / size) / size;
    (*walk).origin = origin;
    (*walk).inverse = inverse;
    (*walk).padding = padding * abs(inverse);
#if wide
    (*walk).octant = traversal_octant(direction);
#endif
}
