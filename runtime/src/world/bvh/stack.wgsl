// The stack of a walk: an array of the thread's own, or its first entries in workgroup memory,
// as Ylitie, Karras and Laine (2017) keep them. There a thread's entries lie a workgroup apart,
// so that threads that push together write neighbouring words.

#if shared
var<private> walk_lane: u32 = 0u; // the thread's index in its workgroup

var<workgroup> shared_stack: array<Group, STACK_SHARED * WORKGROUP_SIZE>;
#endif
#if own
var<private> own_stack: array<Group, BVH_STACK_SIZE - STACK_SHARED>;
#endif

fn store_stack(at: u32, group: Group) {
#if shared && own
    if at >= STACK_SHARED {
        own_stack[at - STACK_SHARED] = group;
        return;
    }
#endif
#if shared
    shared_stack[at * WORKGROUP_SIZE + walk_lane] = group;
#else
    own_stack[at] = group;
#endif
}

fn load_stack(at: u32) -> Group {
#if shared && own
    if at >= STACK_SHARED {
        return own_stack[at - STACK_SHARED];
    }
#endif
#if shared
    return shared_stack[at * WORKGROUP_SIZE + walk_lane];
#else
    return own_stack[at];
#endif
}
