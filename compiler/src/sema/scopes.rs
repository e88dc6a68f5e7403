//! The names in scope of a body. Each is found in one look, however many there are: a body may have
//! as many as its source has room for.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};
use std::rc::Rc;

use super::body::{Binding, Entry};
use crate::source::Span;

/// Scopes within each other.
pub struct Scopes {
    /// What each brings in, innermost last; there is always one.
    entries: Vec<Vec<Entry>>,
    /// By name where its entries are, innermost last. Never iterated.
    places: HashMap<Rc<str>, Vec<Place>, BuildHasherDefault<NameHasher>>,
}

/// FNV-1a: names are short, and it is quick for these.
struct NameHasher(u64);

impl Default for NameHasher {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Hasher for NameHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3);
        }
    }
}

/// A scope, and a position in it.
type Place = (usize, usize);

impl Default for Scopes {
    fn default() -> Self {
        Self {
            entries: vec![Vec::new()],
            places: HashMap::default(),
        }
    }
}

impl Scopes {
    /// Opens a scope within the innermost.
    pub fn open(&mut self) {
        self.entries.push(Vec::new());
    }

    /// Closes the innermost scope; gives what it brought in.
    pub fn close(&mut self) -> Vec<Entry> {
        let closed = self.entries.pop().unwrap_or_default();
        for entry in &closed {
            if let Some(places) = self.places.get_mut(&entry.name) {
                places.pop();
            }
        }
        closed
    }

    /// Brings a name into the innermost scope; gives where that scope has it already.
    pub fn add(&mut self, entry: Entry) -> Option<Span> {
        let innermost = self.entries.len().checked_sub(1)?;
        let place = (innermost, self.entries[innermost].len());
        let first = match self.places.get_mut(&entry.name) {
            Some(places) => {
                let first = places.partition_point(|(scope, _)| *scope < innermost);
                let first = places.get(first).copied();
                places.push(place);
                first
            }
            None => {
                self.places.insert(entry.name.clone(), vec![place]);
                None
            }
        };
        let clash = first.map(|(scope, at)| self.entries[scope][at].span);
        self.entries[innermost].push(entry);
        clash
    }

    /// What a name stands for, and the scope that says so.
    pub fn find(&self, name: &str) -> Option<(usize, Binding)> {
        let (scope, at) = self.place(name)?;
        Some((scope, self.entries[scope][at].binding))
    }

    /// What a name that is read stands for.
    pub fn read(&mut self, name: &str) -> Option<Binding> {
        let (scope, at) = self.place(name)?;
        let entry = &mut self.entries[scope][at];
        entry.used = true;
        Some(entry.binding)
    }

    /// Where the name that a name stands for is defined.
    pub fn defined(&self, name: &str) -> Option<Span> {
        let (scope, at) = self.place(name)?;
        Some(self.entries[scope][at].span)
    }

    fn place(&self, name: &str) -> Option<Place> {
        self.places.get(name)?.last().copied()
    }

    /// How many scopes are open.
    pub fn depth(&self) -> usize {
        self.entries.len()
    }

    /// How many names there are.
    pub fn names(&self) -> usize {
        self.entries.iter().map(Vec::len).sum()
    }

    /// Everything in scope, innermost last.
    pub fn entries(&self) -> impl Iterator<Item = &Entry> {
        self.entries.iter().flatten()
    }

    /// Lets everything in scope stay unread without a warning.
    pub fn watch_none(&mut self) {
        let all = self.entries.iter_mut().flatten();
        all.for_each(|entry| entry.watched = false);
    }
}
