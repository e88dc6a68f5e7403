//! The goals at which a render ends, as a panel has them and as `--until` writes them: what is reached first counts.

/// A goal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Goal {
    /// What the panel calls it.
    pub name: &'static str,
    /// What it is, in a sentence.
    pub about: &'static str,
    /// What `--until` calls it.
    word: &'static str,
    /// How large it is, as a text.
    pub size: String,
    /// Is it pursued?
    pub is_on: bool,
}

/// One goal of each kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Goals(pub [Goal; 3]);

impl Default for Goals {
    /// None is pursued.
    fn default() -> Self {
        let goal = |name, word, first: &str, about| Goal {
            name,
            about,
            word,
            size: first.to_owned(),
            is_on: false,
        };
        Self([
            goal(
                "relMSE",
                "relmse",
                "1e-3",
                "Rest once the relative mean squared error is as small as this",
            ),
            goal(
                "RMSE",
                "rmse",
                "0.01",
                "Rest once the root of the mean squared error is as small as this",
            ),
            goal(
                "Time",
                "time",
                "60s",
                "Rest after this time, as in 30s or 5min",
            ),
        ])
    }
}

impl Goals {
    /// Those of a text such as `relmse=1e-3,time=60s`; what is no goal is left out.
    pub fn of(text: &str) -> Self {
        let mut goals = Self::default();
        for part in text.split(',') {
            let Some((word, size)) = part.split_once('=') else {
                continue;
            };
            for goal in goals.0.iter_mut().filter(|g| g.word == word.trim()) {
                size.trim().clone_into(&mut goal.size);
                goal.is_on = true;
            }
        }
        goals
    }

    /// Those that are pursued, as such a text; `None` if none is.
    pub fn text(&self) -> Option<String> {
        let pursued = self.0.iter().filter(|goal| goal.is_on);
        let texts = pursued.map(|goal| format!("{}={}", goal.word, goal.size.trim()));
        let texts: Vec<String> = texts.collect();
        (!texts.is_empty()).then(|| texts.join(","))
    }

    /// The relative mean squared error that is pursued, if one is.
    pub fn relmse(&self) -> Option<f64> {
        let goal = self.0.iter().find(|g| g.word == "relmse" && g.is_on)?;
        let size: f64 = goal.size.trim().parse().ok()?;
        (size.is_finite() && size > 0.0).then_some(size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_read_and_written() {
        assert_eq!(Goals::default().text(), None);
        let goals = Goals::of("time=5min, relmse= 2e-3 ,nothing,other=3");
        assert_eq!(goals.text().as_deref(), Some("relmse=2e-3,time=5min"));
        assert_eq!(goals.relmse(), Some(2e-3));
        assert_eq!(Goals::of("rmse=0.1").relmse(), None);
        assert_eq!(Goals::of("relmse=-1").relmse(), None);
    }
}
