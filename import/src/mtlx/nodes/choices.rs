//! Choices between values, and what they are made by.

use crate::error::ImportError;
use crate::mtlx::call::Call;
use crate::mtlx::nodes::Make::{Code, Text};
use crate::mtlx::nodes::{Made, NodeRow, one, row};
use crate::mtlx::types::Literal;
use crate::mtlx::types::Type::*;
use crate::mtlx::value::Value;

pub(super) const ROWS: &[NodeRow] = &[
    row(
        "ifgreater",
        "value1:any=1 value2:any=0 in1:same=0 in2:same=0",
        Code(greater),
        "`if value1 > value2 { in1 } else { in2 }`",
    ),
    row(
        "ifgreatereq",
        "value1:any=1 value2:any=0 in1:same=0 in2:same=0",
        Code(greater_or_equal),
        "`if value1 >= value2 { in1 } else { in2 }`",
    ),
    row(
        "ifequal",
        "value1:any=0 value2:any=0 in1:same=0 in2:same=0",
        Code(equal),
        "`if value1 == value2 { in1 } else { in2 }`",
    ),
    row(
        "compare",
        "intest:float=0 cutoff:float=0 in1:same=0 in2:same=0",
        Text("if {intest} > {cutoff} { {in2} } else { {in1} }"),
        "of version 1.36: `if intest > cutoff { in2 } else { in1 }`",
    ),
    row(
        "switch",
        "in1:same=0 in2:same=0 in3:same=0 in4:same=0 in5:same=0 in6:same=0 in7:same=0 in8:same=0 in9:same=0 \
        in10:same=0 which:any=0",
        Code(switch),
        "a chain of `if`; only the input itself where `which` is known",
    ),
    row(
        "and",
        "->boolean in1:boolean=false in2:boolean=false",
        Text("{in1} && {in2}"),
        "",
    ),
    row(
        "or",
        "->boolean in1:boolean=false in2:boolean=false",
        Text("{in1} || {in2}"),
        "",
    ),
    row(
        "xor",
        "->boolean in1:boolean=false in2:boolean=false",
        Text("{in1} != {in2}"),
        "",
    ),
    row("not", "->boolean in:boolean=false", Text("!{in}"), ""),
];

/// Does the node give what it compares?
fn is_test(call: &mut Call<'_, '_, '_>) -> Result<bool, ImportError> {
    Ok(call.ty == Boolean && call.given("in1")?.is_none() && call.given("in2")?.is_none())
}

fn chosen(call: &mut Call<'_, '_, '_>, operator: &str) -> Result<Made, ImportError> {
    if is_test(call)? {
        return call.template(&format!("{{value1}} {operator} {{value2}}"));
    }
    let template = format!("if {{value1}} {operator} {{value2}} {{ {{in1}} }} else {{ {{in2}} }}");
    call.template(&template)
}

fn greater(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    chosen(call, ">")
}

fn greater_or_equal(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    chosen(call, ">=")
}

fn equal(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let value = call.arg("value1")?;
    let other = call.arg("value2")?;
    // A default is a number: beside a truth value it is false.
    if value.ty == Boolean && other.literal == Some(Literal::Boolean(true)) {
        if is_test(call)? {
            return one(value);
        }
        return call.template("if {value1} { {in1} } else { {in2} }");
    }
    chosen(call, "==")
}

fn switch(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let which = call.arg("which")?;
    const INPUTS: [&str; 10] = [
        "in1", "in2", "in3", "in4", "in5", "in6", "in7", "in8", "in9", "in10",
    ];
    if let Some(which) = which.single() {
        let index = which.max(0.0).floor() as usize;
        return match INPUTS.get(index) {
            Some(name) => one(call.arg(name)?),
            None => one(Value::of(
                call.ty,
                Literal::Numbers(vec![0.0; call.ty.count()]),
            )),
        };
    }
    let mut last = 1;
    for (index, name) in INPUTS.iter().enumerate() {
        if call.given(name)?.is_some() {
            last = index + 1;
        }
    }
    let which = call.named("which", which);
    let which_text = match which.ty {
        Integer => which.text,
        _ => format!("floor({})", which.text),
    };
    let number = |index: usize| match which.ty {
        Integer => index.to_string(),
        _ => format!("{index}.0"),
    };
    let mut text = String::new();
    for (index, name) in INPUTS.iter().take(last).enumerate() {
        let value = call.arg(name)?.plain();
        text.push_str(&format!(
            "if {which_text} == {} {{ {value} }} else ",
            number(index)
        ));
    }
    let zero = match call.ty {
        Matrix33 => "mat3(0.0)".to_owned(),
        ty => Value::of(ty, Literal::Numbers(vec![0.0; ty.count()])).text,
    };
    text.push_str(&format!("{{ {zero} }}"));
    one(Value::new(call.ty, text))
}
