// Ray casts: what all acceleration structures share.
//
// A cast is a state that moves in small steps, so that a kernel may cast one ray a thread
// (`trace`, below) or keep many rays in flight and take up new ones in between (fetch.wgsl).
// A structure (bvh_wide.wgsl, bvh_binary.wgsl) provides the steps:
//
//     start_nodes(walk, root)   makes the node `root` the first to visit
//     visit_node(walk)          visits the next node, and leaves triangles in walk.leaves
//     take_next(walk)           is there another node? If need be, takes one from the stack.

const NO_PRIMITIVE: u32 = 0xffffffffu;

struct Hit {
    t: f32,
    u: f32,        // barycentric coordinate of corner b
    v: f32,        // barycentric coordinate of corner c
    primitive: u32 // NO_PRIMITIVE on a miss
}

struct Walk {
    frame: RayFrame,
    inverse: vec3<f32>, // see safe_inverse
#if wide
    octant: u32,        // see traversal_octant
#endif
#if placed
    origin: vec3<f32>,  // the ray's, in the space of the tree that is walked
    padding: vec3<f32>, // how much wider slabs are there, as distances along the ray
    placement: u32,     // whose tree that is; NO_PLACEMENT for the tree of placements
    places: vec2<u32>,  // placements still to be entered: the first one's index, and a bit each
    outer: Group,       // what was left of the group of the tree of placements
#endif
    skip: u32,          // the primitive that is not hit
    hit: Hit,           // the nearest so far; its t bounds what is looked for
    group: Group,       // nodes still to be visited, beside those on the stack
    leaves: vec2<u32>,  // triangles still to be tested: the first one's index, and a bit each
    stacked: u32,       // how many groups are on the stack
    stack_floor: u32    // how many of them were there before this cast began
}

// The nearest hit with 0 < t < t_max on another primitive than `skip`; `direction` is a unit vector.
fn trace_closest(origin: vec3<f32>, direction: vec3<f32>, t_max: f32, skip: u32) -> Hit {
    return trace(BVH_ROOT, 0u, origin, direction, t_max, skip, false);
}

// Is there any such hit?
fn trace_any(origin: vec3<f32>, direction: vec3<f32>, t_max: f32, skip: u32) -> bool {
    return trace(BVH_ROOT, 0u, origin, direction, t_max, skip, true).primitive != NO_PRIMITIVE;
}

// Casts through the tree below `root`, where the stack already holds `stack_floor` groups of
// somebody else's.
fn trace(
    root: u32, stack_floor: u32, origin: vec3<f32>, direction: vec3<f32>, t_max: f32, skip: u32, any_hit: bool
) -> Hit {
    var walk = begin_walk(root, stack_floor, origin, direction, t_max, skip);
    loop {
        visit_node(&walk);
        while walk.leaves.y != 0u {
            visit_triangle(&walk);
            if any_hit && walk.hit.primitive != NO_PRIMITIVE {
                return walk.hit;
            }
        }
        if !take_next(&walk) {
            break;
        }
    }
    return walk.hit;
}

fn begin_walk(
    root: u32, stack_floor: u32, origin: vec3<f32>, direction: vec3<f32>, t_max: f32, skip: u32
) -> Walk {
    var walk: Walk;
    walk.frame = RayFrame(origin, across(direction), direction);
    walk.inverse = safe_inverse(direction);
#if wide
    walk.octant = traversal_octant(direction);
#endif
    walk.skip = skip;
    walk.hit = Hit(t_max, 0.0, 0.0, NO_PRIMITIVE);
    walk.leaves = vec2<u32>(0u);
    walk.stacked = stack_floor;
    walk.stack_floor = stack_floor;
#if placed
    walk.origin = origin;
    walk.padding = vec3<f32>(0.0);
    walk.placement = NO_PLACEMENT;
    walk.places = vec2<u32>(0u);
#endif
    start_nodes(&walk, root);
    return walk;
}
#if !placed

// Tests the next of walk.leaves, of which there must be one.
fn visit_triangle(walk: ptr<function, Walk>) {
    let bit = firstLeadingBit((*walk).leaves.y);
    (*walk).leaves.y &= ~(1u << bit);
#if split
    let reference = (*walk).leaves.x + bit;
    let tuv = intersect_triangle(triangle_vertices(reference), (*walk).frame);
    if !(tuv.x > 0.0 && tuv.x < (*walk).hit.t) {
        return;
    }
    let primitive = primitive_of(reference);
#else
    let primitive = (*walk).leaves.x + bit;
    let tuv = intersect_triangle(triangle_vertices(primitive), (*walk).frame);
#endif
    if primitive != (*walk).skip && tuv.x > 0.0 && tuv.x < (*walk).hit.t {
        (*walk).hit = Hit(tuv.x, tuv.y, tuv.z, primitive);
    }
}
#endif
#if split

// The primitive that a reference is: the first of those to its triangle. Where it is not the first, the place of
// the light says which is: bits 0..30, below a set bit, and not all of them.
fn primitive_of(reference: u32) -> u32 {
    let light = triangles[3u * reference + 1u].w;
    return select(reference, light & 0x7fffffffu, light >= 0x80000000u && light != 0xffffffffu);
}
#endif

// 1 / direction, with components too small to divide by replaced by tiny ones of the same sign:
// slabs parallel to the ray then lie (finitely) far before or behind its origin, or contain it.
fn safe_inverse(direction: vec3<f32>) -> vec3<f32> {
    let tiny = select(vec3<f32>(1e-18), vec3<f32>(-1e-18), direction < vec3<f32>(0.0));
    return 1.0 / select(tiny, direction, abs(direction) > vec3<f32>(1e-18));
}
