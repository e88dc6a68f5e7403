//! Every render as a row of comma-separated values, for spreadsheets and scripts.

use std::fmt::Write as _;

use crate::converge::data::{Convergence, Run, SceneConvergence, Series};
use crate::runtime::technique::Choice;

/// The names of the columns.
const HEAD: &str = "scene,width,height,strategy,sampler,compile_seconds,samples,seed,gpu_seconds,\
                    mse,rmse,relmse,flip,dropped\n";

/// A row each render, below the names of the columns. Numbers are written so that they read back to
/// the same bits.
pub(super) fn csv(convergence: &Convergence) -> String {
    let mut out = HEAD.to_string();
    for scene in &convergence.scenes {
        for series in &scene.series {
            for point in &series.points {
                for run in &point.runs {
                    row(&mut out, scene, series, point.samples, run);
                }
            }
        }
    }
    out
}

fn row(out: &mut String, scene: &SceneConvergence, series: &Series, samples: u32, run: &Run) {
    let (width, height) = scene.size;
    let errors = &run.errors;
    let _ = writeln!(
        out,
        "{},{width},{height},{},{},{},{samples},{},{},{},{},{},{},{}",
        cell(&scene.name),
        cell(&series.strategy),
        series.sampler.name(),
        series.compile_seconds,
        run.seed,
        run.gpu_seconds,
        errors.mse,
        errors.mse.sqrt(),
        errors.relmse,
        errors.flip,
        run.dropped,
    );
}

/// A text in quotes where it must be (RFC 4180).
fn cell(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::super::example;
    use super::*;

    #[test]
    fn every_render_is_a_row() {
        let example = example::convergence();
        let text = csv(&example);
        let lines: Vec<&str> = text.lines().collect();
        let runs = example.scenes.iter().flat_map(|s| &s.series);
        let runs = runs
            .flat_map(|s| &s.points)
            .map(|p| p.runs.len())
            .sum::<usize>();
        assert_eq!(lines.len(), 1 + runs);
        let columns = |line: &str| line.split(',').count();
        assert!(
            lines[1..]
                .iter()
                .all(|line| columns(line) == columns(lines[0]))
        );
        let run = &example.scenes[0].series[0].points[0].runs[0];
        assert!(
            lines[1].contains(&format!(",{},", run.errors.mse)),
            "{}",
            lines[1]
        );
    }

    #[test]
    fn texts_with_commas_are_quoted() {
        assert_eq!(cell("a,\"b\""), "\"a,\"\"b\"\"\"");
        assert_eq!(cell("plain"), "plain");
    }
}
