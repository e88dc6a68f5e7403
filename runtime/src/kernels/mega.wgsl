// The megakernel: the stages of the wavefront in a loop, with state in registers. A thread
// takes one path from its camera to its end, which MAX_DEPTH bounds.

var<private> wanted_instance: u32 = NOTHING;
var<private> wants_extension: bool = false;

// The loop ends instead: what the path gathered is in the film.
fn request_new_path() {}

fn request_material(instance: u32) {
    wanted_instance = instance;
}

fn request_extension() {
    wants_extension = true;
}

#if shadow_rays
var<private> wants_shadow: bool = false;

fn request_shadow() {
    wants_shadow = true;
}
#endif

@compute @workgroup_size(WORKGROUP_SIZE)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let item = (group.y * ROW_GROUPS + group.x) * WORKGROUP_SIZE + lane;
    if item >= POOL_SIZE {
        return;
    }
    new_path(item, item);
    // Each segment takes a turn, and one more ends a path whose scattering failed.
    for (var turn = 0u; turn <= MAX_DEPTH + 1u; turn++) {
#if shadow_rays
        if wants_shadow {
            wants_shadow = false;
            shadow(item);
        }
#endif
        if wants_extension {
            wants_extension = false;
            extension(item);
        }
        wanted_instance = NOTHING;
        logic(item);
        if wanted_instance == NOTHING {
            return;
        }
        material(item, wanted_instance);
    }
}
