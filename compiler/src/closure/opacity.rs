//! Opacity: what a material does not cover, light passes as if there were no surface.

use crate::ir::build::Builder;
use crate::ir::ops::Op;
use crate::ir::{Closure, ClosureDefId, ClosureId, Const, Expr, ExprId, Lobe, Material};

/// Puts a material's opacity into its closures: `mix(transparent(), surface, opacity)`, and emission
/// weighted by it.
pub fn cut_out(m: &mut Material, transparent: ClosureDefId) {
    let Some(opacity) = m.opacity.take() else {
        return;
    };
    let through = through(m, transparent, opacity);
    m.surface = Some(match m.surface {
        Some(surface) => add(m, Closure::Mix(through, surface, opacity)),
        None => {
            let open = complement(m, opacity);
            add(m, Closure::Weight(open, through))
        }
    });
    m.emission = m
        .emission
        .map(|emission| add(m, Closure::Weight(opacity, emission)));
}

/// The lobe of light that passes untinted.
fn through(m: &mut Material, transparent: ClosureDefId, opacity: ExprId) -> ClosureId {
    let Expr { span, via, .. } = *m.body.expr(opacity);
    let value = m.body.value;
    let mut b = Builder::resume(m.body.clone());
    let white = b.constant(Const::Float(vec![1.0; 3]), span);
    m.body = b.finish(value);
    add(
        m,
        Closure::Lobe(Lobe {
            def: transparent,
            args: vec![white],
            normal: None,
            tangent: None,
            span,
            via,
        }),
    )
}

fn add(m: &mut Material, closure: Closure) -> ClosureId {
    m.closures.push(closure);
    ClosureId(m.closures.len() as u32 - 1)
}

/// One minus a float of the body.
fn complement(m: &mut Material, x: ExprId) -> ExprId {
    let span = m.body.expr(x).span;
    let value = m.body.value;
    let mut b = Builder::resume(m.body.clone());
    let one = b.float(1.0, span);
    let rest = b.op(Op::Sub, &[one, x], span);
    m.body = b.finish(value);
    rest
}
