//! The WGSL of ray casts, put together from the files of a technique.

use std::fmt::Write;

use crate::technique::{Stack, Technique, Traversal};
use crate::wgsl;
use crate::wgsl::ShaderPart;
use crate::wgsl::template::template;
use crate::wgsl::text::mentions;

/// How much slabs are widened, relative to the terms of a plane's distance: 16 units in the last
/// place. The builder rounds exponents by up to 11 of them (through `log2`), the kernel by 2.
pub(super) const SLACK: f32 = 1.0 / (1 << 20) as f32;

/// Bytes of a thread's stack that lie in workgroup memory: twelve entries of the wide BVH, as
/// in Ylitie et al. 2017, which is deeper than most rays get.
const SHARED_BYTES: usize = 96;

/// Everything a kernel needs to cast rays through a tree of `depth` inner nodes below `root`.
/// If it is a tree of placements, `depth` counts the deepest tree of an object as well. If it is
/// `split`, several references may be to one triangle.
pub(super) fn casts(
    traversal: Traversal,
    technique: &Technique,
    root: u32,
    depth: usize,
    placed: bool,
    split: bool,
) -> String {
    let stack = technique.stack;
    let binary = traversal == Traversal::Bvh2;
    let flags = [
        ("wide", !binary),
        ("trail", stack == Stack::Trail),
        ("placed", placed),
        ("split", split),
    ];
    let nodes = if binary {
        template!("binary.wgsl")
    } else {
        template!("wide.wgsl")
    };
    let mut out = wgsl::constant_u32("BVH_ROOT", root) + &wgsl::constant_f32("BVH_SLACK", SLACK);
    out += &template!("cast.wgsl").wgsl(&flags);
    out += include_str!("triangle.wgsl");
    if placed {
        out += &template!("placed.wgsl").wgsl(&flags);
    }
    out += &nodes.wgsl(&flags);
    out += &match stack {
        Stack::Trail => trail(if binary { 1 } else { 8 }, depth),
        Stack::Private => array(depth, 0),
        Stack::Workgroup => array(depth, depth.min(SHARED_BYTES / if binary { 4 } else { 8 })),
    };
    out
}

/// Whether a part has the steps of a cast, so that kernels may take up rays in its midst.
pub(crate) fn provides_steps(part: &ShaderPart) -> bool {
    mentions(&part.wgsl, "begin_walk")
}

/// Whether a part casts rays through a wide tree.
pub(super) fn is_wide(part: &ShaderPart) -> bool {
    mentions(&part.wgsl, "traversal_octant")
}

/// Whether a part must be told the thread's index in its workgroup.
pub(crate) fn asks_for_lane(part: &ShaderPart) -> bool {
    mentions(&part.wgsl, "walk_lane")
}

/// Whether this is the name of a function that casts rays, or of a part of one: it has the same text in every kernel.
pub(crate) fn is_traversal(function: &str) -> bool {
    let defined = format!("fn {function}(");
    FILES.iter().any(|text| text.contains(&defined))
}

/// The text of all of them.
const FILES: [&str; 6] = [
    include_str!("binary.wgsl"),
    include_str!("cast.wgsl"),
    include_str!("placed.wgsl"),
    include_str!("stack.wgsl"),
    include_str!("triangle.wgsl"),
    include_str!("wide.wgsl"),
];

/// Whether a kernel has a stack in workgroup memory, which need not be cleared: an entry is
/// written before it is read.
pub(crate) fn shares_stack(wgsl: &str) -> bool {
    mentions(wgsl, "shared_stack")
}

/// A stack of `size` entries, the first `shared` of them in workgroup memory.
fn array(size: usize, shared: usize) -> String {
    let flags = [("shared", shared > 0), ("own", shared < size)];
    wgsl::constant_u32("BVH_STACK_SIZE", size as u32)
        + &wgsl::constant_u32("STACK_SHARED", shared as u32)
        + &template!("stack.wgsl").wgsl(&flags)
}

/// What is left of a stack if `bits` bits a level say what remains to be visited there, and the
/// rest is read from the tree again, from the bottom up: a shift register over the levels, the
/// lowest bits the deepest level. After the restart trail of Laine, "Restart Trail for
/// Stackless BVH Traversal" (2010), with parent pointers in place of restarts, as in Afra and
/// Szirmay-Kalos, "Stackless Multi-BVH Traversal for CPU, MIC and GPU Ray Tracing" (2014).
fn trail(bits: usize, depth: usize) -> String {
    let words = (bits * depth).div_ceil(32);
    let mut out = String::from(
        "// A bit for each node that remains to be visited, by levels; the deepest is lowest.\n",
    );
    for word in 0..words {
        let _ = writeln!(out, "var<private> trail_{word}: u32 = 0u;");
    }
    out += "// The node whose children are visited, and in binary trees the last of them.\n\
            var<private> trail_node: u32 = 0u;\n\
            var<private> trail_child: u32 = 0u;\n\n";
    let zeros: Vec<String> = (0..words)
        .map(|w| format!("    trail_{w} = 0u;\n"))
        .collect();
    let _ = writeln!(
        out,
        "fn begin_trail() {{\n    trail_node = BVH_ROOT;\n    trail_child = BVH_ROOT;\n{}}}\n",
        zeros.concat()
    );
    let all: Vec<String> = (0..words).map(|w| format!("trail_{w}")).collect();
    let _ = writeln!(
        out,
        "fn trail_is_empty() -> bool {{\n    return ({}) == 0u;\n}}\n",
        all.join(" | ")
    );
    let out_shift = 32 - bits;
    out += "fn push_trail(level: u32) {\n";
    for word in (1..words).rev() {
        let below = word - 1;
        let _ = writeln!(
            out,
            "    trail_{word} = (trail_{word} << {bits}u) | (trail_{below} >> {out_shift}u);"
        );
    }
    let _ = writeln!(out, "    trail_0 = (trail_0 << {bits}u) | level;\n}}\n");
    let mask = (1u32 << bits) - 1;
    let _ = writeln!(
        out,
        "fn pop_trail() -> u32 {{\n    let level = trail_0 & {mask}u;"
    );
    for word in 0..words {
        let above = match word + 1 {
            above if above < words => format!(" | (trail_{above} << {out_shift}u)"),
            _ => String::new(),
        };
        let _ = writeln!(out, "    trail_{word} = (trail_{word} >> {bits}u){above};");
    }
    out += "    return level;\n}\n";
    out
}
