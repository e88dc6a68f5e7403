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
    Laine, Karras and Aila (2013) chose by hand which materials share a kernel, and leave open how to do it \
    automatically.\nImpasto predicts the time of every candidate from what materials cost and how a scene hits them, \
    and takes the plan with\nthe least sum. Here that plan is held against the fastest one that was measured: \
    *regret* is the time of an iteration\nby a plan over that by the best plan, 1 where nothing is lost. \
    `cargo experiments partition` measures it and writes this page;\nall numbers are in [partition.json](partition.json).\n\n";

const LIMITS: &str = "\n## How it is measured, and what that does not say\n\n\
    `impasto plan SCENE --strategy exhaustive --pool N` renders until paths of all lengths are mixed, keeps a copy of \
    what they\nare between two iterations, and times every kernel on this copy, again and again, by the GPU's \
    timestamps. The time of an\ninline set is what it adds to the logic kernel. Up to six materials, all sets are \
    timed in all forms, and every plan is\nadded up; the best is the least of them. Beyond, single materials, \
    pairs, the\nsets of the strategies' plans, and larger sets drawn by lot are timed, as far as the time of a scene \
    goes, and the best is that of\nthe plans made of these: regret is then a lower bound. The least of many sums is\nalso the luckiest, which makes regret look larger by up \
    to the spread of the measurements. Iterations at the start and at\nthe end of a picture, when few paths are alive, \
    are in none of this but in the whole renders.\n\n\
    ```text\n\
    cargo scenes\n\
    cargo experiments partition                     # all of it; again, to go on where it stopped\n\
    cargo experiments partition --only stones_3     # one scene\n\
    cargo experiments partition --repredict h200    # what was measured, predicted anew by a profile; no GPU\n\
    cargo experiments partition --page --held-out   # the model fitted to half of the materials; no GPU\n\
    cargo experiments partition --page              # the page from the JSON alone\n\
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
            "0 of 1 plans drawn by lot and 3 of 3 of the strategies' are within 2 %",
            "Of the 1 that are further off, the furthest:",
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
