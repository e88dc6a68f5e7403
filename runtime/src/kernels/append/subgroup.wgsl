// Appends a subgroup's requests: one atomic operation a queue that some of its threads want
// reserves the places of all that want it (Laine et al. 2013, section 4.4).

fn append(queue: u32, wanted: bool, slot: u32) {
    var pending = wanted;
    // A turn a queue: that of the first thread that still waits, for all that want the same.
    loop {
        let waiting = subgroupBallot(pending);
        if all(waiting == vec4<u32>(0u)) {
            break;
        }
        let leader = first_lane(waiting);
        let chosen = pending && queue == subgroupShuffle(queue, leader);
        let members = subgroupBallot(chosen);
        var base = 0u;
        if subgroup_lane == leader {
            base = atomicAdd(&counters[COUNTER_PUSHED + COUNTER_PUSHED_STRIDE * queue], lane_count(members));
        }
        base = subgroupShuffle(base, leader);
        if chosen {
            put(queue, base + lanes_before(members, subgroup_lane), slot);
            pending = false;
        }
    }
}
