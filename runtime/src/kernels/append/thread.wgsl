// Appends a thread's requests by itself: an atomic operation a request, in whatever order threads
// come. The baseline of Laine et al. 2013, section 4.4.

// Appends the slot to every queue that its stage asked for.
fn push_requests(lane: u32, slot: u32) {
#if sorts
    append(wanted_work, wanted_work != NOTHING, slot);
#endif
#if casts
    append(QUEUE_EXTENSION, wants_extension, slot);
#endif
#if casts_shadows
    append(QUEUE_SHADOW, wants_shadow, slot);
#endif
}

fn append(queue: u32, wanted: bool, slot: u32) {
    if wanted {
        put(queue, atomicAdd(&counters[COUNTER_PUSHED + COUNTER_PUSHED_STRIDE * queue], 1u), slot);
    }
}
