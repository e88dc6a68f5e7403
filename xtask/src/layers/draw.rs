//! The drawing of a crate's folders: a table of layers, from the top down, with what each folder names.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use super::arrows::Arrow;
use xtask::shell::Result;

const BEGIN: &str = "<!-- layers: written by `cargo xtask layers --write` -->\n";
const END: &str = "<!-- end of layers -->\n";

/// The workspace's crates with those that each depends on.
pub(super) fn crates(crates: &[(String, Vec<String>)]) -> String {
    let mut out = "\n#### Crates\n\n| crate | depends on |\n|---|---|\n".to_owned();
    for (name, needed) in crates {
        let _ = writeln!(out, "| `{name}` | {} |", needed.join(", "));
    }
    out
}

/// A crate's folders from the top down, with all that each names. A folder's layer is the longest way down.
pub(super) fn table(
    name: &str,
    path: &str,
    folders: &BTreeSet<String>,
    arrows: &[Arrow],
) -> String {
    let mut named: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for folder in folders {
        named.entry(folder).or_default();
    }
    for arrow in arrows {
        named.entry(&arrow.from).or_default().insert(&arrow.to);
    }
    let heights = heights(&named);
    let mut out =
        format!("\n#### `{name}` (`{path}`)\n\n| layer | folder | names |\n|---|---|---|\n");
    let mut rows: Vec<(usize, &str)> = heights.iter().map(|(f, h)| (*h, *f)).collect();
    rows.sort_unstable_by(|a, b| (b.0, a.1).cmp(&(a.0, b.1)));
    for (height, folder) in rows {
        let names: Vec<&str> = named.get(folder).into_iter().flatten().copied().collect();
        let _ = writeln!(out, "| {height} | `{folder}` | {} |", names.join(", "));
    }
    out
}

/// How many arrows the longest way down from each folder has. Folders of a cycle have no bottom; they
/// are cut where the way comes back.
fn heights<'a>(named: &BTreeMap<&'a str, BTreeSet<&'a str>>) -> BTreeMap<&'a str, usize> {
    fn height<'a>(
        folder: &'a str,
        named: &BTreeMap<&'a str, BTreeSet<&'a str>>,
        known: &mut BTreeMap<&'a str, usize>,
    ) -> usize {
        if let Some(height) = known.get(folder) {
            return *height;
        }
        known.insert(folder, 0);
        let below = named.get(folder).into_iter().flatten();
        let highest = below.map(|to| height(to, named, known) + 1).max();
        known.insert(folder, highest.unwrap_or(0));
        highest.unwrap_or(0)
    }
    let mut known = BTreeMap::new();
    for folder in named.keys() {
        height(folder, named, &mut known);
    }
    known
}

/// A page with another drawing between its marks.
pub(super) fn replace(page: &str, drawing: &str) -> Result<String> {
    let missing = || format!("the page lacks the line {BEGIN}or the line {END}after it");
    let (before, rest) = page.split_once(BEGIN).ok_or_else(missing)?;
    let (_, after) = rest.split_once(END).ok_or_else(missing)?;
    Ok(format!("{before}{BEGIN}{drawing}\n{END}{after}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arrow(from: &str, to: &str) -> Arrow {
        Arrow {
            from: from.to_owned(),
            to: to.to_owned(),
            place: (String::new(), 1),
        }
    }

    #[test]
    fn folders_stand_above_what_they_name() {
        let folders = ["a", "b", "c"].map(str::to_owned).into();
        let drawn = table(
            "x",
            "x/src",
            &folders,
            &[arrow("a", "b"), arrow("b", "c"), arrow("a", "c")],
        );
        let rows: Vec<&str> = drawn.lines().skip(5).collect();
        assert_eq!(
            rows,
            ["| 2 | `a` | b, c |", "| 1 | `b` | c |", "| 0 | `c` |  |"]
        );
    }

    #[test]
    fn only_what_is_between_the_marks_is_replaced() {
        let page = format!("Before.\n{BEGIN}old\n{END}After.\n");
        let expected = format!("Before.\n{BEGIN}new\n{END}After.\n");
        assert_eq!(replace(&page, "new").expect("marks"), expected);
        assert!(replace("Before.\n", "new").is_err());
    }
}
