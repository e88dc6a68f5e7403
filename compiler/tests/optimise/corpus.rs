//! The functions to optimise, as lowering leaves them, and numbers to call them with.

use std::path::Path;

use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::value::Value;
use impasto_compiler::ir::{
    ClosureDefId, Const, Function, FunctionId, Material, Module, StructId, Type,
};
use impasto_compiler::{Checked, Loader, MemoryLoader, check, closure, diag, passes};

/// Work after which a call is given up.
const FUEL: u64 = 1 << 22;

/// A function with the module that its calls refer to.
pub struct Subject {
    pub name: String,
    /// Nothing in it is optimised.
    pub module: Module,
    pub function: Function,
    /// Values of the material's parameters.
    pub params: Vec<Const>,
}

/// Checks a source that must be free of errors.
pub fn checked(path: &str, loader: &mut dyn Loader) -> Checked {
    let checked = check(path, loader);
    let text = diag::render::text(&checked.sources, &checked.diagnostics, false);
    assert!(!diag::has_errors(&checked.diagnostics), "{path}: {text}");
    checked
}

/// Every function that the library's files define and reach, but each only once.
pub fn library() -> Vec<Subject> {
    let mut subjects: Vec<Subject> = Vec::new();
    for file in impasto_stdlib::files() {
        // What is in scope everywhere cannot be defined again, and is reached by the rest.
        if file.folder == impasto_stdlib::CORE {
            continue;
        }
        let mut loader = MemoryLoader::default();
        loader.add("copy.impasto", file.text);
        let module = checked("copy.impasto", &mut loader).ir;
        for function in &module.functions {
            let name = format!("{}/{}: {}", file.folder, file.name, function.name);
            let known = |s: &Subject| {
                s.function.name == function.name && s.function.exprs.len() == function.exprs.len()
            };
            if !subjects.iter().any(known) {
                subjects.push(Subject {
                    name,
                    module: module.clone(),
                    function: function.clone(),
                    params: Vec::new(),
                });
            }
        }
    }
    assert!(subjects.len() > 60, "only {} functions", subjects.len());
    subjects
}

struct Files;

impl Loader for Files {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        std::fs::read(path).map_err(|e| e.to_string())
    }
}

/// The evaluation of every material in `materials/`, with its parameters open and, a
/// second time, as constants.
pub fn materials() -> Vec<Subject> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../materials");
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .expect("materials")
        .flatten()
        .map(|e| e.path())
        .filter(|f| f.extension().is_some_and(|e| e == "impasto"))
        .collect();
    files.sort();
    assert!(files.len() >= 15, "only {} materials", files.len());
    let each = files.iter().flat_map(|file| {
        let checked = checked(&file.to_string_lossy(), &mut Files);
        let both = |m: &Material| [false, true].map(|baked| evaluation(&checked.ir, m, baked));
        checked.checked.iter().flat_map(both).collect::<Vec<_>>()
    });
    each.collect()
}

/// The function that evaluates a material, as the compiler lowers it.
pub fn evaluation(module: &Module, material: &Material, baked: bool) -> Subject {
    let mut m = material.clone();
    let defaults: Vec<Const> = m.params.iter().map(|p| p.default.clone()).collect();
    if baked {
        let agreed: Vec<Option<Const>> = defaults.iter().cloned().map(Some).collect();
        passes::run_material_until(module, &mut m, &agreed, "fold_body").expect("no problem");
    }
    let lobes = closure::surface_lobes(&m);
    let how = if baked { "baked" } else { "tabled" };
    Subject {
        name: format!("{}, {how}", m.name),
        function: closure::evaluate(module, &core(module), &m, "evaluate", &lobes),
        module: module.clone(),
        params: defaults,
    }
}

/// What shows through holes, if the module has it.
fn transparent(module: &Module) -> Option<ClosureDefId> {
    let at = module.closures.iter().position(|c| c.name == "transparent");
    at.map(|at| ClosureDefId(at as u32))
}

fn core(module: &Module) -> closure::Core {
    let function = |name: &str| {
        let at = module.functions.iter().position(|f| f.name == name);
        FunctionId(at.unwrap_or_else(|| panic!("no function `{name}`")) as u32)
    };
    let structure = |name: &str| {
        let at = module.structs.iter().position(|s| s.name == name);
        StructId(at.unwrap_or_else(|| panic!("no struct `{name}`")) as u32)
    };
    closure::Core {
        valid_normal: function("valid_normal"),
        frame: function("frame"),
        to_local: function("to_local"),
        to_world: function("to_world"),
        transport_valid: function("transport_valid"),
        surface_point: structure("SurfacePoint"),
        material_sample: structure("MaterialSample"),
        transparent: transparent(module),
    }
}

/// What a function gives and how many operations it took; nothing if it takes too long.
pub fn answer<'a>(
    run: &mut Interpreter<'a, f64>,
    f: &'a Function,
    args: &[Value<f64>],
) -> Option<(Vec<f64>, u64)> {
    run.refill(FUEL);
    let before = run.executed();
    let value = run.run(f, args.to_vec()).ok()?;
    let mut flat = Vec::new();
    flatten(&value, &mut flat);
    Some((flat, run.executed() - before))
}

/// All numbers of a value.
pub fn flatten(value: &Value<f64>, out: &mut Vec<f64>) {
    match value {
        Value::Bool(b) => out.push(f64::from(u8::from(*b))),
        Value::Int(i) => out.push(f64::from(*i)),
        Value::Floats(_) => out.extend(value.to_f64()),
        Value::Mat3(columns) => out.extend(columns.iter().flatten()),
        Value::Struct(fields) => fields.iter().for_each(|f| flatten(f, out)),
    }
}

/// Numbers that look random and are the same in every run (splitmix64, Steele et al. 2014).
pub struct Numbers(pub u64);

impl Numbers {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From 0 to 1.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Often a value that code treats specially.
    fn float(&mut self) -> f64 {
        match self.bits() % 12 {
            0 => 0.0,
            1 => 1.0,
            2 => -1.0,
            3..6 => self.unit(),
            _ => 6.0 * self.unit() - 3.0,
        }
    }

    fn direction(&mut self) -> Value<f64> {
        let (z, turn) = (2.0 * self.unit() - 1.0, std::f64::consts::TAU * self.unit());
        let s = (1.0 - z * z).max(0.0).sqrt();
        Value::vector(&[s * turn.cos(), s * turn.sin(), z])
    }

    pub fn value(&mut self, module: &Module, name: &str, ty: Type) -> Value<f64> {
        match ty {
            Type::Bool => Value::Bool(self.bits() & 1 == 0),
            Type::Int => Value::Int((self.bits() % 7) as i32 - 1),
            Type::Vec3 if name.contains("normal") || name.starts_with('w') => self.direction(),
            Type::Vec4 if name == "u" => Value::vector(&[(); 4].map(|()| self.unit())),
            Type::Mat3 => Value::Mat3([[(); 3]; 3].map(|c| c.map(|()| self.float()))),
            Type::Struct(id) => {
                let fields = module.structs[id.index()].fields.iter();
                let values = fields.map(|(name, ty)| self.value(module, name, *ty));
                Value::Struct(values.collect())
            }
            _ => {
                let n = ty.width().unwrap_or(1);
                Value::vector(&(0..n).map(|_| self.float()).collect::<Vec<_>>())
            }
        }
    }

    /// Arguments for a call.
    pub fn args(&mut self, module: &Module, f: &Function) -> Vec<Value<f64>> {
        f.params
            .iter()
            .map(|p| self.value(module, &p.name, p.ty))
            .collect()
    }
}
