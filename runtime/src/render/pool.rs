//! How much work at a time: the paths in flight, and the iterations of a submission.

use std::time::{Duration, Instant};

use crate::device::DeviceRef;
use crate::error::RuntimeError;
use crate::kernels::layout::PlanLayout;
use crate::kernels::modules::{LARGEST_WORKGROUP, Sizes};
use crate::options::{Progress, RenderOptions};
use crate::technique::{RayKernels, Stack, Technique};
use crate::world::World;

/// Paths in flight by default, as in Laine et al. 2013. In a megakernel they are those of one
/// dispatch, whose time this bounds.
const POOL: u32 = 1 << 20;
/// The same for the wavefront on GPUs with memory of their own: each kernel drains the machine
/// once an iteration, so that an H200 renders 1.4 to 1.5 times as fast as with the paper's.
const LARGE_POOL: u32 = 1 << 23;
/// The same for renders of many times as many paths: while a pool fills, and at the end, slots are idle.
const LARGEST_POOL: u32 = 1 << 24;
/// So many times.
const MANY: u64 = 24;
/// What a default pool may take, in bytes.
const LARGE_POOL_BYTES: u64 = 3 << 30;
/// Paths of a dispatch of a megakernel there: at its end threads idle.
const LARGE_BATCH: u32 = 1 << 22;
/// The same for GPUs in software, to stay responsive.
const SOFTWARE_POOL: u32 = 1 << 16;
/// Threads of a workgroup (docs/measurements.md).
const WORKGROUP: u32 = 256;
/// Threads that fetch their work: about as many as an H200 holds at once.
const THREADS: u32 = 1 << 18;
/// Items that each of them may fetch; with few threads and large pools a dispatch takes long.
const FETCH_LIMIT: u32 = 64;
/// The same for GPUs in software: Mesa's ends all loops of a thread after 65,535 turns in sum.
const SOFTWARE_FETCH_LIMIT: u32 = 2;

/// Paths that a thread of the processor takes at a time.
const PORTION: u32 = 16;
/// Paths of a dispatch there, for each thread: they take some milliseconds.
const PATHS_OF_THREAD: u32 = 4096;

/// A submission is made shorter above this time unless another is asked for, and longer below a fifth of it.
pub(crate) const LONG: Duration = Duration::from_millis(100);
/// Iterations in a submission: at most, and at least when the end is near.
pub(crate) const MAX_ITERATIONS: u32 = 64;
const LAST_ITERATIONS: u64 = 8;

/// With as many paths in flight or fewer, the ends of dispatches are a good part of a wavefront's time: one casts
/// both shadow and extension rays (docs/measurements.md, "Shadow and extension rays in one dispatch").
const FEW_PATHS: u32 = 1 << 22;

/// The technique that a device renders by, with what depends on the paths in flight.
pub(crate) fn technique(
    device: DeviceRef<'_>,
    world: &World,
    options: &RenderOptions,
) -> Technique {
    let technique = device.technique(options.technique);
    let default = || wavefront_pool(device, world, options);
    let asked = u64::from(options.pool.unwrap_or_else(default));
    let few = asked.min(paths(world, options)) <= u64::from(FEW_PATHS);
    with_paths(technique, few)
}

/// A technique for few paths in flight, or for many.
fn with_paths(technique: Technique, few: bool) -> Technique {
    let ray_kernels = match technique.ray_kernels {
        RayKernels::Auto if few => RayKernels::One,
        other => other,
    };
    Technique {
        ray_kernels,
        ..technique
    }
}

/// The paths of a whole render.
fn paths(world: &World, options: &RenderOptions) -> u64 {
    let rendered = options.pixel_count(world.width, world.height);
    rendered.saturating_mul(u64::from(options.samples))
}

