//! What the animations of a glTF file move, and by what: the channels of each node, told apart once.
//!
//! The first animation is shown, and with it each that moves no node of one that is shown: Blender writes one for each
//! object. Those that move the same nodes are other takes.

use std::collections::{BTreeMap, HashSet};

use gltf::animation::{Interpolation, Property};
use gltf::json;
use gltf::json::validation::Checked;

use super::Buffers;

#[cfg(test)]
mod tests;

/// The motion of a file's nodes.
#[derive(Default)]
pub(super) struct Motion {
    /// The animations in words.
    names: Vec<String>,
    /// By the node and what of it moves.
    channels: BTreeMap<(usize, Moved), Sampler>,
    /// By the node: does its place in the world change?
    moves: Vec<bool>,
    /// By the node: the node that it is a child of.
    parents: Vec<Option<usize>>,
}

/// What of a node a channel moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Moved {
    Translation,
    Rotation,
    Scale,
    Weights,
}

/// Where a channel's keys are.
#[derive(Clone, Copy)]
struct Sampler {
    animation: usize,
    number: usize,
    /// The accessors of times and of values.
    input: usize,
    output: usize,
    interpolation: Interpolation,
}

impl Motion {
    /// The motion of the nodes in a file.
    ///
    /// # Errors
    /// A channel leads nowhere, in words.
    pub(super) fn of(root: &json::Root) -> Result<Self, String> {
        let count = root.nodes.len();
        let mut motion = Self {
            moves: vec![false; count],
            parents: vec![None; count],
            ..Self::default()
        };
        let children = |node: usize| {
            let children = root.nodes[node].children.iter().flatten();
            children.map(|child| child.value())
        };
        for node in 0..count {
            for child in children(node) {
                motion.parents[child] = Some(node);
            }
        }
        let mut moved = HashSet::new();
        for (number, animation) in root.animations.iter().enumerate() {
            let name = animation.name.as_deref().filter(|n| !n.trim().is_empty());
            let name = name.map_or(format!("animation {number}"), |n| {
                format!("animation `{n}`")
            });
            let channels = channels(animation, number, count).map_err(|channel| {
                format!("channel {channel} of {name} leads to something that is not there")
            })?;
            motion.names.push(name);
            let own: HashSet<usize> = channels.keys().map(|(node, _)| *node).collect();
            if own.is_disjoint(&moved) {
                moved.extend(own);
                motion.channels.extend(channels);
            }
        }
        let moved = motion.channels.keys();
        let mut pending: Vec<usize> = moved
            .filter(|(_, what)| *what != Moved::Weights)
            .map(|(node, _)| *node)
            .collect();
        while let Some(node) = pending.pop() {
            if !std::mem::replace(&mut motion.moves[node], true) {
                pending.extend(children(node));
            }
        }
        Ok(motion)
    }

    /// The node that this one is a child of.
    pub(super) fn parent(&self, node: usize) -> Option<usize> {
        self.parents.get(node).copied().flatten()
    }

    /// Does the node's place in the world change?
    pub(super) fn moves(&self, node: usize) -> bool {
        self.moves.get(node).is_some_and(|moves| *moves)
    }

    /// Does that of the node change by channels of its own?
    pub(super) fn has(&self, node: usize, what: Moved) -> bool {
        self.channels.contains_key(&(node, what))
    }

    /// When the last key of the node, or of those that it is within, is, in seconds.
    ///
    /// # Errors
    /// What is wrong with the keys, in words.
    pub(super) fn last(&self, node: usize, buffers: &Buffers<'_>) -> Result<f64, String> {
        let mut last = 0.0f64;
        let mut within = Some(node);
        // A file in which nodes are within themselves has an error of its own.
        for _ in 0..super::nodes::MAX_DEPTH {
            let Some(node) = within else { break };
            let own = self
                .channels
                .range((node, Moved::Translation)..=(node, Moved::Weights));
            for sampler in own.map(|(_, sampler)| sampler) {
                let times = self.times(sampler, buffers)?;
                last = last.max(times.last().copied().unwrap_or(0.0));
            }
            within = self.parent(node);
        }
        Ok(last)
    }

    /// What a node has at a time; none if nothing says so.
    ///
    /// # Errors
    /// What is wrong with the keys, in words.
    pub(super) fn at<const N: usize>(
        &self,
        node: usize,
        what: Moved,
        seconds: f64,
        buffers: &Buffers<'_>,
    ) -> Result<Option<[f64; N]>, String> {
        let Some(sampler) = self.channels.get(&(node, what)) else {
            return Ok(None);
        };
        let values = self.values::<N>(sampler, buffers)?;
        let at = self.sampled(sampler, what, seconds, &values, N, buffers)?;
        Ok(at.try_into().ok())
    }

    /// The weights of a node's `count` morph targets at a time; none if nothing says so.
    ///
    /// # Errors
    /// What is wrong with the keys, in words.
    pub(super) fn weights(
        &self,
        node: usize,
        count: usize,
        seconds: f64,
        buffers: &Buffers<'_>,
    ) -> Result<Option<Vec<f64>>, String> {
        let Some(sampler) = self.channels.get(&(node, Moved::Weights)) else {
            return Ok(None);
        };
        let values = self.values::<1>(sampler, buffers)?;
        let what = Moved::Weights;
        self.sampled(sampler, what, seconds, &values, count, buffers)
            .map(Some)
    }

    fn wrong(&self, sampler: &Sampler, what: &str) -> String {
        let Sampler {
            number, animation, ..
        } = sampler;
        format!("sampler {number} of {} {what}", self.names[*animation])
    }

