// Between counting and writing: where each bin begins. A workgroup adds up the bins of a block, and
// takes as many places as they need from those that are left; so blocks lie in any order, and
// the bins of one side by side. Counts are left at zero for the next time.

const SCAN_THREADS: u32 = 128u;

var<workgroup> sums: array<u32, SCAN_THREADS>;
var<workgroup> block_begin: u32;

@compute @workgroup_size(SCAN_THREADS)
fn main(@builtin(workgroup_id) block: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let first = 4u * (block.x * SCAN_THREADS + lane);
    var counts = array<u32, 4>();
    for (var k = 0u; k < 4u; k++) {
        counts[k] = atomicExchange(&bins[first + k], 0u);
    }
    let sum = counts[0] + counts[1] + counts[2] + counts[3];
    sums[lane] = sum;
    // Sums over the threads before: Hillis and Steele 1986.
    var through = sum;
    for (var distance = 1u; distance < SCAN_THREADS; distance *= 2u) {
        workgroupBarrier();
        var more = 0u;
        if lane >= distance {
            more = sums[lane - distance];
        }
        workgroupBarrier();
        through += more;
        sums[lane] = through;
    }
    if lane == SCAN_THREADS - 1u {
        block_begin = atomicAdd(&bins[2u * BINS], through);
    }
    workgroupBarrier();
    var begin = block_begin + through - sum;
    for (var k = 0u; k < 4u; k++) {
        atomicStore(&bins[BINS + first + k], begin);
        begin += counts[k];
    }
}
