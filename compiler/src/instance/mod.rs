//! What a material gives to the surface model that it is an instance of, for formats that have the same model.
//!
//! A material like `material = open_pbr(base_color: tint * image(map, uv));` says no more than a few constants and
//! pictures. [`instance`] finds them in the checked material, whatever parameters, `let`s and functions they came
//! through, and says of every argument that is something else why it is.

use crate::diag::{self, Code, Diagnostic};
use crate::driver::MaterialRequest;
use crate::ir::Const;
use crate::loader::Loader;
use crate::sema::{Checker, Declared, ItemRef, Origin, WholeArgument};
use crate::source::{SourceMap, Span};

mod evaluate;
mod operate;
mod shape;
mod sum;
mod value;

use evaluate::{Evaluator, Frame};
use shape::Shapes;
use value::Sym;

/// The folder of the library that has the models.
const MODELS: &str = "surface";

/// What was found of a material.
pub struct Found {
    /// The texts that diagnostics point into.
    pub sources: SourceMap,
    /// What is wrong with the material, and what of it is not found.
    pub diagnostics: Vec<Diagnostic>,
    /// The instance, unless there were errors.
    pub instance: Option<Instance>,
}

/// A material as an instance of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// The material.
    pub name: String,
    /// The model: a material of the library's folder `surface`.
    pub model: String,
    /// What it is given, in the order of the model's parameters. What is equal to a default is not there.
    pub arguments: Vec<Argument>,
    /// Where pictures are looked up.
    pub lookups: Vec<Lookup>,
    /// The pictures that these read, as paths.
    pub pictures: Vec<String>,
    /// Where the model is called.
    pub span: Span,
}

/// What a parameter of a model is given.
#[derive(Clone, Debug, PartialEq)]
pub struct Argument {
    /// The parameter.
    pub name: String,
    /// The value.
    pub value: Value,
    /// Where it is written.
    pub span: Span,
}

/// A value. Lengths are in metres, angles in radians.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs)]
pub enum Value {
    Bool(bool),
    Int(i32),
    /// A number, or components.
    Numbers(Vec<f64>),
    /// What varies over the surface.
    Varying(Varying),
    /// A normal that a picture bends.
    Normal(NormalMap),
}

/// `offset + factor * texel * vertex color`, by component.
#[derive(Clone, Debug, PartialEq)]
pub struct Varying {
    /// What is added; as many components as the parameter has.
    pub offset: Vec<f64>,
    /// What multiplies; likewise.
    pub factor: Vec<f64>,
    /// A picture.
    pub texel: Option<Texel>,
    /// Is it multiplied by the color that the geometry's corners have?
    pub has_vertex_color: bool,
}

impl Varying {
    /// Does it add nothing?
    pub fn is_product(&self) -> bool {
        self.offset.iter().all(|x| *x == 0.0)
    }

    /// Is it what the picture says, as it is?
    pub fn is_plain(&self) -> bool {
        self.is_product() && !self.has_vertex_color && self.factor.iter().all(|x| *x == 1.0)
    }
}

/// What a lookup gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Texel {
    /// Which of [`Instance::lookups`].
    pub lookup: usize,
    /// What of it is meant.
    pub channels: Channels,
}

/// Channels of a texel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Channels {
    /// A color, as `image` gives it.
    Color,
    /// The first three as data, as `image_data` gives them.
    Data,
    /// One of the three of a color, from 0.
    OneOfColor(u8),
    /// One of four as data, from 0.
    One(u8),
}

/// An instance in another format.
#[derive(Clone, Debug, PartialEq)]
pub struct Exported {
    /// The file.
    pub text: String,
    /// What differs, in one sentence each.
    pub warnings: Vec<String>,
}

/// Where and how a picture is looked up.
#[derive(Clone, Debug, PartialEq)]
pub struct Lookup {
    /// Which of [`Instance::pictures`].
    pub picture: usize,
    /// Where.
    pub place: Place,
    /// How it goes on beyond its edges along u and v: indices of [`crate::abi::WRAPS`].
    pub wrap: [usize; 2],
    /// How it is filtered: an index of [`crate::abi::FILTERS`].
    pub filter: usize,
}

