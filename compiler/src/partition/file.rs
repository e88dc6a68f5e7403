//! Plan files: a plan by the names of its materials, so that it holds for every program that has
//! them, in whatever order.

use serde::{Deserialize, Serialize};

use super::error::list;
use super::text::find;
use super::{Form, Organisation, Plan, PlanError, PlanKernel};

/// The version of the format.
pub const VERSION: u32 = 1;

/// What makes a new file.
const REMAKE: &str = "make a new one with `impasto plan SCENE --save P.json`";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    version: u32,
    strategy: String,
    organisation: Organisation,
    kernels: Vec<Kernel>,
    #[serde(default)]
    unused: Vec<String>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Kernel {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    name: Option<String>,
    form: Form,
    materials: Vec<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    workgroup: Option<u32>,
}

/// What a file of any version has.
#[derive(Deserialize)]
struct Versioned {
    version: u32,
}

/// The text of a plan's file, for a program whose materials are called `names`.
pub fn write(plan: &Plan, names: &[String]) -> String {
    let named = |members: &[usize]| -> Vec<String> {
        members
            .iter()
            .filter_map(|m| names.get(*m).cloned())
            .collect()
    };
    let kernel = |kernel: &PlanKernel| Kernel {
        name: Some(kernel.name.clone()),
        form: kernel.form,
        materials: named(&kernel.materials),
        workgroup: kernel.workgroup,
    };
    let file = File {
        version: VERSION,
        strategy: plan.strategy.clone(),
        organisation: plan.organisation,
        kernels: plan.kernels.iter().map(kernel).collect(),
        unused: named(&plan.unused),
    };
    // Structs of strings and lists always have a JSON text.
    let text = serde_json::to_string_pretty(&file).unwrap_or_default();
    format!("{text}\n")
}

/// The plan that the text of a file describes, for materials called `names`.
///
/// # Errors
/// What is wrong with it, or why it does not fit the materials, and what to do.
pub fn read(text: &str, names: &[String]) -> Result<Plan, PlanError> {
    let broken =
        |e: serde_json::Error| PlanError::new(format!("the plan cannot be read: {e}")).hint(REMAKE);
    let Versioned { version } = serde_json::from_str(text).map_err(broken)?;
    if version != VERSION {
        let message = format!("the plan has version {version}, and this program reads {VERSION}");
        return Err(PlanError::new(message).hint(REMAKE));
    }
    let file: File = serde_json::from_str(text).map_err(broken)?;
    check_names(&file, names)?;
    let plan = resolve(file, names);
    plan.check_named(names)
        .map_err(|e| PlanError::new(format!("the plan cannot be run: {e}")))?;
    Ok(plan)
}

/// The file and the program have the same materials.
fn check_names(file: &File, names: &[String]) -> Result<(), PlanError> {
    let kernels = file.kernels.iter().flat_map(|k| &k.materials);
    let planned: Vec<&str> = kernels.chain(&file.unused).map(String::as_str).collect();
    let known = |name: &str| names.iter().any(|n| n == name);
    let extra: Vec<&str> = planned.iter().copied().filter(|n| !known(n)).collect();
    if !extra.is_empty() {
        let message = format!("the plan has {}, which the scene lacks", list(extra));
        return Err(PlanError::new(message).hint(REMAKE));
    }
    let missing = names.iter().map(String::as_str);
    let missing: Vec<&str> = missing.filter(|n| !planned.contains(n)).collect();
    if !missing.is_empty() {
        let message = format!("the plan lacks {}, which the scene has", list(missing));
        return Err(PlanError::new(message).hint(REMAKE));
    }
    Ok(())
}

/// The plan by indices. Every name is known.
fn resolve(file: File, names: &[String]) -> Plan {
    let indices = |members: &[String]| -> Vec<usize> {
        members.iter().filter_map(|n| find(n, names).ok()).collect()
    };
    let unused = indices(&file.unused);
    let kernels = file.kernels.into_iter().map(|given| {
        let kernel = PlanKernel::new(given.form, indices(&given.materials), names);
        PlanKernel {
            name: given.name.unwrap_or(kernel.name),
            workgroup: given.workgroup,
            ..kernel
        }
    });
    let plan = Plan::of_kernels(file.strategy, kernels.collect(), unused);
    Plan {
        organisation: file.organisation,
        ..plan
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

    fn plan() -> Plan {
        let groups = [(Form::Inline, vec![2]), (Form::Own, vec![0])];
        Plan::wavefront("auto", groups, vec![1], &names())
    }

    #[track_caller]
    fn refused(text: &str, message: &str) {
        let error = read(text, &names()).expect_err(text).to_string();
        assert!(error.contains(message), "{error}");
        assert!(error.contains("hint: "), "{error}");
    }

    #[test]
    fn what_is_written_reads_back() {
        assert_eq!(read(&write(&plan(), &names()), &names()), Ok(plan()));
        let mut wide = plan();
        wide.kernels[1].workgroup = Some(384);
        assert_eq!(read(&write(&wide, &names()), &names()), Ok(wide));
        let names = names();
        for strategy in by_names() {
            let plan = strategy.plan(&PlanInputs::of_names(&names)).expect("names");
            assert_eq!(read(&write(&plan, &names), &names), Ok(plan));
        }
    }

    #[test]
    fn materials_may_come_in_another_order() {
        let other = ["wall", "paint", "glass"].map(String::from);
        let read = read(&write(&plan(), &names()), &other).expect("it fits");
        assert_eq!(read.kernels[0].materials, [0]);
        assert_eq!((read.kernels[1].materials[0], read.unused[0]), (1, 2));
    }

    #[test]
    fn names_of_kernels_may_be_left_out() {
        let text = write(&plan(), &names()).replace("\"name\": \"material_paint\",", "");
        assert_eq!(read(&text, &names()), Ok(plan()));
    }

    #[test]
    fn what_does_not_fit_is_said() {
        let text = write(&plan(), &names());
        refused(
            &text.replace("\"version\": 1", "\"version\": 2"),
            "version 2",
        );
        refused(&text[..text.len() / 2], "line ");
        refused("", "cannot be read");
        refused("{}", "missing field `version`");
        refused(
            &text.replace("\"form\"", "\"from\""),
            "unknown field `from`",
        );
        refused(
            &text.replace("inline", "inlined"),
            "unknown variant `inlined`",
        );
        refused(
            &text.replace("\"glass\"", "\"water\""),
            "has `water`, which the scene lacks",
        );
        refused(
            &text.replace("\"glass\"", ""),
            "lacks `glass`, which the scene has",
        );
        refused(
            &text.replace("\"glass\"", "\"glass\", \"wall\""),
            "`wall` is in",
        );
    }
}
