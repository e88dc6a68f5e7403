//! Plans as sets of materials: every partition of them into kernels of every form, its time as the sum
//! of its kernels' times, and the least of all.
//!
//! A kernel of several materials is mixed or binned, one of a single material is own, and one kernel at
//! most is inline, of any number of materials. So n materials have as many plans as the Touchard
//! polynomial T_n has at 2: 2, 6, 22, 94, 454, 2430 for n from 1 to 6.

use std::collections::BTreeMap;

use super::Result;
use crate::measure::Measurement;
use impasto_compiler::partition::{Form, text};

/// A set of materials: bit i is the i-th.
pub type Set = u64;

/// A kernel. Mixed and binned ones of a single material are the same as its own.
pub type Kernel = (Form, Set);

/// A kernel as it is known in tables of times.
pub fn kernel(form: Form, members: Set) -> Kernel {
    match form {
        Form::Mixed | Form::Binned if members.count_ones() == 1 => (Form::Own, members),
        _ => (form, members),
    }
}

/// The kernels of a plan, in ascending order.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Plan(pub Vec<Kernel>);

impl Plan {
    pub fn new(mut kernels: Vec<Kernel>) -> Self {
        kernels.sort_unstable();
        Self(kernels)
    }

    /// The plan that a partition string such as `own:a|binned:b,c|inline:*` describes; materials of
    /// `unused` need not be in it.
    ///
    /// # Errors
    /// What is wrong with the text.
    pub fn parse(partition: &str, names: &[String], unused: &[usize]) -> Result<Self> {
        let plan = text::parse(partition, names, unused).map_err(|e| e.to_string())?;
        let set = |members: &[usize]| members.iter().fold(0, |set, i| set | 1 << i);
        let kernels = plan.kernels.iter();
        let kernels = kernels.map(|k| kernel(k.form, set(&k.materials)));
        Ok(Self::new(kernels.collect()))
    }

    /// As a partition string.
    pub fn text(&self, names: &[String]) -> String {
        let group = |(form, set): &Kernel| {
            let members: Vec<&str> = members(*set).map(|i| names[i].as_str()).collect();
            format!("{}:{}", form.name(), members.join(","))
        };
        self.0.iter().map(group).collect::<Vec<_>>().join("|")
    }
}

/// The set of the first `n` materials.
pub fn all(n: usize) -> Set {
    if n >= 64 { Set::MAX } else { (1 << n) - 1 }
}

/// The members of a set, ascending.
pub fn members(set: Set) -> impl Iterator<Item = usize> {
    (0..64).filter(move |i| set >> i & 1 == 1)
}

/// Subsets of `set`, the set itself first and the empty one last.
fn subsets(set: Set) -> impl Iterator<Item = Set> {
    let mut next = Some(set);
    std::iter::from_fn(move || {
        let subset = next?;
        next = (subset > 0).then(|| (subset - 1) & set);
        Some(subset)
    })
}

/// Every plan for the materials of `set`.
pub fn every(set: Set) -> Vec<Plan> {
    let mut out = Vec::new();
    for inline in subsets(set) {
        let mut kernels = Vec::new();
        if inline != 0 {
            kernels.push((Form::Inline, inline));
        }
        groups(set & !inline, &mut kernels, &mut out);
    }
    out
}

/// Adds to `out` all plans that begin with `kernels` and have kernels with queues for `rest`.
fn groups(rest: Set, kernels: &mut Vec<Kernel>, out: &mut Vec<Plan>) {
    if rest == 0 {
        out.push(Plan::new(kernels.clone()));
        return;
    }
    let first = rest & rest.wrapping_neg();
    for others in subsets(rest & !first) {
        let group = first | others;
        let forms: &[Form] = match others {
            0 => &[Form::Own],
            _ => &[Form::Mixed, Form::Binned],
        };
        for form in forms {
            kernels.push((*form, group));
            groups(rest & !group, kernels, out);
            kernels.pop();
        }
    }
}

/// Seconds of kernels.
#[derive(Clone, Debug, Default)]
pub struct Times(BTreeMap<Kernel, f64>);

impl Times {
    pub fn new(kernels: impl IntoIterator<Item = (Kernel, f64)>) -> Self {
        Self(kernels.into_iter().collect())
    }

    /// The sum over a plan's kernels; none if one of them is not known.
    pub fn sum(&self, plan: &Plan) -> Option<f64> {
        plan.0.iter().map(|kernel| self.0.get(kernel)).sum()
    }

