//! What is run on an input: the compiler from end to end, and the IR's text with all passes.

use impasto_compiler::format::{Unformatted, format};
use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::parse::parse;
use impasto_compiler::ir::value::Value;
use impasto_compiler::ir::{Const, ExprKind, Function, Module, Type, print, verify};
use impasto_compiler::passes;
use impasto_compiler::source::FileId;
use impasto_compiler::{Checked, MaterialRequest, MemoryLoader, check, compile, diag};

/// Takes any bytes; panics if they show a fault.
pub type Target = fn(&[u8]);

/// Expressions that the interpreter may evaluate for a function.
const FUEL: u64 = 1 << 16;

/// Compiles a source, as `impasto check` and as a scene do, renders its diagnostics, and runs what
/// came out.
pub fn source(input: &[u8]) {
    let mut files = MemoryLoader::default();
    files.add("m.impasto", input);
    let (checked, text) = checked(&mut files);
    let internal = checked
        .diagnostics
        .iter()
        .find(|d| d.code.id().starts_with("E09"));
    assert!(internal.is_none(), "{text}");
    if diag::has_errors(&checked.diagnostics) {
        return;
    }
    let Some(name) = checked.materials.first() else {
        return;
    };
    let request = MaterialRequest {
        material: Some(name.clone()),
        ..MaterialRequest::new("m", "m.impasto")
    };
    let compiled = compile(&[request], &mut files);
    let Some(program) = compiled.program else {
        return;
    };
    for m in program.compiled() {
        execute(program.ir(), &m.evaluate, &[], &[]);
    }
}

/// Checks `m.impasto`; also its diagnostics as text.
fn checked(files: &mut MemoryLoader) -> (Checked, String) {
    let checked = check("m.impasto", files);
    let text = diag::render::text(&checked.sources, &checked.diagnostics, false);
    let failed = diag::has_errors(&checked.diagnostics);
    assert!(!failed || !text.is_empty(), "an error without words");
    (checked, text)
}

/// Checks a source and formats it, as `impasto check` and `impasto fmt` do.
pub fn checked_and_formatted(input: &[u8]) {
    let mut files = MemoryLoader::default();
    files.add("m.impasto", input);
    checked(&mut files);
    if let Ok(text) = std::str::from_utf8(input)
        && let Err(Unformatted::Lost) = format(FileId(0), text)
    {
        panic!("formatting loses something");
    }
}

/// Reads IR, prints it, runs the passes and what they made of it.
pub fn ir(input: &[u8]) {
    let text = String::from_utf8_lossy(input);
    let Ok(parsed) = parse(FileId(0), &text) else {
        return;
    };
    let printed = print::module(&parsed.module, &parsed.materials);
    match parse(FileId(0), &printed) {
        Ok(again) => {
            let again = print::module(&again.module, &again.materials);
            assert!(
                again == printed,
                "the text changes when it is read and printed again"
            );
        }
        Err(e) => panic!("what was printed cannot be read: {e}"),
    }
    let mut module = parsed.module;
    for i in 0..module.functions.len() {
        let mut f = module.functions[i].clone();
        let params = params(&f);
        execute(&module, &f, &params, &[]);
        passes::run(&module, &mut f);
        execute(&module, &f, &params, &[]);
        module.functions[i] = f.clone();
        let was_hoisted_from = f.reads_table();
        let hoist = passes::pass("hoist").expect("a row");
        let hoisted = hoist.run(&module, &mut f).expect("values");
        well_formed(if was_hoisted_from {
            verify::function(&module, &f)
        } else {
            verify::hoisted(&module, &f, &hoisted.types())
        });
        well_formed(verify::function(&module, &hoisted.prelude));
        if let Ok(values) = hoisted.evaluate(&module, &params) {
            execute(&module, &f, &params, &values);
        }
    }
    for mut m in parsed.materials {
        for name in ["fold_body", "prune"] {
            let pass = passes::pass(name).expect("a row");
            pass.run_on_material(&module, &mut m, &[])
                .expect("no problem");
        }
        well_formed(verify::material(&module, &m));
    }
}

fn well_formed(result: Result<(), verify::Problem>) {
    if let Err(problem) = result {
        panic!("{problem}");
    }
}

/// Runs a function on zeros.
fn execute(module: &Module, f: &Function, params: &[Const], table: &[Const]) {
    let args = f.params.iter();
    let args = args.map(|p| Value::zero(p.ty, &module.structs)).collect();
    let run = Interpreter::<f64>::new(module, FUEL);
    let mut run = run.with_params(params).with_table(table);
    let _ = run.run(f, args);
}

/// Zeros for the parameters of its material that a function mentions.
fn params(f: &Function) -> Vec<Const> {
    let mut out: Vec<Const> = Vec::new();
    for e in &f.exprs {
        if let ExprKind::MaterialParam(i) = e.kind {
            let i = i as usize;
            out.resize(out.len().max(i + 1), Const::Bool(false));
            out[i] = zero(e.ty);
        }
    }
    out
}

fn zero(ty: Type) -> Const {
    match ty {
        Type::Bool => Const::Bool(false),
        Type::Int => Const::Int(0),
        _ => Const::Float(vec![0.0; ty.width().unwrap_or(1)]),
    }
}
