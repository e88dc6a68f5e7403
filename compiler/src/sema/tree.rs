//! The tree that a material builds from closures: lobes, layers, mixes, weights and sums.

use crate::ast::{self, Arg, BinaryOp, Expr, ExprKind, ItemKind, Name};
use crate::diag::{Code, Diagnostic};
use crate::ir::{Closure, ClosureDefId, ClosureId, Const, ExprId, Lobe};
use crate::ops::Op;
use crate::source::Span;

use super::body::{Binding, Body, Operand, Place};
use super::expr::NO_MEDIUM;
use super::types::Ty;

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

/// A closure to combine, if there is one, with its kind and place.
type Part = (Option<ClosureId>, Ty, Span);

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
                crate::closure::MAX_LOBES
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

    /// Closures of arguments without names, all of one type.
    fn closures_of(&mut self, what: &str, args: &[Arg]) -> Option<Vec<Part>> {
        let mut all = Vec::new();
        let mut ok = true;
        for arg in args {
            let at = arg.value.span;
            match self.expr(&arg.value) {
                _ if arg.name.is_some() => {
                    let named = Diagnostic::new(
                        Code::UnknownArgument,
                        at,
                        format!("`{what}` takes its closures by position"),
                    )
                    .expected("closures without names");
                    self.report::<()>(named);
                    ok = false;
                }
                Some(Operand::Closure(id, ty)) => all.push((Some(id), ty, at)),
                Some(Operand::Nothing(ty)) if ty != Ty::Medium => all.push((None, ty, at)),
                Some(other) => {
                    let found = self.cx.a_type(other.ty());
                    let message = format!("`{what}` combines bsdfs and edfs, and this is {found}");
                    let wrong =
                        Diagnostic::new(Code::TypeMismatch, at, message).expected("a bsdf or edf");
                    self.report::<()>(match other {
                        Operand::Value(..) => {
                            wrong.hint("a weight is multiplied: `w * diffuse(...)`")
                        }
                        Operand::Material(_) => {
                            wrong.hint("take the surface of the material: `m.surface`")
                        }
                        _ => wrong.hint("a medium is assigned to `interior`"),
                    });
                    ok = false;
                }
                None => ok = false,
            }
        }
        ok.then_some(all)
    }

    /// `layer(a, b, ...)`, top first. With an edf at the bottom, it is emission seen through the
    /// layers above.
    pub fn layer(&mut self, args: &[Arg], span: Span) -> Option<Operand> {
        self.require_closures("layer", span)?;
        let closures = self.closures_of("layer", args)?;
        let Some((&(bottom, ty, _), above)) =
            closures.split_last().filter(|(_, above)| !above.is_empty())
        else {
            let few = Diagnostic::new(
                Code::MissingArgument,
                span,
                "`layer` needs two closures at least",
            )
            .expected("`layer(top, ..., bottom)`");
            return self.report(few);
        };
        if let Some((_, _, at)) = above.iter().find(|c| c.1 == Ty::Edf) {
            let wrong = Diagnostic::new(
                Code::TypeMismatch,
                *at,
                "an edf covers nothing, so it cannot lie above another layer",
            )
            .expected("a bsdf; an edf only at the bottom of `layer`")
            .hint("emission from under a coat is `emission = layer(coat, edf);`");
            return self.report(wrong);
        }
        let mut stack = bottom;
        for &(top, ..) in above.iter().rev() {
            stack = match (top, stack) {
                (Some(top), Some(under)) => Some(self.add(Closure::Layer(top, under))),
                // What is black stays so under a coat, and the coat is what is seen.
                (Some(top), None) if ty == Ty::Bsdf => Some(top),
                (_, stack) => stack,
            };
        }
        Some(closure_or_nothing(stack, ty))
    }

    /// `mix(a, b, t)` of closures.
    pub fn mix_closures(&mut self, args: &[Arg], span: Span) -> Option<Operand> {
        self.require_closures("mix", span)?;
        let named_weight = args
            .iter()
            .position(|a| a.name.as_ref().is_some_and(|n| n.node == "t"));
        let [a, b, t] = args else {
            let wrong = Diagnostic::new(
                Code::MissingArgument,
                span,
                format!("`mix` takes 3 arguments, not {}", args.len()),
            )
            .expected("`mix(a, b, t)`");
            return self.report(wrong);
        };
        if named_weight.is_some_and(|i| i != 2) {
            let wrong = Diagnostic::new(Code::UnknownArgument, span, "the weight comes last")
                .expected("`mix(a, b, t)`");
            return self.report(wrong);
        }
        let closures = self.closures_of("mix", &[a.clone(), b.clone()]);
        let weight = self.value_as(&t.value, Ty::Float, "the weight of `mix`");
        let (closures, weight) = (closures?, weight?);
        let [(x, xt, _), (y, yt, at)] = closures.as_slice() else {
            return None;
        };
        self.same_kind(*xt, *yt, *at)?;
        let weight = self.builder.op(Op::Saturate, &[weight], t.value.span);
        let mixed = match (*x, *y) {
            (Some(x), Some(y)) => Some(self.add(Closure::Mix(x, y, weight))),
            (Some(x), None) => {
                let one = self.builder.float(1.0, span);
                let rest = self.builder.op(Op::Sub, &[one, weight], span);
                Some(self.add(Closure::Weight(rest, x)))
            }
            (None, y) => y.map(|y| self.add(Closure::Weight(weight, y))),
        };
        Some(closure_or_nothing(mixed, *xt))
    }

    fn require_closures(&mut self, what: &str, span: Span) -> Option<()> {
        if self.place != Place::Values {
            return Some(());
        }
        let message = format!("`{what}` combines closures, which are no values");
        let wrong = Diagnostic::new(Code::ClosureUse, span, message)
            .expected("closures in materials, and in functions that return one");
        self.report(wrong)
    }

    fn same_kind(&mut self, a: Ty, b: Ty, span: Span) -> Option<()> {
        if a == b {
            return Some(());
        }
        let (a, b) = (self.cx.a_type(a), self.cx.a_type(b));
        let wrong = Diagnostic::new(
            Code::TypeMismatch,
            span,
            format!("{a} and {b} do not combine"),
        )
        .expected(a);
        self.report(wrong)
    }

    /// `w * a` and `a + b` where a closure takes part.
    pub fn closure_operator(
        &mut self,
        op: BinaryOp,
        a: Operand,
        b: Operand,
        span: Span,
    ) -> Option<Operand> {
        match (op, a, b) {
            (BinaryOp::Mul, Operand::Value(w, wt), Operand::Closure(c, ty))
            | (BinaryOp::Mul, Operand::Closure(c, ty), Operand::Value(w, wt)) => {
                self.weight(w, wt, c, ty, span)
            }
            (BinaryOp::Mul, Operand::Value(..), Operand::Nothing(ty))
            | (BinaryOp::Mul, Operand::Nothing(ty), Operand::Value(..))
                if ty != Ty::Medium =>
            {
                Some(Operand::Nothing(ty))
            }
            (
                BinaryOp::Add,
                Operand::Nothing(xt),
                y @ (Operand::Closure(..) | Operand::Nothing(_)),
            )
            | (BinaryOp::Add, y @ Operand::Closure(..), Operand::Nothing(xt))
                if xt != Ty::Medium =>
            {
                self.same_kind(y.ty(), xt, span)?;
                Some(y)
            }
            (BinaryOp::Add, Operand::Closure(x, xt), Operand::Closure(y, yt)) => {
                self.same_kind(xt, yt, span)?;
                if xt == Ty::Bsdf && self.may_gain(x, y) {
                    let gain = Diagnostic::new(Code::EnergyGain, span, "this sum of closures can reflect more light than it receives")
                        .hint("use `layer(top, bottom)` or `mix(a, b, t)`, or weights that sum to at most one");
                    self.report::<()>(gain);
                }
                Some(self.add_closure(Closure::Add(x, y), xt))
            }
            _ => {
                let message = format!("`{}` does not combine closures this way", op.symbol());
                let wrong = Diagnostic::new(Code::ClosureUse, span, message)
                    .expected("`weight * closure` or `closure + closure`");
                self.report(match (a, b) {
                    (Operand::Material(_), _) | (_, Operand::Material(_)) => {
                        wrong.hint("take the surface of the material: `m.surface`")
                    }
                    _ => wrong.hint("to take light away, multiply by a weight below one"),
                })
            }
        }
    }

    /// May a sum of closures reflect more than comes? Not if constant weights keep it to one.
    fn may_gain(&self, x: ClosureId, y: ClosureId) -> bool {
        let (x, y) = (self.most_reflected(x), self.most_reflected(y));
        x.iter().zip(y).any(|(x, y)| x + y > 1.0 + 1e-9)
    }

    /// How much a closure reflects at most in each channel, by its constant weights.
    fn most_reflected(&self, id: ClosureId) -> [f64; 3] {
        match &self.closures[id.index()] {
            Closure::Weight(w, a) => match self.builder.function().constant(*w) {
                Some(Const::Float(w)) => {
                    let a = self.most_reflected(*a);
                    std::array::from_fn(|c| a[c] * w.get(c).or(w.first()).copied().unwrap_or(1.0))
                }
                _ => self.most_reflected(*a),
            },
            Closure::Add(a, b) => {
                let (a, b) = (self.most_reflected(*a), self.most_reflected(*b));
                std::array::from_fn(|c| a[c] + b[c])
            }
            Closure::Mix(..) | Closure::Layer(..) | Closure::Select(..) | Closure::Lobe(_) => {
                [1.0; 3]
            }
        }
    }

    fn weight(&mut self, w: ExprId, wt: Ty, c: ClosureId, ty: Ty, span: Span) -> Option<Operand> {
        let w = match wt {
            Ty::Int => self.promote(w, span),
            Ty::Float | Ty::Color => w,
            _ => {
                let message = format!("a closure cannot be weighted by {}", self.cx.a_type(wt));
                return self.report(
                    Diagnostic::new(Code::TypeMismatch, span, message)
                        .expected("a float or a color"),
                );
            }
        };
        if let (Ty::Bsdf, Some(Const::Float(v))) = (ty, self.builder.function().constant(w)) {
            let (most, least) = v
                .iter()
                .fold((f64::MIN, f64::MAX), |(a, b), &x| (a.max(x), b.min(x)));
            let warning = if most > 1.0 {
                Some(
                    Diagnostic::new(
                        Code::WeightAboveOne,
                        span,
                        format!("a weight of {most} can create light"),
                    )
                    .expected("a weight from 0 to 1"),
                )
            } else if most <= 0.0 && least <= 0.0 {
                Some(
                    Diagnostic::new(
                        Code::LobesNeverSampled,
                        span,
                        "the weight is zero, so the closure never shows",
                    )
                    .expected("a weight above 0"),
                )
            } else {
                None
            };
            if let Some(warning) = warning {
                self.report::<()>(warning);
            }
        }
        // Light cannot be negative; emission may be as strong as it likes.
        let zero = self.builder.float(0.0, span);
        let w = self.builder.op(Op::Max, &[w, zero], span);
        Some(self.add_closure(Closure::Weight(w, c), ty))
    }

    /// An `if` between closures. Both sides' patterns are computed, so neither may assign what
    /// is seen outside.
    pub fn if_closure(
        &mut self,
        cond: ExprId,
        then: &ast::Block,
        otherwise: &ast::Block,
        span: Span,
    ) -> Option<Operand> {
        let outside = std::mem::replace(&mut self.fixed_scopes, self.scopes.len());
        let a = self.scoped(|cx| cx.block_value(then, span));
        let b = self.scoped(|cx| cx.block_value(otherwise, span));
        self.fixed_scopes = outside;
        match (a?.0, b?) {
            (a, (b, at)) if a.ty().is_closure() && b.ty().is_closure() => {
                self.same_kind(a.ty(), b.ty(), at)?;
                self.choose_closure(cond, a, b, span)
            }
            (_, (_, at)) => {
                let wrong = Diagnostic::new(
                    Code::TypeMismatch,
                    at,
                    "one branch is a closure and the other is not",
                )
                .expected("closures in both branches")
                .hint("`0.0 * diffuse(0.0)` is a closure that does nothing");
                self.report(wrong)
            }
        }
    }

    /// The first of two closures of one kind where `cond` holds, else the second.
    pub fn choose_closure(
        &mut self,
        cond: ExprId,
        a: Operand,
        b: Operand,
        span: Span,
    ) -> Option<Operand> {
        use Operand::{Closure as C, Material, Medium, Nothing};
        if let Some(Const::Bool(holds)) = self.builder.function().constant(cond)
            && matches!((a, b), (Nothing(_), _) | (_, Nothing(_)) | (Medium(_), _))
        {
            return Some(if *holds { a } else { b });
        }
        Some(match (a, b) {
            (C(x, ty), C(y, _)) => self.add_closure(Closure::Select(cond, x, y), ty),
            (C(x, ty), Nothing(_)) | (Nothing(_), C(x, ty)) => {
                let (one, zero) = (self.builder.float(1.0, span), self.builder.float(0.0, span));
                let share = match a {
                    Nothing(_) => [cond, zero, one],
                    _ => [cond, one, zero],
                };
                let share = self.builder.op(Op::Select, &share, span);
                self.add_closure(Closure::Weight(share, x), ty)
            }
            (Medium(x), Medium(y)) => self.choose_medium(cond, x, y, span),
            (Medium(x), Nothing(_)) => self.medium_when(cond, true, x, span),
            (Nothing(_), Medium(y)) => self.medium_when(cond, false, y, span),
            (Material(x), Material(y)) => return self.choose_material(cond, x, y, span),
            (nothing @ Nothing(_), _) => nothing,
            _ => return None,
        })
    }

    /// Does a block end in a closure? Seen from the syntax, before anything is checked.
    pub fn is_closure_block(&self, block: &ast::Block) -> bool {
        let in_block = |name: &str| {
            block.stmts.iter().any(|s| match &s.kind {
                ast::StmtKind::Let { name: n, value, .. } => {
                    n.node == name && self.is_closure(value)
                }
                _ => false,
            })
        };
        tail(block).is_some_and(|e| match &e.kind {
            ExprKind::Name(name) if in_block(name) => true,
            _ => self.is_closure(e),
        })
    }

    /// Will an expression be a closure?
    pub fn is_closure(&self, expr: &Expr) -> bool {
        match &expr.kind {
            ExprKind::Name(name) => {
                let mut entries = self.scopes.iter().rev().flat_map(|s| s.iter().rev());
                match entries.find(|e| e.name == *name).map(|e| e.binding) {
                    Some(Binding::Fixed(operand)) => operand.ty().is_closure(),
                    Some(_) => false,
                    None => name == NO_MEDIUM && self.cx.lookup(self.module, name).is_none(),
                }
            }
            ExprKind::Call { callee, args } => match self.cx.lookup(self.module, &callee.node) {
                Some(item) => match &self.cx.item(item).kind {
                    ItemKind::Closure(_) | ItemKind::Material(_) => true,
                    ItemKind::Function(f) => returns_closure(f),
                    _ => false,
                },
                None => makes_closure(&callee.node, args, |e| self.is_closure(e)),
            },
            ExprKind::Binary(BinaryOp::Mul | BinaryOp::Add | BinaryOp::Sub, a, b) => {
                self.is_closure(a) || self.is_closure(b)
            }
            ExprKind::If(branch) => {
                self.is_closure_block(&branch.then)
                    || branch
                        .otherwise
                        .as_ref()
                        .is_some_and(|b| self.is_closure_block(b))
            }
            ExprKind::Field(base, part) => part.node != "opacity" && self.is_closure(base),
            ExprKind::Block(block) => self.is_closure_block(block),
            _ => false,
        }
    }
}

/// Does a function return a closure? Seen from its text.
fn returns_closure(f: &ast::Function) -> bool {
    let mut closures = super::types::NAMED.iter().filter(|(_, ty)| ty.is_closure());
    closures.any(|(name, _)| *name == f.result.node)
}

/// Is the callee a closure-making function of the language itself?
fn makes_closure(callee: &str, args: &[Arg], is_closure: impl Fn(&Expr) -> bool) -> bool {
    match callee {
        "layer" | "medium" => true,
        "mix" => args.iter().any(|a| is_closure(&a.value)),
        _ => false,
    }
}

/// The last expression of a block, through nested blocks.
fn tail(block: &ast::Block) -> Option<&Expr> {
    let value = block.value.as_deref()?;
    match &value.kind {
        ExprKind::Block(inner) => tail(inner),
        _ => Some(value),
    }
}
