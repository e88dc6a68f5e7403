//! What the language server asks of the rest: plans of scenes, previews, and files as they were committed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;

use impasto_compiler::partition::{DeviceProfile, PlanInputs, Strategy};
use impasto_compiler::{Loader, Program, compile_until, diag};
use impasto_lsp::{Host, PlannedMaterial, ScenePlan};
use impasto_runtime::device::{Device, DeviceOptions};
use impasto_runtime::scene::{Asked, Scene};
use impasto_runtime::world;

use crate::plan::{OnProcessor, SceneMaterials, unused, workload};

/// At how many points materials are evaluated for a plan.
const SAMPLES: usize = 256;

/// The part of Impasto that editors reach through the language server.
#[derive(Debug, Default)]
pub struct Workbench {
    /// The device that plans are for; opened when the first is made.
    device: Mutex<Option<Device>>,
    options: DeviceOptions,
}

impl Workbench {
    /// One whose plans are for the device that `options` say.
    pub fn new(options: DeviceOptions) -> Self {
        Self {
            device: Mutex::default(),
            options,
        }
    }
}

/// Nobody waits for what was begun.
const STOPPED: &str = "nobody waits for it any more";

impl Host for Workbench {
    fn plan(
        &self,
        path: &Path,
        text: Option<String>,
        loader: &mut dyn Loader,
        stop: &dyn Fn() -> bool,
    ) -> Result<ScenePlan, String> {
        let file = match text {
            Some(text) => world::open_edited(path, text),
            None => world::open(path),
        };
        let scene = file.and_then(|file| file.scene(&Asked::default()));
        let scene = scene.map_err(|e| e.to_string())?;
        let compiled = compile_until(&scene.requests(), loader, false, stop);
        if stop() {
            return Err(STOPPED.into());
        }
        let program = compiled.program.ok_or_else(|| {
            let text = diag::render::text(&compiled.sources, &compiled.diagnostics, false);
            format!("its materials have errors\n{text}")
        })?;
        let mut device = self.device.lock().unwrap_or_else(|e| e.into_inner());
        let device = match &mut *device {
            Some(device) => device,
            none => none.insert(Device::open(&self.options).map_err(|e| e.to_string())?),
        };
        let kernels = match device {
            Device::Gpu(gpu) => of_gpu(gpu, &scene, &program, stop)?,
            Device::Cpu(_) => of_processor(device, &scene, &program)?,
        };
        Ok(kernels.of_scene(&scene, &program))
    }

    fn preview(&self, path: &Path) -> Result<(), String> {
        let program = std::env::current_exe().map_err(|e| format!("no preview: {e}"))?;
        let begun = Command::new(program)
            .arg("view")
            .arg(path)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn();
        let mut window = begun.map_err(|e| format!("no preview of `{}`: {e}", path.display()))?;
        // Somebody must wait for it, or it stays on as a name without a process.
        std::thread::spawn(move || window.wait());
        Ok(())
    }

    fn committed(&self, path: &Path) -> Option<String> {
        let (folder, name) = (path.parent()?, path.file_name()?);
        let output = Command::new("git")
            .arg("-C")
            .arg(folder)
            .arg("show")
            .arg(format!("HEAD:./{}", name.to_str()?))
            .stdin(Stdio::null())
            .stderr(Stdio::null())
            .output()
            .ok()?;
        let text = output.status.success().then_some(output.stdout)?;
        String::from_utf8(text).ok()
    }

    fn library_folder(&self) -> Option<PathBuf> {
        let of = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty());
        let cache = of("XDG_CACHE_HOME").map(PathBuf::from);
        let home = || of("HOME").map(|home| PathBuf::from(home).join(".cache"));
        let windows = || of("LOCALAPPDATA").map(PathBuf::from);
        let folder = cache.or_else(home).or_else(windows)?;
        Some(folder.join("impasto"))
    }
}

