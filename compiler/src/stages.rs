//! The stages of a compilation, for those who want to know where its time goes.

/// What a compilation is at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Looking files up.
    Read,
    /// Texts to syntax trees.
    Parse,
    /// Names, types and constants; syntax trees to IR.
    Check,
    /// Passes over functions of the library and of users that materials reach.
    Functions,
    /// Constants of an instance into its material, closures that cannot show out of it, lobes.
    Lower,
    /// Passes over the materials' own functions, and what the host computes instead.
    Passes,
    /// IR to WGSL.
    Generate,
    /// WGSL to naga's modules.
    ReadBack,
    /// Naga's validation.
    Validate,
}

impl Stage {
    /// Every stage, in the order in which a compilation first reaches them.
    pub const ALL: [Stage; 9] = [
        Stage::Read,
        Stage::Parse,
        Stage::Check,
        Stage::Functions,
        Stage::Lower,
        Stage::Passes,
        Stage::Generate,
        Stage::ReadBack,
        Stage::Validate,
    ];

    /// A word for tables.
    pub fn name(self) -> &'static str {
        match self {
            Stage::Read => "read",
            Stage::Parse => "parse",
            Stage::Check => "check",
            Stage::Functions => "functions",
            Stage::Lower => "lower",
            Stage::Passes => "passes",
            Stage::Generate => "generate",
            Stage::ReadBack => "naga read",
            Stage::Validate => "naga check",
        }
    }
}

/// Says which stage a compilation is at, whenever that changes, to whoever listens.
pub struct Progress<'a> {
    now: Stage,
    listener: Option<&'a mut dyn FnMut(Stage)>,
    stop: Option<&'a dyn Fn() -> bool>,
}

impl<'a> Progress<'a> {
    /// Nobody listens.
    pub fn silent() -> Self {
        Self {
            now: Stage::Read,
            listener: None,
            stop: None,
        }
    }

    /// `listener` is called with the stage that begins.
    pub fn to(listener: &'a mut dyn FnMut(Stage)) -> Self {
        Self {
            now: Stage::Read,
            listener: Some(listener),
            stop: None,
        }
    }

    /// Nobody listens, and the compilation is of no more use once `stop` tells so.
    pub fn until(stop: &'a dyn Fn() -> bool) -> Self {
        Self {
            stop: Some(stop),
            ..Self::silent()
        }
    }

    /// Whether the compilation is of no more use.
    pub(crate) fn is_stopped(&self) -> bool {
        self.stop.is_some_and(|stop| stop())
    }

    /// A stage begins; gives the one that it interrupts, for going back to it.
    pub fn enter(&mut self, stage: Stage) -> Stage {
        if stage != self.now
            && let Some(listener) = &mut self.listener
        {
            listener(stage);
        }
        std::mem::replace(&mut self.now, stage)
    }
}
