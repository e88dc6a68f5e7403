//! Random kernels: the interpreter and both kinds of machine code must leave the same bits in every lane.
//!
//! A kernel is text that a generator wrote: expressions of all types, variables, arrays that are indexed by
//! anything, branches, loops, functions that take pointers, and stores to a buffer at any index. What no number
//! is may be any such number; calls of sine and the like are left out, since they round as libraries do.
//!
//! Under valgrind, the same tests watch what machine code reads and writes:
//! `valgrind target/debug/deps/impasto_cpu-* random_kernels`.

use std::fmt::Write;
use std::sync::Arc;

use super::Nobody;
use crate::interpret::Machine;
use crate::native::Buffer;
use crate::{Kernel, KernelError, Thread, Width, lower};

/// Invocations of a kernel.
const LANES: u32 = 20;
/// Words that each reads, and words of what they write.
const WORDS: usize = 160;

/// SplitMix64.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % n as u64) as usize
    }

    fn one<'a>(&mut self, of: &[&'a str]) -> &'a str {
        of[self.below(of.len())]
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Float,
    Uint,
    Int,
    Bool,
    Vector,
}

const KINDS: [Kind; 5] = [Kind::Float, Kind::Uint, Kind::Int, Kind::Bool, Kind::Vector];

impl Kind {
    fn wgsl(self) -> &'static str {
        match self {
            Kind::Float => "f32",
            Kind::Uint => "u32",
            Kind::Int => "i32",
            Kind::Bool => "bool",
            Kind::Vector => "vec3<f32>",
        }
    }
}

/// Writes a kernel.
struct Writer<'r> {
    random: &'r mut Random,
    text: String,
    /// Variables in scope.
    variables: Vec<(String, Kind)>,
    names: usize,
    /// Loops around.
    loops: usize,
    /// Whether indices may be out of range, where the interpreter gives up.
    wild: bool,
}

