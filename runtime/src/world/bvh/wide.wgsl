// Nodes of an eight-wide compressed BVH: Ylitie, Karras and Laine, "Efficient Incoherent Ray
// Traversal on GPUs Through Compressed Wide BVHs" (2017).
//
// A node is five words of bvh_nodes: origin, exponents and mask of inner children; bases and
// meta bytes; then for x, y and z the eight lower and the eight upper planes of the children.

// Inner nodes with one parent: the index of its first inner child; hits in bits 24..31, most
// urgent first, and the mask of inner children in 0..7.
alias Group = vec2<u32>;

fn start_nodes(walk: ptr<function, Walk>, root: u32) {
    // The root alone, as if it were the first child of somebody.
    (*walk).group = Group(root, 0x80000000u);
#if trail
    begin_trail();
#endif
}

fn visit_node(walk: ptr<function, Walk>) {
    let group = (*walk).group;
    let bit = firstLeadingBit(group.y);
    let slot = (bit - 24u) ^ ((*walk).octant & 0xffu);
    let node = group.x + countOneBits(group.y & ~(0xffffffffu << slot));
    let rest = group.y & ~(1u << bit);
#if trail
    push_trail(rest >> 24u);
    trail_node = node;
#else
    if rest > 0x00ffffffu {
        store_stack((*walk).stacked, Group(group.x, rest));
        (*walk).stacked += 1u;
    }
#endif
    intersect_node(node, walk);
}

#if placed
fn take_in_tree(walk: ptr<function, Walk>) -> bool {
#else
fn take_next(walk: ptr<function, Walk>) -> bool {
#endif
    if (*walk).group.y > 0x00ffffffu {
        return true;
    }
#if trail
    if trail_is_empty() {
        return false;
    }
    var node = trail_node;
    var rest = 0u;
    while rest == 0u {
        node = bvh_parents[node];
        rest = pop_trail();
    }
    trail_node = node;
    (*walk).group = Group(bvh_nodes[5u * node + 1u].x, (rest << 24u) | (bvh_nodes[5u * node].w >> 24u));
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

// In each byte the octant to visit first: bits set where the direction is not negative.
fn traversal_octant(direction: vec3<f32>) -> u32 {
    let bits = select(vec3<u32>(0x04040404u, 0x02020202u, 0x01010101u), vec3<u32>(0u), direction < vec3<f32>(0.0));
    return bits.x | bits.y | bits.z;
}

// Finds the children of a node that the ray meets: walk.group and walk.leaves.
fn intersect_node(node: u32, walk: ptr<function, Walk>) {
    let inverse = (*walk).inverse;
    let octant = (*walk).octant;
    let t_max = (*walk).hit.t;
    let head = bvh_nodes[5u * node];
    let bases = bvh_nodes[5u * node + 1u];
    let exponents = (vec3<u32>(head.w) >> vec3<u32>(0u, 8u, 16u)) & vec3<u32>(0xffu);
    let step = bitcast<vec3<f32>>(exponents << vec3<u32>(23u)) * inverse;
#if placed
    let start = (bitcast<vec3<f32>>(head.xyz) - (*walk).origin) * inverse;
#else
    let start = (bitcast<vec3<f32>>(head.xyz) - (*walk).frame.origin) * inverse;
#endif
    // Rounding here and in the builder moves planes by some units in the last place of the
    // terms below; widening every slab by more than that keeps the boxes conservative.
#if placed
    let slack = BVH_SLACK * (abs(start) + 255.0 * abs(step)) + (*walk).padding;
#else
    let slack = BVH_SLACK * (abs(start) + 255.0 * abs(step));
#endif

    let x = bvh_nodes[5u * node + 2u];
    let y = bvh_nodes[5u * node + 3u];
    let z = bvh_nodes[5u * node + 4u];
    let flip = inverse < vec3<f32>(0.0);
    let near_x = select(x.xy, x.zw, flip.x);
    let near_y = select(y.xy, y.zw, flip.y);
    let near_z = select(z.xy, z.zw, flip.z);
    let far_x = select(x.zw, x.xy, flip.x);
    let far_y = select(y.zw, y.xy, flip.y);
    let far_z = select(z.zw, z.xy, flip.z);

    let hits = intersect_children(bases.z, octant, step, start - slack, start + slack,
            vec3<u32>(near_x.x, near_y.x, near_z.x), vec3<u32>(far_x.x, far_y.x, far_z.x), t_max)
        | intersect_children(bases.w, octant, step, start - slack, start + slack,
            vec3<u32>(near_x.y, near_y.y, near_z.y), vec3<u32>(far_x.y, far_y.y, far_z.y), t_max);
    (*walk).group = Group(bases.x, (hits & 0xff000000u) | (head.w >> 24u));
    (*walk).leaves = vec2<u32>(bases.y, hits & 0x00ffffffu);
}

// The bits of floats, which as integers have the order of the floats where these are not negative.
// Of negative ones the slab tests ask the sign alone, and three integers are compared at once.
fn ordered(distances: vec4<f32>) -> vec4<i32> {
    return bitcast<vec4<i32>>(distances);
}

// Slab tests of four children; one byte each in `child_meta`, `near` and `far`.
fn intersect_children(
    child_meta: u32, octant: u32, step: vec3<f32>, near_start: vec3<f32>, far_start: vec3<f32>,
    near: vec3<u32>, far: vec3<u32>, t_max: f32
) -> u32 {
    let t_near = max(
        max(ordered(bytes(near.x) * step.x + near_start.x), ordered(bytes(near.y) * step.y + near_start.y)),
        max(ordered(bytes(near.z) * step.z + near_start.z), vec4<i32>(0))
    );
    let t_far = min(
        min(ordered(bytes(far.x) * step.x + far_start.x), ordered(bytes(far.y) * step.y + far_start.y)),
        min(ordered(bytes(far.z) * step.z + far_start.z), ordered(vec4<f32>(t_max)))
    );
    // A leaf's meta byte is its triangles in unary (3 bits) and their offset (5 bits); an inner
    // child's is 1 and its slot plus 24, where the octant makes slots an order of visiting.
    let inner = (child_meta & (child_meta << 1u)) & 0x10101010u;
    let shifts = (child_meta ^ (octant & ((inner >> 4u) * 0xffu))) & 0x1f1f1f1fu;
    let lanes = vec4<u32>(0u, 8u, 16u, 24u);
    let child_bits = (vec4<u32>(child_meta) >> (lanes + 5u)) & vec4<u32>(7u);
    let child_shifts = (vec4<u32>(shifts) >> lanes) & vec4<u32>(31u);
    let hits = select(vec4<u32>(0u), child_bits << child_shifts, t_near <= t_far);
    return hits.x | hits.y | hits.z | hits.w;
}

fn bytes(word: u32) -> vec4<f32> {
    return vec4<f32>(unpack4xU8(word));
}
