//! Kernels and what they take, as a window lists them.

use impasto_compiler::Program;
use impasto_compiler::partition::{Organisation, Plan, Strategy};
use impasto_runtime::device::Device;
use impasto_runtime::render::Sitting;
use impasto_viewer::engine::{Kernel, Kernels};

use super::built::Built;
use super::survey::Survey;
use crate::plan::OnProcessor;

/// The kernels that render, since a sitting began, with what was found beside the picture.
pub(super) fn of(built: &Built<'_>, sitting: &Sitting, survey: Option<&Survey>) -> Kernels {
    let survey = survey.filter(|survey| survey.origin == Some(built.origin));
    let explained = survey.and_then(|survey| survey.explained.as_ref());
    let explained = explained.filter(|(plan, _)| plan == built.renderer.plan());
    let reports = built.renderer.kernels_of(sitting);
    let all: f64 = reports.iter().map(|kernel| kernel.gpu_seconds).sum();
    let is_timed = built.renderer.is_timed() && all > 0.0;
    let kernel = |report: impasto_runtime::render::report::KernelReport| Kernel {
        share: is_timed.then(|| (report.gpu_seconds / all) as f32),
        name: report.name,
        materials: report.materials,
    };
    Kernels {
        device: built.renderer.maker().device,
        strategy: built.renderer.strategy().to_owned(),
        kernels: reports.into_iter().map(kernel).collect(),
        reasons: match explained {
            Some((_, lines)) if !lines.is_empty() => lines.clone(),
            _ => built.reasons.clone(),
        },
        operations: match survey {
            Some(survey) => survey.operations.clone(),
            None => vec![None; built.scene.materials.len()],
        },
    }
}

/// Why materials share kernels as they do, a line each.
pub(super) fn reasons(
    asked: &Plan,
    runs: &Plan,
    program: &Program,
    device: &Device,
) -> Vec<String> {
    let names: Vec<String> = program.materials().map(|m| m.name.clone()).collect();
    let mut reasons = Vec::new();
    if let Device::Cpu(_) = device {
        let replaced = (asked.strategy != runs.strategy).then(|| asked.strategy.clone());
        let on = OnProcessor::new(runs, &names, &device.info(), replaced);
        reasons.push(on.why);
        let replaced = on.replaced_strategy.into_iter();
        reasons.extend(replaced.map(|asked| format!("`{asked}` is for GPUs")));
    } else if let Ok(strategy) = Strategy::parse(&asked.strategy) {
        let help = strategy.row().help;
        reasons.push(format!("`{}`: {help}", asked.strategy));
        if strategy == Strategy::AUTO {
            reasons.push(AUTO.into());
        }
    }
    if runs.organisation == Organisation::Mega {
        reasons.push("one kernel takes a path from its beginning to its end".into());
    }
    let named = |index: &usize| names.get(*index).map(String::as_str);
    let unused: Vec<&str> = runs.unused.iter().filter_map(named).collect();
    if !unused.is_empty() {
        reasons.push(format!("on no surface: {}", unused.join(", ")));
    }
    reasons
}

/// What `auto` does while one changes things.
const AUTO: &str = "a kernel a material while things change; on a GPU of its own a plan is made once the picture is left \
                    alone";
