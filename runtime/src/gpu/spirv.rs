//! SPIR-V whose arithmetic is rounded as it is written.
//!
//! A driver may contract a product and a sum to one operation that rounds once, and does so as it sees fit: the same
//! function then rounds differently in a kernel of its own and in one that it shares. `NoContraction` forbids that, so
//! that a path has the same bits under every plan. WGSL has no word for it and neither has naga, so it is written into
//! the module that naga makes. Traversal, most of the time of a render, has the same text in every kernel and is left as
//! it is.

use std::collections::{BTreeMap, BTreeSet};

use naga::back::spv;
use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};
use naga::valid::ModuleInfo;
use naga::{Module, ShaderStage};

/// Words before the first instruction.
const HEADER: usize = 5;

/// Opcodes (SPIR-V specification 1.6, section 3.52).
mod op {
    pub const NAME: u32 = 5;
    pub const EXT_INST: u32 = 12;
    pub const TYPE_FLOAT: u32 = 22;
    pub const TYPE_VECTOR: u32 = 23;
    pub const TYPE_MATRIX: u32 = 24;
    pub const FUNCTION: u32 = 54;
    pub const DECORATE: u32 = 71;
    pub const MEMBER_DECORATE: u32 = 72;
    pub const F_NEGATE: u32 = 127;
    /// Arithmetic on floats: sums, differences, products, quotients, remainders, and products of vectors and matrices.
    pub const ARITHMETIC: [u32; 13] = [
        129, 131, 133, 136, 140, 141, 142, 143, 144, 145, 146, 147, 148,
    ];
}

/// The decoration `NoContraction`.
const NO_CONTRACTION: u32 = 42;

/// How a kernel is written.
#[derive(Clone, Copy)]
pub(super) struct Kind {
    /// With checks of array bounds, loops and divisors.
    pub checked: bool,
    /// With workgroup memory that begins as zeros.
    pub zero_workgroup: bool,
}

/// A kernel's module as the driver takes it, if its one bind group has no bindings but the module's. In functions that
/// `contracts` names arithmetic may be contracted.
///
/// # Errors
/// What naga has against it, in words.
pub(super) fn write(
    module: &Module,
    info: &ModuleInfo,
    kind: Kind,
    contracts: &dyn Fn(&str) -> bool,
) -> Result<Vec<u32>, String> {
    let options = spv::Options {
        // Functions are told by their names.
        flags: spv::WriterFlags::DEBUG,
        binding_map: bindings(module),
        zero_initialize_workgroup_memory: if kind.zero_workgroup {
            spv::ZeroInitializeWorkgroupMemoryMode::Polyfill
        } else {
            spv::ZeroInitializeWorkgroupMemoryMode::None
        },
        ..options(kind.checked)
    };
    let entry = spv::PipelineOptions {
        shader_stage: ShaderStage::Compute,
        entry_point: module
            .entry_points
            .first()
            .map_or(String::new(), |e| e.name.clone()),
    };
    let words = spv::write_vec(module, info, &options, Some(&entry)).map_err(|e| e.to_string())?;
    Ok(uncontracted(words, contracts))
}

/// What naga is told of any kernel: with checks of array bounds, loops and divisors or without.
pub(super) fn options(checked: bool) -> spv::Options<'static> {
    let policy = if checked {
        BoundsCheckPolicy::Restrict
    } else {
        BoundsCheckPolicy::Unchecked
    };
    spv::Options {
        // The least that has subgroups.
        lang_version: (1, 3),
        flags: spv::WriterFlags::empty(),
        bounds_check_policies: BoundsCheckPolicies {
            index: policy,
            buffer: policy,
            image_load: policy,
            binding_array: policy,
        },
        force_loop_bounding: checked,
        emit_int_div_checks: checked,
        ..spv::Options::default()
    }
}

/// Where wgpu puts the bindings of a layout: in their order, numbered from 0 on.
fn bindings(module: &Module) -> spv::BindingMap {
    let bound = module.global_variables.iter();
    let bound: BTreeSet<u32> = bound
        .filter_map(|(_, g)| Some(g.binding?.binding))
        .collect();
    let numbered = bound.into_iter().zip(0..).map(|(binding, number)| {
        let resource = naga::ResourceBinding { group: 0, binding };
        let info = spv::BindingInfo {
            descriptor_set: 0,
            binding: number,
            binding_array_size: None,
        };
        (resource, info)
    });
    numbered.collect()
}

/// The instructions of a module: where each begins, its opcode and its operands.
fn instructions(words: &[u32]) -> impl Iterator<Item = (usize, u32, &[u32])> {
    let mut at = HEADER;
    std::iter::from_fn(move || {
        let first = *words.get(at)?;
        let (begin, length) = (at, ((first >> 16) as usize).max(1));
        at += length;
        let operands = words.get(begin + 1..at)?;
        Some((begin, first & 0xffff, operands))
    })
}

