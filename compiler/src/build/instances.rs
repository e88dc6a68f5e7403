//! Instances of a material: the values that share its code, and what the host computes of them.

use std::collections::BTreeSet;

use super::{errors, interior};
use crate::abi::{Emission, InstanceInfo};
use crate::closure;
use crate::diag::Diagnostic;
use crate::ir::{Const, Material, Module};
use crate::passes::MaterialState;
use crate::program::Instance;

/// Values for a material's parameters, and who wants them.
#[derive(Clone, Debug)]
pub(crate) struct Setting {
    /// The instance's name.
    pub name: String,
    /// A value for every parameter.
    pub values: Vec<Const>,
    /// Must the code hold for other values as well?
    pub open: bool,
    /// Parameters that have other values at other times.
    pub moving: Vec<usize>,
}

/// The values of the parameters on which all settings agree for good.
pub(super) fn agreed(settings: &[Setting]) -> Vec<Option<Const>> {
    let Some((first, others)) = settings.split_first() else {
        return Vec::new();
    };
    let same = |(i, value): (usize, &Const)| {
        let agree = others.iter().all(|s| s.values.get(i) == Some(value));
        (agree && !settings.iter().any(|s| s.open || s.moving.contains(&i))).then(|| value.clone())
    };
    first.values.iter().enumerate().map(same).collect()
}

/// The instances of a material that has been through all passes, and will have number `number`.
pub(super) fn instances(
    module: &Module,
    state: &MaterialState,
    settings: &[Setting],
    number: usize,
) -> Result<Vec<Instance>, Diagnostic> {
    let instances = settings.iter().map(|s| instance(module, state, s, number));
    let mut instances: Vec<Instance> = instances.collect::<Result<_, _>>()?;
    // Where one instance must be evaluated as it is hit, the code for it is there for all.
    if instances
        .iter()
        .any(|i| i.info.emission == Emission::Varying)
    {
        let emitting = instances
            .iter_mut()
            .filter(|i| i.info.emission != Emission::None);
        emitting.for_each(|i| i.info.emission = Emission::Varying);
    }
    Ok(instances)
}

fn instance(
    module: &Module,
    state: &MaterialState,
    setting: &Setting,
    number: usize,
) -> Result<Instance, Diagnostic> {
    let too_long = |_| errors::too_long(&state.material, &setting.name);
    let mut values = Vec::new();
    for part in &state.hoisted {
        values.extend(part.evaluate(module, &setting.values).map_err(too_long)?);
    }
    let medium = interior::medium(module, &state.material, &setting.values).map_err(too_long)?;
    let emission = closure::emission_kind(module, state.emission(), &values);
    Ok(Instance {
        info: InstanceInfo {
            name: setting.name.clone(),
            material: number,
            emission,
            medium,
        },
        values,
        row: 0,
    })
}

/// Textures that a material may read: its texture parameters, and those its file names.
pub(super) fn textures(
    material: &Material,
    settings: &[Setting],
    literal: &BTreeSet<usize>,
) -> Vec<usize> {
    let textures: BTreeSet<usize> = settings
        .iter()
        .flat_map(|s| material.params.iter().zip(&s.values))
        .filter(|(p, _)| p.surface_type == "texture")
        .filter_map(|(_, v)| match v {
            Const::Int(t) => usize::try_from(*t).ok(),
            _ => None,
        })
        .chain(literal.iter().copied())
        .collect();
    textures.into_iter().collect()
}
