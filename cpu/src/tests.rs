//! Small kernels of which it is known what they do: statements, memory, and what is refused.

mod random;

use std::sync::Arc;

use crate::code::Code;
use crate::error::KernelError;
use crate::interpret::{Float, Host, Machine};
use crate::native::Buffer;
use crate::{Kernel, Thread, Width, lower};

/// A host that looks at nothing.
struct Nobody;

impl Host for Nobody {
    fn enter(&mut self, _: usize, _: &[u64], _: &mut Vec<u64>) -> Result<(), KernelError> {
        Ok(())
    }
    fn leave(&mut self, _: usize, _: &[u64], _: &[u64]) {}
}

/// The code of a kernel with the buffers `input` (words) and `result` (8 atomic words).
fn code(functions: &str, body: &str) -> Result<Code, KernelError> {
    let text = format!(
        "@group(0) @binding(0) var<storage, read> input: array<vec4<u32>>;
         @group(0) @binding(1) var<storage, read_write> result: array<atomic<u32>>;
         {functions}
         @compute @workgroup_size(1) fn main() {{ {body} }}"
    );
    let module = naga::front::wgsl::parse_str(&text).expect("WGSL");
    let flags = naga::valid::ValidationFlags::all();
    let mut validator = naga::valid::Validator::new(flags, naga::valid::Capabilities::all());
    let info = validator.validate(&module).expect("valid WGSL");
    lower(&module, &info, &[], &[])
}

/// Runs `body`; what `result` holds then.
fn run<F: Float>(functions: &str, body: &str, input: &[u32]) -> Result<Vec<u32>, KernelError> {
    let code = code(functions, body)?;
    let buffers = code.buffers.iter().map(|name| match name.as_str() {
        "input" => input.to_vec(),
        _ => vec![0; 8],
    });
    let mut machine = Machine::<F>::new(&code, buffers.collect(), 10_000)?;
    machine.run(&mut Nobody)?;
    let at = code.buffers.iter().position(|name| name == "result");
    Ok(at.map_or_else(Vec::new, |at| machine.buffers[at].clone()))
}

/// The same as machine code.
fn run_native(
    functions: &str,
    body: &str,
    input: &[u32],
    width: Width,
) -> Result<Vec<u32>, KernelError> {
    let code = code(functions, body)?;
    let kernel = Arc::new(Kernel::build(&code, &[], |_| false, width)?);
    let (given, result) = (Buffer::new(input.len().max(4)), Buffer::new(8));
    given.write(0, input);
    let (given, result) = (Arc::new(given), Arc::new(result));
    let buffers = code.buffers.iter().map(|name| match name.as_str() {
        "input" => given.clone(),
        _ => result.clone(),
    });
    // SAFETY: nobody answers.
    #[allow(unsafe_code)]
    let thread = unsafe { Thread::new(&kernel, buffers.collect(), &[], &Arc::default()) };
    thread?.run([0; 3], 0..1);
    Ok(result.read())
}

#[track_caller]
fn gives(functions: &str, body: &str, expected: &[u32]) {
    let input: Vec<u32> = (0..16).collect();
    let single = run::<f32>(functions, body, &input).unwrap_or_else(|e| panic!("{e}"));
    let double = run::<f64>(functions, body, &input).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(single[..expected.len()], *expected);
    assert_eq!(double[..expected.len()], *expected);
    for width in [Width::One, Width::Best] {
        let native = run_native(functions, body, &input, width).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(native[..expected.len()], *expected, "{width:?}");
    }
}

#[test]
fn loops_break_and_continue() {
    let body = "
        var sum = 0u;
        for (var i = 0u; i < 100u; i++) {
            if i % 2u == 0u { continue; }
            if i > 9u { break; }
            sum += i;
        }
        var turns = 0u;
        loop {
            turns += 1u;
            continuing { break if turns == 7u; }
        }
        atomicStore(&result[0], sum);
        atomicStore(&result[1], turns);";
    gives("", body, &[1 + 3 + 5 + 7 + 9, 7]);
}

#[test]
fn a_loop_begins_each_turn_with_new_variables() {
    let body = "
        var sum = 0u;
        for (var i = 0u; i < 3u; i++) {
            var fresh: u32;
            fresh += i + 1u;
            sum = sum * 10u + fresh;
        }
        atomicStore(&result[0], sum);";
    gives("", body, &[123]);
}

#[test]
fn a_switch_takes_one_case_or_the_default() {
    let functions = "fn pick(x: u32) -> u32 {
        switch x {
            case 1u, 2u: { return 10u; }
            case 7u: { if x > 3u { break; } return 20u; }
            default: { return 30u; }
        }
        return 40u;
    }";
    let body = "atomicStore(&result[0], pick(2u)); atomicStore(&result[1], pick(7u));
        atomicStore(&result[2], pick(9u));";
    gives(functions, body, &[10, 40, 30]);
}

