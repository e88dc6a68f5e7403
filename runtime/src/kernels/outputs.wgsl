// Outputs of the film beside the picture: planes of their own, after those of the picture. What is recorded where
// is generated from the table of outputs.
//
// Sums are exact as those of radiance are, and in two's complement, since positions and normals have signs.

// Adds the first numbers of a value, cut to lie between two limits.
fn film_add_values(plane: u32, pixel: u32, value: vec3<f32>, count: u32, low: f32, high: f32) {
    if !is_finite(value) {
        atomicAdd(&counters[COUNTER_FILM_CLAMPED], 1u);
        return;
    }
    let cut = clamp(value, vec3<f32>(low), vec3<f32>(high));
    for (var i = 0u; i < count; i++) {
        film_add_signed((plane + 3u * i) * PIXELS + pixel, cut[i]);
    }
}

// Adds to the sum whose lowest word is `word`. The value's magnitude is split exactly at 2^32 units, which is 256.
fn film_add_signed(word: u32, value: f32) {
    let size = abs(value);
    let multiples = floor(size * 0x1p-8);
    var low = u32(round((size - multiples * 0x1p8) * 0x1p24));
    var middle = u32(multiples);
    var high = 0u;
    if (low | middle) == 0u {
        return;
    }
    if value < 0.0 {
        // The complement, plus 1 in the lowest word, which carries if that was 0.
        middle = select(~middle, 0u - middle, low == 0u);
        low = 0u - low;
        high = 0xffffffffu;
    }
    let carry = add_carrying(word, low);
    // What the middle word takes may itself wrap.
    let sum = middle + carry;
    high += select(0u, 1u, sum < carry) + add_carrying(word + PIXELS, sum);
    if high != 0u {
        atomicAdd(&film[word + 2u * PIXELS], high);
    }
}

// Adds to a word; what it carries to the next.
fn add_carrying(word: u32, value: u32) -> u32 {
    if value == 0u {
        return 0u;
    }
    let before = atomicAdd(&film[word], value);
    return select(0u, 1u, before > 0xffffffffu - value);
}

// Keeps the smallest distance: its complement is the largest, so that 0 says that there is none.
fn film_add_nearest(plane: u32, pixel: u32, distance: f32) {
    atomicMax(&film[plane * PIXELS + pixel], ~bitcast<u32>(max(distance, 1e-37)));
}

// Counts an id in one of the slots of its pixel; 0 is no id. What finds no slot is counted after them.
fn film_add_id(plane: u32, pixel: u32, id: u32) {
    if id == 0u {
        return;
    }
    for (var slot = 0u; slot < ID_SLOTS; slot++) {
        let at = (plane + 2u * slot) * PIXELS + pixel;
        var found = atomicLoad(&film[at]);
        // An exchange may fail without a reason.
        while found == 0u {
            let tried = atomicCompareExchangeWeak(&film[at], 0u, id);
            found = select(tried.old_value, id, tried.exchanged);
        }
        if found == id {
            atomicAdd(&film[at + PIXELS], 1u);
            return;
        }
    }
    atomicAdd(&film[(plane + 2u * ID_SLOTS) * PIXELS + pixel], 1u);
}

// The sign that turns a normal to the side that a ray comes from.
fn facing(geometric: vec3<f32>, way: vec3<f32>) -> f32 {
    return select(-1.0, 1.0, dot(geometric, way) < 0.0);
}
