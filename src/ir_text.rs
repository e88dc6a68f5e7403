//! The IR of one file as text, for `impasto emit --what ir` and for snapshots.
//!
//! What the file defines, and what that reaches in other files, callees before callers; a
//! function that nothing reaches is left out, wherever it comes from.

use std::collections::BTreeSet;

use impasto_compiler::Checked;
use impasto_compiler::ir::{
    Closure, ClosureDef, ExprKind, Function, FunctionId, Material, Methods, Module, Type, print,
};
use impasto_compiler::source::FileId;

/// The IR of the file `path` that was checked; only one of its materials, if `only` names it.
pub fn ir_text(checked: &Checked, path: &str, only: Option<&str>) -> String {
    let module = &checked.ir;
    let mut files = checked.sources.files();
    let file = files.find(|(_, file)| file.name == path).map(|(id, _)| id);
    let wanted = |m: &&Material| only.is_none_or(|name| m.name == name);
    let materials: Vec<&Material> = checked.checked.iter().filter(wanted).collect();

    let mut reached = Reached {
        module,
        functions: BTreeSet::new(),
        closures: BTreeSet::new(),
    };
    if only.is_none() {
        reached.own(file);
    }
    materials.iter().for_each(|m| reached.material(m));
    let mut parts: Vec<String> = reached
        .functions
        .iter()
        .map(|&i| &module.functions[i])
        .map(|f| print::function(module, f))
        .collect();
    parts.splice(0..0, reached.structs());
    parts.extend(
        reached
            .closures
            .iter()
            .map(|&i| closure(module, &module.closures[i])),
    );
    parts.extend(materials.into_iter().map(|m| print::material(module, m)));
    parts.join("\n")
}

/// What is to be printed, by position in the module.
struct Reached<'a> {
    module: &'a Module,
    functions: BTreeSet<usize>,
    closures: BTreeSet<usize>,
}

impl Reached<'_> {
    /// Everything defined in `file`.
    fn own(&mut self, file: Option<FileId>) {
        for (i, f) in self.module.functions.iter().enumerate() {
            if Some(f.span.file) == file {
                self.function(FunctionId(i as u32));
            }
        }
        for (i, c) in self.module.closures.iter().enumerate() {
            if Some(c.span.file) == file {
                self.closure(i);
            }
        }
    }

    fn material(&mut self, material: &Material) {
        self.callees(&material.body);
        for closure in &material.closures {
            if let Closure::Lobe(lobe) = closure {
                self.closure(lobe.def.index());
            }
        }
    }

    fn closure(&mut self, index: usize) {
        self.closures.insert(index);
        for method in methods(&self.module.closures[index]) {
            self.function(method.1);
        }
    }

    /// Calls go to functions before their callers, so this ends.
    fn function(&mut self, id: FunctionId) {
        let module = self.module;
        if self.functions.insert(id.index()) {
            self.callees(&module.functions[id.index()]);
        }
    }

    fn callees(&mut self, f: &Function) {
        for expr in &f.exprs {
            if let ExprKind::Call(callee, _) = expr.kind {
                self.function(callee);
            }
        }
    }

    /// The structs that printed functions mention.
    fn structs(&self) -> Vec<String> {
        let functions = self.functions.iter().map(|&i| &self.module.functions[i]);
        let types = functions.flat_map(|f| {
            let params = f.params.iter().map(|p| p.ty);
            params.chain(f.exprs.iter().map(|e| e.ty)).chain([f.result])
        });
        let ids: BTreeSet<usize> = types
            .filter_map(|ty| match ty {
                Type::Struct(id) => Some(id.index()),
                _ => None,
            })
            .collect();
        let text = |i: usize| {
            let s = &self.module.structs[i];
            let field = |(name, ty): &(String, Type)| {
                format!("    {name}: {}\n", print::ty(self.module, *ty))
            };
            let fields: String = s.fields.iter().map(field).collect();
            format!("struct {} {{\n{fields}}}\n", s.name)
        };
        ids.into_iter().map(text).collect()
    }
}

/// A closure definition: its parameters and the functions that are its methods.
fn closure(module: &Module, def: &ClosureDef) -> String {
    let params = def
        .params
        .iter()
        .map(|p| format!("{}: {}", p.name, print::ty(module, p.ty)));
    let params: Vec<String> = params.collect();
    let kind = match def.methods {
        Methods::Edf { .. } => "edf",
        Methods::Bsdf { .. } if def.delta => "delta bsdf",
        Methods::Bsdf { .. } => "bsdf",
    };
    let line = |(name, id): (&str, FunctionId)| {
        format!("    {name} = {}\n", module.functions[id.index()].name)
    };
    let methods: String = methods(def).into_iter().map(line).collect();
    format!(
        "{kind} {}({}) {{\n{methods}}}\n",
        def.name,
        params.join(", ")
    )
}

fn methods(def: &ClosureDef) -> Vec<(&'static str, FunctionId)> {
    match def.methods {
        Methods::Edf { emit } => vec![("emit", emit)],
        Methods::Bsdf {
            sample,
            eval,
            pdf,
            albedo,
        } => {
            vec![
                ("sample", sample),
                ("eval", eval),
                ("pdf", pdf),
                ("albedo", albedo),
            ]
        }
    }
}
