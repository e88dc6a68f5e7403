//! The queues between stages and the counters of a render: where each lies in its buffer, for
//! the kernels (as WGSL constants) and for the host alike.

use std::fmt::Write;
use std::ops::Range;

use impasto_compiler::partition::Plan;

use crate::kernels::dropped::{self, Row};
use crate::kernels::stages::{Phase, Stage, Work};
use crate::world::needs::{Need, Needs};

/// Which queues a wavefront has: those of its stages, phase by phase, of each phase first those that every
/// scene has. Each has room for the pool. If rays are ordered, there is as much room for the queue in
/// that order, and for each of its items' bin and rank.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Queues {
    /// The stages.
    pub stages: &'static [Stage],
    /// What must exist.
    pub needs: Needs,
    /// How many queues material kernels have.
    pub materials: usize,
}

impl Queues {
    /// How many queues each kernel of a plan has: none where materials are evaluated inline, one for each
    /// member of a binned kernel, else one.
    pub(crate) fn of_plan(plan: &Plan) -> impl Iterator<Item = usize> {
        let kernels = plan.kernels.iter();
        kernels.map(|kernel| kernel.form.queues(kernel.materials.len()))
    }

    /// Those of a plan's material kernels, in its order.
    pub(crate) fn of_kernels(self, plan: &Plan) -> Vec<Range<usize>> {
        let is_material = |stage: &&Stage| matches!(stage.work, Work::Material { .. });
        let material = self.order().find(is_material);
        let mut next = material.map_or(0, |stage| self.of(stage.name).start);
        let queues = Self::of_plan(plan).map(|count| {
            let begin = next;
            next += count;
            begin..next
        });
        queues.collect()
    }

    /// The stages that may have queues, in the order of the buffer.
    pub(crate) fn order(self) -> impl Iterator<Item = &'static Stage> {
        let of = move |phase, always| {
            let rows = self.stages.iter();
            let rows = rows.filter(move |s| s.phase == phase && s.work.is_asked_for());
            rows.filter(move |s| s.need.is_always() == always)
        };
        let phases = Phase::ALL.into_iter();
        phases.flat_map(move |(phase, _)| of(phase, true).chain(of(phase, false)))
    }

    /// The stages with their queues.
    fn ranges(self) -> impl Iterator<Item = (&'static Stage, Range<usize>)> {
        let mut next = 0;
        self.order().map(move |stage| {
            let begin = next;
            next += match stage.work {
                Work::Material { .. } => self.materials,
                _ => usize::from(self.needs.met(stage.need)),
            };
            (stage, begin..next)
        })
    }

    /// The queues of a stage; empty if it has none.
    pub(crate) fn of(self, name: &str) -> Range<usize> {
        let found = self.ranges().find(|(stage, _)| stage.name == name);
        found.map_or(0..0, |(_, range)| range)
    }

    /// The queues of a phase.
    pub(crate) fn of_phase(self, phase: Phase) -> Range<usize> {
        let ranges = self.ranges().filter(|(stage, _)| stage.phase == phase);
        let ranges = ranges.map(|(_, range)| range);
        let all = ranges.reduce(|all, range| all.start..range.end);
        all.unwrap_or_default()
    }

    /// The queue of slots that are to begin a path.
    pub(crate) fn new_paths(self) -> usize {
        let begins = |(stage, _): &(&Stage, _)| matches!(stage.work, Work::Begin { .. });
        let found = self.ranges().find(begins);
        found.map_or(0, |(_, range)| range.start)
    }

    pub(crate) fn count(self) -> usize {
        self.ranges().last().map_or(0, |(_, range)| range.end)
    }

    /// Whether rays are cast in an order of their own.
    fn ordered(self) -> bool {
        self.needs.has(Need::Order)
    }

    /// Where a queue of rays is put in order, of those in the buffer.
    pub(crate) fn region_ordered(self) -> usize {
        self.count()
    }

    /// How often the pool there is room for.
    pub(crate) fn regions(self) -> usize {
        self.count() + if self.ordered() { 3 } else { 0 }
    }

    pub(crate) fn constants(self) -> String {
        let mut out = String::new();
        for (stage, queues) in self.ranges() {
            let is_one = !matches!(stage.work, Work::Material { .. });
            if is_one && !queues.is_empty() {
                let name = stage.name.to_uppercase();
                let _ = writeln!(out, "const QUEUE_{name}: u32 = {}u;", queues.start);
            }
        }
        if self.ordered() {
            for (at, name) in (self.count()..).zip(["ORDERED", "BINS", "RANKS"]) {
                let _ = writeln!(out, "const REGION_{name}: u32 = {at}u;");
            }
        }
        out
    }
}

