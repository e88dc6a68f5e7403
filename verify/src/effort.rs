//! How hard is tried: as much as one waits for, or all that time allows.

/// How hard a search or a test tries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Effort {
    /// As much as one waits for.
    #[default]
    Quick,
    /// Every case of a bsdf, with more samples: as a suite of tests has it.
    Thorough,
    /// All that time allows: more directions, samples and restarts.
    Full,
}

impl Effort {
    /// The number of the two that this effort takes; a thorough one is quick in most things.
    pub fn of(self, quick: usize, full: usize) -> usize {
        self.among(quick, quick, full)
    }

    /// The number of the three that this effort takes.
    pub fn among(self, quick: usize, thorough: usize, full: usize) -> usize {
        match self {
            Effort::Quick => quick,
            Effort::Thorough => thorough,
            Effort::Full => full,
        }
    }
}
