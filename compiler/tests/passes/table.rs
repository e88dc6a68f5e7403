//! A pass is one file and one row: what the table of passes and the folder say of each other.

use std::collections::{BTreeMap, BTreeSet};

/// The file with the table, which also declares the files of passes.
const TABLE: &str = include_str!("../../src/passes/mod.rs");

/// Files of the folder that are no pass: what several share.
const SHARED: [&str; 2] = ["rewrite", "run"];

/// The rows as text.
fn rows() -> Vec<&'static str> {
    let (_, rest) = TABLE
        .split_once("pub const PIPELINE: &[Pass] = &[")
        .expect("the table");
    let (table, _) = rest.split_once("];").expect("the end of the table");
    let lines = table.lines().map(str::trim);
    lines.filter(|line| line.starts_with("row(")).collect()
}

/// The files of passes.
fn files() -> BTreeSet<&'static str> {
    let declared = TABLE.lines().filter_map(|line| {
        let name = line.strip_prefix("mod ")?.strip_suffix(';')?;
        (!SHARED.contains(&name)).then_some(name)
    });
    declared.collect()
}

/// What a row runs, `file::function`.
fn runs(row: &str) -> (&str, &str) {
    let path = row.trim_end_matches([',', ')']);
    let path = path.rsplit([' ', '(']).next().expect("a path");
    path.split_once("::")
        .unwrap_or_else(|| panic!("{row} names no file"))
}

#[test]
fn every_file_of_a_pass_is_in_the_table_and_no_other_is() {
    let named: BTreeSet<&str> = rows().into_iter().map(|row| runs(row).0).collect();
    assert_eq!(named, files());
}

#[test]
fn every_pass_has_one_row_unless_it_runs_again() {
    let mut first: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    for row in rows() {
        *first.entry(runs(row)).or_default() += usize::from(!row.contains("Again("));
    }
    assert!(first.len() > 10, "{first:?}");
    for ((file, function), count) in first {
        assert_eq!(
            count, 1,
            "rows that run {file}::{function} for the first time"
        );
    }
}

#[test]
fn no_order_stands_beside_the_table() {
    let (before, rest) = TABLE.split_once("pub const PIPELINE").expect("the table");
    let (_, after) = rest.split_once("];").expect("the end of the table");
    let code = before.lines().chain(after.lines());
    // What others than the table may use of a pass are types and helpers.
    let code = code.filter(|line| !line.starts_with("pub use ") && !line.starts_with("//"));
    for line in code {
        for file in files() {
            let call = format!("{file}::");
            assert!(
                !line.contains(&call),
                "`{line}` names the pass `{file}` beside the table"
            );
        }
    }
}
