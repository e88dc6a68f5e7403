//! WGSL as it is kept: without the comments that say where lines come from, since a blank line in a source changes all
//! of them. They tell which line of a source a difference comes from.

use std::ops::Range;

use similar::{ChangeTag, TextDiff};

/// Lines that are not those of the snapshot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Changed {
    /// Of the snapshot, from 0.
    pub old: Range<usize>,
    /// Of the WGSL as it is, from 0.
    pub new: Range<usize>,
}

/// Parts a text into lines without places, and the place of each: `... // file.impasto:12`.
pub(super) fn without_places(text: &str) -> (String, Vec<Option<(String, usize)>>) {
    let mut out = String::with_capacity(text.len());
    let mut from = Vec::new();
    // A comment of its own, above a function, tells of the line below it.
    let mut above = None;
    for line in text.lines() {
        let (code, place) = parted(line);
        if code.trim().is_empty() && place.is_some() {
            above = place;
            continue;
        }
        out.push_str(code.trim_end());
        out.push('\n');
        from.push(place.or(above.take()));
    }
    (out, from)
}

/// A line, and the place that its comment tells.
fn parted(line: &str) -> (&str, Option<(String, usize)>) {
    let place = |(code, comment): (&'_ str, &str)| {
        let (file, number) = comment.rsplit_once(':')?;
        let number = number.trim().parse().ok()?;
        let is_code_free = !code.contains('"');
        is_code_free.then(|| (code.len(), (file.trim().to_owned(), number)))
    };
    let found = line.rsplit_once("//").and_then(place);
    match found {
        Some((end, place)) => (&line[..end], Some(place)),
        None => (line, None),
    }
}

/// Where two texts differ, in the order of their lines.
pub(super) fn changed(old: &str, new: &str) -> Vec<Changed> {
    let diff = TextDiff::from_lines(old, new);
    let mut all: Vec<Changed> = Vec::new();
    let (mut i, mut j) = (0, 0);
    let mut open = false;
    for change in diff.iter_all_changes() {
        let tag = change.tag();
        if tag == ChangeTag::Equal {
            (i, j, open) = (i + 1, j + 1, false);
            continue;
        }
        if !open {
            all.push(Changed {
                old: i..i,
                new: j..j,
            });
            open = true;
        }
        if tag == ChangeTag::Delete {
            i += 1;
        } else {
            j += 1;
        }
        if let Some(last) = all.last_mut() {
            (last.old.end, last.new.end) = (i, j);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_told_apart_from_code() {
        let text =
            "// std/a.impasto:3\nfn f() {\n    let x = a / b; // m.impasto:12\n}\n// a remark\n";
        let (code, from) = without_places(text);
        assert_eq!(code, "fn f() {\n    let x = a / b;\n}\n// a remark\n");
        let place = |file: &str, line| Some((file.to_owned(), line));
        assert_eq!(
            from,
            [
                place("std/a.impasto", 3),
                place("m.impasto", 12),
                None,
                None
            ]
        );
    }

    #[test]
    fn neighbouring_lines_are_one_change() {
        let found = changed("a\nb\nc\nd\n", "a\nx\ny\nc\nd\ne\n");
        let change = |old, new| Changed { old, new };
        assert_eq!(found, [change(1..2, 1..3), change(4..4, 5..6)]);
    }
}
