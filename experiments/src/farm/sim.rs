//! A farm, event by event: GPUs that render parts, a scheduler that starts tasks one after another, a file system that
//! all share, nodes that fail, and merges. Everything random comes from a seed, so that a run is the same again.
//!
//! GPUs stand still while their films are gathered and written, as those of `impasto render --checkpoint` do. A merge
//! is a stream of the films that it reads and of the one that it writes. Merges run beside renders, on cores of the
//! nodes, and are never lost; pictures are counted as if they were as large as films.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap, HashMap, VecDeque};

/// The most elements of an array of Slurm, which counts from 0 and of which the first is not used.
pub(super) const ARRAY: usize = 1000;
/// GPUs of a node.
pub(super) const NODE: usize = 8;

/// What tasks run on. Times are in seconds, and sizes in bytes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Farm {
    pub gpus: usize,
    /// From the start of a task until its first sample.
    pub start: f64,
    /// Speeds of GPUs and costs of pictures lie so far around 1, evenly.
    pub spread: f64,
    /// The mean time between failures of a node, until one is noticed, and until the node is back.
    pub failures: f64,
    pub notice: f64,
    pub repair: f64,
    /// Tasks started a second.
    pub dispatch: f64,
    /// Bytes a second of the file system, and of a single stream.
    pub bandwidth: f64,
    pub stream: f64,
    /// Merges that run at a time.
    pub mergers: usize,
    /// From the start of a merge until its first byte.
    pub merge_start: f64,
    pub seed: u64,
}

/// What is rendered.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Job {
    pub pictures: usize,
    pub parts: usize,
    /// What a part takes a GPU of speed 1.
    pub seconds: f64,
    /// Seconds between two checkpoints; infinite without any.
    pub every: f64,
    /// Bytes of a film, and the time to gather it from the GPU.
    pub film: f64,
    pub gather: f64,
    /// Films that one merge reads at most.
    pub fan_in: usize,
    /// All parts of a picture come before those of the next, however many there are.
    pub in_turn: bool,
}

/// What came of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Outcome {
    /// When the last part was written, and when the last picture was.
    pub rendered: f64,
    pub done: f64,
    /// `done` over the time in which the GPUs would have taken the samples, with nothing else to do.
    pub times: f64,
    /// Failures of nodes, and GPU seconds that were rendered again for them.
    pub failed: usize,
    pub lost: f64,
    /// Bytes that went to the file system and from it.
    pub moved: f64,
    pub merges: usize,
}

impl Job {
    /// Arrays that are submitted: those of parts, and one of merges for each picture or each thousand.
    pub fn arrays(&self) -> usize {
        if self.pictures < self.parts {
            self.pictures * (self.parts.div_ceil(ARRAY) + 1)
        } else {
            self.pictures.div_ceil(ARRAY) * (self.parts + 1)
        }
    }

    /// Pictures of parts in the order of the arrays: a part of all pictures where these are more, else all parts of one.
    fn order(&self) -> Vec<usize> {
        if self.in_turn || self.pictures < self.parts {
            return (0..self.pictures)
                .flat_map(|picture| vec![picture; self.parts])
                .collect();
        }
        let chunks = (0..self.pictures).step_by(ARRAY);
        let chunk = |first: usize| first..self.pictures.min(first + ARRAY);
        chunks
            .flat_map(|first| (0..self.parts).flat_map(move |_| chunk(first)))
            .collect()
    }
}

