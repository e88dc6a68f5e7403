//! Lookups of textures that wrap, filter or average in other ways than `texture_fetch`.
//!
//! Their text stands here once for every target, over levels and texels that the target provides:
//!
//! ```wgsl
//! // A level of the texture in a slot; 0 is the picture itself.
//! fn texture_level(slot: u32, level: u32) -> vec2<u32>
//! // The level of one texel.
//! fn texture_last_level(slot: u32) -> u32
//! fn texture_level_size(level: vec2<u32>) -> vec2<i32>
//! // Columns from the left, rows from the top.
//! fn texture_level_texel(level: vec2<u32>, p: vec2<i32>) -> vec4<f32>
//! ```
//!
//! Only what some material asks for is written.

use crate::abi::Lookups;

/// Most taps along the longer side of a width.
const TAPS: u32 = 8;

/// `texture_fetch_as`, and `texture_fetch_wide` if some lookup averages over a width; nothing where
/// all lookups are plain. Where some texture is in `tiles`, the target provides
///
/// ```wgsl
/// fn texture_is_tiled(slot: u32) -> bool
/// // The slot of the tile at `uv`, or NO_TILE.
/// fn texture_tile(slot: u32, uv: vec2<f32>) -> u32
/// // The mode of a tile, but for its filter.
/// const CLAMPED_TILE: i32
/// ```
pub fn lookups(uses: Lookups, tiles: bool) -> String {
    let mut out = written(uses);
    if tiles && !uses.is_plain() {
        out = out.replace("fn texture_fetch_", "fn texture_tile_");
        out += TILED;
        if uses.levels {
            out += TILED_WIDE;
        }
    }
    out
}

fn written(uses: Lookups) -> String {
    if uses.is_plain() {
        return String::new();
    }
    let wraps = |n: u8| uses.wraps & 1 << n != 0;
    let filters = |n: u8| uses.filters & 1 << n != 0;
    let line = |there: bool, text: &'static str| if there { text } else { "" };
    let mut out = String::new();
    if uses.levels {
        out += &WIDE.replace("TAPS", &format!("{TAPS}.0"));
    }
    out += AS;
    out += &[
        FILTER_BEGINS,
        line(filters(1), NEAREST),
        line(filters(2), BICUBIC_CHOSEN),
        FILTER_ENDS,
        line(filters(2), BICUBIC),
        REDUCE_BEGINS,
        line(wraps(1), REDUCE_MIRROR),
        line(wraps(2) || wraps(3), REDUCE_CLAMP),
        REDUCE_ENDS,
        INDEX_BEGINS,
        line(wraps(1), INDEX_MIRROR),
        line(wraps(2), INDEX_CLAMP),
        line(wraps(3), INDEX_BORDER),
        INDEX_ENDS,
        TEXEL_BEGINS,
        line(wraps(3), TEXEL_BORDER),
        TEXEL_ENDS,
    ]
    .concat();
    out
}

const WIDE: &str = "\
// The mean over a box of sides at.zw around at.xy. The shorter side, no less than an eighth of the longer,
// chooses the levels; taps go along the longer one.
fn texture_fetch_wide(slot: u32, at: vec4<f32>, mode: i32) -> vec4<f32> {
    let size = vec2<f32>(texture_level_size(texture_level(slot, 0u)));
    let sides = min(abs(at.zw) * size, vec2<f32>(1e6));
    let longer = max(sides.x, sides.y);
    let shorter = max(max(min(sides.x, sides.y), longer / TAPS), 1.0);
    let detail = min(log2(shorter), f32(texture_last_level(slot)));
    let taps = max(ceil(longer / shorter), 1.0);
    let step = select(vec2<f32>(0.0, at.w), vec2<f32>(at.z, 0.0), sides.x > sides.y) / taps;
    var sum = vec4<f32>(0.0);
    for (var i = 0.5; i < taps; i += 1.0) {
        sum += texture_between(slot, detail, at.xy + (i - 0.5 * taps) * step, mode);
    }
    return sum / taps;
}

// Between the levels below and above `detail`.
fn texture_between(slot: u32, detail: f32, uv: vec2<f32>, mode: i32) -> vec4<f32> {
    let level = u32(detail);
    let fine = texture_filter(texture_level(slot, level), uv, mode);
    let weight = fract(detail);
    if weight == 0.0 {
        return fine;
    }
    return mix(fine, texture_filter(texture_level(slot, level + 1u), uv, mode), weight);
}

";

const AS: &str = "\
// The texture as `mode` says: two bits how it goes on along u, two along v, and how it is filtered.
fn texture_fetch_as(slot: u32, uv: vec2<f32>, mode: i32) -> vec4<f32> {
    return texture_filter(texture_level(slot, 0u), uv, mode);
}

";

const TILED: &str = "
// The texture, or its tile at the place, which goes on at its edges as it ends.
fn texture_fetch_as(slot: u32, uv: vec2<f32>, mode: i32) -> vec4<f32> {
    if !texture_is_tiled(slot) {
        return texture_tile_as(slot, uv, mode);
    }
    let tile = texture_tile(slot, uv);
    if tile == NO_TILE {
        return vec4<f32>(0.0);
    }
    return texture_tile_as(tile, fract(uv), CLAMPED_TILE + (mode & 0x30));
}
";

