//! Which device takes which samples.
//!
//! Every device begins with an equal share of consecutive samples, and takes it in one pass if it can: a pass ends
//! with a pool that runs empty, which costs time. A device that is done takes over samples that another has not begun,
//! so many that both are expected to end together. The samples of a device that is lost are free again, but for those
//! that it has put into the common film.
//!
//! Nothing here knows what a device is, or what time it is.

use std::collections::VecDeque;

use crate::film::ranges::Range;
use crate::render::passes::Order;

/// The most samples of a pass: indices beyond the last, which idle slots are given, do not wrap.
const LONGEST: u64 = 1 << 30;

/// What a device does next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// Takes these samples.
    Take(Range),
    /// Puts what it took into the common film.
    Put,
    /// Waits: others may give it something, or be lost.
    Wait,
    /// Nothing will come any more.
    Done,
}

/// The samples of a render, and which device has which.
#[derive(Debug)]
pub(super) struct Board {
    members: Vec<Member>,
    /// Those that no device has.
    free: Vec<Range>,
    /// How often all were asked to put in what they have.
    calls: u64,
    /// Whether no more samples are begun.
    stopped: bool,
    /// Seconds that giving samples away must save.
    worthwhile: f64,
}

/// What a device has.
#[derive(Debug, Default)]
struct Member {
    /// Samples that are its to take.
    rest: Vec<Range>,
    /// Those of the pass that it runs.
    running: Option<Range>,
    /// How many of these are finished, by the paths that are.
    finished: f64,
    /// When the pass began.
    began: f64,
    /// Those that are in its own film.
    held: Vec<Range>,
    /// How many are in the common film.
    put: u64,
    /// The last call that it has answered.
    answered: u64,
    /// Devices that wait for it to give samples away.
    asked_by: VecDeque<usize>,
    /// Whether all samples of its pass are begun.
    is_begun: bool,
    /// Samples that it took, and the seconds that it took for them.
    taken: u64,
    seconds: f64,
    is_lost: bool,
    /// Whether it asks no more what to do.
    has_left: bool,
}

impl Board {
    /// All samples of some ranges, in equal shares of the devices that are not lost.
    pub(super) fn new(ranges: &[Range], lost: &[bool], worthwhile: f64) -> Self {
        let mut free = ranges.to_vec();
        let mut left = lost.iter().filter(|lost| !**lost).count() as u64;
        let mut members: Vec<Member> = Vec::new();
        for is_lost in lost.iter().copied() {
            let mut member = Member {
                is_lost,
                has_left: is_lost,
                ..Member::default()
            };
            if !is_lost {
                let share = count(&free).div_ceil(left);
                member.rest = take_first(&mut free, share);
                left -= 1;
            }
            members.push(member);
        }
        Self {
            members,
            free,
            calls: 0,
            stopped: false,
            worthwhile,
        }
    }

    /// What a device does next, at a time in seconds.
    pub(super) fn next(&mut self, index: usize, now: f64) -> Step {
        let holds = !self.members[index].held.is_empty();
        if self.stopped {
            return if holds { Step::Put } else { Step::Done };
        }
        if holds && self.members[index].answered < self.calls {
            return Step::Put;
        }
        if self.members[index].rest.is_empty() {
            self.take_free(index);
        }
        if self.members[index].rest.is_empty() {
            self.ask(index, now);
        }
        let member = &mut self.members[index];
        if member.rest.is_empty() {
            return if holds {
                Step::Put
            } else if self.is_over() {
                Step::Done
            } else {
                Step::Wait
            };
        }
        let first = member.rest[0].count.min(LONGEST);
        let range = take_first(&mut member.rest, first)[0];
        member.running = Some(range);
        (member.finished, member.began, member.is_begun) = (0.0, now, false);
        Step::Take(range)
    }

    /// Takes a share of what nobody has.
    fn take_free(&mut self, index: usize) {
        let devices = self.members.iter().filter(|m| !m.is_lost).count().max(1);
        let share = count(&self.free).div_ceil(devices as u64);
        self.members[index].rest = take_first(&mut self.free, share);
    }

