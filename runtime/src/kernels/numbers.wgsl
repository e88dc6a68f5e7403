// Tests on bits, since compilers may assume that floats are never NaN or infinite.

fn is_finite(v: vec3<f32>) -> bool {
    return all((bitcast<vec3<u32>>(v) & vec3<u32>(0x7f800000u)) != vec3<u32>(0x7f800000u));
}

// Finite, and not below zero (-0 is not).
fn is_light(v: vec3<f32>) -> bool {
    let bits = bitcast<vec3<u32>>(v);
    return all((bits < vec3<u32>(0x7f800000u)) | (bits == vec3<u32>(0x80000000u)));
}

fn max_component(v: vec3<f32>) -> f32 {
    return max(v.x, max(v.y, v.z));
}

// Counts a sample that is left out, and keeps the first of a row as an example: its pixel, sample
// and vertex, and which value was wrong.
fn count_dropped(row: u32, negative: bool, value: u32, place: vec3<u32>) {
    let at = COUNTER_DROPPED + DROPPED_WORDS * row;
    atomicAdd(&counters[at + select(DROPPED_NONFINITE, DROPPED_NEGATIVE, negative)], 1u);
    if atomicMax(&counters[at + DROPPED_CLAIMED], 1u) == 0u {
        atomicStore(&counters[at + DROPPED_VALUE], value);
        atomicStore(&counters[at + DROPPED_PIXEL], place.x);
        atomicStore(&counters[at + DROPPED_SAMPLE], place.y);
        atomicStore(&counters[at + DROPPED_VERTEX], place.z);
    }
}
