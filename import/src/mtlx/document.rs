//! A document as it is written: elements with their attributes and places, of all files that belong to it.
//!
//! Nothing here knows what an element means. Elements lie in one list and name each other by index.

use std::collections::HashMap;
use std::sync::Arc;

use crate::error::{ImportError, Warning};

/// An element, by its place in the list.
pub(crate) type Id = u32;

/// The element of the document itself.
pub(crate) const ROOT: Id = 0;

/// One element.
#[derive(Debug)]
pub(crate) struct Element {
    /// What kind it is: `input`, `nodegraph`, or the category of a node.
    pub category: String,
    /// Its attributes, in the order of the file.
    pub attributes: Vec<(String, String)>,
    pub children: Vec<Id>,
    pub parent: Id,
    /// The file, by its place in [`Document::files`].
    pub file: u32,
    /// The line, from 1.
    pub line: u32,
    /// The bytes of its start tag in the file: the first, and one past the last.
    pub tag: (u32, u32),
}

/// All elements of a document and of what it includes.
#[derive(Debug, Default)]
pub(crate) struct Document {
    pub elements: Vec<Element>,
    /// The paths of the files that it is made of; the first is the document's own.
    pub files: Vec<String>,
    /// Their texts.
    pub texts: Vec<Arc<str>>,
    names: HashMap<Id, HashMap<String, Id>>,
    inputs: HashMap<Id, HashMap<String, Id>>,
}

impl Document {
    /// The element `id`.
    pub fn element(&self, id: Id) -> &Element {
        &self.elements[id as usize]
    }

    /// An attribute; an empty one counts as missing.
    pub fn attribute(&self, id: Id, name: &str) -> Option<&str> {
        let attributes = &self.element(id).attributes;
        let found = attributes.iter().find(|(key, _)| key == name);
        found
            .map(|(_, value)| value.trim())
            .filter(|v| !v.is_empty())
    }

    /// The name, or nothing.
    pub fn name(&self, id: Id) -> &str {
        self.attribute(id, "name").unwrap_or_default()
    }

    /// The category.
    pub fn category(&self, id: Id) -> &str {
        &self.element(id).category
    }

    /// The children of a category.
    pub fn children<'a>(&'a self, id: Id, category: &'a str) -> impl Iterator<Item = Id> + 'a {
        let children = self.element(id).children.iter().copied();
        children.filter(move |child| self.category(*child) == category)
    }

    /// The inputs of an element: `parameter` is what they were called before version 1.38.
    pub fn inputs(&self, id: Id) -> impl Iterator<Item = Id> + '_ {
        let children = self.element(id).children.iter().copied();
        children.filter(|child| matches!(self.category(*child), "input" | "parameter"))
    }

    /// The input of a name.
    pub fn input(&self, id: Id, name: &str) -> Option<Id> {
        self.inputs
            .get(&id)
            .and_then(|names| names.get(name))
            .copied()
    }

    /// The child of a name that is no input: a node, an output or a graph.
    pub fn child(&self, id: Id, name: &str) -> Option<Id> {
        self.names
            .get(&id)
            .and_then(|names| names.get(name))
            .copied()
    }

    /// Names that [`Document::child`] finds, sorted.
    pub fn child_names(&self, id: Id) -> Vec<&str> {
        let names = self.names.get(&id).into_iter().flatten();
        let mut names: Vec<&str> = names.map(|(name, _)| name.as_str()).collect();
        names.sort_unstable();
        names
    }

    /// What an element stands in: a graph, a node, or the document, whichever file of it.
    pub fn scope_of(&self, id: Id) -> Id {
        let parent = self.element(id).parent;
        if self.category(parent) == "materialx" {
            ROOT
        } else {
            parent
        }
    }

    /// What stands in the document itself, in the order of the files and within them.
    pub fn top(&self) -> impl Iterator<Item = Id> + '_ {
        let elements = 1..self.elements.len() as Id;
        elements.filter(|id| self.scope_of(*id) == ROOT && self.category(*id) != "materialx")
    }

    /// An attribute of the element, or else of what it stands in, up to the document and the file that included it.
    pub fn inherited(&self, id: Id, name: &str) -> Option<&str> {
        let mut at = id;
        loop {
            if let Some(value) = self.attribute(at, name) {
                return Some(value);
            }
            if at == ROOT {
                return None;
            }
            at = self.element(at).parent;
        }
    }

    /// An error about an element.
    pub fn error(&self, id: Id, message: impl Into<String>) -> ImportError {
        let element = self.element(id);
        ImportError::new(self.files[element.file as usize].clone(), message).line(element.line)
    }

    /// A warning about an element.
    pub fn warning(&self, id: Id, message: impl Into<String>) -> Warning {
        let element = self.element(id);
        Warning {
            path: self.files[element.file as usize].clone(),
            line: Some(element.line),
            message: message.into(),
        }
    }

    /// The error about two elements of one name.
    fn second(&self, what: &str, id: Id, first: Id) -> ImportError {
        let (name, line) = (self.name(id), self.element(first).line);
        let message = format!("a second {what} is called `{name}`; the first is in line {line}");
        self.error(id, message).hint("rename one of them")
    }

    /// Finds children by name from now on.
    ///
    /// # Errors
    /// Two children have one name.
    pub fn index(&mut self) -> Result<(), Vec<ImportError>> {
        let mut errors = Vec::new();
        for id in 0..self.elements.len() as Id {
            let element = self.element(id);
            if matches!(element.category.as_str(), "input" | "parameter") {
                let (name, parent) = (self.name(id).to_owned(), element.parent);
                let inputs = self.inputs.entry(parent).or_default();
                let first = *inputs.entry(name.clone()).or_insert(id);
                if first != id && !name.is_empty() {
                    errors.push(self.second("input", id, first));
                }
                continue;
            }
            if element.category == "token" || id == ROOT {
                continue;
            }
            let (name, parent) = (self.name(id).to_owned(), self.scope_of(id));
            if name.is_empty() || element.category == "materialx" {
                continue;
            }
            let names = self.names.entry(parent).or_default();
            if let Some(first) = names.get(&name).copied() {
                errors.push(self.second("element", id, first));
            } else {
                names.insert(name, id);
            }
        }
        if errors.is_empty() {
            Ok(())
        } else {
            Err(errors)
        }
    }
}
