//! What is connected to what: scopes, the source of every input, and an order in which nodes can be written.
//!
//! A graph that stands for itself is one scope. A graph that defines a node is a scope for each node of that kind, whose
//! inputs are those of the node. All walks are loops: a chain of nodes may be as long as a document.

use std::collections::HashMap;

use impasto_compiler::diag::nearest;

use crate::error::ImportError;
use crate::mtlx::document::{Document, Id, ROOT};
use crate::mtlx::types::Type;

/// A scope, by its place in the list.
pub(crate) type ScopeId = u32;

/// The scope of the document.
pub(crate) const TOP: ScopeId = 0;

/// A node in a scope.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Key {
    pub scope: ScopeId,
    pub node: Id,
}

/// Most nodes that a document grows to where its definitions are expanded.
const MOST_NODES: usize = 200_000;
/// Most steps from an input to what it is connected to, through interfaces.
const MOST_STEPS: usize = 1_000;
/// Most of these steps in all.
const MOST_STEPS_IN_ALL: usize = 20_000_000;

/// What an input is connected to in the end.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Source {
    /// An output of a node that is in the table of nodes; the first of several where none is named.
    Node(Key, Option<String>),
    /// A value that is written at this element.
    Value(Id),
    /// An input of a graph that stands for itself, with a value: a parameter.
    Parameter(Id),
    /// A property of the geometry, such as `UV0`.
    Geometry(String),
    /// Nothing.
    Nothing,
}

#[derive(Clone, Debug)]
struct Scope {
    /// The graph, or the document.
    graph: Id,
    /// The node whose definition it is, and the definition.
    instance: Option<(Key, Id)>,
}

/// The graphs of a document.
#[derive(Debug)]
pub(crate) struct Graphs<'a> {
    pub document: &'a Document,
    scopes: Vec<Scope>,
    plain: HashMap<Id, ScopeId>,
    instances: HashMap<Key, ScopeId>,
    definitions: HashMap<&'a str, Vec<Id>>,
    implementations: HashMap<&'a str, Id>,
    steps: usize,
}

impl<'a> Graphs<'a> {
    pub fn new(document: &'a Document) -> Self {
        let mut definitions: HashMap<&str, Vec<Id>> = HashMap::new();
        let mut implementations = HashMap::new();
        for id in document.top() {
            match document.category(id) {
                "nodedef" => {
                    let node = document.attribute(id, "node");
                    let node = node.or(document.attribute(id, "nodename"));
                    definitions
                        .entry(node.unwrap_or_default())
                        .or_default()
                        .push(id);
                }
                "nodegraph" => {
                    if let Some(of) = document.attribute(id, "nodedef") {
                        implementations.entry(of).or_insert(id);
                    }
                }
                "implementation" => {
                    let of = document.attribute(id, "nodedef");
                    let graph = document.attribute(id, "nodegraph");
                    let graph = graph.and_then(|graph| document.child(ROOT, graph));
                    if let (Some(of), Some(graph)) = (of, graph) {
                        implementations.insert(of, graph);
                    }
                }
                _ => {}
            }
        }
        Self {
            document,
            scopes: vec![Scope {
                graph: ROOT,
                instance: None,
            }],
            plain: HashMap::new(),
            instances: HashMap::new(),
            definitions,
            implementations,
            steps: 0,
        }
    }

    /// The scope of a graph that stands for itself.
    pub fn plain_scope(&mut self, graph: Id) -> ScopeId {
        let next = self.scopes.len() as ScopeId;
        let scope = *self.plain.entry(graph).or_insert(next);
        if scope == next {
            self.scopes.push(Scope {
                graph,
                instance: None,
            });
        }
        scope
    }

    /// The nodes whose definitions a scope is in, outermost first.
    pub fn instances(&self, scope: ScopeId) -> Vec<Id> {
        let mut nodes = Vec::new();
        let mut at = scope;
        while let Some((key, _)) = self.scopes[at as usize].instance {
            nodes.push(key.node);
            at = key.scope;
        }
        nodes.reverse();
        nodes
    }

