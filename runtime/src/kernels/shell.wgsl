// A kernel of the wavefront: one thread an item of its queue, or a slot of the pool.

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(
#if subgroups
    @builtin(subgroup_invocation_id) lane_of_subgroup: u32,
#endif
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) lane: u32
) {
#if subgroups
    subgroup_lane = lane_of_subgroup;
#endif
#if walk_lane
    walk_lane = lane;
#endif
#if clears
    // Where stacks are in workgroup memory, none of it begins as zeros.
#if joins
    for (var index = lane; index < PUSHED_QUEUES; index += WORKGROUP_SIZE) {
        atomicStore(&group_count[index], 0u);
    }
#endif
#if counts_hits
    for (var index = lane; index < MATERIALS; index += WORKGROUP_SIZE) {
        atomicStore(&group_hits[index], 0u);
    }
    for (var index = lane; index < BLOCK_WORDS * (WORKGROUP_SIZE / BLOCK); index += WORKGROUP_SIZE) {
        atomicStore(&block_hits[index], 0u);
    }
#endif
    workgroupBarrier();
#endif
    let index = group.y * ROW_GROUPS + group.x;
#if binned
    find_bin(index, lane);
    workgroupBarrier();
    let item = (index - bin.first_group) * WORKGROUP_SIZE + lane;
#else
    let item = index * WORKGROUP_SIZE + lane;
#endif
    var slot = item;
#if queued && binned
    let in_range = item < bin.items;
    let region = bin.queue;
#endif
#if queued && !binned
    let in_range = item < atomicLoad(&counters[COUNTER_TAKEN + CONSUMED_QUEUE]);
#endif
#if queued && !binned && slots
    let region = CONSUMED_REGION;
#endif
#if queued && slots
    if in_range {
        slot = queues[region * POOL_SIZE + item];
    }
#endif
#if !queued
    let in_range = item < POOL_SIZE;
#endif
    if in_range {
#if moves
        take_up(slot);
#endif
        run_stage(slot, item);
    }
#if counts_hits
    if group_counts(index) {
        count_hits(lane);
    }
#endif
#if moves
    slot = settle(index * WORKGROUP_SIZE, lane, in_range);
    // A new path brings a state of its own.
    if in_range && wanted_work != QUEUE_NEW_PATH {
        put_down(slot);
    }
#endif
#if begins
    if in_range {
        put_down(slot);
    }
#endif
#if pushes
    push_requests(lane, slot);
#endif
#if keeps
    if is_ray_wanted() {
        keep_requests(slot, $places);
    }
#endif
}
#if binned

// The queue that a workgroup works on. Without items, as it begins, where the last row of
// workgroups is longer than needed.
struct Bin { queue: u32, first_group: u32, items: u32 }

var<workgroup> bin: Bin;

// Finds the queue of the workgroup with some index: threads look at a queue each, and at most one
// finds that the workgroup is one of those that begin with the queue's first.
fn find_bin(index: u32, lane: u32) {
    for (var member = lane; member < CONSUMED_QUEUES; member += WORKGROUP_SIZE) {
        let queue = CONSUMED_QUEUE + member;
        let first_group = atomicLoad(&counters[COUNTER_FIRST_GROUP + queue]);
        let items = atomicLoad(&counters[COUNTER_TAKEN + queue]);
        // Of an earlier workgroup the difference wraps, and is beyond all items.
        if index - first_group < (items + WORKGROUP_SIZE - 1u) / WORKGROUP_SIZE {
            bin = Bin(queue, first_group, items);
        }
    }
}
#endif
