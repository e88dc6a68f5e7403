//! The values that a scene gives to a material's parameters.

use crate::ast::{self, ItemKind};
use crate::diag::{Code, Diagnostic};
use crate::ir::build::const_type;
use crate::ir::{Const, Material, MaterialParam};
use crate::moment::Moment;
use crate::parameter_value::ParameterValue;
use crate::parser;
use crate::source::{FileId, Span};
use crate::written::Written;

use super::Checker;
use super::expr::PICTURES;
use super::modules::{ModuleId, list};
use super::purpose::Purpose;
use super::types::{NAMED, Ty};

impl Checker<'_> {
    /// The values of a material's parameters: defaults, and what a scene sets.
    /// `origin` names the scene's setting in diagnostics, and `written` is its place.
    pub fn parameter_values(
        &mut self,
        module: ModuleId,
        material: &Material,
        given: &[(String, ParameterValue)],
        origin: &str,
        written: Option<&Written>,
    ) -> Option<Vec<Const>> {
        let mut values: Vec<Const> = material.params.iter().map(|p| p.default.clone()).collect();
        let mut ok = true;
        for (name, value) in given {
            let (own, value) = value.origin();
            let named = own.map_or_else(|| format!("{origin}, parameter {name}"), str::to_owned);
            let place = written.filter(|_| own.is_none());
            let place = place.and_then(|w| Some((w, w.param(name)?)));
            let origin = own.unwrap_or(origin);
            let Some(index) = material
                .params
                .iter()
                .position(|p| p.name == *name && !p.is_input)
            else {
                if self.only_callers_give(module, material, name, origin) {
                    ok = false;
                    continue;
                }
                let before = self.diagnostics.len();
                let settable = material.params.iter().filter(|p| !p.is_input);
                let names: Vec<&str> = settable.map(|p| p.name.as_str()).collect();
                let message = format!(
                    "{origin}: material `{}` has no parameter `{name}`",
                    material.name
                );
                let unknown = Diagnostic::without_span(Code::UnknownParameter, message)
                    .expected(if names.is_empty() {
                        "no parameters".into()
                    } else {
                        format!("one of {}", list(names.iter().copied()))
                    })
                    .did_you_mean(name, names);
                self.report(unknown);
                if let Some((written, param)) = place {
                    let new = &mut self.diagnostics[before..];
                    written.place(&param.key, &mut self.sources, new);
                }
                ok = false;
                continue;
            };
            let before = self.diagnostics.len();
            let snippet = self.sources.add(named, value.to_string());
            match self.parameter_value(module, &material.params[index], value, snippet) {
                Some(value) => values[index] = value,
                None => ok = false,
            }
            if let Some((written, param)) = place {
                let new = &mut self.diagnostics[before..];
                written.take_over(param, snippet, &mut self.sources, new);
            }
        }
        ok.then_some(values)
    }

    /// The same when a material is seen at some time; refuses times that are no numbers.
    pub fn values_at(
        &mut self,
        material: &Material,
        mut values: Vec<Const>,
        moment: Moment,
    ) -> Option<Vec<Const>> {
        for (param, value) in material.params.iter().zip(&mut values) {
            if !param.is_input {
                continue;
            }
            let Moment { frame, time } = moment;
            let now = if param.name == "frame" { frame } else { time };
            if !(now as f32).is_finite() {
                let message = format!("the {} is {now}", param.name);
                let wrong =
                    Diagnostic::without_span(Code::OutOfRange, message).expected("a finite number");
                self.report(wrong);
                return None;
            }
            *value = Const::Float(vec![now]);
        }
        Some(values)
    }

    /// Reports a setting of a parameter that is an input, if `name` is one.
    fn only_callers_give(
        &mut self,
        module: ModuleId,
        material: &Material,
        name: &str,
        origin: &str,
    ) -> bool {
        let ast = self.ast(module);
        let item = ast.items.iter().find(|i| i.span == material.span);
        let Some(ItemKind::Material(declared)) = item.map(|i| &i.kind) else {
            return false;
        };
        let Some(p) = declared.params.iter().find(|p| p.name.node == name) else {
            return false;
        };
        let message = format!(
            "{origin}: `{name}` of `{}` is an input of the surface, which a scene cannot set",
            material.name
        );
        let wrong = Diagnostic::new(Code::UnknownParameter, p.span, message)
            .expected("parameters whose default is a constant")
            .hint("call the material from another one, with an argument for it");
        self.report(wrong);
        true
    }

    fn parameter_value(
        &mut self,
        module: ModuleId,
        param: &MaterialParam,
        given: &ParameterValue,
        file: FileId,
    ) -> Option<Const> {
        let (_, ty) = NAMED.iter().find(|(n, _)| *n == param.surface_type)?;
        let text = given.to_string();
        let (value, span) = match self.plain(given, *ty) {
            Some(value) => (value, Span::new(file, 0..text.len())),
            None => self.evaluated(module, param, *ty, file, &text)?,
        };
        debug_assert_eq!(const_type(&value), param.ty);
        self.in_range(param, &value, span, "the value")
            .then_some(value)
    }

    /// A value as a constant of type `ty`, where nothing of the language is needed for it but its
    /// implicit conversions.
    fn plain(&mut self, given: &ParameterValue, ty: Ty) -> Option<Const> {
        use ParameterValue::{Bool, Float, Floats, Int, Texture};
        let float = |x: f64| (x as f32).is_finite().then_some(x);
        let int = |i: i64| i32::try_from(i).ok();
        Some(match (given, ty) {
            (Bool(b), Ty::Bool) => Const::Bool(*b),
            (Int(i), Ty::Int) => Const::Int(int(*i)?),
            (Int(i), Ty::Float) => Const::Float(vec![int(*i)?.into()]),
            (Int(i), Ty::Color) => Const::Float(vec![int(*i)?.into(); 3]),
            (Float(x), Ty::Float) => Const::Float(vec![float(*x)?]),
            (Float(x), Ty::Color) => Const::Float(vec![float(*x)?; 3]),
            (Floats(v), ty) if ty.is_vector() && ty.ir()?.width() == Some(v.len()) => {
                Const::Float(v.iter().map(|x| float(*x)).collect::<Option<_>>()?)
            }
            // A scene names files relative to itself; the runtime resolves them.
            (Texture(path), Ty::Texture) => Const::Int(self.texture("", path)),
            _ => return None,
        })
    }

    /// The value of an expression, and its place; says what is wrong if it is no constant of the
    /// parameter's type.
    fn evaluated(
        &mut self,
        module: ModuleId,
        param: &MaterialParam,
        ty: Ty,
        file: FileId,
        text: &str,
    ) -> Option<(Const, Span)> {
        if ty == Ty::Texture && names_a_picture(text) {
            let path = Const::Int(self.texture("", text));
            return Some((path, Span::new(file, 0..text.len())));
        }
        let (expr, diagnostics) = parser::parse_expression(file, text);
        diagnostics.into_iter().for_each(|d| self.report(d));
        let expr = expr?;
        let value = match (&expr.kind, ty) {
            (ast::ExprKind::Str(path), Ty::Texture) => Const::Int(self.texture("", path)),
            _ => self.constant(module, &expr, ty, Purpose::Named(&param.name))?,
        };
        Some((value, expr.span))
    }
}

