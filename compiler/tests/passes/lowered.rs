//! Materials taken to their `evaluate` function, with their parameters left open.

use impasto_compiler::closure::{self, Core};
use impasto_compiler::ir::{Function, FunctionId, Material, Module, StructId};
use impasto_compiler::{Checked, Loader, check, diag};

/// Reads files of the repository.
pub struct Files;

impl Loader for Files {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        std::fs::read(path).map_err(|e| e.to_string())
    }
}

/// Every material file of the repository.
pub fn material_files() -> Vec<String> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../materials");
    let entries = std::fs::read_dir(folder).expect("a folder");
    let paths = entries.map(|e| e.expect("an entry").path().to_string_lossy().into_owned());
    let mut found: Vec<String> = paths.filter(|p| p.ends_with(".impasto")).collect();
    found.sort();
    assert!(found.len() > 10, "no materials in {folder}");
    found
}

/// Checks a file that must be right.
pub fn checked(path: &str, loader: &mut dyn Loader) -> Checked {
    let checked = check(path, loader);
    let problems = diag::render::text(&checked.sources, &checked.diagnostics, false);
    assert!(
        !diag::has_errors(&checked.diagnostics),
        "{path}\n{problems}"
    );
    checked
}

/// The function `(point, wo, wl, u) -> MaterialSample`.
pub fn evaluate(module: &Module, m: &Material) -> Function {
    closure::evaluate(
        module,
        &core(module),
        m,
        &m.name,
        &closure::surface_lobes(m),
    )
}

fn core(module: &Module) -> Core {
    let function = |name: &str| {
        let index = module.functions.iter().position(|f| f.name == name);
        FunctionId(index.unwrap_or_else(|| panic!("no function {name}")) as u32)
    };
    let structure = |name: &str| {
        let index = module.structs.iter().position(|s| s.name == name);
        StructId(index.unwrap_or_else(|| panic!("no struct {name}")) as u32)
    };
    Core {
        valid_normal: function("valid_normal"),
        frame: function("frame"),
        to_local: function("to_local"),
        to_world: function("to_world"),
        transport_valid: function("transport_valid"),
        surface_point: structure("SurfacePoint"),
        material_sample: structure("MaterialSample"),
        transparent: None,
    }
}
