//! The pictures of the page: predicted against measured times of kernels and of plans, and regret.

use super::measured::{BASELINES, Measured, Pair};
use super::plans::Form;
use super::plot::{
    Anchor, BLACK, BLUE, GREEN, GREY, Log, Mark, ORANGE, PURPLE, SKY, Svg, VERMILION, time,
};

/// Names and contents of all pictures; none if nothing was measured.
pub(super) fn all(scenes: &[Measured]) -> Vec<(&'static str, String)> {
    if scenes.is_empty() {
        return Vec::new();
    }
    vec![
        ("partition-kernels.svg", kernels(scenes)),
        ("partition-plans.svg", plans(scenes)),
        ("partition-regret.svg", regret(scenes)),
    ]
}

/// Points of one color.
struct Series {
    name: String,
    color: &'static str,
    points: Vec<Pair>,
}

fn kernels(scenes: &[Measured]) -> String {
    let series = Form::ALL.map(|form| Series {
        name: form.name().into(),
        color: color_of(form),
        points: scenes.iter().flat_map(|s| s.kernels(Some(form))).collect(),
    });
    scatter("Material kernels: predicted against measured", &series)
}

fn color_of(form: Form) -> &'static str {
    match form {
        Form::Own => BLUE,
        Form::Mixed => VERMILION,
        Form::Binned => GREEN,
        Form::Inline => PURPLE,
    }
}

/// So many plans of a scene are drawn, evenly taken from all.
const PLANS: usize = 100;

fn plans(scenes: &[Measured]) -> String {
    let mut pools: Vec<u64> = scenes.iter().map(|s| s.scene.pool).collect();
    pools.sort_unstable();
    pools.dedup();
    let colors = [BLUE, ORANGE, GREEN, PURPLE];
    let series = pools
        .iter()
        .zip(colors.into_iter().cycle())
        .map(|(pool, color)| {
            let of_pool = scenes.iter().filter(|s| s.scene.pool == *pool);
            Series {
                name: format!("pool of {}", paths(*pool)),
                color,
                points: of_pool
                    .flat_map(|s| thinned(s.material_plans(), PLANS))
                    .collect(),
            }
        });
    let series: Vec<Series> = series.collect();
    scatter(
        "Material kernels of whole plans: predicted against measured",
        &series,
    )
}

/// At most `most` of some values, evenly taken.
fn thinned<T: Clone>(values: Vec<T>, most: usize) -> Vec<T> {
    let step = values.len().div_ceil(most).max(1);
    values.into_iter().step_by(step).collect()
}

/// A number of paths: millions from 2^20 on.
pub(super) fn paths(pool: u64) -> String {
    match pool % (1 << 20) {
        0 => format!("{} M paths", pool >> 20),
        _ => format!("{pool} paths"),
    }
}

/// Predicted over measured seconds, both axes logarithmic and of the same range.
fn scatter(title: &str, series: &[Series]) -> String {
    const SIZE: f64 = 640.0;
    const LEFT: f64 = 78.0;
    const TOP: f64 = 62.0;
    let mut svg = Svg::new(SIZE + LEFT + 24.0, SIZE + TOP + 56.0, title);
    let values = series
        .iter()
        .flat_map(|s| &s.points)
        .flat_map(|p| [p.predicted, p.measured]);
    let positive = values.filter(|v| *v > 0.0);
    let (low, high) = positive.fold((f64::INFINITY, 0.0), |(low, high), v| {
        (v.min(low), v.max(high))
    });
    let (low, high) = if high > 0.0 {
        (low / 1.25, high * 1.25)
    } else {
        (1e-6, 1e-3)
    };
    let x = Log {
        low,
        high,
        from: LEFT,
        to: LEFT + SIZE,
    };
    let y = Log {
        from: TOP + SIZE,
        to: TOP,
        ..x
    };
    x.draw_below(&mut svg, (TOP, TOP + SIZE), time);
    y.draw_left(&mut svg, (LEFT, LEFT + SIZE), time);
    let along = |factor: f64| {
        let (from, to) = (
            low * f64::max(1.0, 1.0 / factor),
            high / f64::max(1.0, factor),
        );
        (
            (x.at(from), y.at(from * factor)),
            (x.at(to), y.at(to * factor)),
        )
    };
    for series in series {
        let points = series
            .points
            .iter()
            .filter(|p| p.predicted > 0.0 && p.measured > 0.0);
        let points: Vec<(f64, f64)> = points
            .map(|p| (x.at(p.measured), y.at(p.predicted)))
            .collect();
        svg.points(series.color, 5.0, &points);
    }
    let (from, to) = along(1.0);
    svg.line(from, to, BLACK, "");
    for factor in [1.15, 1.0 / 1.15] {
        let (from, to) = along(factor);
        svg.line(from, to, GREY, "5 4");
    }
    svg.label(
        LEFT + 0.5 * SIZE,
        TOP + SIZE + 40.0,
        Anchor::Middle,
        "measured",
    );
    svg.upright(18.0, TOP + 0.5 * SIZE, "predicted");
    let mut at = LEFT;
    for series in series {
        svg.points(series.color, 9.0, &[(at + 6.0, 44.0)]);
        let name = format!("{} ({})", series.name, series.points.len());
        svg.label(at + 16.0, 48.0, Anchor::Start, &name);
        at += 34.0 + 6.6 * name.chars().count() as f64;
    }
    svg.note(LEFT + SIZE, 48.0, Anchor::End, "dashed: 15 % off");
    svg.finish()
}

