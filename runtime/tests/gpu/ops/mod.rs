//! Every op of the op table means the same on the GPU as in the interpreter, at every combination
//! of operand types that it takes, and at the edges that WGSL leaves undefined: `pow(0, 0)`,
//! `x / 0`, `mod(x, 0)`, `atan2(0, 0)`, `normalize(0)`, ints that overflow.
//!
//! The table is walked: an op that is added to it is asked for here. Each op is one kernel, a
//! `switch` over its combinations of types, with operands and results as raw words.

mod accuracy;
mod operands;

use impasto_compiler::ir::build::{Builder, const_type};
use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::ops::Op;
use impasto_compiler::ir::value::Value;
use impasto_compiler::ir::{Const, Function, Local, Type};
use impasto_compiler::source::{FileId, Span};
use impasto_compiler::{MaterialRequest, MemoryLoader, Program, codegen, compile};
use impasto_runtime::wgsl::ShaderPart;

use crate::support::{Row, run};

/// Types that operands have.
const TYPES: [Type; 7] = [
    Type::Bool,
    Type::Int,
    Type::Float,
    Type::Vec2,
    Type::Vec3,
    Type::Vec4,
    Type::Mat3,
];

/// Rows of an operand: the columns of a matrix; what is not one lies in the first.
const COLUMNS: usize = 3;

/// Rows of a question: its case, then the operands.
const ROWS: usize = 1 + 3 * COLUMNS;

/// A function that applies an op to its parameters.
struct Case {
    types: Vec<Type>,
    function: Function,
}

/// Operands for a case.
struct Question {
    case: usize,
    operands: Vec<Value<f32>>,
}

/// Is the op a lookup of an image? What those give is asked of whole renders.
fn is_lookup(op: Op) -> bool {
    op.texture_space().is_some()
}

/// The cases of an op: all combinations of types that it takes.
fn cases(op: Op) -> Vec<Case> {
    let mut combinations: Vec<Vec<Type>> = vec![Vec::new()];
    for _ in 0..op.arity() {
        let longer = |types: &Vec<Type>| TYPES.map(|ty| [types.as_slice(), &[ty]].concat());
        combinations = combinations.iter().flat_map(longer).collect();
    }
    combinations.retain(|types| op.result(types).is_some());
    let case = |(i, types): (usize, Vec<Type>)| Case {
        function: function(op, &format!("case_{i}"), &types),
        types,
    };
    combinations.into_iter().enumerate().map(case).collect()
}

fn function(op: Op, name: &str, types: &[Type]) -> Function {
    let span = Span::new(FileId(0), 0..0);
    let param = |(i, ty): (usize, &Type)| Local {
        name: format!("p{i}"),
        ty: *ty,
    };
    let params = types.iter().enumerate().map(param).collect();
    let mut builder = Builder::new(name, params, span);
    let args: Vec<_> = (0..types.len()).map(|i| builder.param(i, span)).collect();
    let value = builder.op(op, &args, span);
    builder.finish(value)
}

/// A program for the functions to be printed in.
fn program() -> Program {
    let mut files = MemoryLoader::default();
    let text = "use std::bsdf::diffuse;\nmaterial plain { surface = diffuse(0.5); }\n";
    files.add("plain.impasto", text);
    let compiled = compile(
        &[MaterialRequest::new("plain", "plain.impasto")],
        &mut files,
    );
    compiled.program.expect("it compiles")
}

/// The words of a question, for the kernel.
fn rows(question: &Question) -> Vec<Row> {
    let mut rows = vec![[0; 4]; ROWS];
    rows[0][0] = question.case as u32;
    for (value, rows) in question.operands.iter().zip(rows[1..].chunks_mut(COLUMNS)) {
        match value {
            Value::Mat3(columns) => {
                for (row, column) in rows.iter_mut().zip(columns) {
                    row[..3].copy_from_slice(&column.map(f32::to_bits));
                }
            }
            value => rows[0] = words(value),
        }
    }
    rows
}

