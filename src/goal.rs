//! Goals of a render in words: `relmse=1e-3`, `rmse=0.01` and `time=60s`, as `--until` takes them.

use std::time::Duration;

use impasto_runtime::render::until::Goals;

/// The longest time that can be asked for: 30 days.
const LONGEST: f64 = 30.0 * 86_400.0;

/// One goal, as it is given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// A relative mean squared error.
    Relmse(f64),
    /// The root of a mean squared error.
    Rmse(f64),
    /// A time of rendering.
    Time(Duration),
}

impl Goal {
    /// Adds it to others; its name, and whether there was one of its kind.
    pub fn add_to(self, goals: &mut Goals) -> (&'static str, bool) {
        match self {
            Self::Relmse(error) => ("relmse", goals.relmse.replace(error).is_some()),
            Self::Rmse(error) => ("rmse", goals.rmse.replace(error).is_some()),
            Self::Time(time) => ("time", goals.time.replace(time).is_some()),
        }
    }
}

/// How goals begin.
pub fn kinds() -> Vec<&'static str> {
    vec!["relmse=", "rmse=", "time="]
}

/// Reads a goal.
///
/// # Errors
/// What is wrong with it, and what was expected.
pub fn parse(text: &str) -> Result<Goal, String> {
    let kinds = "expected relmse=ERROR, rmse=ERROR or time=TIME, such as relmse=1e-3 or time=60s";
    let (kind, value) = text.split_once('=').ok_or(kinds)?;
    match kind {
        "relmse" => Ok(Goal::Relmse(parse_error(value)?)),
        "rmse" => Ok(Goal::Rmse(parse_error(value)?)),
        "time" => Ok(Goal::Time(parse_time(value)?)),
        other => Err(format!("there is no measure `{other}`: {kinds}")),
    }
}

fn parse_error(text: &str) -> Result<f64, String> {
    let error = text.parse::<f64>().ok();
    let error = error.filter(|error| error.is_finite() && *error > 0.0);
    error.ok_or_else(|| {
        format!("`{text}` is no error that can be reached: expected a number above 0")
    })
}

fn parse_time(text: &str) -> Result<Duration, String> {
    let split = text.find(|c: char| c.is_ascii_alphabetic() && c != 'e' && c != 'E');
    let (number, unit) = text.split_at(split.unwrap_or(text.len()));
    let factor = match unit {
        "ms" => 1e-3,
        "s" => 1.0,
        "min" => 60.0,
        "h" => 3600.0,
        _ => {
            return Err(format!(
                "`{text}` has no unit of time: expected ms, s, min or h, as in 60s"
            ));
        }
    };
    let seconds = number.trim().parse::<f64>().map(|n| n * factor).ok();
    let seconds = seconds.filter(|s| (1e-3..=LONGEST).contains(s));
    let seconds = seconds.ok_or_else(|| format!("`{text}` is no time from 1ms to 720h"))?;
    Ok(Duration::from_secs_f64(seconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goals_are_read() {
        assert_eq!(parse("relmse=1e-3"), Ok(Goal::Relmse(1e-3)));
        assert_eq!(parse("rmse=0.5"), Ok(Goal::Rmse(0.5)));
        for (text, seconds) in [
            ("60s", 60.0),
            ("250ms", 0.25),
            ("1.5min", 90.0),
            ("2h", 7200.0),
            ("1e1s", 10.0),
        ] {
            let expected = Goal::Time(Duration::from_secs_f64(seconds));
            assert_eq!(parse(&format!("time={text}")), Ok(expected), "{text}");
        }
    }

    #[test]
    fn what_is_no_goal_is_refused() {
        for (text, reason) in [
            ("relmse", "expected relmse=ERROR"),
            ("psnr=40", "no measure `psnr`"),
            ("relmse=0", "above 0"),
            ("relmse=-1e-3", "above 0"),
            ("rmse=nan", "above 0"),
            ("rmse=inf", "above 0"),
            ("rmse=", "above 0"),
            ("time=60", "no unit of time"),
            ("time=60days", "no unit of time"),
            ("time=0s", "no time from 1ms"),
            ("time=-5s", "no time from 1ms"),
            ("time=nans", "no unit of time"),
            ("time=s", "no time from 1ms"),
            ("time=1e9h", "no time from 1ms"),
        ] {
            let error = parse(text).expect_err(text);
            assert!(error.contains(reason), "{text}: {error}");
        }
    }
}
