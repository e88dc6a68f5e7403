//! The IR as text, for `impasto emit --what ir` and snapshots.
//!
//! One evaluated expression a line, `%id: type = what`; free expressions (constants,
//! parameters) stand where they are used.

use std::fmt::Write;

use super::{
    Block, Closure, ClosureId, Const, ExprId, ExprKind, Function, Lobe, Material, Module, Stmt,
    Type,
};

/// A function as text.
pub fn function(module: &Module, f: &Function) -> String {
    let mut out = String::new();
    let params = f
        .params
        .iter()
        .map(|p| format!("{}: {}", p.name, ty(module, p.ty)));
    let params = params.collect::<Vec<_>>().join(", ");
    let result = ty(module, f.result);
    let _ = writeln!(out, "fn {}({params}) -> {result} {{", f.name);
    Printer { module, f }.body(&mut out);
    let _ = writeln!(out, "    return {}", Printer { module, f }.operand(f.value));
    out.push_str("}\n");
    out
}

/// A material as text: parameters, patterns, closure tree.
pub fn material(module: &Module, m: &Material) -> String {
    let mut out = String::new();
    let _ = writeln!(out, "material {} {{", m.name);
    for (i, p) in m.params.iter().enumerate() {
        let (name, default) = (&p.name, constant(&p.default));
        let _ = writeln!(
            out,
            "    uniform ${i} {name}: {} = {default}",
            ty(module, p.ty)
        );
    }
    let printer = Printer { module, f: &m.body };
    printer.body(&mut out);
    for (output, root) in [("surface", m.surface), ("emission", m.emission)] {
        if let Some(root) = root {
            let _ = writeln!(out, "    {output} =");
            printer.closure(&mut out, m, root, 2);
        }
    }
    if let Some(medium) = &m.interior {
        let parts = [medium.absorption, medium.ior, medium.priority];
        let parts = parts.map(|id| printer.operand(id)).join(", ");
        let _ = writeln!(out, "    interior = medium({parts})");
    }
    if let Some(opacity) = m.opacity {
        let _ = writeln!(out, "    opacity = {}", printer.operand(opacity));
    }
    out.push_str("}\n");
    out
}

/// The name of a type.
pub fn ty(module: &Module, ty: Type) -> String {
    match ty {
        Type::Struct(id) => module.structs[id.index()].name.clone(),
        other => format!("{other:?}").to_lowercase(),
    }
}

/// A constant as text.
pub fn constant(c: &Const) -> String {
    match c {
        Const::Bool(b) => b.to_string(),
        Const::Int(i) => i.to_string(),
        Const::Float(v) => {
            let parts: Vec<String> = v.iter().map(|&x| format!("{:?}", x as f32)).collect();
            if parts.len() == 1 {
                parts[0].clone()
            } else {
                format!("({})", parts.join(", "))
            }
        }
    }
}

struct Printer<'a> {
    module: &'a Module,
    f: &'a Function,
}

