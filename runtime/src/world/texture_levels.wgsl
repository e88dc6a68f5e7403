// The levels of textures in texture_data, for lookups that wrap, filter or average in special ways. A level
// is a pair of words as at the start of the buffer; those of smaller levels lie before the first texel.

fn texture_level(slot: u32, level: u32) -> vec2<u32> {
    let picture = texture_data[slot];
    if level == 0u {
        return picture;
    }
    return texture_data[picture.x - level];
}

fn texture_last_level(slot: u32) -> u32 {
    let size = texture_data[slot].y;
    return firstLeadingBit(max(size & 0xffffu, size >> 16u));
}

fn texture_level_size(level: vec2<u32>) -> vec2<i32> {
    return vec2<i32>(vec2<u32>(level.y & 0xffffu, level.y >> 16u));
}

fn texture_level_texel(level: vec2<u32>, p: vec2<i32>) -> vec4<f32> {
    return texel(level.x, level.y & 0xffffu, vec2<u32>(p));
}

