//! Names of materials in files of other programs, as the language has them.

use std::collections::{BTreeMap, BTreeSet};

/// Names that are given once each.
#[derive(Default)]
pub(super) struct Unique {
    taken: BTreeSet<String>,
    /// Where to look on for a name that is free.
    next: BTreeMap<String, usize>,
}

impl Unique {
    /// The name, with a number after it if it was there already.
    pub(super) fn name(&mut self, name: String) -> String {
        if self.taken.insert(name.clone()) {
            return name;
        }
        let number = self.next.entry(name.clone()).or_insert(1);
        loop {
            *number += 1;
            let numbered = format!("{name}_{number}");
            if self.taken.insert(numbered.clone()) {
                return numbered;
            }
        }
    }
}

/// A name as the language has them, and none of those that are used for something else.
pub(super) fn identifier(name: &str, used: &[&str]) -> String {
    let legal = |c: char| {
        if c.is_ascii_alphanumeric() {
            c.to_ascii_lowercase()
        } else {
            '_'
        }
    };
    let legal: String = name.chars().map(legal).collect();
    let trimmed = legal.trim_matches('_');
    let starts_with_digit = trimmed.starts_with(|c: char| c.is_ascii_digit());
    if trimmed.is_empty() || starts_with_digit || !is_word(trimmed) || used.contains(&trimmed) {
        let named = format!("material_{trimmed}");
        named.trim_end_matches('_').to_owned()
    } else {
        trimmed.to_owned()
    }
}

/// Is it no word of the language?
fn is_word(name: &str) -> bool {
    let file = impasto_compiler::source::FileId(0);
    let (tokens, problems) = impasto_compiler::lexer::lex(file, name);
    matches!(&tokens[..], [(token, _), ..] if token.kind_name() == "name") && problems.is_empty()
}