    /// Asks the device that will take longest for some of its samples. Those that are not in its pass are given at once.
    fn ask(&mut self, index: usize, now: f64) {
        if self.members.iter().any(|m| m.asked_by.contains(&index)) {
            return;
        }
        let saved = |other: usize| -> Option<(f64, usize)> {
            let (gift, seconds) = self.gift(other, index, now);
            let member = &self.members[other];
            let movable = !member.rest.is_empty() || !member.is_begun;
            (other != index && movable && gift > 0 && seconds >= self.worthwhile)
                .then_some((seconds, other))
        };
        let best = (0..self.members.len()).filter_map(saved);
        let Some((_, other)) = best.max_by(|a, b| a.0.total_cmp(&b.0)) else {
            return;
        };
        let (gift, _) = self.gift(other, index, now);
        if count(&self.members[other].rest) >= gift {
            let given = take_last(&mut self.members[other].rest, gift);
            self.members[index].rest = given;
        } else {
            self.members[other].asked_by.push_back(index);
        }
    }

    /// How many samples a device should give another so that both end together, and the seconds that this saves.
    fn gift(&self, from: usize, to: usize, now: f64) -> (u64, f64) {
        let member = &self.members[from];
        let left = member.left();
        let own = member.rate(now);
        let others = self.members[to].rate(now);
        let (Some(own), others) = (own, others.or(own)) else {
            return (0, 0.0);
        };
        let kept = left * own / (own + others.unwrap_or(own));
        (((left - kept).max(0.0)) as u64, (left - kept) / own)
    }

    /// Whether no device has anything to do, so that none can be lost with samples.
    fn is_over(&self) -> bool {
        let idle = |m: &Member| m.rest.is_empty() && m.running.is_none() && m.held.is_empty();
        self.free.is_empty() && self.members.iter().all(|m| m.is_lost || idle(m))
    }

    /// A device has finished so many samples of its pass. Should it halt, to begin fewer than it was given?
    pub(super) fn look(&mut self, index: usize, finished: f64) -> Order {
        let (stopped, calls) = (self.stopped, self.calls);
        let member = &mut self.members[index];
        member.finished = finished;
        let wanted = stopped || member.answered < calls || !member.asked_by.is_empty();
        if wanted && !member.is_begun {
            return Order::Halt;
        }
        Order::GoOn
    }

    /// How many samples of its pass a device keeps that has begun some.
    pub(super) fn keep(&mut self, index: usize, begun: u64, now: f64) -> u64 {
        let Some(running) = self.members[index].running else {
            return begun;
        };
        let ends = self.stopped || self.members[index].answered < self.calls;
        let member = &mut self.members[index];
        let not_begun = Range::new(running.first + begun, running.end());
        let before = std::mem::take(&mut member.rest);
        member.rest = not_begun.into_iter().chain(before).collect();
        member.running = Range::new(running.first, running.first + begun);
        while let Some(other) = self.members[index].asked_by.pop_front() {
            let (gift, seconds) = self.gift(index, other, now);
            if seconds >= self.worthwhile {
                let given = take_last(&mut self.members[index].rest, gift);
                self.members[other].rest.extend(given);
            }
        }
        let member = &mut self.members[index];
        member.is_begun = true;
        if ends {
            return begun;
        }
        // It goes on with what is still its own of the pass.
        let again = member.rest.first().copied();
        let again = again.filter(|range| range.first == running.first + begun);
        let more = again.map_or(0, |range| range.count.min(running.count - begun));
        take_first(&mut member.rest, more);
        member.running = Range::new(running.first, running.first + begun + more);
        member.is_begun = more == 0;
        begun + more
    }

