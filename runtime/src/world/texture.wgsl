// Texture lookups in texture_data, pairs of words: first one pair a texture (index of its first
// texel; width and height in 16 bits each), then texels, top row first, as four half floats.

// Linear values at `uv`, bilinear and wrapping; v points up, texel centres are at half-integers.
fn texture_fetch(slot: u32, uv: vec2<f32>) -> vec4<f32> {
    let info = texture_data[slot];
#if tiles
    if info.y == 0u {
        return texture_fetch_as(slot, uv, 0);
    }
#endif
    let size = vec2<u32>(info.y & 0xffffu, info.y >> 16u);
    let wrapped = vec2<f32>(fract(uv.x), 1.0 - fract(uv.y));
    let p = wrapped * vec2<f32>(size) - 0.5;
    let cell = floor(p);
    let weight = p - cell;
    // cell is at least -1 and less than size: one turn of wrapping is enough.
    let low = wrap_texel(vec2<i32>(cell), vec2<i32>(size));
    let high = wrap_texel(vec2<i32>(cell) + 1, vec2<i32>(size));
    let top = mix(texel(info.x, size.x, low), texel(info.x, size.x, vec2<u32>(high.x, low.y)), weight.x);
    let bottom = mix(texel(info.x, size.x, vec2<u32>(low.x, high.y)), texel(info.x, size.x, high), weight.x);
    return mix(top, bottom, weight.y);
}

#if tiles
// Is the texture in a slot a table of tiles?
fn texture_is_tiled(slot: u32) -> bool {
    return texture_data[slot].y == 0u;
}

// The slot of the tile at `uv`, or NO_TILE.
fn texture_tile(slot: u32, uv: vec2<f32>) -> u32 {
    let table = texture_data[slot].x;
    let place = floor(uv);
    let rows = f32(texture_data[table].x);
    if !(place.x >= 0.0 && place.x < 10.0 && place.y >= 0.0 && place.y < rows) {
        return NO_TILE;
    }
    return texture_data[table + 1u + u32(place.x) + 10u * u32(place.y)].x;
}

#endif
fn wrap_texel(p: vec2<i32>, size: vec2<i32>) -> vec2<u32> {
    let below = select(p, p + size, p < vec2<i32>(0));
    return vec2<u32>(select(below, below - size, below >= size));
}

fn texel(first: u32, width: u32, p: vec2<u32>) -> vec4<f32> {
    let packed = texture_data[first + p.y * width + p.x];
    return vec4<f32>(unpack2x16float(packed.x), unpack2x16float(packed.y));
}