/// The words of a value that is no matrix.
fn words(value: &Value<f32>) -> Row {
    let mut row = [0; 4];
    match value {
        Value::Bool(b) => row[0] = u32::from(*b),
        Value::Int(i) => row[0] = *i as u32,
        value => {
            let words = value.components().iter().map(|x| x.to_bits());
            row.iter_mut().zip(words).for_each(|(to, word)| *to = word);
        }
    }
    row
}

/// Operand `k` read from the rows at `at`, in WGSL.
fn read(k: usize, ty: Type) -> String {
    let row = |column: usize| format!("input[at + {}u]", 1 + COLUMNS * k + column);
    let letters = |n: usize| &"xyzw"[..n];
    match ty {
        Type::Bool => format!("({}.x != 0u)", row(0)),
        Type::Int => format!("bitcast<i32>({}.x)", row(0)),
        Type::Mat3 => {
            let columns = [0, 1, 2].map(|c| format!("bitcast<vec4f>({}).xyz", row(c)));
            format!("mat3x3f({})", columns.join(", "))
        }
        ty => format!(
            "bitcast<vec4f>({}).{}",
            row(0),
            letters(ty.width().unwrap_or(1))
        ),
    }
}

/// Writes the value `text` as the result of question `i`, in WGSL.
fn written(text: &str, ty: Type) -> String {
    let row = match ty {
        Type::Bool => "vec4u(u32(r))",
        Type::Int | Type::Float => "vec4u(bitcast<u32>(r))",
        Type::Vec2 => "bitcast<vec4u>(vec4f(r, 0.0, 0.0))",
        Type::Vec3 => "bitcast<vec4u>(vec4f(r, 0.0))",
        _ => "bitcast<vec4u>(r)",
    };
    let to = |column: usize| format!("result[{COLUMNS}u * i + {column}u]");
    let column = |c: usize| format!("{} = bitcast<vec4u>(vec4f(r[{c}], 0.0));", to(c));
    let writes = match ty {
        Type::Mat3 => [0, 1, 2].map(column).concat(),
        _ => format!("{} = {row};", to(0)),
    };
    format!("let r = {text}; {writes}")
}

/// The body of the kernel: calls the function of question `i`.
fn body(cases: &[Case]) -> String {
    let branch = |(i, case): (usize, &Case)| {
        let args = case.types.iter().enumerate().map(|(k, ty)| read(k, *ty));
        let args: Vec<String> = args.collect();
        let call = format!("{}({})", case.function.name, args.join(", "));
        let value = written(&call, case.function.result);
        format!("case {i}u: {{ {value} }}\n")
    };
    let branches: String = cases.iter().enumerate().map(branch).collect();
    format!("let at = i * {ROWS}u;\nswitch input[at].x {{\n{branches}default: {{}}\n}}")
}

/// What the GPU gives for the questions.
fn answers(program: &Program, cases: &[Case], questions: &[Question]) -> Vec<[Row; COLUMNS]> {
    let functions: Vec<Function> = cases.iter().map(|c| c.function.clone()).collect();
    let part = ShaderPart {
        wgsl: codegen::functions(program, &functions),
        buffers: Vec::new(),
    };
    let input: Vec<Row> = questions.iter().flat_map(rows).collect();
    let count = questions.len();
    let rows = run(&[&part], &body(cases), &input, count, COLUMNS * count);
    rows.as_chunks().0.to_vec()
}

/// Asks for all cases of an op; what is wrong.
fn problems(program: &Program, op: Op) -> Vec<String> {
    let cases = cases(op);
    let mut questions = Vec::new();
    for (case, c) in cases.iter().enumerate() {
        let of_case = operands::tuples(op, &c.types).into_iter();
        questions.extend(of_case.map(|operands| Question { case, operands }));
    }
    let mut interpreter = Interpreter::<f32>::new(program.ir(), u64::MAX);
    let mut wrong = Vec::new();
    for (q, rows) in questions.iter().zip(answers(program, &cases, &questions)) {
        let f = &cases[q.case].function;
        let mut expected = |operands: &[Value<f32>]| {
            let value = interpreter.run(f, operands.to_vec());
            value.expect("there is fuel")
        };
        let value = expected(&q.operands);
        if accuracy::agrees(op, &q.operands, rows, &value) {
            continue;
        }
        // A GPU may take numbers below the least normal one for zero.
        let flushed: Vec<Value<f32>> = q.operands.iter().map(operands::flushed).collect();
        if !accuracy::agrees(op, &flushed, rows, &expected(&flushed)) {
            let found = accuracy::shown(rows, f.result);
            wrong.push(format!(
                "{op:?} of {:?}: {found}, expected {value:?}",
                q.operands
            ));
        }
    }
    wrong
}

