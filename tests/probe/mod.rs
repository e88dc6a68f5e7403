//! Writes a material that uses everything a library file defines.
//!
//! Arguments depend on the surface point, so that nothing is folded to a constant.

use std::path::Path;

use impasto::compiler::ast::{ClosureKind, Field, Item, ItemKind, Module, Param};
use impasto::compiler::parser;
use impasto::compiler::source::SourceMap;

/// The source of the probe of the library file at `path`; none if it defines nothing to call.
pub(crate) fn source(path: &Path) -> Option<String> {
    let folder = path.parent()?.file_name()?.to_str()?;
    let name = path.file_stem()?.to_str()?;
    let mut module = parsed(impasto_stdlib::file(folder, name)?.text);
    // What is private shows in what uses it.
    module.items.retain(|item| !item.private);
    let used = module.items.iter();
    let used = used.filter(|item| is_callable(item) || is_argument(&module, item));
    let names: Vec<&str> = used.map(|item| item.name.node.as_str()).collect();
    if names.is_empty() {
        return None;
    }
    let mut source = String::new();
    if folder != impasto_stdlib::CORE {
        source += &format!("use std::{folder}::{{{}}};\n", names.join(", "));
    }
    if !names.contains(&"diffuse") {
        source += "use std::bsdf::diffuse as probe_diffuse;\n";
    }
    if used_types(&module).any(|ty| matches!(ty, "edf" | "medium")) {
        source += "use std::edf::uniform as probe_uniform;\n";
    }
    for item in &module.items {
        if let Some((output, params)) = output(item) {
            let (name, call) = (&item.name.node, call(item, params));
            source += &format!("material probe_{name} {{ {output} = {call}; }}\n");
        }
    }
    Some(source + &functions(&module))
}

/// The output that what an item makes is assigned to, with its parameters, if it makes closures.
fn output(item: &Item) -> Option<(&'static str, &[Param])> {
    match &item.kind {
        ItemKind::Closure(closure) => match closure.kind {
            ClosureKind::Edf => Some(("emission", &closure.params)),
            _ => Some(("surface", &closure.params)),
        },
        ItemKind::Function(f) => match f.result.node.as_str() {
            "bsdf" => Some(("surface", &f.params)),
            "edf" => Some(("emission", &f.params)),
            // An interior may not depend on the point, as arguments here do; it is made all the same.
            "medium" => Some(("emission = probe_uniform(1.0); let _unused", &f.params)),
            _ => None,
        },
        // With its defaults.
        ItemKind::Material(_) => Some(("material", &[])),
        _ => None,
    }
}

/// Types that stand in the parameters and results of functions.
fn used_types(module: &Module) -> impl Iterator<Item = &str> {
    let functions = module.items.iter().filter_map(|item| match &item.kind {
        ItemKind::Function(f) => Some(f),
        _ => None,
    });
    functions.flat_map(|f| {
        let params = f.params.iter().map(|p| p.ty.node.as_str());
        params.chain([f.result.node.as_str()])
    })
}

/// One material whose color is the sum of what all functions of the module give.
fn functions(module: &Module) -> String {
    let values = module.items.iter().filter_map(|item| match &item.kind {
        ItemKind::Function(f) if output(item).is_none() => {
            Some((call(item, &f.params), f.result.node.as_str()))
        }
        _ => None,
    });
    let values: Vec<(String, &str)> = values.collect();
    if values.is_empty() {
        return String::new();
    }
    let mut body = String::from("    var sum = color(0.0);\n");
    for (index, (call, ty)) in values.iter().enumerate() {
        let value = color_of(&format!("v{index}"), ty);
        body += &format!("    let v{index} = {call};\n    sum += {value};\n");
    }
    format!("material probe_functions {{\n{body}    surface = probe_diffuse(sum);\n}}\n")
}

fn is_callable(item: &Item) -> bool {
    matches!(
        item.kind,
        ItemKind::Function(_) | ItemKind::Closure(_) | ItemKind::Material(_)
    )
}

/// Is an item a struct that some function of the module takes?
fn is_argument(module: &Module, item: &Item) -> bool {
    matches!(item.kind, ItemKind::Struct(_))
        && module.items.iter().any(|user| match &user.kind {
            ItemKind::Function(f) => f.params.iter().any(|p| p.ty.node == item.name.node),
            _ => false,
        })
}

fn call(item: &Item, params: &[Param]) -> String {
    let args = params.iter().map(|param| argument(&param.ty.node));
    let args: Vec<String> = args.collect();
    format!("{}({})", item.name.node, args.join(", "))
}

/// Some value of a type.
fn argument(ty: &str) -> String {
    if let Some((element, count)) = ty.strip_suffix(']').and_then(|ty| ty.split_once('[')) {
        let one = argument(element);
        return match count {
            "" => format!("[{one}, {one}, {one}]"),
            _ => format!("fill({one}, {count})"),
        };
    }
    let text = match ty {
        "bool" => "position.x > 0.0",
        "int" => "int(position.y)",
        "uint" => "uint(position.y)",
        "float" => "position.z",
        "length" => "position.x * 1 m",
        "angle" => "position.y * 1 rad",
        "vec2" => "uv",
        "vec3" | "point" => "position",
        "vector" | "normal" => "normal",
        "vec4" => "vec4(position, 1.0)",
        "color" => "color(position)",
        "mat2" => "mat2(uv, 2.0 * uv)",
        "mat3" => "mat3(tangent, normal, geometric_normal)",
        "texture" => "\"probe.png\"",
        "bsdf" => "probe_diffuse(0.5)",
        "edf" => "probe_uniform(1.0)",
        "medium" => "medium()",
        name => return structure(name),
    };
    text.into()
}

fn structure(name: &str) -> String {
    let fields = fields(name);
    let args: Vec<String> = fields.iter().map(|f| argument(&f.ty.node)).collect();
    format!("{name}({})", args.join(", "))
}

/// A color that depends on `value`.
fn color_of(value: &str, ty: &str) -> String {
    match ty {
        "bool" => format!("color(select({value}, 1.0, 0.0))"),
        "int" | "uint" | "float" | "length" | "angle" => format!("color(float({value}))"),
        "vec2" => format!("color({value}.x + {value}.y)"),
        "vec3" | "point" | "vector" | "normal" => format!("color({value})"),
        "vec4" => format!("color({value}.xyz)"),
        "color" => value.into(),
        "mat2" => format!("color({value}.x.x + {value}.y.y)"),
        "mat3" => format!("color({value} * normal)"),
        name => {
            let fields = fields(name);
            let field = |f: &Field| color_of(&format!("{value}.{}", f.name.node), &f.ty.node);
            fields.iter().map(field).collect::<Vec<_>>().join(" + ")
        }
    }
}

/// The fields of a struct of the library.
fn fields(name: &str) -> Vec<Field> {
    let items = impasto_stdlib::files()
        .iter()
        .flat_map(|file| parsed(file.text).items);
    let found = items
        .filter(|item| item.name.node == name)
        .find_map(|item| match item.kind {
            ItemKind::Struct(fields) => Some(fields),
            _ => None,
        });
    found.unwrap_or_else(|| panic!("the probe knows no type `{name}`"))
}

fn parsed(text: &str) -> Module {
    let file = SourceMap::default().add("library", text);
    parser::parse(file, text).0
}
