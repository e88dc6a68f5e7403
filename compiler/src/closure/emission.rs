//! Builds a material's `emission` function, and finds out whether it is the same everywhere.

use super::{Core, children};
use crate::abi::Emission;
use crate::ir::build::Builder;
use crate::ir::interp::Interpreter;
use crate::ir::value::Value;
use crate::ir::{
    Closure, ClosureId, Const, ExprId, ExprKind, Function, Lobe, Local, Material, Methods, Module,
    Type,
};
use crate::ops::Op;

/// The function `(point, wo) -> radiance`, if the material emits.
pub fn emission(module: &Module, core: &Core, m: &Material, name: &str) -> Option<Function> {
    let root = m.emission?;
    let mut body = m.body.clone();
    body.name = name.to_owned();
    body.params.push(Local {
        name: "wo".into(),
        ty: Type::Vec3,
    });
    let mut b = Builder::resume(body);
    let point = b.param(0, m.span);
    let fields = &module.structs[core.surface_point.index()].fields;
    let index = fields.iter().position(|(n, _)| n == "geometric_normal")?;
    let normal = b.field(module, point, index, m.span);
    let zero = b.constant(Const::Float(vec![0.0; 3]), m.span);
    // Emission has no tangent frame of its own: about the normal it is symmetric or takes any.
    let frame = b.call(module, core.frame, &[normal, zero], m.span);
    let wo = b.param(1, m.span);
    let wo = b.call(module, core.to_local, &[frame, wo], m.span);
    let value = sum(module, m, &mut b, root, wo);
    let value = b.op(Op::Max, &[value, zero], m.span);
    Some(b.finish(value))
}

fn sum(module: &Module, m: &Material, b: &mut Builder, id: ClosureId, wo: ExprId) -> ExprId {
    let kept = children(m, id);
    match m.closures[id.index()].clone() {
        Closure::Lobe(lobe) => emit(module, b, &lobe, wo),
        _ if kept.is_empty() => b.constant(Const::Float(vec![0.0; 3]), m.span),
        Closure::Weight(w, a) => {
            let inner = sum(module, m, b, a, wo);
            b.op(Op::Mul, &[inner, w], m.span)
        }
        _ if kept.len() == 1 => sum(module, m, b, kept[0], wo),
        Closure::Add(x, y) | Closure::Layer(x, y) => {
            let (x, y) = (sum(module, m, b, x, wo), sum(module, m, b, y, wo));
            b.op(Op::Add, &[x, y], m.span)
        }
        Closure::Mix(x, y, t) => {
            let (x, y) = (sum(module, m, b, x, wo), sum(module, m, b, y, wo));
            b.op(Op::Mix, &[x, y, t], m.span)
        }
        Closure::Select(c, x, y) => {
            let (x, y) = (sum(module, m, b, x, wo), sum(module, m, b, y, wo));
            b.op(Op::Select, &[c, x, y], m.span)
        }
    }
}

fn emit(module: &Module, b: &mut Builder, lobe: &Lobe, wo: ExprId) -> ExprId {
    let Methods::Edf { emit } = module.closures[lobe.def.index()].methods else {
        return wo;
    };
    let mut args = lobe.args.clone();
    args.push(wo);
    b.call(module, emit, &args, lobe.span)
}

/// How an instance with the given uniforms emits, from its material's emission function.
///
/// It is uniform if nothing it reads differs over the surface, and every direction of the front
/// sees one radiance and every one of the back none. The former is seen from the code, the
/// latter is tried on directions of every elevation.
pub fn emission_kind(module: &Module, function: Option<&Function>, uniforms: &[Const]) -> Emission {
    let Some(f) = function else {
        return Emission::None;
    };
    if reads_point(module, f) {
        return Emission::Varying;
    }
    let radiance = |z: f64, azimuth: f64| radiance(module, f, uniforms, z, azimuth);
    let front = radiance(1.0, 0.0);
    let same = |z: f64, azimuth: f64, expected: [f32; 3]| radiance(z, azimuth) == Some(expected);
    let Some(expected) = front else {
        return Emission::Varying;
    };
    let uniform = (1..=200).all(|i| {
        let (z, azimuth) = (f64::from(i) / 200.0, f64::from(i) * 2.4);
        same(z, azimuth, expected) && same(-z, azimuth, [0.0; 3])
    });
    match (uniform, expected == [0.0; 3]) {
        (true, true) => Emission::None,
        (true, false) => Emission::Uniform(expected),
        (false, _) => Emission::Varying,
    }
}

/// Does the value depend on a field of the surface point other than its geometric normal?
fn reads_point(module: &Module, f: &Function) -> bool {
    f.exprs.iter().any(|e| match &e.kind {
        ExprKind::Field(base, i) => match (&f.expr(*base).kind, f.ty(*base)) {
            (ExprKind::Param(0), Type::Struct(s)) => {
                module.structs[s.index()].fields[*i as usize].0 != "geometric_normal"
                    && is_evaluated(f, e)
            }
            _ => false,
        },
        ExprKind::Op(Op::Image | Op::ImageData, _) => is_evaluated(f, e),
        _ => false,
    })
}

/// Dead code was removed from the body but stays in the arena.
fn is_evaluated(f: &Function, wanted: &crate::ir::Expr) -> bool {
    use crate::ir::{Block, Stmt};
    fn within(f: &Function, block: &Block, wanted: &crate::ir::Expr) -> bool {
        block.iter().any(|s| match s {
            Stmt::Eval(id) => std::ptr::eq(f.expr(*id), wanted),
            Stmt::If(_, a, b) => within(f, a, wanted) || within(f, b, wanted),
            Stmt::For { body, .. } => within(f, body, wanted),
            Stmt::While { head, body, .. } => within(f, head, wanted) || within(f, body, wanted),
            _ => false,
        })
    }
    within(f, &f.body, wanted)
}

/// The radiance toward a direction of cosine `z` on a surface whose normal is z.
fn radiance(
    module: &Module,
    f: &Function,
    uniforms: &[Const],
    z: f64,
    azimuth: f64,
) -> Option<[f32; 3]> {
    let s = (1.0 - z * z).max(0.0).sqrt();
    let wo = Value::vector(&[s * azimuth.cos(), s * azimuth.sin(), z]);
    let zero = || Value::vector(&[0.0; 3]);
    let normal = || Value::vector(&[0.0, 0.0, 1.0]);
    let point = Value::Struct(vec![
        zero(),
        normal(),
        normal(),
        zero(),
        Value::vector(&[0.0; 2]),
        Value::float(1.0),
    ]);
    let value = Interpreter::<f64>::new(module, 1 << 20)
        .with_uniforms(uniforms)
        .run(f, vec![point, wo])
        .ok()?;
    match value.to_f64().as_slice() {
        [r, g, b] => Some([*r as f32, *g as f32, *b as f32]),
        _ => None,
    }
}
