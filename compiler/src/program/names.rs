//! WGSL identifiers for source names: readable, unique, and never a reserved word.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

use crate::ir::{Module, StructId};
use crate::source::{SourceMap, Span};

/// Names of a program's functions and structs.
#[derive(Clone, Debug, Default)]
pub struct Names {
    functions: Vec<String>,
    structs: Vec<String>,
}

impl Names {
    /// Names for everything in a module, in order of definition; the first of equal names keeps
    /// it. A name says where its definition is: `noise_perlin`, `bsdf_diffuse_eval`, or `user_f`
    /// for a user's own, so that no name can meet one of the runtime's kernels. The structs of
    /// the ABI, `exact`, keep theirs.
    pub fn new(module: &Module, sources: &SourceMap, exact: &[StructId]) -> Self {
        let mut taken = BTreeMap::new();
        let mut name = |name: &str, span: Span| {
            unique(&mut taken, &format!("{}_{name}", origin(sources, span)))
        };
        let mut structs = Vec::new();
        for (i, s) in module.structs.iter().enumerate() {
            let kept = exact.contains(&StructId(i as u32));
            structs.push(if kept {
                s.name.clone()
            } else {
                name(&s.name, s.span)
            });
        }
        let functions = module
            .functions
            .iter()
            .map(|f| name(&f.name, f.span))
            .collect();
        Self { functions, structs }
    }

    /// The name of function `id`.
    pub fn function(&self, id: usize) -> &str {
        &self.functions[id]
    }

    /// The name of struct `id`.
    pub fn structure(&self, id: StructId) -> &str {
        &self.structs[id.index()]
    }
}

/// The folder of the standard library that a span is in, or `user`.
fn origin(sources: &SourceMap, span: Span) -> &str {
    let std = sources.file(span.file).name.strip_prefix("std/");
    std.and_then(|path| path.split('/').next())
        .unwrap_or("user")
}

/// `name`, or `name_2`, `name_3`, ... if it is taken.
pub fn unique(taken: &mut BTreeMap<String, u32>, name: &str) -> String {
    let base = identifier(name);
    let mut candidate = base.clone();
    loop {
        let count = taken.entry(candidate.clone()).or_insert(0);
        *count += 1;
        if *count == 1 {
            return candidate;
        }
        let next = taken.get(&base).copied().unwrap_or(2);
        candidate = format!("{base}_{next}");
        if taken.contains_key(&candidate) {
            *taken.entry(base.clone()).or_insert(1) += 1;
        }
    }
}

/// A legal WGSL identifier for `name`.
pub fn identifier(name: &str) -> String {
    let mut out: String = name
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '_' })
        .collect();
    if out.starts_with(|c: char| c.is_ascii_digit()) || out.is_empty() || out == "_" {
        out.insert(0, 'm');
    }
    if out.starts_with("__") {
        out.insert(0, 'm');
    }
    if is_taken(&out) { out + "_" } else { out }
}

/// Names that belong to WGSL or to unnamed values.
fn is_taken(name: &str) -> bool {
    static TAKEN: LazyLock<BTreeSet<&str>> = LazyLock::new(|| {
        let all = [KEYWORDS, RESERVED, PREDECLARED];
        all.into_iter().flatten().copied().collect()
    });
    TAKEN.contains(name) || is_temporary(name)
}

/// `v12`: what unnamed values are called.
fn is_temporary(name: &str) -> bool {
    name.strip_prefix('v')
        .is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()))
}

/// Keywords (WGSL specification, section 15.1).
const KEYWORDS: &[&str] = &[
    "alias",
    "break",
    "case",
    "const",
    "const_assert",
    "continue",
    "continuing",
    "default",
    "diagnostic",
    "discard",
    "else",
    "enable",
    "false",
    "fn",
    "for",
    "if",
    "let",
    "loop",
    "override",
    "requires",
    "return",
    "struct",
    "switch",
    "true",
    "var",
    "while",
];

