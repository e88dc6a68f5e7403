//! Random programs that parse: every construct of the grammar, nested at random. They mean
//! nothing; only their syntax is right.

use proptest::prelude::*;
use proptest::sample::select;

fn word() -> impl Strategy<Value = String> {
    let words = [
        "a",
        "roughness",
        "base_color",
        "a_name_that_is_rather_long_for_a_name",
        "wo",
        "uv",
    ];
    select(words.to_vec()).prop_map(String::from)
}

fn leaf() -> impl Strategy<Value = String> {
    let literals = [
        "0",
        "1.5",
        ".5",
        "2.",
        "1e-3",
        "0xFF8800",
        "0.60 mm",
        "30 deg",
        "true",
        "\"wood.png\"",
        "5km",
    ];
    prop_oneof![word(), select(literals.to_vec()).prop_map(String::from)]
}

/// An expression. Operands are in parentheses, so that comparisons are never chained.
fn expr() -> impl Strategy<Value = String> {
    leaf().prop_recursive(5, 40, 4, |inner| {
        let tight = [
            "+", "-", "*", "/", "%", "&&", "||", "|", "^", "&", "<<", ">>",
        ];
        let compare = ["==", "!=", "<", "<=", ">", ">="];
        let args = prop::collection::vec((prop::option::of(word()), inner.clone()), 0..5);
        let comma = select(vec!["", ",", ",\n"]);
        prop_oneof![
            (inner.clone(), select(tight.to_vec()), inner.clone())
                .prop_map(|(a, op, b)| format!("{a} {op} {b}")),
            (inner.clone(), select(compare.to_vec()), inner.clone())
                .prop_map(|(a, op, b)| format!("(({a}) {op} ({b}))")),
            (select(vec!["-", "!", "- -"]), inner.clone()).prop_map(|(op, a)| format!("{op}({a})")),
            inner.clone().prop_map(|a| format!("({a}).xy.x")),
            (inner.clone(), block(inner.clone()), block(inner.clone()))
                .prop_map(|(c, a, b)| format!("(if {c} {a} else {b})")),
            (inner.clone(), inner.clone(), block(inner.clone())).prop_map(|(c, d, a)| format!(
                "(if {c} {{\n{d} }} else if {d} {a} else {{ {c} }})"
            )),
            block(inner.clone()).prop_map(|b| format!("({b})")),
            (word(), args, comma).prop_map(|(name, args, comma)| call(&name, &args, comma)),
        ]
    })
}

fn call(name: &str, args: &[(Option<String>, String)], comma: &str) -> String {
    let arg = |(name, value): &(Option<String>, String)| match name {
        Some(name) => format!("{name}: {value}"),
        None => value.clone(),
    };
    let list: Vec<String> = args.iter().map(arg).collect();
    let comma = if list.is_empty() { "" } else { comma };
    format!("{name}({}{comma})", list.join(", "))
}

/// A block that ends in a value.
fn block(value: impl Strategy<Value = String>) -> impl Strategy<Value = String> {
    let statements = select(vec![
        "",
        "",
        "let a = 1;",
        "var b: float = 2.0; b += 1.0;",
        "for i in 0..4 { continue; }",
        "if true { x = 1; } else if y { } else { z.x /= 2; }",
        "while a < 3 limit 8 { break; }",
    ]);
    (statements, value).prop_map(|(statements, value)| format!("{{ {statements} {value} }}"))
}

fn statement() -> impl Strategy<Value = String> {
    prop_oneof![
        (word(), expr()).prop_map(|(n, e)| format!("let {n} = {e};")),
        (word(), expr()).prop_map(|(n, e)| format!("var {n}: vec3 = {e};")),
        (word(), expr()).prop_map(|(n, e)| format!("{n} *= {e};")),
        (expr(), statements()).prop_map(|(e, s)| format!("if {e} {{ {s} }} else {{ {s} }}")),
        (expr(), expr(), statements()).prop_map(|(a, b, s)| format!("for i in {a} .. {b} {{{s}}}")),
        (expr(), statements()).prop_map(|(a, s)| format!("while ({a}) limit 9 {{{s}}}")),
    ]
}

fn statements() -> impl Strategy<Value = String> {
    let plain = select(vec![
        "break;",
        "x = 1;",
        "",
        "let a = { 2.0 };\n\n\nvar b = a;",
    ]);
    prop::collection::vec(plain, 0..3).prop_map(|all| all.join(" "))
}

fn item() -> impl Strategy<Value = String> {
    let body = prop::collection::vec(statement(), 0..4)
        .prop_map(|all| all.join("\n"))
        .boxed();
    let parameter = (word(), prop::option::of(expr())).prop_map(|(name, default)| match default {
        Some(value) => format!("{name}: float = {value}"),
        None => format!("{name}: bsdf"),
    });
    let parameters = prop::collection::vec(parameter, 0..5)
        .prop_map(|all| all.join(", "))
        .boxed();
    let private = select(vec!["", "", "private "]);
    let meta = select(vec![
        "",
        " in 0.0..1.0",
        " in 0.0 .. 1.0 { label: \"A\", soft: 0.1..0.9 }",
        " { label: \"Width of a brick\", group: \"Size of the bricks\", unit: mm, soft: 1 mm .. 20 mm, }",
    ]);
    prop_oneof![
        (word(), body.clone(), expr(), meta).prop_map(|(n, body, value, meta)| format!(
            "/// Docs.\nmaterial {n} {{ /// More.\nparam p: float = {value}{meta}; {body} surface = {value}; }}"
        )),
        (private.clone(), word(), parameters.clone(), expr())
            .prop_map(|(p, n, list, e)| format!("{p}fn {n}({list}) -> float = {e};")),
        (private.clone(), word(), parameters.clone(), body, expr()).prop_map(
            |(p, n, list, body, e)| format!("{p}fn {n}({list}) -> float {{ {body} {e} }}")
        ),
        (word(), parameters, expr(), expr()).prop_map(|(n, list, e, c)| format!(
            "delta bsdf {n}({list}) {{ let q = {e};\n\n eval(wo, wi) = {e} when {c}; \
             pdf(wo, wi) = {{ let a = 1; a }} when {c}; sample(wo, u) {{ {e} }} }}"
        )),
        (private, word(), expr()).prop_map(|(p, n, e)| format!("{p}const {n}: float = {e};")),
        word().prop_map(|n| format!("struct {n} {{ a: float, /// Docs.\nb: color }}")),
    ]
}

/// A source file.
pub fn program() -> impl Strategy<Value = String> {
    let head = select(vec![
        "",
        "//! Docs.\n\n\nuse std::noise::{perlin,worley as w,};\nuse std::bsdf::diffuse as d;",
        "use a::{a_name_that_is_rather_long, another_name_that_is_rather_long, a_third_name_that_is_too};",
    ]);
    let items = prop::collection::vec(item(), 0..4);
    (head, items).prop_map(|(head, items)| format!("{head}\n{}", items.join("\n")))
}
