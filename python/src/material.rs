//! Material files: what is wrong with them, what they declare, stages of their compilation, and what they cost.

use impasto::compiler::diag::{self, Code};
use impasto::compiler::inspect::{self as at_point, Precision, Query};
use impasto::compiler::parser;
use impasto::compiler::source::SourceMap;
use impasto::compiler::{self, Loader, MaterialRequest, Parameters, codegen, lexer};
use impasto::cost::anywhere;
use impasto::runtime::world::texture;
use impasto::{docs, ir_text};
use pyo3::prelude::*;
use serde_json::{Value, json};

use crate::error::Failure;
use crate::process;
use crate::scene::{Scene, working_directory};
use crate::source::{self, Sources, Texts};

fn loader<'t>(texts: &'t Texts) -> Sources<'t> {
    Sources::new(texts, working_directory())
}

fn parsed(text: &str) -> Vec<Value> {
    serde_json::from_str(text).unwrap_or_default()
}

/// Every diagnostic of a material file, or of a scene with all that it names: as JSON, and as a terminal shows them.
#[pyfunction]
#[pyo3(signature = (file, texts, scene))]
pub(crate) fn check(
    py: Python<'_>,
    file: String,
    texts: Texts,
    scene: Option<&Bound<'_, Scene>>,
) -> PyResult<(String, String)> {
    if let Some(scene) = scene {
        let scene = scene.get();
        return process::run(py, None, |_| of_scene(scene));
    }
    process::run(py, None, |_| {
        let mut loader = loader(&texts);
        loader.check(&file)?;
        let checked = compiler::check(&file, &mut loader);
        Ok(told(&checked.sources, &checked.diagnostics))
    })
}

fn told(sources: &SourceMap, diagnostics: &[diag::Diagnostic]) -> (String, String) {
    let text = diag::render::text(sources, diagnostics, false);
    (diag::render::json(sources, diagnostics), text)
}

fn of_scene(scene: &Scene) -> Result<(String, String), Failure> {
    let (mut found, mut text) = (Vec::new(), String::new());
    let (scene, compiled) = scene.checked()?;
    for warning in &scene.warnings {
        found.push(impasto::error::scene_warning(&scene.name, warning));
        text += &format!("warning: {}: {warning}\n", scene.name);
    }
    let (materials, shown) = told(&compiled.sources, &compiled.diagnostics);
    found.extend(parsed(&materials));
    text += &shown;
    if let Some(program) = &compiled.program {
        let checked = texture::check(&program.textures(), &scene.base);
        if let Err(error) = checked.map_err(|e| texture::named(e, &scene)) {
            found.push(impasto::error::scene_diagnostic(&error));
            text += &format!("error: {error}\n");
        }
    }
    Ok((json!(found).to_string(), text))
}

/// The materials that a file declares, with their parameters: docs/params.md, as JSON.
#[pyfunction]
pub(crate) fn interface(py: Python<'_>, file: String, texts: Texts) -> PyResult<String> {
    process::run(py, None, |_| {
        let mut loader = loader(&texts);
        loader.check(&file)?;
        let found = compiler::interface::interface(&file, &mut loader);
        if diag::has_errors(&found.diagnostics) {
            return Err(Failure::sources(&found.sources, &found.diagnostics));
        }
        Ok(json!(found.materials).to_string())
    })
}

/// A stage of the compilation of a file, as `impasto emit` prints it.
#[pyfunction]
#[pyo3(signature = (file, texts, what, item, target, table, params))]
#[allow(clippy::too_many_arguments)]
pub(crate) fn emit(
    py: Python<'_>,
    file: String,
    texts: Texts,
    what: String,
    item: Option<String>,
    target: &str,
    table: bool,
    params: source::Values<'_>,
) -> PyResult<String> {
    let target = match target {
        "native" => codegen::Target::Native,
        "webgpu" => codegen::Target::WebGpu,
        _ => {
            let message = format!("there is no target `{target}`; the targets are native, webgpu");
            return Err(Failure::Value(message).into_exception(py));
        }
    };
    let params = source::values(&params)?;
    process::run(py, None, |control| {
        let mut loader = loader(&texts);
        loader.check(&file)?;
        let names = match &item {
            Some(name) => vec![name.clone()],
            None => compiler::check(&file, &mut loader).materials,
        };
        let request = |name: String| MaterialRequest {
            material: Some(name.clone()),
            parameters: if table {
                Parameters::Table
            } else {
                Parameters::Agreed
            },
            apart: true,
            params: params.clone(),
            ..MaterialRequest::new(name, &file)
        };
        let mut requests: Vec<MaterialRequest> = names.into_iter().map(request).collect();
        if requests.is_empty() {
            // The compiler knows what to say of a file without a material.
            requests.push(MaterialRequest::new("material", &file));
        }
        let stop = || control.is_stopped();
        match what.as_str() {
            "tokens" | "ast" | "docs" => syntax(&file, &what, &mut loader),
            "ir" => {
                let only = item.as_deref();
                if only.is_some() {
                    source::compile(&requests, &mut loader, false, &stop)?;
                }
                let checked = compiler::check(&file, &mut loader);
                if diag::has_errors(&checked.diagnostics) {
                    return Err(Failure::sources(&checked.sources, &checked.diagnostics));
                }
                Ok(ir_text(&checked, &file, only))
            }
            "wgsl" => {
                let program = source::compile(&requests, &mut loader, false, &stop)?;
                Ok(program.complete_wgsl(target))
            }
            _ => Err(Failure::Value(format!(
                "there is no stage `{what}`; the stages are tokens, ast, ir, wgsl, docs"
            ))),
        }
    })
}

