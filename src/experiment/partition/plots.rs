//! The pictures of the page: predicted against measured times of kernels and of plans, and regret.

use super::Result;
use crate::plot::COLORS;
use impasto_compiler::partition::Form;

use super::measured::Measured;
use super::regret;
use super::scatter::{Series, scatter};

/// Names and contents of all pictures of a part; none if nothing was measured.
///
/// # Errors
/// What the plotting library says.
pub fn all(part: &str, scenes: &[Measured]) -> Result<Vec<(String, String)>> {
    if scenes.is_empty() {
        return Ok(Vec::new());
    }
    let name = |what: &str| format!("{part}-{what}.svg");
    Ok(vec![
        (name("kernels"), kernels(scenes)?),
        (name("plans"), plans(scenes)?),
        (name("regret"), regret::picture(scenes)?),
    ])
}

fn kernels(scenes: &[Measured]) -> Result<String> {
    let series = Form::all().zip(COLORS);
    let series = series.map(|(form, color)| Series {
        name: form.name().into(),
        color,
        points: scenes.iter().flat_map(|s| s.kernels(Some(form))).collect(),
    });
    let series: Vec<Series> = series.collect();
    scatter("Material kernels: predicted against measured", &series)
}

/// So many plans of a scene are drawn, evenly taken from all.
const PLANS: usize = 100;

fn plans(scenes: &[Measured]) -> Result<String> {
    let series = pools(scenes).into_iter().zip(COLORS.into_iter().cycle());
    let series = series.map(|(pool, color)| {
        let of_pool = scenes.iter().filter(|s| s.scene.pool == pool);
        Series {
            name: format!("pool of {}", paths(pool)),
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

/// The pools that scenes were measured with, ascending.
pub fn pools(scenes: &[Measured]) -> Vec<u32> {
    let mut pools: Vec<u32> = scenes.iter().map(|s| s.scene.pool).collect();
    pools.sort_unstable();
    pools.dedup();
    pools
}

/// At most `most` of some values, evenly taken.
fn thinned<T: Clone>(values: Vec<T>, most: usize) -> Vec<T> {
    let step = values.len().div_ceil(most).max(1);
    values.into_iter().step_by(step).collect()
}

/// A number of paths: millions from 2^20 on.
pub fn paths(pool: u32) -> String {
    match pool % (1 << 20) {
        0 => format!("{} M paths", pool >> 20),
        _ => format!("{pool} paths"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_well_formed_and_show_every_form() {
        let scene = super::super::fixture::scene();
        let scenes = [Measured::new(&scene).expect("fits")];
        let pictures = all("partition", &scenes).expect("drawn");
        assert_eq!(pictures.len(), 3);
        for (name, svg) in &pictures {
            well_formed(svg).unwrap_or_else(|why| panic!("{name}: {why}"));
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
        }
        for (form, color) in Form::all().zip(COLORS) {
            let color = format!("#{:02X}{:02X}{:02X}", color.0, color.1, color.2);
            let dots = pictures[0].1.split("<circle");
            // One of them is the legend's.
            let drawn = dots.filter(|dot| dot.contains(&color)).count();
            assert!(drawn > 1, "{} is not drawn", form.name());
        }
        for word in ["auto", "mega", "threshold=1000", "tiny"] {
            let texts = pictures[2].1.lines().map(str::trim);
            assert!(texts.clone().any(|t| t == word), "{word} is not named");
        }
    }

    #[test]
    fn at_most_so_many_are_drawn() {
        assert_eq!(thinned((0..7).collect(), 3), [0, 3, 6]);
        assert_eq!(thinned((0..3).collect(), 3), [0, 1, 2]);
        assert_eq!(paths(1 << 22), "4 M paths");
        assert_eq!(paths(5000), "5000 paths");
    }

    /// Do elements nest, are attributes quoted, and is nothing left unescaped?
    fn well_formed(svg: &str) -> Result {
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
