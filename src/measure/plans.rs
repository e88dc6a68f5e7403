//! Plans by measured kernels: the time model that looks times up, and what can be found with it.

use std::collections::BTreeMap;

use impasto_compiler::cost::Inputs;
use impasto_compiler::partition::search::Groups;
use impasto_compiler::partition::{Form, TimeModel};

/// Seconds of measured kernels. What was not measured takes for ever, so that no search picks it.
#[derive(Clone, Debug, Default)]
pub(super) struct Times {
    seconds: BTreeMap<(&'static str, Vec<usize>), f64>,
}

impl Times {
    pub(super) fn insert(&mut self, form: Form, members: Vec<usize>, seconds: f64) {
        self.seconds.insert(key(form, &members), seconds);
    }

    /// What a plan's kernels take together; `None` if one was not measured.
    pub(super) fn added(&self, groups: &[(Form, Vec<usize>)]) -> Option<f64> {
        let of = |(form, members): &(Form, Vec<usize>)| self.seconds(*form, members);
        let sum: f64 = groups.iter().map(of).sum();
        sum.is_finite().then_some(sum)
    }

    /// The slowest of all partitions of `materials`; `None` if they are many or one cannot be told.
    pub(super) fn worst(&self, materials: &[usize]) -> Option<Groups> {
        if materials.len() > super::ALL {
            return None;
        }
        let all = (1u32 << materials.len()) - 1;
        let plans = (0..=all).filter_map(|inline| {
            let (mut sum, mut groups) = self.worst_queued(materials, all & !inline)?;
            if inline != 0 {
                let members = chosen(materials, inline);
                sum += self.known(Form::Inline, &members)?;
                groups.push((Form::Inline, members));
            }
            Some((sum, groups))
        });
        let worst = plans.max_by(|(a, _), (b, _)| a.total_cmp(b));
        worst.map(|(_, groups)| groups)
    }

    /// The slowest kernels with queues over the materials whose bits are set.
    fn worst_queued(&self, materials: &[usize], set: u32) -> Option<(f64, Groups)> {
        if set == 0 {
            return Some((0.0, Vec::new()));
        }
        let first = set & set.wrapping_neg();
        let mut worst: Option<(f64, Groups)> = None;
        // Every subset with the first material in it, and the rest of the set.
        let rest = set & !first;
        let mut more = rest;
        loop {
            let members = chosen(materials, first | more);
            for form in Form::queued_of_members(members.len()) {
                let seconds = self.known(form, &members);
                let others = self.worst_queued(materials, rest & !more);
                if let (Some(seconds), Some((sum, mut groups))) = (seconds, others)
                    && worst.as_ref().is_none_or(|(w, _)| seconds + sum > *w)
                {
                    groups.push((form, members.clone()));
                    worst = Some((seconds + sum, groups));
                }
            }
            if more == 0 {
                return worst;
            }
            more = (more - 1) & rest;
        }
    }

    fn known(&self, form: Form, members: &[usize]) -> Option<f64> {
        self.seconds.get(&key(form, members)).copied()
    }

