//! Walks the whole models of the library, and compiles them with parameters set. What they promise is held in `held`.

use impasto_compiler::ast::ItemKind;
use impasto_compiler::source::FileId;
use impasto_compiler::{MaterialRequest, MemoryLoader, Parameters, Program, compile, diag, parser};
use impasto_verify::drawn::{Setting, values};

/// A model of the library.
struct Model {
    name: String,
    text: &'static str,
}

/// Every model of `std::surface`.
fn models() -> Vec<Model> {
    let files = impasto_stdlib::folder("surface");
    let models: Vec<Model> = files.filter_map(|f| model(f.name, f.text)).collect();
    assert!(models.len() >= 4, "only {} models", models.len());
    models
}

/// The material that a file defines under its own name, if it does.
fn model(name: &str, text: &'static str) -> Option<Model> {
    let (ast, _) = parser::parse(FileId(0), text);
    let item = ast.items.iter().find(|i| i.name.node == name)?;
    matches!(item.kind, ItemKind::Material(_)).then(|| Model {
        name: name.to_owned(),
        text,
    })
}

/// A model with some parameters set, as constants.
pub fn set(name: &str, params: &[Setting]) -> Program {
    let file = impasto_stdlib::file("surface", name);
    let text = file
        .unwrap_or_else(|| panic!("no std::surface::{name}"))
        .text;
    let mut files = MemoryLoader::default();
    files.add("model.impasto", text);
    let request = MaterialRequest {
        params: values(params),
        parameters: Parameters::Baked,
        ..MaterialRequest::new("m", "model.impasto")
    };
    let compiled = compile(&[request], &mut files);
    let problems = diag::render::text(&compiled.sources, &compiled.diagnostics, false);
    assert!(problems.is_empty(), "{name} {params:?}:\n{problems}");
    compiled.program.expect("no problems")
}

#[test]
fn tables_and_constants_are_one_model() {
    for model in models() {
        let mut files = MemoryLoader::default();
        files.add("model.impasto", model.text);
        let request = MaterialRequest {
            parameters: Parameters::Table,
            ..MaterialRequest::new("m", "model.impasto")
        };
        let compiled = compile(&[request], &mut files);
        let problems = diag::render::text(&compiled.sources, &compiled.diagnostics, false);
        assert!(problems.is_empty(), "{}:\n{problems}", model.name);
    }
}