#[test]
fn every_op_is_on_the_gpu_what_it_is_in_the_interpreter() {
    let program = program();
    let mut wrong = Vec::new();
    for &op in Op::ALL.iter().filter(|op| !is_lookup(**op)) {
        let of_op = problems(&program, op);
        let more = of_op.len().saturating_sub(6);
        wrong.extend(of_op.into_iter().take(6));
        if more > 0 {
            wrong.push(format!("{op:?}: and {more} more"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_op_is_asked_for_at_all_its_operands() {
    let left_out: Vec<Op> = Op::ALL
        .iter()
        .copied()
        .filter(|op| is_lookup(*op))
        .collect();
    assert_eq!(left_out.len(), 6, "{left_out:?}");
    for &op in Op::ALL.iter().filter(|op| !is_lookup(**op)) {
        let cases = cases(op);
        assert!(!cases.is_empty(), "{op:?}");
        for case in cases {
            let questions = operands::tuples(op, &case.types).len();
            assert!(questions > 1, "{op:?} of {:?}", case.types);
        }
    }
}

/// Code for divisors that are known leaves the guard against zero out, but not where one component is zero.
#[test]
fn constant_divisors_divide_on_the_gpu_as_in_the_interpreter() {
    let span = Span::new(FileId(0), 0..0);
    let program = program();
    let vector = |v: [f64; 3]| Const::Float(v.to_vec());
    let divisors = [
        vector([2.0, 0.0, -4.0]),
        vector([0.0; 3]),
        vector([0.5, 3.0, -1.0]),
        // Zero in single precision.
        vector([1e-60, 1.0, 1e-60]),
        Const::Int(0),
        Const::Int(-1),
        Const::Int(7),
    ];
    let (mut cases, mut ops) = (Vec::new(), Vec::new());
    for divisor in &divisors {
        for op in [Op::Div, Op::Rem] {
            let ty = const_type(divisor);
            let param = Local {
                name: "x".into(),
                ty,
            };
            let name = format!("case_{}", cases.len());
            let mut builder = Builder::new(name, vec![param], span);
            let x = builder.param(0, span);
            let y = builder.constant(divisor.clone(), span);
            let value = builder.op(op, &[x, y], span);
            let function = builder.finish(value);
            let types = vec![ty];
            cases.push(Case { types, function });
            ops.push((op, Value::<f32>::constant(divisor)));
        }
    }
    let dividends = |ty: Type| match ty {
        Type::Int => [5, -9, i32::MIN].map(Value::Int).to_vec(),
        _ => [[1.0, -2.0, 3.5], [7.25, 1e30, -0.5]]
            .map(|v| Value::vector(&v))
            .to_vec(),
    };
    let of_case = |(case, c): (usize, &Case)| {
        let questions = dividends(c.types[0]).into_iter();
        questions.map(move |x| Question {
            case,
            operands: vec![x],
        })
    };
    let questions: Vec<Question> = cases.iter().enumerate().flat_map(of_case).collect();
    let mut interpreter = Interpreter::<f32>::new(program.ir(), u64::MAX);
    for (q, rows) in questions.iter().zip(answers(&program, &cases, &questions)) {
        let f = &cases[q.case].function;
        let value = interpreter.run(f, q.operands.clone()).expect("fuel");
        let (op, divisor) = &ops[q.case];
        let operands = [q.operands[0].clone(), divisor.clone()];
        let found = accuracy::shown(rows, f.result);
        assert!(
            accuracy::agrees(*op, &operands, rows, &value),
            "{op:?} of {operands:?}: {found}, expected {value:?}"
        );
    }
}
