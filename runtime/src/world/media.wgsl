// The media that a path is in: a stack of four words, the one entered last first, 0 beyond.
//
// A word is the rank of the medium's priority in the high half and its row of medium_table
// (absorption, index of refraction) in the low half. Where several overlap, the one with the
// highest priority counts: Schmidt and Budge, "Simple Nested Dielectrics in Ray Traced Images" (2002).

// The medium that counts; of equals the one entered last.
fn active_medium(stack: vec4<u32>) -> u32 {
    let near = select(stack.x, stack.y, (stack.y >> 16u) > (stack.x >> 16u));
    let far = select(stack.z, stack.w, (stack.w >> 16u) > (stack.z >> 16u));
    return select(near, far, (far >> 16u) > (near >> 16u));
}

// The stack without the medium's last entry; as it is if the path never entered it.
fn without_medium(stack: vec4<u32>, medium: u32) -> vec4<u32> {
    if stack.x == medium {
        return vec4<u32>(stack.yzw, 0u);
    }
    if stack.y == medium {
        return vec4<u32>(stack.x, stack.zw, 0u);
    }
    if stack.z == medium {
        return vec4<u32>(stack.xy, stack.w, 0u);
    }
    return vec4<u32>(stack.xyz, select(stack.w, 0u, stack.w == medium));
}

// The media outside of a boundary of `medium`, for a path in `stack` that is inside of it or not.
fn media_outside(stack: vec4<u32>, medium: u32, inside: bool) -> vec4<u32> {
    if inside {
        return without_medium(stack, medium);
    }
    return stack;
}

// The stack on the other side of the boundary. A fifth medium finds no room and is left out.
fn media_beyond(stack: vec4<u32>, medium: u32, inside: bool) -> vec4<u32> {
    if inside {
        return without_medium(stack, medium);
    }
    let entered = vec4<u32>(medium, stack.xyz);
    return select(entered, stack, medium == 0u || stack.w != 0u);
}

// The same, for a path that goes there: what finds no room is counted.
fn cross_boundary(stack: vec4<u32>, medium: u32, inside: bool) -> vec4<u32> {
    if !inside && medium != 0u && stack.w != 0u {
        atomicAdd(&counters[COUNTER_MEDIA_OVERFLOW], 1u);
    }
    return media_beyond(stack, medium, inside);
}

// Index of refraction outside of a surface that bounds `medium`, or that bounds none.
fn exterior_index(stack: vec4<u32>, medium: u32, inside: bool) -> f32 {
    return medium_table[active_medium(media_outside(stack, medium, inside)) & 0xffffu].w;
}

// Is the boundary within a medium that counts more on both of its sides? Then there is none.
fn is_false_boundary(stack: vec4<u32>, medium: u32, inside: bool) -> bool {
    let other = active_medium(media_outside(stack, medium, inside));
    return medium != 0u && (other >> 16u) > (medium >> 16u);
}

// What is left of light over a distance in the medium that counts: Beer and Lambert.
fn transmittance(stack: vec4<u32>, distance: f32) -> vec3<f32> {
    let absorption = medium_table[active_medium(stack) & 0xffffu].xyz;
    return exp(-absorption * min(distance, 1e18));
}
