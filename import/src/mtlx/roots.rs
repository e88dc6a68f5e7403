//! What of a document becomes a material.
//!
//! Materials do. Documents without materials may have surface shaders or outputs: each becomes a material that shows it.

use std::collections::HashSet;

use crate::error::ImportError;
use crate::imported::Options;
use crate::mtlx::document::{Document, Id, ROOT};
use crate::mtlx::graph::{Graphs, Key, ScopeId, Source, TOP};
use crate::mtlx::material::Builder;
use crate::mtlx::origin::Traced;
use crate::mtlx::parameters::wrapped;
use crate::mtlx::source::SourceText;
use crate::mtlx::text;
use crate::mtlx::types::Type;
use crate::mtlx::value::{Extra, Medium, Outputs, Shader, Value};

/// What becomes a material.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Root {
    /// A `surfacematerial`.
    Material(Id),
    /// A node with an output to show, or that is a material of its own.
    Node(Id),
    /// An output of a graph or of the document.
    Output(Id),
}

impl Root {
    /// The element.
    pub fn element(&self) -> Id {
        match self {
            Self::Material(id) | Self::Node(id) | Self::Output(id) => *id,
        }
    }

    /// The name that the material should have.
    pub fn name(&self, document: &Document) -> String {
        let id = self.element();
        let graph = document.scope_of(id);
        let name = document.name(id);
        match self {
            Self::Output(_) if graph != ROOT => {
                // Most graphs have one output, `out`.
                match document.children(graph, "output").nth(1) {
                    None => document.name(graph).to_owned(),
                    Some(_) => format!("{}_{name}", document.name(graph)),
                }
            }
            _ => name.to_owned(),
        }
    }
}

/// What of the document becomes materials, in its order.
pub(crate) fn find(document: &Document, source: &mut SourceText) -> Vec<Root> {
    let implementations = document
        .top()
        .filter(|id| document.category(*id) == "implementation");
    let implementing: HashSet<&str> = implementations
        .filter_map(|id| document.attribute(id, "nodegraph"))
        .collect();
    let graphs: Vec<Id> = document
        .top()
        .filter(|id| document.category(*id) == "nodegraph")
        .filter(|id| document.attribute(*id, "nodedef").is_none())
        .filter(|id| !implementing.contains(document.name(*id)))
        .collect();
    let nodes = |category: &str| -> Vec<Id> {
        let top = document
            .top()
            .filter(|id| document.category(*id) == category);
        let inner = graphs
            .iter()
            .flat_map(|graph| document.children(*graph, category));
        let mut found: Vec<Id> = top.chain(inner).collect();
        found.sort_unstable();
        found
    };
    let materials = nodes("surfacematerial");
    for volume in nodes("volumematerial") {
        let message = format!("the volume `{}` is left out", document.name(volume));
        source.warn(document.warning(volume, message));
    }
    let surfaces = nodes("LamaSurface");
    if !materials.is_empty() || !surfaces.is_empty() {
        let materials = materials.into_iter().map(Root::Material);
        let mut roots: Vec<Root> = materials
            .chain(surfaces.into_iter().map(Root::Node))
            .collect();
        roots.sort_by_key(Root::element);
        return roots;
    }
    let is_shader = |id: &Id| document.attribute(*id, "type") == Some("surfaceshader");
    let top: Vec<Id> = document.top().collect();
    let outputs = nodes("output");
    let shaders: Vec<Root> = top
        .iter()
        .filter(|id| is_shader(id) && !matches!(document.category(**id), "output" | "nodegraph"))
        .map(|id| Root::Node(*id))
        .chain(
            outputs
                .iter()
                .filter(|id| is_shader(id))
                .map(|id| Root::Output(*id)),
        )
        .collect();
    if !shaders.is_empty() {
        return shaders;
    }
    if !outputs.is_empty() {
        return outputs.into_iter().map(Root::Output).collect();
    }
    // Loose nodes: those that no other takes.
    let taken: HashSet<&str> = top
        .iter()
        .flat_map(|id| document.inputs(*id))
        .filter_map(|input| document.attribute(input, "nodename"))
        .collect();
    const DECLARATIONS: &[&str] = &[
        "nodedef",
        "nodegraph",
        "implementation",
        "typedef",
        "unitdef",
        "unittypedef",
        "geominfo",
        "look",
        "collection",
        "propertyset",
        "backdrop",
        "token",
        "input",
        "variant",
        "variantset",
        "targetdef",
        "output",
        "geompropdef",
        "attributedef",
        "lookgroup",
        "include",
    ];
    let loose = top.into_iter().filter(|id| {
        !DECLARATIONS.contains(&document.category(*id)) && !taken.contains(document.name(*id))
    });
    loose.map(Root::Node).collect()
}

