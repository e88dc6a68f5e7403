//! Which kernels to measure: all of them where materials are few, a stated sample where they are many or time is short.

use std::collections::BTreeSet;

use impasto_compiler::cost::Inputs;
use impasto_compiler::partition::{Form, Groups};
use impasto_runtime::lab::Candidate;

use super::plans::draw;

/// The most materials of which every subset is measured.
pub const ALL: usize = 6;
/// How many larger subsets are drawn beyond that, of each form.
const DRAWN: usize = 24;
/// The seed of what is drawn.
const SEED: u64 = 0x1a30;

/// The kernels of `materials`, ascending: every material by itself, then those of several. Up to
/// [`ALL`] materials these are all subsets in every form; beyond, all pairs and a sample of larger
/// subsets.
pub fn candidates(materials: &[usize]) -> Vec<Candidate> {
    let subsets = match materials.len() {
        ..=ALL => subsets(materials),
        _ => sample(materials),
    };
    in_all_forms(materials, subsets)
}

/// The same, but no more than `most` kernels beyond those of `plans`, which come first: single materials, then in turn what
/// comes of a plan when one material moves to another kernel, and the kernels of a plan drawn by chance. So those that
/// were measured go together into many plans, good ones above all.
pub fn candidates_within(materials: &[usize], plans: &[Groups], most: usize) -> Vec<Candidate> {
    let mut all = Distinct::default();
    for (form, members) in plans.iter().flatten() {
        all.add(*form, members.clone());
    }
    let most = most.saturating_add(all.0.len());
    let every = candidates(materials);
    let rest = every.iter().filter(|c| !all.0.contains(c)).count();
    if all.0.len() + rest <= most {
        let every = every.into_iter().filter(|c| !all.0.contains(c));
        return all.0.iter().cloned().chain(every).collect();
    }
    for material in materials {
        all.add(Form::Own, vec![*material]);
        all.add(Form::Inline, vec![*material]);
    }
    let mut numbers = Inputs::new(SEED);
    // What chance finds again and again is known already.
    for turn in 0..20 * most {
        let groups = match plans {
            [_, ..] if turn % 2 == 0 => {
                let plan = &plans[turn / 2 % plans.len()];
                moved(plan, &mut numbers)
            }
            _ => draw(materials, &mut numbers),
        };
        for (form, members) in groups {
            if all.0.len() >= most {
                return all.0;
            }
            all.add(form, members);
        }
    }
    all.0
}

/// The kernels that a plan gets when one of its materials moves to another of them, or inline, or out of all.
fn moved(plan: &Groups, numbers: &mut Inputs) -> Groups {
    let mut below = |n: usize| ((numbers.unit() * n as f64) as usize).min(n.saturating_sub(1));
    let mut plan = plan.clone();
    if plan.is_empty() {
        return plan;
    }
    let from = below(plan.len());
    let taken = below(plan[from].1.len());
    let material = plan[from].1.remove(taken);
    // One place more than there are kernels: a queue of its own, or inline with what is.
    match below(plan.len() + 2) {
        to if to < plan.len() && to != from => plan[to].1.push(material),
        to if to % 2 == 0 => plan.push((Form::Own, vec![material])),
        _ => match plan.iter_mut().find(|(form, _)| *form == Form::Inline) {
            Some((_, inline)) => inline.push(material),
            None => plan.push((Form::Inline, vec![material])),
        },
    }
    plan.retain(|(_, members)| !members.is_empty());
    for (form, members) in &mut plan {
        members.sort_unstable();
        // What had one material and has two shares a queue.
        if *form == Form::Own && members.len() > 1 {
            *form = Form::Binned;
        }
    }
    plan
}

/// Kernels, each once.
#[derive(Default)]
struct Distinct(Vec<Candidate>);

impl Distinct {
    fn add(&mut self, form: Form, members: Vec<usize>) {
        let new = candidate(form.with_members(members.len()), members);
        if !self.0.contains(&new) {
            self.0.push(new);
        }
    }
}

/// Every material by itself, and the subsets, in all forms that they may have.
fn in_all_forms(
    materials: &[usize],
    subsets: impl IntoIterator<Item = Vec<usize>>,
) -> Vec<Candidate> {
    let each = |members: Vec<usize>| {
        let forms = Form::of_members(members.len());
        forms.map(move |form| candidate(form, members.clone()))
    };
    let singles = materials.iter().map(|m| vec![*m]);
    singles.chain(subsets).flat_map(each).collect()
}

/// A sample for fitting: every material by itself and the first two, three and so on together; with
/// `pairs`, all of those too.
pub fn sample_for_fit(materials: &[usize], pairs: bool) -> Vec<Candidate> {
    let mut subsets: BTreeSet<Vec<usize>> = BTreeSet::new();
    subsets.extend((2..=materials.len()).map(|count| materials[..count].to_vec()));
    if pairs {
        subsets.extend(all_pairs(materials));
    }
    in_all_forms(materials, subsets)
}

