//! What a scene asks of material kernels: the part of a prediction that only rendering can tell.

use serde::{Deserialize, Serialize};

use super::PlanError;
use super::error::list;

/// Lanes of the blocks of slots in which [`Hits::present`] is counted.
pub const BLOCK: u32 = 32;

/// The mean iteration of a wavefront in a scene: which materials paths hit, and what the kernels
/// take that evaluate none. Measured by rendering (`Renderer::workload` of the runtime).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Workload {
    /// Slots of the pool.
    pub pool: u32,
    /// Of each material of the program, in its order.
    pub materials: Vec<Hits>,
    /// Paths that begin in an iteration over slots, if the kernel that begins them decides how they go on; else 0.
    #[serde(default)]
    pub begun: f64,
    /// Seconds of the kernels that decide how paths go on, if they evaluate no material; 0 if not measured.
    pub logic_seconds: f64,
    /// Seconds that everything else takes but material kernels: rays, what lies between kernels, and new paths
    /// if others decide about these; 0 if not measured.
    pub other_seconds: f64,
    /// Whether paths lie in the order of their queues, so that what a queue's kernel reads is dense however few slots
    /// hit its materials.
    #[serde(default)]
    pub in_order: bool,
}

/// How paths hit a material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hits {
    /// The material's name.
    pub material: String,
    /// Whether any surface of the scene binds it: what is on no surface needs no kernel.
    pub on_surface: bool,
    /// Hits in an iteration over slots.
    pub share: f64,
    /// The share of blocks of [`BLOCK`] neighbouring slots in which at least one hits it. As large as
    /// `share` where neighbours hit the same, 1 - (1 - share)^32 where they have nothing in common.
    pub present: f64,
    /// Bytes of path state and geometry that a hit loads.
    pub loads: f64,
    /// Bytes of path state that it stores.
    pub stores: f64,
}

impl Hits {
    /// How many independent draws a block of slots amounts to: 32 where neighbours hit whatever they hit
    /// independently, 1 where all hit the same. `present` = 1 - (1 - `share`)^draws.
    pub fn draws(&self) -> f64 {
        draws(self.share, self.present)
    }

    /// Takes in what was counted in an iteration: hits over slots, and the share of blocks with any of the threads that
    /// look for hits, which are [`begun`](Workload::begun) for a slot more than slots.
    pub fn count(&mut self, share: f64, met: f64, begun: f64) {
        self.share = share;
        self.present = if begun > 0.0 {
            let present = 1.0 - (1.0 - share.min(1.0)).powf(draws(share / (1.0 + begun), met));
            // No more digits than files are read back with.
            (1e15 * present).round() / 1e15
        } else {
            met
        };
    }
}

/// The draws of hits by a `share` of threads, of whose blocks a part is `met`.
fn draws(share: f64, met: f64) -> f64 {
    let most = f64::from(BLOCK);
    if share <= 0.0 || share >= 1.0 || met >= 1.0 {
        return if share >= 1.0 { 1.0 } else { most };
    }
    ((1.0 - met).ln() / (1.0 - share).ln()).clamp(1.0, most)
}

/// What makes a new file.
const REMAKE: &str = "make a new one with `impasto plan SCENE --save-workload FILE`";

impl Workload {
    /// The workload that the JSON `text` describes, for materials called `names`, in their order.
    ///
    /// # Errors
    /// If it is broken, of other materials, or has numbers that no scene has.
    pub fn parse(text: &str, names: &[String]) -> Result<Self, PlanError> {
        let refuse = |what: String| Err(PlanError::new(what).hint(REMAKE));
        let broken = |e| PlanError::new(format!("the workload cannot be read: {e}")).hint(REMAKE);
        let mut workload: Self = serde_json::from_str(text).map_err(broken)?;
        let given: Vec<&str> = workload
            .materials
            .iter()
            .map(|h| h.material.as_str())
            .collect();
        let named: Vec<&str> = names.iter().map(String::as_str).collect();
        let without = |all: &[&str], some: &[&str]| -> Vec<String> {
            let other = all.iter().filter(|name| !some.contains(name));
            other.map(|name| (*name).to_owned()).collect()
        };
        let (extra, missing) = (without(&given, &named), without(&named, &given));
        if !extra.is_empty() {
            let extra = list(extra.iter().map(String::as_str));
            return refuse(format!("the workload has {extra}, which the scene lacks"));
        }
        if !missing.is_empty() {
            let missing = list(missing.iter().map(String::as_str));
            return refuse(format!("the workload lacks {missing}, which the scene has"));
        }
        if given.len() != names.len() {
            return refuse("the workload has a material twice".into());
        }
        let place = |h: &Hits| names.iter().position(|name| *name == h.material);
        workload.materials.sort_by_key(place);
        match workload.impossible() {
            Some(what) => refuse(format!("the workload cannot be: {what}")),
            None => Ok(workload),
        }
    }

