//! `impasto emit`: what the compiler makes of a file, at any stage.

use std::path::Path;

use clap::builder::PossibleValuesParser;
use clap::{Args, ValueEnum, ValueHint};
use impasto::compiler::codegen::Target;
use impasto::compiler::interface::{self, MaterialInterface};
use impasto::compiler::ir;
use impasto::compiler::passes::PIPELINE;
use impasto::compiler::source::SourceMap;
use impasto::compiler::{self, Loader, MaterialRequest, Parameters, diag, lexer, parser};
use impasto::{FileLoader, Program};
use impasto::{docs, files};
use serde::Serialize;

use super::{Failure, Global, Outcome, print};

#[derive(Args)]
pub(super) struct EmitArgs {
    /// A material file or module of the library, such as `std::bsdf::diffuse`; `-` is standard input
    #[arg(value_hint = ValueHint::FilePath)]
    file: String,
    /// Which stage to print
    #[arg(long, default_value = "wgsl")]
    what: What,
    /// Only this material of the file, with IR, WGSL and parameters; by default all of them
    #[arg(long, value_name = "NAME")]
    material: Option<String>,
    /// With `--what ir`: materials after the first run of the passes up to this one; from `lowering`
    /// on, their evaluate functions
    #[arg(long, value_name = "PASS", value_parser = passes())]
    after: Option<String>,
    /// What the WGSL is for
    #[arg(long, default_value = "native")]
    target: TargetName,
    /// Keep parameters in a table, as for instances with different values, instead of using their
    /// defaults
    #[arg(long)]
    table: bool,
    /// Where to write it; `-` is standard output
    #[arg(short, long, value_name = "FILE", default_value = "-", value_hint = ValueHint::FilePath)]
    out: String,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum What {
    /// The tokens, one a line with its place
    Tokens,
    /// The syntax tree
    Ast,
    /// The typed intermediate representation
    Ir,
    /// The generated WGSL
    Wgsl,
    /// Its materials' parameters as JSON, for user interfaces (docs/params.md)
    Params,
    /// Doc comments and signatures of all definitions, as JSON
    Docs,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum TargetName {
    /// The renderer, and other users of wgpu
    Native,
    /// WebGPU in a browser: a module of its own, with its textures as bindings
    Webgpu,
}

impl From<TargetName> for Target {
    fn from(name: TargetName) -> Self {
        match name {
            TargetName::Native => Target::Native,
            TargetName::Webgpu => Target::WebGpu,
        }
    }
}

/// What `--after` takes: the passes, each once.
fn passes() -> PossibleValuesParser {
    let mut names = Vec::new();
    for pass in PIPELINE {
        if !names.contains(&pass.name) {
            names.push(pass.name);
        }
    }
    PossibleValuesParser::new(names)
}

pub(super) fn run(args: &EmitArgs, global: &Global) -> Outcome {
    let to_stdout = args.out == files::STDIN;
    if !to_stdout {
        files::check_writable(Path::new(&args.out))?;
    }
    let text = emitted(args, global)?;
    if to_stdout {
        print(&text)
    } else {
        Ok(files::write_whole(Path::new(&args.out), text.as_bytes())?)
    }
}

/// The text of the stage that was asked for.
fn emitted(args: &EmitArgs, global: &Global) -> Result<String, Failure> {
    let mut loader = FileLoader::new("");
    let bytes = loader
        .load(&args.file)
        .map_err(|message| format!("cannot read `{}`: {message}", args.file))?;
    match (args.what, &args.after) {
        (What::Ir, Some(pass)) => after(args, pass, &mut loader, global),
        (_, Some(_)) => Err(Failure::Error("`--after` goes with `--what ir`".into())),
        (What::Tokens | What::Ast | What::Docs, None) => syntax(args, &bytes, global),
        (What::Ir, None) => ir(args, &mut loader, global),
        (What::Wgsl, None) => wgsl(args, &mut loader, global),
        (What::Params, None) => params(args, &mut loader, global),
    }
}

/// Tokens, tree or docs, which need nothing but the text.
fn syntax(args: &EmitArgs, bytes: &[u8], global: &Global) -> Result<String, Failure> {
    let mut sources = SourceMap::default();
    let text = match lexer::decode(&args.file, bytes) {
        Ok(text) => text,
        Err(diagnostic) => {
            global.report(&sources, &[diagnostic]);
            return Err(Failure::Diagnostics);
        }
    };
    let file = sources.add(&args.file, text.as_str());
    let (shown, diagnostics) = match args.what {
        What::Tokens => {
            let (tokens, diagnostics) = lexer::lex(file, &text);
            (lexer::listing(&text, &tokens), diagnostics)
        }
        what => {
            let (module, diagnostics) = parser::parse(file, &text);
            let shown = match what {
                What::Docs => format!("{:#}\n", serde_json::json!(docs::docs(&module, &text))),
                _ => parser::print(&module),
            };
            (shown, diagnostics)
        }
    };
    global.report(&sources, &diagnostics);
    if diag::has_errors(&diagnostics) {
        Err(Failure::Diagnostics)
    } else {
        Ok(shown)
    }
}

/// The IR of what the file defines and of what that reaches.
fn ir(args: &EmitArgs, loader: &mut FileLoader, global: &Global) -> Result<String, Failure> {
    let only = args.material.as_deref();
    if only.is_some() {
        compiled(args, loader, global)?;
    }
    let checked = compiler::check(&args.file, loader);
    if only.is_none() {
        global.report(&checked.sources, &checked.diagnostics);
    }
    if diag::has_errors(&checked.diagnostics) {
        Err(Failure::Diagnostics)
    } else {
        Ok(impasto::ir_text(&checked, &args.file, only))
    }
}

/// What a pass leaves of one material, or of all that the file defines: its evaluate function, or
/// before there is one the material.
fn after(
    args: &EmitArgs,
    pass: &str,
    loader: &mut FileLoader,
    global: &Global,
) -> Result<String, Failure> {
    compiled(args, loader, global)?;
    let mut texts = Vec::new();
    let requests = requests(args, loader);
    compiler::after_pass(&requests, loader, pass, |module, state| {
        texts.push(match state.functions.first() {
            Some(f) => ir::print::function(module, f),
            None => ir::print::material(module, &state.material),
        });
    });
    Ok(texts.join("\n"))
}

/// The WGSL of one material, or of all that the file defines.
fn wgsl(args: &EmitArgs, loader: &mut FileLoader, global: &Global) -> Result<String, Failure> {
    let program = compiled(args, loader, global)?;
    Ok(program.complete_wgsl(args.target.into()))
}

/// What user interfaces are told of one material, or of all that the file defines.
fn params(args: &EmitArgs, loader: &mut FileLoader, global: &Global) -> Result<String, Failure> {
    let found = interface::interface(&args.file, loader);
    global.report(&found.sources, &found.diagnostics);
    if diag::has_errors(&found.diagnostics) {
        return Err(Failure::Diagnostics);
    }
    let mut materials = found.materials;
    if let Some(name) = &args.material {
        materials.retain(|m| m.name == *name);
    }
    if materials.is_empty() {
        // The compiler knows what to say of a material that is not there.
        compiled(args, loader, global)?;
    }
    let told = Told {
        version: interface::VERSION,
        file: &args.file,
        materials,
    };
    // Written from the types, not through a value: numbers are as short as they can be, and fields
    // in the order of the page that describes them.
    let text = serde_json::to_string_pretty(&told).map_err(|e| e.to_string())?;
    Ok(text + "\n")
}

/// What `--what params` prints.
#[derive(Serialize)]
struct Told<'a> {
    version: u32,
    file: &'a str,
    materials: Vec<MaterialInterface>,
}

fn compiled(args: &EmitArgs, loader: &mut FileLoader, global: &Global) -> Result<Program, Failure> {
    let requests = requests(args, loader);
    let compiled = compiler::compile(&requests, loader);
    global.report(&compiled.sources, &compiled.diagnostics);
    compiled.program.ok_or(Failure::Diagnostics)
}

/// A request for each material to print. A file without any is asked for its material all the
/// same: the compiler knows what to say.
fn requests(args: &EmitArgs, loader: &mut FileLoader) -> Vec<MaterialRequest> {
    let parameters = if args.table {
        Parameters::Table
    } else {
        Parameters::Agreed
    };
    let request = |name: &str, material| MaterialRequest {
        material,
        parameters,
        apart: true,
        ..MaterialRequest::new(name, &args.file)
    };
    if let Some(name) = &args.material {
        return vec![request(name, Some(name.clone()))];
    }
    let names = compiler::check(&args.file, loader).materials;
    if names.is_empty() {
        vec![request("material", None)]
    } else {
        names.iter().map(|n| request(n, Some(n.clone()))).collect()
    }
}
