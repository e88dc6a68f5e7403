// Puts the paths of a workgroup in the order of the queues that they go to, so that the threads of the next kernels, which
// follow these queues, find neighbours in neighbouring slots: a line of the cache that is read for one path holds
// those of others in the same queue (stream compaction within blocks: Hoberock, Lu, Jia and Hart, "Stream Compaction for
// Deferred Shading", 2009; Wald, "Active Thread Compaction for GPU Path Tracing", 2011).

// The queues that work is pushed to, and what goes to none.
const DESTINATIONS: u32 = PUSHED_QUEUES + 1u;

// For each of them how many paths of the workgroup go there, and the first of their slots.
var<workgroup> destination_count: array<atomic<u32>, DESTINATIONS>;
var<workgroup> destination_begin: array<u32, DESTINATIONS>;
var<workgroup> slots_given: atomic<u32>;

// The slot of the thread's path from now on; `first` is that of the workgroup's first thread. All threads of a
// workgroup call it, and all of them have taken up their paths when it returns.
fn settle(first: u32, lane: u32, has_path: bool) -> u32 {
    let destination = min(wanted_work - FIRST_PUSHED, PUSHED_QUEUES);
    var rank = 0u;
    if has_path {
        rank = atomicAdd(&destination_count[destination], 1u);
    }
    workgroupBarrier();
    for (var index = lane; index < DESTINATIONS; index += WORKGROUP_SIZE) {
        let count = atomicLoad(&destination_count[index]);
        if count > 0u {
            destination_begin[index] = atomicAdd(&slots_given, count);
        }
    }
    storageBarrier();
    workgroupBarrier();
    return first + destination_begin[destination] + rank;
}
