//! What makes a plan one that can be run.

use std::ops::RangeInclusive;

use super::error::list;
use super::{Form, Organisation, Plan, PlanError, PlanKernel};

/// The threads that workgroups have on GPUs that have the largest.
const WORKGROUPS: RangeInclusive<u32> = 1..=1024;

impl Plan {
    /// Holds the plan to its rules for a program of `materials` materials: each is in exactly one kernel
    /// or unused; no kernel is empty; an own kernel has one member; at most one kernel is inline, and has no workgroups of its own; a
    /// megakernel is the only one, and inline.
    ///
    /// # Errors
    /// The first rule that is broken. Materials are called by their indices.
    pub fn check(&self, materials: usize) -> Result<(), PlanError> {
        let names: Vec<String> = (0..materials).map(|m| format!("material {m}")).collect();
        self.check_named(&names)
    }

    /// As [`Plan::check`], for a program whose materials are called `names`.
    ///
    /// # Errors
    /// The first rule that is broken.
    pub fn check_named(&self, names: &[String]) -> Result<(), PlanError> {
        self.kernels.iter().try_for_each(check_kernel)?;
        self.check_places(names)?;
        let inline = self.kernels.iter().filter(|k| !k.form.has_queue());
        let inline: Vec<&str> = inline.map(|k| k.name.as_str()).collect();
        if inline.len() > 1 {
            let message = format!("it has several inline kernels: {}", list(inline));
            return Err(PlanError::new(message)
                .hint("what is inline is part of one kernel, logic: make them one"));
        }
        let whole = inline.len() == self.kernels.len();
        match self.organisation {
            Organisation::Mega if !whole => Err(PlanError::new(
                "a megakernel evaluates every material inline, and it has other kernels",
            )),
            _ => Ok(()),
        }
    }

    /// Holds the plan to leaving out only materials of `unbound`, which no surface of the scene binds.
    ///
    /// # Errors
    /// The first material that a surface binds and that has no kernel.
    pub fn check_unused(&self, unbound: &[usize], names: &[String]) -> Result<(), PlanError> {
        let missed = self.unused.iter().find(|m| !unbound.contains(m));
        let name = |m: &usize| names.get(*m).map_or("?", String::as_str);
        match missed {
            None => Ok(()),
            Some(m) => {
                let name = name(m);
                let message =
                    format!("it has no kernel for `{name}`, which is on a surface of the scene");
                Err(PlanError::new(message)
                    .hint("make a new one with `impasto plan SCENE --save P.json`"))
            }
        }
    }

    /// Each material has exactly one place.
    fn check_places(&self, names: &[String]) -> Result<(), PlanError> {
        let mut places: Vec<Vec<&str>> = vec![Vec::new(); names.len()];
        let kernels = self.kernels.iter();
        let kernels = kernels.map(|k| (k.name.as_str(), &k.materials));
        for (place, members) in kernels.chain([("unused", &self.unused)]) {
            for &m in members {
                let Some(of) = places.get_mut(m) else {
                    let message =
                        format!("`{place}` has material {m}, and there are {}", names.len());
                    return Err(PlanError::new(message).hint("materials count from 0"));
                };
                of.push(place);
            }
        }
        let twice = places.iter().position(|of| of.len() > 1);
        if let Some(m) = twice {
            let message = format!("`{}` is in {}", names[m], list(places[m].iter().copied()));
            return Err(PlanError::new(message).hint("each material has one place"));
        }
        let missing = names.iter().zip(&places).filter(|(_, of)| of.is_empty());
        let missing: Vec<&str> = missing.map(|(name, _)| name.as_str()).collect();
        if missing.is_empty() {
            Ok(())
        } else {
            Err(PlanError::new(format!(
                "it has no kernel for {}",
                list(missing)
            )))
        }
    }
}

