//! Modules that stand by themselves: generated code with declarations of what it reads, for one
//! target or the other.
//!
//! The text of materials is the same on every target. What differs is who provides textures, and
//! which extensions of WGSL must be named.

use std::fmt::Write;

use super::module;
use crate::Program;
use crate::abi::{TEXTURE_FETCH, TextureSpace};

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
    let fetches = body.contains(TEXTURE_FETCH);
    match target {
        Target::WebGpu if fetches => textures(program, tables.len(), &mut out),
        _ if fetches => stand_in(&mut out),
        _ => {}
    }
    if !out.is_empty() {
        out.push('\n');
    }
    enables(&body, target) + &out + &body
}

/// A lookup that only completes the module.
fn stand_in(out: &mut String) {
    let _ = writeln!(
        out,
        "fn {TEXTURE_FETCH}(slot: u32, uv: vec2f) -> vec4f {{\n    return vec4f(uv, f32(slot), 1.0);\n}}"
    );
}

/// Textures as bindings, and the lookup in them: v points up, as the renderer has it.
fn textures(program: &Program, first: usize, out: &mut String) {
    let _ = writeln!(out, "// Linear filter, repeating.");
    let _ = writeln!(
        out,
        "@group(0) @binding({first}) var material_sampler: sampler;"
    );
    let mut cases = String::new();
    for (slot, texture) in program.textures().iter().enumerate() {
        let kind = match texture.space {
            TextureSpace::Color => "decoded to linear color, as the -srgb formats are",
            TextureSpace::Data => "numbers as they are",
        };
        let path = texture.path.replace(|c: char| c.is_control(), "?");
        let _ = writeln!(out, "// {path}: {kind}.");
        let _ = writeln!(
            out,
            "@group(0) @binding({}) var material_texture_{slot}: texture_2d<f32>;",
            first + 1 + slot
        );
        let _ = writeln!(
            cases,
            "        case {slot}u: {{ return textureSampleLevel(material_texture_{slot}, material_sampler, at, 0.0); }}"
        );
    }
    let _ = writeln!(
        out,
        "\nfn {TEXTURE_FETCH}(slot: u32, uv: vec2f) -> vec4f {{\n    let at = vec2f(uv.x, 1.0 - uv.y);\n    switch slot {{\n{cases}        default: {{ return vec4f(); }}\n    }}\n}}"
    );
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
