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
    let item = (group.y * ROW_GROUPS + group.x) * WORKGROUP_SIZE + lane;
    var slot = item;
#if queued
    let in_range = item < atomicLoad(&counters[COUNTER_TAKEN + CONSUMED_QUEUE]);
#if slots
    if in_range {
        slot = queues[CONSUMED_REGION * POOL_SIZE + item];
    }
#endif
#else
    let in_range = item < POOL_SIZE;
#endif
    if in_range {
        run_stage(slot, item);
    }
#if pushes
    push_requests(lane, slot);
#endif
#if keeps
    if is_ray_wanted() {
        keep_requests(slot, extension_place, shadow_place);
    }
#endif
}
