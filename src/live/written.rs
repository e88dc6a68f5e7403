//! Writes values into the text of a scene, which keeps its comments, its order and its layout.

use std::collections::BTreeMap;

use impasto_compiler::ParameterValue;
use impasto_viewer::engine::ParamId;
use toml_edit::{Array, DocumentMut, InlineTable, Item, TableLike, Value};

/// The text with these values.
///
/// # Errors
/// Why one of them cannot be written.
pub(super) fn with_values(
    text: &str,
    values: &BTreeMap<ParamId, ParameterValue>,
) -> Result<String, String> {
    let mut document: DocumentMut = text.parse().map_err(|error: toml_edit::TomlError| {
        let why = error.message();
        format!("the scene file cannot be read as it is now: {why}\n  hint: mend it first")
    })?;
    for (id, value) in values {
        let ParamId { binding, param } = id;
        match params(&mut document, binding)? {
            Item::Value(Value::InlineTable(table)) => put_inline(table, param, toml_value(value)),
            item => {
                let table = item.as_table_like_mut();
                let none = || format!("`params` of `[materials.{binding}]` is no table");
                put(table.ok_or_else(none)?, param, toml_value(value));
            }
        }
    }
    Ok(document.to_string())
}

/// The `params` of a binding, which is made if there is none.
fn params<'d>(document: &'d mut DocumentMut, binding: &str) -> Result<&'d mut Item, String> {
    let none = || {
        format!(
            "the scene file has no `[materials.{binding}]` any more\n  hint: reload it, or reset the value"
        )
    };
    let found = document
        .get_mut("materials")
        .and_then(|materials| materials.get_mut(binding));
    let table = found.and_then(Item::as_table_like_mut).ok_or_else(none)?;
    if !table.contains_key("params") {
        table.insert("params", Item::Value(InlineTable::new().into()));
    }
    table.get_mut("params").ok_or_else(none)
}

/// Puts a value in the place of the one before, between the same spaces and comments.
fn put(table: &mut dyn TableLike, name: &str, mut value: Value) {
    if let Some(old) = table.get(name).and_then(Item::as_value) {
        *value.decor_mut() = old.decor().clone();
    }
    match table.get_mut(name) {
        Some(item) => *item = Item::Value(value),
        None => {
            table.insert(name, Item::Value(value));
        }
    }
}

/// The same in `{ a = 1, b = 2 }`: the space before the bracket belongs to the last value, whichever that is.
fn put_inline(table: &mut InlineTable, name: &str, mut value: Value) {
    if !table.contains_key(name)
        && let Some((_, last)) = table.iter_mut().last()
    {
        let suffix = last.decor().suffix().cloned();
        last.decor_mut().set_suffix("");
        value.decor_mut().set_prefix(" ");
        value.decor_mut().set_suffix(suffix.unwrap_or_default());
    }
    put(table, name, value);
}

/// A value as scenes write it.
fn toml_value(value: &ParameterValue) -> Value {
    match value.origin().1 {
        ParameterValue::Bool(b) => (*b).into(),
        ParameterValue::Int(i) => (*i).into(),
        ParameterValue::Float(x) => (*x).into(),
        ParameterValue::Floats(v) => Array::from_iter(v.iter().copied()).into(),
        ParameterValue::Texture(path) => path.as_str().into(),
        ParameterValue::Text(text) => text.as_str().into(),
        other @ ParameterValue::From(..) => other.to_string().into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = "# A wall.\n[camera]\nposition = [0, 1, 2] # from here\n\n[materials.wall]\nfile = \"wall.impasto\"   # the file\n\
        params = { rough = 0.5, tint = [0.1, 0.2, 0.3] } # as measured\n\n# The floor.\n[materials.floor]\nfile = \"floor.impasto\"\n\n\
        [materials.lamp]\nfile = \"lamp.impasto\"\n[materials.lamp.params]\n# Watts.\npower = 3.0  # bright\n";

    #[test]
    fn comments_order_and_layout_stay() {
        let id = |binding: &str, param: &str| ParamId {
            binding: binding.into(),
            param: param.into(),
        };
        let values = BTreeMap::from([
            (id("wall", "rough"), ParameterValue::Float(0.25)),
            (id("floor", "size"), ParameterValue::Text("3 mm".into())),
            (id("lamp", "power"), ParameterValue::Float(7.5)),
            (
                id("lamp", "tint"),
                ParameterValue::Floats(vec![1.0, 0.5, 0.25]),
            ),
        ]);
        let written = with_values(SCENE, &values).expect("written");
        let expected = SCENE
            .replace("rough = 0.5", "rough = 0.25")
            .replace(
                "file = \"floor.impasto\"\n",
                "file = \"floor.impasto\"\nparams = { size = \"3 mm\" }\n",
            )
            .replace(
                "power = 3.0  # bright\n",
                "power = 7.5  # bright\ntint = [1.0, 0.5, 0.25]\n",
            );
        assert_eq!(written, expected);
        assert_eq!(with_values(SCENE, &BTreeMap::new()).as_deref(), Ok(SCENE));
        let gone = with_values(
            SCENE,
            &BTreeMap::from([(id("roof", "a"), ParameterValue::Bool(true))]),
        );
        assert!(gone.is_err_and(|e| e.contains("no `[materials.roof]`")));
        assert!(with_values("[camera", &values).is_err_and(|e| e.contains("hint: mend")));
    }
}
