//! The sections of the page that say how good plans are, each empty where nothing of it was measured.

use std::fmt::Write as _;

use impasto_runtime::lab::statistics::median;

use super::measured::{BASELINES, EXHAUSTIVE, Measured, correlation};
use super::plots::paths;
use super::regret::mega_regret;
use super::results::CHOSEN;

/// Scenes with so many materials say how long a large search takes.
const MANY: u32 = 64;

/// What the project set itself, and what was reached.
pub fn targets(scenes: &[Measured]) -> String {
    let mut rows = String::new();
    let mut row = |target: &str, value: Option<String>, reached: Option<bool>| {
        let (Some(value), Some(reached)) = (value, reached) else {
            return;
        };
        let verdict = if reached { "reached" } else { "**missed**" };
        let _ = writeln!(rows, "| {target} | {value} | {verdict} |");
    };
    let worst_of = |of: &dyn Fn(&Measured) -> Option<f64>| {
        let values = scenes.iter().filter_map(|s| Some((of(s)?, s)));
        values.max_by(|a, b| a.0.total_cmp(&b.0))
    };
    let told = |(value, scene): (f64, &Measured)| format!("{value:.3} ({})", place(scene));
    let regret = worst_of(&|s| Some(s.regret()));
    row(
        "regret of every scene at most 1.05",
        regret.map(told),
        regret.map(|r| r.0 <= 1.05),
    );
    let middle = median(scenes.iter().map(Measured::regret));
    row(
        "median regret at most 1.02",
        middle.map(|m| format!("{m:.3}")),
        middle.map(|m| m <= 1.02),
    );
    for name in ["own", "paper"] {
        let found = worst_of(&|s| Some(s.regret() / s.regret_of(name)?));
        let target = format!("time over that of `{name}` at most 1.01");
        row(&target, found.map(told), found.map(|f| f.0 <= 1.01));
    }
    let mega = worst_of(&|s| Some(1.0 / s.render_ratio("mega")?));
    row(
        "time over that of `mega` at most 1.01 (whole renders)",
        mega.map(told),
        mega.map(|m| m.0 <= 1.01),
    );
    let kernels: Vec<_> = scenes.iter().flat_map(|s| s.kernels(None)).collect();
    let rank = correlation(&kernels);
    row(
        "rank correlation of kernels at least 0.95",
        rank.map(|r| format!("{r:.3}")),
        rank.map(|r| r >= 0.95),
    );
    let [material, whole] =
        [1, 2].map(|i| median(scenes.iter().filter_map(|s| s.median_errors()[i])));
    let both = whole.zip(material).map(|(w, m)| {
        format!(
            "{}, of its material kernels alone {}",
            percent(w),
            percent(m)
        )
    });
    row(
        "median error of a plan's predicted time at most 15 %",
        both,
        whole.map(|w| w <= 0.15),
    );
    let many =
        worst_of(&|s| Some(s.scene.planning).filter(|seconds| s.count() >= MANY && *seconds > 0.0));
    let shown = many.map(|(seconds, s)| format!("{:.1} ms ({})", seconds * 1e3, place(s)));
    row(
        "planning 64 materials in less than 50 ms",
        shown,
        many.map(|m| m.0 < 0.05),
    );
    if rows.is_empty() {
        return rows;
    }
    format!("| to reach | measured | |\n|---|---|---|\n{rows}")
}

/// A scene and its pool.
fn place(scene: &Measured) -> String {
    format!("{}, {}", scene.scene.name, paths(scene.scene.pool))
}

/// As people write it.
pub fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

/// In a table.
pub fn cell(value: Option<f64>) -> String {
    value.map_or_else(|| "-".into(), |value| format!("{value:.3}"))
}

/// A partition in a table, where `|` would end the cell.
pub fn code(partition: &str) -> String {
    format!("`{}`", partition.replace('|', "\\|"))
}

