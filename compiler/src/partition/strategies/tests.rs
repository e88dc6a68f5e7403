//! The table of strategies, the plans that strategies come to, and what is said where one cannot be.

mod pairs;

use std::collections::BTreeSet;
use std::path::Path;

use super::super::text::print;
use super::super::{DeviceProfile, Hits, Plan, PlanInputs, Strategy, Workload};
use super::*;
use crate::cost::{Classes, LANES, Operations};

fn cost(mean: f64) -> Option<Cost> {
    let classes = Classes {
        alu: mean,
        ..Classes::default()
    };
    let operations = Operations {
        evaluations: 1,
        mean,
        min: 0,
        max: mean as u64,
        classes,
    };
    Some(Cost {
        operations,
        issued: [classes; LANES.len()],
        live: 20,
        code: mean as u32,
        loops: 0,
        bytes: 0.0,
    })
}

fn names() -> Vec<String> {
    ["paint", "glass", "wall", "asphalt", "lost"]
        .map(String::from)
        .to_vec()
}

fn costs() -> Vec<Option<Cost>> {
    vec![cost(3300.0), cost(236.0), cost(600.0), cost(599.0), None]
}

fn workload() -> Workload {
    let hits = |material: &String| Hits {
        material: material.clone(),
        on_surface: material != "lost",
        share: 0.2,
        present: 0.9,
        loads: 64.0,
        stores: 64.0,
    };
    Workload {
        pool: 1 << 20,
        materials: names().iter().map(hits).collect(),
        begun: 0.0,
        logic_seconds: 0.0,
        other_seconds: 0.0,
        in_order: false,
    }
}

/// The plan of a strategy for materials that everything is known of.
fn planned_by(strategy: Strategy) -> String {
    let (names, costs, workload) = (names(), costs(), workload());
    let profile = DeviceProfile::named("h200").expect("it is shipped");
    let inputs = PlanInputs {
        names: &names,
        unused: &[4],
        costs: Some(&costs),
        workload: Some(&workload),
        profile: Some(&profile),
    };
    let plan = strategy.plan(&inputs).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(plan.check_named(&names), Ok(()), "{strategy}");
    assert_eq!(
        (&plan.unused, &plan.strategy),
        (&vec![4], &strategy.to_string())
    );
    print(&plan, &names)
}

fn planned(text: &str) -> String {
    planned_by(Strategy::parse(text).unwrap_or_else(|e| panic!("{e}")))
}

#[test]
fn strategies_come_to_their_plans() {
    assert_eq!(planned("own"), "own:paint|own:glass|own:wall|own:asphalt");
    assert_eq!(planned("shared"), "mixed:paint,glass,wall,asphalt");
    assert_eq!(planned("mega"), "inline:paint,glass,wall,asphalt");
    assert_eq!(planned("paper"), "own:paint|own:wall|mixed:glass,asphalt");
    assert_eq!(planned("threshold=600"), planned("paper"));
    assert_eq!(planned("threshold=0"), planned("own"));
    assert_eq!(planned("threshold=599.5"), planned("paper"));
    assert_eq!(planned("threshold=1e9"), planned("mixed"));
    assert_eq!(
        planned("threshold=240"),
        "own:paint|own:wall|own:asphalt|own:glass"
    );
    assert!(planned("auto").contains("paint"));
}

#[test]
fn what_needs_only_names_has_a_plan_without_further_ado() {
    let names = names();
    let inputs = PlanInputs {
        unused: &[1, 4],
        ..PlanInputs::of_names(&names)
    };
    assert_eq!(Strategy::OWN.plan(&inputs), Ok(Plan::own(&names, &[1, 4])));
    assert_eq!(
        Strategy::MEGA.plan(&inputs),
        Ok(Plan::mega(&names, &[1, 4]))
    );
    assert_eq!(Plan::own(&[], &[]).kernels, []);
    assert_eq!(Plan::mega(&[], &[]).kernels, []);
}

