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

// Writes the slot to its place in a queue.
fn put(queue: u32, place: u32, slot: u32) {
    // A slot is in a queue at most once, so this holds; if it ever did not, the prepare
    // kernel would count the surplus.
    if place < POOL_SIZE {
        queues[queue * POOL_SIZE + place] = slot;
    }
}
