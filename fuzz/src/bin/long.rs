//! Measures the compiler on long sources: `long SHAPE BYTES` prints what checking, compiling and
//! formatting one takes, `long` lists the shapes, and `long SHAPE BYTES write` writes the source.
//! `long all` measures every shape at the greatest length of a source.

use std::io::Write;
use std::process::ExitCode;

use impasto_compiler::format::format;
use impasto_compiler::source::{FileId, MAX_SOURCE_BYTES};
use impasto_compiler::stages::{Progress, Stage};
use impasto_compiler::{MaterialRequest, MemoryLoader, check, compile_with_progress, diag};
use impasto_fuzz::{Stopwatch, sources};

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let mut out = std::io::stdout().lock();
    let written = match args.as_slice() {
        [all] if all == "all" => sources::SHAPES
            .iter()
            .try_for_each(|s| write!(out, "{}: {}", s.name, measured(&s.source(MAX_SOURCE_BYTES)))),
        [] => sources::SHAPES
            .iter()
            .try_for_each(|s| writeln!(out, "{}", s.name)),
        [name, bytes, rest @ ..] => {
            let Some((shape, bytes)) = sources::shape(name).zip(bytes.parse().ok()) else {
                eprintln!("no shape `{name}`, or no number of bytes; `long` lists the shapes");
                return 2.into();
            };
            let source = shape.source(bytes);
            match rest {
                [] => out.write_all(measured(&source).as_bytes()),
                _ => out.write_all(source.as_bytes()),
            }
        }
        [_] => {
            eprintln!("write `long`, `long all`, or `long SHAPE BYTES`");
            return 2.into();
        }
    };
    u8::from(written.is_err()).into()
}

/// What each command takes for a source, in seconds, with the stages of a compilation.
fn measured(source: &str) -> String {
    let mut files = MemoryLoader::default();
    files.add("m.impasto", source);
    let watch = Stopwatch::start();
    let checked = check("m.impasto", &mut files);
    let text = diag::render::text(&checked.sources, &checked.diagnostics, false);
    let check = watch.elapsed().as_secs_f64();
    let errors = checked.diagnostics.iter().filter(|d| d.is_error()).count();
    let first = checked.diagnostics.iter().find(|d| d.is_error());
    let first = first.map_or(String::new(), |d| {
        format!("  {}: {:.60}", d.code.id(), d.message)
    });
    let requests = checked.materials.iter().map(|name| MaterialRequest {
        material: Some(name.clone()),
        ..MaterialRequest::new(name, "m.impasto")
    });
    let requests: Vec<MaterialRequest> = requests.collect();
    let mut spent: Vec<(Stage, f64)> = Vec::new();
    let mut watch = Stopwatch::start();
    let mut now = Stage::Read;
    let mut listener = |stage| {
        spent.push((
            std::mem::replace(&mut now, stage),
            watch.elapsed().as_secs_f64(),
        ));
        watch = Stopwatch::start();
    };
    let mut all = Stopwatch::start();
    let mut emit = 0.0;
    if errors == 0 {
        let compiled = compile_with_progress(&requests, &mut files, Progress::to(&mut listener));
        let program = compiled
            .program
            .map(|p| p.wgsl(&(0..p.compiled().len()).collect::<Vec<_>>()));
        drop(program);
        emit = all.elapsed().as_secs_f64();
    }
    spent.push((now, watch.elapsed().as_secs_f64()));
    all = Stopwatch::start();
    let formatted = format(FileId(0), source);
    let fmt = all.elapsed().as_secs_f64();
    let stages = Stage::ALL.into_iter().map(|stage| {
        let time: f64 = spent
            .iter()
            .filter(|(s, _)| *s == stage)
            .map(|(_, t)| t)
            .sum();
        match time {
            t if t < 0.05 => String::new(),
            t => format!(" {} {t:.2}", stage.name()),
        }
    });
    let stages: String = stages.collect();
    format!(
        "{} bytes: check {check:.2}, emit {emit:.2} ({}), fmt {fmt:.2}{}; {errors} errors of {}, {} bytes of text{first}\n",
        source.len(),
        stages.trim(),
        if formatted.is_ok() { "" } else { " (refused)" },
        checked.diagnostics.len(),
        text.len(),
    )
}