#[test]
fn every_row_of_the_table_is_a_strategy() {
    for row in STRATEGIES {
        let text = row.usage().replace('N', "7");
        let strategy = Strategy::parse(&text).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(strategy.to_string(), text);
        assert_eq!(strategy.row().name, row.name);
        assert_eq!(strategy.requires(), row.rule.requires());
        for older in row.older_names {
            assert_eq!(Strategy::parse(older), Ok(strategy));
        }
    }
    let names = STRATEGIES.iter().flat_map(|row| {
        let older = row.older_names.iter().copied();
        older.chain([row.name])
    });
    let all: Vec<&str> = names.collect();
    let different: BTreeSet<&str> = all.iter().copied().collect();
    assert_eq!(all.len(), different.len(), "two strategies share a name");
}

/// A strategy is one file and one row: neither is without the other.
#[test]
fn every_row_has_its_file() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/partition/strategies");
    let entries = std::fs::read_dir(folder).expect("the folder");
    let files = entries.map(|entry| entry.expect("an entry").file_name());
    let files = files.filter_map(|file| {
        let file = file.into_string().expect("a name");
        Some(file.strip_suffix(".rs")?.to_owned())
    });
    let files: BTreeSet<String> = files.filter(|f| f != "mod" && f != "tests").collect();
    let rows: BTreeSet<String> = STRATEGIES.iter().map(|row| row.name.to_owned()).collect();
    assert_eq!(files, rows);
}

/// The table that people read has the same rows.
#[test]
fn every_row_is_documented() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/plan.md");
    let page = std::fs::read_to_string(page).expect("docs/plan.md");
    for row in STRATEGIES {
        let older = row.older_names.iter().map(|name| format!(" (`{name}`)"));
        let begin = format!("| `{}`{} |", row.usage(), older.collect::<String>());
        assert!(page.contains(&begin), "docs/plan.md lacks a row `{begin}`");
    }
}

/// The example of CONTRIBUTING.md is the file that is compiled here.
#[test]
fn the_example_of_how_to_add_one_works() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../CONTRIBUTING.md");
    let page = std::fs::read_to_string(page).expect("CONTRIBUTING.md");
    let file = include_str!("tests/pairs.rs");
    assert!(page.contains(&format!("```rust\n{file}```")), "{file}");
    let pairs = Strategy::new(&pairs::ROW);
    assert_eq!(planned_by(pairs), "binned:paint,glass|binned:wall,asphalt");
    assert_eq!(pairs.to_string(), "pairs");
    assert_eq!(pairs.requires(), Requires::Nothing);
}

#[test]
fn strategies_that_the_model_can_compare_are_those_it_predicts() {
    let names: Vec<String> = Strategy::comparable().map(|s| s.to_string()).collect();
    assert_eq!(names, ["auto", "own", "mixed", "binned", "inline", "paper"]);
    assert!(paper::ROW.help.ends_with(&format!("={PAPER_OPERATIONS}")));
}

#[test]
fn what_is_no_strategy_is_said() {
    let refused = |text: &str, part: &str| {
        let error = Strategy::parse(text).expect_err(text).to_string();
        assert!(error.contains(part), "{error}");
    };
    refused("bined", "did you mean `binned`?");
    refused("quick", "strategies are `auto`, `own`");
    refused("threshold", "as in `threshold=1000`");
    refused("threshold=many", "`threshold=many` has no number");
    refused("threshold=-1", "at least 0");
    refused("threshold=NaN", "at least 0");
    refused("own=3", "`own` takes no value");
    refused("", "there is no strategy ``");
}

#[test]
fn what_is_not_known_is_said() {
    let names = names();
    let known = PlanInputs::of_names(&names);
    for strategy in [
        Strategy::AUTO,
        Strategy::PAPER,
        Strategy::threshold(1.0),
        Strategy::EXHAUSTIVE,
    ] {
        let error = strategy.plan(&known).expect_err("it is not known");
        let part = format!("`{strategy}` must know");
        assert!(error.to_string().contains(&part), "{error}");
    }
    let costs = costs();
    let some = PlanInputs {
        costs: Some(&costs),
        ..known
    };
    assert!(Strategy::PAPER.plan(&some).is_ok());
    assert!(Strategy::AUTO.plan(&some).is_err());
    assert!(Strategy::OWN.plan(&known).is_ok());
    let error = Strategy::EXHAUSTIVE
        .plan(&some)
        .expect_err("it is measured");
    assert!(
        error
            .to_string()
            .contains("impasto plan SCENE --strategy exhaustive")
    );
}
