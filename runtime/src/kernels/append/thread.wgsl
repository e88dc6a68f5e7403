// Appends a thread's requests by itself: an atomic operation a request, in whatever order threads
// come. The baseline of Laine et al. 2013, section 4.4.

fn append(queue: u32, wanted: bool, slot: u32) {
    if wanted {
        put(queue, atomicAdd(&counters[COUNTER_PUSHED + COUNTER_PUSHED_STRIDE * queue], 1u), slot);
    }
}
