//! Walks the whole models of the library: each with its defaults and with the settings that its
//! documentation asks to try (`Try: name = value, ...`). They are held to what materials are held to
//! (`materials`); here is what they promise of themselves: `Furnace: within 0.02 with name = value, ...`
//! says that with these all light is kept.

use impasto_compiler::ast::ItemKind;
use impasto_compiler::source::FileId;
use impasto_compiler::{MaterialRequest, MemoryLoader, Parameters, Program, compile, diag, parser};

use super::materials::{point, reflected};
use super::sampling::view;
use crate::common::record::effort;

/// A parameter and its value, as scenes write them.
pub type Setting = (String, String);

/// A model of the library with settings.
pub struct Surface {
    /// Its name.
    pub name: String,
    /// What it is called in messages.
    pub label: String,
    /// Compiled with these settings as constants.
    pub program: Program,
}

/// What the documentation of a model says.
struct Model {
    name: String,
    text: &'static str,
    /// Its doc comment, settings joined to lines of their own.
    lines: Vec<String>,
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
        lines: super::library::whole_lines(&item.docs),
    })
}

/// `name = value, ...`; commas within brackets are part of a value.
fn settings(line: &str) -> Vec<Setting> {
    let mut depth = 0;
    let mut parts = vec![String::new()];
    for c in line.chars() {
        depth += i32::from(c == '(') - i32::from(c == ')');
        match parts.last_mut() {
            Some(part) if c != ',' || depth > 0 => part.push(c),
            _ => parts.push(String::new()),
        }
    }
    let pair = |part: &String| {
        let (name, value) = part.split_once('=').expect("`name = value, ...`");
        (name.trim().to_owned(), value.trim().to_owned())
    };
    parts.iter().map(pair).collect()
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
        params: params
            .iter()
            .map(|(n, v)| (n.clone(), v.as_str().into()))
            .collect(),
        parameters: Parameters::Baked,
        ..MaterialRequest::new("m", "model.impasto")
    };
    let compiled = compile(&[request], &mut files);
    let problems = diag::render::text(&compiled.sources, &compiled.diagnostics, false);
    assert!(problems.is_empty(), "{name} {params:?}:\n{problems}");
    compiled.program.expect("no problems")
}

/// Every model with its defaults and with what it asks to try.
pub fn surfaces() -> Vec<Surface> {
    let mut all = Vec::new();
    for model in models() {
        let tried = model.lines.iter().filter_map(|l| l.strip_prefix("Try:"));
        let tried: Vec<Vec<Setting>> = tried.map(settings).collect();
        assert!(tried.len() >= 5, "{} asks to try little", model.name);
        for params in std::iter::once(Vec::new()).chain(tried) {
            all.push(Surface {
                label: format!("{} {params:?}", model.name),
                program: set(&model.name, &params),
                name: model.name.clone(),
            });
        }
    }
    all
}

#[test]
fn settings_are_read_with_their_brackets() {
    let read = settings(" a = color(0.1, 0.2, 0.3), b = 1 cm");
    let expected = [("a", "color(0.1, 0.2, 0.3)"), ("b", "1 cm")];
    assert_eq!(read, expected.map(|(n, v)| (n.to_owned(), v.to_owned())));
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

/// Angles from which a furnace is looked into.
const VIEWS: [f64; 4] = [0.0, 30.0, 60.0, 75.0];

#[test]
fn white_surfaces_keep_light() {
    let mut work = Vec::new();
    for model in models() {
        let promised = model
            .lines
            .iter()
            .filter_map(|l| l.strip_prefix("Furnace:"));
        let before = work.len();
        for line in promised {
            let (within, with) = line
                .trim()
                .strip_prefix("within ")
                .and_then(|l| l.split_once(" with "))
                .expect("`Furnace: within X with name = value, ...`");
            let within: f64 = within.parse().expect("a number");
            let params = settings(with);
            let label = format!("{} {params:?}", model.name);
            work.push((label, set(&model.name, &params), within));
        }
        assert!(work.len() > before, "{} promises nothing", model.name);
    }
    super::each_in_parallel(&work, |_, (label, program, within)| {
        let at = point([0.013, 0.024, 0.5], [0.3, 0.7]);
        let mut faults = Vec::new();
        for degrees in VIEWS {
            let kept = reflected(program, &at, view(degrees), effort(1 << 12, 1 << 16));
            // Sampling errs by less than a hundredth: weights are about one.
            let least = kept.iter().fold(f64::INFINITY, |a, &b| a.min(b));
            let most = kept.iter().fold(0.0f64, |a, &b| a.max(b));
            if least < 1.0 - within - 0.01 || most > 1.02 {
                faults.push(format!("keeps {kept:?} from {degrees} degrees"));
            }
        }
        (label.clone(), faults)
    });
}
