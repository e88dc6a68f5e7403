// Ray casts through an eight-wide compressed BVH: Ylitie, Karras and Laine, "Efficient
// Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs" (2017).
//
// A node is five words of bvh_nodes: origin, exponents and mask of inner children; bases and
// meta bytes; then for x, y and z the eight lower and the eight upper planes of the children.

const NO_PRIMITIVE: u32 = 0xffffffffu;

struct Hit {
    t: f32,
    u: f32,        // barycentric coordinate of corner b
    v: f32,        // barycentric coordinate of corner c
    primitive: u32 // NO_PRIMITIVE on a miss
}

// The ray as the slab tests need it.
struct SlabRay {
    origin: vec3<f32>,
    inverse: vec3<f32>,
    t_max: f32
}

// What a ray finds in a node: the triangles and inner nodes to visit, most urgent bit first.
struct NodeHits {
    children: vec2<u32>, // index of the first inner child; hits in bits 24..31, mask of inner children in 0..7
    triangles: vec2<u32> // index of the first triangle; hits in bits 0..23
}

// The nearest hit with 0 < t < t_max on another primitive than `skip`; `direction` is a unit vector.
fn trace_closest(origin: vec3<f32>, direction: vec3<f32>, t_max: f32, skip: u32) -> Hit {
    return traverse(origin, direction, t_max, skip, false);
}

// Is there any such hit?
fn trace_any(origin: vec3<f32>, direction: vec3<f32>, t_max: f32, skip: u32) -> bool {
    return traverse(origin, direction, t_max, skip, true).primitive != NO_PRIMITIVE;
}

fn traverse(origin: vec3<f32>, direction: vec3<f32>, t_max: f32, skip: u32, any_hit: bool) -> Hit {
    var ray = SlabRay(origin, safe_inverse(direction), t_max);
    let frame = RayFrame(origin, across(direction), direction);
    let octant = traversal_octant(direction);
    var hit = Hit(t_max, 0.0, 0.0, NO_PRIMITIVE);
    var stack: array<vec2<u32>, BVH_STACK_SIZE>;
    var stacked = 0u;
    // A group of inner nodes that are still to be visited; the first is the root alone.
    var group = vec2<u32>(0u, 0x80000000u);
    loop {
        let bit = firstLeadingBit(group.y);
        let slot = (bit - 24u) ^ (octant & 0xffu);
        let node = group.x + countOneBits(group.y & ~(0xffffffffu << slot));
        group.y = group.y & ~(1u << bit);
        if group.y > 0x00ffffffu {
            stack[stacked] = group;
            stacked += 1u;
        }
        let found = intersect_node(node, ray, octant);
        group = found.children;

        var leaves = found.triangles;
        while leaves.y != 0u {
            let leaf = firstLeadingBit(leaves.y);
            leaves.y = leaves.y & ~(1u << leaf);
            let primitive = leaves.x + leaf;
            let tuv = intersect_triangle(triangle_vertices(primitive), frame);
            if primitive != skip && tuv.x > 0.0 && tuv.x < hit.t {
                hit = Hit(tuv.x, tuv.y, tuv.z, primitive);
                ray.t_max = tuv.x;
                if any_hit {
                    return hit;
                }
            }
        }
        if group.y <= 0x00ffffffu {
            if stacked == 0u {
                break;
            }
            stacked -= 1u;
            group = stack[stacked];
        }
    }
    return hit;
}

// 1 / direction, with components too small to divide by replaced by tiny ones of the same sign:
// slabs parallel to the ray then lie (finitely) far before or behind its origin, or contain it.
fn safe_inverse(direction: vec3<f32>) -> vec3<f32> {
    let tiny = select(vec3<f32>(1e-18), vec3<f32>(-1e-18), direction < vec3<f32>(0.0));
    return 1.0 / select(tiny, direction, abs(direction) > vec3<f32>(1e-18));
}

// In each byte the octant to visit first: bits set where the direction is not negative.
fn traversal_octant(direction: vec3<f32>) -> u32 {
    let bits = select(vec3<u32>(0x04040404u, 0x02020202u, 0x01010101u), vec3<u32>(0u), direction < vec3<f32>(0.0));
    return bits.x | bits.y | bits.z;
}

