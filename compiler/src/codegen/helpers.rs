//! The functions behind ops that WGSL leaves undefined somewhere: written only if used.

use std::collections::BTreeSet;
use std::fmt::Write;

use super::type_name;
use crate::abi::TextureSpace;
use crate::ir::Type;
use crate::ir::ops::{Op, Wgsl};
use crate::program::Program;

/// The helpers that a module uses.
#[derive(Default)]
pub struct Helpers {
    used: BTreeSet<(Op, Type)>,
    /// Does light walk below some material?
    pub walks: bool,
    /// How textures are read that are chosen at run time.
    pub texture_slots: BTreeSet<TextureSpace>,
}

impl Helpers {
    /// The name of the helper of `op` on operands of type `ty`; it will be printed.
    pub fn name(&mut self, op: Op, ty: Type, text: &str) -> String {
        if matches!(op, Op::Hash2 | Op::Hash3) {
            self.used.insert((Op::Hash1, Type::Int));
        }
        self.used.insert((op, ty));
        helper_name(text, ty)
    }

    /// The name of `select` on values of type `ty`; WGSL has it for scalars and vectors only.
    pub fn select(&mut self, program: &Program, ty: Type) -> String {
        if matches!(ty, Type::Mat3 | Type::Struct(_)) {
            self.used.insert((Op::Select, ty));
            return select_name(type_name(program, ty));
        }
        "select".into()
    }

    /// Prints the helpers used.
    pub fn print(&self, program: &Program, out: &mut String) {
        for &(op, ty) in &self.used {
            if op == Op::Select {
                select(out, type_name(program, ty));
                continue;
            }
            let info = op.info();
            let row = info
                .wgsl_int
                .filter(|_| ty == Type::Int)
                .unwrap_or(info.wgsl);
            let Wgsl::Helper(text, body) = row else {
                continue;
            };
            let name = helper_name(text, ty);
            match op {
                Op::MaxComponent => reduction(out, &name, "max", ty),
                Op::MinComponent => reduction(out, &name, "min", ty),
                _ => {
                    let _ = writeln!(
                        out,
                        "fn {name}{}\n",
                        with_type(body, type_name(program, ty))
                    );
                }
            }
        }
        for &space in &self.texture_slots {
            texture_slot(program, space, out);
        }
    }
}

/// Slots that are listed in code. Drivers take long for longer lists that functions have.
const MOST_LISTED: usize = 32;

/// The function from a texture to its slot.
fn texture_slot(program: &Program, space: TextureSpace, out: &mut String) {
    let name = texture_slot_name(space);
    let n = program.module.textures.len().max(1);
    if n > MOST_LISTED {
        let read = program.textures.iter().enumerate();
        let read = read.filter(|(_, (_, read_as, _))| *read_as == space);
        let slots: Vec<(usize, usize)> =
            read.map(|(slot, (texture, ..))| (*texture, slot)).collect();
        let _ = writeln!(out, "fn {name}(texture: i32) -> u32 {{");
        for run in runs(&slots).iter().rev() {
            let Run {
                texture,
                slot,
                step,
            } = run;
            let value = format!("u32({slot} + {step} * (texture - {texture}))");
            let _ = writeln!(out, "    if texture >= {texture} {{ return {value}; }}");
        }
        let _ = writeln!(out, "    return 0u;\n}}\n");
        return;
    }
    let slots: Vec<String> = (0..program.module.textures.len())
        .map(|t| format!("{}u", program.slot(t, space)))
        .collect();
    let _ = writeln!(
        out,
        "fn {name}(texture: i32) -> u32 {{\n    var slots = array<u32, {n}>({});\n    return slots[clamp(texture, 0, {})];\n}}\n",
        slots.join(", "),
        n - 1
    );
}

/// Textures whose slots lie `step` apart from one texture to the next, from `texture` in `slot` on.
#[derive(Debug, PartialEq)]
struct Run {
    texture: usize,
    slot: usize,
    step: usize,
}

/// The runs of ascending textures with their slots.
fn runs(slots: &[(usize, usize)]) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    let mut alone = true;
    for &(texture, slot) in slots {
        if let Some(last) = runs.last_mut() {
            let (right, up) = (texture - last.texture, slot - last.slot);
            if alone && up.is_multiple_of(right) {
                last.step = up / right;
                alone = false;
                continue;
            }
            if !alone && up == right * last.step {
                continue;
            }
        }
        runs.push(Run {
            texture,
            slot,
            step: 0,
        });
        alone = true;
    }
    runs
}

/// The function from a texture to the slot where it is read in one way.
pub fn texture_slot_name(space: TextureSpace) -> &'static str {
    match space {
        TextureSpace::Color => "op_texture_slot",
        TextureSpace::Data => "op_texture_slot_data",
    }
}

/// `op_safe_div_3`: prefixed like all generated names, with the width of vectors.
fn helper_name(text: &str, ty: Type) -> String {
    match ty.width() {
        Some(w) if w > 1 => format!("op_{text}_{w}"),
        _ => format!("op_{text}"),
    }
}

fn select_name(ty: &str) -> String {
    format!("op_select_{ty}")
}

/// `select` for a type that WGSL's own does not take.
fn select(out: &mut String, ty: &str) {
    let _ = writeln!(
        out,
        "fn {}(no: {ty}, yes: {ty}, c: bool) -> {ty} {{ if c {{ return yes; }} return no; }}\n",
        select_name(ty)
    );
}

/// The largest or smallest component of a vector.
fn reduction(out: &mut String, name: &str, op: &str, ty: Type) {
    let letters = &["x", "y", "z", "w"][..ty.width().unwrap_or(1)];
    let nested = letters[1..]
        .iter()
        .fold(format!("v.{}", letters[0]), |acc, l| {
            format!("{op}({acc}, v.{l})")
        });
    let width = letters.len();
    let _ = writeln!(
        out,
        "fn {name}(v: vec{width}f) -> f32 {{ return {nested}; }}\n"
    );
}

/// A helper's body with its operand type in place of the word `T`.
fn with_type(body: &str, ty: &str) -> String {
    let mut out = String::with_capacity(body.len() + 16);
    let mut word = String::new();
    for c in body.chars().chain([' ']) {
        if c.is_ascii_alphanumeric() || c == '_' || c == '.' {
            word.push(c);
            continue;
        }
        out.push_str(if word == "T" { ty } else { &word });
        word.clear();
        out.push(c);
    }
    out.pop();
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_give_every_texture_its_slot() {
        let of = |slots: &[usize]| -> Vec<(usize, usize)> {
            slots
                .iter()
                .copied()
                .enumerate()
                .map(|(slot, t)| (t, slot))
                .collect()
        };
        let doubled: Vec<(usize, usize)> = (0..100).map(|t| (t, 2 * t + 1)).collect();
        let mixed = of(&[3, 4, 5, 9, 10, 12, 14, 20, 21]);
        for (slots, most) in [(of(&[7]), 1), (doubled, 1), (mixed, 5)] {
            let runs = runs(&slots);
            assert!(runs.len() <= most, "{runs:?}");
            for (texture, slot) in slots {
                let run = runs.iter().rev().find(|run| texture >= run.texture);
                let found = run.map(|run| run.slot + run.step * (texture - run.texture));
                assert_eq!(found, Some(slot), "{texture} in {runs:?}");
            }
        }
    }
}
