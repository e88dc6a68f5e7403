// Requests of the wavefront: a stage notes what it wants of its slot, and the kernel around it
// appends the slot to queues. One atomic operation a workgroup and queue reserves the places,
// so that neighbours stay neighbours (Laine et al. 2013, section 4.4).

#if sorts
var<private> wanted_work: u32 = NOTHING;
var<private> wanted_instance: u32 = NOTHING;

fn request_new_path() {
    wanted_work = QUEUE_NEW_PATH;
}

fn request_material(instance: u32) {
    wanted_instance = instance;
    wanted_work = material_queue(instance);
}
#endif
#if casts
var<private> wants_extension: bool = false;

fn request_extension() {
    wants_extension = true;
}
#endif
#if casts_shadows
var<private> wants_shadow: bool = false;

fn request_shadow() {
    wants_shadow = true;
}
#endif

// Of the queues that this kernel pushes to: how many places the workgroup needs, and where
// those begin.
var<workgroup> group_count: array<atomic<u32>, PUSHED_QUEUES>;
var<workgroup> group_base: array<u32, PUSHED_QUEUES>;

// Appends the slot to every queue that its stage asked for. All threads of a workgroup call it.
fn push_requests(lane: u32, slot: u32) {
#if sorts
    let work_rank = reserve(wanted_work, wanted_work != NOTHING);
#endif
#if casts
    let extension_rank = reserve(QUEUE_EXTENSION, wants_extension);
#endif
#if casts_shadows
    let shadow_rank = reserve(QUEUE_SHADOW, wants_shadow);
#endif
    workgroupBarrier();
    for (var index = lane; index < PUSHED_QUEUES; index += WORKGROUP_SIZE) {
        let count = atomicLoad(&group_count[index]);
        if count > 0u {
            let counter = COUNTER_PUSHED + FIRST_PUSHED + index;
            group_base[index] = atomicAdd(&counters[counter], count);
        }
    }
    workgroupBarrier();
#if sorts
    push(wanted_work, wanted_work != NOTHING, work_rank, slot);
#endif
#if casts
    push(QUEUE_EXTENSION, wants_extension, extension_rank, slot);
#endif
#if casts_shadows
    push(QUEUE_SHADOW, wants_shadow, shadow_rank, slot);
#endif
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
    let place = group_base[queue - FIRST_PUSHED] + rank;
    // A slot is in a queue at most once, so this holds; if it ever did not, the prepare
    // kernel would count the surplus.
    if place < POOL_SIZE {
        queues[queue * POOL_SIZE + place] = slot;
    }
}