fn intersect_node(node: u32, ray: SlabRay, octant: u32) -> NodeHits {
    let head = bvh_nodes[5u * node];
    let bases = bvh_nodes[5u * node + 1u];
    let exponents = (vec3<u32>(head.w) >> vec3<u32>(0u, 8u, 16u)) & vec3<u32>(0xffu);
    let step = bitcast<vec3<f32>>(exponents << vec3<u32>(23u)) * ray.inverse;
    let start = (bitcast<vec3<f32>>(head.xyz) - ray.origin) * ray.inverse;
    // Rounding here and in the builder moves planes by some units in the last place of the
    // terms below; widening every slab by more than that keeps the boxes conservative.
    let slack = BVH_SLACK * (abs(start) + 255.0 * abs(step));

    let x = bvh_nodes[5u * node + 2u];
    let y = bvh_nodes[5u * node + 3u];
    let z = bvh_nodes[5u * node + 4u];
    let flip = ray.inverse < vec3<f32>(0.0);
    let near_x = select(x.xy, x.zw, flip.x);
    let near_y = select(y.xy, y.zw, flip.y);
    let near_z = select(z.xy, z.zw, flip.z);
    let far_x = select(x.zw, x.xy, flip.x);
    let far_y = select(y.zw, y.xy, flip.y);
    let far_z = select(z.zw, z.xy, flip.z);

    let hits = intersect_children(bases.z, octant, step, start - slack, start + slack,
            vec3<u32>(near_x.x, near_y.x, near_z.x), vec3<u32>(far_x.x, far_y.x, far_z.x), ray.t_max)
        | intersect_children(bases.w, octant, step, start - slack, start + slack,
            vec3<u32>(near_x.y, near_y.y, near_z.y), vec3<u32>(far_x.y, far_y.y, far_z.y), ray.t_max);
    return NodeHits(
        vec2<u32>(bases.x, (hits & 0xff000000u) | (head.w >> 24u)),
        vec2<u32>(bases.y, hits & 0x00ffffffu)
    );
}

// Slab tests of four children; one byte each in `child_meta`, `near` and `far`.
fn intersect_children(
    child_meta: u32, octant: u32, step: vec3<f32>, near_start: vec3<f32>, far_start: vec3<f32>,
    near: vec3<u32>, far: vec3<u32>, t_max: f32
) -> u32 {
    let t_near = max(
        max(bytes(near.x) * step.x + near_start.x, bytes(near.y) * step.y + near_start.y),
        max(bytes(near.z) * step.z + near_start.z, vec4<f32>(0.0))
    );
    let t_far = min(
        min(bytes(far.x) * step.x + far_start.x, bytes(far.y) * step.y + far_start.y),
        min(bytes(far.z) * step.z + far_start.z, vec4<f32>(t_max))
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
    return vec4<f32>((vec4<u32>(word) >> vec4<u32>(0u, 8u, 16u, 24u)) & vec4<u32>(0xffu));
}

// The frame of a ray: two unit vectors across it, its direction as z.
struct RayFrame {
    origin: vec3<f32>,
    across: Across,
    z: vec3<f32>
}

// t and the barycentric coordinates of b and c; t = -1 on a miss. As in Woop, Benthin and Wald,
// "Watertight Ray/Triangle Intersection" (2013), corners are moved to the ray's frame, where
// edges are tested in two dimensions. The order of operations matters: see edge_side.
fn intersect_triangle(triangle: Triangle, frame: RayFrame) -> vec3<f32> {
    let a = to_frame(triangle.a, frame);
    let b = to_frame(triangle.b, frame);
    let c = to_frame(triangle.c, frame);
    let weights = vec3<f32>(edge_side(b.xy, c.xy), edge_side(c.xy, a.xy), edge_side(a.xy, b.xy));
    let inside = all(weights >= vec3<f32>(0.0)) || all(weights <= vec3<f32>(0.0));
    let sum = weights.x + weights.y + weights.z;
    if !(inside && abs(sum) > 1e-37) {
        return vec3<f32>(-1.0, 0.0, 0.0);
    }
    let barycentric = weights / sum;
    return vec3<f32>(dot(barycentric, vec3<f32>(a.z, b.z, c.z)), barycentric.yz);
}

fn to_frame(point: vec3<f32>, frame: RayFrame) -> vec3<f32> {
    let p = point - frame.origin;
    return vec3<f32>(dot(frame.across.x, p), dot(frame.across.y, p), dot(frame.z, p));
}

// On which side of the edge from p to q is the ray, times twice the area they span? It is
// p.x q.y - p.y q.x in a form that the triangle on the other side, which has the edge from q to
// p, evaluates to the exact negative, whether or not the driver fuses multiplications with
// additions. So no ray passes between them.
fn edge_side(p: vec2<f32>, q: vec2<f32>) -> f32 {
    let middle = p + q;
    let edge = q - p;
    return middle.x * edge.y - middle.y * edge.x;
}