    /// The definition of a node in this document, if it has one.
    pub fn definition(&self, node: Id) -> Option<Id> {
        let document = self.document;
        let of_kind = self.definitions.get(document.category(node))?;
        let asked = document.attribute(node, "nodedef");
        if let Some(asked) = asked.and_then(|asked| document.child(ROOT, asked)) {
            return of_kind.contains(&asked).then_some(asked);
        }
        let ty = document.attribute(node, "type").unwrap_or_default();
        let fits = |definition: &&Id| {
            let mut outputs = document.children(**definition, "output");
            let several = ty == "multioutput";
            several || outputs.any(|o| document.attribute(o, "type").unwrap_or_default() == ty)
        };
        of_kind.iter().find(fits).or(of_kind.first()).copied()
    }

    /// The graph that says what a definition does.
    pub fn implementation(&self, definition: Id) -> Option<Id> {
        self.implementations
            .get(self.document.name(definition))
            .copied()
    }

    /// The scope within a node that a graph of the document defines; nothing for other nodes.
    fn inner(&mut self, key: Key) -> Result<Option<ScopeId>, ImportError> {
        if let Some(scope) = self.instances.get(&key) {
            return Ok(Some(*scope));
        }
        let Some(definition) = self.definition(key.node) else {
            return Ok(None);
        };
        let document = self.document;
        let Some(graph) = self.implementation(definition) else {
            let (name, category) = (document.name(key.node), document.category(key.node));
            let message = format!(
                "the node `{name}` is a `{category}`, whose definition `{}` has no graph",
                document.name(definition)
            );
            let error = document.error(key.node, message);
            let error = error.expected("a nodegraph with the attribute `nodedef`");
            return Err(
                error.hint("code of another language cannot be imported: write it as a graph")
            );
        };
        if self.is_within(key.scope, graph) {
            let name = document.name(graph);
            let message = format!("the graph `{name}` contains a node that it defines itself");
            return Err(document.error(key.node, message).hint("take it out"));
        }
        if self.scopes.len() >= MOST_NODES {
            return Err(self.too_many(key.node));
        }
        let scope = self.scopes.len() as ScopeId;
        self.scopes.push(Scope {
            graph,
            instance: Some((key, definition)),
        });
        self.instances.insert(key, scope);
        Ok(Some(scope))
    }

    fn is_within(&self, scope: ScopeId, graph: Id) -> bool {
        let mut at = scope;
        loop {
            let scope = &self.scopes[at as usize];
            if scope.graph == graph {
                return true;
            }
            match scope.instance {
                Some((key, _)) => at = key.scope,
                None => return false,
            }
        }
    }

    fn too_many(&self, at: Id) -> ImportError {
        let message = format!("the document grows to more than {MOST_NODES} nodes");
        let error = self.document.error(at, message);
        error.hint("import its materials apart, or define fewer nodes by others")
    }

    /// What an element that may be connected is connected to: an input, or the output of a graph.
    pub fn source(&mut self, scope: ScopeId, element: Id) -> Result<Source, ImportError> {
        let (mut scope, mut at) = (scope, element);
        for _ in 0..MOST_STEPS {
            self.steps += 1;
            if self.steps > MOST_STEPS_IN_ALL {
                return Err(self.too_many(element));
            }
            match self.step(scope, at)? {
                Step::To(next_scope, next) => (scope, at) = (next_scope, next),
                Step::Node(key, output) => {
                    let Some(inner) = self.inner(key)? else {
                        return Ok(Source::Node(key, output));
                    };
                    let graph = self.scopes[inner as usize].graph;
                    (scope, at) = (inner, self.output(graph, output.as_deref(), at)?);
                }
                Step::End(source) => return Ok(source),
            }
        }
        let message = format!("`{}` is connected to itself", self.document.name(element));
        Err(self
            .document
            .error(element, message)
            .hint("break the circle"))
    }

    /// A node: itself, or the source of the first output of its definition.
    pub fn node_source(&mut self, key: Key) -> Result<Source, ImportError> {
        let Some(inner) = self.inner(key)? else {
            return Ok(Source::Node(key, None));
        };
        let graph = self.scopes[inner as usize].graph;
        let output = self.output(graph, None, key.node)?;
        self.source(inner, output)
    }