/// The text of a material; nothing if there is nothing to show.
pub(crate) fn written(
    root: &Root,
    name: &str,
    graphs: &mut Graphs<'_>,
    source: &mut SourceText,
    options: &Options,
) -> Result<Option<Traced>, Vec<ImportError>> {
    let document = graphs.document;
    let id = root.element();
    let scope = match document.scope_of(id) {
        ROOT => TOP,
        graph => graphs.plain_scope(graph),
    };
    let from = match root {
        Root::Material(_) => shader_of(scope, id, graphs, source),
        Root::Node(_) => node_of(scope, id, graphs),
        Root::Output(_) => graphs.source(scope, id),
    };
    let from = from.map_err(|error| vec![error])?;
    let mut builder = Builder::new(graphs, source, options);
    let value = match &from {
        Source::Nothing => None,
        Source::Node(key, _) => {
            builder.write(&[*key])?;
            // The output by its own element, which names the one of several.
            let value = match root {
                Root::Output(_) => builder.value_at(scope, id, None),
                Root::Material(_) => {
                    let input = document.input(id, "surfaceshader").unwrap_or(id);
                    builder.value_at(scope, input, None)
                }
                Root::Node(_) => Ok(builder.first_output(*key)),
            };
            value.map_err(|error| vec![error])?
        }
        _ => builder
            .value_at(scope, id, None)
            .map_err(|error| vec![error])?,
    };
    let assignments = value.and_then(|value| assignments(&value, &mut builder));
    let Some(assignments) = assignments.filter(|assignments| !assignments.is_empty()) else {
        let message = format!("`{name}` has no surface to show and is left out");
        let warning = document.warning(id, message);
        source.warn(warning);
        return Ok(None);
    };
    let docs = document.attribute(id, "doc").unwrap_or_default();
    let docs = wrapped(docs).join("\n");
    let shown = match from {
        Source::Node(key, _) => Some(key),
        _ => None,
    };
    Ok(Some(builder.finished(
        (name, &docs),
        id,
        &assignments,
        shown,
    )))
}

fn shader_of(
    scope: ScopeId,
    material: Id,
    graphs: &mut Graphs<'_>,
    source: &mut SourceText,
) -> Result<Source, ImportError> {
    let document = graphs.document;
    for (input, what) in [
        ("displacementshader", "displacement"),
        ("backsurfaceshader", "back side"),
    ] {
        let Some(element) = document.input(material, input) else {
            continue;
        };
        if let Source::Node(..) = graphs.source(scope, element)? {
            let message = format!("the {what} of `{}` is left out", document.name(material));
            source.warn(document.warning(element, message));
        }
    }
    match document.input(material, "surfaceshader") {
        Some(element) => graphs.source(scope, element),
        None => Ok(Source::Nothing),
    }
}

/// A node of the document: itself, or what its definition says.
fn node_of(scope: ScopeId, node: Id, graphs: &mut Graphs<'_>) -> Result<Source, ImportError> {
    graphs.node_source(Key { scope, node })
}

/// An output of a material and its value.
type Assignment = (&'static str, String);

/// What the material assigns to show a value; nothing if it cannot be shown.
fn assignments(value: &Value, builder: &mut Builder<'_, '_>) -> Option<Vec<Assignment>> {
    let text = value.plain();
    let color = match value.ty {
        Type::SurfaceShader => match &value.extra {
            Extra::Shader(Shader::Call(call)) => {
                return Some(vec![("material", call.clone())]);
            }
            Extra::Shader(Shader::Outputs(outputs)) => return Some(assigned(outputs)),
            _ => return None,
        },
        Type::Bsdf => {
            let interior = value.medium().map(Medium::text);
            return Some(assigned(&Outputs {
                surface: Some(text),
                interior,
                ..Outputs::default()
            }));
        }
        Type::Edf => return Some(vec![("emission", text)]),
        Type::Color3 => text,
        Type::Float => format!("color({text})"),
        Type::Integer => format!("color(float({text}))"),
        Type::Boolean => format!("if {text} {{ color(1.0) }} else {{ color(0.0) }}"),
        Type::Vector2 => {
            let text = if text::is_simple(&text) {
                text
            } else {
                builder.bind("value", &text)
            };
            format!("color({text}.x, {text}.y, 0.0)")
        }
        Type::Vector3 => format!("color({text})"),
        Type::Color4 | Type::Vector4 => {
            format!("color({}.xyz)", text::bound(&text, text::Level::Atom))
        }
        Type::Matrix33 => format!(
            "color({} * vec3(1.0))",
            text::bound(&text, text::Level::Product)
        ),
        _ => return None,
    };
    let shown = builder.source.names_in("@edf::uniform");
    Some(vec![("emission", format!("{shown}({color})"))])
}

/// Assignments of outputs.
fn assigned(outputs: &Outputs) -> Vec<Assignment> {
    let all = [
        ("surface", &outputs.surface),
        ("emission", &outputs.emission),
        ("opacity", &outputs.opacity),
        ("interior", &outputs.interior),
    ];
    let given = all.iter();
    given
        .filter_map(|(name, text)| text.as_ref().map(|text| (*name, text.clone())))
        .collect()
}
