//! Rules for lookups of textures, which drop what a lookup does not ask for.
//!
//! Functions of the library hand on widths and ways to wrap whose defaults are constants: once such a
//! function is in line, its lookups are the plain ones again.

use super::{New, Site, is, op};
use crate::ir::ops::Op;
use crate::ir::{Const, ExprId, ExprKind, Type};
use crate::passes::rewrite::Rewriter;

/// A lookup with a mode: without a width where that is zero, and plain where the mode is.
pub(super) fn lookup(
    w: &mut Rewriter<'_>,
    site: Site,
    this: Op,
    texture: ExprId,
    at: ExprId,
    mode: ExprId,
) -> Option<New> {
    let narrow = match w.f.ty(at) {
        Type::Vec4 => place_alone(w, site, at),
        _ => Some(at),
    };
    match (narrow, is(w, mode, 0.0)) {
        (Some(uv), true) => op(this.without_mode(), &[texture, uv]),
        (Some(uv), false) if uv != at => op(this, &[texture, uv, mode]),
        _ => None,
    }
}

/// The first half of a vec4 whose second half is zero.
fn place_alone(w: &mut Rewriter<'_>, site: Site, at: ExprId) -> Option<ExprId> {
    if let Some(Const::Float(v)) = w.f.constant(at) {
        let (place, width) = (v.get(..2)?.to_vec(), v.get(2..)?);
        let zero = width.iter().all(|x| *x == 0.0);
        return zero.then(|| w.constant(Const::Float(place), site.span));
    }
    let ExprKind::Compose(parts) = w.kind(at) else {
        return None;
    };
    let parts = parts.clone();
    let mut first = 0;
    let mut place = Vec::new();
    for part in parts {
        let width = w.f.ty(part).width()?;
        match first {
            0..2 if first + width <= 2 => place.push(part),
            2.. if is(w, part, 0.0) => {}
            _ => return None,
        }
        first += width;
    }
    match place.as_slice() {
        [uv] if w.f.ty(*uv) == Type::Vec2 => Some(*uv),
        [_, _] => Some(w.create(ExprKind::Compose(place), Type::Vec2, site.span)),
        _ => None,
    }
}
