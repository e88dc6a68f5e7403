// Between stages: turns the lengths of the queues that come next into indirect arguments,
// empties them for the next iteration, and hands out work for new paths.

@compute @workgroup_size(PREPARE_SIZE)
fn main(@builtin(local_invocation_index) lane: u32) {
#if queues && binned
    place_groups(lane);
#endif
#if queues && !binned
    for (var queue = FIRST_CONSUMED + lane; queue < END_CONSUMED; queue += PREPARE_SIZE) {
        dispatch(queue, consume(queue));
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
// Empties a queue; how many workgroups work on what was in it.
fn consume(queue: u32) -> u32 {
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
    let threads = threads_on(queue);
    return (items + threads - 1u) / threads;
}

// Writes the arguments of the kernel whose first queue it is: rows of groups, since a dimension
// has a limit.
fn dispatch(queue: u32, groups: u32) {
    arguments[3u * queue] = min(groups, ROW_GROUPS);
    arguments[3u * queue + 1u] = (groups + ROW_GROUPS - 1u) / ROW_GROUPS;
    arguments[3u * queue + 2u] = 1u;
}
#endif
#if binned

// Workgroups of the same kernel that come no later than a lane's, of the queues at hand.
var<workgroup> sums: array<u32, PREPARE_SIZE>;

// Gives each queue its place among the workgroups of its kernel: sums of groups over the queues of
// a kernel, as many queues at a time as there are threads (Hillis and Steele 1986).
fn place_groups(lane: u32) {
    var carried = 0u;
    for (var tile = FIRST_CONSUMED; tile < END_CONSUMED; tile += PREPARE_SIZE) {
        let queue = tile + lane;
        let first = first_of_kernel(queue);
        var groups = 0u;
        if queue < END_CONSUMED {
            groups = consume(queue);
        }
        // The kernel may have begun in the tile before.
        var end = groups + select(0u, carried, lane == 0u && queue > first);
        // Queues of this tile that the kernel has before this one.
        let before = min(queue - first, lane);
        for (var step = 1u; step < PREPARE_SIZE; step *= 2u) {
            sums[lane] = end;
            workgroupBarrier();
            if step <= before {
                end += sums[lane - step];
            }
            workgroupBarrier();
        }
        sums[lane] = end;
        workgroupBarrier();
        carried = sums[PREPARE_SIZE - 1u];
        workgroupBarrier();
        if queue < END_CONSUMED {
            atomicStore(&counters[COUNTER_FIRST_GROUP + queue], end - groups);
            if first_of_kernel(queue + 1u) != first {
                dispatch(first, end);
            }
        }
    }
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
#if some_pixels
    let pixels = run.pixels;
#else
    let pixels = PIXELS;
#endif
    let left = run.samples - sample;
    let place = pixel + asking;
    if place / pixels >= left {
        atomicStore(&counters[COUNTER_NEXT_PIXEL], 0u);
        atomicStore(&counters[COUNTER_NEXT_SAMPLE], run.samples);
        atomicAdd(&counters[COUNTER_RETIRED], asking - claimed(left, pixel, pixels, asking));
    } else {
        atomicStore(&counters[COUNTER_NEXT_PIXEL], place % pixels);
        atomicStore(&counters[COUNTER_NEXT_SAMPLE], sample + place / pixels);
    }
}

// How many of those asking still get work, when `left` samples of each of `pixels` are left and the
// first of them begins at `pixel`.
fn claimed(left: u32, pixel: u32, pixels: u32, asking: u32) -> u32 {
    if left == 0u {
        return 0u;
    }
    return min(asking, left * pixels - pixel);
}
#endif