impl Printer<'_> {
    fn body(&self, out: &mut String) {
        for (i, local) in self.f.locals.iter().enumerate() {
            let _ = writeln!(
                out,
                "    var {}: {}",
                self.local(i),
                ty(self.module, local.ty)
            );
        }
        self.block(out, &self.f.body, 1);
    }

    fn local(&self, index: usize) -> String {
        format!("@{index}.{}", self.f.locals[index].name)
    }

    fn block(&self, out: &mut String, block: &Block, depth: usize) {
        let pad = "    ".repeat(depth);
        for stmt in block {
            match stmt {
                Stmt::Eval(id) => {
                    let e = self.f.expr(*id);
                    let name = e
                        .name
                        .as_ref()
                        .map(|n| format!(" // {n}"))
                        .unwrap_or_default();
                    let _ = writeln!(
                        out,
                        "{pad}%{}: {} = {}{name}",
                        id.0,
                        ty(self.module, e.ty),
                        self.value(*id)
                    );
                }
                Stmt::Store(local, part, value) => {
                    let part =
                        part.map(|p| format!(".{}", ["x", "y", "z", "w"][usize::from(p) & 3]));
                    let (place, value) = (self.local(local.index()), self.operand(*value));
                    let _ = writeln!(out, "{pad}{place}{} = {value}", part.unwrap_or_default());
                }
                Stmt::If(cond, then, otherwise) => {
                    let _ = writeln!(out, "{pad}if {} {{", self.operand(*cond));
                    self.block(out, then, depth + 1);
                    if !otherwise.is_empty() {
                        let _ = writeln!(out, "{pad}}} else {{");
                        self.block(out, otherwise, depth + 1);
                    }
                    let _ = writeln!(out, "{pad}}}");
                }
                Stmt::For {
                    local,
                    low,
                    high,
                    body,
                } => {
                    let (name, low, high) = (
                        self.local(local.index()),
                        self.operand(*low),
                        self.operand(*high),
                    );
                    let _ = writeln!(out, "{pad}for {name} in {low} .. {high} {{");
                    self.block(out, body, depth + 1);
                    let _ = writeln!(out, "{pad}}}");
                }
                Stmt::While {
                    head,
                    test,
                    limit,
                    body,
                } => {
                    let _ = writeln!(out, "{pad}while limit {limit} {{");
                    self.block(out, head, depth + 1);
                    let _ = writeln!(out, "{pad}}} {} {{", self.operand(*test));
                    self.block(out, body, depth + 1);
                    let _ = writeln!(out, "{pad}}}");
                }
                Stmt::Break => drop(writeln!(out, "{pad}break")),
                Stmt::Continue => drop(writeln!(out, "{pad}continue")),
            }
        }
    }

    fn operand(&self, id: ExprId) -> String {
        match &self.f.expr(id).kind {
            kind if !kind.is_free() => format!("%{}", id.0),
            _ => self.value(id),
        }
    }

    fn operands(&self, ids: &[ExprId]) -> String {
        ids.iter()
            .map(|&a| self.operand(a))
            .collect::<Vec<_>>()
            .join(", ")
    }

    fn value(&self, id: ExprId) -> String {
        let e = self.f.expr(id);
        match &e.kind {
            ExprKind::Const(c) => constant(c),
            ExprKind::Param(i) => self.f.params[*i as usize].name.clone(),
            ExprKind::Uniform(i) => format!("${i}"),
            ExprKind::Load(local) => format!("load {}", self.local(local.index())),
            ExprKind::Op(op, args) => format!("{} {}", op.info().text, self.operands(args)),
            ExprKind::Compose(args) => {
                format!("{}({})", ty(self.module, e.ty), self.operands(args))
            }
            ExprKind::Swizzle(v, components) => {
                let letters: String = components
                    .iter()
                    .map(|&c| ['x', 'y', 'z', 'w'][usize::from(c) & 3])
                    .collect();
                format!("{}.{letters}", self.operand(*v))
            }
            ExprKind::Call(f, args) => {
                format!(
                    "call {}({})",
                    self.module.functions[f.index()].name,
                    self.operands(args)
                )
            }
            ExprKind::Make(s, args) => {
                format!(
                    "{} {{ {} }}",
                    self.module.structs[s.index()].name,
                    self.operands(args)
                )
            }
            ExprKind::Field(v, i) => {
                let name = match self.f.ty(*v) {
                    Type::Struct(s) => &self.module.structs[s.index()].fields[*i as usize].0,
                    _ => "?",
                };
                format!("{}.{name}", self.operand(*v))
            }
        }
    }

    fn closure(&self, out: &mut String, m: &Material, id: ClosureId, depth: usize) {
        let pad = "    ".repeat(depth);
        let children = match &m.closures[id.index()] {
            Closure::Lobe(lobe) => {
                let _ = writeln!(out, "{pad}{}", self.lobe(lobe));
                vec![]
            }
            Closure::Layer(a, b) => {
                let _ = writeln!(out, "{pad}layer");
                vec![*a, *b]
            }
            Closure::Mix(a, b, t) => {
                let _ = writeln!(out, "{pad}mix {}", self.operand(*t));
                vec![*a, *b]
            }
            Closure::Weight(w, a) => {
                let _ = writeln!(out, "{pad}weight {}", self.operand(*w));
                vec![*a]
            }
            Closure::Add(a, b) => {
                let _ = writeln!(out, "{pad}add");
                vec![*a, *b]
            }
            Closure::Select(c, a, b) => {
                let _ = writeln!(out, "{pad}select {}", self.operand(*c));
                vec![*a, *b]
            }
        };
        for child in children {
            self.closure(out, m, child, depth + 1);
        }
    }

    fn lobe(&self, lobe: &Lobe) -> String {
        let def = &self.module.closures[lobe.def.index()];
        let mut args: Vec<String> = def
            .params
            .iter()
            .zip(&lobe.args)
            .map(|(p, &a)| format!("{}: {}", p.name, self.operand(a)))
            .collect();
        args.extend(lobe.normal.map(|n| format!("normal: {}", self.operand(n))));
        args.extend(
            lobe.tangent
                .map(|t| format!("tangent: {}", self.operand(t))),
        );
        format!("{}({})", def.name, args.join(", "))
    }
}
