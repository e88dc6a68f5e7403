// A ray-cast kernel of the wavefront whose threads stay until their queues are used up: Aila and Laine,
// "Understanding the Efficiency of Ray Traversal on GPUs" (2009). Rays differ in length; when
// many threads of a subgroup have finished theirs, these take the next ones.
#if several
//
// It casts the rays of several queues, those of one after those of the other: while the last long ones of a
// queue are under way, other threads have rays of the next.
#endif

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(
    @builtin(subgroup_invocation_id) lane_of_subgroup: u32, @builtin(local_invocation_index) lane: u32
) {
    subgroup_lane = lane_of_subgroup;
#if walk_lane
    walk_lane = lane;
#endif
    // Where in all items those of a queue end.
    var items = 0u;
#each casts
    items += atomicLoad(&counters[COUNTER_TAKEN + $queueu]);
    let end_of_$name = items;
#end
    let lanes = lane_count(subgroupBallot(true));
    var walk: Walk;
    var slot = 0u;
#if several
    var kind = 0u;
#else
    let kind = 0u;
#endif
    var live = false;
    var rays_left = true;
    // What the subgroup may still fetch.
    var budget = lanes * FETCH_LIMIT;
    loop {
        // Rays diverge; here the threads come together again.
        subgroupBarrier();
        let idle = subgroupBallot(!live);
        let idle_lanes = lane_count(idle);
        if rays_left && idle_lanes * 100u > lanes * FETCH_PERCENT {
            let leader = first_lane(idle);
            let count = min(idle_lanes, budget);
            var first = 0u;
            if subgroup_lane == leader {
                first = atomicAdd(&counters[COUNTER_RAYS_FETCHED], count);
            }
            first = subgroupShuffle(first, leader);
            budget -= count;
            rays_left = first + count < items && budget > 0u;
            let rank = lanes_before(idle, subgroup_lane);
            let item = first + rank;
            if !live && rank < count && item < items {
                var ray: array<vec4<u32>, 2>;
#each casts
                $otherwiseif item < end_of_$name {
#if several
                    kind = $kindu;
#endif
                    let place = item$begin;
#if slots
                    slot = queues[$regionu * POOL_SIZE + place];
#else
                    slot = place;
#endif
                    ray = $name_ray(slot);
                }
#end
                let way = bitcast<vec4<f32>>(ray[1]);
                walk = begin_walk(BVH_ROOT, 0u, bitcast<vec3<f32>>(ray[0].xyz), way.xyz, way.w, ray[0].w);
                live = true;
            }
        } else if idle_lanes == lanes {
            break;
        }
        if live && walk.leaves.y == 0u {
            visit_node(&walk);
        }
        test_triangles(&walk, kind, live);
        if live && walk.leaves.y == 0u && (is_decided(kind, walk.hit) || !take_next(&walk)) {
#each casts
            if kind == $kindu {
                end_$name(slot, walk.hit);
            }
#end
            live = false;
        }
    }
}

// Whether nothing further can change what becomes of a ray.
fn is_decided(kind: u32, hit: Hit) -> bool {
#each casts
    if kind == $kindu {
        return is_$name_decided(hit);
    }
#end
    return false;
}

// Tests the triangles that threads came to.
#if together
// While few have any, these wait, and others visit nodes (Ylitie, Karras and Laine 2017).
#endif
fn test_triangles(walk: ptr<function, Walk>, kind: u32, live: bool) {
    loop {
        let wants = live && (*walk).leaves.y != 0u;
        let wanting = lane_count(subgroupBallot(wants));
#if together
        let living = lane_count(subgroupBallot(live));
        if wanting == 0u || (wanting < living && wanting * 100u < living * TRIANGLE_PERCENT) {
            break;
        }
#else
        if wanting == 0u {
            break;
        }
#endif
        if wants {
            visit_triangle(walk);
            if is_decided(kind, (*walk).hit) {
                (*walk).leaves.y = 0u;
            }
        }
    }
}
