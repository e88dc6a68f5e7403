//! Modules that stand by themselves: generated code with declarations of what it reads, for one
//! target or the other.
//!
//! The text of materials is the same on every target. What differs is who provides textures, and
//! which extensions of WGSL must be named.

use std::fmt::Write;

use super::{lookups, module};
use crate::abi::{TEXTURE_FETCH, TEXTURE_FETCH_AS, TEXTURE_FETCH_WIDE, TextureSpace};
use crate::program::Program;

/// What a module is for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Target {
    /// wgpu on a native device, through naga. The renderer's kernels look textures up in a buffer;
    /// here a stand-in completes the module.
    #[default]
    Native,
    /// WebGPU in a browser: textures are bound as such, and every extension is enabled by name.
    WebGpu,
}

/// Extensions of WGSL that text may use, by a word that shows it. Naga has them without being
/// asked, and refuses the line that browsers require.
const EXTENSIONS: [(&str, &str); 2] = [("subgroups", "subgroup"), ("f16", "f16")];

/// The `enable` lines that a text needs on a target.
pub fn enables(wgsl: &str, target: Target) -> String {
    let used = |(_, word): &&(&str, &str)| {
        let words = wgsl.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
        words.into_iter().any(|w| match *word {
            "subgroup" => w.starts_with("subgroup") && w != "subgroup",
            exact => w == exact,
        })
    };
    let named = EXTENSIONS.iter().filter(used);
    match target {
        Target::Native => String::new(),
        Target::WebGpu => named.map(|(name, _)| format!("enable {name};\n")).collect(),
    }
}

/// The WGSL of some materials with declarations of all that a kernel would provide, which makes
/// it a module that can be checked by itself.
pub fn complete(program: &Program, members: &[usize], target: Target) -> String {
    let mut out = String::new();
    let tables = program.tables();
    for (binding, table) in tables.iter().enumerate() {
        let (name, ty) = (table.name, table.wgsl_type);
        let _ = writeln!(
            out,
            "@group(0) @binding({binding}) var<storage, read> {name}: {ty};"
        );
    }
    let body = module(program, members);
    match target {
        Target::WebGpu => textures(program, &body, tables.len(), &mut out),
        Target::Native => stand_ins(&body, &mut out),
    }
    if !out.is_empty() {
        out.push('\n');
    }
    enables(&body, target) + &out + &body
}

/// Does a text call a function?
fn calls(text: &str, function: &str) -> bool {
    text.contains(&format!("{function}("))
}

/// Lookups that only complete the module.
fn stand_ins(body: &str, out: &mut String) {
    let lookups = [
        (TEXTURE_FETCH, "uv: vec2f", "vec4f(uv, f32(slot), 1.0)"),
        (
            TEXTURE_FETCH_AS,
            "uv: vec2f, mode: i32",
            "vec4f(uv, f32(slot), f32(mode))",
        ),
        (
            TEXTURE_FETCH_WIDE,
            "at: vec4f, mode: i32",
            "at + f32(slot) + f32(mode)",
        ),
    ];
    for (name, parameters, value) in lookups.into_iter().filter(|(name, ..)| calls(body, name)) {
        let _ = writeln!(
            out,
            "fn {name}(slot: u32, {parameters}) -> vec4f {{\n    return {value};\n}}"
        );
    }
}

/// Textures as bindings from number `first` on, and the lookups in them that `body` calls: v points up,
/// as the renderer has it.
fn textures(program: &Program, body: &str, first: usize, out: &mut String) {
    let plain = calls(body, TEXTURE_FETCH);
    let special = calls(body, TEXTURE_FETCH_AS) || calls(body, TEXTURE_FETCH_WIDE);
    if !plain && !special {
        return;
    }
    if plain {
        let _ = writeln!(out, "// Linear filter, repeating.");
        let _ = writeln!(
            out,
            "@group(0) @binding({first}) var material_sampler: sampler;"
        );
    }
    for (slot, texture) in program.textures().iter().enumerate() {
        let kind = match texture.space {
            TextureSpace::Color => "decoded to linear color, as the -srgb formats are",
            TextureSpace::Data => "numbers as they are",
        };
        let levels = if texture.lookups.levels {
            ", all mip levels"
        } else {
            ""
        };
        let path = texture.path.replace(|c: char| c.is_control(), "?");
        let _ = writeln!(out, "// {path}: {kind}{levels}.");
        let _ = writeln!(
            out,
            "@group(0) @binding({}) var material_texture_{slot}: texture_2d<f32>;",
            first + 1 + slot
        );
    }
    let slots = program.textures().len();
    if plain {
        let value = "textureSampleLevel(TEXTURE, material_sampler, at, 0.0)";
        let body = format!(
            "    let at = vec2f(uv.x, 1.0 - uv.y);\n{}",
            by_slot("slot", slots, value, "vec4f()")
        );
        let _ = write!(
            out,
            "\nfn {TEXTURE_FETCH}(slot: u32, uv: vec2f) -> vec4f {{\n{body}}}\n"
        );
    }
    if special {
        let _ = write!(out, "\n{}", levels(slots));
        out.push_str(&lookups(program.lookups(), false));
    }
}

/// What [`lookups`] asks for: a level is the slot and the number of the level.
fn levels(slots: usize) -> String {
    let last = by_slot("slot", slots, "textureNumLevels(TEXTURE) - 1u", "0u");
    let size = "vec2<i32>(textureDimensions(TEXTURE, level.y))";
    let size = by_slot("level.x", slots, size, "vec2<i32>(1)");
    let texel = "textureLoad(TEXTURE, p, level.y)";
    let texel = by_slot("level.x", slots, texel, "vec4<f32>()");
    format!(
        "fn texture_level(slot: u32, level: u32) -> vec2<u32> {{\n    return vec2<u32>(slot, level);\n}}\n\n\
         fn texture_last_level(slot: u32) -> u32 {{\n{last}}}\n\n\
         fn texture_level_size(level: vec2<u32>) -> vec2<i32> {{\n{size}}}\n\n\
         fn texture_level_texel(level: vec2<u32>, p: vec2<i32>) -> vec4<f32> {{\n{texel}}}\n\n"
    )
}

/// Statements that return `value` with the texture of the slot that `slot` gives in place of `TEXTURE`.
fn by_slot(slot: &str, slots: usize, value: &str, otherwise: &str) -> String {
    let case = |n: usize| {
        let value = value.replace("TEXTURE", &format!("material_texture_{n}"));
        format!("        case {n}u: {{ return {value}; }}\n")
    };
    let cases: String = (0..slots).map(case).collect();
    format!("    switch {slot} {{\n{cases}        default: {{ return {otherwise}; }}\n    }}\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extensions_are_enabled_where_browsers_ask_for_it() {
        let text = "fn f(x: f16) -> u32 { return subgroupAdd(1u); }";
        assert_eq!(enables(text, Target::Native), "");
        let lines = enables(text, Target::WebGpu);
        assert_eq!(lines, "enable subgroups;\nenable f16;\n");
        assert_eq!(enables("let f16x = subgroup;", Target::WebGpu), "");
    }
}
