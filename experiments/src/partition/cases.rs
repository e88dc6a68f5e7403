//! What is measured: the paper's scenes and the mixes, each with two pools, and by which plans whole
//! pictures are rendered.

use impasto_scenes::mixes::{MIXES, Mix};

/// A scene.
#[derive(Clone, Debug)]
pub(super) struct Case {
    pub name: String,
    pub about: String,
    pub hits: String,
    pub shares: String,
    /// Its file, relative to the repository.
    pub scene: String,
    /// Samples a pixel of whole renders: enough for a second of an H200 or less.
    pub samples: u32,
    /// Is it one of the paper's, of which whole renders by all strategies are made?
    pub paper: bool,
}

/// The pools: 2^20 paths, as in the paper, and 2^22.
pub(super) const POOLS: [u64; 2] = [1 << 20, 1 << 22];
/// The same where only the way is to be tried.
pub(super) const QUICK_POOLS: [u64; 2] = [1 << 12, 1 << 13];

const PAPER: [(&str, &str, u32); 3] = [
    ("carpaint", "the paper's CARPAINT", 512),
    ("city", "the paper's CITY", 96),
    ("conference", "the paper's CONFERENCE", 96),
];

/// What has to be generated.
pub(super) const GENERATED: [&str; 4] = ["carpaint", "city", "conference", "mixes"];

/// All scenes.
pub(super) fn all() -> Vec<Case> {
    let paper = PAPER.map(|(name, about, samples)| Case {
        name: name.into(),
        about: about.into(),
        hits: String::new(),
        shares: String::new(),
        scene: format!("examples/{name}/scene.toml"),
        samples,
        paper: true,
    });
    paper.into_iter().chain(MIXES.iter().map(mix)).collect()
}

fn mix(mix: &Mix) -> Case {
    Case {
        name: mix.name.into(),
        about: mix.about.into(),
        hits: mix.hits.name().into(),
        shares: mix.shares.name().into(),
        scene: mix.scene(),
        samples: if mix.materials().len() > 8 { 24 } else { 48 },
        paper: false,
    }
}

/// Which whole renders are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Renders {
    /// None
    None,
    /// By every strategy of the paper's scenes with the smallest pool; of the rest by the chosen plan, mega and
    /// own, of mixes with the smallest pool alone
    Some,
    /// By every strategy of every scene
    All,
}

/// A plan by which whole pictures are rendered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Way {
    pub label: &'static str,
    pub options: Vec<String>,
}

/// The ways to render a case whose chosen and best plans are known.
pub(super) fn ways(
    case: &Case,
    first_pool: bool,
    which: Renders,
    auto: &str,
    best: Option<&str>,
) -> Vec<Way> {
    let strategy = |label: &'static str| Way {
        label,
        options: vec![format!("--strategy={label}")],
    };
    let partition = |label, text: &str| Way {
        label,
        options: vec![format!("--partition={text}")],
    };
    let chosen = partition("auto's plan", auto);
    let all = which == Renders::All || (case.paper && first_pool);
    let few = case.paper || first_pool;
    match which {
        Renders::None => return Vec::new(),
        _ if all => {}
        _ if few => return vec![chosen, strategy("mega"), strategy("own")],
        _ => return Vec::new(),
    }
    let mut out = vec![chosen];
    out.extend(
        best.filter(|best| *best != auto)
            .map(|best| partition("best", best)),
    );
    out.extend(["auto", "mega", "own", "paper", "mixed", "binned", "inline"].map(strategy));
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paper_scenes_are_rendered_by_all_strategies_and_mixes_by_few() {
        let mut case = mix(&MIXES[0]);
        let labels = |case: &Case, first, which| -> Vec<&str> {
            let ways = ways(case, first, which, "own:a", Some("mixed:a,b"));
            ways.iter().map(|way| way.label).collect()
        };
        let few = ["auto's plan", "mega", "own"];
        assert_eq!(labels(&case, true, Renders::Some), few);
        assert!(labels(&case, false, Renders::Some).is_empty());
        assert!(labels(&case, true, Renders::None).is_empty());
        assert_eq!(labels(&case, false, Renders::All).len(), 9);
        case.paper = true;
        assert_eq!(labels(&case, true, Renders::Some).len(), 9);
        assert_eq!(labels(&case, false, Renders::Some), few);
        let same = ways(&case, true, Renders::All, "own:a", Some("own:a"));
        assert!(same.iter().all(|way| way.label != "best"));
    }
}
