//! Which values of a material's body differ from point to point, and because of what.
//!
//! A value varies if it reads the surface point or a texture, or a variable that was assigned a
//! varying value or assigned where a varying condition decides. Each remembers the first cause
//! found, for the message.

use std::collections::BTreeMap;

use crate::ir::{Block, ExprId, ExprKind, Function, LocalId, Module, Stmt, Type};
use crate::source::Span;

/// Why a value varies.
#[derive(Clone, Debug, PartialEq)]
pub enum Cause {
    /// It reads this field of the surface point.
    Input(Span, String),
    /// It looks up a texture.
    Texture(Span),
}

/// The values that vary.
pub struct Causes {
    exprs: BTreeMap<ExprId, Cause>,
    locals: BTreeMap<LocalId, Cause>,
}

impl Causes {
    /// Why the value `id` varies; none if it is the same at every point.
    pub fn of(&self, id: ExprId) -> Option<&Cause> {
        self.exprs.get(&id)
    }

    fn count(&self) -> usize {
        self.exprs.len() + self.locals.len()
    }
}

/// Finds what varies in a body whose first parameter is the surface point.
pub fn causes(module: &Module, f: &Function) -> Causes {
    let mut found = Causes {
        exprs: BTreeMap::new(),
        locals: BTreeMap::new(),
    };
    // A loop carries what it assigns to its start, so more than one round may be needed; each
    // but the last finds something.
    loop {
        let before = found.count();
        Walk {
            module,
            f,
            found: &mut found,
        }
        .block(&f.body, None);
        if found.count() == before {
            return found;
        }
    }
}

struct Walk<'a> {
    module: &'a Module,
    f: &'a Function,
    found: &'a mut Causes,
}

impl Walk<'_> {
    /// Walks statements whose execution depends on `control`.
    fn block(&mut self, block: &Block, control: Option<&Cause>) {
        for stmt in block {
            self.stmt(stmt, control);
        }
    }

    fn stmt(&mut self, stmt: &Stmt, control: Option<&Cause>) {
        match stmt {
            Stmt::Eval(id) => self.eval(*id),
            Stmt::Store(local, _, value) => {
                let cause = self.found.exprs.get(value).or(control).cloned();
                self.assigned(*local, cause);
            }
            Stmt::If(cond, then, otherwise) => {
                let cause = self.found.exprs.get(cond).or(control).cloned();
                self.block(then, cause.as_ref());
                self.block(otherwise, cause.as_ref());
            }
            Stmt::For {
                local,
                low,
                high,
                body,
            } => {
                let bounds = [low, high]
                    .into_iter()
                    .find_map(|b| self.found.exprs.get(b));
                let cause = bounds.or(control).cloned();
                self.assigned(*local, cause.clone());
                let cause = cause.or_else(|| self.leaves(body));
                self.block(body, cause.as_ref());
            }
            Stmt::While {
                head, test, body, ..
            } => {
                self.block(head, control);
                let cause = self.found.exprs.get(test).or(control).cloned();
                let cause = cause.or_else(|| self.leaves(body));
                self.block(body, cause.as_ref());
            }
            Stmt::Break | Stmt::Continue => {}
        }
    }

    fn assigned(&mut self, local: LocalId, cause: Option<Cause>) {
        if let Some(cause) = cause {
            self.found.locals.entry(local).or_insert(cause);
        }
    }

    /// Why a loop's turns differ: a `break` or `continue` under a varying condition, which is
    /// known from the round before.
    fn leaves(&self, block: &Block) -> Option<Cause> {
        block.iter().find_map(|stmt| match stmt {
            Stmt::If(cond, then, otherwise) => {
                let cause = self.found.exprs.get(cond);
                let jumps = jumps(then) || jumps(otherwise);
                let own = cause.filter(|_| jumps).cloned();
                own.or_else(|| self.leaves(then))
                    .or_else(|| self.leaves(otherwise))
            }
            _ => None,
        })
    }

    fn eval(&mut self, id: ExprId) {
        let expr = self.f.expr(id);
        let own = match &expr.kind {
            ExprKind::Field(base, field) if self.is_point(*base) => {
                Some(Cause::Input(expr.span, self.input(*base, *field)))
            }
            ExprKind::Op(op, _) if op.texture_space().is_some() => Some(Cause::Texture(expr.span)),
            ExprKind::Load(local) => self.found.locals.get(local).cloned(),
            _ => None,
        };
        let mut operands = expr.kind.operands().iter();
        let cause = own.or_else(|| operands.find_map(|o| self.found.exprs.get(o)).cloned());
        if let Some(cause) = cause {
            self.found.exprs.entry(id).or_insert(cause);
        }
    }

    fn is_point(&self, id: ExprId) -> bool {
        matches!(self.f.expr(id).kind, ExprKind::Param(0))
    }

    fn input(&self, point: ExprId, field: u32) -> String {
        let Type::Struct(id) = self.f.ty(point) else {
            return String::new();
        };
        let fields = &self.module.structs[id.index()].fields;
        let name = fields.get(field as usize).map(|(name, _)| name.clone());
        name.unwrap_or_default()
    }
}

/// Does a block leave the loop it stands in, at any depth?
fn jumps(block: &Block) -> bool {
    block.iter().any(|stmt| match stmt {
        Stmt::Break | Stmt::Continue => true,
        Stmt::If(_, a, b) => jumps(a) || jumps(b),
        _ => false,
    })
}