/// A single counter of the buffer `counters`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scalar {
    /// Requests that found a queue full.
    Overflow,
    /// Samples above what the film holds.
    FilmClamped,
    /// The first pixel and sample that no slot was given yet.
    NextPixel,
    NextSample,
    /// The first pixel and sample for the slots that start paths in this iteration.
    WorkPixel,
    WorkSample,
    /// Items of the work handed out that threads of a megakernel have fetched.
    Fetched,
    /// Slots that found no work left.
    Retired,
    /// Media that paths entered while in as many as a stack holds.
    MediaOverflow,
    /// Paths that crossed too many boundaries in a row that were none.
    LostPaths,
}

const SCALARS: [(Scalar, &str); 10] = [
    (Scalar::Overflow, "OVERFLOW"),
    (Scalar::FilmClamped, "FILM_CLAMPED"),
    (Scalar::NextPixel, "NEXT_PIXEL"),
    (Scalar::NextSample, "NEXT_SAMPLE"),
    (Scalar::WorkPixel, "WORK_PIXEL"),
    (Scalar::WorkSample, "WORK_SAMPLE"),
    (Scalar::Fetched, "FETCHED"),
    (Scalar::Retired, "RETIRED"),
    (Scalar::MediaOverflow, "MEDIA_OVERFLOW"),
    (Scalar::LostPaths, "LOST_PATHS"),
];

/// Words between the lengths of queues: as far apart as the parts of a GPU's cache that work
/// on atomic operations independently, since all threads of the logic kernel add to these.
const PUSHED_STRIDE: usize = 64;

/// Where between those lengths is the number of items that threads have fetched from the queue.
const FETCHED_OF: usize = PUSHED_STRIDE / 2;

/// The layout of the buffer `counters`, in words: the scalars, then for each queue its length
/// when it was consumed, if a kernel is binned the first of its workgroups that works on that queue,
/// then items consumed in 64 bits, then a row of dropped samples for
/// each material and one for the film; in a profiling build lanes at work and lanes in all for
/// each kernel, in 64 bits; then, apart from each other, the lengths of queues so
/// far and, between those, how much threads have fetched of each; at last, if hits are counted, for
/// each material its hits and the blocks of slots with any, both in 64 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Counters {
    /// Number of queues; 0 in a megakernel.
    pub queues: usize,
    /// Whether a kernel works on several queues.
    pub binned: bool,
    /// Number of materials.
    pub materials: usize,
    /// Number of kernels whose lanes are counted.
    pub profiled: usize,
    /// Number of materials whose hits are counted.
    pub hits: usize,
}

impl Counters {
    /// The first words, which are the scalars, whatever the plan.
    pub(crate) const SCALARS: usize = SCALARS.len();

    fn taken(self) -> usize {
        Self::SCALARS
    }

    fn first_groups(self) -> usize {
        self.taken() + self.queues
    }

    fn items(self) -> usize {
        self.first_groups() + if self.binned { self.queues } else { 0 }
    }

    /// The first row of dropped samples.
    fn dropped(self) -> usize {
        self.items() + 2 * self.queues
    }

    /// The row of those found when they were to be added to the film, after that of the last material.
    pub(crate) fn film_row(self) -> usize {
        self.materials
    }

    /// What one of those rows counted, in the words read back; `None` if nothing.
    pub(crate) fn dropped_row(self, words: &[u32], row: usize) -> Option<Row> {
        let at = self.dropped() + dropped::ROW_WORDS * row;
        Row::read(words.get(at..at + dropped::ROW_WORDS)?)
    }

