// A ray-cast kernel of the wavefront whose threads stay until their queue is used up: Aila and Laine,
// "Understanding the Efficiency of Ray Traversal on GPUs" (2009). Rays differ in length; when
// many threads of a subgroup have finished theirs, these take the next ones of the queue.

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(
    @builtin(subgroup_invocation_id) lane_of_subgroup: u32, @builtin(local_invocation_index) lane: u32
) {
    subgroup_lane = lane_of_subgroup;
#if walk_lane
    walk_lane = lane;
#endif
    let items = atomicLoad(&counters[COUNTER_TAKEN + CONSUMED_QUEUE]);
    let lanes = lane_count(subgroupBallot(true));
    var walk: Walk;
    var slot = 0u;
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
#if slots
                slot = queues[CONSUMED_REGION * POOL_SIZE + item];
#else
                slot = item;
#endif
                walk = begin_ray(slot);
                live = true;
            }
        } else if idle_lanes == lanes {
            break;
        }
        if live && walk.leaves.y == 0u {
            visit_node(&walk);
        }
        test_triangles(&walk, live);
        if live && walk.leaves.y == 0u && (is_decided(walk.hit) || !take_next(&walk)) {
            end_ray(slot, walk.hit);
            live = false;
        }
    }
}

// Tests the triangles that threads came to.
#if together
// While few have any, these wait, and others visit nodes (Ylitie, Karras and Laine 2017).
#endif
fn test_triangles(walk: ptr<function, Walk>, live: bool) {
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
            if is_decided((*walk).hit) {
                (*walk).leaves.y = 0u;
            }
        }
    }
}