/// Is a text the name of a picture and no expression? Scenes need no quotes within quotes.
fn names_a_picture(text: &str) -> bool {
    let extension = text.rsplit_once('.').map(|(_, extension)| extension);
    let is_known = |e: &str| PICTURES.iter().any(|known| known.eq_ignore_ascii_case(e));
    extension.is_some_and(is_known) && !text.contains('"')
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{MemoryLoader, diag};

    const TEXT: &str = "
use std::bsdf::diffuse;
material m {
    param b: bool = false;
    param i: int = 1 in -5 .. 5;
    param f: float = 0.5 in -10.0 .. 10.0;
    param l: length = 1 mm;
    param w: length = 10 um in 0 um .. 100 um;
    param v2: vec2 = vec2(0.0);
    param v3: vec3 = vec3(0.0) in 0.0 .. 2.0;
    param v4: vec4 = vec4(0.0);
    param c: color = color(0.0) in 0.0 .. 1.0;
    param p: point = point(0.0);
    param n: normal = normal(0.0, 0.0, 1.0);
    param t: texture = \"none.png\";
    surface = diffuse(color(0.5));
}";

    const NAMES: [&str; 11] = ["b", "i", "f", "l", "v2", "v3", "v4", "c", "p", "n", "t"];

    /// The values of all parameters if `name` is given, and what is said about that.
    fn given(name: &str, value: ParameterValue) -> (Option<Vec<Const>>, String) {
        let mut files = MemoryLoader::default();
        files.add("m.impasto", TEXT);
        let mut checker = Checker::new(&mut files);
        let module = checker.load("m.impasto").expect("it parses");
        let index = checker.find_material(module, None).expect("the only one");
        let material = checker.material(module, index).expect("it checks");
        checker.diagnostics.clear();
        let values =
            checker.parameter_values(module, &material, &[(name.into(), value)], "m", None);
        let said = diag::render::text(&checker.sources, &checker.diagnostics, false);
        (values, said)
    }

    /// A typed value and its text are one constant, or fail with the same words.
    #[test]
    fn typed_values_are_what_their_text_is() {
        let floats = |v: &[f64]| ParameterValue::Floats(v.to_vec());
        let values = [
            ParameterValue::Bool(true),
            ParameterValue::Int(3),
            ParameterValue::Int(-4),
            ParameterValue::Int(7),
            ParameterValue::Int(i32::MIN.into()),
            ParameterValue::Int(1 << 31),
            ParameterValue::Int(1 << 40),
            ParameterValue::Float(0.1),
            ParameterValue::Float(-0.0),
            ParameterValue::Float(1.234_567_890_123),
            ParameterValue::Float(-1e-7),
            ParameterValue::Float(1e30),
            ParameterValue::Float(1e300),
            floats(&[0.25, -1.0]),
            floats(&[1e-7, 0.5, 1.0]),
            floats(&[0.5, 3.0, -0.0]),
            floats(&[1.0, 2.0, 3.0, 4.0]),
            ParameterValue::Texture("a b/c.png".into()),
        ];
        for name in NAMES {
            let mut taken = 0;
            for value in &values {
                // Three components are called what the parameter is.
                let ty = match name {
                    "v3" => "vec3",
                    "p" => "point",
                    "n" => "normal",
                    _ => "color",
                };
                let text = value.to_string();
                let typed = given(name, value.clone());
                let written = given(name, text.replace("color", ty).into());
                assert_eq!(typed.0, written.0, "{name} = {text}");
                let said = typed.1.replace("color(", &format!("{ty}("));
                let lines = |said: &str| -> Vec<String> {
                    // A longer name has more carets under it.
                    let lines = said.lines().map(|l| l.trim_end_matches('^').to_owned());
                    lines.collect()
                };
                assert_eq!(lines(&said), lines(&written.1), "{name} = {text}");
                taken += usize::from(typed.0.is_some());
            }
            // A length needs its unit, which only text has.
            let takes_some = taken > 0 && taken < values.len();
            assert!(takes_some || name == "l", "{name} takes {taken} values");
        }
    }

    /// A picture is named as any file is, with or without quotes of its own.
    #[test]
    fn pictures_need_no_quotes_in_quotes() {
        for text in [
            "ball.png",
            "\"ball.png\"",
            "maps/wood.<UDIM>.EXR",
            "a b/c.jpeg",
        ] {
            let (values, said) = given("t", ParameterValue::Text(text.into()));
            assert!(values.is_some() && said.is_empty(), "{text}: {said}");
        }
        assert_eq!(
            given("t", ParameterValue::Text("ball.png".into())).0,
            given("t", ParameterValue::Text("\"ball.png\"".into())).0
        );
        let (values, said) = given("c", ParameterValue::Text("ball.png".into()));
        assert!(values.is_none() && said.contains("E0201"), "{said}");
    }

    /// Numbers reach the checker in the precision that they were written in.
    #[test]
    fn numbers_are_not_rounded() {
        let x = 0.123_456_789_012_345;
        let (values, said) = given("c", ParameterValue::Floats(vec![x, 0.5, 0.5]));
        let values = values.expect(&said);
        assert!(values.contains(&Const::Float(vec![x, 0.5, 0.5])));
        let (_, said) = given("c", ParameterValue::Floats(vec![0.5, 2.0, 0.5]));
        assert!(
            said.contains("E0305") && said.contains("color(0.5, 2.0, 0.5)"),
            "{said}"
        );
    }

    /// Whatever unit they are written in: the product of a number and a unit is rounded.
    #[test]
    fn ends_of_a_range_are_inside_in_every_unit() {
        for text in [
            "100 um",
            "100000 nm",
            "0.1 mm",
            "0.01 cm",
            "0.0001 m",
            "1e-7 km",
        ] {
            let (values, said) = given("w", ParameterValue::Text(text.into()));
            assert!(values.is_some(), "{said}");
        }
        for text in ["100000.001 nm", "100.000001 um", "0.00010000001 m"] {
            let (values, _) = given("w", ParameterValue::Text(text.into()));
            assert!(values.is_none(), "{text}");
        }
    }
}