    /// The words that count the lanes of the `kernel`-th kernel.
    pub(crate) fn lanes(self, kernel: usize) -> usize {
        self.dropped() + dropped::ROW_WORDS * (self.materials + 1) + 4 * kernel
    }

    fn pushed(self) -> usize {
        self.lanes(self.profiled).next_multiple_of(PUSHED_STRIDE)
    }

    fn hits(self) -> usize {
        self.pushed() + PUSHED_STRIDE * self.queues
    }

    /// Words in all.
    pub(crate) fn len(self) -> usize {
        self.hits() + PUSHED_STRIDE * self.hits
    }

    pub(crate) fn constants(self) -> String {
        let scalars = SCALARS
            .iter()
            .enumerate()
            .map(|(at, (_, name))| (*name, at));
        let arrays = [
            ("PUSHED", self.pushed()),
            ("PUSHED_STRIDE", PUSHED_STRIDE),
            ("FETCHED_OF", self.pushed() + FETCHED_OF),
            ("TAKEN", self.taken()),
            ("FIRST_GROUP", self.first_groups()),
            ("ITEMS", self.items()),
            ("HITS", self.hits()),
            ("HITS_STRIDE", PUSHED_STRIDE),
        ];
        let exists = |name: &str| match name {
            "FIRST_GROUP" => self.binned,
            "HITS" | "HITS_STRIDE" => self.hits > 0,
            _ => true,
        };
        let arrays = arrays.into_iter().filter(|(name, _)| exists(name));
        let mut out = String::new();
        for (name, at) in scalars.chain(arrays) {
            let _ = writeln!(out, "const COUNTER_{name}: u32 = {at}u;");
        }
        out + &dropped::constants(self.dropped(), self.materials)
    }

    /// The word that a scalar is kept in.
    pub(crate) fn index(self, scalar: Scalar) -> usize {
        // The table holds every scalar, which a test asserts.
        let at = SCALARS.iter().position(|(s, _)| *s == scalar);
        at.unwrap_or(0)
    }

    /// A scalar's value in the words read back.
    pub(crate) fn scalar(self, words: &[u32], scalar: Scalar) -> u32 {
        words.get(self.index(scalar)).copied().unwrap_or(0)
    }

    /// All samples dropped because a value was no number or below zero.
    pub(crate) fn all_dropped(self, words: &[u32]) -> u64 {
        let rows = (0..=self.film_row()).filter_map(|row| self.dropped_row(words, row));
        rows.map(|row| row.samples()).sum()
    }

    /// The length of `queue` when it was consumed last, in the words read back.
    pub(crate) fn taken_of(self, words: &[u32], queue: usize) -> u32 {
        words.get(self.taken() + queue).copied().unwrap_or(0)
    }

    /// The words with the lengths of queues when they were consumed last.
    pub(crate) fn taken_words(self) -> Range<usize> {
        self.taken()..self.taken() + self.queues
    }

    /// The counters of several pools as those of one: sums, and of examples the first.
    pub(crate) fn merged(self, parts: &[Vec<u32>]) -> Vec<u32> {
        let mut sums = vec![0u32; self.len()];
        for part in parts {
            for (sum, word) in sums.iter_mut().zip(part) {
                *sum = sum.wrapping_add(*word);
            }
        }
        let items = (0..self.queues).map(|queue| self.items() + 2 * queue);
        let hits = (0..self.hits).map(|material| self.hits() + PUSHED_STRIDE * material);
        let lanes = (0..self.profiled).flat_map(|kernel| [0, 2].map(|at| self.lanes(kernel) + at));
        for at in items.chain(hits.flat_map(|at| [at, at + 2])).chain(lanes) {
            let sum: u64 = parts.iter().map(|part| long(part, at)).sum();
            sums[at] = sum as u32;
            sums[at + 1] = (sum >> 32) as u32;
        }
        for row in 0..=self.film_row() {
            let at = self.dropped() + dropped::ROW_WORDS * row;
            let example = at + dropped::COUNTS..at + dropped::ROW_WORDS;
            let claimed = parts
                .iter()
                .find(|part| part.get(at + dropped::COUNTS).is_some_and(|c| *c > 0));
            if let Some(part) = claimed {
                sums[example.clone()].copy_from_slice(&part[example]);
            }
        }
        sums
    }