/// What stands for a strategy.
fn sign_of(strategy: &str) -> (Mark, &'static str) {
    match strategy {
        "auto" => (Mark::Disc, BLACK),
        "own" => (Mark::Ring, BLUE),
        "mixed" => (Mark::Square, VERMILION),
        "binned" => (Mark::Diamond, GREEN),
        "inline" => (Mark::Triangle, PURPLE),
        "paper" => (Mark::Plus, ORANGE),
        "mega" => (Mark::Cross, GREY),
        _ => (Mark::Cross, SKY),
    }
}

/// The regret of mega, which only whole renders tell: theirs relative to the chosen plan's.
pub(super) fn mega_regret(scene: &Measured) -> Option<f64> {
    Some(scene.regret() * scene.render_ratio("mega")?)
}

/// A row a scene and a panel a pool: how many times the best plan's time each strategy takes.
fn regret(scenes: &[Measured]) -> String {
    const ROW: f64 = 22.0;
    const PANEL: f64 = 400.0;
    const LEFT: f64 = 108.0;
    const TOP: f64 = 92.0;
    const GAP: f64 = 28.0;
    let mut pools: Vec<u64> = scenes.iter().map(|s| s.scene.pool).collect();
    pools.sort_unstable();
    pools.dedup();
    let mut names: Vec<&str> = Vec::new();
    for scene in scenes {
        if !names.contains(&scene.scene.name.as_str()) {
            names.push(&scene.scene.name);
        }
    }
    let marks = |scene: &Measured| -> Vec<(&'static str, f64)> {
        let mut out: Vec<(&'static str, f64)> = BASELINES
            .iter()
            .filter_map(|name| Some((*name, scene.regret_of(name)?)))
            .collect();
        out.extend(mega_regret(scene).map(|r| ("mega", r)));
        // Last, so that it lies above the others.
        out.push(("auto", scene.regret()));
        out
    };
    let most = scenes
        .iter()
        .flat_map(marks)
        .map(|(_, r)| r)
        .fold(1.2, f64::max);
    let height = ROW * names.len() as f64;
    let width = LEFT + pools.len() as f64 * (PANEL + GAP);
    let title = "Time of an iteration over that of the best plan";
    let mut svg = Svg::new(width.max(LEFT + 1.6 * PANEL), TOP + height + 48.0, title);
    let shown: Vec<&str> = ["auto"]
        .into_iter()
        .chain(BASELINES)
        .chain(["mega"])
        .collect();
    let mut at = 20.0;
    for strategy in shown {
        if scenes
            .iter()
            .all(|s| marks(s).iter().all(|(name, _)| *name != strategy))
        {
            continue;
        }
        let (mark, color) = sign_of(strategy);
        svg.mark(mark, (at, 48.0), color);
        svg.label(at + 11.0, 52.0, Anchor::Start, strategy);
        at += 34.0 + 6.8 * strategy.len() as f64;
    }
    for (panel, pool) in pools.iter().enumerate() {
        let left = LEFT + panel as f64 * (PANEL + GAP);
        let axis = Log {
            low: 0.97,
            high: most * 1.08,
            from: left,
            to: left + PANEL,
        };
        svg.label(
            left + 0.5 * PANEL,
            TOP - 12.0,
            Anchor::Middle,
            &format!("pool of {}", paths(*pool)),
        );
        axis.draw_below(&mut svg, (TOP, TOP + height), |v| format!("{v}"));
        svg.line((axis.at(1.0), TOP), (axis.at(1.0), TOP + height), BLACK, "");
        svg.line(
            (axis.at(1.05), TOP),
            (axis.at(1.05), TOP + height),
            GREY,
            "4 3",
        );
        for (row, name) in names.iter().enumerate() {
            let y = TOP + (row as f64 + 0.5) * ROW;
            if panel == 0 {
                svg.label(left - 10.0, y + 4.0, Anchor::End, name);
            }
            let scene = scenes
                .iter()
                .find(|s| s.scene.name == *name && s.scene.pool == *pool);
            for (strategy, value) in scene.map(marks).unwrap_or_default() {
                let (mark, color) = sign_of(strategy);
                svg.mark(mark, (axis.at(value), y), color);
            }
        }
        svg.note(
            left + 0.5 * PANEL,
            TOP + height + 36.0,
            Anchor::Middle,
            "times the best; dashed: 1.05",
        );
    }
    svg.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_well_formed_and_show_every_form() {
        let results = super::super::fixture::results();
        let scenes: Vec<Measured> = results
            .scenes
            .iter()
            .map(|s| Measured::new(s).expect("fits"))
            .collect();
        let pictures = all(&scenes);
        assert_eq!(pictures.len(), 3);
        for (name, svg) in &pictures {
            well_formed(svg).unwrap_or_else(|why| panic!("{name}: {why}"));
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
        }
        for form in Form::ALL {
            let path = format!("stroke=\"{}\" stroke-width=\"5\"", color_of(form));
            assert!(
                pictures[0].1.contains(&path),
                "{} is not drawn",
                form.name()
            );
        }
        for word in ["auto", "mega", "threshold=1000", "tiny"] {
            assert!(
                pictures[2].1.contains(&format!(">{word}<")),
                "{word} is not named"
            );
        }
    }

    #[test]
    fn what_was_predicted_too_long_is_above_the_diagonal() {
        let pair = |predicted, measured| Pair {
            predicted,
            measured,
        };
        let series = [Series {
            name: "one".into(),
            color: BLUE,
            points: vec![pair(1e-3, 1e-6), pair(1e-6, 1e-3), pair(1e-5, -1e-6)],
        }];
        let svg = scatter("title", &series);
        let path = svg
            .split("<path d=\"")
            .find(|part| part.contains("stroke-width=\"5\""));
        let points: Vec<Vec<f64>> = path
            .and_then(|part| part.split('"').next())
            .expect("points")
            .split("h0")
            .filter(|point| !point.is_empty())
            .map(|point| {
                point[1..]
                    .split(' ')
                    .map(|n| n.parse().expect("a number"))
                    .collect()
            })
            .collect();
        assert_eq!(
            points.len(),
            2,
            "less than no time is on no logarithmic axis"
        );
        let (above, below) = (&points[0], &points[1]);
        assert!(above[0] < below[0] && above[1] < below[1], "{points:?}");
    }

    #[test]
    fn at_most_so_many_are_drawn() {
        assert_eq!(thinned((0..7).collect(), 3), [0, 3, 6]);
        assert_eq!(thinned((0..3).collect(), 3), [0, 1, 2]);
        assert_eq!(paths(1 << 22), "4 M paths");
        assert_eq!(paths(5000), "5000 paths");
    }

    /// Do elements nest, are attributes quoted, and is nothing left unescaped?
    fn well_formed(svg: &str) -> Result<(), String> {
        let mut open: Vec<&str> = Vec::new();
        let mut rest = svg;
        while let Some(at) = rest.find('<') {
            let (text, tail) = rest.split_at(at);
            if text.contains('>') || (text.contains('&') && !text.contains(';')) {
                return Err(format!("unescaped: {text}"));
            }
            let (tag, after) = tail[1..].split_once('>').ok_or("a tag does not end")?;
            rest = after;
            if tag.matches('"').count() % 2 == 1 {
                return Err(format!("a quote is missing: {tag}"));
            }
            let name = tag
                .split([' ', '/'])
                .find(|word| !word.is_empty())
                .unwrap_or("");
            if let Some(closed) = tag.strip_prefix('/') {
                let last = open.pop();
                if last != Some(closed) {
                    return Err(format!("</{closed}> closes {last:?}"));
                }
            } else if !tag.ends_with('/') {
                open.push(name);
            }
        }
        match open.as_slice() {
            [] => Ok(()),
            open => Err(format!("left open: {open:?}")),
        }
    }
}
