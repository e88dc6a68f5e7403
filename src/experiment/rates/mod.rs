//! Tables of whole renders, by the layout that the study file asks for, and of ray casts.

mod plot;
mod rays;
mod stages;

use std::fmt::Write as _;

pub use plot::PLOTTED;
pub use rays::table as rays;

use super::results::{Results, Row};
use super::study::{Column, Layout, Part, Rates, Scene, Study, Value, Variant};

/// The table of a part; empty where nothing of it was measured.
pub fn table(study: &Study, part: &Part, of: &Rates, results: &Results) -> String {
    let made = Made {
        study,
        part,
        results,
    };
    match &of.layout {
        Layout::Scenes(columns) => made.by_scene(columns),
        Layout::Families(columns) => made.by_family(columns),
        Layout::Variants => made.by_variant(&of.variants),
        Layout::Stages { of, given } => stages::times(&made, of, given.as_deref()),
        Layout::Lanes { mega, of } => stages::lanes(&made, mega, of),
    }
}

/// The name and the picture of a part's renders; none if there is nothing to show.
///
/// # Errors
/// What the plotting library says.
pub fn picture(
    study: &Study,
    part: &Part,
    of: &Rates,
    results: &Results,
) -> Result<Option<(String, String)>, String> {
    let made = Made {
        study,
        part,
        results,
    };
    let svg = plot::picture(&made, &of.variants)?;
    Ok(svg.map(|svg| (format!("{}-rates.svg", part.name), svg)))
}

/// A part with its results.
struct Made<'a> {
    study: &'a Study,
    part: &'a Part,
    results: &'a Results,
}

impl Made<'_> {
    fn scenes(&self) -> impl Iterator<Item = &Scene> {
        self.part
            .scenes
            .iter()
            .map(|scene| &self.study.scenes[*scene])
    }

    /// The row of a variant that was rendered.
    fn row(&self, scene: &Scene, variant: &str) -> Option<&Row> {
        let row = self.results.find(self.part, &scene.name, variant)?;
        row.report.is_some().then_some(row)
    }

    /// Paths a second.
    fn rate(&self, scene: &Scene, variant: &str) -> Option<f64> {
        Some(self.row(scene, variant)?.report.as_ref()?.rate())
    }

    /// A row a scene of which anything was measured.
    fn by_scene(&self, columns: &[Column]) -> String {
        let mut rows = String::new();
        for scene in self.scenes() {
            if self.is_measured(scene) {
                let _ = writeln!(rows, "| {} | {} |", scene.title, self.cells(scene, columns));
            }
        }
        if rows.is_empty() {
            return rows;
        }
        format!("{}{rows}", head("scene", columns))
    }

    /// A table a family.
    fn by_family(&self, columns: &[Column]) -> String {
        let mut out = String::new();
        let mut last = None;
        for scene in self.scenes().filter(|scene| self.is_measured(scene)) {
            let Some((family, number)) = &scene.family else {
                continue;
            };
            if last != Some(family) {
                if last.is_some() {
                    out.push('\n');
                }
                out += &head(family, columns);
                last = Some(family);
            }
            let _ = writeln!(out, "| {number} | {} |", self.cells(scene, columns));
        }
        out
    }

    fn is_measured(&self, scene: &Scene) -> bool {
        let mut rows = self.results.of(self.part);
        rows.any(|row| row.scene == scene.name && row.report.is_some())
    }

    fn cells(&self, scene: &Scene, columns: &[Column]) -> String {
        let cells = columns.iter().map(|column| {
            let cell = self.cell(scene, &column.value);
            if column.is_bold {
                format!("**{cell}**")
            } else {
                cell
            }
        });
        cells.collect::<Vec<_>>().join(" | ")
    }

    fn cell(&self, scene: &Scene, value: &Value) -> String {
        let ratio = |value: Option<f64>| or_dash(value.map(|value| format!("{value:.2}")));
        match value {
            Value::Rate(of) => mpaths(self.rate(scene, of)),
            Value::Ratio(ratio_of) => {
                let others = ratio_of
                    .over
                    .iter()
                    .filter_map(|over| self.rate(scene, over));
                let best = others.max_by(f64::total_cmp).filter(|best| *best > 0.0);
                ratio(
                    self.rate(scene, &ratio_of.of)
                        .zip(best)
                        .map(|(rate, best)| rate / best),
                )
            }
            Value::Triangles => {
                let mut rows = self.results.of(self.part);
                let row = rows.find(|row| row.scene == scene.name && row.report.is_some());
                or_dash(row.and_then(|row| Some(row.report.as_ref()?.triangles.to_string())))
            }
            Value::Given(name) => ratio(scene.given.get(name).and_then(|g| g.first().copied())),
        }
    }

    /// A row a variant, with the ratio to the first one.
    fn by_variant(&self, variants: &[Variant]) -> String {
        let Some((base, others)) = variants.split_first() else {
            return String::new();
        };
        let scenes: Vec<&Scene> = self.scenes().collect();
        let mut rows = String::new();
        let mut last = "";
        for variant in others {
            let cell = |scene: &&Scene| {
                let rate = self.rate(scene, &variant.label)?;
                let base = self.rate(scene, &base.label)?;
                Some(format!("{:.1} ({:.2})", rate * 1e-6, rate / base))
            };
            let cells: Vec<Option<String>> = scenes.iter().map(cell).collect();
            if cells.iter().all(Option::is_none) {
                continue;
            }
            let cells: Vec<String> = cells.into_iter().map(or_dash).collect();
            let shown = if variant.group == last {
                ""
            } else {
                &variant.group
            };
            last = &variant.group;
            let _ = writeln!(
                rows,
                "| {shown} | `{}` | {} |",
                variant.label,
                cells.join(" | ")
            );
        }
        if rows.is_empty() {
            return rows;
        }
        let titles: Vec<&str> = scenes.iter().map(|scene| scene.title.as_str()).collect();
        let of_base = scenes
            .iter()
            .map(|scene| mpaths(self.rate(scene, &base.label)));
        format!(
            "| technique | option | {} |\n|---|---|{}\n| defaults | | {} |\n{rows}",
            titles.join(" | "),
            "---|".repeat(titles.len()),
            of_base.collect::<Vec<_>>().join(" | ")
        )
    }
}

fn head(first: &str, columns: &[Column]) -> String {
    let heads: Vec<&str> = columns.iter().map(|column| column.head.as_str()).collect();
    format!(
        "| {first} | {} |\n|---|{}\n",
        heads.join(" | "),
        "---|".repeat(columns.len())
    )
}

fn mpaths(rate: Option<f64>) -> String {
    or_dash(rate.map(|rate| format!("{:.1}", rate * 1e-6)))
}

fn or_dash(text: Option<String>) -> String {
    text.unwrap_or_else(|| "-".into())
}

/// What all renders of some rows lost, in a sentence.
pub fn faults<'a>(rows: impl Iterator<Item = &'a Row>) -> String {
    let reports: Vec<_> = rows.filter_map(|row| row.report.as_ref()).collect();
    let sum = |of: fn(&impasto_runtime::render::report::Report) -> u64| {
        reports.iter().map(|report| of(report)).sum::<u64>()
    };
    if reports.is_empty() {
        return String::new();
    }
    format!(
        "All of these renders together lost {} samples that were not finite. They cut {} samples to what the film holds, and {}\n\
         requests found a queue full.\n",
        sum(|r| r.nonfinite_samples),
        sum(|r| r.clamped_samples),
        sum(|r| r.queue_overflow),
    )
}
