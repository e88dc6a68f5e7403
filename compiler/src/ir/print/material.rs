//! Materials as text: parameters, patterns, closure tree.

use std::fmt::Write;

use super::{Names, Printer, constant};
use crate::ir::{Closure, ClosureId, Lobe, Material, MaterialParam, Module};

/// A material as text.
pub fn material(module: &Module, m: &Material) -> String {
    named(&Names::of(module), m)
}

pub(super) fn named(names: &Names<'_>, m: &Material) -> String {
    let printer = Printer::new(names, &m.body);
    let mut out = format!("material {}({}) {{\n", m.name, printer.signature());
    for (i, p) in m.params.iter().enumerate() {
        let _ = writeln!(out, "    uniform ${i} {}", uniform(names, p));
    }
    printer.body(&mut out);
    for (output, root) in [("surface", m.surface), ("emission", m.emission)] {
        if let Some(root) = root {
            let _ = writeln!(out, "    {output} =");
            Tree {
                printer: &printer,
                m,
            }
            .closure(&mut out, root, 2);
        }
    }
    if let Some(medium) = &m.interior {
        let parts = medium.parts.map(|id| printer.operand(id)).join(", ");
        let when = medium
            .when
            .map(|id| format!(" when {}", printer.operand(id)));
        let when = when.unwrap_or_default();
        let _ = writeln!(out, "    interior = medium({parts}){when}");
    }
    if let Some(opacity) = m.opacity {
        let _ = writeln!(out, "    opacity = {}", printer.operand(opacity));
    }
    out.push_str("}\n");
    out
}

/// `scale: float as length = 0.1 in 0.0 .. 1.0`, `time: float = 0.0 input`
fn uniform(names: &Names<'_>, p: &MaterialParam) -> String {
    let ty = names.ty(p.ty);
    let surface = if p.surface_type == ty {
        String::new()
    } else {
        format!(" as {}", p.surface_type)
    };
    let range = p.range.map_or(String::new(), |(low, high)| {
        format!(" in {low:?} .. {high:?}")
    });
    let default = constant(&p.default);
    let input = if p.is_input { " input" } else { "" };
    format!("{}: {ty}{surface} = {default}{range}{input}", p.name)
}

struct Tree<'a> {
    printer: &'a Printer<'a>,
    m: &'a Material,
}

impl Tree<'_> {
    /// A node and below it, one step deeper, its children.
    fn closure(&self, out: &mut String, id: ClosureId, depth: usize) {
        let operand = |e| self.printer.operand(e);
        let (text, children) = match &self.m.closures[id.index()] {
            Closure::Lobe(lobe) => (self.lobe(lobe), vec![]),
            Closure::Layer(a, b) => ("layer".into(), vec![*a, *b]),
            Closure::Mix(a, b, t) => (format!("mix {}", operand(*t)), vec![*a, *b]),
            Closure::Weight(w, a) => (format!("weight {}", operand(*w)), vec![*a]),
            Closure::Add(a, b) => ("add".into(), vec![*a, *b]),
            Closure::Select(c, a, b) => (format!("select {}", operand(*c)), vec![*a, *b]),
        };
        let _ = writeln!(out, "{}{text}", "    ".repeat(depth));
        for child in children {
            self.closure(out, child, depth + 1);
        }
    }

    /// `lobe name(parameter: value, ...) normal %1 tangent %2`
    fn lobe(&self, lobe: &Lobe) -> String {
        let names = self.printer.names;
        let def = &names.module.closures[lobe.def.index()];
        let labels = super::unique(def.params.iter().map(|p| &p.name));
        let arg = |(label, &a): (&String, _)| format!("{label}: {}", self.printer.operand(a));
        let args: Vec<String> = labels.iter().zip(&lobe.args).map(arg).collect();
        let frame = [("normal", lobe.normal), ("tangent", lobe.tangent)];
        let frame: String = frame
            .into_iter()
            .filter_map(|(what, id)| Some(format!(" {what} {}", self.printer.operand(id?))))
            .collect();
        let name = &names.closures[lobe.def.index()];
        format!("lobe {name}({}){frame}", args.join(", "))
    }
}
