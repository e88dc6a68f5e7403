//! The files of cases: reading them, running their passes, comparing, rewriting.

use std::path::{Path, PathBuf};

use impasto_compiler::ir::parse::{Parsed, parse};
use impasto_compiler::ir::{Const, print, verify};
use impasto_compiler::passes::{Hoisted, Pass, pass};
use impasto_compiler::source::FileId;

use super::{RULE, meaning};

/// A file of `cases/`.
pub struct Case {
    pub name: String,
    path: PathBuf,
    pub passes: Vec<String>,
    /// Up to the rule.
    input: String,
    expected: String,
}

/// Every case, by name.
pub fn cases() -> Vec<Case> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/passes/cases");
    let mut paths: Vec<PathBuf> = std::fs::read_dir(&folder)
        .expect("the folder of cases")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|e| e == "ir"))
        .collect();
    paths.sort();
    paths.into_iter().map(read).collect()
}

fn read(path: PathBuf) -> Case {
    let name = path
        .file_name()
        .expect("a name")
        .to_string_lossy()
        .into_owned();
    let text = std::fs::read_to_string(&path).expect("a text");
    let head = text.lines().next().unwrap_or_default();
    let Some(passes) = head.strip_prefix("// pass: ") else {
        panic!("{name}: the first line is not `// pass: NAME`");
    };
    let passes = passes.split(',').map(|p| p.trim().to_owned()).collect();
    let (input, expected) = text.split_once(RULE).unwrap_or((&text, ""));
    Case {
        passes,
        input: input.to_owned(),
        expected: expected.to_owned(),
        name,
        path,
    }
}

/// Runs a case; an error says how what came out differs.
pub fn check(case: &Case) -> Result<(), String> {
    let before = parse(FileId(0), &case.input).map_err(|e| e.to_string())?;
    let mut after = Outcome {
        parsed: before.clone(),
        hoisted: Vec::new(),
    };
    for pass in &case.passes {
        after.apply(pass)?;
    }
    meaning::same(&before.module, &after.parsed.module, &after.hoisted)?;
    let text = after.text();
    parse(FileId(0), &text).map_err(|e| format!("what came out cannot be read: {e}\n{text}"))?;
    if text == case.expected {
        return Ok(());
    }
    if std::env::var_os("IMPASTO_BLESS").is_some() {
        let whole = format!("{}{RULE}{text}", case.input);
        return std::fs::write(&case.path, whole).map_err(|e| e.to_string());
    }
    let lines = difference(&case.expected, &text);
    Err(format!("`-` is expected, `+` came out\n{lines}"))
}

/// What passes made of a case.
struct Outcome {
    parsed: Parsed,
    /// What was hoisted from each function, if anything was to be.
    hoisted: Vec<Hoisted>,
}

impl Outcome {
    /// Runs one pass as the compiler does: over every function, callees first, or over every
    /// material, whose parameters have their defaults for values.
    fn apply(&mut self, name: &str) -> Result<(), String> {
        let pass = pass(name).ok_or_else(|| format!("there is no pass `{name}`"))?;
        if pass.is_on_material() {
            return self.materials(pass);
        }
        self.functions(pass)
    }

    fn functions(&mut self, pass: &Pass) -> Result<(), String> {
        let module = &mut self.parsed.module;
        for i in 0..module.functions.len() {
            let mut f = module.functions[i].clone();
            let hoisted = pass.run(module, &mut f);
            let text = print::function(module, &f);
            let checked = match &hoisted {
                Some(h) => verify::hoisted(module, &f, &h.types()),
                None => verify::function(module, &f),
            };
            checked.map_err(|e| format!("after {}: {e}\n{text}", pass.name))?;
            module.functions[i] = f;
            if let Some(h) = hoisted {
                let text = print::function(module, &h.prelude);
                verify::function(module, &h.prelude)
                    .map_err(|e| format!("prelude: {e}\n{text}"))?;
                self.hoisted.push(h);
            }
        }
        Ok(())
    }

    fn materials(&mut self, pass: &Pass) -> Result<(), String> {
        for m in &mut self.parsed.materials {
            let defaults = m.params.iter().map(|p| Some(p.default.clone()));
            let defaults: Vec<Option<Const>> = defaults.collect();
            pass.run_on_material(&self.parsed.module, m, &defaults)
                .map_err(|e| e.message)?;
            verify::material(&self.parsed.module, m)
                .map_err(|e| format!("after {}: {e}", pass.name))?;
        }
        Ok(())
    }

    /// The module, then what was hoisted from its functions.
    fn text(&self) -> String {
        let Parsed { module, materials } = &self.parsed;
        let mut out = print::module(module, materials);
        for h in self.hoisted.iter().filter(|h| !h.values.is_empty()) {
            let mut prelude = h.prelude.clone();
            prelude.name += "_prelude";
            let values = h.values.iter().enumerate();
            let values: Vec<String> = values
                .map(|(k, &v)| format!("#{k} = {}", print::operand(module, &prelude, v)))
                .collect();
            let values = values.join(", ");
            let text = print::function(module, &prelude);
            out.push_str(&format!("\n// {values}\n{text}"));
        }
        out
    }
}

/// Lines of both texts; those that only one has are marked.
fn difference(old: &str, new: &str) -> String {
    let (old, new): (Vec<&str>, Vec<&str>) = (old.lines().collect(), new.lines().collect());
    // common[i][j] is the length of the longest common subsequence of old[i..] and new[j..].
    let mut common = vec![vec![0; new.len() + 1]; old.len() + 1];
    for i in (0..old.len()).rev() {
        for j in (0..new.len()).rev() {
            common[i][j] = if old[i] == new[j] {
                common[i + 1][j + 1] + 1
            } else {
                common[i + 1][j].max(common[i][j + 1])
            };
        }
    }
    let (mut i, mut j, mut out) = (0, 0, String::new());
    while i < old.len() || j < new.len() {
        let (mark, line) = match (old.get(i), new.get(j)) {
            (Some(a), Some(b)) if a == b => (' ', a),
            (Some(a), Some(_)) if common[i + 1][j] >= common[i][j + 1] => ('-', a),
            (Some(a), None) => ('-', a),
            (_, Some(b)) => ('+', b),
            (None, None) => break,
        };
        out.push_str(&format!("{mark} {line}\n"));
        i += usize::from(mark != '+');
        j += usize::from(mark != '-');
    }
    out
}
