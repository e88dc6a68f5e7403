//! docs/materialx.md has the tables that the crate has.

use impasto_import::{MISSING, node_rows};

/// The tables of the page.
fn tables() -> String {
    let mut text = String::new();
    let mut group = "";
    for row in node_rows() {
        if row.group != group {
            group = row.group;
            text.push_str(&format!("\n### {group}\n\n| node | becomes |\n|---|---|\n"));
        }
        text.push_str(&format!("| `{}` | {} |\n", row.category, row.becomes()));
    }
    text.push_str("\n### Without a counterpart\n\n| node | why |\n|---|---|\n");
    for missing in MISSING {
        text.push_str(&format!(
            "| `{}` | {} |\n",
            missing.category, missing.reason
        ));
    }
    text
}

/// `IMPASTO_BLESS=1` writes the page's tables.
#[test]
fn the_page_has_the_tables_of_nodes() {
    const MARK: &str =
        "<!-- nodes: written by a test of impasto-import, with IMPASTO_BLESS=1 -->\n";
    let path = "../docs/materialx.md";
    let page = std::fs::read_to_string(path).expect("the page");
    let (before, after) = page.split_once(MARK).expect("the mark");
    if std::env::var_os("IMPASTO_BLESS").is_some() {
        std::fs::write(path, format!("{before}{MARK}{}", tables())).expect("written");
        return;
    }
    assert_eq!(
        after.replace("\r\n", "\n"),
        tables(),
        "IMPASTO_BLESS=1 writes the page"
    );
}

#[test]
fn no_node_has_two_rows() {
    let mut names: Vec<&str> = node_rows().map(|row| row.category).collect();
    names.extend(MISSING.iter().map(|missing| missing.category));
    let count = names.len();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), count);
    assert!(MISSING.is_sorted_by(|a, b| a.category < b.category));
}