    /// One step from an element along its connection.
    fn step(&mut self, scope: ScopeId, at: Id) -> Result<Step, ImportError> {
        let document = self.document;
        let graph = self.scopes[scope as usize].graph;
        let output = document.attribute(at, "output");
        if let Some(name) = document.attribute(at, "interfacename") {
            return self.interface(scope, at, name);
        }
        if let Some(name) = document.attribute(at, "nodegraph") {
            // A graph stands in the document; inner graphs stand in graphs.
            let here = document.child(graph, name).or(document.child(ROOT, name));
            let found = here.filter(|id| document.category(*id) == "nodegraph");
            let found = found.ok_or_else(|| self.unknown(at, graph, name, "nodegraph"))?;
            let scope = self.plain_scope(found);
            return Ok(Step::To(scope, self.output(found, output, at)?));
        }
        if let Some(name) = document.attribute(at, "nodename") {
            let found = document.child(graph, name);
            let found = found.ok_or_else(|| self.unknown(at, graph, name, "node"))?;
            return Ok(match document.category(found) {
                "nodegraph" => {
                    let scope = self.plain_scope(found);
                    Step::To(scope, self.output(found, output, at)?)
                }
                "output" => Step::To(scope, found),
                _ => Step::Node(Key { scope, node: found }, output.map(str::to_owned)),
            });
        }
        if let Some(name) = output.filter(|_| document.category(at) != "output") {
            let found = document.child(graph, name);
            let found = found.filter(|id| document.category(*id) == "output");
            let found = found.ok_or_else(|| self.unknown(at, graph, name, "output"))?;
            return Ok(Step::To(scope, found));
        }
        let is_interface = document.category(document.element(at).parent) == "nodegraph";
        Ok(Step::End(
            match (
                document.attribute(at, "value"),
                document.attribute(at, "defaultgeomprop"),
            ) {
                (Some(_), _) if is_interface && document.category(at) != "output" => {
                    Source::Parameter(at)
                }
                (Some(_), _) => Source::Value(at),
                (None, Some(property)) => Source::Geometry(property.to_owned()),
                // A text may be empty, and a picture may have no file yet.
                (None, None) => match document.attribute(at, "type").and_then(Type::of) {
                    Some(Type::Text) if is_interface => Source::Value(at),
                    _ => Source::Nothing,
                },
            },
        ))
    }

    /// Where the input `name` of the interface of a scope has its value.
    fn interface(&mut self, scope: ScopeId, at: Id, name: &str) -> Result<Step, ImportError> {
        let document = self.document;
        let Scope { graph, instance } = self.scopes[scope as usize].clone();
        let Some((key, definition)) = instance else {
            let found = document.input(graph, name);
            let found = found.ok_or_else(|| self.no_input(at, graph, name))?;
            return Ok(Step::To(TOP, found));
        };
        if let Some(given) = document.input(key.node, name) {
            return Ok(Step::To(key.scope, given));
        }
        match document
            .input(definition, name)
            .or(document.input(graph, name))
        {
            // Values of definitions are defaults, and no parameters of the material.
            Some(default) => Ok(Step::End(
                match (
                    document.attribute(default, "value"),
                    document.attribute(default, "defaultgeomprop"),
                ) {
                    (Some(_), _) => Source::Value(default),
                    (None, Some(property)) => Source::Geometry(property.to_owned()),
                    (None, None) => Source::Nothing,
                },
            )),
            None => Err(self.no_input(at, definition, name)),
        }
    }

    /// The output of a graph: that of the name, or the only one.
    fn output(&self, graph: Id, name: Option<&str>, at: Id) -> Result<Id, ImportError> {
        let document = self.document;
        let named = name.and_then(|name| document.child(graph, name));
        if let Some(output) = named.filter(|id| document.category(*id) == "output") {
            return Ok(output);
        }
        let mut outputs = document.children(graph, "output");
        match (name, outputs.next(), outputs.next()) {
            // Definitions may have one output that their graph calls otherwise.
            (Some("out"), Some(only), None) | (None, Some(only), _) => Ok(only),
            (name, _, _) => {
                let outputs = document.children(graph, "output");
                let names: Vec<&str> = outputs.map(|id| document.name(id)).collect();
                let message = match name {
                    Some(name) => format!("`{}` has no output `{name}`", document.name(graph)),
                    None => format!("`{}` has no output", document.name(graph)),
                };
                let near = name.and_then(|name| nearest(name, names.iter().copied()));
                let error = document.error(at, message);
                Err(error.maybe_hint(near.map(|near| format!("did you mean `{near}`?"))))
            }
        }
    }

    fn unknown(&self, at: Id, graph: Id, name: &str, what: &str) -> ImportError {
        let document = self.document;
        let here = match graph {
            ROOT => "the document".to_owned(),
            graph => format!("`{}`", document.name(graph)),
        };
        let message = format!("{here} has no {what} `{name}`");
        let near = nearest(name, document.child_names(graph));
        let error = document.error(at, message);
        error.maybe_hint(near.map(|near| format!("did you mean `{near}`?")))
    }