    /// What no scene has.
    fn impossible(&self) -> Option<String> {
        if self.pool == 0 {
            return Some("its pool has no slots".into());
        }
        let hits = self.materials.iter();
        let shares = hits.flat_map(|h| [("share", h, h.share), ("present", h, h.present)]);
        let mut outside = shares.filter(|(_, _, value)| !(0.0..=1.0).contains(value));
        if let Some((what, hits, value)) = outside.next() {
            let of = &hits.material;
            return Some(format!("`{what}` of `{of}` is {value}, which is no share"));
        }
        let sum: f64 = self.materials.iter().map(|h| h.share).sum();
        if sum > 1.0 + 1e-6 {
            return Some(format!("{sum} hits for each slot"));
        }
        let bytes = self.materials.iter();
        let bytes = bytes.flat_map(|h| [("loads", h.loads), ("stores", h.stores)]);
        let scene = [
            ("begun", self.begun),
            ("logic_seconds", self.logic_seconds),
            ("other_seconds", self.other_seconds),
        ];
        let mut others = bytes.chain(scene);
        let wrong = others.find(|(_, value)| !value.is_finite() || *value < 0.0);
        wrong.map(|(name, value)| format!("`{name}` is {value}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"{"pool": 1024, "materials": [
        {"material": "paint", "on_surface": true, "share": 0.25, "present": 0.5, "loads": 64, "stores": 96},
        {"material": "glass", "on_surface": true, "share": 0.5, "present": 0.5, "loads": 64, "stores": 96}],
        "logic_seconds": 0, "other_seconds": 1e-3}"#;

    fn names() -> [String; 2] {
        ["glass", "paint"].map(String::from)
    }

    #[test]
    fn it_is_read_in_the_programs_order() {
        let workload = Workload::parse(TEXT, &names()).expect("it is sound");
        assert_eq!((workload.pool, workload.other_seconds), (1024, 1e-3));
        let [glass, paint] = &workload.materials[..] else {
            panic!("{workload:?}");
        };
        assert_eq!((glass.share, paint.share), (0.5, 0.25));
    }

    #[test]
    fn what_cannot_be_used_is_said() {
        let refused = |text: &str, part: &str| {
            let error = Workload::parse(text, &names()).expect_err(part).to_string();
            assert!(
                error.contains(part) && error.contains("--save-workload"),
                "{error}"
            );
        };
        refused(&TEXT[..200], "line ");
        refused(
            &TEXT.replace("\"loads\"", "\"load\""),
            "missing field `loads`",
        );
        refused(
            &TEXT.replace("glass", "water"),
            "has `water`, which the scene lacks",
        );
        refused(
            &TEXT.replace("\"glass\"", "\"paint\""),
            "lacks `glass`, which the scene has",
        );
        refused(&TEXT.replace("1024", "0"), "no slots");
        refused(
            &TEXT.replace("0.25", "-0.25"),
            "`share` of `paint` is -0.25",
        );
        refused(&TEXT.replace("0.25", "0.75"), "1.25 hits for each slot");
        refused(&TEXT.replace("1e-3", "-1"), "`other_seconds` is -1");
    }

    #[test]
    fn draws_tell_how_alike_neighbours_are() {
        let hits = |share: f64, present| Hits {
            material: String::new(),
            on_surface: true,
            share,
            present,
            loads: 64.0,
            stores: 96.0,
        };
        assert!((hits(0.2, 0.2).draws() - 1.0).abs() < 1e-9);
        assert!((hits(0.2, 1.0 - 0.8f64.powi(32)).draws() - 32.0).abs() < 1e-6);
        assert!((hits(0.2, 1.0 - 0.8f64.powi(5)).draws() - 5.0).abs() < 1e-9);
        assert_eq!(
            (hits(0.0, 0.0).draws(), hits(1.0, 1.0).draws()),
            (32.0, 1.0)
        );
    }

    /// Neighbours are as alike as those of the threads that looked for hits, of which there may be more than slots.
    #[test]
    fn what_is_counted_of_threads_holds_for_slots() {
        let mut hits = Hits {
            material: String::new(),
            on_surface: true,
            share: 0.0,
            present: 0.0,
            loads: 64.0,
            stores: 96.0,
        };
        let met = |draws: i32| 1.0 - (1.0 - 0.3f64 / 1.5).powi(draws);
        for draws in [1, 5, 32] {
            hits.count(0.3, met(draws), 0.5);
            assert!((hits.draws() - f64::from(draws)).abs() < 1e-6, "{hits:?}");
            assert!((hits.present - (1.0 - 0.7f64.powi(draws))).abs() < 1e-9);
            let kept = serde_json::to_string(&hits).expect("plain data");
            let read: Hits = serde_json::from_str(&kept).expect("what was kept");
            assert_eq!(read, hits);
        }
        // All slots hit it, be it by two threads each.
        hits.count(1.0, 0.5, 1.0);
        assert_eq!((hits.share, hits.present), (1.0, 1.0));
        // Logic alone looks for hits: what was met is what there is.
        hits.count(0.3, 0.4, 0.0);
        assert_eq!((hits.share, hits.present), (0.3, 0.4));
    }
}
