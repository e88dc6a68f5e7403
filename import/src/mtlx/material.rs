//! One material while it is written: its parameters, and a statement for each node that deserves a name.

use std::collections::{HashMap, HashSet};

use impasto_compiler::diag::nearest;

use crate::error::ImportError;
use crate::imported::Options;
use crate::mtlx::call::Call;
use crate::mtlx::document::Id;
use crate::mtlx::graph::{Graphs, Key, ScopeId, Source, TOP};
use crate::mtlx::names::{Names, is_given};
use crate::mtlx::nodes::{self, Made};
use crate::mtlx::origin::{Mark, Traced};
use crate::mtlx::source::{SourceText, words};
use crate::mtlx::text;
use crate::mtlx::types::{Literal, Type};
use crate::mtlx::upgrade;
use crate::mtlx::value::Value;
use crate::mtlx::{color_spaces, parameters, units};

/// Longer expressions get a name.
const MOST_INLINE: usize = 72;
/// The longest expression; longer ones would be text that nobody reads and that takes long to look through.
const MOST_EXPRESSION: usize = 1 << 16;

/// A material that is being written.
pub(crate) struct Builder<'b, 'a> {
    pub graphs: &'b mut Graphs<'a>,
    pub source: &'b mut SourceText,
    pub options: &'b Options,
    /// The parameter that says how long a unit of the scene is, if there is need of one.
    pub scene_unit: Option<String>,
    names: Names,
    /// By element: the order of the document.
    params: Vec<(Id, String)>,
    statements: Vec<Statement>,
    values: HashMap<Key, Made>,
    parameters: HashMap<Id, Value>,
    uses: HashMap<Key, u32>,
    /// The node that is being written.
    current: Option<Key>,
}

/// A value with a name.
struct Statement {
    name: String,
    text: String,
    /// The node that it is of.
    key: Option<Key>,
}

impl<'b, 'a> Builder<'b, 'a> {
    pub fn new(
        graphs: &'b mut Graphs<'a>,
        source: &'b mut SourceText,
        options: &'b Options,
    ) -> Self {
        let names = source.names.clone();
        Self {
            graphs,
            source,
            options,
            scene_unit: None,
            names,
            params: Vec::new(),
            statements: Vec::new(),
            values: HashMap::new(),
            parameters: HashMap::new(),
            uses: HashMap::new(),
            current: None,
        }
    }

    /// Writes the nodes that `from` needs, and `from`.
    ///
    /// # Errors
    /// All nodes without a counterpart; or the first node that is wrong in another way.
    pub fn write(&mut self, from: &[Key]) -> Result<(), Vec<ImportError>> {
        let order = self.graphs.order(from).map_err(|error| vec![error])?;
        self.uses = order.uses;
        let missing = order.nodes.iter().filter_map(|key| self.missing(*key));
        let missing: Vec<ImportError> = missing.collect();
        if !missing.is_empty() {
            return Err(missing);
        }
        for key in order.nodes {
            self.current = Some(key);
            let made = self.made(key).map_err(|error| vec![error])?;
            let made = self.settled(key, made);
            if let Some(long) = made.iter().find(|(_, v)| v.text.len() > MOST_EXPRESSION) {
                let message = format!("`{}` is an expression that is too long", long.0);
                return Err(vec![self.graphs.document.error(key.node, message)]);
            }
            self.values.insert(key, made);
        }
        Ok(())
    }

    /// The error about a node that has no row.
    fn missing(&self, key: Key) -> Option<ImportError> {
        let document = self.graphs.document;
        let category = upgrade::category(document, key.node);
        if nodes::find(&category).is_some() {
            return None;
        }
        let message = format!(
            "the node `{}` is a `{category}`, which has no counterpart in Impasto",
            document.name(key.node)
        );
        let error = document.error(key.node, message);
        let error = error
            .expected("a node of docs/materialx.md, or one that the document defines by a graph");
        let known = nodes::MISSING
            .iter()
            .find(|missing| missing.category == category);
        let near = nearest(&category, nodes::node_rows().map(|row| row.category));
        Some(error.hint(match (known, near) {
            (Some(missing), _) => missing.reason.to_owned(),
            (None, Some(near)) => format!("did you mean `{near}`?"),
            (None, None) => "include the file that defines it".to_owned(),
        }))
    }

