//! Calls functions of a text, and through them those of the library.

use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::value::{Real, Value};
use impasto_compiler::ir::{FunctionId, Module, Type};
use impasto_compiler::{MemoryLoader, check, diag};

use crate::common::kept;

/// The IR of a text and what it reaches. It stays in memory, as do the interpreters that run it.
pub struct Text {
    pub module: &'static Module,
}

impl Text {
    pub fn new(text: &str) -> Self {
        let mut files = MemoryLoader::default();
        files.add("t.impasto", text);
        let checked = check("t.impasto", &mut files);
        let problems = diag::render::text(&checked.sources, &checked.diagnostics, false);
        assert!(!diag::has_errors(&checked.diagnostics), "{problems}");
        Self {
            module: Box::leak(Box::new(checked.ir)),
        }
    }

    pub fn id(&self, name: &str) -> FunctionId {
        let index = self.module.functions.iter().position(|f| f.name == name);
        FunctionId(index.unwrap_or_else(|| panic!("no function `{name}`")) as u32)
    }

    /// Calls a function with floats and vectors; the components of a struct come flattened.
    pub fn call<F: Real + 'static>(&self, name: &str, args: &[&[f64]]) -> Vec<f64> {
        let id = self.id(name);
        let params = self.module.functions[id.index()].params.iter();
        let typed = params.zip(args).map(|(p, v)| match p.ty {
            Type::Int => Value::Int(v[0] as i32),
            Type::Bool => Value::Bool(v[0] != 0.0),
            _ => Value::vector(v),
        });
        let args = typed.collect();
        let call = |run: &mut Interpreter<'static, F>| run.call(id, args);
        flatten(&kept::interpreter(self.module, call).expect("enough fuel"))
    }
}

fn flatten<F: Real>(value: &Value<F>) -> Vec<f64> {
    match value {
        Value::Struct(fields) => fields.iter().flat_map(flatten).collect(),
        Value::Int(i) => vec![f64::from(*i)],
        Value::Bool(b) => vec![f64::from(u8::from(*b))],
        value => value.to_f64(),
    }
}
