//! Checking materials: parameters, patterns and outputs.

use crate::ast::{self, ItemKind};
use crate::diag::{Code, Diagnostic};
use crate::ir::build::Builder;
use crate::ir::{self, ExprKind, Material, Type};

use super::body::{Binding, Body, Operand, Place};
use super::called::{self, Declared, MaterialSignature, Origin};
use super::modules::{ItemRef, ModuleId, list};
use super::{Checker, inputs};

impl Checker<'_> {
    /// The material called `name` in a file, or without a name its only one; beside others, one that is private is a part of
    /// them.
    pub fn find_material(&mut self, module: ModuleId, name: Option<&str>) -> Option<usize> {
        let ast = self.ast(module);
        let is_material = |i: &&ast::Item| matches!(i.kind, ItemKind::Material(_));
        let materials: Vec<&ast::Item> = ast.items.iter().filter(is_material).collect();
        let has_public = materials.iter().any(|i| !i.private);
        let is_meant = |i: &&&ast::Item| name.is_some() || !i.private || !has_public;
        let meant = materials.iter().filter(is_meant);
        let names: Vec<&str> = meant.map(|i| i.name.node.as_str()).collect();
        let path = self.modules[module.0].path.clone();
        let own = path.rsplit_once("::").map(|(_, last)| last);
        let wanted = match (name, names.as_slice()) {
            (Some(name), names) if names.contains(&name) => name,
            (None, [only]) => only,
            // A module of the library is named for the material that it is about.
            (None, names) if own.is_some_and(|own| names.contains(&own)) => own.unwrap_or(""),
            (asked, names) => {
                let message = match asked {
                    Some(name) => format!("`{path}` has no material `{name}`"),
                    None if names.is_empty() => format!("`{path}` defines no material"),
                    None => format!("`{path}` defines several materials"),
                };
                let missing = Diagnostic::without_span(Code::NoMaterial, message);
                let missing = if names.is_empty() {
                    missing.expected("`material name { ... }`")
                } else {
                    missing.expected(format!("one of {}", list(names.iter().copied())))
                };
                self.report(missing.did_you_mean(asked.unwrap_or(""), names.iter().copied()));
                return None;
            }
        };
        ast.items
            .iter()
            .position(|i| i.name.node == wanted && is_material(&i))
    }

    /// Checks the material at `index` of a file, once.
    pub fn material(&mut self, module: ModuleId, index: usize) -> Option<Material> {
        let item = ItemRef { module, index };
        if let Some(known) = self.materials.get(&item) {
            return known.clone();
        }
        let declared = self.declared(module, index)?;
        self.enter_material(item, None)?;
        let material = self.new_material(module, index, &declared);
        self.leave_material();
        self.materials.insert(item, material.clone());
        material
    }

    fn new_material(
        &mut self,
        module: ModuleId,
        index: usize,
        declared: &MaterialSignature,
    ) -> Option<Material> {
        let ast = self.ast(module);
        let item = &ast.items[index];
        let ItemKind::Material(material) = &item.kind else {
            return None;
        };
        let point = self.core_struct("SurfacePoint")?;
        let input = ir::Local {
            name: "point".into(),
            ty: Type::Struct(point),
        };
        let mut body = Body::new(
            self,
            module,
            Builder::new(item.name.node.as_str(), vec![input], item.span),
        );
        body.place = Place::Material;
        body.bind_params(&material.params, declared);
        let ok = body.scoped(|cx| cx.statements(&material.body));
        let scope = body.scopes.close();
        body.report_unused(scope);
        if !ok {
            return None;
        }
        let mut outputs = body.take_outputs(&item.name)?;
        if let Some(whole) = body.whole.take() {
            body.cx.wholes.insert(ItemRef { module, index }, whole);
        }
        let closures = std::mem::take(&mut body.closures);
        let inputs = std::mem::take(&mut body.inputs);
        let value = body.builder.float(0.0, item.span);
        let mut function = body.builder.finish(value);
        if let Some(interior) = &mut outputs.interior {
            self.check_interior(&mut function, interior)?;
        }
        Some(Material {
            name: item.name.node.clone(),
            docs: item.docs.clone(),
            params: called::settable(declared)?
                .into_iter()
                .chain(inputs)
                .collect(),
            body: function,
            closures,
            surface: outputs.surface,
            emission: outputs.emission,
            interior: outputs.interior,
            opacity: outputs.opacity,
            span: item.span,
        })
    }

    /// The index of the image file `path`, relative to `folder`.
    pub(super) fn texture(&mut self, folder: &str, path: &str) -> i32 {
        let path = if path.starts_with('/') {
            path.to_owned()
        } else {
            format!("{folder}{path}")
        };
        let known = self.ir.textures.iter().position(|t| *t == path);
        let index = known.unwrap_or_else(|| {
            self.ir.textures.push(path);
            self.ir.textures.len() - 1
        });
        index as i32
    }
}

impl Body<'_, '_> {
    fn bind_params(&mut self, params: &[ast::MaterialParam], declared: &MaterialSignature) {
        for (p, declared) in params.iter().zip(declared.iter()) {
            // `normal: normal = normal` is the input, unless a caller gives another.
            let of = |d: &Declared| matches!(&d.origin, Origin::Input(i) if *i == p.name.node);
            let same = declared.as_ref().is_some_and(of);
            if inputs::is_input(&p.name.node) && !same {
                let message = format!("`{}` is an input of every material", p.name.node);
                self.report::<()>(
                    Diagnostic::new(Code::Duplicate, p.name.span, message).expected("another name"),
                );
            }
            let operand = declared.as_ref().and_then(|d| self.own_param(d, p));
            let binding = operand.map_or(Binding::Broken, Binding::Fixed);
            self.bind(&p.name, binding, operand.is_some());
        }
    }

    /// What a parameter stands for where the material is checked on its own.
    fn own_param(&mut self, declared: &Declared, p: &ast::MaterialParam) -> Option<Operand> {
        match &declared.origin {
            Origin::Settable(param) => {
                let kind = ExprKind::MaterialParam(self.ranges.len() as u32);
                self.ranges.push(param.range);
                let id = self.builder.add(kind, param.ty, p.name.span);
                self.builder.name(id, &p.name.node);
                Some(Operand::Value(id, declared.ty))
            }
            Origin::Input(input) => self.connected(input, declared.ty, p.default.span),
        }
    }
}