    fn made(&mut self, key: Key) -> Result<Made, ImportError> {
        let document = self.graphs.document;
        let category = upgrade::category(document, key.node);
        let written = document.attribute(key.node, "type");
        let ty = written
            .map_or(Some(Type::Several), Type::of)
            .ok_or_else(|| {
                let written = written.unwrap_or_default();
                let message = format!(
                    "`{}` has the unknown type `{written}`",
                    document.name(key.node)
                );
                let near = nearest(written, Type::names());
                let error = document.error(key.node, message);
                error.maybe_hint(near.map(|near| format!("did you mean `{near}`?")))
            })?;
        let Some(row) = nodes::find(&category) else {
            return Err(document.error(key.node, format!("no row for `{category}`")));
        };
        Call {
            builder: self,
            key,
            row,
            ty,
        }
        .made()
    }

    /// Gives a name to what is used more than once, or was named by a person.
    fn settled(&mut self, key: Key, mut made: Made) -> Made {
        let [(_, value)] = made.as_mut_slice() else {
            return made;
        };
        let document = self.graphs.document;
        let is_value = !value.ty.impasto().is_empty() && value.ty != Type::Filename;
        if !is_value || value.text.is_empty() || value.ty == Type::Vdf {
            return made;
        }
        let category = document.category(key.node);
        let given = is_given(document.name(key.node), category);
        let used = self.uses.get(&key).copied().unwrap_or(0);
        let is_simple = text::is_simple(&value.text);
        let wanted = if is_simple {
            given && category == "constant"
        } else {
            given || used > 1 || value.text.len() > MOST_INLINE
        };
        if wanted {
            if category == "position" {
                *value = Value::new(value.ty, value.plain());
            }
            let name = self.node_name(key);
            value.text = self.bind(&name, &value.text.clone());
            if category != "constant" {
                value.literal = None;
            }
        }
        made
    }

    /// The name of a node, behind those of the nodes whose definitions it is in.
    pub fn node_name(&self, key: Key) -> String {
        let nodes = self.graphs.instances(key.scope).into_iter();
        let names = nodes
            .chain([key.node])
            .map(|node| self.graphs.document.name(node));
        names.collect::<Vec<_>>().join("_")
    }

    /// A name like this one that nothing of the material has.
    pub fn unique(&mut self, name: &str) -> String {
        self.names.unique(name, "value")
    }

    /// Names an expression by a statement.
    pub fn bind(&mut self, name: &str, text: &str) -> String {
        let name = self.unique(name);
        self.statements.push(Statement {
            name: name.clone(),
            text: text.to_owned(),
            key: self.current,
        });
        name
    }

    /// The value of an element that may be connected; nothing if it has none. `declared` is the type that it has.
    pub fn value_at(
        &mut self,
        scope: ScopeId,
        element: Id,
        declared: Option<Type>,
    ) -> Result<Option<Value>, ImportError> {
        let document = self.graphs.document;
        let value = match self.graphs.source(scope, element)? {
            Source::Nothing => return Ok(None),
            Source::Geometry(property) => self.geometry(&property, element)?,
            Source::Value(at) => {
                let own = document.attribute(at, "type").and_then(Type::of);
                let Some(ty) = own.or(declared) else {
                    let message = format!("`{}` has no type", document.name(element));
                    return Err(document
                        .error(element, message)
                        .expected("the attribute `type`"));
                };
                self.literal(scope, at, ty)?
            }
            Source::Parameter(at) => self.parameter(scope, at)?,
            Source::Node(key, output) => self.output(element, key, output.as_deref())?,
        };
        if let Some(declared) = declared.filter(|declared| *declared != value.ty) {
            // Integers stand where floats may; documents of old versions call outputs of several `multioutput`.
            if !(declared == Type::Float && value.ty == Type::Integer) && declared != Type::Several
            {
                let message = format!(
                    "`{}` has the type `{}`, but is connected to a `{}`",
                    document.name(element),
                    declared.name(),
                    value.ty.name()
                );
                return Err(document
                    .error(element, message)
                    .hint("put a `convert` between them"));
            }
        }
        Ok(Some(value))
    }

    fn output(&self, at: Id, key: Key, output: Option<&str>) -> Result<Value, ImportError> {
        let document = self.graphs.document;
        let made = self.made_of(key);
        let found = match output {
            None => made.first(),
            Some(name) => made
                .iter()
                .find(|(known, _)| *known == name)
                .or(match made {
                    [only] if name == "out" || only.0 == "out" => Some(only),
                    _ => None,
                }),
        };
        if let Some((_, value)) = found {
            return Ok(value.clone());
        }
        let output = output.unwrap_or("out");
        let message = format!("`{}` has no output `{output}`", document.name(key.node));
        let names: Vec<String> = made.iter().map(|(name, _)| format!("`{name}`")).collect();
        Err(document.error(at, message).expected(names.join(", ")))
    }