/// Predeclared types and functions that a source name could shadow to its own harm.
const PREDECLARED: &[&str] = &[
    "abs",
    "acos",
    "acosh",
    "all",
    "any",
    "array",
    "asin",
    "asinh",
    "atan",
    "atan2",
    "atanh",
    "atomic",
    "bitcast",
    "bool",
    "ceil",
    "clamp",
    "cos",
    "cosh",
    "cross",
    "degrees",
    "determinant",
    "distance",
    "dot",
    "exp",
    "exp2",
    "extractBits",
    "f16",
    "f32",
    "faceForward",
    "floor",
    "fma",
    "fract",
    "frexp",
    "i32",
    "insertBits",
    "inverseSqrt",
    "ldexp",
    "length",
    "log",
    "log2",
    "mat2x2",
    "mat3x3",
    "mat3x3f",
    "mat4x4",
    "max",
    "min",
    "mix",
    "modf",
    "normalize",
    "pow",
    "ptr",
    "radians",
    "reflect",
    "refract",
    "round",
    "sampler",
    "saturate",
    "select",
    "sign",
    "sin",
    "sinh",
    "smoothstep",
    "sqrt",
    "step",
    "tan",
    "tanh",
    "transpose",
    "trunc",
    "u32",
    "vec2",
    "vec2f",
    "vec3",
    "vec3f",
    "vec4",
    "vec4f",
];

/// Reserved words (WGSL specification, section 15.2).
const RESERVED: &[&str] = &[
    "NULL",
    "Self",
    "abstract",
    "active",
    "alignas",
    "alignof",
    "as",
    "asm",
    "asm_fragment",
    "async",
    "attribute",
    "auto",
    "await",
    "become",
    "cast",
    "catch",
    "class",
    "co_await",
    "co_return",
    "co_yield",
    "coherent",
    "column_major",
    "common",
    "compile",
    "compile_fragment",
    "concept",
    "const_cast",
    "consteval",
    "constexpr",
    "constinit",
    "crate",
    "debugger",
    "decltype",
    "delete",
    "demote",
    "demote_to_helper",
    "do",
    "dynamic_cast",
    "enum",
    "explicit",
    "export",
    "extends",
    "extern",
    "external",
    "fallthrough",
    "filter",
    "final",
    "finally",
    "friend",
    "from",
    "fxgroup",
    "get",
    "goto",
    "groupshared",
    "highp",
    "impl",
    "implements",
    "import",
    "inline",
    "instanceof",
    "interface",
    "layout",
    "lowp",
    "macro",
    "macro_rules",
    "match",
    "mediump",
    "meta",
    "mod",
    "module",
    "move",
    "mut",
    "mutable",
    "namespace",
    "new",
    "nil",
    "noexcept",
    "noinline",
    "nointerpolation",
    "non_coherent",
    "noncoherent",
    "noperspective",
    "null",
    "nullptr",
    "of",
    "operator",
    "package",
    "packoffset",
    "pass",
    "patch",
    "pixelfragment",
    "precise",
    "precision",
    "premerge",
    "priv",
    "protected",
    "pub",
    "public",
    "readonly",
    "ref",
    "regardless",
    "register",
    "reinterpret_cast",
    "require",
    "resource",
    "restrict",
    "self",
    "set",
    "shared",
    "sizeof",
    "smooth",
    "snorm",
    "static",
    "static_assert",
    "static_cast",
    "std",
    "subroutine",
    "super",
    "target",
    "template",
    "this",
    "thread_local",
    "throw",
    "trait",
    "try",
    "type",
    "typedef",
    "typeid",
    "typename",
    "typeof",
    "union",
    "unless",
    "unorm",
    "unsafe",
    "unsized",
    "use",
    "using",
    "varying",
    "virtual",
    "volatile",
    "wgsl",
    "where",
    "with",
    "writeonly",
    "yield",
];
