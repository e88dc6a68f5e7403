//! What fills an object, as numbers: evaluated on the host once an instance, since it is the same
//! everywhere in it.

use crate::abi::Medium;
use crate::ir::interp::{Interpreter, OutOfFuel};
use crate::ir::value::Value;
use crate::ir::{Const, ExprId, Material, Module};
use crate::passes;

/// The medium inside an instance whose parameters are `values`; none if the material has no
/// interior, or these values leave it out.
///
/// # Errors
/// If it takes more operations than the host spends on an instance.
pub fn medium(
    module: &Module,
    m: &Material,
    values: &[Const],
) -> Result<Option<Medium>, OutOfFuel> {
    let Some(interior) = &m.interior else {
        return Ok(None);
    };
    let number = |id: ExprId| -> Result<Value<f64>, OutOfFuel> {
        let mut f = m.body.clone();
        (f.value, f.result) = (id, f.ty(id));
        passes::drop_dead_code(&mut f);
        // Sema saw to it that the point is not read.
        let args = f.params.iter().map(|p| Value::zero(p.ty, &module.structs));
        let args = args.collect();
        Interpreter::new(module, passes::HOIST_FUEL)
            .with_uniforms(values)
            .run(&f, args)
    };
    if let Some(when) = interior.when
        && !number(when)?.as_bool()
    {
        return Ok(None);
    }
    let absorption = number(interior.absorption)?.to_f64();
    let channel = |c: usize| {
        absorption
            .get(c)
            .map_or(0.0, |&x| x.clamp(0.0, 1e30) as f32)
    };
    Ok(Some(Medium {
        absorption: std::array::from_fn(channel),
        ior: number(interior.ior)?.as_float() as f32,
        priority: u32::try_from(number(interior.priority)?.as_int()).unwrap_or(0),
    }))
}
