//! What mixes keep to: every place has a material, shares are what they are called, and a draw covers what it must.

use super::*;

fn mix(hits: Hits, shares: Shares, materials: &[&str]) -> Mix {
    Mix {
        name: "m".into(),
        about: "a mix".into(),
        hits,
        shares,
        materials: materials.iter().map(|m| m.to_string()).collect(),
    }
}

#[test]
fn every_place_of_a_scene_has_a_material_that_is_there() {
    for of in [&["julia", "../wood.impasto", "mtl"][..], &["spectral_7"]] {
        for shares in Shares::ALL {
            let mix = mix(Hits::Random, shares, of);
            let text = scene(&mix);
            let bound = text.lines().filter(|line| line.contains("file = "));
            assert_eq!(bound.count(), PLACES.len());
            assert_eq!(mix.places().iter().sum::<usize>(), PLACES.len());
            let files = files(std::slice::from_ref(&mix));
            for material in of {
                let written = format!("{material}.impasto");
                let generated = files.iter().any(|file| file.path == written);
                assert_eq!(generated, !material.contains('/'), "{material}");
                let named = if generated { &written } else { *material };
                assert!(text.contains(&format!("file = \"{named}\"")), "{text}");
            }
        }
    }
}

#[test]
fn shares_are_what_they_are_called() {
    let names: Vec<String> = kinds(5);
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let even = mix(Hits::Random, Shares::Even, &names).places();
    assert!(even.iter().all(|n| (12..=13).contains(n)), "{even:?}");
    let skewed = mix(Hits::Random, Shares::Skewed, &names).places();
    assert!(skewed[0] > 5 * skewed[4] && skewed.is_sorted_by(|a, b| a >= b));
    assert_eq!(mix(Hits::Random, Shares::Skewed, &[]).places(), [0; 0]);
}

#[test]
fn generated_materials_are_called_what_they_were_asked_for() {
    for name in [
        "julia",
        "julia_40",
        "spectral_7",
        "wide",
        "fbm_3",
        "kind_61",
        "hashes_33",
    ] {
        let text = materials::source(name).expect(name);
        assert!(text.contains(&format!("material {name} {{")), "{text}");
        assert!(!text.contains("TURNS") && !text.contains("HALF") && !text.contains("PLANE"));
    }
    assert!(
        materials::source("hashes_33")
            .is_some_and(|text| text.contains("0 .. 33") && text.contains("sum / 16.5"))
    );
    for name in [
        "jul",
        "julia_0",
        "julia_99999999999999999999",
        "kind_64",
        "dots_3",
        "_",
        "",
    ] {
        assert!(!is_generated(name), "{name}");
    }
}

#[test]
fn forty_mixes_cover_what_models_are_tried_on() {
    let mixes = draw(&Draw {
        seed: 7,
        ..Draw::default()
    });
    assert_eq!(mixes.len(), 40);
    let names: BTreeSet<&String> = mixes.iter().map(|mix| &mix.name).collect();
    assert_eq!(names.len(), 40);
    let sizes: BTreeSet<usize> = mixes.iter().map(|mix| mix.materials.len()).collect();
    assert_eq!(sizes, (1..=16).collect());
    for hits in Hits::ALL {
        for shares in Shares::ALL {
            let such = mixes
                .iter()
                .filter(|m| m.hits == hits && m.shares == shares);
            assert_eq!(such.count(), 10);
        }
    }
    for class in Class::ALL {
        let with = mixes.iter().filter(|mix| mix.about.contains(class.name()));
        assert!(with.count() >= 5, "{class:?}");
    }
    let materials: BTreeSet<&String> = mixes.iter().flat_map(|mix| &mix.materials).collect();
    assert!(materials.len() > 100, "{}", materials.len());
    for mix in &mixes {
        let distinct: BTreeSet<&String> = mix.materials.iter().collect();
        assert_eq!(distinct.len(), mix.materials.len(), "{}", mix.name);
        assert!(mix.materials.iter().all(|m| is_generated(m)));
    }
}

#[test]
fn equal_seeds_draw_equal_mixes_and_others_do_not() {
    let seeded = |seed| {
        draw(&Draw {
            count: 5,
            seed,
            ..Draw::default()
        })
    };
    assert_eq!(seeded(3), seeded(3));
    let materials = |seed| seeded(seed).into_iter().map(|mix| mix.materials);
    assert!(!materials(3).eq(materials(4)));
    let none = Draw {
        classes: Vec::new(),
        ..Draw::default()
    };
    assert!(draw(&none).is_empty());
    let few = Draw {
        count: 3,
        materials: 6..=6,
        classes: vec![Class::Cheap],
        ..Draw::default()
    };
    // There are three cheap materials, and no others were allowed.
    assert!(draw(&few).iter().all(|mix| mix.materials.len() == 3));
}