    fn no_input(&self, at: Id, of: Id, name: &str) -> ImportError {
        let document = self.document;
        let message = format!("`{}` has no input `{name}`", document.name(of));
        let names: Vec<&str> = document.inputs(of).map(|id| document.name(id)).collect();
        let near = nearest(name, names);
        let error = document.error(at, message);
        error.maybe_hint(near.map(|near| format!("did you mean `{near}`?")))
    }

    /// The nodes that `from` needs, each after those that it needs itself, and how often each is used.
    ///
    /// # Errors
    /// Connections to nothing, and nodes that need themselves.
    pub fn order(&mut self, from: &[Key]) -> Result<Order, ImportError> {
        let mut order = Order::default();
        let mut state: HashMap<Key, bool> = HashMap::new();
        for first in from {
            *order.uses.entry(*first).or_insert(0) += 1;
            if state.contains_key(first) {
                continue;
            }
            state.insert(*first, false);
            let mut stack = vec![(*first, self.needed(*first)?, 0usize)];
            while let Some((key, needed, next)) = stack.last_mut() {
                let Some(needed) = needed.get(*next).copied() else {
                    state.insert(*key, true);
                    order.nodes.push(*key);
                    stack.pop();
                    continue;
                };
                *next += 1;
                *order.uses.entry(needed).or_insert(0) += 1;
                match state.get(&needed) {
                    Some(true) => {}
                    Some(false) => {
                        let names = stack.iter().map(|(key, _, _)| *key);
                        let circle: Vec<Key> = names.skip_while(|key| *key != needed).collect();
                        return Err(self.circle(&circle));
                    }
                    None => {
                        if state.len() >= MOST_NODES {
                            return Err(self.too_many(needed.node));
                        }
                        state.insert(needed, false);
                        let below = self.needed(needed)?;
                        stack.push((needed, below, 0));
                    }
                }
            }
        }
        Ok(order)
    }

    /// The nodes that a node's inputs are connected to.
    fn needed(&mut self, key: Key) -> Result<Vec<Key>, ImportError> {
        let inputs: Vec<Id> = self.document.inputs(key.node).collect();
        let mut needed = Vec::new();
        for input in inputs {
            if let Source::Node(key, _) = self.source(key.scope, input)? {
                needed.push(key);
            }
        }
        Ok(needed)
    }

    fn circle(&self, circle: &[Key]) -> ImportError {
        const MOST_NAMED: usize = 12;
        let document = self.document;
        let names = circle
            .iter()
            .take(MOST_NAMED)
            .map(|key| document.name(key.node));
        let mut names: Vec<String> = names.map(|name| format!("`{name}`")).collect();
        if circle.len() > MOST_NAMED {
            names.push(format!("{} more", circle.len() - MOST_NAMED));
        }
        let message = format!("nodes are connected in a circle: {}", names.join(", "));
        let at = circle.first().map_or(ROOT, |key| key.node);
        document.error(at, message).hint("disconnect one of them")
    }

    /// A token `[NAME]` of file names: of the node, its graph, or the definition whose graph that is.
    pub fn token(&self, key: Key, name: &str) -> Option<&'a str> {
        let document = self.document;
        let value = |of: Id| {
            let token = document
                .children(of, "token")
                .find(|id| document.name(*id) == name);
            token.and_then(|token| document.attribute(token, "value"))
        };
        let mut key = key;
        loop {
            let Scope { graph, instance } = &self.scopes[key.scope as usize];
            let found = value(key.node).or_else(|| value(*graph));
            match (found, instance) {
                (Some(value), _) => return Some(value),
                (None, Some((outer, definition))) => {
                    if let Some(value) = value(outer.node).or_else(|| value(*definition)) {
                        return Some(value);
                    }
                    key = *outer;
                }
                (None, None) => return None,
            }
        }
    }
}

enum Step {
    To(ScopeId, Id),
    Node(Key, Option<String>),
    End(Source),
}

/// Nodes in an order in which each comes after what it needs.
#[derive(Debug, Default)]
pub(crate) struct Order {
    pub nodes: Vec<Key>,
    /// How many inputs each is connected to.
    pub uses: HashMap<Key, u32>,
}