    /// The times of keys, none before the one before it.
    fn times(&self, sampler: &Sampler, buffers: &Buffers<'_>) -> Result<Vec<f64>, String> {
        let times: Vec<f64> = self.numbers::<1>(sampler, sampler.input, buffers)?;
        if times.is_empty() {
            return Err(self.wrong(sampler, "has no keys"));
        }
        if let Some(late) = times.windows(2).position(|pair| pair[0] > pair[1]) {
            let what = format!("has key {} before the one before it", late + 1);
            return Err(self.wrong(sampler, &what));
        }
        Ok(times)
    }

    fn values<const N: usize>(
        &self,
        sampler: &Sampler,
        buffers: &Buffers<'_>,
    ) -> Result<Vec<f64>, String> {
        self.numbers::<N>(sampler, sampler.output, buffers)
    }

    fn numbers<const N: usize>(
        &self,
        sampler: &Sampler,
        accessor: usize,
        buffers: &Buffers<'_>,
    ) -> Result<Vec<f64>, String> {
        let numbers = buffers.floats_of::<N>(accessor);
        let numbers =
            numbers.map_err(|why| self.wrong(sampler, &format!("cannot be read: {why}")))?;
        let numbers: Vec<f64> = numbers.into_iter().flatten().map(f64::from).collect();
        if numbers.iter().any(|x| !x.is_finite()) {
            return Err(self.wrong(sampler, "has a value that is no number"));
        }
        Ok(numbers)
    }

    /// The `width` numbers that keys of these values come to at a time: before the first key, and after the last, what
    /// that says (glTF 2.0, appendix C).
    fn sampled(
        &self,
        sampler: &Sampler,
        what: Moved,
        seconds: f64,
        values: &[f64],
        width: usize,
        buffers: &Buffers<'_>,
    ) -> Result<Vec<f64>, String> {
        let times = self.times(sampler, buffers)?;
        let is_cubic = sampler.interpolation == Interpolation::CubicSpline;
        let each = if is_cubic { 3 * width } else { width };
        if times.len().checked_mul(each) != Some(values.len()) {
            let (keys, has) = (times.len(), values.len());
            let what = format!("has {has} numbers for {keys} keys of {each}");
            return Err(self.wrong(sampler, &what));
        }
        // Of a cubic key, the slope before it, its value, and the slope after it.
        let part = |key: usize, part: usize| &values[key * each + part * width..][..width];
        let value = |key: usize| part(key, usize::from(is_cubic));
        let after = times.partition_point(|time| *time <= seconds);
        if after == 0 || after == times.len() {
            return Ok(value(after.saturating_sub(1)).to_vec());
        }
        let (from, to) = (after - 1, after);
        let span = times[to] - times[from];
        let t = (seconds - times[from]) / span;
        let mixed = |weights: [f64; 4], parts: [&[f64]; 4]| -> Vec<f64> {
            let sum = |i: usize| (0..4).map(|p| weights[p] * parts[p][i]).sum();
            (0..width).map(sum).collect()
        };
        Ok(match sampler.interpolation {
            Interpolation::Step => value(from).to_vec(),
            Interpolation::Linear if what == Moved::Rotation => {
                let [a, b] = [value(from), value(to)].map(rotation);
                a.slerp(b, t).to_array().to_vec()
            }
            Interpolation::Linear => {
                let pairs = value(from).iter().zip(value(to));
                pairs.map(|(a, b)| a + t * (b - a)).collect()
            }
            Interpolation::CubicSpline => {
                let (t2, t3) = (t * t, t * t * t);
                let weights = [
                    2.0 * t3 - 3.0 * t2 + 1.0,
                    span * (t3 - 2.0 * t2 + t),
                    3.0 * t2 - 2.0 * t3,
                    span * (t3 - t2),
                ];
                mixed(
                    weights,
                    [value(from), part(from, 2), value(to), part(to, 0)],
                )
            }
        })
    }
}

/// The channels of an animation in a file of so many nodes; the number of one that leads nowhere.
fn channels(
    animation: &json::Animation,
    number: usize,
    nodes: usize,
) -> Result<BTreeMap<(usize, Moved), Sampler>, usize> {
    let mut channels = BTreeMap::new();
    for (index, channel) in animation.channels.iter().enumerate() {
        let what = match channel.target.path {
            Checked::Valid(Property::Translation) => Moved::Translation,
            Checked::Valid(Property::Rotation) => Moved::Rotation,
            Checked::Valid(Property::Scale) => Moved::Scale,
            Checked::Valid(Property::MorphTargetWeights) => Moved::Weights,
            Checked::Invalid => continue,
        };
        let node = channel.target.node.value();
        let sampler = animation.samplers.get(channel.sampler.value());
        let sampler = sampler.filter(|_| node < nodes).ok_or(index)?;
        let interpolation = match sampler.interpolation {
            Checked::Valid(interpolation) => interpolation,
            Checked::Invalid => Interpolation::Linear,
        };
        let sampler = Sampler {
            animation: number,
            number: channel.sampler.value(),
            input: sampler.input.value(),
            output: sampler.output.value(),
            interpolation,
        };
        // Of two channels that say the same of a node, the first holds.
        channels.entry((node, what)).or_insert(sampler);
    }
    Ok(channels)
}

/// A rotation of four numbers; of zeros none at all.
pub(super) fn rotation(numbers: &[f64]) -> glam::DQuat {
    let four = glam::DVec4::from_array(std::array::from_fn(|i| {
        numbers.get(i).copied().unwrap_or(0.0)
    }));
    let unit = four.normalize_or_zero();
    if unit == glam::DVec4::ZERO {
        glam::DQuat::IDENTITY
    } else {
        glam::DQuat::from_vec4(unit)
    }
}
