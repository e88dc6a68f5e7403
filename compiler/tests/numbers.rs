//! Numbers of a source as data: code that was asked to hold for any numbers stays when one is edited, and computes
//! what the edited source says.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use impasto_compiler::lexer;
use impasto_compiler::source::FileId;
use impasto_compiler::{
    Loader, MaterialRequest, ParameterValue, Parameters, Program, compile, diag, with_values,
};

use crate::common::answered;

const PAINT: &str = "
use std::bsdf::{blinn_phong, diffuse, mirror};
const RED: color = srgb(0x8c1010);
fn wave(x: float) -> float = 0.5 + 0.25 * sin(3.0 * x);
fn waves(p: point) -> float {
    var sum = 0.125;
    for i in 0..3 {
        sum = sum + wave(p.x + 0.75) * exp(-0.5 * p.y);
    }
    clamp(sum + wave(p.z), 0.05, 0.95)
}
material paint {
    param tint: color = srgb(0x20ff40);
    param gloss: float = 40.0 in 1.0 .. 1000.0;
    let spots = waves(position) * wave(2.5);
    let coat = mirror(1.5);
    surface = layer(coat, 0.5 * spots * (blinn_phong(900) + blinn_phong(gloss)), diffuse(mix(RED, tint, 0.9) * color(0.4, 0.5, 0.6)));
}";

/// Files of the project, of which one may have another text.
struct Files<'a> {
    texts: BTreeMap<&'a str, &'a str>,
}

impl Loader for Files<'_> {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        match self.texts.get(path) {
            Some(text) => Ok((*text).into()),
            None => std::fs::read(path).map_err(|e| e.to_string()),
        }
    }
}

fn compiled(file: &str, text: &str, parameters: Parameters) -> Result<Program, String> {
    let request = MaterialRequest {
        parameters,
        ..MaterialRequest::new("m", file)
    };
    let mut files = Files {
        texts: [(file, text)].into(),
    };
    let compiled = compile(&[request], &mut files);
    let text = diag::render::text(&compiled.sources, &compiled.diagnostics, false);
    compiled.program.ok_or(text)
}

/// Everything but the table that a renderer sees of a program.
fn code(program: &Program) -> String {
    let infos = program.infos();
    format!("{} {infos:?}", program.wgsl(&[0]))
}

/// The numbers of a sample that say what is scattered of the light from a given direction.
const LIGHT: Range<usize> = 8..11;

/// What a material answers at a few points: every number of its samples.
fn answers(program: &Program) -> Vec<f64> {
    answered::samples(program, 0).concat()
}

#[track_caller]
fn assert_near(found: &[f64], expected: &[f64], what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}");
    for (a, b) in found.iter().zip(expected) {
        let most = 1e-6 * (1.0 + b.abs());
        assert!((a - b).abs() <= most, "{what}: {a} for {b}");
    }
}

/// The text with its floats other than 0 and 1, those of declarations of parameters apart, times `by`: all, or one of
/// them.
fn edited(text: &str, by: f64, only: Option<usize>) -> Option<String> {
    let (tokens, _) = lexer::lex(FileId(0), text);
    let declared = |at: usize| {
        let line = text[..at].rfind('\n').map_or(0, |end| end + 1);
        text[line..].trim_start().starts_with("param ")
    };
    let mut floats = tokens;
    floats.retain(|(token, span)| {
        let is_either = matches!(&text[span.range()], "0.0" | "1.0");
        token.kind_name() == "float" && !is_either && !declared(span.range().start)
    });
    let chosen = match only {
        Some(one) => floats.get(one..one + 1)?,
        None => &floats[..],
    };
    let mut out = text.to_owned();
    for (_, span) in chosen.iter().rev() {
        let number: f64 = text[span.range()].parse().ok()?;
        out.replace_range(span.range(), &format!("{:?}", number * by));
    }
    Some(out)
}

#[test]
fn editing_a_number_takes_no_other_code() {
    let open = |text: &str| compiled("paint", text, Parameters::Open).expect("compiles");
    let first = open(PAINT);
    let plain = |text: &str| compiled("paint", text, Parameters::Agreed).expect("compiles");
    assert_near(&answers(&first), &answers(&plain(PAINT)), "as it is");
    let mut edits = 0;
    while let Some(text) = edited(PAINT, 0.875, Some(edits)) {
        let next = open(&text);
        assert_eq!(code(&first), code(&next), "{text}");
        assert_ne!(first.tables(), next.tables(), "{text}");
        assert_near(&answers(&next), &answers(&plain(&text)), &text);
        edits += 1;
    }
    // Three of `wave`, five of `waves` and seven of the material.
    assert_eq!(edits, 15);
    // Ints that stand for floats count, and constants of the file; ints that are ints are code.
    for (from, to) in [("(900)", "(700)"), ("0x8c1010);\nfn", "0x20ff40);\nfn")] {
        let text = PAINT.replace(from, to);
        assert_ne!(text, PAINT);
        assert_eq!(code(&first), code(&open(&text)), "{to}");
    }
    let more = open(&PAINT.replace("0..3", "0..5"));
    assert_ne!(code(&first), code(&more));
}

#[test]
fn parameters_of_open_code_are_set_as_those_of_other_code() {
    let request = |gloss: f64| MaterialRequest {
        parameters: Parameters::Open,
        params: vec![("gloss".into(), ParameterValue::Float(gloss))],
        ..MaterialRequest::new("m", "paint")
    };
    let of = |gloss: f64| {
        let mut files = Files {
            texts: [("paint", PAINT)].into(),
        };
        compile(&[request(gloss)], &mut files)
            .program
            .expect("compiles")
    };
    let set = with_values(&of(40.0), &[request(90.0)]).ok().expect("fits");
    assert_eq!(set.tables(), of(90.0).tables());
    assert_eq!(code(&set), code(&of(90.0)));
}

/// Every material of the project, with all of its floats edited at once.
#[test]
fn numbers_of_all_materials_are_data() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../materials");
    let files = std::fs::read_dir(folder).expect("materials");
    let mut count = 0;
    let mut other = Vec::new();
    for path in files.flatten().map(|entry| entry.path()) {
        if path.extension().is_none_or(|e| e != "impasto") {
            continue;
        }
        let name = path.to_string_lossy().into_owned();
        let text = std::fs::read_to_string(&path).expect("a source");
        let open = |text: &str| compiled(&name, text, Parameters::Open);
        // Directions are drawn otherwise where a lobe without weight is not known to be one.
        let scattered = |program: &Program| {
            let all = answered::samples(program, 0).into_iter();
            all.flat_map(|one| one[LIGHT].to_vec())
                .collect::<Vec<f64>>()
        };
        let first = open(&text).expect("compiles");
        let plain = compiled(&name, &text, Parameters::Table).expect("compiles");
        assert_near(&scattered(&first), &scattered(&plain), &name);
        let text = edited(&text, 0.9921875, None).expect("floats are floats");
        match open(&text) {
            Ok(next) if code(&next) == code(&first) => {}
            Ok(_) => other.push(name),
            Err(problem) => panic!("{problem}"),
        }
        count += 1;
    }
    assert!(count > 40, "only {count} materials");
    let most = 0;
    assert!(
        other.len() <= most,
        "of {count} take other code: {other:#?}"
    );
}