const TILED_WIDE: &str = "
// The same over a width, of which what lies beyond the tile is as its edge.
fn texture_fetch_wide(slot: u32, at: vec4<f32>, mode: i32) -> vec4<f32> {
    if !texture_is_tiled(slot) {
        return texture_tile_wide(slot, at, mode);
    }
    let tile = texture_tile(slot, at.xy);
    if tile == NO_TILE {
        return vec4<f32>(0.0);
    }
    return texture_tile_wide(tile, vec4<f32>(fract(at.xy), at.zw), CLAMPED_TILE + (mode & 0x30));
}
";

const FILTER_BEGINS: &str = "\
// One level as `mode` says; v points up, texel centres are at half-integers.
fn texture_filter(level: vec2<u32>, uv: vec2<f32>, mode: i32) -> vec4<f32> {
    let size = texture_level_size(level);
    let wraps = vec2<i32>(mode & 3, (mode >> 2u) & 3);
    let wrapped = vec2<f32>(texture_reduce(uv.x, wraps.x), 1.0 - texture_reduce(uv.y, wraps.y));
    let at = wrapped * vec2<f32>(size);
";

const NEAREST: &str = "    \
    if mode >> 4u == 1 {
        let p = vec2<i32>(floor(at));
        return texture_texel(level, texture_index(p.x, size.x, wraps.x), texture_index(p.y, size.y, wraps.y));
    }
";

const BICUBIC_CHOSEN: &str = "    \
    if mode >> 4u == 2 {
        return texture_bicubic(level, size, at, wraps);
    }
";

const FILTER_ENDS: &str = "    \
    let cell = floor(at - 0.5);
    let weight = at - 0.5 - cell;
    let p = vec2<i32>(cell);
    let left = texture_index(p.x, size.x, wraps.x);
    let right = texture_index(p.x + 1, size.x, wraps.x);
    let upper = texture_index(p.y, size.y, wraps.y);
    let lower = texture_index(p.y + 1, size.y, wraps.y);
    let top = mix(texture_texel(level, left, upper), texture_texel(level, right, upper), weight.x);
    let bottom = mix(texture_texel(level, left, lower), texture_texel(level, right, lower), weight.x);
    return mix(top, bottom, weight.y);
}

";

const BICUBIC: &str = "\
// The cubic B-spline of the texels.
fn texture_bicubic(level: vec2<u32>, size: vec2<i32>, at: vec2<f32>, wraps: vec2<i32>) -> vec4<f32> {
    let cell = floor(at - 0.5);
    let columns = texture_cubic(at.x - 0.5 - cell.x);
    let rows = texture_cubic(at.y - 0.5 - cell.y);
    let first = vec2<i32>(cell) - 1;
    var sum = vec4<f32>(0.0);
    for (var j = 0; j < 4; j++) {
        let y = texture_index(first.y + j, size.y, wraps.y);
        for (var i = 0; i < 4; i++) {
            let x = texture_index(first.x + i, size.x, wraps.x);
            sum += columns[i] * rows[j] * texture_texel(level, x, y);
        }
    }
    return sum;
}

// Weights of four texels, `t` beyond the second.
fn texture_cubic(t: f32) -> vec4<f32> {
    let s = 1.0 - t;
    let t2 = t * t;
    let s2 = s * s;
    return vec4<f32>(s2 * s, 4.0 + t2 * (3.0 * t - 6.0), 4.0 + s2 * (3.0 * s - 6.0), t2 * t) / 6.0;
}

";

const REDUCE_BEGINS: &str = "\
// A coordinate near the picture where the texture is the same, so that far ones keep their precision.
fn texture_reduce(x: f32, wrap: i32) -> f32 {
";

const REDUCE_MIRROR: &str = "    \
    if wrap == 1 {
        return x - 2.0 * floor(0.5 * x);
    }
";

const REDUCE_CLAMP: &str = "    \
    if wrap >= 2 {
        return clamp(x, -3.0, 4.0);
    }
";

const REDUCE_ENDS: &str = "    \
    return x - floor(x);
}

";

const INDEX_BEGINS: &str = "\
// Which of n texels of a side stands at place i.
fn texture_index(i: i32, n: i32, wrap: i32) -> i32 {
";

const INDEX_MIRROR: &str = "    \
    if wrap == 1 {
        let j = (i % (2 * n) + 2 * n) % (2 * n);
        return min(j, 2 * n - 1 - j);
    }
";

const INDEX_CLAMP: &str = "    \
    if wrap == 2 {
        return clamp(i, 0, n - 1);
    }
";

const INDEX_BORDER: &str = "    \
    if wrap == 3 {
        return select(-1, i, i >= 0 && i < n);
    }
";

const INDEX_ENDS: &str = "    \
    return (i % n + n) % n;
}

";

const TEXEL_BEGINS: &str = "\
fn texture_texel(level: vec2<u32>, x: i32, y: i32) -> vec4<f32> {
";

const TEXEL_BORDER: &str = "    \
    if x < 0 || y < 0 {
        return vec4<f32>(0.0);
    }
";

const TEXEL_ENDS: &str = "    \
    return texture_level_texel(level, vec2<i32>(x, y));
}
";
