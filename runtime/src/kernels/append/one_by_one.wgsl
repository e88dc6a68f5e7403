// Appends the slot to every queue that its stage asked for, one queue after another.
#if subgroups
// All threads of a subgroup call it.
#endif
fn push_requests(lane: u32, slot: u32) {
#if subgroups
    // Stages diverge; here the threads come together again.
    subgroupBarrier();
#endif
#each wishes
    append($queue, $wanted, slot);
#end
}

