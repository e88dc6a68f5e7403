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
