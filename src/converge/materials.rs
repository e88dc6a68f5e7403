//! Who makes the noise: errors and time of the pixels in which each material is seen first.

use std::collections::BTreeMap;

use impasto_runtime::first_hit;

use super::StudyError;
use super::data::MaterialShare;
use super::subject::Stage;

/// The shares of all materials that are seen, those in most pixels first, when a pixel's squared and
/// relative squared errors are `errors`.
pub(super) fn shares(
    errors: &[[f64; 2]],
    stage: &Stage<'_>,
) -> Result<Vec<MaterialShare>, StudyError> {
    let scene = stage.subject.scene;
    let seen = first_hit::materials(scene);
    let pixels = by_material(&seen);
    let seconds: BTreeMap<Option<u32>, f64> = BTreeMap::new();
    let name = |material: u32| {
        scene
            .materials
            .get(material as usize)
            .map(|m| m.name.clone())
    };
    Ok(table(&pixels, errors, &seconds, &name))
}

/// The pixels in which each is seen first.
fn by_material(seen: &[Option<u32>]) -> BTreeMap<Option<u32>, Vec<u32>> {
    let mut pixels: BTreeMap<Option<u32>, Vec<u32>> = BTreeMap::new();
    for (pixel, material) in (0..).zip(seen) {
        pixels.entry(*material).or_default().push(pixel);
    }
    pixels
}

fn table(
    pixels: &BTreeMap<Option<u32>, Vec<u32>>,
    errors: &[[f64; 2]],
    seconds: &BTreeMap<Option<u32>, f64>,
    name: &dyn Fn(u32) -> Option<String>,
) -> Vec<MaterialShare> {
    let error = |pixels: &[u32], which: usize| -> f64 {
        let errors = pixels
            .iter()
            .filter_map(|pixel| errors.get(*pixel as usize));
        errors.map(|error| error[which]).sum()
    };
    let all = |which| errors.iter().map(|error| error[which]).sum::<f64>();
    let all_seconds: f64 = seconds.values().sum();
    let count: usize = pixels.values().map(Vec::len).sum();
    let mut shares: Vec<MaterialShare> = pixels
        .iter()
        .map(|(material, pixels)| MaterialShare {
            name: material.and_then(name),
            pixels: part(pixels.len() as f64, count as f64),
            mse: part(error(pixels, 0), all(0)),
            relmse: part(error(pixels, 1), all(1)),
            seconds: part(seconds.get(material).copied().unwrap_or(0.0), all_seconds),
        })
        .collect();
    shares.sort_by(|a, b| b.pixels.total_cmp(&a.pixels).then(a.name.cmp(&b.name)));
    shares
}

/// The share of something in all; none of nothing.
fn part(some: f64, all: f64) -> f64 {
    if all > 0.0 { some / all } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_add_up_and_the_most_seen_is_first() {
        let seen = [Some(1), None, Some(0), Some(0), None, Some(0)];
        let errors: Vec<[f64; 2]> = (1..7).map(|i| [f64::from(i), 1.0]).collect();
        let seconds = BTreeMap::from([(None, 1.0), (Some(0), 2.0), (Some(1), 5.0)]);
        let name = |i: u32| Some(format!("m{i}"));
        let shares = table(&by_material(&seen), &errors, &seconds, &name);
        let names: Vec<_> = shares.iter().map(|s| s.name.as_deref()).collect();
        assert_eq!(names, [Some("m0"), None, Some("m1")]);
        let of = |pick: fn(&MaterialShare) -> f64| shares.iter().map(pick).collect::<Vec<f64>>();
        assert_eq!(of(|s| s.pixels), [3.0 / 6.0, 2.0 / 6.0, 1.0 / 6.0]);
        assert_eq!(of(|s| s.mse), [13.0 / 21.0, 7.0 / 21.0, 1.0 / 21.0]);
        assert_eq!(of(|s| s.relmse), [3.0 / 6.0, 2.0 / 6.0, 1.0 / 6.0]);
        assert_eq!(of(|s| s.seconds), [2.0 / 8.0, 1.0 / 8.0, 5.0 / 8.0]);
    }

    #[test]
    fn nothing_has_no_share() {
        let seen = [Some(0), None];
        let name = |_: u32| Some("a".to_string());
        let shares = table(&by_material(&seen), &[[0.0; 2]; 2], &BTreeMap::new(), &name);
        for share in &shares {
            assert_eq!([share.mse, share.relmse, share.seconds], [0.0; 3]);
        }
    }
}