    /// A device has taken so many samples of its pass.
    pub(super) fn passed(&mut self, index: usize, taken: u64, now: f64) {
        let member = &mut self.members[index];
        if let Some(running) = member.running.take() {
            let range = Range::new(running.first, running.first + taken);
            member.held.extend(range);
            member.taken += taken;
            member.seconds += now - member.began;
        }
        member.finished = 0.0;
        // Who waits looks again.
        member.asked_by.clear();
    }

    /// What a device holds is in the common film; which samples these are.
    pub(super) fn put(&mut self, index: usize) -> Vec<Range> {
        let member = &mut self.members[index];
        member.answered = self.calls;
        let held = std::mem::take(&mut member.held);
        member.put += count(&held);
        held
    }

    /// A device is lost, with all that is not in the common film.
    pub(super) fn lost(&mut self, index: usize) {
        let member = &mut self.members[index];
        let mut freed = std::mem::take(&mut member.rest);
        freed.extend(member.running.take());
        freed.append(&mut member.held);
        member.asked_by.clear();
        member.is_lost = true;
        self.free.append(&mut freed);
        self.free.sort_unstable();
        for other in &mut self.members {
            other.asked_by.retain(|by| *by != index);
        }
    }

    /// No more samples are begun.
    pub(super) fn stop(&mut self) {
        self.stopped = true;
    }

    /// Asks all devices to put in what they have.
    pub(super) fn call(&mut self) {
        self.calls += 1;
    }

    /// Whether all have, since they were asked last.
    pub(super) fn is_answered(&self) -> bool {
        let answered = |m: &Member| {
            let idle = m.running.is_none() && m.held.is_empty();
            m.is_lost || idle || m.answered >= self.calls
        };
        self.members.iter().all(answered)
    }

    /// A device asks no more what to do.
    pub(super) fn leave(&mut self, index: usize) {
        self.members[index].has_left = true;
    }

    /// Whether all have left.
    pub(super) fn is_left(&self) -> bool {
        self.members.iter().all(|member| member.has_left)
    }

    /// Samples that a device is expected to take from now on.
    pub(super) fn expected(&self, index: usize) -> u64 {
        let member = &self.members[index];
        count(&member.rest) + member.running.map_or(0, |range| range.count)
    }

    /// Samples that are finished on all devices.
    pub(super) fn finished(&self) -> f64 {
        let of = |m: &Member| (m.put + count(&m.held)) as f64 + m.finished;
        self.members.iter().map(of).sum()
    }
}

impl Member {
    /// Samples that are not finished.
    fn left(&self) -> f64 {
        let running = self.running.map_or(0, |range| range.count) as f64;
        (running - self.finished).max(0.0) + count(&self.rest) as f64
    }

    /// Samples a second, if there were any yet.
    fn rate(&self, now: f64) -> Option<f64> {
        let seconds = match self.running {
            Some(_) => self.seconds + (now - self.began),
            None => self.seconds,
        };
        let samples = self.taken as f64 + self.finished;
        (samples > 0.0 && seconds > 0.0).then(|| samples / seconds)
    }
}

/// How many samples some ranges have.
pub(super) fn count(ranges: &[Range]) -> u64 {
    ranges.iter().map(|range| range.count).sum()
}

/// Takes samples from the beginning of a list.
fn take_first(from: &mut Vec<Range>, mut samples: u64) -> Vec<Range> {
    let mut taken = Vec::new();
    while let Some(range) = from.first().copied().filter(|_| samples > 0) {
        let split = range.first + range.count.min(samples);
        taken.extend(Range::new(range.first, split));
        samples -= split - range.first;
        match Range::new(split, range.end()) {
            Some(rest) => from[0] = rest,
            None => drop(from.remove(0)),
        }
    }
    taken
}

/// Takes samples from the end of a list, in their order.
fn take_last(from: &mut Vec<Range>, samples: u64) -> Vec<Range> {
    let kept = count(from).saturating_sub(samples);
    let mut all = std::mem::take(from);
    *from = take_first(&mut all, kept);
    all
}

#[cfg(test)]
mod tests;
