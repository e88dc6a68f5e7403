//! Finds out whether a material sends out more light than falls on it.
//!
//! The checker sees weights and sums that are constants. Of what depends on the view the albedo of the whole
//! material is tried, seen from every elevation; of lobes with the same arguments all over the surface
//! their own albedo, so that no list says which parameters are reflectances.

use super::{Core, probe, surface_lobes};
use crate::ir::interp::Interpreter;
use crate::ir::value::Value;
use crate::ir::{Const, ExprKind, Lobe, Material, Methods, Module, Type};
use crate::source::Span;

/// Elevations that are tried.
const VIEWS: u32 = 24;

/// Rounding, and albedos that are fits, are no gain.
const SLACK: f64 = 1.01;

/// Operations that a view may take.
const FUEL: u64 = 1 << 20;

/// The view from which a material gains the most light.
#[derive(Clone, Copy, Debug)]
pub struct Gain {
    /// Degrees from the normal.
    pub angle: f64,
    /// What it scatters of the light from there.
    pub albedo: f64,
}

/// How a material gains light at a point like any other, with values for its parameters; nothing if it does
/// not, or cannot be tried.
pub fn gain(module: &Module, core: &Core, m: &Material, values: &[Const]) -> Option<Gain> {
    let probe = probe(module, core, m);
    let texture = |_: &_| [0.5; 4];
    let albedo = |angle: f64| -> Option<f64> {
        let (s, z) = angle.sin_cos();
        let wo = [s, 0.0, z];
        let args = vec![flat_point(&probe.module, core, wo), Value::vector(&wo)];
        let mut run = Interpreter::<f64>::new(&probe.module, FUEL)
            .with_params(values)
            .with_texture(&texture);
        let found = run.run(&probe.function, args).ok()?;
        let mut sum = [0.0; 3];
        let mut at = probe.patterns.len();
        for lobe in &probe.lobes {
            at += lobe.params.len();
            let [albedo, weight] = [at, at + 1].map(|i| found.field(i).map(Value::to_f64));
            for (c, part) in sum.iter_mut().enumerate() {
                let of = |v: &Option<Vec<f64>>| v.as_ref()?.get(c).copied();
                *part += of(&albedo)? * of(&weight)?;
            }
            at += 3;
        }
        Some(sum.into_iter().fold(0.0, f64::max))
    };
    let mut most: Option<Gain> = None;
    for view in 0..VIEWS {
        let angle = (f64::from(view) + 0.5) / f64::from(VIEWS) * std::f64::consts::FRAC_PI_2;
        let albedo = albedo(angle)?;
        if albedo > most.map_or(SLACK, |m| m.albedo) {
            let angle = angle.to_degrees();
            most = Some(Gain { angle, albedo });
        }
    }
    most
}

/// A point of a flat surface whose normal is z, at home in its object.
fn flat_point(module: &Module, core: &Core, view: [f64; 3]) -> Value<f64> {
    let fields = &module.structs[core.surface_point.index()].fields;
    let field = |(name, ty): &(String, Type)| match (name.as_str(), ty) {
        ("normal" | "geometric_normal", _) => Value::vector(&[0.0, 0.0, 1.0]),
        ("view", _) => Value::vector(&view),
        ("exterior_ior" | "object_scale", _) => Value::float(1.0),
        ("vertex_color", _) => Value::vector(&[1.0; 3]),
        (_, Type::Mat3) => Value::Mat3([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
        _ => Value::zero(*ty, &module.structs),
    };
    Value::Struct(fields.iter().map(field).collect())
}

/// A lobe that scatters more light than falls on it, by arguments that are the same all over the surface.
#[derive(Clone, Debug)]
pub struct Excess {
    /// Its bsdf.
    pub bsdf: String,
    /// Where it was written.
    pub span: Span,
    /// The albedo of the brightest channel.
    pub albedo: f64,
    /// The parameters of the material among its arguments that exceed one, by number.
    pub params: Vec<usize>,
}

/// The lobes of a material that scatter too much with values for its parameters.
pub fn excesses(module: &Module, m: &Material, values: &[Const]) -> Vec<Excess> {
    let lobes = surface_lobes(m);
    let found = lobes
        .iter()
        .filter_map(|path| excess(module, m, path.lobe, values));
    found.collect()
}

fn excess(module: &Module, m: &Material, lobe: &Lobe, values: &[Const]) -> Option<Excess> {
    let def = &module.closures[lobe.def.index()];
    let Methods::Bsdf { albedo, .. } = def.methods else {
        return None;
    };
    let above = |c: &Const| matches!(c, Const::Float(v) if v.iter().any(|x| *x > 1.0));
    let mut args = Vec::with_capacity(lobe.args.len() + 1);
    let mut params = Vec::new();
    let mut is_bright = false;
    for arg in &lobe.args {
        let value = match &m.body.expr(*arg).kind {
            ExprKind::Const(value) => value,
            ExprKind::MaterialParam(p) => {
                let value = values.get(*p as usize)?;
                if above(value) {
                    params.push(*p as usize);
                }
                value
            }
            // It differs from point to point.
            _ => return None,
        };
        is_bright |= above(value);
        args.push(Value::constant(value));
    }
    if !is_bright {
        return None;
    }
    args.push(Value::vector(&[0.6, 0.0, 0.8]));
    let method = &module.functions[albedo.index()];
    let found = Interpreter::<f64>::new(module, FUEL)
        .run(method, args)
        .ok()?;
    let albedo = found.to_f64().into_iter().fold(0.0, f64::max);
    (albedo > SLACK).then(|| Excess {
        bsdf: def.name.clone(),
        span: lobe.span,
        albedo,
        params,
    })
}
