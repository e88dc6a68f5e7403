//! Every row of the table of nodes: bare, and with all of its inputs connected, it becomes a source that compiles.

use impasto_import::{NodeRow, node_rows};

use crate::common::of_text;

/// Types that a node may have, the likeliest first.
const TYPES: [&str; 14] = [
    "float",
    "color3",
    "vector3",
    "vector2",
    "color4",
    "vector4",
    "integer",
    "boolean",
    "matrix33",
    "BSDF",
    "EDF",
    "VDF",
    "surfaceshader",
    "multioutput",
];

/// Nodes that give varying values of these types, named after them.
const SOURCES: &str = "<texcoord name=\"vector2\" type=\"vector2\"/>
    <extract name=\"float\" type=\"float\"><input name=\"in\" type=\"vector2\" nodename=\"vector2\"/></extract>
    <combine3 name=\"vector3\" type=\"vector3\"><input name=\"in1\" type=\"float\" nodename=\"float\"/></combine3>
    <combine3 name=\"color3\" type=\"color3\"><input name=\"in1\" type=\"float\" nodename=\"float\"/></combine3>
    <combine4 name=\"color4\" type=\"color4\"><input name=\"in1\" type=\"float\" nodename=\"float\"/></combine4>
    <combine4 name=\"vector4\" type=\"vector4\"><input name=\"in1\" type=\"float\" nodename=\"float\"/></combine4>
    <creatematrix name=\"matrix33\" type=\"matrix33\"><input name=\"in1\" type=\"vector3\" nodename=\"vector3\"/></creatematrix>
    <uniform_edf name=\"EDF\" type=\"EDF\"/>
    <burley_diffuse_bsdf name=\"BSDF\" type=\"BSDF\"/>";

/// The inputs of a row, each connected to a node of its type, where there is one.
fn connected(row: &NodeRow, ty: &str, any: &str) -> String {
    let inputs = row.inputs.split_whitespace().filter_map(|input| {
        let (name, rest) = input.split_once(':')?;
        // What fills an object must not vary over its surface.
        let fills = ["absorption", "scatter", "IOR", "ior", "reflectivity"];
        let is_boundary =
            row.category.contains("ielectric") || row.category == "LamaGeneralizedSchlick";
        if is_boundary && fills.iter().any(|part| name.starts_with(part)) {
            return None;
        }
        let kind = rest.split('=').next()?;
        let kind = match kind {
            "same" | "scalar" => ty,
            "any" => any,
            kind => kind,
        };
        let given = match kind {
            "filename" => "value=\"a.png\"".to_owned(),
            kind if SOURCES.contains(&format!("name=\"{kind}\"")) => format!("nodename=\"{kind}\""),
            _ => return None,
        };
        Some(format!("<input name=\"{name}\" type=\"{kind}\" {given}/>"))
    });
    inputs.collect()
}

/// Why a node does not become a source that compiles, which importing makes sure of.
fn problem(row: &NodeRow, ty: &str, inputs: &str) -> Result<(), String> {
    let category = row.category;
    let text = format!(
        "<materialx version=\"1.39\">{SOURCES}<{category} name=\"n\" type=\"{ty}\">{inputs}</{category}>\
         <output name=\"shown\" type=\"{ty}\" nodename=\"n\"/></materialx>"
    );
    let imported = of_text(&text).map_err(|errors| errors[0].to_string())?;
    assert_eq!(imported.materials.len(), 1);
    Ok(())
}

/// Inputs without which a node means nothing.
fn needed(category: &str) -> &'static str {
    match category {
        "geompropvalue" => "<input name=\"geomprop\" type=\"string\" value=\"st\"/>",
        "UsdPrimvarReader" => "<input name=\"varname\" type=\"string\" value=\"st\"/>",
        "transformpoint" | "transformvector" | "transformnormal" => {
            "<input name=\"fromspace\" type=\"string\" value=\"object\"/>\
             <input name=\"tospace\" type=\"string\" value=\"world\"/>"
        }
        "swizzle" => "<input name=\"channels\" type=\"string\" value=\"x\"/>",
        "generalized_schlick_edf" => "<input name=\"base\" type=\"EDF\" nodename=\"EDF\"/>",
        "LamaSurface" => "<input name=\"materialFront\" type=\"BSDF\" nodename=\"BSDF\"/>",
        _ => "",
    }
}

/// Each row compiles for some type of the node and some type of the inputs that take any.
fn compiles_for_some_type(inputs: impl Fn(&NodeRow, &str, &str) -> String) {
    let mut failed = Vec::new();
    for row in node_rows() {
        // A volume is shown by nothing alone; the documents have those.
        if row.category.ends_with("_vdf") {
            continue;
        }
        let mut why = String::new();
        let works = TYPES.iter().any(|ty| {
            [ty, "float", "vector3", "matrix33"].iter().any(|any| {
                let mut inputs = inputs(&row, ty, any);
                let needed = needed(row.category);
                let name = needed.split(" type").next().unwrap_or_default();
                if name.is_empty() || !inputs.contains(name) {
                    inputs.insert_str(0, needed);
                }
                let problem = problem(&row, ty, &inputs).err();
                why = problem.clone().unwrap_or_default();
                problem.is_none()
            })
        });
        if !works {
            failed.push(format!("{}: {why}", row.category));
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn a_bare_node_of_every_row_compiles() {
    compiles_for_some_type(|_, _, _| String::new());
}

#[test]
fn a_node_of_every_row_compiles_with_its_inputs_connected() {
    compiles_for_some_type(connected);
}
