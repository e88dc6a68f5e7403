//! A benchmark of ray casts alone: the same rays by every technique.
//!
//! The rays are those of a path tracer: from the camera (coherent), scattered by a diffuse surface
//! once and twice (less and less so), and shadow rays between points of surfaces. Each set is
//! cast once by the default technique, from whose hits the next set is made and by whose hits
//! other techniques are judged; then every technique is timed on it.

mod caster;
mod sets;

use serde::{Deserialize, Serialize};

use crate::error::RuntimeError;
use crate::gpu::Gpu;
use crate::lab::statistics::median;
use crate::render::report::AdapterReport;
use crate::scene::Scene;
use crate::technique::{Choice, Leaves, RayFetch, Stack, Technique, Traversal, Tree};
use crate::world::bvh::Bvh;

use caster::Caster;
use sets::RaySet;
pub use sets::SetKind;

/// What to cast.
#[derive(Clone, Debug)]
pub struct RayOptions {
    /// Columns and rows of the picture whose camera rays are the first set.
    pub size: (u32, u32),
    /// How often each technique is timed on each set; the median counts.
    pub repetitions: u32,
    /// The techniques; of each only what concerns ray casts counts.
    pub techniques: Vec<Technique>,
    /// The seed of scattered directions.
    pub seed: u32,
}

/// One technique on one set of rays.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RayRate {
    /// The set.
    pub rays: SetKind,
    /// Rays cast.
    pub count: usize,
    /// How many of them hit something.
    #[serde(default)]
    pub hits: usize,
    /// How many hit at another distance than by the default technique (by over 1e-4 of it), or
    /// something where that hit nothing.
    pub astray: usize,
    /// Median GPU seconds of a cast of all; seconds waited where the GPU has no timestamps.
    #[serde(default)]
    pub seconds: f64,
    /// Millions of rays cast in a second.
    pub mrays_per_second: f64,
    /// What rays were cast through.
    pub traversal: Traversal,
    /// In how many leaves of that a triangle lay.
    #[serde(default)]
    pub tree: Tree,
    /// Where casts kept the nodes that they had yet to visit.
    pub stack: Stack,
    /// When threads that fetched rays tested triangles; others did at once.
    pub leaves: Leaves,
    /// How threads got rays.
    pub ray_fetch: RayFetch,
}

/// What was measured in a scene: the answer of `impasto rays --format json`, which says more of the
/// GPU than most readers need.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RayReport<A = AdapterReport> {
    /// The GPU.
    pub adapter: A,
    /// The scene's name.
    pub scene: String,
    /// Its triangles.
    pub triangles: usize,
    /// Every technique on every set of rays.
    pub rates: Vec<RayRate>,
}

/// Every technique of casting rays that a GPU can run. Threads that do not fetch rays test
/// triangles at once.
pub fn techniques(gpu: &Gpu) -> Vec<Technique> {
    let mut all = vec![Technique::default().within(gpu.has_subgroups())];
    for (traversal, ..) in Traversal::ALL {
        for (stack, ..) in Stack::ALL {
            for (ray_fetch, leaves) in [
                (RayFetch::Persistent, Leaves::Together),
                (RayFetch::Persistent, Leaves::AtOnce),
                (RayFetch::Thread, Leaves::AtOnce),
            ] {
                let technique = Technique {
                    traversal: *traversal,
                    stack: *stack,
                    leaves,
                    ray_fetch,
                    ..Technique::default()
                };
                all.push(technique.within(gpu.has_subgroups()));
            }
        }
    }
    let mut distinct: Vec<Technique> = Vec::new();
    for technique in all {
        if !distinct.contains(&technique) {
            distinct.push(technique);
        }
    }
    distinct
}

/// Times the techniques on every set of rays in `scene`; `progress` is told which one comes next.
pub fn measure(
    gpu: &Gpu,
    scene: &Scene,
    options: &RayOptions,
    progress: &mut dyn FnMut(&Technique),
) -> Result<Vec<RayRate>, RuntimeError> {
    check(options)?;
    // What is measured is one level; two take the same steps.
    let scene = &*scene.flattened()?;
    let default = Technique::default().within(gpu.has_subgroups());
    let reference = Bvh::build(&scene.mesh, &default);
    let caster = Caster::new(gpu, scene, &reference, &default)?;
    let mut sets = Vec::new();
    for kind in SetKind::ALL {
        let rays = sets::make(kind, scene, options, &sets);
        if rays.is_empty() {
            continue;
        }
        let hits = caster.cast(&rays, kind.any_hit(), 0)?.hits;
        sets.push(RaySet { kind, rays, hits });
    }
    let mut rates = Vec::new();
    // Several techniques walk the same hierarchy.
    let kind = |technique: &Technique| (technique.traversal, technique.tree);
    let mut built = vec![(kind(&default), reference)];
    for technique in &options.techniques {
        progress(technique);
        let index = built
            .iter()
            .position(|(known, _)| *known == kind(technique));
        let index = index.unwrap_or_else(|| {
            built.push((kind(technique), Bvh::build(&scene.mesh, technique)));
            built.len() - 1
        });
        let caster = Caster::new(gpu, scene, &built[index].1, technique)?;
        for set in &sets {
            rates.push(rate(&caster, technique, set, options.repetitions)?);
        }
    }
    Ok(rates)
}

fn check(options: &RayOptions) -> Result<(), RuntimeError> {
    let refuse = |setting, value: String, expected: &str| {
        Err(RuntimeError::Setting {
            setting,
            value,
            expected: expected.to_string(),
        })
    };
    let (width, height) = options.size;
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 || pixels > 1 << 24 {
        return refuse("size", format!("{width}x{height}"), "1 to 2^24 pixels");
    }
    if options.repetitions == 0 {
        return refuse("repetitions", "0".into(), "at least 1");
    }
    Ok(())
}

fn rate(
    caster: &Caster<'_>,
    technique: &Technique,
    set: &RaySet,
    repetitions: u32,
) -> Result<RayRate, RuntimeError> {
    let cast = caster.cast(&set.rays, set.kind.any_hit(), repetitions)?;
    let seconds = median(cast.seconds).unwrap_or_default();
    let pairs = set.hits.iter().zip(&cast.hits);
    let count = set.rays.len();
    Ok(RayRate {
        rays: set.kind,
        count,
        hits: cast.hits.iter().filter(|h| h.is_some()).count(),
        astray: pairs.filter(|(a, b)| sets::differ(a, b, set.kind)).count(),
        seconds,
        mrays_per_second: count as f64 * 1e-6 / seconds.max(1e-12),
        traversal: technique.traversal,
        tree: technique.tree,
        stack: technique.stack,
        leaves: technique.leaves,
        ray_fetch: technique.ray_fetch,
    })
}
