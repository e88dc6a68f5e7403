//! Checks that a function is well-formed: types fit, and every value is computed before use.
//!
//! Run after lowering and after every pass in debug builds; a failure is a compiler defect.

use super::{Block, ExprId, ExprKind, Function, Module, Stmt, Type};

/// What is wrong with `f`, if anything.
pub fn function(module: &Module, f: &Function) -> Result<(), String> {
    let mut v = Verifier {
        module,
        f,
        ready: f.exprs.iter().map(|e| e.kind.is_free()).collect(),
        loops: 0,
    };
    v.block(&f.body)
        .and_then(|()| v.used(f.value))
        .map_err(|e| format!("{}: {e}", f.name))?;
    if f.ty(f.value) != f.result {
        return Err(format!(
            "{}: value is {:?}, not {:?}",
            f.name,
            f.ty(f.value),
            f.result
        ));
    }
    Ok(())
}

struct Verifier<'a> {
    module: &'a Module,
    f: &'a Function,
    /// Which expressions are available at this place.
    ready: Vec<bool>,
    loops: usize,
}

impl Verifier<'_> {
    /// Checks a block; what it computes is not visible after it.
    fn scoped(&mut self, block: &Block) -> Result<(), String> {
        let before = self.ready.clone();
        self.block(block)?;
        self.ready = before;
        Ok(())
    }

    fn block(&mut self, block: &Block) -> Result<(), String> {
        block.iter().try_for_each(|s| self.stmt(s))
    }

    fn stmt(&mut self, stmt: &Stmt) -> Result<(), String> {
        match stmt {
            Stmt::Eval(id) => {
                self.expr(*id)?;
                if std::mem::replace(&mut self.ready[id.index()], true) {
                    return Err(format!("%{} is evaluated twice", id.0));
                }
                Ok(())
            }
            Stmt::Store(local, part, value) => {
                self.used(*value)?;
                let ty = self.f.locals[local.index()].ty;
                let expected = if part.is_some() { Type::Float } else { ty };
                self.expect(*value, expected)
            }
            Stmt::If(cond, then, otherwise) => {
                self.used(*cond)?;
                self.expect(*cond, Type::Bool)?;
                self.scoped(then)?;
                self.scoped(otherwise)
            }
            Stmt::For {
                low, high, body, ..
            } => {
                for bound in [*low, *high] {
                    self.used(bound)?;
                    self.expect(bound, Type::Int)?;
                }
                self.repeated(body)
            }
            Stmt::While {
                head, test, body, ..
            } => {
                let before = self.ready.clone();
                self.block(head)?;
                self.used(*test)?;
                self.expect(*test, Type::Bool)?;
                self.repeated(body)?;
                self.ready = before;
                Ok(())
            }
            Stmt::Break | Stmt::Continue if self.loops == 0 => Err("break outside a loop".into()),
            Stmt::Break | Stmt::Continue => Ok(()),
        }
    }

    fn repeated(&mut self, body: &Block) -> Result<(), String> {
        self.loops += 1;
        let result = self.scoped(body);
        self.loops -= 1;
        result
    }

    fn used(&self, id: ExprId) -> Result<(), String> {
        match self.ready.get(id.index()) {
            Some(true) => Ok(()),
            _ => Err(format!("%{} is used before it is evaluated", id.0)),
        }
    }

    fn expect(&self, id: ExprId, ty: Type) -> Result<(), String> {
        let found = self.f.ty(id);
        if found == ty {
            Ok(())
        } else {
            Err(format!("%{} is {found:?}, expected {ty:?}", id.0))
        }
    }

    fn expr(&self, id: ExprId) -> Result<(), String> {
        let e = self.f.expr(id);
        e.kind.operands().iter().try_for_each(|&a| self.used(a))?;
        let types: Vec<Type> = e.kind.operands().iter().map(|&a| self.f.ty(a)).collect();
        let fits = match &e.kind {
            ExprKind::Op(op, _) => op.result(&types) == Some(e.ty),
            ExprKind::Load(local) => self.f.locals[local.index()].ty == e.ty,
            ExprKind::Call(callee, _) => {
                let callee = &self.module.functions[callee.index()];
                callee.result == e.ty
                    && callee.params.iter().map(|p| p.ty).eq(types.iter().copied())
            }
            ExprKind::Make(s, _) => {
                let fields = &self.module.structs[s.index()].fields;
                fields.iter().map(|f| f.1).eq(types.iter().copied())
            }
            ExprKind::Field(_, i) => match types[0] {
                Type::Struct(s) => {
                    self.module.structs[s.index()]
                        .fields
                        .get(*i as usize)
                        .map(|f| f.1)
                        == Some(e.ty)
                }
                _ => false,
            },
            ExprKind::Swizzle(_, c) => {
                let width = types[0].width().unwrap_or(0);
                e.ty == Type::of_width(c.len()) && c.iter().all(|&c| usize::from(c) < width)
            }
            ExprKind::Compose(_) => composes(e.ty, &types),
            ExprKind::Const(_) | ExprKind::Param(_) | ExprKind::Uniform(_) => true,
        };
        if fits {
            Ok(())
        } else {
            Err(format!(
                "%{}: {:?} does not fit {types:?} -> {:?}",
                id.0, e.kind, e.ty
            ))
        }
    }
}

/// Can parts of types `parts` make a `ty`?
fn composes(ty: Type, parts: &[Type]) -> bool {
    if ty == Type::Mat3 {
        return parts == [Type::Vec3; 3];
    }
    let widths: Option<usize> = parts.iter().map(|p| p.width()).sum();
    ty.width()
        .is_some_and(|w| widths == Some(w) || parts == [Type::Float])
}
