//! The blocks of a page about partitions: what takes the place of their names in its text.

use super::checks;
use super::measured::Measured;
use super::tables;
use crate::experiment::results::ModelNote;

/// The names of the blocks.
pub const NAMES: [&str; 10] = [
    "targets",
    "scenes",
    "regret",
    "differences",
    "forms",
    "predictions",
    "held_out",
    "additivity",
    "renders",
    "gaps",
];

/// The block of that name; empty where nothing of it was measured.
pub fn block(name: &str, scenes: &[Measured<'_>], note: Option<&ModelNote>) -> String {
    match name {
        "targets" => tables::targets(scenes),
        "scenes" => tables::scenes(scenes),
        "regret" => tables::regret(scenes),
        "differences" => tables::differences(scenes),
        "forms" => checks::forms(scenes),
        "predictions" => checks::predictions(scenes),
        "held_out" => note.map(checks::held_out).unwrap_or_default(),
        "additivity" => checks::additivity(scenes),
        "renders" => tables::renders(scenes),
        _ => checks::gaps(scenes),
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixture;
    use super::super::results::Scene;
    use super::*;
    use crate::calibrate::Errors;

    fn page_of(scene: &Scene) -> String {
        let scenes = [Measured::new(scene).expect("fits")];
        NAMES.map(|name| block(name, &scenes, None)).join("\n")
    }

    #[test]
    fn the_fixtures_page_says_what_was_missed() {
        let page = page_of(&fixture::scene());
        for line in [
            "| regret of every scene at most 1.05 | 1.103 (tiny, 1 M paths) | **missed** |",
            "| tiny | 1 M paths | `own:a\\|own:b\\|own:c` | `mixed:a,b\\|inline:c` | 10.3 % |",
            "| own | 3 | 22.2 % | 0.78 | 0.500 |",
            "0 of 1 random plans and 3 of 3 plans of the strategies are within 2 %",
            "Plans further off: 1. The furthest are:",
            "| tiny | 1 M paths | sample | `own:b\\|binned:a,c` | 1.043 |",
            "| tiny | 1 M paths | 110.0 | - | - | 55.0 | - |",
            "| tiny | 1 M paths | 1.103 | 1.333 | 1.103 | 1.310 | 1.069 | 1.345 | 1.048 | 1.138 | 2.207 |",
            "| tiny | three of a kind | random | even | 18 | all 22 | a 50 (90), b 25 (80), c 12 (12) |",
        ] {
            assert!(page.contains(line), "{line}\nis not in\n{page}");
        }
    }

    #[test]
    fn what_was_not_measured_is_said() {
        let mut scene = fixture::scene();
        assert!(!page_of(&scene).contains("no time was left"));
        scene.left_out = 2;
        scene.failed = vec!["mixed:a|b: too large".into()];
        let row = "| tiny | 1 M paths | 3 | no time was left; mixed:a b: too large |";
        assert!(page_of(&scene).contains(row), "{}", page_of(&scene));
    }

    #[test]
    fn errors_of_held_out_kernels_are_told() {
        let note = ModelNote {
            held_out: Some(Errors {
                kernels: 40,
                median: 0.1234567,
                ..Errors::default()
            }),
            ..ModelNote::default()
        };
        let text = block("held_out", &[], Some(&note));
        let said = "On the 40 kernels over the others the median error is 12.3 %";
        assert!(text.contains(said), "{text}");
        assert_eq!(block("held_out", &[], None), "");
    }
}
