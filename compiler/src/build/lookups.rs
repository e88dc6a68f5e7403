//! Which textures compiled materials look up, and how: what the runtime must load, and what code it
//! must provide.

use std::collections::{BTreeMap, BTreeSet};

use crate::abi::{Lookups, TextureSpace};
use crate::closure::Looks;
use crate::ir::{Const, ExprKind, Function, Module, Type};
use crate::program::{CompiledMaterial, Slot};

/// How textures are looked up that are known, and those that are chosen at run time.
#[derive(Default)]
struct Reads {
    known: BTreeMap<(usize, TextureSpace), Lookups>,
    chosen: BTreeMap<TextureSpace, Lookups>,
}

/// What materials look up: every texture with how, in the order of slots. Each material's `textures`,
/// which are those that it may read, become the slots that it does read.
///
/// A lookup whose texture is not known before the code runs may be of any of them.
pub(super) fn slots(module: &Module, materials: &mut [CompiledMaterial]) -> Vec<Slot> {
    let of = |m: &CompiledMaterial| {
        let mut found = Reads::default();
        reached(module, m)
            .into_iter()
            .for_each(|f| found.function(f));
        for (space, lookups) in std::mem::take(&mut found.chosen) {
            let any = m.info.textures.iter();
            any.for_each(|&t| found.note(t, space, lookups));
        }
        found.known
    };
    let own: Vec<_> = materials.iter().map(of).collect();
    let mut all = Reads::default();
    for (&(t, space), &lookups) in own.iter().flatten() {
        all.note(t, space, lookups);
    }
    for (m, known) in materials.iter_mut().zip(own) {
        let slots = all.known.keys().enumerate();
        let read = slots.filter(|(_, texture)| known.contains_key(texture));
        m.info.textures = read.map(|(slot, _)| slot).collect();
    }
    let slots = all.known.into_iter();
    slots.map(|((t, space), l)| (t, space, l)).collect()
}

impl Reads {
    fn note(&mut self, texture: usize, space: TextureSpace, lookups: Lookups) {
        let slot = self.known.entry((texture, space)).or_default();
        *slot = slot.and(lookups);
    }

    fn function(&mut self, f: &Function) {
        for id in f.evaluated() {
            let ExprKind::Op(op, args) = &f.expr(id).kind else {
                continue;
            };
            let (Some(space), Some(&texture)) = (op.texture_space(), args.first()) else {
                continue;
            };
            let mut lookups = match args.get(2).map(|&mode| f.constant(mode)) {
                None => Lookups::default(),
                Some(Some(Const::Int(mode))) => Lookups::of_mode(*mode),
                Some(_) => Lookups::ANY_MODE,
            };
            lookups.alpha = op.texel_part() == (3..4);
            lookups.levels = args.get(1).is_some_and(|&at| f.ty(at) == Type::Vec4);
            if let Some(Const::Int(t)) = f.constant(texture) {
                self.note((*t).max(0) as usize, space, lookups);
            } else {
                let slot = self.chosen.entry(space).or_default();
                *slot = slot.and(lookups);
            }
        }
    }
}

/// The functions of a material, and those that they call.
fn reached<'p>(module: &'p Module, material: &'p CompiledMaterial) -> Vec<&'p Function> {
    let mut found: Vec<&Function> = vec![&material.evaluate];
    found.extend(&material.emission);
    found.extend(material.looks.iter().flat_map(Looks::functions));
    let mut known = BTreeSet::new();
    let mut next = 0;
    while let Some(&f) = found.get(next) {
        let callees = f.calls().filter(|callee| known.insert(callee.index()));
        found.extend(callees.map(|callee| &module.functions[callee.index()]));
        next += 1;
    }
    found
}
