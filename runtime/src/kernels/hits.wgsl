// Counts what the slots of a workgroup hit, for the time model of plans: hits of each material, and
// blocks of neighbouring slots with any.

// Of each material its hits in the low half, and in the high half the blocks with any.
var<workgroup> group_hits: array<atomic<u32>, MATERIALS>;
// For each block a bit a material.
var<workgroup> block_hits: array<atomic<u32>, BLOCK_WORDS * (WORKGROUP_SIZE / BLOCK)>;

// Whether a workgroup counts, by its index.
fn group_counts(group: u32) -> bool {
    return group * GOLDEN <= MOST_COUNTING;
}

// All threads of a workgroup that counts call it.
fn count_hits(lane: u32) {
    if wanted_instance != NOTHING {
        let material = material_of(wanted_instance);
        let bit = 1u << (material % 32u);
        let met = atomicOr(&block_hits[BLOCK_WORDS * (lane / BLOCK) + material / 32u], bit);
        atomicAdd(&group_hits[material], select(0x10001u, 1u, (met & bit) != 0u));
    }
    workgroupBarrier();
    for (var material = lane; material < MATERIALS; material += WORKGROUP_SIZE) {
        let found = atomicLoad(&group_hits[material]);
        if found != 0u {
            let counter = COUNTER_HITS + COUNTER_HITS_STRIDE * material;
            add_long(counter, found & 0xffffu);
            add_long(counter + 2u, found >> 16u);
        }
    }
}

// Adds to a counter of two words, the low one first.
fn add_long(counter: u32, count: u32) {
    let before = atomicAdd(&counters[counter], count);
    if before > 0xffffffffu - count {
        atomicAdd(&counters[counter + 1u], 1u);
    }
}