    /// A partition drawn by chance whose kernels are all measured, if a few draws find one.
    pub(super) fn drawn(&self, materials: &[usize], numbers: &mut Inputs) -> Option<Groups> {
        (0..200)
            .map(|_| draw(materials, numbers))
            .find(|groups| self.added(groups).is_some())
    }
}

impl TimeModel for Times {
    fn seconds(&self, form: Form, members: &[usize]) -> f64 {
        self.known(form, members).unwrap_or(f64::INFINITY)
    }
}

/// A queue of one material is the same in every form.
fn key(form: Form, members: &[usize]) -> (&'static str, Vec<usize>) {
    (form.with_members(members.len()).name(), members.to_vec())
}

fn chosen(materials: &[usize], set: u32) -> Vec<usize> {
    let members = materials.iter().enumerate();
    let members = members.filter(|(i, _)| set & (1 << i) != 0);
    members.map(|(_, m)| *m).collect()
}

/// Materials thrown into as many boxes, the first of them inline at times.
pub(super) fn draw(materials: &[usize], numbers: &mut Inputs) -> Groups {
    let boxes = materials.len();
    let mut below = |n: usize| ((numbers.unit() * n as f64) as usize).min(n - 1);
    let mut groups: Vec<Vec<usize>> = vec![Vec::new(); boxes];
    for material in materials {
        groups[below(boxes)].push(*material);
    }
    groups.retain(|group| !group.is_empty());
    let inline = below(2) == 0;
    let queued: Vec<Form> = Form::queued_of_members(2).collect();
    let form = |(index, members): (usize, Vec<usize>)| {
        let form = queued[below(queued.len())].with_members(members.len());
        let form = if inline && index == 0 {
            Form::Inline
        } else {
            form
        };
        (form, members)
    };
    let mut groups: Groups = groups.into_iter().enumerate().map(form).collect();
    groups.sort_by_key(|(form, members)| (!form.has_queue(), members.clone()));
    groups
}

#[cfg(test)]
mod tests {
    use super::*;
    use impasto_compiler::partition::search::{Automatic, Problem, Search};

    /// Kernels of up to three materials; mixed ones are slow, inline ones too beyond one.
    fn times() -> Times {
        let mut times = Times::default();
        for candidate in super::super::candidates(&[0, 1, 2]) {
            let n = candidate.members.len() as f64;
            let first = candidate.members[0] as f64;
            let seconds = match candidate.form {
                Form::Own => 1.0 + 0.1 * first,
                Form::Mixed => 3.0 * n,
                Form::Binned => 1.0 + 0.5 * n,
                Form::Inline => 0.5 * n * n * n,
            };
            times.insert(candidate.form, candidate.members, seconds);
        }
        times
    }

    #[test]
    fn the_best_and_the_worst_of_all_plans_are_found() {
        let times = times();
        let best = Automatic.search(&Problem::new(0..3), &times);
        // One material inline, which may be any but for rounding, and two binned.
        assert_eq!(times.added(&best), Some(0.5 + 2.0));
        let worst = times.worst(&[0, 1, 2]).expect("they are few");
        assert_eq!(worst, [(Form::Inline, vec![0, 1, 2])]);
        assert_eq!(times.worst(&(0..7).collect::<Vec<_>>()), None);
        let mut saving = times.clone();
        for ((form, _), seconds) in &mut saving.seconds {
            *seconds *= if *form == "inline" { -1.0 } else { 1.0 };
        }
        let worst = saving.worst(&[0, 1, 2]).expect("they are few");
        assert_eq!(worst, [(Form::Mixed, vec![0, 1, 2])]);
    }

    #[test]
    fn what_was_not_measured_takes_for_ever() {
        let mut times = times();
        let key = key(Form::Binned, &[1, 2]);
        times.seconds.remove(&key);
        assert_eq!(
            times.added(&[(Form::Own, vec![0]), (Form::Binned, vec![1, 2])]),
            None
        );
        let best = Automatic.search(&Problem::new(0..3), &times);
        assert!(!best.contains(&(Form::Binned, vec![1, 2])) && times.added(&best).is_some());
        // A binned kernel of one is its own.
        assert_eq!(times.added(&[(Form::Binned, vec![2])]), Some(1.2));
    }

    #[test]
    fn drawn_plans_hold_every_material_once() {
        let (times, mut numbers) = (times(), Inputs::new(1));
        let mut different = std::collections::BTreeSet::new();
        for _ in 0..30 {
            let groups = times
                .drawn(&[0, 1, 2], &mut numbers)
                .expect("all are measured");
            let mut members: Vec<usize> = groups.iter().flat_map(|(_, m)| m.clone()).collect();
            members.sort_unstable();
            assert_eq!(members, [0, 1, 2]);
            assert!(groups.iter().filter(|(f, _)| *f == Form::Inline).count() <= 1);
            different.insert(format!("{groups:?}"));
        }
        assert!(different.len() > 5);
    }
}
