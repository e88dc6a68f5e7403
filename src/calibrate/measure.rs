//! Measuring the calibration's own scenes.

use std::time::Instant;

use impasto_compiler::{MemoryLoader, Program};
use impasto_runtime::gpu::Gpu;
use impasto_runtime::lab::LabOptions;
use impasto_runtime::technique::{SlotOrder, Technique};

use super::room::{self, Coherence};
use super::sources::{Palette, palettes};
use crate::measure::{MeasuredScene, Measurement, Progress, sample_for_fit};
use crate::plan::SceneMaterials;
use crate::{Error, Scene};

/// Points at which each material is evaluated to learn what it costs.
const COST_SAMPLES: usize = 1024;

/// How thoroughly to measure.
#[derive(Clone, Debug)]
pub struct Effort {
    /// Numbers of paths in flight, each measured by itself.
    pub pools: Vec<u32>,
    /// How often each kernel is timed.
    pub repetitions: u32,
    /// How many of the palettes are measured.
    pub palettes: usize,
    /// Whether all pairs of materials are measured, or few subsets.
    pub pairs: bool,
    /// Pixels along a side of the pictures that are rendered meanwhile.
    pub side: u32,
}

impl Effort {
    /// What suits a GPU: one in software has little to gain from many paths.
    pub fn of(gpu: &Gpu, quick: bool) -> Self {
        let software = gpu.info().kind == "software";
        Self {
            pools: match (software, quick) {
                (true, _) => vec![1 << 14],
                (false, true) => vec![1 << 20],
                (false, false) => vec![1 << 20, 1 << 22],
            },
            repetitions: if software { 5 } else { 9 },
            palettes: if quick || software { 2 } else { 3 },
            pairs: !quick && !software,
            side: if software { 128 } else { 1024 },
        }
    }
}

/// How far calibration is.
#[derive(Clone, Debug)]
pub struct Step<'a> {
    /// The scene that is measured.
    pub scene: &'a str,
    /// Which of how many scenes, counted from 0.
    pub at: (usize, usize),
    /// Kernels of this scene.
    pub kernels: Progress,
}

/// Measures all scenes; `warn` is told of kernels that cannot be measured.
///
/// # Errors
/// If the GPU fails, or has no timestamps.
pub fn measure(
    gpu: &Gpu,
    effort: &Effort,
    progress: &mut dyn FnMut(&Step<'_>),
    warn: &mut dyn FnMut(&str),
) -> Result<Vec<Measurement>, Error> {
    let palettes = palettes();
    let mut cases: Vec<(&Palette, Coherence, u32)> = Vec::new();
    for pool in &effort.pools {
        for palette in palettes.iter().take(effort.palettes) {
            cases.extend([Coherence::Random, Coherence::Runs].map(|c| (palette, c, *pool)));
        }
    }
    let all = cases.len();
    let mut sets = Vec::new();
    for (at, (palette, coherence, pool)) in cases.into_iter().enumerate() {
        let scene = room::scene(palette, coherence, effort.side);
        let mut kernels = |kernels| {
            progress(&Step {
                scene: &scene.name,
                at: (at, all),
                kernels,
            });
        };
        sets.push(one(gpu, &scene, palette, pool, effort, &mut kernels, warn)?);
    }
    Ok(sets)
}

fn one(
    gpu: &Gpu,
    scene: &Scene,
    palette: &Palette,
    pool: u32,
    effort: &Effort,
    progress: &mut dyn FnMut(Progress),
    warn: &mut dyn FnMut(&str),
) -> Result<Measurement, Error> {
    let program = compile(scene, palette)?;
    let options = LabOptions {
        pool: Some(pool),
        repetitions: effort.repetitions,
        statistics: true,
        // Paths that move bring neighbours of one kind together, and the palettes are made to have all kinds.
        technique: Technique {
            slot_order: SlotOrder::Fixed,
            ..Technique::default()
        },
        ..LabOptions::default()
    };
    let materials = SceneMaterials::new(scene, &program, COST_SAMPLES);
    let subject = MeasuredScene::new(scene, &program, materials, &options)?;
    let mut lab = subject.lab(gpu, &options)?;
    let candidates = sample_for_fit(&subject.on_surface(), effort.pairs);
    let timed = subject.time(&mut lab, &candidates, None::<Instant>, progress)?;
    for (candidate, why) in &timed.failed {
        warn(&format!(
            "the {} kernel of materials {:?} of `{}` was not measured: {why}",
            candidate.form.name(),
            candidate.members,
            scene.name
        ));
    }
    Ok(subject.measurement(gpu, &lab, &options, timed.kernels))
}

fn compile(scene: &Scene, palette: &Palette) -> Result<Program, Error> {
    let mut files = MemoryLoader::default();
    files.add(room::FILE, palette.source.clone());
    let compiled = impasto_compiler::compile(&crate::requests(scene), &mut files);
    let text =
        || impasto_compiler::diag::render::text(&compiled.sources, &compiled.diagnostics, false);
    match compiled.program {
        Some(program) => Ok(program),
        None => Err(Error::Materials(text())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{GpuOptions, calibrate};

    #[test]
    fn a_small_calibration_measures_and_fits() {
        let gpu = Gpu::new(&GpuOptions::default()).expect("these tests need a GPU");
        let effort = Effort {
            pools: vec![1 << 12],
            repetitions: 1,
            palettes: 1,
            pairs: false,
            side: 64,
        };
        let mut steps = Vec::new();
        let mut progress = |step: &Step<'_>| steps.push(step.at);
        let mut warn = |why: &str| panic!("{why}");
        let sets = measure(&gpu, &effort, &mut progress, &mut warn).expect("it is measured");
        assert!(
            steps.contains(&(0, 2)) && steps.contains(&(1, 2)),
            "{steps:?}"
        );
        assert_eq!(sets.len(), 2);
        // In the room hits of every material are everywhere, on the plane they lie together.
        let hits = |set: &Measurement| {
            let hits = set.workload.materials.iter();
            hits.fold([0.0, 0.0], |[s, p], h| [s + h.share, p + h.present])
        };
        let ([room, in_room], [plane, on_plane]) = (hits(&sets[0]), hits(&sets[1]));
        assert!(
            in_room / room > 2.0 * on_plane / plane,
            "{in_room} {room} {on_plane} {plane}"
        );
        let start = calibrate::start(&sets).expect("one GPU");
        let fitted = calibrate::fit(&sets, &start);
        assert_eq!(
            fitted.residuals.len(),
            sets.iter().map(|s| s.kernels.len()).sum::<usize>()
        );
        assert!(fitted.profile.check().is_ok());
        assert!(!calibrate::text(&fitted, true).is_empty());
    }
}