    /// How many items of `queue` were consumed, in the words read back.
    pub(crate) fn items_of(self, words: &[u32], queue: usize) -> u64 {
        long(words, self.items() + 2 * queue)
    }

    /// Hits of a material, and blocks of slots with any, if they are counted.
    pub(crate) fn hits_of(self, words: &[u32], material: usize) -> [u64; 2] {
        let at = self.hits() + PUSHED_STRIDE * material;
        [long(words, at), long(words, at + 2)]
    }

    /// The share of lanes at work in the statements of the `kernel`-th kernel, if it was profiled
    /// and ran.
    pub(crate) fn utilisation(self, words: &[u32], kernel: usize) -> Option<f64> {
        let at = self.lanes(kernel);
        let all = long(words, at + 2);
        (kernel < self.profiled && all > 0).then(|| long(words, at) as f64 / all as f64)
    }
}

/// A counter of two words, the low one first.
fn long(words: &[u32], at: usize) -> u64 {
    let word = |i: usize| words.get(i).copied().map_or(0, u64::from);
    word(at) | word(at + 1) << 32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::stages::STAGES;
    use impasto_compiler::partition::{Form, PlanKernel};

    /// The queues of a scene whose lights are sampled.
    fn lit(materials: usize) -> Queues {
        Queues {
            stages: &STAGES,
            needs: Needs::of_rows(&[Need::ShadowRays]),
            materials,
        }
    }

    #[test]
    fn regions_do_not_overlap() {
        let queues = lit(3);
        assert_eq!(queues.new_paths(), 0);
        assert_eq!(queues.of("material"), 1..4);
        assert_eq!(queues.of_phase(Phase::Materials), 0..4);
        assert_eq!(queues.of("extension"), 4..5);
        assert_eq!(queues.of("shadow"), 5..6);
        assert_eq!(queues.of_phase(Phase::Rays), 4..queues.count());
        let counters = Counters {
            queues: queues.count(),
            binned: false,
            materials: 4,
            profiled: 2,
            hits: 0,
        };
        let mut words: Vec<u32> = (0..counters.len() as u32).collect();
        assert_eq!(counters.scalar(&words, Scalar::Retired), 7);
        assert_eq!(counters.dropped(), 10 + 3 * 6);
        let rows = dropped::ROW_WORDS * 5;
        assert_eq!(counters.lanes(0), counters.dropped() + rows);
        assert!(counters.pushed() >= counters.lanes(2));
        let last = counters.dropped_row(&words, counters.film_row());
        assert_eq!(
            last.map(|row| row.nonfinite as usize),
            Some(counters.lanes(0) - dropped::ROW_WORDS)
        );
        assert_eq!(counters.dropped_row(&words[..30], 0), None);
        assert_eq!(counters.utilisation(&words, 2), None);
        assert_eq!(counters.len(), counters.pushed() + 6 * PUSHED_STRIDE);
        let binned = Counters {
            binned: true,
            ..counters
        };
        assert_eq!(binned.items(), counters.items() + 6);
        let counted = Counters {
            hits: 3,
            ..counters
        };
        assert_eq!(counted.len(), counters.len() + 3 * PUSHED_STRIDE);
        words[counters.items() + 2] = 5;
        words[counters.items() + 3] = 1;
        assert_eq!(counters.items_of(&words, 1), (1 << 32) + 5);
    }

    #[test]
    fn a_binned_kernel_has_a_queue_for_each_member() {
        let names: Vec<String> = ["a", "b", "c", "d", "e"].map(String::from).to_vec();
        let kernel = |form, members: &[usize]| PlanKernel::new(form, members.to_vec(), &names);
        let plan = Plan {
            kernels: vec![
                kernel(Form::Mixed, &[1, 4]),
                kernel(Form::Inline, &[2]),
                kernel(Form::Binned, &[0, 3]),
            ],
            ..Plan::own(&names, &[])
        };
        assert_eq!(lit(3).of_kernels(&plan), [1..2, 2..2, 2..4]);
    }
}
