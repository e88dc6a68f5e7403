// Requests of the wavefront: a stage notes what it wants of its slot, and the kernel around it
// appends the slot to queues, in one of the ways of `append/`.

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
#each asked

$variable
$request
#end

// Writes the slot to its place in a queue.
#if requests
// Of rays it is the ray that is written, and the path keeps the place, where the result will be.
#endif
fn put(queue: u32, place: u32, slot: u32) {
    // A slot is in a queue at most once, so this does not happen; if it ever did, the prepare
    // kernel would count the surplus.
    if place >= POOL_SIZE {
        return;
    }
#each kept
    if queue == $queue {
        $name_rays[2u * place] = $name_ray[0];
        $name_rays[2u * place + 1u] = $name_ray[1];
        $name_place = place;
        return;
    }
#end
    queues[queue * POOL_SIZE + place] = slot;
}
#if keeps

// The places of the thread's rays.
#each rays
var<private> $name_place: u32 = 0u;
#end

fn is_ray_wanted() -> bool {
#each any_kept
    return $wanted;
#end
}
#endif
