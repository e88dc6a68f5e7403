//! One node while it is written: its inputs as values, checked by its row.

use impasto_compiler::diag::nearest;

use crate::error::ImportError;
use crate::mtlx::document::Id;
use crate::mtlx::graph::Key;
use crate::mtlx::material::Builder;
use crate::mtlx::nodes::{InputRow, Kind, Made, Make, NodeRow, matrices, one};
use crate::mtlx::text;
use crate::mtlx::types::{Literal, Type};
use crate::mtlx::value::Value;

/// A node that is being written.
pub(crate) struct Call<'c, 'b, 'a> {
    pub builder: &'c mut Builder<'b, 'a>,
    pub key: Key,
    pub row: &'static NodeRow,
    /// The type of the node.
    pub ty: Type,
}

impl Call<'_, '_, '_> {
    /// The outputs of the node.
    pub fn made(&mut self) -> Result<Made, ImportError> {
        self.check_names();
        if !self.row.takes(self.ty) {
            let message = format!("{} has the type `{}`", self.described(), self.ty.name());
            let expected = self.row.result().map_or("a type of values", Type::name);
            return Err(self.error(message).expected(expected));
        }
        if matrices::is_known(self)? {
            return matrices::computed(self);
        }
        match self.row.make {
            Make::Text(template) => self.template(template),
            Make::Each(templates) => {
                let first = self.row.input_rows().next();
                let of_first = match first {
                    Some(input) => self.arg(input.name)?.ty,
                    None => self.ty,
                };
                let wanted = templates.iter().find(|(types, _)| types.contains(&self.ty));
                let found = wanted
                    .or(templates
                        .iter()
                        .find(|(types, _)| types.contains(&of_first)))
                    .or(templates.iter().find(|(types, _)| types.is_empty()));
                let Some((_, template)) = found else {
                    let types = templates.iter().flat_map(|(types, _)| types.iter());
                    let types: Vec<&str> = types.map(|ty| ty.name()).collect();
                    let message = format!(
                        "{} has the type `{}`, for which it has no counterpart",
                        self.described(),
                        self.ty.name()
                    );
                    return Err(self.error(message).expected(types.join(", ")));
                };
                self.template(template)
            }
            Make::Code(code) => code(self),
        }
    }

    /// The single output that a template gives.
    pub fn template(&mut self, template: &str) -> Result<Made, ImportError> {
        one(Value::new(self.ty, self.filled(template)?))
    }

    /// A template with its holes filled.
    pub fn filled(&mut self, template: &str) -> Result<String, ImportError> {
        let values = self.values(template)?;
        Ok(self.expanded(template, &values))
    }

    /// The values of the holes of a template. What stands in it twice gets a name.
    fn values(&mut self, template: &str) -> Result<Vec<(String, Value)>, ImportError> {
        let plain = template.replace('~', "");
        let holes = text::holes(&plain);
        let mut values: Vec<(String, Value)> = Vec::new();
        for hole in &holes {
            if values.iter().any(|(name, _)| name == hole) {
                continue;
            }
            let mut value = self.arg(hole)?;
            let count = holes.iter().filter(|other| *other == hole).count();
            if count > 1 && value.literal.is_none() {
                value = self.named(hole, value);
            }
            values.push(((*hole).to_owned(), value));
        }
        Ok(values)
    }

    fn expanded(&mut self, template: &str, values: &[(String, Value)]) -> String {
        let template = template.replace("$T", self.ty.impasto());
        let template = self.builder.source.names_in(&template);
        // `{~in}` becomes a hole of its own, `{_raw_in}`.
        let template = template.replace("{~", "{_raw_");
        text::filled(&template, &|hole| {
            let (name, raw) = match hole.strip_prefix("_raw_") {
                Some(name) => (name, true),
                None => (hole, false),
            };
            let value = values.iter().find(|(known, _)| known == name);
            value.map_or(String::new(), |(_, value)| {
                if raw {
                    value.text.clone()
                } else {
                    value.plain()
                }
            })
        })
    }

    /// The value under a name of its own, unless it is short.
    pub fn named(&mut self, what: &str, value: Value) -> Value {
        if text::is_simple(&value.text) {
            return value;
        }
        let name = format!("{}_{what}", self.name());
        let text = self.builder.bind(&name, &value.text);
        Value { text, ..value }
    }

    /// The value of an input: what it is connected to, its value, or its default.
    pub fn arg(&mut self, name: &str) -> Result<Value, ImportError> {
        let input = self.row.input_row(name);
        if let Some(value) = self.given(name)? {
            return Ok(value);
        }
        let ty = match input.map(|input| input.kind) {
            Some(Kind::Of(ty)) => ty,
            Some(Kind::Same | Kind::Scalar) => self.ty,
            // What gives a type of its own, or is put together, is given numbers.
            _ if self.row.result().is_some() || self.row.category == "combine2" => Type::Float,
            _ if self.ty.is_numeric() => self.ty,
            _ => Type::Float,
        };
        let default = input.and_then(|input| input.default).unwrap_or("0");
        let ty = match default.split(',').count() {
            count if count == 1 || count == ty.count() => ty,
            2 => Type::Vector2,
            3 => Type::Vector3,
            9 => Type::Matrix33,
            _ => ty,
        };
        if let Some(property) = default.strip_prefix('@') {
            return self.builder.geometry(property, self.key.node);
        }
        match ty {
            Type::Bsdf => Ok(Value::new(
                ty,
                self.builder.source.names_in("@bsdf::diffuse(0.0)"),
            )),
            Type::Edf => Ok(Value::new(
                ty,
                self.builder.source.names_in("@edf::uniform(0.0)"),
            )),
            Type::Matrix33 => Ok(Value::new(ty, "mat3(1.0)")),
            _ => {
                let literal = Literal::read(default, ty);
                let literal = literal.unwrap_or(Literal::Numbers(vec![0.0; ty.count().max(1)]));
                Ok(Value::of(ty, literal))
            }
        }
    }

    /// The value of an input that the document gives.
    pub fn given(&mut self, name: &str) -> Result<Option<Value>, ImportError> {
        let document = self.builder.graphs.document;
        let Some(element) = document.input(self.key.node, name) else {
            return Ok(None);
        };
        let declared = self.declared(element)?;
        let Some(value) = self.builder.value_at(self.key.scope, element, declared)? else {
            return Ok(None);
        };
        let kind = self
            .row
            .input_row(name)
            .map_or(Kind::Any, |input| input.kind);
        self.fitting(element, name, kind, value).map(Some)
    }

    /// The type that an input says it has.
    fn declared(&self, element: Id) -> Result<Option<Type>, ImportError> {
        let document = self.builder.graphs.document;
        let Some(name) = document.attribute(element, "type") else {
            return Ok(None);
        };
        let ty = Type::of(name).ok_or_else(|| {
            let message = format!("`{}` has the unknown type `{name}`", document.name(element));
            let near = nearest(name, Type::names()).map(|near| format!("did you mean `{near}`?"));
            document.error(element, message).maybe_hint(near)
        })?;
        Ok(Some(ty))
    }

    /// The value, if its type is one that the input takes.
    fn fitting(
        &self,
        element: Id,
        name: &str,
        kind: Kind,
        value: Value,
    ) -> Result<Value, ImportError> {
        let fits =
            |wanted: Type| value.ty == wanted || wanted == Type::Float && value.ty == Type::Integer;
        let (fits, expected) = match kind {
            Kind::Any => (true, ""),
            Kind::Of(ty) => (fits(ty), ty.name()),
            Kind::Same => (fits(self.ty), self.ty.name()),
            // Closures are not weighted by closures.
            Kind::Scalar if !self.ty.is_numeric() => (fits(Type::Float), Type::Float.name()),
            Kind::Scalar => (fits(self.ty) || fits(Type::Float), self.ty.name()),
        };
        if fits {
            return Ok(value);
        }
        let message = format!(
            "the input `{name}` of {} has the type `{}`",
            self.described(),
            value.ty.name()
        );
        let document = self.builder.graphs.document;
        let error = document
            .error(element, message)
            .expected(format!("`{expected}`"));
        Err(error.hint("put a `convert` between them"))
    }

    /// The text that an input is: of strings and enumerations, which must be known.
    pub fn text(&mut self, name: &str) -> Result<String, ImportError> {
        match self.arg(name)?.literal {
            Some(Literal::Text(text)) => Ok(text),
            _ => {
                let message = format!("the input `{name}` of {} is not known", self.described());
                Err(self
                    .error(message)
                    .expected("a text that the document says"))
            }
        }
    }

    /// Is the input given, and does it differ from its default?
    pub fn differs(&mut self, name: &str) -> Result<bool, ImportError> {
        let Some(given) = self.given(name)? else {
            return Ok(false);
        };
        let default = self.row.input_row(name).and_then(|input| input.default);
        let same = match (default, &given.literal) {
            (Some(default), Some(literal)) => {
                Literal::read(default, given.ty).as_ref() == Ok(literal)
            }
            _ => false,
        };
        Ok(!same)
    }

    /// The name of the node.
    pub fn name(&self) -> String {
        self.builder.node_name(self.key)
    }

    /// The node for messages: its category and name.
    pub fn described(&self) -> String {
        let document = self.builder.graphs.document;
        let node = self.key.node;
        format!(
            "the `{}` node `{}`",
            document.category(node),
            document.name(node)
        )
    }

    /// An error about the node.
    pub fn error(&self, message: impl Into<String>) -> ImportError {
        self.builder.graphs.document.error(self.key.node, message)
    }

    /// A warning about the node; said once.
    pub fn warn(&mut self, message: impl Into<String>) {
        let warning = self.builder.graphs.document.warning(self.key.node, message);
        self.builder.source.warn(warning);
    }

    /// Warns of inputs that the row does not know.
    fn check_names(&mut self) {
        let document = self.builder.graphs.document;
        // Models have the inputs of the library's material.
        if self.row.inputs == "*" {
            return;
        }
        let inputs: Vec<Id> = document.inputs(self.key.node).collect();
        for input in inputs {
            let name = document.name(input);
            if self.row.input_row(name).is_none() {
                let known: Vec<&str> = self.row.input_rows().map(|i: InputRow| i.name).collect();
                let near = nearest(name, known).map(|near| format!("; did you mean `{near}`?"));
                let message = format!(
                    "{} has no input `{name}`, which is left out{}",
                    self.described(),
                    near.unwrap_or_default()
                );
                let warning = document.warning(input, message);
                self.builder.source.warn(warning);
            }
        }
    }
}