/// Runs a job to its end.
pub(super) fn run(farm: &Farm, job: &Job) -> Outcome {
    let mut sim = Sim::new(farm, job);
    while sim.pictures_left > 0 && sim.step() {}
    sim.outcome.done = sim.now;
    sim.outcome.times = sim.now / (sim.work / sim.gpus.iter().map(|gpu| gpu.speed).sum::<f64>());
    sim.outcome
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Event {
    /// The scheduler may start another task.
    Free,
    /// A GPU, in the run of that number, is ready to render or has rendered until its next film.
    Begin(usize, u64),
    Film(usize, u64),
    /// A merge is ready to read.
    Merge(usize),
    /// A part is to be rendered again.
    Again(usize),
    Fail(usize),
    Repaired(usize),
}

/// What a stream is of.
#[derive(Clone, Copy)]
enum Of {
    Resume(usize),
    Film(usize),
    Merge(usize),
}

struct Part {
    picture: usize,
    /// Seconds at speed 1 that no film holds.
    left: f64,
    resumes: bool,
}

#[derive(Default)]
struct Gpu {
    speed: f64,
    /// Number of the run, by which events of one that was lost are told.
    run: u64,
    part: Option<usize>,
    /// Since when it renders what no film holds, if it does, and the seconds at speed 1 until the next one.
    since: Option<f64>,
    stretch: f64,
    stream: Option<u64>,
}

#[derive(Clone, Copy)]
struct Merge {
    picture: usize,
    level: u32,
    index: usize,
    films: usize,
}

/// Streams that share a file system evenly. All have moved equally many bytes since they began, so that one number
/// tells how far each is.
#[derive(Default)]
struct Disk {
    moved: f64,
    at: f64,
    next: u64,
    /// By the number of bytes at which they end.
    ends: BinaryHeap<Reverse<(u64, u64)>>,
    live: HashMap<u64, Of>,
}

impl Disk {
    fn rate(&self, farm: &Farm) -> f64 {
        farm.stream.min(farm.bandwidth / self.live.len() as f64)
    }

    fn advance(&mut self, now: f64, farm: &Farm) {
        if self.live.is_empty() {
            self.moved = 0.0;
            self.ends.clear();
        } else {
            self.moved += self.rate(farm) * (now - self.at);
        }
        self.at = now;
    }

    fn begin(&mut self, bytes: f64, of: Of) -> u64 {
        self.next += 1;
        // Numbers that are not negative are in the order of their bits.
        let end = (self.moved + bytes).to_bits();
        self.ends.push(Reverse((end, self.next)));
        self.live.insert(self.next, of);
        self.next
    }

    /// The stream that ends first, and when.
    fn first(&mut self, farm: &Farm) -> Option<(f64, u64)> {
        while let Some(Reverse((end, stream))) = self.ends.peek().copied() {
            if self.live.contains_key(&stream) {
                let left = (f64::from_bits(end) - self.moved).max(0.0);
                return Some((self.at + left / self.rate(farm), stream));
            }
            self.ends.pop();
        }
        None
    }
}

#[derive(Default)]
struct Sim {
    farm: Farm,
    job: Job,
    now: f64,
    random: u64,
    /// By time, and then in the order in which they were added.
    events: BinaryHeap<Reverse<(u64, u64, Event)>>,
    added: u64,
    disk: Disk,
    gpus: Vec<Gpu>,
    idle: BTreeSet<usize>,
    parts: Vec<Part>,
    queue: VecDeque<usize>,
    merges: Vec<Merge>,
    ready: VecDeque<usize>,
    /// Films that merges of a picture, level and index wait for.
    waits: BTreeMap<(usize, u32, usize), usize>,
    /// Parts of each picture that are done.
    parts_done: Vec<usize>,
    running_merges: usize,
    /// When the scheduler may start the next task, and whether that is among the events.
    free_at: f64,
    is_waiting: bool,
    pictures_left: usize,
    work: f64,
    outcome: Outcome,
}

impl Sim {
    fn new(farm: &Farm, job: &Job) -> Self {
        let mut sim = Self {
            farm: *farm,
            job: *job,
            random: farm.seed,
            idle: (0..farm.gpus).collect(),
            parts_done: vec![0; job.pictures],
            pictures_left: job.pictures,
            ..Self::default()
        };
        for _ in 0..farm.gpus {
            let speed = sim.around_one();
            sim.gpus.push(Gpu {
                speed,
                ..Gpu::default()
            });
        }
        let costs: Vec<f64> = (0..job.pictures).map(|_| sim.around_one()).collect();
        for picture in job.order() {
            let left = job.seconds * costs[picture];
            sim.work += left;
            sim.queue.push_back(sim.parts.len());
            sim.parts.push(Part {
                picture,
                left,
                resumes: false,
            });
        }
        for node in 0..farm.gpus.div_ceil(NODE) {
            sim.fail_later(node);
        }
        sim.add(0.0, Event::Free);
        sim
    }

    /// A number from 0 to 1, by SplitMix64 (Steele, Lea and Flood 2014).
    fn uniform(&mut self) -> f64 {
        self.random = self.random.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.random;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn around_one(&mut self) -> f64 {
        1.0 + self.farm.spread * (2.0 * self.uniform() - 1.0)
    }

    fn add(&mut self, after: f64, event: Event) {
        self.added += 1;
        let at = (self.now + after).to_bits();
        self.events.push(Reverse((at, self.added, event)));
    }

    fn fail_later(&mut self, node: usize) {
        if self.farm.failures.is_finite() {
            let after = -self.farm.failures * (1.0 - self.uniform()).ln();
            self.add(after, Event::Fail(node));
        }
    }

    /// Does what is next; false if there is nothing.
    fn step(&mut self) -> bool {
        let event = self
            .events
            .peek()
            .map(|Reverse((at, ..))| f64::from_bits(*at));
        let stream = self.disk.first(&self.farm);
        match (event, stream) {
            (None, None) => return false,
            (at, Some((end, stream))) if at.is_none_or(|at| end <= at) => {
                self.pass(end);
                if let Some(of) = self.disk.live.remove(&stream) {
                    self.ended(of);
                }
            }
            _ => {
                if let Some(Reverse((at, _, event))) = self.events.pop() {
                    self.pass(f64::from_bits(at));
                    self.happen(event);
                }
            }
        }
        self.dispatch();
        true
    }

    fn pass(&mut self, to: f64) {
        self.disk.advance(to, &self.farm);
        self.now = to;
    }

    /// Starts what may be started: merges first, since they need no GPU.
    fn dispatch(&mut self) {
        loop {
            let may_merge = self.running_merges < self.farm.mergers && !self.ready.is_empty();
            let may_render = !self.queue.is_empty() && !self.idle.is_empty();
            if !may_merge && !may_render {
                return;
            }
            if self.now < self.free_at {
                if !self.is_waiting {
                    self.is_waiting = true;
                    self.add(self.free_at - self.now, Event::Free);
                }
                return;
            }
            self.free_at = self.now + 1.0 / self.farm.dispatch;
            if may_merge && let Some(merge) = self.ready.pop_front() {
                self.running_merges += 1;
                self.add(self.farm.merge_start, Event::Merge(merge));
            } else if let Some(part) = self.queue.pop_front()
                && let Some(gpu) = self.idle.pop_first()
            {
                self.gpus[gpu].run += 1;
                self.gpus[gpu].part = Some(part);
                self.add(self.farm.start, Event::Begin(gpu, self.gpus[gpu].run));
            }
        }
    }

    fn happen(&mut self, event: Event) {
        match event {
            // The sum of two times may be a little less than the later one.
            Event::Free => (self.is_waiting, self.free_at) = (false, self.now),
            Event::Begin(gpu, run) if self.gpus[gpu].run == run => {
                let resumes = self.gpus[gpu].part.is_some_and(|p| self.parts[p].resumes);
                if resumes {
                    self.stream(gpu, self.job.film, Of::Resume(gpu));
                } else {
                    self.render(gpu);
                }
            }
            Event::Film(gpu, run) if self.gpus[gpu].run == run => {
                let Some(part) = self.gpus[gpu].part else {
                    return;
                };
                let is_last = self.gpus[gpu].stretch >= self.parts[part].left;
                // With checkpoints the last is one of all samples, and the film is written after it.
                let films = if is_last && self.job.every.is_finite() {
                    2.0
                } else {
                    1.0
                };
                self.stream(gpu, films * self.job.film, Of::Film(gpu));
            }
            Event::Begin(..) | Event::Film(..) => {}
            Event::Merge(merge) => {
                let bytes = (self.merges[merge].films + 1) as f64 * self.job.film;
                self.outcome.moved += bytes;
                self.disk.begin(bytes, Of::Merge(merge));
            }
            Event::Again(part) => self.queue.push_front(part),
            Event::Fail(node) => self.fail(node),
            Event::Repaired(node) => {
                self.idle.extend(self.gpus_of(node));
                self.fail_later(node);
            }
        }
    }

    fn gpus_of(&self, node: usize) -> std::ops::Range<usize> {
        node * NODE..self.farm.gpus.min((node + 1) * NODE)
    }

    fn stream(&mut self, gpu: usize, bytes: f64, of: Of) {
        self.outcome.moved += bytes;
        self.gpus[gpu].stream = Some(self.disk.begin(bytes, of));
    }

    /// Renders until the next film is to be written.
    fn render(&mut self, gpu: usize) {
        let Some(part) = self.gpus[gpu].part else {
            return;
        };
        let state = &mut self.gpus[gpu];
        state.stretch = self.parts[part].left.min(self.job.every * state.speed);
        state.since = Some(self.now);
        let (after, run) = (state.stretch / state.speed + self.job.gather, state.run);
        self.add(after, Event::Film(gpu, run));
    }

    fn ended(&mut self, of: Of) {
        match of {
            Of::Resume(gpu) => {
                self.gpus[gpu].stream = None;
                self.render(gpu);
            }
            Of::Film(gpu) => {
                let state = &mut self.gpus[gpu];
                (state.stream, state.since) = (None, None);
                let Some(part) = state.part else { return };
                self.parts[part].left -= state.stretch;
                self.parts[part].resumes = true;
                if self.parts[part].left > 0.0 {
                    return self.render(gpu);
                }
                state.part = None;
                self.idle.insert(gpu);
                self.outcome.rendered = self.now;
                let picture = self.parts[part].picture;
                let index = self.parts_done[picture];
                self.parts_done[picture] += 1;
                self.film_is_there(picture, 0, index);
            }
            Of::Merge(merge) => {
                self.running_merges -= 1;
                self.outcome.merges += 1;
                let Merge {
                    picture,
                    level,
                    index,
                    ..
                } = self.merges[merge];
                if self.films(level) == 1 {
                    self.pictures_left -= 1;
                } else {
                    self.film_is_there(picture, level, index);
                }
            }
        }
    }

    /// Films of a picture at a level of the tree, whose leaves are the parts.
    fn films(&self, level: u32) -> usize {
        (0..level).fold(self.job.parts, |films, _| films.div_ceil(self.job.fan_in))
    }

    /// A merge is ready once all of its films are there. Which of a picture's parts go together does not matter.
    fn film_is_there(&mut self, picture: usize, level: u32, index: usize) {
        let (fan_in, parent) = (self.job.fan_in, index / self.job.fan_in);
        let films = fan_in.min(self.films(level) - parent * fan_in);
        let key = (picture, level + 1, parent);
        let waits = self.waits.entry(key).or_insert(films);
        *waits -= 1;
        if *waits == 0 {
            self.waits.remove(&key);
            self.ready.push_back(self.merges.len());
            self.merges.push(Merge {
                picture,
                level: level + 1,
                index: parent,
                films,
            });
        }
    }

    fn fail(&mut self, node: usize) {
        self.outcome.failed += 1;
        for gpu in self.gpus_of(node) {
            self.idle.remove(&gpu);
            let state = &mut self.gpus[gpu];
            state.run += 1;
            if let Some(stream) = state.stream.take() {
                self.disk.live.remove(&stream);
            }
            if let Some(since) = state.since.take() {
                self.outcome.lost += (self.now - since).min(state.stretch / state.speed);
            }
            if let Some(part) = state.part.take() {
                self.add(self.farm.notice, Event::Again(part));
            }
        }
        self.add(self.farm.repair, Event::Repaired(node));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nothing but GPUs, whose tasks begin at once.
    fn ideal(gpus: usize) -> Farm {
        Farm {
            gpus,
            failures: f64::INFINITY,
            notice: 300.0,
            repair: 3600.0,
            dispatch: 1e12,
            bandwidth: 1e18,
            stream: 1e18,
            mergers: 1000,
            seed: 1,
            ..Farm::default()
        }
    }

    fn job(pictures: usize, parts: usize) -> Job {
        Job {
            pictures,
            parts,
            seconds: 100.0,
            every: f64::INFINITY,
            film: 1e9,
            gather: 0.0,
            fan_in: usize::MAX,
            in_turn: false,
        }
    }

    #[track_caller]
    fn near(value: f64, expected: f64) {
        assert!(
            (value / expected - 1.0).abs() < 1e-6,
            "{value}, not {expected}"
        );
    }

    #[test]
    fn tasks_alone_take_as_many_rounds_as_there_are() {
        for (gpus, pictures, parts) in [
            (1usize, 1usize, 1usize),
            (7, 3, 5),
            (8, 4, 4),
            (16, 2, 40),
            (100, 3, 4),
        ] {
            let farm = Farm {
                start: 5.0,
                ..ideal(gpus)
            };
            let rounds = (pictures * parts).div_ceil(gpus) as f64;
            near(run(&farm, &job(pictures, parts)).done, rounds * 105.0);
        }
        near(run(&ideal(8), &job(4, 4)).times, 1.0);
    }

    #[test]
    fn writers_are_bound_by_their_stream_and_by_all_streams_together() {
        // One writer: ten films of 1 s each, and then a merge of ten films into one.
        let slow = Farm {
            bandwidth: 1e9,
            ..ideal(1)
        };
        let outcome = run(&slow, &job(1, 10));
        near(outcome.rendered, 10.0 * 101.0);
        near(outcome.done, 10.0 * 101.0 + 11.0);
        near(outcome.moved, 21e9);
        // Twenty at a time share 1 GB/s; a stream of its own is bound by 0.1 GB/s.
        near(run(&Farm { gpus: 20, ..slow }, &job(1, 20)).rendered, 120.0);
        near(
            run(
                &Farm {
                    stream: 1e8,
                    ..ideal(20)
                },
                &job(1, 20),
            )
            .rendered,
            110.0,
        );
        // With checkpoints every 30 s three are written on the way, and the last film twice.
        let kept = Job {
            every: 30.0,
            gather: 2.0,
            ..job(1, 10)
        };
        near(run(&slow, &kept).rendered, 10.0 * (100.0 + 5.0 + 4.0 * 2.0));
    }

    #[test]
    fn a_scheduler_starts_one_task_after_another() {
        let farm = Farm {
            dispatch: 4.0,
            ..ideal(1000)
        };
        near(run(&farm, &job(1, 101)).rendered, 25.0 + 100.0);
    }

    #[test]
    fn trees_take_their_levels_one_after_another() {
        let farm = Farm {
            stream: 1e9,
            merge_start: 0.5,
            ..ideal(1000)
        };
        let after = |farm: &Farm, fan_in| {
            let outcome = run(
                farm,
                &Job {
                    fan_in,
                    ..job(1, 1000)
                },
            );
            (outcome.done - outcome.rendered, outcome.merges)
        };
        let (flat, merges) = after(&farm, usize::MAX);
        near(flat, 1001.5);
        assert_eq!(merges, 1);
        let (tree, merges) = after(&farm, 10);
        near(tree, 3.0 * 11.5);
        assert_eq!(merges, 100 + 10 + 1);
        // 1000 films make 32 of up to 32.
        near(after(&farm, 32).0, 2.0 * 33.5);
        // One at a time: every film but the picture is read once and written once.
        let one = Farm { mergers: 1, ..farm };
        near(after(&one, 10).0, 1110.0 + 111.0 * 1.5);
    }

    #[test]
    fn failures_lose_what_they_are_expected_to() {
        // Four hours of 800 GPUs, whose nodes fail every 20 h.
        let farm = Farm {
            failures: 72_000.0,
            ..ideal(800)
        };
        let long = Job {
            seconds: 3600.0,
            every: 60.0,
            film: 1.0,
            ..job(32, 100)
        };
        let outcome = run(&farm, &long);
        // A node fails once in 21 h, an hour of which it is away.
        let expected = 100.0 * outcome.done / 75_600.0;
        let failed = outcome.failed as f64;
        assert!(
            (failed - expected).abs() < 4.0 * expected.sqrt(),
            "{failed}, not {expected}"
        );
        // Each of the eight GPUs, if at work, loses between nothing and a minute.
        let losses = 8.0 * failed;
        let (mean, deviation) = (30.0 * losses, 60.0 / 12f64.sqrt() * losses.sqrt());
        assert!(
            outcome.lost < mean + 4.0 * deviation,
            "{} of {mean}",
            outcome.lost
        );
        assert!(
            outcome.lost > 0.8 * mean - 4.0 * deviation,
            "{} of {mean}",
            outcome.lost
        );
        assert_eq!(outcome, run(&farm, &long), "a seed tells all");
        assert_ne!(outcome, run(&Farm { seed: 2, ..farm }, &long));
    }

    #[test]
    fn arrays_are_those_of_the_farm() {
        let arrays = |pictures, parts| job(pictures, parts).arrays();
        assert_eq!(
            [arrays(240, 12), arrays(2, 1500), arrays(2500, 3)],
            [13, 6, 12]
        );
        assert_eq!(job(2, 3).order(), [0, 0, 0, 1, 1, 1]);
        assert_eq!(job(3, 2).order(), [0, 1, 2, 0, 1, 2]);
        let in_turn = Job {
            in_turn: true,
            ..job(3, 2)
        };
        assert_eq!(in_turn.order(), [0, 0, 1, 1, 2, 2]);
    }
}