/// Chooses the pool, within what the GPU can bind.
pub(crate) fn sizes(
    device: DeviceRef<'_>,
    world: &World,
    layout: &PlanLayout,
    options: &RenderOptions,
) -> Result<Sizes, RuntimeError> {
    let pixels = u64::from(world.width) * u64::from(world.height);
    let film = pixels * world.outputs.layers.planes() as u64 * 4;
    device.check_binding_size("the film", film)?;
    // State and queues are one buffer each.
    let state_bytes = layout.path_bytes();
    let queue_bytes = 4 * layout.queue_words();
    let slot_bytes = state_bytes.max(queue_bytes).max(1);
    if let Some(pool) = options.pool {
        let bytes = u64::from(pool) * slot_bytes;
        device
            .check_binding_size("a pool of that size", bytes)
            .map_err(|error| error.with_hint("use a smaller pool (`--pool`)"))?;
    }
    let most = device.limits().buffer_bytes;
    let fits = u32::try_from(most / slot_bytes).unwrap_or(u32::MAX);
    let wavefront = wavefront_pool(device, world, options);
    let default = || default_pool(device, layout, wavefront, state_bytes + queue_bytes);
    let enough = u32::try_from(paths(world, options)).unwrap_or(u32::MAX);
    let pool = options
        .pool
        .unwrap_or_else(default)
        .min(enough)
        .min(fits)
        .clamp(1, 1 << 30);
    dispatch_sizes(device, pool, &options.technique)
}

/// The fewest paths in flight for which memory is still asked.
const LEAST_POOL: u32 = 1 << 12;

/// What is made for a pool, or for the largest that is the half of it, a quarter and so on, where there is not memory for more.
/// What others on the same GPU hold is not known before it is asked for.
///
/// # Errors
/// If there is none for [`LEAST_POOL`] paths either, or making it fails otherwise.
pub(crate) fn within_memory<T>(
    sizes: Sizes,
    make: &mut dyn FnMut(Sizes) -> Result<T, RuntimeError>,
) -> Result<T, RuntimeError> {
    let mut sizes = sizes;
    loop {
        match make(sizes) {
            Err(RuntimeError::OutOfMemory(_)) if sizes.pool > LEAST_POOL => sizes = halved(sizes),
            made => return made,
        }
    }
}

/// Dispatches over half as many slots, by half as many threads where slots are fetched.
fn halved(sizes: Sizes) -> Sizes {
    let pool = sizes.pool.div_ceil(2);
    Sizes {
        pool,
        threads: sizes.threads.min(pool),
        ..sizes
    }
}

/// The sizes of dispatches over `items` slots.
pub(crate) fn dispatch_sizes(
    device: DeviceRef<'_>,
    items: u32,
    technique: &Technique,
) -> Result<Sizes, RuntimeError> {
    let limits = device.limits();
    let fetch_limit = if matches!(device, DeviceRef::Gpu(gpu) if gpu.is_software()) {
        SOFTWARE_FETCH_LIMIT
    } else {
        FETCH_LIMIT
    };
    let pools = match device {
        DeviceRef::Gpu(_) => 1,
        DeviceRef::Cpu(cpu) => u32::try_from(cpu.threads()).unwrap_or(u32::MAX),
    };
    let items = items.div_ceil(pools);
    let sizes = Sizes {
        pool: items,
        pools,
        workgroup: workgroup_size(device, technique.workgroup)?,
        suited: matches!(device, DeviceRef::Gpu(_))
            && technique.workgroup.is_none()
            // There is no memory for the stacks of more threads.
            && technique.stack != Stack::Workgroup
            && limits.workgroup_threads >= LARGEST_WORKGROUP,
        threads: technique.threads.unwrap_or(THREADS).min(items),
        fetch_limit,
        row_groups: limits.row_groups,
    };
    Ok(Sizes {
        threads: sizes.threads_for(1),
        ..sizes
    })
}

/// Threads of a workgroup, within the GPU's limits.
fn workgroup_size(device: DeviceRef<'_>, wanted: Option<u32>) -> Result<u32, RuntimeError> {
    let most = device.limits().workgroup_threads;
    let default = match device {
        DeviceRef::Gpu(_) => WORKGROUP,
        DeviceRef::Cpu(_) => PORTION,
    };
    wanted.map_or(Ok(default.min(most)), |threads| {
        possible_workgroup(threads, most)
    })
}