/// What a plan says of the materials of a program.
struct Kernels {
    about: String,
    /// In words what evaluates each, and why, by the material's name.
    of: BTreeMap<String, (String, String)>,
}

impl Kernels {
    fn of_scene(&self, scene: &Scene, program: &Program) -> ScenePlan {
        let names: Vec<&str> = program.materials().map(|m| m.name.as_str()).collect();
        let instances = program.instances();
        let planned = scene.materials.iter().zip(instances).map(|(binding, i)| {
            let none = || ("no kernel".to_owned(), "no surface binds it".to_owned());
            let kernel = names
                .get(i.info.material)
                .and_then(|name| self.of.get(*name));
            let (kernel, why) = kernel.cloned().unwrap_or_else(none);
            PlannedMaterial {
                file: impasto_lsp::documents::normal(&scene.base.join(&binding.file)).into(),
                material: binding.material.clone(),
                binding: binding.name.clone(),
                kernel,
                why,
            }
        });
        ScenePlan {
            about: self.about.clone(),
            materials: planned.collect(),
        }
    }
}

fn of_gpu(
    gpu: &crate::Gpu,
    scene: &Scene,
    program: &Program,
    stop: &dyn Fn() -> bool,
) -> Result<Kernels, String> {
    let materials = SceneMaterials::new(scene, program, SAMPLES);
    if stop() {
        return Err(STOPPED.into());
    }
    let workload = workload(gpu, scene, program, None).map_err(|e| e.to_string())?;
    let info = gpu.info();
    let profile = DeviceProfile::shipped(&info.name, info.kind).map_err(|e| e.to_string())?;
    let inputs = materials.inputs(&workload, &profile.profile);
    let plan = Strategy::AUTO.plan(&inputs).map_err(|e| e.to_string())?;
    let explanation = materials.explained(&plan, &workload, &profile.profile, profile.exact);
    let explanation = explanation.map_err(|e| e.to_string())?;
    let mut of = BTreeMap::new();
    for kernel in &explanation.kernels {
        for member in &kernel.members {
            let others = kernel.members.iter().map(|m| m.material.as_str());
            let others: Vec<&str> = others.filter(|name| *name != member.material).collect();
            let form = kernel.form.name();
            let words = match others.as_slice() {
                [] => format!("a kernel of its own ({form})"),
                others => format!("a kernel with {} ({form})", some(others)),
            };
            of.insert(member.material.clone(), (words, kernel.to_string()));
        }
    }
    Ok(Kernels {
        about: format!("plan `{}` for {}", explanation.strategy, info.name),
        of,
    })
}

fn of_processor(device: &Device, scene: &Scene, program: &Program) -> Result<Kernels, String> {
    let names: Vec<String> = program.materials().map(|m| m.name.clone()).collect();
    let unused = unused(scene, program);
    let inputs = PlanInputs {
        unused: &unused,
        ..PlanInputs::of_names(&names)
    };
    let plan = device.strategy().plan(&inputs).map_err(|e| e.to_string())?;
    let said = OnProcessor::new(&plan, &names, &device.info(), None);
    let mut of = BTreeMap::new();
    for kernel in &said.kernels {
        for name in &kernel.materials {
            let others = kernel.materials.iter().map(String::as_str);
            let others: Vec<&str> = others.filter(|other| other != name).collect();
            let words = match others.as_slice() {
                [] => "a kernel of its own".to_owned(),
                others => format!("a kernel with {}", some(others)),
            };
            of.insert(name.clone(), (words, said.why.clone()));
        }
    }
    Ok(Kernels {
        about: format!(
            "plan `{}` for {}, the processor",
            said.strategy, said.device
        ),
        of,
    })
}

/// Names, of which only the first few are listed.
fn some(names: &[&str]) -> String {
    const LISTED: usize = 3;
    let shown = names[..names.len().min(LISTED)].join(", ");
    match names.len().saturating_sub(LISTED) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}
