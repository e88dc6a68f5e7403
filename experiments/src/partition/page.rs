//! `docs/partition.md`: how good the automatic partition is, and where it is not.

use std::fmt::Write as _;

use super::checks;
use super::measured::Measured;
use super::results::Results;
use super::tables;

/// The whole page.
pub(super) fn page(results: &Results, scenes: &[Measured]) -> String {
    let mut out = String::from(INTRODUCTION);
    let adapter = &results.adapter;
    let driver: Vec<&str> = [adapter.backend.as_str(), adapter.driver.as_str()]
        .into_iter()
        .filter(|part| !part.is_empty())
        .collect();
    let _ = writeln!(
        out,
        "Machine: {} ({}), Impasto {}, device profile `{}`.\n",
        adapter.name,
        driver.join(", "),
        results.version,
        results.profile
    );
    let sections = [
        tables::targets(scenes),
        tables::scenes(scenes),
        tables::regret(scenes),
        tables::differences(scenes),
        checks::predictions(scenes),
        checks::held_out(results),
        checks::additivity(scenes),
        tables::renders(scenes),
        checks::gaps(scenes),
    ];
    let sections: Vec<String> = sections.into_iter().filter(|s| !s.is_empty()).collect();
    out += &sections.join("\n");
    out + LIMITS
}

const INTRODUCTION: &str = "# Is the automatic partition the best?\n\n\
    Laine, Karras and Aila (2013) chose by hand which materials share a kernel. They leave open how to choose \
    automatically.\nImpasto predicts the time of every candidate kernel from what its materials cost and how the scene \
    hits them. It takes the\nplan with the least sum. This page compares that plan with the fastest one that was \
    measured.\n\n\
    The *regret* of a plan is the time of an iteration by that plan over the time by the best plan. It is 1 if nothing is \
    lost.\n`cargo experiments partition` measures it and writes this page. All numbers are in \
    [partition.json](partition.json).\n\n";

const LIMITS: &str = "\n## How it is measured, and what that does not say\n\n\
    `impasto plan SCENE --strategy exhaustive --pool N` renders until paths of all lengths are mixed. It keeps a copy of \
    the\npaths between two iterations, and times every kernel on this copy several times, by the GPU's timestamps. \
    The time of an inline\nset is what it adds to the logic kernel.\n\n\
    - Up to six materials, every set is timed in every form. The time of every plan is the sum of its kernels' times, and \
    the\n  best plan is the one with the least sum.\n\
    - With more materials, single materials, pairs, the sets of the strategies' plans and randomly chosen larger sets \
    are timed,\n  until the time for the scene is over. The best plan is the best one of these kernels, so regret is \
    a lower bound.\n\
    - The least of many sums is also the luckiest. This makes regret look larger, by up to the spread of the \
    measurements.\n\
    - Few paths are alive at the start and at the end of a picture. Only the whole renders include those \
    iterations.\n\n\
    ```text\n\
    cargo experiments partition                     # all of it; again, to go on where it stopped\n\
    cargo experiments partition --only stones_3     # one scene\n\
    cargo experiments partition --repredict h200    # predicts anew what was measured, by a profile; no GPU\n\
    cargo experiments partition --page --held-out   # fits the model to half of the materials; no GPU\n\
    cargo experiments partition --page              # writes the page from the JSON alone\n\
    ```\n";

#[cfg(test)]
mod tests {
    use super::super::fixture;
    use super::*;
    use xtask::shell;

    fn page_of(results: &Results) -> String {
        let scenes: Vec<Measured> = results
            .scenes
            .iter()
            .map(|s| Measured::new(s).expect("fits"))
            .collect();
        page(results, &scenes)
    }

    #[test]
    fn the_fixtures_page_says_what_was_missed() {
        let page = page_of(&fixture::results());
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
            "Machine: GPU (), Impasto abc",
        ] {
            let line = line.replace(" ()", "");
            let page = page.replace(" ()", "");
            assert!(page.contains(&line), "{line}\nis not in\n{page}");
        }
    }

    #[test]
    fn what_was_not_measured_is_said() {
        let mut results = fixture::results();
        assert!(!page_of(&results).contains("not measured\n"));
        results.scenes[0].left_out = 2;
        results.scenes[0].failed = vec!["mixed:a|b: too large".into()];
        let row = "| tiny | 1 M paths | 3 | no time was left; mixed:a b: too large |";
        assert!(page_of(&results).contains(row), "{}", page_of(&results));
    }

    /// Whoever changes the page or the numbers writes the page anew: `cargo experiments partition --page`.
    #[test]
    fn the_page_is_that_of_its_numbers() {
        let docs = shell::root().join("docs");
        let json = docs.join("partition.json");
        let page = docs.join("partition.md");
        assert_eq!(json.exists(), page.exists(), "one without the other");
        if !json.exists() {
            return;
        }
        let results = Results::load(&json).expect("the numbers");
        assert!(!results.scenes.is_empty());
        let written = std::fs::read_to_string(page).expect("the page");
        assert!(
            written == page_of(&results),
            "docs/partition.md is not docs/partition.json's"
        );
    }
}