    /// The fastest plan for the materials of `set` that consists of known kernels, and its time; none if
    /// there is none, or if they are too many to try all their subsets.
    pub fn best(&self, set: Set) -> Option<(Plan, f64)> {
        const MOST: u32 = 16;
        if set == 0 || set.count_ones() > MOST {
            return None;
        }
        let places: Vec<usize> = members(set).collect();
        let known = self.0.iter().filter(|((_, of), _)| of & !set == 0);
        let known: Vec<(Set, Kernel, f64)> = known
            .map(|(kernel, seconds)| (packed(kernel.1, &places), *kernel, *seconds))
            .collect();
        let queued = best_queued(places.len(), &known);
        let everything = all(places.len()) as usize;
        let inline = known
            .iter()
            .filter(|(_, kernel, _)| kernel.0 == Form::Inline);
        let none = [(0, None, 0.0)].into_iter();
        let choices = none.chain(inline.map(|(of, kernel, s)| (*of, Some(*kernel), *s)));
        let (seconds, inline, rest) = choices
            .filter_map(|(of, kernel, s)| {
                let rest = everything & !(of as usize);
                Some((queued[rest]?.0 + s, kernel, rest))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        let mut kernels: Vec<Kernel> = inline.into_iter().collect();
        let mut rest = rest;
        while let Some((_, Some((of, last)))) = queued[rest] {
            kernels.push(last);
            rest &= !(of as usize);
        }
        Some((Plan::new(kernels), seconds))
    }
}

/// Seconds of the fastest kernels for a subset, and the one of its first material: its packed members and
/// itself; nothing for the empty subset.
type Fastest = Option<(f64, Option<(Set, Kernel)>)>;

/// The fastest kernels with queues for every subset of `n` materials, from those of smaller subsets.
fn best_queued(n: usize, known: &[(Set, Kernel, f64)]) -> Vec<Fastest> {
    let mut of_first: Vec<Vec<&(Set, Kernel, f64)>> = vec![Vec::new(); n];
    for entry in known
        .iter()
        .filter(|(_, kernel, _)| kernel.0 != Form::Inline)
    {
        of_first[entry.0.trailing_zeros() as usize].push(entry);
    }
    let mut best: Vec<Fastest> = vec![None; 1 << n];
    best[0] = Some((0.0, None));
    for subset in 1..best.len() {
        let candidates = of_first[subset.trailing_zeros() as usize].iter();
        let within = candidates.filter(|(of, _, _)| of & !(subset as Set) == 0);
        let sums = within.filter_map(|(of, kernel, seconds)| {
            let (rest, _) = best[subset & !(*of as usize)]?;
            Some((rest + seconds, Some((*of, *kernel))))
        });
        best[subset] = sums.min_by(|a, b| a.0.total_cmp(&b.0));
    }
    best
}

/// The materials and kernels of a measurement, as sets.
pub struct Sets {
    /// The materials' names.
    pub names: Vec<String>,
    /// Those on surfaces, which plans are about.
    pub used: Set,
    /// The kernels, in the order of the measurement.
    kernels: Vec<Kernel>,
}

impl Sets {
    /// # Errors
    /// If there are more materials than a set can have.
    pub fn of(measured: &Measurement) -> Result<Self> {
        let names: Vec<String> = measured.materials.iter().map(|m| m.name.clone()).collect();
        if names.len() > Set::BITS as usize {
            let (scene, count) = (&measured.scene, names.len());
            return Err(format!(
                "`{scene}` has {count} materials: plans are added up of at most {}",
                Set::BITS
            ));
        }
        let set = |members: &[usize]| members.iter().fold(0, |set: Set, at| set | 1 << at);
        let hits = measured.workload.materials.iter().enumerate();
        let used = hits.filter(|(_, hits)| hits.on_surface);
        let used: Vec<usize> = used.map(|(at, _)| at).collect();
        let kernels = measured.kernels.iter();
        let kernels = kernels.map(|k| kernel(k.form, set(&measured.members(k))));
        Ok(Self {
            used: set(&used),
            kernels: kernels.collect(),
            names,
        })
    }

    /// Seconds of the kernels, in their order; of those that have any.
    pub fn times(&self, seconds: impl IntoIterator<Item = Option<f64>>) -> Times {
        let known = self.kernels.iter().zip(seconds);
        Times::new(known.filter_map(|(kernel, seconds)| Some((*kernel, seconds?))))
    }

    /// The plan that a partition string describes.
    ///
    /// # Errors
    /// What is wrong with the text.
    pub fn plan(&self, partition: &str) -> Result<Plan> {
        let unused = (0..self.names.len()).filter(|at| self.used >> at & 1 == 0);
        Plan::parse(partition, &self.names, &unused.collect::<Vec<_>>())
    }
}

/// The bits of `set` at `places`, side by side.
fn packed(set: Set, places: &[usize]) -> Set {
    let bits = places.iter().enumerate();
    bits.map(|(i, at)| (set >> at & 1) << i).sum()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn there_are_as_many_plans_as_the_touchard_polynomials_say() {
        for (n, count) in [1, 2, 6, 22, 94, 454, 2430].into_iter().enumerate() {
            let plans = every(all(n));
            assert_eq!(plans.len(), count, "of {n} materials");
            let distinct: BTreeSet<&Plan> = plans.iter().collect();
            assert_eq!(distinct.len(), count, "of {n} materials");
        }
    }

    #[test]
    fn without_forms_there_are_as_many_as_bell_numbers() {
        let own_or_mixed = |plan: &&Plan| {
            let forms = plan.0.iter().map(|k| k.0);
            forms
                .clone()
                .all(|form| form == Form::Own || form == Form::Mixed)
        };
        for (n, bell) in [1, 1, 2, 5, 15, 52, 203].into_iter().enumerate() {
            assert_eq!(every(all(n)).iter().filter(own_or_mixed).count(), bell);
        }
    }

    #[test]
    fn every_plan_has_each_material_once() {
        let set = 0b1_0110_0001;
        for plan in every(set) {
            let together = plan.0.iter().fold(0, |union, kernel| union | kernel.1);
            let total: u32 = plan.0.iter().map(|kernel| kernel.1.count_ones()).sum();
            assert_eq!((together, total), (set, set.count_ones()), "{plan:?}");
            assert!(plan.0.iter().filter(|k| k.0 == Form::Inline).count() <= 1);
        }
    }

    /// Times without a pattern, so that every plan has one of its own.
    fn times(set: Set) -> Times {
        let kernels: BTreeSet<Kernel> = every(set).into_iter().flat_map(|plan| plan.0).collect();
        Times::new(kernels.into_iter().map(|kernel| {
            let mixed = (kernel.1 * 4 + kernel.0 as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let members = f64::from(kernel.1.count_ones());
            (
                kernel,
                members.sqrt() * (1.0 + (mixed >> 40) as f64 / (1 << 24) as f64),
            )
        }))
    }

    #[test]
    fn the_best_is_the_least_of_all() {
        for set in [0b1, 0b1000, 0b1101, 0b10_1011, 0b11_1111] {
            let times = times(set);
            let (plan, seconds) = times.best(set).expect("known kernels");
            let of_all = every(set)
                .into_iter()
                .map(|p| times.sum(&p).expect("known"));
            let least = of_all.fold(f64::INFINITY, f64::min);
            assert!((seconds - least).abs() < 1e-12, "{seconds} is not {least}");
            assert!(
                (times.sum(&plan).expect("known") - least).abs() < 1e-12,
                "{plan:?}"
            );
        }
    }

    #[test]
    fn what_was_not_measured_has_no_time() {
        let own = Times::new([((Form::Own, 1), 1.0), ((Form::Own, 2), 2.0)]);
        assert_eq!(
            own.best(0b11),
            Some((Plan(vec![(Form::Own, 1), (Form::Own, 2)]), 3.0))
        );
        assert_eq!(own.best(0b111), None);
        assert_eq!(own.sum(&Plan(vec![(Form::Mixed, 0b11)])), None);
    }

    #[test]
    fn partitions_are_read_as_the_command_writes_them() {
        let names = ["a", "b", "c", "d"].map(String::from);
        let read = |text| Plan::parse(text, &names, &[]).map(|plan| plan.text(&names));
        let same = ["own:a|own:b|mixed:c,d", "own:a|binned:b,c|inline:d"];
        for text in same {
            assert_eq!(read(text).as_deref(), Ok(text));
        }
        assert_eq!(read("own:*").as_deref(), Ok("own:a|own:b|own:c|own:d"));
        assert_eq!(read("d,b|inline:*").as_deref(), Ok("mixed:b,d|inline:a,c"));
        assert_eq!(
            read("a|mixed:b|c,d").as_deref(),
            Ok("own:a|own:b|mixed:c,d")
        );
        assert!(read("a|e").is_err_and(|why| why.contains("`e`")));
        assert!(read("lined:a").is_err_and(|why| why.contains("`lined`")));
        let without = Plan::parse("own:a|own:b", &names, &[2, 3]);
        assert_eq!(without.map(|plan| plan.0.len()), Ok(2));
    }
}
