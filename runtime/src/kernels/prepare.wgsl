// Between stages: turns the lengths of the queues that come next into indirect arguments,
// empties them for the next iteration, and hands out work for new paths.

@compute @workgroup_size(PREPARE_SIZE)
fn main(@builtin(local_invocation_index) lane: u32) {
#if queues
    for (var queue = FIRST_CONSUMED + lane; queue < END_CONSUMED; queue += PREPARE_SIZE) {
        consume(queue);
    }
#endif
#if work
    if lane == 0u {
        hand_out_work();
#if regenerates
        atomicStore(&counters[COUNTER_FETCHED], 0u);
#endif
    }
#endif
}

#if queues
fn consume(queue: u32) {
    let pushed = atomicExchange(&counters[COUNTER_PUSHED + COUNTER_PUSHED_STRIDE * queue], 0u);
    let items = min(pushed, POOL_SIZE);
    atomicStore(&counters[COUNTER_TAKEN + queue], items);
    if pushed > items {
        atomicAdd(&counters[COUNTER_OVERFLOW], pushed - items);
    }
    let before = atomicAdd(&counters[COUNTER_ITEMS + 2u * queue], items);
    if before > 0xffffffffu - items {
        atomicAdd(&counters[COUNTER_ITEMS + 2u * queue + 1u], 1u);
    }
#if fetched
    atomicStore(&counters[COUNTER_FETCHED_OF + COUNTER_PUSHED_STRIDE * queue], 0u);
#endif
    // Rows of groups, since a dimension has a limit.
    let groups = (items + WORKGROUP_SIZE - 1u) / WORKGROUP_SIZE;
    arguments[3u * queue] = min(groups, ROW_GROUPS);
    arguments[3u * queue + 1u] = (groups + ROW_GROUPS - 1u) / ROW_GROUPS;
    arguments[3u * queue + 2u] = 1u;
}
#endif

#if work
// Moves the start of unclaimed work past what the slots asking for it will take. Counters
// stop at the end, so that asking again and again cannot wrap them.
fn hand_out_work() {
#if queues
    let asking = atomicLoad(&counters[COUNTER_TAKEN + QUEUE_NEW_PATH]);
#else
    let asking = POOL_SIZE;
#endif
    let pixel = atomicLoad(&counters[COUNTER_NEXT_PIXEL]);
    let sample = atomicLoad(&counters[COUNTER_NEXT_SAMPLE]);
    atomicStore(&counters[COUNTER_WORK_PIXEL], pixel);
    atomicStore(&counters[COUNTER_WORK_SAMPLE], sample);
    let left = run.samples - sample;
    let place = pixel + asking;
    if place / PIXELS >= left {
        atomicStore(&counters[COUNTER_NEXT_PIXEL], 0u);
        atomicStore(&counters[COUNTER_NEXT_SAMPLE], run.samples);
        atomicAdd(&counters[COUNTER_RETIRED], asking - claimed(left, pixel, asking));
    } else {
        atomicStore(&counters[COUNTER_NEXT_PIXEL], place % PIXELS);
        atomicStore(&counters[COUNTER_NEXT_SAMPLE], sample + place / PIXELS);
    }
}

// How many of those asking still get work, when `left` samples of a pixel are left and the
// first of them begins at `pixel`.
fn claimed(left: u32, pixel: u32, asking: u32) -> u32 {
    if left == 0u {
        return 0u;
    }
    return min(asking, left * PIXELS - pixel);
}
#endif
