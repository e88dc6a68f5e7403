//! Which kernels to measure: all of them where materials are few, a stated sample where they are many.

use std::collections::BTreeSet;

use impasto_compiler::cost::Inputs;
use impasto_compiler::partition::Form;
use impasto_runtime::lab::Candidate;

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
