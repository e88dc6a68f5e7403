//! The two-line example of each entry, which is also what its picture shows: a call with the
//! defaults, with what has none filled in by type, turned into something that can be seen.
//!
//! A doc line `Gallery: value = EXPR` replaces the call, `Gallery: surface = EXPR` puts a function
//! on the shader ball (bumps, and whatever bends normals), and `Gallery: item = fn ...` defines a
//! function that these call.

use std::collections::BTreeSet;

use impasto::docs::{Definition, Item, Parameter};

use super::library::{Entry, Library, MATERIALS};

/// On what an entry is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stand {
    /// The shader ball.
    Ball,
    /// A flat tile that shows a value as light.
    Tile,
    /// A lamp near a wall.
    Lamp,
}

/// What is shown of an entry, and how to write it.
pub(super) struct Example {
    pub(super) stand: Stand,
    /// The source of what is seen: a generated one, or that of the material itself.
    pub(super) picture: String,
    /// The material of that source.
    pub(super) material: String,
    /// A source of two lines, as the page has it.
    pub(super) page: String,
    /// How large the shader ball is, in metres.
    pub(super) size: f64,
}

/// The example of an entry; none where a picture would show nothing.
pub(super) fn example(entry: &Entry, library: &Library) -> Result<Example, String> {
    let failed = |why: &str| format!("{}: {why}", entry.path.display());
    let main = entry
        .main()
        .ok_or_else(|| failed("defines nothing of its own name, so there is nothing to show"))?;
    let notes = entry.notes();
    let item = notes.get("item").map_or("", String::as_str);
    let size = match notes.get("scale") {
        Some(text) => {
            metres(text).ok_or_else(|| failed("`Gallery: scale` is not a length in m, cm or mm"))?
        }
        None => 0.1,
    };
    let source = |statement: &str| source(library, &entry.folder, item, statement);
    let made = |stand, picture: String, page: String| {
        let material = "example".to_owned();
        Ok(Example {
            stand,
            picture,
            material,
            page,
            size,
        })
    };
    if matches!(main.definition, Definition::Material { .. }) {
        return Ok(Example {
            stand: Stand::Ball,
            picture: entry.text.clone(),
            material: main.name.clone(),
            page: used_material(entry, &main.name),
            size,
        });
    }
    if let Some(surface) = notes.get("surface") {
        let text = source(&format!("surface = {surface};"));
        return made(Stand::Ball, text.clone(), text);
    }
    let call = || match notes.get("value") {
        Some(value) => Ok(value.clone()),
        None => called(main).map_err(|why| failed(&why)),
    };
    let result = match &main.definition {
        Definition::Fn { result, .. } => Some(result.as_str()),
        _ => None,
    };
    match (main.kind(), result) {
        ("bsdf" | "delta bsdf", _) | ("fn", Some("bsdf")) => {
            let call = call()?;
            let text = source(&format!("surface = {call};"));
            made(Stand::Ball, text.clone(), text)
        }
        ("edf", _) | ("fn", Some("edf")) => {
            let page = called(main).map_err(|why| failed(&why))?;
            let page = source(&format!("emission = {page};"));
            let call = call()?;
            let text = source(&format!("emission = 9.0 * {call};"));
            made(Stand::Lamp, text, page)
        }
        ("fn", Some(result)) => {
            let call = call()?;
            let seen = match notes.get("value") {
                Some(_) => call,
                None => shown(&call, result, entry).ok_or_else(|| {
                    failed(&format!(
                        "say how a {result} is shown: `Gallery: value = ...`"
                    ))
                })?,
            };
            let picture = source(&format!("emission = uniform({seen});"));
            let page = source(&format!("surface = diffuse({seen});"));
            made(Stand::Tile, picture, page)
        }
        (kind, _) => Err(failed(&format!("a {kind} cannot be shown"))),
    }
}

