//! `rays`: every technique is timed on every set of rays, and finds the same hits.

use std::collections::BTreeSet;

use crate::cli::common::{SCENE, impasto};

#[test]
fn every_technique_is_timed_and_finds_what_the_others_find() {
    let size = ["--size", "12x12", "--repetitions", "1"];
    let args = [&["rays", SCENE, "--format", "json"], &size[..]].concat();
    let json = impasto(&args).exits(0).json();
    let rates = json["rates"].as_array().expect("a list");
    let mut techniques = BTreeSet::new();
    for rate in rates {
        let names = ["traversal", "stack", "leaves", "ray_fetch"];
        techniques.insert(names.map(|name| rate[name].as_str().expect("a name")));
        let count = rate["count"].as_u64().expect("a number");
        let hits = rate["hits"].as_u64().expect("a number");
        assert!(count > 0 && hits <= count, "{rate}");
        assert_eq!(rate["astray"], 0, "{rate}");
        let speed = rate["mrays_per_second"].as_f64().expect("a number");
        assert!(speed > 0.0 && speed.is_finite(), "{rate}");
        if rate["rays"] == "primary" {
            assert_eq!(count, 144);
        }
        // Surfaces of the scene see each other, but not all.
        if rate["rays"] == "shadow" {
            assert!(hits > 0 && hits < count, "{rate}");
        }
    }
    let traversals: BTreeSet<_> = techniques.iter().map(|names| names[0]).collect();
    assert_eq!(traversals, BTreeSet::from(["bvh2", "cwbvh"]));
    assert_eq!(rates.len(), 4 * techniques.len());
}

#[test]
fn sizes_and_scenes_that_are_none_are_refused() {
    impasto(&["rays", SCENE, "--size", "0x9"]).exits(2);
    impasto(&["rays", SCENE, "--size", "60000x60000"]).exits(2);
    impasto(&["rays", "no/such/scene.toml"]).exits(2);
}
