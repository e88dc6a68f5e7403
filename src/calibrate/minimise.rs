//! Least squares without derivatives: damped Gauss-Newton steps on differences (Levenberg 1944,
//! Marquardt 1963), then a search along each coordinate, which gets over kinks of the model.
//!
//! Nothing is random: equal input gives equal output.

/// Difference by which slopes are taken, in a logarithm: 1 %.
const STEP: f64 = 0.01;
/// Rounds of Gauss-Newton steps at most.
const ROUNDS: usize = 60;
/// A step that improves the loss by a smaller share ends the rounds.
const ENOUGH: f64 = 1e-5;
/// The longest step of a coordinate: a factor of e.
const LONGEST: f64 = 1.0;

/// Coordinates near `start` where the sum of squares of `residuals` is least.
pub fn least_squares(start: &[f64], residuals: &dyn Fn(&[f64]) -> Vec<f64>) -> Vec<f64> {
    let mut x = descend(start.to_vec(), residuals);
    for _ in 0..2 {
        x = search_along_each(x, residuals);
        x = descend(x, residuals);
    }
    x
}

fn loss(residuals: &[f64]) -> f64 {
    let sum: f64 = residuals.iter().map(|r| r * r).sum();
    if sum.is_finite() { sum } else { f64::INFINITY }
}

/// Gauss-Newton steps while they improve.
fn descend(mut x: Vec<f64>, residuals: &dyn Fn(&[f64]) -> Vec<f64>) -> Vec<f64> {
    let mut damping = 1e-2;
    let mut here = residuals(&x);
    for _ in 0..ROUNDS {
        let before = loss(&here);
        let slopes = slopes(&x, &here, residuals);
        let mut improved = false;
        for _ in 0..8 {
            let step = damped_step(&slopes, &here, damping);
            let tried: Vec<f64> = x.iter().zip(&step).map(|(x, s)| x + s).collect();
            let there = residuals(&tried);
            if loss(&there) < before {
                (x, here, improved) = (tried, there, true);
                damping = (0.3 * damping).max(1e-9);
                break;
            }
            damping *= 5.0;
        }
        if !improved || before - loss(&here) < ENOUGH * before {
            break;
        }
    }
    x
}

/// The slope of every residual along each coordinate.
fn slopes(x: &[f64], here: &[f64], residuals: &dyn Fn(&[f64]) -> Vec<f64>) -> Vec<Vec<f64>> {
    let along = |i: usize| {
        let mut moved = x.to_vec();
        moved[i] += STEP;
        let there = residuals(&moved);
        there
            .iter()
            .zip(here)
            .map(|(t, h)| (t - h) / STEP)
            .collect()
    };
    (0..x.len()).map(along).collect()
}

/// Solves (J'J + damping diag) step = -J'r.
fn damped_step(slopes: &[Vec<f64>], here: &[f64], damping: f64) -> Vec<f64> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let n = slopes.len();
    let mut rows: Vec<Vec<f64>> = (0..n)
        .map(|i| {
            let mut row: Vec<f64> = (0..n).map(|j| dot(&slopes[i], &slopes[j])).collect();
            row[i] += damping * row[i] + 1e-9;
            row.push(-dot(&slopes[i], here));
            row
        })
        .collect();
    let step = solve(&mut rows);
    step.into_iter()
        .map(|s| s.clamp(-LONGEST, LONGEST))
        .collect()
}

/// Gauss elimination with pivots; what cannot be told stays 0. The last column is the right side.
fn solve(rows: &mut [Vec<f64>]) -> Vec<f64> {
    let n = rows.len();
    for column in 0..n {
        let pivot =
            (column..n).max_by(|a, b| rows[*a][column].abs().total_cmp(&rows[*b][column].abs()));
        rows.swap(column, pivot.unwrap_or(column));
        if rows[column][column].abs() < 1e-300 {
            continue;
        }
        let (above, below) = rows.split_at_mut(column + 1);
        for row in below {
            let factor = row[column] / above[column][column];
            for (r, p) in row.iter_mut().zip(&above[column]).skip(column) {
                *r -= factor * p;
            }
        }
    }
    let mut x = vec![0.0; n];
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|j| rows[i][j] * x[j]).sum();
        let step = (rows[i][n] - known) / rows[i][i];
        x[i] = if step.is_finite() { step } else { 0.0 };
    }
    x
}

/// Moves each coordinate by itself while that improves, by ever smaller steps.
fn search_along_each(mut x: Vec<f64>, residuals: &dyn Fn(&[f64]) -> Vec<f64>) -> Vec<f64> {
    let mut least = loss(&residuals(&x));
    for step in [1.0, 0.3, 0.1] {
        for i in 0..x.len() {
            for direction in [step, -step] {
                loop {
                    let mut tried = x.clone();
                    tried[i] += direction;
                    let there = loss(&residuals(&tried));
                    if there >= least * (1.0 - ENOUGH) {
                        break;
                    }
                    (x, least) = (tried, there);
                }
            }
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sum_of_exponentials_is_found_again() {
        let model = |x: &[f64], t: f64| x[0].exp() + x[1].exp() * t + (x[2].exp() * t * t).sqrt();
        let truth = [-2.0, 1.0, 3.0];
        let residuals = |x: &[f64]| -> Vec<f64> {
            let times = (1..30).map(|t| 0.05 * f64::from(t * t % 23));
            times
                .map(|t| (model(x, t) / model(&truth, t)).ln())
                .collect()
        };
        let found = least_squares(&[0.0; 3], &residuals);
        assert!(loss(&residuals(&found)) < 1e-8, "{found:?}");
        // The two that grow with t cannot be told apart; their sum can.
        assert!((found[0] - truth[0]).abs() < 1e-3, "{found:?}");
    }

    #[test]
    fn kinks_and_flat_directions_do_no_harm() {
        let residuals = |x: &[f64]| vec![(x[0] - 2.0).max(0.0) + 0.1 * (x[0] - 1.0), 0.0 * x[1]];
        let found = least_squares(&[9.0, 5.0], &residuals);
        assert!((found[0] - 1.0).abs() < 0.05, "{found:?}");
        assert_eq!(found[1], 5.0);
    }
}