fn syntax(file: &str, what: &str, loader: &mut Sources<'_>) -> Result<String, Failure> {
    let mut sources = SourceMap::default();
    let bytes = loader.load(file).map_err(Failure::File)?;
    let text = lexer::decode(file, &bytes);
    let text = text.map_err(|diagnostic| Failure::sources(&sources, &[diagnostic]))?;
    let id = sources.add(file, text.as_str());
    let (shown, diagnostics) = if what == "tokens" {
        let (tokens, diagnostics) = lexer::lex(id, &text);
        (lexer::listing(&text, &tokens), diagnostics)
    } else {
        let (module, diagnostics) = parser::parse(id, &text);
        let shown = match what {
            "docs" => format!("{:#}\n", json!(docs::docs(&module, &text))),
            _ => parser::print(&module),
        };
        (shown, diagnostics)
    };
    if diag::has_errors(&diagnostics) {
        return Err(Failure::sources(&sources, &diagnostics));
    }
    Ok(shown)
}

/// What evaluating the materials of a file costs, as JSON.
#[pyfunction]
#[pyo3(signature = (file, texts, item, samples, params))]
pub(crate) fn cost_of_file(
    py: Python<'_>,
    file: String,
    texts: Texts,
    item: Option<String>,
    samples: usize,
    params: source::Values<'_>,
) -> PyResult<String> {
    let params = source::values(&params)?;
    process::run(py, None, |control| {
        let mut loader = loader(&texts);
        loader.check(&file)?;
        let names = match item {
            Some(name) => vec![name],
            None => compiler::check(&file, &mut loader).materials,
        };
        let request = |name: String| MaterialRequest {
            material: Some(name.clone()),
            apart: true,
            params: params.clone(),
            ..MaterialRequest::new(name, &file)
        };
        let mut requests: Vec<MaterialRequest> = names.into_iter().map(request).collect();
        if requests.is_empty() {
            requests.push(MaterialRequest::new(&file, &file));
        }
        let stop = || control.is_stopped();
        let program = source::compile(&requests, &mut loader, false, &stop)?;
        Ok(json!(anywhere(&program, samples)).to_string())
    })
}

/// What a file defines, evaluated at one point in double and in single precision, as JSON of docs/eval.md.
#[pyfunction]
#[pyo3(signature = (file, texts, item, params, at))]
pub(crate) fn inspect(
    py: Python<'_>,
    file: String,
    texts: Texts,
    item: Option<String>,
    params: Vec<(String, String)>,
    at: String,
) -> PyResult<String> {
    process::run(py, None, |_| {
        let query = Query {
            file: file.clone(),
            item,
            params,
            at: at.parse().map_err(Failure::Value)?,
            precisions: vec![Precision::F64, Precision::F32],
        };
        let mut loader = loader(&texts);
        let found = at_point::inspect(&query, &mut loader);
        let found = found.map_err(|why| Failure::File(format!("cannot read `{file}`: {why}")))?;
        if diag::has_errors(&found.diagnostics) {
            return Err(Failure::sources(&found.sources, &found.diagnostics));
        }
        Ok(json!({
            "file": file,
            "at": query.at,
            "answers": found.answers,
            "skipped": found.skipped,
            "diagnostics": parsed(&diag::render::json(&found.sources, &found.diagnostics)),
        })
        .to_string())
    })
}

/// Title, explanation and example of a diagnostic.
#[pyfunction]
pub(crate) fn explain(code: &str) -> Option<(String, String, String)> {
    let code = Code::from_id(code)?;
    Some((
        code.id().into(),
        code.title().into(),
        code.explanation().into(),
    ))
}