/// How a scene uses a material, as two lines of its file.
fn used_material(entry: &Entry, name: &str) -> String {
    let file = match entry.folder.as_str() {
        MATERIALS => format!("materials/{}.impasto", entry.name),
        folder => format!("std::{folder}::{}", entry.name),
    };
    format!("[materials.{name}]\nfile = \"{file}\"\n")
}

/// A call of `item` with its defaults.
fn called(item: &Item) -> Result<String, String> {
    let needed = item.parameters().iter().filter(|p| p.default.is_none());
    let args: Result<Vec<String>, String> = needed.map(argument).collect();
    Ok(format!("{}({})", item.name, args?.join(", ")))
}

/// A value for a parameter without a default: tiles are 10 cm wide, and show about eight periods.
fn argument(parameter: &Parameter) -> Result<String, String> {
    let value = match (parameter.ty.as_str(), parameter.name.as_str()) {
        ("point", _) => "position / 1.25 cm",
        ("vec2", _) => "4.0 * uv",
        ("float", "t" | "x") => "uv.x",
        ("float", _) => "0.5",
        ("color", _) => "color(0.6, 0.25, 0.1)",
        ("normal", _) => "normal",
        ("vector", "tangent") => "tangent",
        ("length", _) => "1 cm",
        (ty, name) => {
            return Err(format!(
                "say what to show: `{name}: {ty}` has no default (`Gallery: value = ...`)"
            ));
        }
    };
    Ok(value.to_owned())
}

/// A color that shows the value of `call`; of a struct its first field that can be seen.
fn shown(call: &str, result: &str, entry: &Entry) -> Option<String> {
    match result {
        "float" => Some(format!("saturate({call})")),
        "color" => Some(call.to_owned()),
        "vec3" | "point" | "vector" | "normal" => Some(format!("color(0.5 + 0.5 * {call})")),
        _ => {
            let fields = entry.docs.items.iter().find(|i| i.name == result)?.fields();
            let visible = |ty: &str| ["float", "color", "vec3", "vector", "normal"].contains(&ty);
            let field = fields.iter().find(|f| visible(&f.ty))?;
            shown(&format!("{call}.{}", field.name), &field.ty, entry)
        }
    }
}

/// A material of one statement, after `item` and imports of all that they name of the library. A
/// name that several folders define is the one of `folder`, or else of the first.
fn source(library: &Library, folder: &str, item: &str, statement: &str) -> String {
    let mut imports: BTreeSet<String> = BTreeSet::new();
    for word in [item, statement].into_iter().flat_map(words) {
        let homes = library.homes.get(word).map_or(&[][..], Vec::as_slice);
        let own = homes.iter().find(|home| *home == folder);
        if let Some(home) = own.or(homes.first()) {
            imports.insert(format!("use std::{home}::{word};"));
        }
    }
    let imports: Vec<String> = imports.into_iter().collect();
    let item = match item {
        "" => String::new(),
        item => format!("{item}\n"),
    };
    let imports = imports.join(" ");
    format!("{imports}\n{item}material example {{ {statement} }}\n")
}

/// The identifiers of an expression, but those of arguments and parameters (before a `:`) and of
/// fields (after a `.`).
fn words(text: &str) -> impl Iterator<Item = &str> {
    let ends = |c: char| !c.is_ascii_alphanumeric() && c != '_';
    let mut after_dot = false;
    let named = text.split_inclusive(ends).filter(move |word| {
        let is_field = std::mem::replace(&mut after_dot, word.ends_with('.'));
        !is_field && !word.ends_with(':')
    });
    named
        .map(move |word| word.trim_end_matches(ends))
        .filter(|word| !word.is_empty())
}

/// A length such as `2 m` or `30 cm`.
fn metres(text: &str) -> Option<f64> {
    let (number, unit) = text.split_once(' ')?;
    let unit = match unit.trim() {
        "m" => 1.0,
        "cm" => 0.01,
        "mm" => 0.001,
        _ => return None,
    };
    let metres = number.parse::<f64>().ok()? * unit;
    (metres.is_finite() && metres > 0.0).then_some(metres)
}