/// That number of threads, if the GPU's workgroups may have so many.
pub(super) fn possible_workgroup(threads: u32, most: u32) -> Result<u32, RuntimeError> {
    if (1..=most).contains(&threads) {
        return Ok(threads);
    }
    Err(RuntimeError::Setting {
        setting: "workgroup",
        value: threads.to_string(),
        expected: format!("1 to {most} threads"),
    })
}

/// The pool where none is asked for, and a wavefront of any size would have `wavefront` paths.
fn default_pool(
    device: DeviceRef<'_>,
    layout: &PlanLayout,
    wavefront: u32,
    slot_bytes: u64,
) -> u32 {
    match device {
        DeviceRef::Gpu(gpu) if gpu.has_own_memory() => {}
        _ => return wavefront,
    }
    if !layout.wavefront {
        return LARGE_BATCH;
    }
    let affordable = LARGE_POOL_BYTES / slot_bytes.max(1);
    wavefront.min(u32::try_from(affordable).unwrap_or(u32::MAX))
}

/// The paths that a wavefront has in flight by default, where there is memory for them.
fn wavefront_pool(device: DeviceRef<'_>, world: &World, options: &RenderOptions) -> u32 {
    match device {
        DeviceRef::Gpu(gpu) if gpu.is_software() => SOFTWARE_POOL,
        DeviceRef::Gpu(gpu) if gpu.has_own_memory() => {
            large_pool(paths(world, options), options.pixels.is_some())
        }
        DeviceRef::Gpu(_) => POOL,
        DeviceRef::Cpu(cpu) => {
            let threads = u32::try_from(cpu.threads()).unwrap_or(u32::MAX);
            threads.saturating_mul(PATHS_OF_THREAD)
        }
    }
}

/// That of a GPU with memory of its own. Where pixels are chosen, somebody waits for iterations.
fn large_pool(paths: u64, chooses_pixels: bool) -> u32 {
    if paths >= MANY * u64::from(LARGEST_POOL) && !chooses_pixels {
        LARGEST_POOL
    } else {
        LARGE_POOL
    }
}

/// How many iterations a submission has.
pub(crate) struct Pace {
    iterations: u32,
    /// The most that will be asked for.
    pub max: u32,
    /// The time that it may take.
    long: Duration,
    last: Instant,
}

impl Pace {
    /// At most `max` iterations, starting with one, which take about `long` at most.
    pub(crate) fn new(max: u32, long: Duration) -> Self {
        Self {
            iterations: 1,
            long,
            max: max.clamp(1, MAX_ITERATIONS),
            last: Instant::now(),
        }
    }

    /// Asks for at most `max` iterations from now on.
    pub(crate) fn limit(&mut self, max: u32) {
        self.max = max.clamp(1, MAX_ITERATIONS);
        self.iterations = self.iterations.min(self.max);
    }

    /// Called whenever a submission is done.
    pub(crate) fn adapt(&mut self) {
        let took = self.last.elapsed();
        self.last = Instant::now();
        if took < self.long / 5 {
            self.iterations = (2 * self.iterations).min(self.max);
        } else if took > self.long {
            self.iterations = (self.iterations / 2).max(1);
        }
    }