/// A kernel to be measured.
pub fn candidate(form: Form, members: Vec<usize>) -> Candidate {
    Candidate { form, members }
}

/// All subsets of two and more, small ones first.
fn subsets(materials: &[usize]) -> Vec<Vec<usize>> {
    let members = |bits: u32| -> Vec<usize> {
        let chosen = materials.iter().enumerate();
        let chosen = chosen.filter(|(i, _)| bits & (1 << i) != 0);
        chosen.map(|(_, m)| *m).collect()
    };
    let mut all: Vec<Vec<usize>> = (0..1u32 << materials.len()).map(members).collect();
    all.retain(|subset| subset.len() >= 2);
    all.sort_by_key(Vec::len);
    all
}

/// All pairs, larger subsets of every size drawn by chance, and everything.
fn sample(materials: &[usize]) -> Vec<Vec<usize>> {
    let mut all = all_pairs(materials);
    let mut numbers = Inputs::new(SEED);
    let mut drawn = BTreeSet::new();
    for turn in 0..DRAWN {
        let size = 3 + turn * (materials.len() - 3) / DRAWN;
        let mut rest = materials.to_vec();
        let mut members: Vec<usize> = (0..size)
            .map(|_| rest.swap_remove((numbers.unit() * rest.len() as f64) as usize))
            .collect();
        members.sort_unstable();
        drawn.insert(members);
    }
    drawn.insert(materials.to_vec());
    all.extend(drawn);
    all
}

fn all_pairs(materials: &[usize]) -> Vec<Vec<usize>> {
    let from = |(i, a): (usize, &usize)| -> Vec<Vec<usize>> {
        materials[i + 1..].iter().map(|b| vec![*a, *b]).collect()
    };
    materials.iter().enumerate().flat_map(from).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_materials_are_measured_in_all_ways() {
        let all = candidates(&[0, 2, 3]);
        // Singles: 3 own and 3 inline. Subsets of two and three: 4, in three forms.
        assert_eq!(all.len(), 6 + 12);
        assert!(all.contains(&candidate(Form::Inline, vec![2])));
        assert!(all.contains(&candidate(Form::Binned, vec![0, 3])));
        assert!(all.contains(&candidate(Form::Mixed, vec![0, 2, 3])));
        assert_eq!(candidates(&(0..6).collect::<Vec<_>>()).len(), 12 + 57 * 3);
        assert_eq!(candidates(&[4]).len(), 2);
        assert!(candidates(&[]).is_empty());
    }

    #[test]
    fn within_a_number_the_kernels_of_plans_come_first_and_make_up_others() {
        let materials: Vec<usize> = (0..8).collect();
        let plans = [
            vec![(Form::Binned, materials.clone())],
            vec![
                (Form::Mixed, vec![0, 1, 2]),
                (Form::Inline, vec![3, 4, 5, 6, 7]),
            ],
        ];
        let some = candidates_within(&materials, &plans, 60);
        assert_eq!(some.len(), 63);
        assert_eq!(some, candidates_within(&materials, &plans, 60));
        assert_eq!(some[0], candidate(Form::Binned, materials.clone()));
        for (at, kernel) in some.iter().enumerate() {
            assert!(!some[..at].contains(kernel), "{kernel:?} twice");
            assert!(kernel.members.is_sorted() && !kernel.members.is_empty());
            let forms: Vec<Form> = Form::of_members(kernel.members.len()).collect();
            assert!(forms.contains(&kernel.form), "{kernel:?}");
        }
        let of = |size: usize| some.iter().filter(|c| c.members.len() == size).count();
        assert!(of(1) >= 16 && of(7) > 0, "{some:?}");
        // Where all fit, all are measured.
        let few = candidates_within(&[0, 1, 2], &[], 18);
        assert_eq!(few.len(), 18);
        assert_eq!(candidates_within(&[0, 1, 2], &[], 7).len(), 7);
    }

    #[test]
    fn fits_take_prefixes_and_pairs() {
        let few = sample_for_fit(&[1, 3, 4, 7], false);
        assert_eq!(few.len(), 8 + 3 * 3);
        assert!(few.contains(&candidate(Form::Binned, vec![1, 3, 4])));
        // One of the six pairs is a prefix.
        assert_eq!(sample_for_fit(&[1, 3, 4, 7], true).len(), 8 + (3 + 5) * 3);
    }

    #[test]
    fn of_many_materials_all_pairs_and_the_same_sample_are_measured() {
        let materials: Vec<usize> = (0..9).collect();
        let all = candidates(&materials);
        assert_eq!(all, candidates(&materials));
        let of = |size: usize| all.iter().filter(|c| c.members.len() == size).count();
        assert_eq!((of(1), of(2), of(9)), (18, 36 * 3, 3));
        assert!(of(4) > 0 && of(7) > 0);
        for candidate in &all {
            assert!(candidate.members.windows(2).all(|pair| pair[0] < pair[1]));
        }
    }
}