/// Decorates the results of arithmetic, but of functions that may contract it.
fn uncontracted(words: Vec<u32>, contracts: &dyn Fn(&str) -> bool) -> Vec<u32> {
    let (mut names, mut floats) = (BTreeMap::new(), BTreeSet::new());
    let mut annotations = None;
    let mut is_left = true;
    let mut decorated = Vec::new();
    for (begin, opcode, operands) in instructions(&words) {
        match (opcode, operands) {
            (op::NAME, [id, text @ ..]) => {
                names.insert(*id, string(text));
            }
            (op::DECORATE | op::MEMBER_DECORATE, _) => {
                annotations.get_or_insert(begin);
            }
            (op::TYPE_FLOAT, [id, ..]) => {
                floats.insert(*id);
            }
            (op::TYPE_VECTOR | op::TYPE_MATRIX, [id, of, ..]) if floats.contains(of) => {
                floats.insert(*id);
            }
            (op::FUNCTION, [_, id, ..]) => {
                is_left = names.get(id).is_some_and(|name| contracts(name));
            }
            (op::EXT_INST | op::F_NEGATE, [kind, id, ..]) if !is_left && floats.contains(kind) => {
                decorated.push(*id);
            }
            (opcode, [_, id, ..]) if !is_left && op::ARITHMETIC.contains(&opcode) => {
                decorated.push(*id);
            }
            _ => {}
        }
    }
    // Every module has a decoration: that of the invocation's index.
    let Some(at) = annotations else {
        return words;
    };
    let more = decorated
        .into_iter()
        .flat_map(|id| [3 << 16 | op::DECORATE, id, NO_CONTRACTION]);
    words[..at]
        .iter()
        .copied()
        .chain(more)
        .chain(words[at..].iter().copied())
        .collect()
}

/// A literal string: UTF-8 with a zero at its end, four bytes a word.
fn string(words: &[u32]) -> String {
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let text = bytes.split(|byte| *byte == 0).next().unwrap_or_default();
    String::from_utf8_lossy(text).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::validate::validate;

    const WGSL: &str = "
        @group(0) @binding(4) var<storage, read_write> values: array<f32>;
        fn free(x: f32) -> f32 {
            return x * x + 1.0;
        }
        fn exact(x: f32) -> f32 {
            let v = vec3<f32>(x) * 2.0 - vec3<f32>(1.0);
            return dot(v, v) / 3.0 + mix(x, -x, 0.25) * f32(u32(x) * 2u + 1u);
        }
        @compute @workgroup_size(64)
        fn main(@builtin(global_invocation_id) id: vec3<u32>) {
            values[id.x] = free(values[id.x]) + exact(values[id.x]);
        }";

    fn written(contracts: &dyn Fn(&str) -> bool) -> Vec<u32> {
        let (module, info) = validate("test", WGSL).expect("valid");
        let kind = Kind {
            checked: false,
            zero_workgroup: true,
        };
        write(&module, &info, kind, contracts).expect("written")
    }

    fn decorated(words: &[u32]) -> BTreeSet<u32> {
        let all = instructions(words);
        let decorations = all.filter_map(|(_, opcode, operands)| match (opcode, operands) {
            (op::DECORATE, [id, NO_CONTRACTION]) => Some(*id),
            _ => None,
        });
        decorations.collect()
    }

    #[test]
    fn arithmetic_of_floats_is_decorated_but_where_it_may_be_contracted() {
        let words = written(&|name| name == "free");
        let found = decorated(&words);
        let (mut name, mut names) = (String::new(), BTreeMap::new());
        let mut counts: BTreeMap<String, [usize; 2]> = BTreeMap::new();
        for (_, opcode, operands) in instructions(&words) {
            match (opcode, operands) {
                (op::NAME, [id, text @ ..]) => drop(names.insert(*id, string(text))),
                (op::FUNCTION, [_, id, ..]) => name = names.get(id).cloned().unwrap_or_default(),
                (opcode, [_, id, ..]) if op::ARITHMETIC.contains(&opcode) => {
                    let count = counts.entry(name.clone()).or_default();
                    count[usize::from(found.contains(id))] += 1;
                }
                _ => {}
            }
        }
        assert_eq!(counts["free"], [2, 0], "{counts:?}");
        assert_eq!(counts["main"], [0, 1], "{counts:?}");
        let [free, exact] = counts["exact"];
        assert!(free == 0 && exact >= 6, "{counts:?}");
        // Also what functions of GLSL's and signs give, and no integer.
        assert!(found.len() > exact + 1);
        assert_eq!(decorated(&written(&|_| true)).len(), 0);
    }

    /// Modules are whole: all instructions end where the next begins, and annotations lie together.
    #[test]
    fn what_is_added_keeps_a_module_in_order() {
        let words = written(&|_| false);
        let mut end = HEADER;
        let mut decorations = Vec::new();
        for (index, (begin, opcode, operands)) in instructions(&words).enumerate() {
            assert_eq!(begin, end);
            end = begin + 1 + operands.len();
            if [op::DECORATE, op::MEMBER_DECORATE].contains(&opcode) {
                decorations.push(index);
            }
        }
        assert_eq!(end, words.len());
        assert!(decorations.windows(2).all(|pair| pair[1] == pair[0] + 1));
    }
}