impl Writer<'_> {
    fn expression(&mut self, kind: Kind, depth: usize) -> String {
        let known: Vec<String> = self
            .variables
            .iter()
            .filter(|(_, k)| *k == kind)
            .map(|(n, _)| n.clone())
            .collect();
        if depth == 0 || self.random.below(6) == 0 {
            if !known.is_empty() && self.random.below(3) > 0 {
                return known[self.random.below(known.len())].clone();
            }
            return self.literal(kind);
        }
        let mut sub = |kind| self.expression(kind, depth - 1);
        match kind {
            Kind::Float => {
                let (a, b) = (sub(Kind::Float), sub(Kind::Float));
                let c = sub(Kind::Float);
                let (u, i, t) = (sub(Kind::Uint), sub(Kind::Int), sub(Kind::Bool));
                let (v, w) = (sub(Kind::Vector), sub(Kind::Vector));
                match self.random.below(18) {
                    0 => format!("({a} + {b})"),
                    1 => format!("({a} - {b})"),
                    2 => format!("({a} * {b})"),
                    3 => format!("({a} / {b})"),
                    4 => format!("min({a}, {b})"),
                    5 => format!("max({a}, {b})"),
                    6 => format!("select({a}, {b}, {t})"),
                    7 => format!("f32({u})"),
                    8 => format!("f32({i})"),
                    9 => format!("bitcast<f32>({u})"),
                    10 => format!("clamp({a}, {b}, {c})"),
                    11 => format!("dot({v}, {w})"),
                    12 => format!(
                        "{}({a})",
                        self.random.one(&[
                            "abs", "floor", "ceil", "trunc", "round", "sqrt", "fract", "sign",
                            "saturate", "-"
                        ])
                    ),
                    13 => format!("mix({a}, {b}, {c})"),
                    14 => format!("{v}.{}", self.random.one(&["x", "y", "z"])),
                    15 => format!("{v}[{}]", self.index(&u, 3)),
                    16 => format!("unpack2x16float({u}).x"),
                    _ => format!("numbers[{}]", self.index(&u, 5)),
                }
            }
            Kind::Uint => {
                let (a, b) = (sub(Kind::Uint), sub(Kind::Uint));
                let (f, i, t) = (sub(Kind::Float), sub(Kind::Int), sub(Kind::Bool));
                match self.random.below(16) {
                    0 => format!("({a} + {b})"),
                    1 => format!("({a} - {b})"),
                    2 => format!("({a} * {b})"),
                    3 => format!("({a} / {b})"),
                    4 => format!("({a} % {b})"),
                    5 => format!("({a} {} {b})", self.random.one(&["&", "|", "^"])),
                    6 => format!("({a} {} ({b} & 31u))", self.random.one(&["<<", ">>"])),
                    7 => format!("min({a}, {b})"),
                    8 => format!("select({a}, {b}, {t})"),
                    9 => format!("u32({f})"),
                    10 => format!("u32({i})"),
                    11 => format!("bitcast<u32>({i})"),
                    12 => format!(
                        "{}({a})",
                        self.random.one(&[
                            "countOneBits",
                            "reverseBits",
                            "firstLeadingBit",
                            "firstTrailingBit",
                            "countLeadingZeros",
                            "countTrailingZeros",
                            "~"
                        ])
                    ),
                    13 => format!("extractBits({a}, {b} & 31u, ({a} >> 3u) & 31u)"),
                    14 => format!(
                        "input[{}].{}",
                        self.index(&a, 16),
                        self.random.one(&["x", "y", "z", "w"])
                    ),
                    _ => format!("max({a}, {b})"),
                }
            }
            Kind::Int => {
                let (a, b) = (sub(Kind::Int), sub(Kind::Int));
                let (f, u, t) = (sub(Kind::Float), sub(Kind::Uint), sub(Kind::Bool));
                match self.random.below(12) {
                    0 => format!("({a} + {b})"),
                    1 => format!("({a} - {b})"),
                    2 => format!("({a} * {b})"),
                    3 => format!("({a} / {b})"),
                    4 => format!("({a} % {b})"),
                    5 => format!("({a} >> ({u} & 31u))"),
                    6 => format!("min({a}, {b})"),
                    7 => format!("max({a}, {b})"),
                    8 => format!("select({a}, {b}, {t})"),
                    9 => format!("i32({f})"),
                    10 => format!("i32({u})"),
                    _ => format!("abs({a})"),
                }
            }
            Kind::Bool => {
                let (a, b) = (sub(Kind::Bool), sub(Kind::Bool));
                let order = self.random.one(&["<", "<=", ">", ">=", "==", "!="]);
                let kind = [Kind::Float, Kind::Uint, Kind::Int][self.random.below(3)];
                let (x, y) = (
                    self.expression(kind, depth - 1),
                    self.expression(kind, depth - 1),
                );
                match self.random.below(6) {
                    0 => format!("({a} && {b})"),
                    1 => format!("({a} || {b})"),
                    2 => format!("!{a}"),
                    _ => format!("({x} {order} {y})"),
                }
            }
            Kind::Vector => {
                let (v, w) = (sub(Kind::Vector), sub(Kind::Vector));
                let (a, b, c) = (sub(Kind::Float), sub(Kind::Float), sub(Kind::Float));
                let t = sub(Kind::Bool);
                match self.random.below(9) {
                    0 => format!("({v} + {w})"),
                    1 => format!("({v} * {w})"),
                    2 => format!("({v} * {a})"),
                    3 => format!("cross({v}, {w})"),
                    4 => format!("normalize({v})"),
                    5 => format!("vec3<f32>({a}, {b}, {c})"),
                    6 => format!("select({v}, {w}, {t})"),
                    7 => format!("reflect({v}, {w})"),
                    _ => format!("{v}.zxy"),
                }
            }
        }
    }

    fn literal(&mut self, kind: Kind) -> String {
        match kind {
            Kind::Float => self
                .random
                .one(&[
                    "none",
                    "(1.0 + none)",
                    "(-2.5 + none)",
                    "(0.1 + none)",
                    "(3e9 + none)",
                    "(-1e-20 + none)",
                    "bitcast<f32>(seed)",
                    "f32(lane)",
                ])
                .into(),
            Kind::Uint => self
                .random
                .one(&[
                    "zero",
                    "(1u | zero)",
                    "(7u | zero)",
                    "(31u | zero)",
                    "(0xffffffffu | zero)",
                    "(0x80000000u | zero)",
                    "lane",
                    "seed",
                ])
                .into(),
            Kind::Int => self
                .random
                .one(&[
                    "i32(zero)",
                    "(1i + i32(zero))",
                    "(-1i + i32(zero))",
                    "(-2147483647i + i32(zero))",
                    "(100i + i32(zero))",
                    "i32(lane)",
                ])
                .into(),
            Kind::Bool => self
                .random
                .one(&["true", "false", "(lane > 3u)", "((seed & 1u) == 0u)"])
                .into(),
            Kind::Vector => self
                .random
                .one(&[
                    "(vec3<f32>(1.0, 2.0, 3.0) + none)",
                    "vec3<f32>(f32(lane))",
                    "(vec3<f32>(0.0, -1.0, 0.5) + none)",
                ])
                .into(),
        }
    }

    fn index(&self, index: &str, length: usize) -> String {
        if self.wild {
            index.into()
        } else {
            format!("({index} % {length}u)")
        }
    }

    fn kind(&mut self) -> Kind {
        KINDS[self.random.below(KINDS.len())]
    }

    fn block(&mut self, depth: usize) {
        let scope = self.variables.len();
        for _ in 0..1 + self.random.below(4) {
            self.statement(depth);
        }
        self.variables.truncate(scope);
    }

    fn statement(&mut self, depth: usize) {
        match self.random.below(if depth == 0 { 5 } else { 11 }) {
            0 | 1 => {
                let kind = self.kind();
                let value = self.expression(kind, 3);
                let name = format!("v{}", self.names);
                self.names += 1;
                let _ = writeln!(self.text, "var {name}: {} = {value};", kind.wgsl());
                self.variables.push((name, kind));
            }
            2 | 3 if !self.variables.is_empty() => {
                let (name, kind) = self.variables[self.random.below(self.variables.len())].clone();
                let value = self.expression(kind, 3);
                let _ = writeln!(self.text, "{name} = {value};");
            }
            4 => {
                let (index, value) = (
                    self.expression(Kind::Uint, 2),
                    self.expression(Kind::Float, 3),
                );
                let index = self.index(&index, 5);
                let _ = writeln!(self.text, "numbers[{index}] = {value};");
            }
            5 | 6 => {
                let condition = self.expression(Kind::Bool, 2);
                let _ = writeln!(self.text, "if {condition} {{");
                self.block(depth - 1);
                if self.loops > 0 && self.random.below(3) == 0 {
                    let jump = self.random.one(&["break", "continue", "return"]);
                    let _ = writeln!(self.text, "{jump};");
                }
                self.text.push_str("} else {\n");
                self.block(depth - 1);
                self.text.push_str("}\n");
            }
            7 | 8 => {
                let name = format!("turn{}", self.names);
                self.names += 1;
                let turns = self
                    .random
                    .one(&["3u", "lane", "(seed & 3u)", "(lane & 1u)"]);
                let _ = writeln!(
                    self.text,
                    "for (var {name} = 0u; {name} < {turns}; {name}++) {{"
                );
                self.loops += 1;
                self.block(depth - 1);
                self.loops -= 1;
                self.text.push_str("}\n");
            }
            9 => {
                let selector = self.expression(Kind::Uint, 2);
                let _ = writeln!(self.text, "switch {selector} & 3u {{ case 0u, 2u: {{");
                let loops = std::mem::take(&mut self.loops);
                self.block(depth - 1);
                self.text.push_str("} case 1u: {\n");
                self.block(depth - 1);
                self.text.push_str("} default: {\n");
                self.block(depth - 1);
                self.text.push_str("} }\n");
                self.loops = loops;
            }
            _ => {
                let (index, value) = (
                    self.expression(Kind::Uint, 2),
                    self.expression(Kind::Float, 2),
                );
                let index = self.index(&index, 5);
                let _ = writeln!(
                    self.text,
                    "shared_number += change(&numbers, {index}, {value});"
                );
            }
        }
    }
}

