//! Builds a material's `emission` function, and finds out whether it is the same everywhere.

use super::view::View;
use super::{Core, children, lobes};
use crate::abi::Emission;
use crate::ir::interp::Interpreter;
use crate::ir::ops::Op;
use crate::ir::value::Value;
use crate::ir::{
    Closure, ClosureId, Const, ExprId, ExprKind, Function, Lobe, Material, Methods, Module, Type,
};

/// The function `(point, wo) -> radiance`, if the material emits.
pub fn emission(module: &Module, core: &Core, m: &Material, name: &str) -> Option<Function> {
    let root = m.emission?;
    let mut view = View::new(module, core, m, &[]);
    let (normal, zero) = (view.point("geometric_normal"), view.color(0.0));
    // Emission has no tangent frame of its own: about the normal it is symmetric or takes any.
    let frame = view.call(core.frame, &[normal, zero]);
    let wo = view.wo();
    let wo = view.call(core.to_local, &[frame, wo]);
    let value = view.radiance(root, wo);
    let value = view.op(Op::Max, &[value, zero]);
    let mut f = view.finish(value);
    name.clone_into(&mut f.name);
    Some(f)
}

impl View<'_> {
    /// The radiance of a tree of edfs toward `wo`, given in the frame of emission.
    fn radiance(&mut self, id: ClosureId, wo: ExprId) -> ExprId {
        let kept = children(self.m, id);
        match self.m.closures[id.index()].clone() {
            Closure::Lobe(lobe) => self.emit(&lobe, wo),
            _ if kept.is_empty() => self.color(0.0),
            Closure::Weight(w, a) => {
                let inner = self.radiance(a, wo);
                self.op(Op::Mul, &[inner, w])
            }
            Closure::Layer(top, under) => {
                let under = self.radiance(under, wo);
                let paths = lobes(self.m, top);
                let (_, seen) = self.lobes(top, &paths);
                let passed = self.passed(seen);
                self.op(Op::Mul, &[under, passed])
            }
            _ if kept.len() == 1 => self.radiance(kept[0], wo),
            Closure::Add(x, y) => {
                let (x, y) = (self.radiance(x, wo), self.radiance(y, wo));
                self.op(Op::Add, &[x, y])
            }
            Closure::Mix(x, y, t) => {
                let (x, y) = (self.radiance(x, wo), self.radiance(y, wo));
                self.op(Op::Mix, &[x, y, t])
            }
            Closure::Select(c, x, y) => {
                let (x, y) = (self.radiance(x, wo), self.radiance(y, wo));
                self.op(Op::Select, &[c, x, y])
            }
        }
    }

    fn emit(&mut self, lobe: &Lobe, wo: ExprId) -> ExprId {
        let Methods::Edf { emit } = self.module.closures[lobe.def.index()].methods else {
            return wo;
        };
        self.at_lobe(lobe);
        let mut args = lobe.args.clone();
        args.push(wo);
        let value = self.call(emit, &args);
        self.at_material();
        value
    }
}

/// How an instance with the given values of the table emits, from its material's emission function.
///
/// It is uniform if nothing it reads differs over the surface, and every direction of the front
/// sees one radiance and every one of the back none. The former is seen from the code, the
/// latter is tried on directions of every elevation.
pub fn emission_kind(module: &Module, function: Option<&Function>, values: &[Const]) -> Emission {
    let Some(f) = function else {
        return Emission::None;
    };
    if reads_point(module, f) {
        return Emission::Varying;
    }
    let radiance = |z: f64, azimuth: f64| radiance(module, f, values, z, azimuth);
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
    f.evaluated().into_iter().any(|id| match &f.expr(id).kind {
        ExprKind::Field(base, i) => match (&f.expr(*base).kind, f.ty(*base)) {
            (ExprKind::Param(0), Type::Struct(s)) => {
                module.structs[s.index()].fields[*i as usize].0 != "geometric_normal"
            }
            _ => false,
        },
        ExprKind::Op(op, _) => op.texture_space().is_some(),
        _ => false,
    })
}

/// The radiance toward a direction of cosine `z` on a surface whose normal is z.
fn radiance(
    module: &Module,
    f: &Function,
    values: &[Const],
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
        .with_table(values)
        .run(f, vec![point, wo])
        .ok()?;
    match value.to_f64().as_slice() {
        [r, g, b] => Some([*r as f32, *g as f32, *b as f32]),
        _ => None,
    }
}