    /// The outputs of a node that is written.
    pub fn made_of(&self, key: Key) -> &[(&'static str, Value)] {
        self.values.get(&key).map(Vec::as_slice).unwrap_or_default()
    }

    /// The first output of a node that is written.
    pub fn first_output(&self, key: Key) -> Option<Value> {
        self.made_of(key).first().map(|(_, value)| value.clone())
    }

    /// A value that is written at an element.
    fn literal(&mut self, scope: ScopeId, at: Id, ty: Type) -> Result<Value, ImportError> {
        let document = self.graphs.document;
        let written = document.attribute(at, "value").unwrap_or_default();
        if ty == Type::Filename {
            return self.file(scope, at, written);
        }
        let mut literal = Literal::read(written, ty).map_err(|expected| {
            let message = format!("`{}` has the value `{written}`", document.name(at));
            document
                .error(at, message)
                .expected(format!("{expected}, for the type `{}`", ty.name()))
        })?;
        if let (Literal::Numbers(numbers), Some(size)) =
            (&mut literal, units::stated(document, at)?)
        {
            numbers.iter_mut().for_each(|number| *number *= size);
        }
        if !matches!(ty, Type::Color3 | Type::Color4) {
            return Ok(Value::of(ty, literal));
        }
        let space = document.inherited(at, "colorspace");
        let (value, unknown) = color_spaces::value(ty, literal, space);
        if let Some(space) = unknown {
            let message = format!(
                "the color space `{space}` is not known; values are taken as linear Rec. 709"
            );
            self.source.warn(document.warning(at, message));
        }
        Ok(Value {
            text: self.source.names_in(&value.text),
            ..value
        })
    }

    /// A picture that an element names.
    fn file(&mut self, scope: ScopeId, at: Id, written: &str) -> Result<Value, ImportError> {
        let document = self.graphs.document;
        let holder = Key {
            scope,
            node: document.element(at).parent,
        };
        let mut name = String::new();
        let mut rest = written;
        while let Some((before, after)) = rest.split_once('[') {
            let Some((token, behind)) = after.split_once(']') else {
                break;
            };
            name.push_str(before);
            match self.graphs.token(holder, token) {
                Some(value) => name.push_str(value),
                None => name.push_str(&format!("[{token}]")),
            }
            rest = behind;
        }
        name.push_str(rest);
        for token in ["<UVTILE>", "<AOVS>"] {
            if name.contains(token) {
                let message = format!("the picture `{name}` has the token `{token}`");
                return Err(document
                    .error(at, message)
                    .expected("`<UDIM>`, or no token"));
            }
        }
        if name.trim().is_empty() {
            let message = format!("`{}` names no picture", document.name(at));
            return Err(document
                .error(at, message)
                .expected("the path of a picture"));
        }
        let prefix = document.inherited(at, "fileprefix").unwrap_or_default();
        let base = &document.files[document.element(at).file as usize];
        let found =
            self.source
                .texture(base, &format!("{prefix}{name}"), self.options.allow_outside);
        let texture = found.map_err(|message| {
            let error = document.error(at, message);
            error.hint("`impasto import --allow-outside` reads it, if you trust the document")
        })?;
        let message = format!("the picture `{}` is missing", texture.found);
        let warning = document.warning(at, message);
        self.source.named.entry(texture.found).or_insert(warning);
        Ok(Value::of(Type::Filename, Literal::Text(texture.written)))
    }

    /// An input of a graph as a parameter of the material.
    fn parameter(&mut self, scope: ScopeId, at: Id) -> Result<Value, ImportError> {
        if let Some(value) = self.parameters.get(&at) {
            return Ok(value.clone());
        }
        let document = self.graphs.document;
        let written = document.attribute(at, "type").unwrap_or_default();
        let Some(ty) = Type::of(written) else {
            let message = format!("`{}` has the unknown type `{written}`", document.name(at));
            return Err(document.error(at, message));
        };
        let value = self.literal(scope, at, ty)?;
        let declarable = ty.is_numeric() || matches!(ty, Type::Boolean | Type::Filename);
        if !declarable {
            return Ok(value);
        }
        let name = self.names.unique(document.name(at), "parameter");
        let text = parameters::declaration(document, at, &name, ty, &value);
        self.params.push((at, text));
        let value = Value::new(ty, name);
        self.parameters.insert(at, value.clone());
        Ok(value)
    }

    /// A property of the geometry.
    pub fn geometry(&self, property: &str, at: Id) -> Result<Value, ImportError> {
        Ok(match property {
            "UV0" | "st" | "uv" | "st0" | "st_0" | "uv0" | "map1" => {
                Value::new(Type::Vector2, "uv")
            }
            "UV1" | "st1" | "st_1" | "uv1" | "uv_1" | "map2" => Value::new(Type::Vector2, "uv1"),
            "Pworld" => Value::geometric("position"),
            "Pobject" | "Pmodel" => Value::geometric("object_position"),
            "Nworld" => Value::geometric("normal"),
            "Nobject" | "Nmodel" => Value::geometric("object_normal"),
            "Tworld" => Value::geometric("tangent"),
            "Tobject" | "Tmodel" => Value::geometric("object_from_world(tangent)"),
            "Bworld" => Value::geometric("cross(normal, tangent)"),
            "Bobject" | "Bmodel" => Value::geometric("object_from_world(cross(normal, tangent))"),
            "Vworld" => Value::geometric("-view"),
            "displayColor" | "Cd" => Value::new(Type::Color3, "vertex_color"),
            _ => {
                let message = format!("the geometry has no property `{property}` in Impasto");
                let error = self.graphs.document.error(at, message);
                return Err(error.expected(
                    "UV0, UV1, st, uv, displayColor, Pworld, Pobject, Nworld, Nobject, Tworld, Tobject or Bworld",
                ));
            }
        })
    }

    /// What the color space of a picture is: said where its path is, or around it.
    pub fn color_space(
        &mut self,
        scope: ScopeId,
        element: Id,
    ) -> Result<Option<&'a str>, ImportError> {
        let document = self.graphs.document;
        if let Some(space) = document.attribute(element, "colorspace") {
            return Ok(Some(space));
        }
        Ok(match self.graphs.source(scope, element)? {
            Source::Value(at) | Source::Parameter(at) => document.inherited(at, "colorspace"),
            _ => None,
        })
    }

