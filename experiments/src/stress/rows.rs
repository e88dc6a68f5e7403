//! The rows that tests keep: reading them back, and the worst of many.

use std::path::Path;

use xtask::shell::Result;

/// A number that a test measured. The other side is `compiler/tests/common/record.rs`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Row {
    /// A row of the table of extremes, or the name of a test of sampling.
    pub table: String,
    pub subject: String,
    pub what: String,
    pub worst: f64,
    /// `<=` or `>=`.
    pub sign: String,
    pub bound: f64,
    pub good: bool,
    pub place: String,
}

impl Row {
    fn parse(line: &str) -> Option<Self> {
        let fields: Vec<&str> = line.split('\t').collect();
        let [table, subject, what, worst, sign, bound, verdict, place] = fields[..] else {
            return None;
        };
        Some(Self {
            table: table.to_owned(),
            subject: subject.to_owned(),
            what: what.to_owned(),
            worst: worst.parse().ok()?,
            sign: sign.to_owned(),
            bound: bound.parse().ok()?,
            good: verdict == "good",
            place: place.to_owned(),
        })
    }

    /// How near to its bound it is, 1 at it and more beyond; bad ones come first.
    pub fn nearness(&self) -> f64 {
        if !self.good {
            return f64::INFINITY;
        }
        let (a, b) = match self.sign.as_str() {
            ">=" => (self.bound, self.worst),
            _ => (self.worst, self.bound),
        };
        if b == 0.0 { 0.0 } else { a / b }
    }
}

/// Empties the folder that rows are kept in, and makes it.
pub(super) fn clear(folder: &Path) -> Result {
    if folder.is_dir() {
        std::fs::remove_dir_all(folder)
            .map_err(|e| format!("{} cannot be emptied: {e}", folder.display()))?;
    }
    std::fs::create_dir_all(folder).map_err(|e| format!("{} cannot be made: {e}", folder.display()))
}

/// All rows of a folder, in an order that does not depend on which test was first. Rows of the same
/// thing become one, the worst.
pub(super) fn read(folder: &Path) -> Result<Vec<Row>> {
    let files = std::fs::read_dir(folder)
        .map_err(|e| format!("{} cannot be read: {e}", folder.display()))?;
    let mut rows = Vec::new();
    for file in files.flatten() {
        let path = file.path();
        let text = std::fs::read_to_string(&path)
            .map_err(|e| format!("{} cannot be read: {e}", path.display()))?;
        for line in text.lines() {
            let row = Row::parse(line);
            rows.push(row.ok_or_else(|| format!("{}: not a row: {line}", path.display()))?);
        }
    }
    Ok(worst_of_each(rows))
}

fn worst_of_each(mut rows: Vec<Row>) -> Vec<Row> {
    let key = |r: &Row| {
        (
            number(&r.table),
            r.table.clone(),
            r.subject.clone(),
            r.what.clone(),
        )
    };
    rows.sort_by(|a, b| {
        let nearer = b.nearness().total_cmp(&a.nearness());
        key(a).cmp(&key(b)).then(nearer).then(a.place.cmp(&b.place))
    });
    rows.dedup_by(|b, a| key(a) == key(b));
    rows
}

/// Rows of the table come in its order, tests of sampling after them.
fn number(table: &str) -> u32 {
    table.parse().unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_row_of_each_thing_is_kept() {
        let line = |table: &str, worst: &str, verdict: &str| {
            format!("{table}\tmetal\terror\t{worst}\t<=\t1e-4\t{verdict}\there")
        };
        let lines = [
            line("10", "1e-5", "good"),
            line("9", "2e-5", "good"),
            line("9", "3e-5", "good"),
            line("energy", "NaN", "bad"),
            line("energy", "1e-9", "good"),
        ];
        let rows: Vec<Row> = lines.iter().filter_map(|l| Row::parse(l)).collect();
        assert_eq!(rows.len(), 5);
        let worst = worst_of_each(rows);
        let tables: Vec<(&str, bool)> = worst.iter().map(|r| (r.table.as_str(), r.good)).collect();
        assert_eq!(tables, [("9", true), ("10", true), ("energy", false)]);
        assert_eq!(worst[0].worst, 3e-5);
        assert_eq!(Row::parse("9\tmetal\terror"), None);
    }
}