/// Texture coordinates: `matrix * uv + offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// 0 for `uv`, 1 for `uv1`.
    pub set: u8,
    /// Two rows.
    pub matrix: [[f64; 2]; 2],
    /// What is added.
    pub offset: [f64; 2],
}

impl Place {
    /// Texture coordinates as they are.
    pub const PLAIN: [[f64; 2]; 2] = [[1.0, 0.0], [0.0, 1.0]];
}

/// What `std::pattern::normal_map` is given, for the normal and tangent of the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalMap {
    /// The map.
    pub map: Varying,
    /// How steep.
    pub scale: f64,
    /// Does green point down?
    pub flip_green: bool,
}

/// The instance that a material is, with the parameters that the request gives and the defaults of the others.
pub fn instance(request: &MaterialRequest, loader: &mut dyn Loader) -> Found {
    let mut checker = Checker::new(loader);
    let instance = found(&mut checker, request);
    let instance = instance.filter(|_| !diag::has_errors(&checker.diagnostics));
    diag::drop_unsure(&mut checker.diagnostics);
    Found {
        sources: checker.sources,
        diagnostics: checker.diagnostics,
        instance,
    }
}

fn found(checker: &mut Checker, request: &MaterialRequest) -> Option<Instance> {
    let module = checker.load(&request.file)?;
    let index = checker.find_material(module, request.material.as_deref())?;
    let material = checker.material(module, index)?;
    let origin = format!("material `{}`", request.name);
    let params = &request.params;
    let written = request.written.as_deref();
    let values = checker.parameter_values(module, &material, params, &origin, written)?;
    let values = checker.values_at(&material, values, request.moment.unwrap_or_default())?;
    let Some(whole) = checker.whole(ItemRef { module, index }).cloned() else {
        let path = request.file.strip_prefix("std::");
        if path.and_then(|path| path.split_once("::")) == Some((MODELS, &material.name)) {
            return Some(itself(&material, &values));
        }
        checker.diagnostics.push(no_instance(&material));
        return None;
    };
    let (folder, model) = checker.named(whole.callee);
    if folder != Some(MODELS) {
        let message = format!("`{model}` is no model that other formats have");
        let wrong = Diagnostic::new(Code::NotExported, whole.span, message);
        checker.diagnostics.push(wrong.expected(EXPECTED));
        return None;
    }
    let declared = checker.declared(whole.callee.module, whole.callee.index)?;
    let name = impasto_stdlib::file("pattern", "normal_map").map(crate::sema::std_path);
    let mut files = checker.sources.files();
    let normal_map = files.find(|(_, file)| Some(&file.name) == name.as_ref());
    let normal_map = normal_map.map(|(id, _)| id);
    let mut evaluator = Evaluator::new(&checker.ir, &values, normal_map);
    let frame = evaluator.material(&material.body);
    let point = checker.ir.structs.iter().find(|s| s.name == "SurfacePoint");
    let mut shapes = Shapes::new(&evaluator, point.map_or(&[], |point| &point.fields[..]));
    let mut arguments = Vec::new();
    let mut refused = Vec::new();
    for (declared, argument) in declared.iter().zip(&whole.arguments) {
        let (Some(declared), Some(argument)) = (declared, argument) else {
            continue;
        };
        let value = evaluated(&evaluator, &material.body, &frame, argument);
        match shapes.of(&value, argument.span) {
            Ok(shape) if shape.is_default(declared) => {}
            Ok(shape::Shape::Value(value)) => arguments.push(Argument {
                name: declared.name.clone(),
                value,
                span: argument.span,
            }),
            Ok(shape::Shape::Input(name)) => {
                let why = sum::Why::new(argument.span, format!("`{name}`"));
                refused.push(not_found(&model, &declared.name, argument.span, &why));
            }
            Err(why) => refused.push(not_found(&model, &declared.name, argument.span, &why)),
        }
    }
    let lookups = std::mem::take(&mut shapes.lookups);
    checker.diagnostics.extend(refused);
    let textures: Vec<usize> = std::mem::take(&mut shapes.textures);
    Some(Instance {
        name: material.name.clone(),
        model,
        arguments,
        lookups,
        pictures: pictures(checker, &textures),
        span: whole.span,
    })
}

