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
            .with_params(values)
            .run(&f, args)
    };
    if let Some(when) = interior.when
        && !number(when)?.as_bool()
    {
        return Ok(None);
    }
    let [absorption, ior, priority, scattering, anisotropy] = interior.parts;
    let rate = |id: ExprId| -> Result<[f32; 3], OutOfFuel> {
        let channels = number(id)?.to_f64();
        let channel = |c: usize| channels.get(c).map_or(0.0, |x| x.clamp(0.0, 1e30) as f32);
        Ok(std::array::from_fn(channel))
    };
    Ok(Some(Medium {
        absorption: rate(absorption)?,
        ior: number(ior)?.as_float() as f32,
        priority: u32::try_from(number(priority)?.as_int()).unwrap_or(0),
        scattering: rate(scattering)?,
        anisotropy: number(anisotropy)?.as_float() as f32,
    }))
}