/// A kernel whose invocations write a row each, and add to words that they share.
fn kernel(random: &mut Random, wild: bool) -> String {
    let mut writer = Writer {
        random,
        text: String::new(),
        variables: Vec::new(),
        names: 0,
        loops: 0,
        wild,
    };
    for _ in 0..4 {
        writer.statement(0);
    }
    for _ in 0..4 {
        writer.statement(3);
    }
    let mut end = String::new();
    for (at, (name, kind)) in writer.variables.clone().iter().take(6).enumerate() {
        let value = match kind {
            Kind::Float => format!("bitcast<u32>({name})"),
            Kind::Uint => name.clone(),
            Kind::Int => format!("bitcast<u32>({name})"),
            Kind::Bool => format!("select(0u, 1u, {name})"),
            Kind::Vector => format!("bitcast<u32>({name}.x + {name}.y * {name}.z)"),
        };
        let _ = writeln!(end, "out[8u * lane + {at}u] = {value};");
    }
    let body = writer.text;
    format!(
        "@group(0) @binding(0) var<storage, read> input: array<vec4<u32>>;
        @group(0) @binding(1) var<storage, read_write> out: array<u32>;
        var<private> shared_number: f32 = 0.5;
        var<private> numbers_before: array<f32, 4>;
        fn change(numbers: ptr<function, array<f32, 5>>, index: u32, value: f32) -> f32 {{
            let before = (*numbers)[index];
            if value > before {{ (*numbers)[index] = value; return 1.0; }}
            numbers_before[index % 4u] = before;
            return before;
        }}
        fn work(lane: u32, seed: u32) {{
            var numbers: array<f32, 5>;
            let zero = input[lane].y & 0u;
            let none = bitcast<f32>(zero);
            {body}
            {end}
            out[8u * lane + 6u] = bitcast<u32>(numbers[seed % 5u] + numbers_before[lane % 4u]);
        }}
        @compute @workgroup_size({LANES}) fn main(@builtin(local_invocation_index) lane: u32) {{
            work(lane, input[lane].x);
            out[8u * lane + 7u] = bitcast<u32>(shared_number);
        }}"
    )
}