    /// The material of an element, which ends with assignments: outputs and their values, of a node.
    pub fn finished(
        mut self,
        (name, docs): (&str, &str),
        element: Id,
        assignments: &[(&str, String)],
        shown: Option<Key>,
    ) -> Traced {
        let values = assignments.iter().flat_map(|(_, text)| words(text));
        let mut used: HashSet<String> = values.collect();
        let mut lets = Vec::new();
        for Statement { name, text, key } in std::mem::take(&mut self.statements).into_iter().rev()
        {
            if used.contains(&name) {
                used.extend(words(&text));
                lets.push(self.statement(&format!("let {name} = "), &text, key));
            }
        }
        lets.reverse();
        let outputs = assignments.iter();
        let outputs =
            outputs.map(|(name, text)| self.statement(&format!("{name} = "), text, shown));
        let outputs: Vec<Traced> = outputs.collect();
        let mark = self.mark(TOP, element);
        self.params.sort_by_key(|(at, _)| *at);
        let names: HashMap<Id, &str> = self
            .parameters
            .iter()
            .map(|(at, value)| (*at, value.text.as_str()))
            .collect();
        let params = self.params.iter();
        let params = params.filter(|(at, _)| names.get(at).is_some_and(|n| used.contains(*n)));
        let params = params.map(|(at, text)| {
            Traced::new(text.as_str()).mark(Mark {
                is_statement: true,
                ..self.mark(TOP, *at)
            })
        });
        let mut params: Vec<Traced> = params.collect();
        if let Some(unit) = self.scene_unit.filter(|unit| used.contains(unit)) {
            params.push(Traced::new(units::declaration(&unit)));
        }
        let mut whole = Traced::default();
        for line in docs.lines() {
            whole.text.push_str(&format!("/// {}\n", line.trim()));
        }
        whole.text.push_str(&format!("material {name} {{\n"));
        for block in [params, lets, outputs].iter().filter(|b| !b.is_empty()) {
            if !whole.text.ends_with("{\n") {
                whole.text.push('\n');
            }
            block.iter().for_each(|statement| whole.push(statement));
        }
        whole.text.push_str("}\n");
        whole.mark(mark)
    }
}
