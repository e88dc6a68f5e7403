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

#if requests
var<private> extension_ray: array<vec4<u32>, 2>;
#endif

fn request_extension(origin: vec3<f32>, direction: vec3<f32>, skip: u32) {
    wants_extension = true;
#if requests
    extension_ray[0] = vec4<u32>(bitcast<vec3<u32>>(origin), skip);
    extension_ray[1] = vec4<u32>(bitcast<vec3<u32>>(direction), 0u);
#endif
}
#endif
#if casts_shadows
var<private> wants_shadow: bool = false;

#if requests
var<private> shadow_ray: array<vec4<u32>, 2>;
#endif

fn request_shadow(origin: vec3<f32>, skip: u32, direction: vec3<f32>, distance: f32) {
    wants_shadow = true;
#if requests
    shadow_ray[0] = vec4<u32>(bitcast<vec3<u32>>(origin), skip);
    shadow_ray[1] = vec4<u32>(bitcast<vec3<u32>>(direction), bitcast<u32>(distance));
#endif
}
#endif

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
#if keeps
    if queue == QUEUE_EXTENSION {
        extension_rays[2u * place] = extension_ray[0];
        extension_rays[2u * place + 1u] = extension_ray[1];
        extension_place = place;
        return;
    }
#endif
#if keeps_shadows
    if queue == QUEUE_SHADOW {
        shadow_rays[2u * place] = shadow_ray[0];
        shadow_rays[2u * place + 1u] = shadow_ray[1];
        shadow_place = place;
        return;
    }
#endif
    queues[queue * POOL_SIZE + place] = slot;
}
#if keeps

// The places of the thread's rays.
var<private> extension_place: u32 = 0u;
var<private> shadow_place: u32 = 0u;

fn is_ray_wanted() -> bool {
#if casts_shadows
    return wants_extension || wants_shadow;
#else
    return wants_extension;
#endif
}
#endif