    /// Iterations of the next submission, when `progress` took `done` iterations and `ahead`
    /// more are submitted: not many more than the rest will take at that rate.
    pub(crate) fn next(&self, progress: &Progress, done: u64, ahead: u64) -> u32 {
        let rest = u128::from(progress.total - progress.paths.min(progress.total));
        let needed = match progress.paths {
            0 => u64::MAX,
            paths => u64::try_from(rest * u128::from(done) / u128::from(paths)).unwrap_or(u64::MAX),
        };
        let useful = needed.saturating_sub(ahead).max(LAST_ITERATIONS);
        self.iterations
            .min(u32::try_from(useful).unwrap_or(u32::MAX))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sizes(pool: u32, fetch_limit: u32) -> Sizes {
        Sizes {
            pool,
            pools: 1,
            workgroup: 256,
            suited: false,
            threads: THREADS.min(pool),
            fetch_limit,
            row_groups: 65_535,
        }
    }

    #[test]
    fn only_long_renders_that_nobody_looks_at_have_the_largest_pool() {
        let paths = 24 << 24;
        assert_eq!(large_pool(paths, false), LARGEST_POOL);
        assert_eq!(large_pool(paths - 1, false), LARGE_POOL);
        assert_eq!(large_pool(u64::MAX, true), LARGE_POOL);
    }

    #[test]
    fn how_many_paths_are_in_flight_decides_which_kernels_cast_rays() {
        let [few, many] = [true, false].map(|few| with_paths(Technique::default(), few));
        assert_eq!(few.ray_kernels, RayKernels::One);
        assert_eq!(many.ray_kernels, RayKernels::Auto);
        let asked = Technique {
            ray_kernels: RayKernels::Each,
            ..Technique::default()
        };
        assert_eq!([true, false].map(|few| with_paths(asked, few)), [asked; 2]);
    }

    /// A budget that just suffices on average ends the threads that have short items.
    #[test]
    fn threads_may_fetch_more_than_their_share() {
        for (pool, limit) in [
            (LARGEST_POOL, FETCH_LIMIT),
            (LARGE_POOL, FETCH_LIMIT),
            (1000, SOFTWARE_FETCH_LIMIT),
        ] {
            for queues in 1..3u32 {
                let sizes = sizes(pool, limit);
                let threads = u64::from(sizes.threads_for(queues as usize));
                assert!(threads * u64::from(limit) >= 2 * u64::from(pool) * u64::from(queues));
            }
        }
    }

    #[test]
    fn a_pool_is_halved_until_there_is_memory_for_it() {
        let within = |room: u32, wanted: u32| {
            let mut asked = Vec::new();
            let made = within_memory(sizes(wanted, FETCH_LIMIT), &mut |sizes| {
                asked.push(sizes.pool);
                assert!(sizes.threads <= sizes.pool);
                assert!(sizes.threads * sizes.fetch_limit >= sizes.pool);
                if sizes.pool > room {
                    Err(RuntimeError::OutOfMemory("full".into()))
                } else {
                    Ok(sizes.pool)
                }
            });
            (made, asked)
        };
        let (made, asked) = within(3_000_000, 1 << 23);
        assert_eq!(made.expect("there is room"), 1 << 21);
        assert_eq!(asked, [1 << 23, 1 << 22, 1 << 21]);
        assert_eq!(within(u32::MAX, 12_345).1, [12_345]);
        assert_eq!(within(6_000, 9_999).0.expect("there is room"), 5_000);
        let (made, asked) = within(100, 1 << 14);
        assert!(matches!(made, Err(RuntimeError::OutOfMemory(_))));
        assert_eq!(asked, [1 << 14, 1 << 13, 1 << 12]);
        // What is wrong otherwise does not get right with less.
        let mut times = 0;
        let made: Result<(), _> = within_memory(sizes(1 << 20, FETCH_LIMIT), &mut |_| {
            times += 1;
            Err(RuntimeError::DeviceLost("gone".into()))
        });
        assert!(matches!(made, Err(RuntimeError::DeviceLost(_))));
        assert_eq!(times, 1);
    }

    #[test]
    fn a_submission_asks_for_what_is_left() {
        let pace = Pace {
            iterations: 64,
            max: 64,
            long: LONG,
            last: Instant::now(),
        };
        let after = |paths| Progress {
            paths,
            total: 1000,
            elapsed: Duration::ZERO,
        };
        assert_eq!(pace.next(&after(0), 10, 20), 64);
        assert_eq!(pace.next(&after(100), 10, 20), 64);
        assert_eq!(pace.next(&after(500), 50, 20), 30);
        assert_eq!(pace.next(&after(999), 50, 20), 8);
        assert_eq!(pace.next(&after(1000), 50, 0), 8);
    }
}
