// Random numbers as a pure function of pixel, sample, draw and seed, so that neither the slot
// nor the order of execution can change a path. A sampler (kernels/random/) gives `random_bits`.

// Four well-mixed words of four. Source: Jarzynski and Olano, "Hash Functions for GPU
// Rendering", JCGT 9(3), 2020.
fn pcg4d(input: vec4<u32>) -> vec4<u32> {
    var v = input * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> vec4<u32>(16u);
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// Random bits as uniform numbers in [0, 1): 24 bits each, so that 1 cannot appear by rounding.
fn unit_numbers(bits: vec4<u32>) -> vec4<f32> {
    return vec4<f32>(bits >> vec4<u32>(8u)) * 0x1p-24;
}

// The four numbers of a draw. Of those y and z are the most evenly distributed pair.
fn random_numbers(pixel: u32, sample: u32, draw: u32) -> vec4<f32> {
    return unit_numbers(random_bits(pixel, sample, draw));
}

// The draw for one purpose at a path's vertex, counted from 1.
fn vertex_draw(vertex: u32, purpose: u32) -> u32 {
    return DRAWS_PER_PATH + (vertex - 1u) * DRAWS_PER_VERTEX + purpose;
}
