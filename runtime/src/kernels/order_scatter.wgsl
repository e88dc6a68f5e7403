// Writes a queue again in the order of its rays' bins; see order.wgsl.

fn run_stage(slot: u32, item: u32) {
    let begin = atomicLoad(&bins[BINS + queues[REGION_BINS * POOL_SIZE + item]]);
    let place = begin + queues[REGION_RANKS * POOL_SIZE + item];
    queues[REGION_ORDERED * POOL_SIZE + place] = slot;
    if item == 0u {
        // All places are left again the next time.
        atomicStore(&bins[2u * BINS], 0u);
    }
}