/// What each way of running a kernel leaves.
fn results(text: &str, input: &[u32], wild: bool) -> Result<Vec<Vec<u32>>, KernelError> {
    let module = naga::front::wgsl::parse_str(text)
        .unwrap_or_else(|e| panic!("{}\n{text}", e.emit_to_string(text)));
    let flags = naga::valid::ValidationFlags::all();
    let mut validator = naga::valid::Validator::new(flags, naga::valid::Capabilities::all());
    let info = validator
        .validate(&module)
        .unwrap_or_else(|e| panic!("{}\n{text}", e.emit_to_string(text)));
    let code = lower(&module, &info, &[], &[])?;
    let mut found = Vec::new();
    for (width, alone) in [
        (Width::One, false),
        (Width::Best, false),
        (Width::Best, true),
    ] {
        let kernel = Arc::new(Kernel::build(&code, &[], |_| alone, width)?);
        let (given, out) = (Arc::new(Buffer::new(WORDS)), Arc::new(Buffer::new(WORDS)));
        given.write(0, input);
        let buffers = code.buffers.iter().map(|name| match name.as_str() {
            "input" => given.clone(),
            _ => out.clone(),
        });
        // SAFETY: nobody answers.
        #[allow(unsafe_code)]
        let thread = unsafe { Thread::new(&kernel, buffers.collect(), &[], &Arc::default()) };
        thread?.run([0; 3], 0..LANES);
        found.push(out.read());
    }
    if wild {
        found.push(found[0].clone());
        return Ok(found);
    }
    let buffers = code.buffers.iter().map(|name| match name.as_str() {
        "input" => input.to_vec(),
        _ => vec![0; WORDS],
    });
    let mut machine = Machine::<f32>::new(&code, buffers.collect(), 1 << 24)?;
    for lane in 0..LANES {
        machine.run_lane(lane, &mut Nobody)?;
    }
    let at = code.buffers.iter().position(|name| name == "out");
    found.push(machine.buffers[at.unwrap_or(0)].clone());
    Ok(found)
}

/// All bits that are no number are one.
fn plain(word: u32) -> u32 {
    if f32::from_bits(word).is_nan() {
        f32::NAN.to_bits()
    } else {
        word
    }
}

fn check(seed: u64) {
    let mut random = Random(seed);
    let wild = seed.is_multiple_of(3);
    let text = kernel(&mut random, wild);
    let input: Vec<u32> = (0..WORDS)
        .map(|_| match random.below(4) {
            0 => random.below(10) as u32,
            1 => (random.below(1000) as f32 / 100.0 - 5.0).to_bits(),
            _ => random.below(1 << 32) as u32,
        })
        .collect();
    let found = results(&text, &input, wild).unwrap_or_else(|e| panic!("seed {seed}: {e}\n{text}"));
    for at in 0..WORDS {
        let all: Vec<u32> = found.iter().map(|words| plain(words[at])).collect();
        assert!(
            all.windows(2).all(|two| two[0] == two[1]),
            "seed {seed}, word {at} of lane {}: {all:x?}\n{text}",
            at / 8
        );
    }
}

#[test]
fn random_kernels_leave_the_same_bits_however_they_run() {
    for seed in 0..150 {
        check(seed);
    }
}

/// `cargo test --release -p impasto-cpu -- --ignored random`
#[test]
#[ignore = "takes minutes"]
fn many_random_kernels_leave_the_same_bits() {
    for seed in 1000..11_000 {
        check(seed);
    }
}
