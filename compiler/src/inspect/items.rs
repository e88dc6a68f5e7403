//! What a file defines that can be evaluated, and the text by which it is.
//!
//! A material is evaluated as it is. A closure becomes the surface or emission of a material, and
//! a function the value of a function without context; both are written in the language and put
//! behind the file's own text, so that names, defaults and errors are those of any call.

use crate::ast::{self, ClosureKind, ItemKind};

/// Something to evaluate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Item {
    /// Its name.
    pub name: String,
    /// What it is.
    pub kind: Kind,
    params: Vec<Param>,
}

/// A parameter.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Param {
    name: String,
    ty: String,
    has_default: bool,
    /// What is put there where nothing is given.
    stand_in: Option<String>,
}

/// What an item is.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A material.
    Material,
    /// A bsdf, or a function that gives one.
    Bsdf,
    /// An edf, or a function that gives one.
    Edf,
    /// A function, with the type of its value.
    #[serde(untagged)]
    Function(FunctionKind),
}

/// A function of values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FunctionKind {
    /// The type of its value.
    pub result: String,
}

impl serde::Serialize for FunctionKind {
    fn serialize<S: serde::Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        s.serialize_str("function")
    }
}

impl Kind {
    /// Its name for people.
    pub fn text(&self) -> &'static str {
        match self {
            Kind::Material => "material",
            Kind::Bsdf => "bsdf",
            Kind::Edf => "edf",
            Kind::Function(_) => "function",
        }
    }
}

/// The name under which an item is evaluated.
pub const NAME: &str = "evaluated_item";

/// What a function's arguments may be made of: the inputs of a material, and the directions.
pub const CONTEXT: [(&str, &str); 15] = [
    ("position", "point"),
    ("normal", "normal"),
    ("geometric_normal", "normal"),
    ("tangent", "vector"),
    ("uv", "vec2"),
    ("exterior_ior", "float"),
    ("view", "vector"),
    ("instance_id", "int"),
    ("object_position", "point"),
    ("object_scale", "float"),
    ("uv1", "vec2"),
    ("vertex_color", "color"),
    ("wo", "vector"),
    ("wi", "vector"),
    ("u", "vec4"),
];

/// The items of a file that can be evaluated, in order.
pub fn items(module: &ast::Module) -> Vec<Item> {
    let item = |i: &ast::Item| item(i, module);
    module.items.iter().filter_map(item).collect()
}

fn item(item: &ast::Item, module: &ast::Module) -> Option<Item> {
    let (kind, params) = match &item.kind {
        ItemKind::Material(_) => (Kind::Material, &[][..]),
        ItemKind::Closure(def) => {
            let kind = match def.kind {
                ClosureKind::Edf => Kind::Edf,
                _ => Kind::Bsdf,
            };
            (kind, &def.params[..])
        }
        ItemKind::Function(f) => {
            let kind = match f.result.node.as_str() {
                "bsdf" => Kind::Bsdf,
                "edf" => Kind::Edf,
                result => Kind::Function(FunctionKind {
                    result: result.to_owned(),
                }),
            };
            (kind, &f.params[..])
        }
        ItemKind::Struct(_) | ItemKind::Const(_) => return None,
    };
    let param = |p: &ast::Param| Param {
        name: p.name.node.clone(),
        ty: p.ty.node.clone(),
        has_default: p.default.is_some(),
        stand_in: stand_in(&p.name.node, &p.ty.node, module, NESTED),
    };
    Some(Item {
        name: item.name.node.clone(),
        kind,
        params: params.iter().map(param).collect(),
    })
}

/// A definition that evaluates an item, and the arguments in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Call {
    /// Source text.
    pub text: String,
    /// Name and text of each argument that is given.
    pub arguments: Vec<(String, String)>,
}

impl Item {
    /// The text that evaluates a closure or function with the given arguments; parameters that
    /// have neither argument nor default get a stand-in.
    ///
    /// # Errors
    /// The parameter that has no stand-in, with its type.
    pub fn call(&self, given: &[(String, String)]) -> Result<Call, (String, String)> {
        let mut arguments = given.to_vec();
        for p in &self.params {
            if p.has_default || given.iter().any(|(n, _)| *n == p.name) {
                continue;
            }
            match &p.stand_in {
                Some(text) => arguments.push((p.name.clone(), text.clone())),
                None => return Err((p.name.clone(), p.ty.clone())),
            }
        }
        let list: Vec<String> = arguments.iter().map(|(n, a)| format!("{n}: {a}")).collect();
        let call = format!("{}({})", self.name, list.join(", "));
        let text = match &self.kind {
            Kind::Material => String::new(),
            Kind::Bsdf => format!("material {NAME} {{ surface = {call}; }}"),
            Kind::Edf => format!("material {NAME} {{ emission = {call}; }}"),
            Kind::Function(FunctionKind { result }) => {
                let context = CONTEXT.map(|(name, ty)| format!("{name}: {ty}"));
                format!("fn {NAME}({}) -> {result} = {call};", context.join(", "))
            }
        };
        Ok(Call { text, arguments })
    }
}

/// How deeply stand-ins for structs of structs are made.
const NESTED: usize = 4;

/// An argument for a parameter of type `ty`; of the structs, those of `module` are known.
fn stand_in(name: &str, ty: &str, module: &ast::Module, nested: usize) -> Option<String> {
    if let Some((element, count)) = ty.strip_suffix(']').and_then(|ty| ty.split_once('[')) {
        let element = stand_in(name, element, module, nested)?;
        let count = if count.is_empty() { "4" } else { count };
        return Some(format!("fill({element}, {count})"));
    }
    let text = match (ty, name) {
        ("vector" | "vec3", "wi") => "wi",
        ("vector" | "vec3", "wo" | "w" | "v") => "wo",
        ("vector", "tangent") => "tangent",
        ("bool", _) => "true",
        ("int", _) => "1",
        ("float", _) => "0.5",
        ("length", _) => "1 cm",
        ("angle", _) => "30 deg",
        ("color", _) => "color(0.5)",
        ("point", _) => "position",
        ("normal", _) => "normal",
        ("vector", _) => "wo",
        ("vec2", _) => "uv",
        ("vec3", _) => "vec3(u.x, u.y, u.z)",
        ("vec4", _) => "u",
        // No picture is read.
        ("texture", _) => "\"picture.png\"",
        _ => return made(ty, module, nested.checked_sub(1)?),
    };
    Some(text.to_owned())
}

/// A struct made of stand-ins.
fn made(ty: &str, module: &ast::Module, nested: usize) -> Option<String> {
    let fields = module.items.iter().find_map(|i| match &i.kind {
        ItemKind::Struct(fields) if i.name.node == ty => Some(fields),
        _ => None,
    })?;
    let field = |f: &ast::Field| {
        let value = stand_in(&f.name.node, &f.ty.node, module, nested)?;
        Some(format!("{}: {value}", f.name.node))
    };
    let fields: Option<Vec<String>> = fields.iter().map(field).collect();
    Some(format!("{ty}({})", fields?.join(", ")))
}