/// A model as an instance of itself: what it is given are values of parameters.
fn itself(material: &crate::ir::Material, values: &[Const]) -> Instance {
    let given = material.params.iter().zip(values);
    let given = given.filter(|(param, value)| !param.is_input && **value != param.default);
    let arguments = given.map(|(param, value)| {
        let value = match value {
            Const::Bool(b) => Value::Bool(*b),
            Const::Int(i) => Value::Int(*i),
            Const::Float(numbers) => Value::Numbers(numbers.clone()),
        };
        Argument {
            name: param.name.clone(),
            value,
            span: param.span,
        }
    });
    Instance {
        name: material.name.clone(),
        model: material.name.clone(),
        arguments: arguments.collect(),
        lookups: Vec::new(),
        pictures: Vec::new(),
        span: material.span,
    }
}

/// The value of an argument: as it is written, since other formats hold what they are given to the same range; where it
/// is known, what it is held to.
fn evaluated(
    evaluator: &Evaluator,
    body: &crate::ir::Function,
    frame: &Frame,
    argument: &WholeArgument,
) -> Sym {
    let held = evaluator.value(body, frame, argument.held);
    if operate::known(&held).is_some() {
        return held;
    }
    evaluator.value(body, frame, argument.written)
}

fn pictures(checker: &Checker, textures: &[usize]) -> Vec<String> {
    let path = |index: &usize| checker.ir.textures.get(*index).cloned();
    textures
        .iter()
        .map(|t| path(t).unwrap_or_default())
        .collect()
}

const EXPECTED: &str = "`material = MODEL(..);`, with a model of `std::surface`";

fn no_instance(material: &crate::ir::Material) -> Diagnostic {
    let message = format!("`{}` is not one call of a surface model", material.name);
    Diagnostic::new(Code::NotExported, material.span, message)
        .expected(EXPECTED)
        .hint("other formats have known models only, not closures; `std::surface::open_pbr` covers most surfaces")
}

fn not_found(model: &str, name: &str, span: Span, why: &sum::Why) -> Diagnostic {
    let what = &why.what;
    let message = format!("`{name}` of `{model}` cannot be exported: it depends on {what}");
    let wrong = Diagnostic::new(Code::NotExported, span, message)
        .expected("a constant, a picture, a constant times a picture, or a normal map")
        .hint("bake what varies into a picture, and look that up");
    let is_inside =
        why.span.file == span.file && span.start <= why.span.start && why.span.end <= span.end;
    if is_inside || why.span.file.is_library() {
        wrong
    } else {
        wrong.label(why.span, "here")
    }
}

impl shape::Shape {
    /// Is it what the parameter is anyway?
    fn is_default(&self, declared: &Declared) -> bool {
        match (self, &declared.origin) {
            (shape::Shape::Input(name), Origin::Input(own)) => name == own,
            (shape::Shape::Value(value), Origin::Settable(param)) => {
                match (value, &param.default) {
                    (Value::Bool(a), Const::Bool(b)) => a == b,
                    (Value::Int(a), Const::Int(b)) => a == b,
                    // In the precision that materials are evaluated in.
                    (Value::Numbers(a), Const::Float(b)) => {
                        a.iter().zip(b).all(|(a, b)| *a as f32 == *b as f32)
                    }
                    _ => false,
                }
            }
            _ => false,
        }
    }
}

impl Instance {
    /// What the parameter `name` is given.
    pub fn argument(&self, name: &str) -> Option<&Argument> {
        self.arguments.iter().find(|argument| argument.name == name)
    }
}

impl Argument {
    /// Says why a format does not have it.
    pub fn refused(&self, model: &str, why: &str) -> Diagnostic {
        let message = format!("`{}` of `{model}` cannot be exported: {why}", self.name);
        Diagnostic::new(Code::NotExported, self.span, message)
    }
}
