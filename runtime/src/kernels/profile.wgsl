
// Counts the lanes that come here, and those of the subgroup they are part of, once a statement.
fn tally(statements: u32) {
    let lanes = subgroupAdd(1u);
    if subgroupExclusiveAdd(1u) == 0u {
        count_long(COUNTER_LANES, statements * lanes);
        count_long(COUNTER_LANES + 2u, statements * SUBGROUP_SIZE);
    }
}

// Adds to a counter of two words, the low one first.
fn count_long(counter: u32, value: u32) {
    let before = atomicAdd(&counters[counter], value);
    if before > 0xffffffffu - value {
        atomicAdd(&counters[counter + 1u], 1u);
    }
}
