//! What a snapshot keeps as numbers: costs and parameters, a value a line, so that a review shows what changed.

use impasto_compiler::cost::MaterialCost;
use impasto_compiler::interface::MaterialInterface;
use serde_json::{Map, Value, json};

/// The version of the form.
pub(super) const VERSION: u64 = 1;

/// The text of both.
pub(super) fn text(
    measured: Option<&MaterialCost>,
    wgsl: &str,
    told: Option<&MaterialInterface>,
) -> String {
    let mut cost = Map::new();
    if let Some(measured) = measured
        && let Some(found) = &measured.cost
    {
        let classes = &found.operations.classes;
        // Means to three digits behind the point: the last bits are those of the machine's math library.
        let rounded = |x: f64| json!((x * 1e3).round() / 1e3);
        cost.insert("operations".into(), rounded(found.operations.mean));
        for (name, value) in [
            ("alu", classes.alu),
            ("special", classes.special),
            ("integer", classes.integer),
            ("texture", classes.texture),
            ("turns", classes.turns),
            ("bytes", found.bytes),
        ] {
            cost.insert(name.into(), rounded(value));
        }
        cost.insert("registers".into(), json!(found.live));
        cost.insert("code".into(), json!(found.code));
        cost.insert("lobes".into(), json!(measured.lobes));
    }
    cost.insert("lines".into(), json!(wgsl.lines().count()));
    let parameters: Vec<Value> = told
        .iter()
        .flat_map(|m| &m.params)
        .filter_map(|p| serde_json::to_value(p).ok())
        .map(|mut value| {
            // What is said about it is no behaviour.
            if let Some(fields) = value.as_object_mut() {
                fields.retain(|key, value| key != "docs" && key != "label" && !value.is_null());
            }
            value
        })
        .collect();
    let all = json!({ "version": VERSION, "cost": cost, "parameters": parameters });
    format!("{all:#}\n")
}
