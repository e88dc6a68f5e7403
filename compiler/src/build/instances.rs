//! Instances of a material: the values that share its code, and what the host computes of them.

use std::collections::BTreeSet;

use super::{errors, interior};
use crate::abi::{Emission, InstanceInfo};
use crate::closure;
use crate::diag::Diagnostic;
use crate::ir::interp::OutOfFuel;
use crate::ir::{Const, Function, Material, Module};
use crate::passes::{Hoisted, MaterialState};
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
    let made = |setting: &Setting| {
        let parts = (&state.material, &state.hoisted[..], state.emission());
        let too_long = |_| errors::too_long(&state.material, &setting.name);
        let name = setting.name.clone();
        instance(module, parts, name, &setting.values, number).map_err(too_long)
    };
    let mut instances: Vec<Instance> = settings.iter().map(made).collect::<Result<_, _>>()?;
    share_emission(instances.iter_mut());
    Ok(instances)
}

/// Where one instance of a material must be evaluated as it is hit, the code for it is there for all.
pub(crate) fn share_emission<'i>(instances: impl Iterator<Item = &'i mut Instance>) {
    let instances: Vec<&mut Instance> = instances.collect();
    if instances
        .iter()
        .any(|i| i.info.emission == Emission::Varying)
    {
        let emitting = instances
            .into_iter()
            .filter(|i| i.info.emission != Emission::None);
        emitting.for_each(|i| i.info.emission = Emission::Varying);
    }
}

/// An instance of material number `number`: the material with what the host computes of its parameters, and its
/// emission.
pub(crate) fn instance(
    module: &Module,
    (material, hoisted, emission): (&Material, &[Hoisted], Option<&Function>),
    name: String,
    parameters: &[Const],
    number: usize,
) -> Result<Instance, OutOfFuel> {
    let mut values = Vec::new();
    for part in hoisted {
        values.extend(part.evaluate(module, parameters)?);
    }
    let medium = interior::medium(module, material, parameters)?;
    let emission = closure::emission_kind(module, emission, &values);
    Ok(Instance {
        info: InstanceInfo {
            name,
            material: number,
            emission,
            medium,
        },
        parameters: parameters.to_vec(),
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