#[test]
fn pointers_reach_members_elements_and_variables_of_callers() {
    let functions = "
        struct Inner { a: vec3<u32>, b: array<u32, 3> }
        struct Outer { x: u32, inner: Inner }
        var<private> shared_one: Outer;
        fn change(outer: ptr<function, Outer>, at: u32) {
            (*outer).inner.b[at] += 5u;
            (*outer).inner.a.y = 9u;
            (*outer).inner.a[2] = at;
        }";
    let body = "
        var outer = Outer(1u, Inner(vec3<u32>(2u), array<u32, 3>(3u, 4u, 5u)));
        change(&outer, 2u);
        let copied = outer.inner;
        change(&outer, 1u);
        atomicStore(&result[0], copied.b[2] * 100u + copied.b[1]);
        atomicStore(&result[1], outer.inner.b[1]);
        atomicStore(&result[2], copied.a.y * 10u + copied.a.z);
        shared_one.inner.b[copied.a.z] = 77u;
        atomicStore(&result[3], shared_one.inner.b[2] + shared_one.x);
        var table = array<vec2<u32>, 2>(vec2<u32>(1u, 2u), vec2<u32>(3u, 4u));
        atomicStore(&result[4], table[outer.x].x);";
    gives(functions, body, &[1004, 9, 92, 77, 3]);
}

#[test]
fn buffers_are_read_where_their_types_lie() {
    let body = "
        let second = input[1];
        atomicStore(&result[0], second.x * 1000u + second.w);
        let index = second.y - 3u;
        atomicStore(&result[1], input[index][3]);
        atomicStore(&result[2], arrayLength(&input));
        let before = atomicAdd(&result[2], 6u);
        atomicStore(&result[3], before);
        atomicMax(&result[3], 2u);
        atomicSub(&result[2], 1u);
        atomicStore(&result[4], atomicExchange(&result[3], 8u) + atomicLoad(&result[3]));";
    gives("", body, &[4007, 11, 9, 8, 12]);
}

#[test]
fn vectors_and_matrices_work_by_component() {
    let body = "
        let v = vec3<f32>(1.0, 2.0, 3.0);
        let m = mat2x2<f32>(1.0, 2.0, 3.0, 4.0);
        let product = m * vec2<f32>(5.0, 6.0);
        atomicStore(&result[0], u32(dot(v.zyx * 2.0, v)));
        atomicStore(&result[1], u32(product.x) * 100u + u32(product.y));
        atomicStore(&result[2], select(1u, 2u, all(v > vec3<f32>(0.5))));
        atomicStore(&result[3], select(1u, 2u, any(v > vec3<f32>(5.0))));
        let picked = select(v, vec3<f32>(9.0), vec3<bool>(false, true, false));
        atomicStore(&result[4], u32(picked.x + 10.0 * picked.y + 100.0 * picked.z));
        atomicStore(&result[5], bitcast<u32>(-v.x));
        atomicStore(&result[6], (vec3<u32>(1u) << vec3<u32>(0u, 4u, 8u)).y);";
    let minus = (-1f32).to_bits();
    gives("", body, &[20, 2334, 2, 1, 391, minus, 16]);
}

#[test]
fn a_word_is_claimed_once() {
    let body = "
        let first = atomicCompareExchangeWeak(&result[0], 0u, 7u);
        let second = atomicCompareExchangeWeak(&result[0], 0u, 9u);
        atomicStore(&result[1], first.old_value);
        atomicStore(&result[2], select(5u, 6u, first.exchanged));
        atomicStore(&result[3], second.old_value);
        atomicStore(&result[4], select(5u, 6u, second.exchanged));";
    gives("", body, &[7, 0, 6, 7, 5]);
    let other = code("", "let x = atomicCompareExchangeWeak(&result[0], 1u, 7u);");
    assert!(other.is_err_and(|error| error.to_string().contains("but with 0")));
}

#[test]
fn a_double_keeps_what_a_single_rounds_away() {
    let body = "
        let small = bitcast<f32>(input[0].x);
        let sum = (1.0 + small) - 1.0;
        atomicStore(&result[0], select(0u, 1u, sum > 0.0));
        let carried = bitcast<f32>(bitcast<u32>(1.0 + small)) - 1.0;
        atomicStore(&result[1], select(0u, 1u, carried > 0.0));";
    let input = [1e-9f32.to_bits(), 0, 0, 0];
    let single = run::<f32>("", body, &input).expect("it runs");
    let double = run::<f64>("", body, &input).expect("it runs");
    assert_eq!(
        (single[..2].to_vec(), double[..2].to_vec()),
        (vec![0, 0], vec![1, 1])
    );
}

#[test]
fn what_goes_too_far_is_an_error_that_says_so() {
    let fails = |functions: &str, body: &str| {
        let error = run::<f32>(functions, body, &[1 << 20, 0, 0, 0]).expect_err("it fails");
        error.to_string()
    };
    let text = fails(
        "",
        "loop { atomicAdd(&result[0], 1u); if input[0].y == 1u { break; } }",
    );
    assert!(text.contains("does not end within 10000 steps"), "{text}");
    let text = fails(
        "fn far() -> u32 { return input[input[0].x].x; }",
        "atomicStore(&result[0], far());",
    );
    assert!(text.contains("`far`") && text.contains("`input`"), "{text}");
    let text = fails(
        "",
        "var a = array<u32, 2>(1u, 2u); atomicStore(&result[0], a[input[0].x]);",
    );
    assert!(text.contains("an array"), "{text}");
    let text = fails(
        "",
        "let e = frexp(1.5 + f32(input[0].x)); atomicStore(&result[0], u32(e.fract));",
    );
    assert!(text.contains("Frexp"), "{text}");
}