fn check_kernel(kernel: &PlanKernel) -> Result<(), PlanError> {
    let (name, members) = (&kernel.name, kernel.materials.len());
    if members == 0 {
        return Err(PlanError::new(format!("kernel `{name}` has no material")));
    }
    if members > 1 && !kernel.form.takes_several() {
        let form = kernel.form.name();
        let message = format!("kernel `{name}` is {form} and has {members} materials");
        let several = list(Form::queued_of_members(members).map(Form::name));
        return Err(PlanError::new(message).hint(format!("{several} take several")));
    }
    match kernel.workgroup {
        Some(_) if !kernel.form.has_queue() => {
            let message = format!("kernel `{name}` is inline and has workgroups of its own");
            Err(PlanError::new(message).hint("what is inline is part of other kernels"))
        }
        Some(threads) if !WORKGROUPS.contains(&threads) => {
            let message = format!("kernel `{name}` has workgroups of {threads} threads");
            let (least, most) = (WORKGROUPS.start(), WORKGROUPS.end());
            Err(PlanError::new(message).hint(format!("they have {least} to {most}")))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::PlanInputs;
    use super::super::cases::by_names;
    use super::*;

    fn names() -> Vec<String> {
        ["paint", "glass", "wall"].map(String::from).to_vec()
    }

    fn plan(groups: &[(Form, &[usize])], unused: &[usize]) -> Plan {
        let groups = groups.iter().map(|(form, m)| (*form, m.to_vec()));
        Plan::wavefront("test", groups, unused.to_vec(), &names())
    }

    #[track_caller]
    fn refused(plan: &Plan, part: &str) {
        let error = plan.check_named(&names()).expect_err("it breaks a rule");
        assert!(error.to_string().contains(part), "{error}");
        assert!(plan.check(3).is_err());
    }

    #[test]
    fn plans_of_strategies_keep_the_rules() {
        for strategy in by_names() {
            for count in [0, 1, 3] {
                let names = &names()[..count];
                let plan = strategy.plan(&PlanInputs::of_names(names)).expect("names");
                assert_eq!(plan.check_named(names), Ok(()), "{strategy:?} {count}");
                if count == 3 {
                    let fewer = plan.leaving_out(&[1]);
                    assert_eq!(fewer.check_named(names), Ok(()), "{strategy:?}");
                    assert_eq!(fewer.unused, [1]);
                    assert_eq!(fewer.check_unused(&[0, 1], names), Ok(()));
                    let missed = fewer.check_unused(&[0], names).expect_err("1 is bound");
                    assert!(missed.message().contains("no kernel for `glass`"));
                    assert!(fewer.kernels.iter().all(|k| !k.materials.contains(&1)));
                }
            }
        }
        let all = plan(&[(Form::Own, &[0]), (Form::Binned, &[1, 2])], &[]);
        assert_eq!(all.check(3), Ok(()));
        assert!(all.check(4).is_err());
    }

    #[test]
    fn each_broken_rule_is_said() {
        refused(
            &plan(&[(Form::Mixed, &[0, 1])], &[]),
            "no kernel for `wall`",
        );
        let twice = plan(&[(Form::Mixed, &[0, 1, 2]), (Form::Own, &[1])], &[]);
        refused(
            &twice,
            "`glass` is in `material_mixed` and `material_glass`",
        );
        let both = plan(&[(Form::Mixed, &[0, 1, 2])], &[2]);
        refused(&both, "`wall` is in `material_mixed` and `unused`");
        refused(
            &plan(&[(Form::Mixed, &[0, 1, 2, 3])], &[]),
            "has material 3, and there are 3",
        );
        refused(
            &plan(&[(Form::Mixed, &[0, 1, 2])], &[7]),
            "`unused` has material 7",
        );
        refused(
            &plan(&[(Form::Own, &[0, 1, 2])], &[]),
            "is own and has 3 materials",
        );
        let empty = plan(&[(Form::Mixed, &[0, 1, 2]), (Form::Binned, &[])], &[]);
        refused(&empty, "kernel `material_binned` has no material");
        let inline = plan(&[(Form::Inline, &[0]), (Form::Inline, &[1, 2])], &[]);
        refused(
            &inline,
            "several inline kernels: `material_inline` and `material_inline_2`",
        );
        let mega = Plan {
            organisation: Organisation::Mega,
            ..plan(&[(Form::Own, &[0]), (Form::Inline, &[1, 2])], &[])
        };
        refused(&mega, "a megakernel evaluates every material inline");
    }

    #[test]
    fn kernels_have_different_names() {
        let names = ["mixed", "a", "b", "c"].map(String::from);
        let groups = [
            (Form::Mixed, vec![1]),
            (Form::Own, vec![0]),
            (Form::Mixed, vec![3, 2]),
        ];
        let plan = Plan::wavefront("test", groups, Vec::new(), &names);
        let called: Vec<&str> = plan.kernels.iter().map(|k| k.name.as_str()).collect();
        assert_eq!(
            called,
            ["material_mixed", "material_mixed_2", "material_mixed_3"]
        );
        assert_eq!(plan.kernels[2].materials, [2, 3]);
    }
}
