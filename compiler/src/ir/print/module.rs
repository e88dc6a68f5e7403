//! Modules as text: all of one, or what a file and its materials reach.

use std::collections::BTreeSet;

use super::{Names, material, named_function};
use crate::ir::{
    Closure, ClosureDef, ExprKind, Function, FunctionId, Material, Methods, Module, Struct, Type,
};
use crate::source::FileId;

/// Everything in a module, then materials over it.
pub fn module(module: &Module, materials: &[Material]) -> String {
    let all = Reached {
        module,
        structs: (0..module.structs.len()).collect(),
        functions: (0..module.functions.len()).collect(),
        closures: (0..module.closures.len()).collect(),
    };
    all.text(&materials.iter().collect::<Vec<_>>())
}

/// What `file` defines and `materials` use, with what these reach in other files, callees before
/// callers. A function that nothing reaches is left out, wherever it comes from.
pub fn reachable(module: &Module, file: Option<FileId>, materials: &[&Material]) -> String {
    let mut reached = Reached {
        module,
        structs: BTreeSet::new(),
        functions: BTreeSet::new(),
        closures: BTreeSet::new(),
    };
    reached.own(file);
    materials.iter().for_each(|m| reached.material(m));
    reached.text(materials)
}

/// What is to be printed, by position in the module.
struct Reached<'a> {
    module: &'a Module,
    structs: BTreeSet<usize>,
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
        self.mentioned(&material.body);
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
            self.mentioned(&module.functions[id.index()]);
        }
    }

    /// The functions and structs that a function mentions.
    fn mentioned(&mut self, f: &Function) {
        let variables = f.params.iter().chain(&f.locals).map(|l| l.ty);
        let types = variables.chain(f.exprs.iter().map(|e| e.ty));
        types.chain([f.result]).for_each(|ty| self.ty(ty));
        for expr in &f.exprs {
            if let ExprKind::Call(callee, _) = expr.kind {
                self.function(callee);
            }
        }
    }

    fn ty(&mut self, ty: Type) {
        let module = self.module;
        if let Type::Struct(id) = ty
            && self.structs.insert(id.index())
        {
            let fields = &module.structs[id.index()].fields;
            fields.iter().for_each(|f| self.ty(f.1));
        }
    }

    fn text(&self, materials: &[&Material]) -> String {
        let module = self.module;
        let names = Names::of(module);
        let mut parts: Vec<String> = Vec::new();
        if !module.textures.is_empty() {
            let lines = module.textures.iter().map(|t| format!("texture {t:?}\n"));
            parts.push(lines.collect());
        }
        let structs = self.structs.iter();
        parts.extend(structs.map(|&i| structure(&names, &module.structs[i], &names.structs[i])));
        let functions = self.functions.iter();
        parts.extend(functions.map(|&i| {
            let f = &module.functions[i];
            named_function(&names, f, &names.functions[i])
        }));
        let closures = self.closures.iter();
        parts.extend(closures.map(|&i| closure(&names, &module.closures[i], &names.closures[i])));
        parts.extend(materials.iter().map(|m| material::named(&names, m)));
        parts.join("\n")
    }
}

fn structure(names: &Names<'_>, s: &Struct, name: &str) -> String {
    let field = |(name, ty): &(String, Type)| format!("    {name}: {}\n", names.ty(*ty));
    let fields: String = s.fields.iter().map(field).collect();
    format!("struct {name} {{\n{fields}}}\n")
}

/// A closure definition: its parameters and the functions that are its methods.
fn closure(names: &Names<'_>, def: &ClosureDef, name: &str) -> String {
    let kind = match def.methods {
        Methods::Edf { .. } => "edf",
        Methods::Bsdf { .. } if def.delta => "delta bsdf",
        Methods::Bsdf { .. } => "bsdf",
    };
    let line = |(method, id): (&str, FunctionId)| {
        format!("    {method} = {}\n", names.functions[id.index()])
    };
    let methods: String = methods(def).into_iter().map(line).collect();
    let params = names.locals(&def.params);
    format!("{kind} {name}({params}) {{\n{methods}}}\n")
}

fn methods(def: &ClosureDef) -> Vec<(&'static str, FunctionId)> {
    match def.methods {
        Methods::Edf { emit } => vec![("emit", emit)],
        Methods::Bsdf {
            sample,
            eval,
            pdf,
            albedo,
            passes,
            walk,
        } => [
            ("sample", sample),
            ("eval", eval),
            ("pdf", pdf),
            ("albedo", albedo),
        ]
        .into_iter()
        .chain(passes.map(|id| ("passes", id)))
        .chain(walk.map(|id| ("walk", id)))
        .collect(),
    }
}
