//! `own`: a kernel for each material.

use super::{Request, Rule, StrategyRow};
use crate::partition::{Form, Groups, Plan, Strategy};

pub(super) const ROW: StrategyRow = StrategyRow {
    older_names: &["wavefront"],
    ..StrategyRow::new("own", "a kernel for each material", Rule::Names(groups))
};

impl Strategy {
    /// Wavefront; each material has its own kernel.
    pub const OWN: Strategy = Strategy::new(&ROW);
}

impl Plan {
    /// The plan of [`Strategy::OWN`], which lacks nothing: materials are called `names`, and no surface
    /// binds those of `unused`.
    pub fn own(names: &[String], unused: &[usize]) -> Plan {
        Strategy::OWN.plan_by_names(groups, names, unused)
    }
}

impl Plan {
    /// Most kernels of [`Plan::few_kernels`].
    pub const FEW: usize = 64;

    /// [`Plan::own`], where that makes at most [`Plan::FEW`] kernels; else mixed kernels of so many
    /// neighbours each that they are no more. Each kernel takes a driver some time, and memory for a
    /// queue, so a kernel for each of very many materials would never be ready.
    pub fn few_kernels(names: &[String], unused: &[usize]) -> Plan {
        Strategy::OWN.plan_by_names(few, names, unused)
    }
}

fn few(request: &Request<'_>) -> Groups {
    let together = request.materials.len().div_ceil(Plan::FEW).max(1);
    let kernels = request.materials.chunks(together);
    kernels
        .map(|members| {
            let form = match members.len() {
                1 => Form::Own,
                _ => Form::Mixed,
            };
            (form, members.to_vec())
        })
        .collect()
}

fn groups(request: &Request<'_>) -> Groups {
    let materials = request.materials.iter();
    materials.map(|m| (Form::Own, vec![*m])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn very_many_materials_get_few_kernels() {
        for count in [1, 64, 65, 1000] {
            let names: Vec<String> = (0..count).map(|i| format!("m{i}")).collect();
            let plan = Plan::few_kernels(&names, &[0]);
            let mut members: Vec<usize> = plan
                .kernels
                .iter()
                .flat_map(|k| k.materials.clone())
                .collect();
            members.sort_unstable();
            assert_eq!(members, (1..count).collect::<Vec<_>>());
            assert!(plan.kernels.len() <= Plan::FEW);
            if count <= Plan::FEW {
                assert_eq!(plan, Plan::own(&names, &[0]));
            }
        }
    }
}
