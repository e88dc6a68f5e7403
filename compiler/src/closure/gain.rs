//! Finds out whether a material whose look depends on the view sends out more light than falls on it.
//!
//! The checker sees weights and sums that are constants. What depends on the view is tried: the albedo of
//! the whole material, seen from every elevation.

use super::{Core, probe};
use crate::ir::interp::Interpreter;
use crate::ir::value::Value;
use crate::ir::{Const, Material, Module, Type};

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
