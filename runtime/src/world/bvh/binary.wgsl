// Nodes of a binary BVH, after Aila and Laine, "Understanding the Efficiency of Ray Traversal on
// GPUs" (2009): the boxes of both children lie in their parent, so that a child is fetched only
// if it is hit.
//
// A node is four words of bvh_nodes: for the one child and then for the other, the lower corner
// with a reference to the child, and the upper corner. A reference is the index of an inner node,
// or for a leaf bit 31, the number of its triangles in bits 27..30, and the first one.

// The reference to visit next; NO_NODE if it is on the stack.
alias Group = u32;

const NO_NODE: u32 = 0xffffffffu;
const LEAF: u32 = 0x80000000u;

fn start_nodes(walk: ptr<function, Walk>, root: u32) {
    (*walk).group = root;
#if trail
    begin_trail();
#endif
}

fn visit_node(walk: ptr<function, Walk>) {
    let reference = (*walk).group;
    if reference >= LEAF {
        (*walk).leaves = vec2<u32>(reference & 0x07ffffffu, (1u << ((reference >> 27u) & 15u)) - 1u);
        (*walk).group = NO_NODE;
        return;
    }
    let a_low = bvh_nodes[4u * reference];
    let a_high = bvh_nodes[4u * reference + 1u];
    let b_low = bvh_nodes[4u * reference + 2u];
    let b_high = bvh_nodes[4u * reference + 3u];
    let a = enter_box(a_low.xyz, a_high.xyz, walk);
    let b = enter_box(b_low.xyz, b_high.xyz, walk);
    let nearer = select(a_low.w, b_low.w, b < a);
    let farther = select(b_low.w, a_low.w, b < a);
    let both = max(a, b) < OUTSIDE;
    let none = min(a, b) >= OUTSIDE;
#if trail
    if none {
        trail_child = reference;
        (*walk).group = NO_NODE;
        return;
    }
    push_trail(select(0u, 1u, both));
    trail_node = reference;
    trail_child = nearer;
    (*walk).group = nearer;
#else
    if both {
        store_stack((*walk).stacked, farther);
        (*walk).stacked += 1u;
    }
    (*walk).group = select(nearer, NO_NODE, none);
#endif
}

#if placed
fn take_in_tree(walk: ptr<function, Walk>) -> bool {
#else
fn take_next(walk: ptr<function, Walk>) -> bool {
#endif
    if (*walk).group != NO_NODE {
        return true;
    }
#if trail
    if trail_is_empty() {
        return false;
    }
    // Up to the last node of which a child is left; its trail says so no more.
    while pop_trail() == 0u {
        trail_child = trail_node;
        trail_node = bvh_parents[trail_node];
    }
    push_trail(0u);
    let one = bvh_nodes[4u * trail_node].w;
    let other = bvh_nodes[4u * trail_node + 2u].w;
    trail_child = select(one, other, trail_child == one);
    (*walk).group = trail_child;
    return true;
#else
    if (*walk).stacked == (*walk).stack_floor {
        return false;
    }
    (*walk).stacked -= 1u;
    (*walk).group = load_stack((*walk).stacked);
    return true;
#endif
}

// More than any distance at which a box is entered.
const OUTSIDE: f32 = 3.4e38;

// Where the ray enters a box; OUTSIDE if it does not before the nearest hit.
fn enter_box(low: vec3<u32>, high: vec3<u32>, walk: ptr<function, Walk>) -> f32 {
#if placed
    let origin = (*walk).origin;
#else
    let origin = (*walk).frame.origin;
#endif
    let inverse = (*walk).inverse;
    let t_low = (bitcast<vec3<f32>>(low) - origin) * inverse;
    let t_high = (bitcast<vec3<f32>>(high) - origin) * inverse;
#if placed
    let enter = min(t_low, t_high) - (*walk).padding;
    let leave = max(t_low, t_high) + (*walk).padding;
#else
    let enter = min(t_low, t_high);
    let leave = max(t_low, t_high);
#endif
    let t_near = max(max(enter.x, enter.y), max(enter.z, 0.0));
    // Each of these is off by some units in its last place; boxes stay conservative if they
    // are left that much later (Ize, "Robust BVH Ray Traversal", 2013).
    let t_far = min(min(leave.x, leave.y), leave.z) * (1.0 + 2.0 * BVH_SLACK);
    return select(OUTSIDE, t_near, t_near <= min(t_far, (*walk).hit.t));
}
