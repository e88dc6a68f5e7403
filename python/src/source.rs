//! Where sources come from: texts that Python holds, and files.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use impasto::FileLoader;
use impasto::compiler::source::Origin;
use impasto::compiler::{
    Compilation, Loader, MaterialRequest, ParameterValue, Program, compile_until,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::error::Failure;

/// Sources by their names, as Python gives them.
pub(crate) type Texts = BTreeMap<String, String>;

/// Reads files, but for names whose text is held.
pub(crate) struct Sources<'t> {
    texts: &'t Texts,
    files: FileLoader,
}

impl<'t> Sources<'t> {
    /// Paths are relative to `base`; an empty one is the working directory.
    pub(crate) fn new(texts: &'t Texts, base: &Path) -> Self {
        Self {
            texts,
            files: FileLoader::new(base),
        }
    }

    /// Fails if there is no file of a name.
    pub(crate) fn check(&mut self, file: &str) -> Result<(), Failure> {
        let read = self.load(file).map(drop);
        read.map_err(|why| Failure::File(format!("cannot read `{file}`: {why}")))
    }
}

impl Loader for Sources<'_> {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        match self.texts.get(path) {
            Some(text) => Ok(text.as_bytes().to_vec()),
            None => self.files.load(path),
        }
    }

    fn origin(&mut self, path: &str) -> Option<Arc<Origin>> {
        self.files.origin(path)
    }

    fn beside(&mut self, path: &str) -> Vec<String> {
        let held = self.texts.keys().cloned();
        held.chain(self.files.beside(path)).collect()
    }
}

/// The program of some requests, with functions that say how materials look if that is asked for.
pub(crate) fn compile(
    requests: &[MaterialRequest],
    loader: &mut Sources<'_>,
    looks: bool,
    stop: &dyn Fn() -> bool,
) -> Result<Program, Failure> {
    for request in requests {
        loader.check(&request.file)?;
    }
    let Compilation {
        sources,
        diagnostics,
        program,
    } = compile_until(requests, loader, looks, stop);
    if stop() {
        return Err(Failure::Interrupted);
    }
    program.ok_or_else(|| Failure::sources(&sources, &diagnostics))
}

/// A value of a parameter, as the package gives it: its kind, and the value.
pub(crate) fn value(kind: &str, value: &Bound<'_, PyAny>) -> PyResult<ParameterValue> {
    Ok(match kind {
        "bool" => ParameterValue::Bool(value.extract()?),
        "int" => ParameterValue::Int(value.extract()?),
        "float" => ParameterValue::Float(value.extract()?),
        "floats" => ParameterValue::Floats(value.extract()?),
        "texture" => ParameterValue::Texture(value.extract()?),
        "text" => ParameterValue::Text(value.extract()?),
        _ => {
            return Err(PyValueError::new_err(format!(
                "there is no kind of value `{kind}`"
            )));
        }
    })
}

/// Values of parameters: of each its name, its kind, and the value.
pub(crate) type Values<'py> = Vec<(String, String, Bound<'py, PyAny>)>;

/// The same as the compiler takes them.
pub(crate) fn values(given: &Values<'_>) -> PyResult<Vec<(String, ParameterValue)>> {
    let one = |(name, kind, given): &(String, String, Bound<'_, PyAny>)| {
        Ok((name.clone(), value(kind, given)?))
    };
    given.iter().map(one).collect()
}
