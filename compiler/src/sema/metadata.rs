//! What a parameter says of itself to user interfaces: `{ label: "IOR", group: "Coat", soft: 1.2 ..
//! 2.0, unit: mm }`. None of it changes what a material means, so it stays out of the IR; all of it
//! is checked, since no one would notice a slider that does not fit its parameter.

use crate::ast::{self, Entry, ExprKind, Unit};
use crate::diag::{Code, Diagnostic};
use crate::ir::{Const, MaterialParam};
use crate::source::Span;

use super::Checker;
use super::modules::{ModuleId, list};
use super::types::Ty;

/// The keys there are.
const KEYS: [&str; 4] = ["label", "group", "soft", "unit"];

/// What a parameter says of itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metadata {
    /// Its name for people.
    pub label: Option<String>,
    /// What it stands together with.
    pub group: Option<String>,
    /// The range that values commonly lie in, with its place; in metres or radians.
    pub soft: Option<((f64, f64), Span)>,
    /// What lengths or angles are shown in.
    pub unit: Option<Unit>,
}

impl Checker<'_> {
    /// The metadata of a parameter of type `ty`.
    pub(super) fn metadata(
        &mut self,
        module: ModuleId,
        p: &ast::MaterialParam,
        ty: Ty,
    ) -> Option<Metadata> {
        let mut found = Metadata::default();
        let mut ok = Some(());
        for (i, entry) in p.metadata.iter().enumerate() {
            let earlier = &p.metadata[..i];
            let entry = match earlier.iter().find(|e| e.key.node == entry.key.node) {
                Some(first) => self.stated_twice(entry, first),
                None => self.entry(module, entry, ty, &mut found),
            };
            ok = ok.and(entry);
        }
        ok.map(|()| found)
    }

    fn stated_twice<T>(&mut self, entry: &Entry, first: &Entry) -> Option<T> {
        let message = format!("`{}` is stated twice", entry.key.node);
        let twice = Diagnostic::new(Code::Duplicate, entry.key.span, message)
            .expected("each key once")
            .label(first.key.span, "first stated here");
        self.refuse(twice)
    }

    fn entry(
        &mut self,
        module: ModuleId,
        entry: &Entry,
        ty: Ty,
        found: &mut Metadata,
    ) -> Option<()> {
        match entry.key.node.as_str() {
            "label" => found.label = Some(self.text(entry)?),
            "group" => found.group = Some(self.text(entry)?),
            "soft" => found.soft = Some(self.soft_range(module, entry, ty)?),
            "unit" => found.unit = Some(self.unit(entry, ty)?),
            unknown => {
                let message = format!("a parameter has no `{unknown}`");
                let wrong = Diagnostic::new(Code::Metadata, entry.key.span, message)
                    .expected(format!("one of {}", list(KEYS)));
                return self.refuse(match unknown {
                    "range" | "min" | "max" | "hard" => {
                        wrong.hint("limits stand before the block: `= 0.5 in 0.0 .. 1.0 { ... }`")
                    }
                    "name" | "displayName" | "display_name" => wrong.hint("it is called `label`"),
                    "docs" | "help" | "description" => {
                        wrong.hint("what a parameter is stands in `///` above it")
                    }
                    _ => wrong.did_you_mean(unknown, KEYS),
                });
            }
        }
        Some(())
    }

    fn text(&mut self, entry: &Entry) -> Option<String> {
        match (&entry.value.kind, &entry.high) {
            (ExprKind::Str(text), None) if !text.trim().is_empty() => Some(text.clone()),
            _ => {
                let key = &entry.key.node;
                let message = format!("`{key}` is a text that is not empty");
                let wrong = Diagnostic::new(Code::Metadata, place(entry), message);
                self.refuse(wrong.expected(format!("a text, as in `{key}: \"Coat\"`")))
            }
        }
    }

    fn soft_range(
        &mut self,
        module: ModuleId,
        entry: &Entry,
        ty: Ty,
    ) -> Option<((f64, f64), Span)> {
        self.may_have_range(ty, entry.key.span, "soft range")?;
        let Some(high) = &entry.high else {
            let wrong = Diagnostic::new(Code::Metadata, place(entry), "`soft` is a range")
                .expected("two limits, as in `soft: 0.0 .. 1.0`");
            return self.refuse(wrong);
        };
        let range = self.range(module, &entry.value, high, ty)?;
        Some((range, place(entry)))
    }

    /// Reports a range of what has no order.
    pub(super) fn may_have_range(&mut self, ty: Ty, span: Span, what: &str) -> Option<()> {
        if !matches!(ty, Ty::Bool | Ty::Texture) {
            return Some(());
        }
        let message = format!("{} has no {what}", self.a_type(ty));
        let wrong = Diagnostic::new(Code::Metadata, span, message)
            .expected("a range of a number, vector or color only");
        self.refuse(wrong)
    }

    fn unit(&mut self, entry: &Entry, ty: Ty) -> Option<Unit> {
        let known = |angle: bool| {
            let units = Unit::ALL.iter().filter(move |u| u.0.is_angle() == angle);
            units.map(|u| u.1)
        };
        if !ty.is_dimension() {
            let message = format!("{} has no unit", self.a_type(ty));
            let wrong = Diagnostic::new(Code::Metadata, entry.key.span, message)
                .expected("a unit of a length or an angle only")
                .hint("declare the parameter as `length` or `angle`");
            return self.refuse(wrong);
        }
        let expected = format!("one of {}", list(known(ty == Ty::Angle)));
        let name = match (&entry.value.kind, &entry.high) {
            (ExprKind::Name(name), None) => name.as_str(),
            _ => {
                let wrong = Diagnostic::new(Code::Metadata, place(entry), "`unit` is a unit");
                return self.refuse(wrong.expected(expected));
            }
        };
        let Some(unit) = Unit::from_name(name) else {
            let message = format!("there is no unit `{name}`");
            let wrong = Diagnostic::new(Code::UnknownUnit, entry.value.span, message);
            let wrong = wrong.expected(expected);
            return self.refuse(wrong.did_you_mean(name, known(ty == Ty::Angle)));
        };
        if unit.is_angle() != (ty == Ty::Angle) {
            let message = format!("`{name}` is no unit of {}", self.a_type(ty));
            let wrong = Diagnostic::new(Code::Metadata, entry.value.span, message);
            return self.refuse(wrong.expected(expected));
        }
        Some(unit)
    }

    /// Reports a soft range that is not within the hard one and around the default.
    pub(super) fn soft_fits(
        &mut self,
        param: &MaterialParam,
        metadata: &Metadata,
        default: Span,
    ) -> Option<()> {
        let Some((soft, span)) = metadata.soft else {
            return Some(());
        };
        let outside = |x: f64| x < soft.0 || soft.1 < x;
        let default_outside = match &param.default {
            Const::Float(v) => v.iter().any(|&x| outside(x)),
            Const::Int(i) => outside(f64::from(*i)),
            Const::Bool(_) => false,
        };
        let name = &param.name;
        let wrong = match param.range {
            Some((low, high)) if soft.0 < low || high < soft.1 => {
                let message = format!("the soft range of `{name}` is wider than its range");
                Diagnostic::new(Code::Metadata, span, message)
                    .expected(format!("limits from {} to {}", low as f32, high as f32))
            }
            _ if default_outside => {
                let message = format!("the default of `{name}` is outside its soft range");
                Diagnostic::new(Code::Metadata, span, message)
                    .expected("a soft range around the default")
                    .label(default, "the default")
            }
            _ => return Some(()),
        };
        self.refuse(wrong)
    }

    fn refuse<T>(&mut self, wrong: Diagnostic) -> Option<T> {
        self.report(wrong);
        None
    }
}

/// The value of an entry.
fn place(entry: &Entry) -> Span {
    let high = entry.high.as_ref();
    high.map_or(entry.value.span, |high| entry.value.span.to(high.span))
}
