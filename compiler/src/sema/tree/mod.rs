//! The tree that a material builds from closures: lobes, and how large a tree may be.

use crate::ast::{Arg, Name};
use crate::diag::{Code, Diagnostic};
use crate::ir::{Closure, ClosureDefId, ClosureId, Lobe};
use crate::source::Span;

use super::body::{Body, Operand, Place};
use super::types::Ty;

mod choose;
mod combine;
mod syntax;
mod weight;

/// Most lobes of a tree before those that cannot contribute are left out.
const MAX_WRITTEN_LOBES: u64 = 1024;
/// Most closures within each other.
const MAX_TREE_DEPTH: u32 = 256;

/// How large the tree below a closure is.
#[derive(Clone, Copy, Debug)]
pub struct TreeSize {
    lobes: u64,
    depth: u32,
}

impl TreeSize {
    const ONE: TreeSize = TreeSize { lobes: 1, depth: 1 };
}

fn closure_or_nothing(closure: Option<ClosureId>, ty: Ty) -> Operand {
    closure.map_or(Operand::Nothing(ty), |id| Operand::Closure(id, ty))
}

impl Body<'_, '_> {
    fn add(&mut self, closure: Closure) -> ClosureId {
        self.tree_sizes.push(self.tree_size(&closure));
        self.closures.push(closure);
        ClosureId(self.closures.len() as u32 - 1)
    }

    fn add_closure(&mut self, closure: Closure, ty: Ty) -> Operand {
        Operand::Closure(self.add(closure), ty)
    }

    fn tree_size(&self, closure: &Closure) -> TreeSize {
        let (a, b) = match closure {
            Closure::Lobe(_) => return TreeSize::ONE,
            Closure::Weight(_, a) => (*a, None),
            Closure::Layer(a, b)
            | Closure::Add(a, b)
            | Closure::Mix(a, b, _)
            | Closure::Select(_, a, b) => (*a, Some(*b)),
        };
        // Arguments of a definition that is checked on its own are no nodes.
        let of = |id: ClosureId| self.tree_sizes.get(id.index()).copied();
        let a = of(a).unwrap_or(TreeSize::ONE);
        let b = b.map(|b| of(b).unwrap_or(TreeSize::ONE));
        TreeSize {
            lobes: a.lobes.saturating_add(b.map_or(0, |b| b.lobes)),
            depth: a.depth.max(b.map_or(0, |b| b.depth)) + 1,
        }
    }

    /// Reports a tree that is too large to be walked. A closure that a `let` names may stand in it
    /// any number of times, so that few lines make a huge one.
    pub fn check_tree(&mut self, root: ClosureId, span: Span) -> Option<()> {
        let size = self.tree_sizes.get(root.index())?;
        let (lobes, depth) = (size.lobes, size.depth);
        if lobes > MAX_WRITTEN_LOBES {
            let message = format!("this is made of {lobes} lobes");
            let many = Diagnostic::new(Code::TooManyLobes, span, message).expected(format!(
                "at most {} after those of weight zero are left out",
                crate::ir::MAX_LOBES
            ));
            return self.report(many);
        }
        if depth > MAX_TREE_DEPTH {
            let message = format!("closures lie {depth} levels within each other");
            let deep = Diagnostic::new(Code::TooLarge, span, message)
                .expected(format!("at most {MAX_TREE_DEPTH} levels"));
            return self.report(deep);
        }
        Some(())
    }

    /// A call of a bsdf or edf.
    pub fn lobe(
        &mut self,
        callee: &Name,
        args: &[Arg],
        def: ClosureDefId,
        ty: Ty,
        span: Span,
    ) -> Option<Operand> {
        if self.place == Place::Values {
            let message = format!("`{}` makes a closure, which is no value", callee.node);
            let wrong = Diagnostic::new(Code::ClosureUse, span, message)
                .expected("closures in materials, and in functions that return one");
            return self.report(wrong);
        }
        let params = self.cx.closure_params[def.index()].clone();
        let framed = |name: &str| ty == Ty::Bsdf && !params.iter().any(|p| p.name == name);
        let (mut normal, mut tangent) = (None, None);
        let mut own = Vec::new();
        for arg in args {
            match arg.name.as_ref().map(|n| n.node.as_str()) {
                Some("normal") if framed("normal") => {
                    normal = Some(self.value_as(&arg.value, Ty::Normal, "`normal`")?)
                }
                Some("tangent") if framed("tangent") => {
                    tangent = Some(self.value_as(&arg.value, Ty::Vector, "`tangent`")?)
                }
                _ => own.push(arg.clone()),
            }
        }
        let args = self.value_arguments(callee, &own, &params)?;
        Some(self.add_closure(
            Closure::Lobe(Lobe {
                def,
                args,
                normal,
                tangent,
                span,
                via: self.builder.via(),
            }),
            ty,
        ))
    }
}