/// The scenes, each once.
pub fn scenes(scenes: &[Measured]) -> String {
    let mut rows = String::new();
    let mut seen: Vec<&str> = Vec::new();
    for measured in scenes {
        let scene = measured.scene;
        if seen.contains(&scene.name.as_str()) {
            continue;
        }
        seen.push(&scene.name);
        let used: Vec<_> = scene.materials.iter().filter(|m| m.used).collect();
        let list: Vec<String> = used
            .iter()
            .take(8)
            .map(|m| {
                format!(
                    "{} {:.0} ({:.0})",
                    m.name,
                    100.0 * m.share,
                    100.0 * m.present
                )
            })
            .collect();
        let more = match used.len() {
            n if n > 8 => format!(", and {} more", n - 8),
            _ => String::new(),
        };
        let all = if measured.count() <= EXHAUSTIVE {
            "all"
        } else {
            "a sample of"
        };
        let plans = format!("{all} {}", measured.material_plans().len());
        let _ = writeln!(
            rows,
            "| {} | {} | {} | {} | {} | {plans} | {}{more} |",
            scene.name,
            scene.about,
            or_dash(&scene.hits),
            or_dash(&scene.shares),
            scene.kernels.len(),
            list.join(", "),
        );
    }
    if rows.is_empty() {
        return rows;
    }
    format!(
        "| scene | | hits | shares | kernels | plans | materials |\n|---|---|---|---|---|---|---|\n{rows}"
    )
}

fn or_dash(text: &str) -> &str {
    if text.is_empty() { "-" } else { text }
}

/// Every strategy against the best plan.
pub fn regret(scenes: &[Measured]) -> String {
    if scenes.is_empty() {
        return String::new();
    }
    let columns: Vec<Vec<Option<f64>>> = scenes.iter().map(regrets).collect();
    let mut rows = String::new();
    let mut line = |name: &str, pool: &str, values: &[Option<f64>]| {
        let cells: Vec<String> = values.iter().map(|v| cell(*v)).collect();
        let _ = writeln!(rows, "| {name} | {pool} | {} |", cells.join(" | "));
    };
    for (scene, values) in scenes.iter().zip(&columns) {
        line(&scene.scene.name, &paths(scene.scene.pool), values);
    }
    let over = |of: &dyn Fn(Vec<f64>) -> Option<f64>| -> Vec<Option<f64>> {
        let column = |i: usize| columns.iter().filter_map(|row| row[i]).collect();
        (0..columns[0].len()).map(|i| of(column(i))).collect()
    };
    line("**median**", "", &over(&|values| median(values)));
    line(
        "**worst**",
        "",
        &over(&|values| values.into_iter().max_by(f64::total_cmp)),
    );
    format!(
        "| scene | pool | auto | kernels | {} | mega |\n|---|---|---|---|{}---|\n{rows}",
        BASELINES.join(" | "),
        "---|".repeat(BASELINES.len())
    )
}

/// Of the chosen plan, of its material kernels, of all baselines, and of mega.
fn regrets(scene: &Measured) -> Vec<Option<f64>> {
    let mut out = vec![Some(scene.regret()), Some(scene.material_regret())];
    out.extend(BASELINES.map(|name| scene.regret_of(name)));
    out.push(mega_regret(scene));
    out
}

/// Where another plan would have been faster.
pub fn differences(scenes: &[Measured]) -> String {
    let mut rows = String::new();
    for scene in scenes.iter().filter(|s| s.auto != s.best) {
        let _ = writeln!(
            rows,
            "| {} | {} | {} | {} | {} |",
            scene.scene.name,
            paths(scene.scene.pool),
            code(&scene.text(&scene.auto)),
            code(&scene.text(&scene.best)),
            percent(scene.regret() - 1.0)
        );
    }
    if rows.is_empty() {
        return rows;
    }
    let count = scenes.iter().filter(|s| s.auto == s.best).count();
    format!(
        "The chosen plan is the best in {count} of {} cases. In the others the loss is a share of an iteration:\n\n\
         | scene | pool | chosen | best | loss |\n|---|---|---|---|---|\n{rows}",
        scenes.len()
    )
}

/// Paths a second of whole renders.
pub fn renders(scenes: &[Measured]) -> String {
    const WAYS: [&str; 9] = [
        CHOSEN, "best", "auto", "mega", "own", "paper", "mixed", "binned", "inline",
    ];
    let mut rows = String::new();
    for scene in scenes.iter().filter(|s| !s.scene.renders.is_empty()) {
        let cells = WAYS.map(|way| {
            let rate = scene.rate(way).map(|rate| format!("{:.1}", rate * 1e-6));
            rate.unwrap_or_else(|| "-".into())
        });
        let pool = paths(scene.scene.pool);
        let _ = writeln!(
            rows,
            "| {} | {pool} | {} |",
            scene.scene.name,
            cells.join(" | ")
        );
    }
    if rows.is_empty() {
        return rows;
    }
    format!(
        "| scene | pool | {} |\n|---|---|{}\n{rows}",
        WAYS.join(" | "),
        "---|".repeat(WAYS.len())
    )
}
