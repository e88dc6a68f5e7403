//! What a value is checked for, as messages name it. Most values fit their place, so that no text is made.

use std::fmt;

/// A place that a value is given to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose<'a> {
    /// In words.
    Words(&'a str),
    /// By its name.
    Named(&'a str),
    /// A parameter of what is called.
    Argument {
        /// The parameter.
        name: &'a str,
        /// What is called.
        of: &'a str,
    },
}

impl<'a> From<&'a str> for Purpose<'a> {
    fn from(words: &'a str) -> Self {
        Purpose::Words(words)
    }
}

impl fmt::Display for Purpose<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Purpose::Words(words) => f.write_str(words),
            Purpose::Named(name) => write!(f, "`{name}`"),
            Purpose::Argument { name, of } => write!(f, "`{name}` of `{of}`"),
        }
    }
}
