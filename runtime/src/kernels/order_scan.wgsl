// Between counting and writing: where each bin begins, which is how many rays are in those before
// it. Counts are left at zero for the next time.

const SCAN_THREADS: u32 = 128u;
const BINS_A_THREAD: u32 = BINS / SCAN_THREADS;

var<workgroup> sums: array<u32, SCAN_THREADS>;

@compute @workgroup_size(SCAN_THREADS)
fn main(@builtin(local_invocation_index) lane: u32) {
    let first = lane * BINS_A_THREAD;
    var sum = 0u;
    for (var bin = first; bin < first + BINS_A_THREAD; bin++) {
        sum += atomicLoad(&bins[bin]);
    }
    sums[lane] = sum;
    // Sums over the threads before: Hillis and Steele 1986.
    var before = sum;
    for (var distance = 1u; distance < SCAN_THREADS; distance *= 2u) {
        workgroupBarrier();
        var more = 0u;
        if lane >= distance {
            more = sums[lane - distance];
        }
        workgroupBarrier();
        before += more;
        sums[lane] = before;
    }
    var begin = before - sum;
    for (var bin = first; bin < first + BINS_A_THREAD; bin++) {
        atomicStore(&bins[BINS + bin], begin);
        begin += atomicExchange(&bins[bin], 0u);
    }
}
