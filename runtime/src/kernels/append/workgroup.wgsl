// Appends a workgroup's requests: one atomic operation a queue reserves the places of all of its
// threads, so that neighbours stay neighbours (Laine et al. 2013, section 4.4, with a workgroup in
// the place of a warp).

// Of the queues that this kernel pushes to: how many places the workgroup needs, and where
// those begin.
var<workgroup> group_count: array<atomic<u32>, PUSHED_QUEUES>;
var<workgroup> group_base: array<u32, PUSHED_QUEUES>;

// Appends the slot to every queue that its stage asked for. All threads of a workgroup call it.
fn push_requests(lane: u32, slot: u32) {
#each wishes
    let $name_rank = reserve($queue, $wanted);
#end
    workgroupBarrier();
    for (var index = lane; index < PUSHED_QUEUES; index += WORKGROUP_SIZE) {
        let count = atomicLoad(&group_count[index]);
        if count > 0u {
            let counter = COUNTER_PUSHED + COUNTER_PUSHED_STRIDE * (FIRST_PUSHED + index);
            group_base[index] = atomicAdd(&counters[counter], count);
        }
    }
    workgroupBarrier();
#each wishes
    push($queue, $wanted, $name_rank, slot);
#end
}

fn reserve(queue: u32, wanted: bool) -> u32 {
    if !wanted {
        return 0u;
    }
    return atomicAdd(&group_count[queue - FIRST_PUSHED], 1u);
}

fn push(queue: u32, wanted: bool, rank: u32, slot: u32) {
    if !wanted {
        return;
    }
    put(queue, group_base[queue - FIRST_PUSHED] + rank, slot);
}
