//! Materials: uniforms, patterns and the closure tree.

use super::body::Body;
use super::{MAX_NESTING, Parser, Result, Token, Wrong};
use crate::ir::{
    Closure, ClosureId, Const, Expr, ExprId, ExprKind, Function, Interior, Lobe, Material,
    MaterialParam, Type, surface,
};
use crate::source::Span;

/// A material's outputs while it is read.
#[derive(Default)]
struct Outputs {
    closures: Vec<Closure>,
    surface: Option<ClosureId>,
    emission: Option<ClosureId>,
    interior: Option<Interior>,
    opacity: Option<ExprId>,
}

impl Parser {
    /// `material name(point: SurfacePoint) { uniforms, statements, outputs }`
    pub(super) fn material(&mut self, start: Span) -> Result<()> {
        self.next();
        let name = self.name("a name")?;
        let inputs = self.params()?;
        self.expect("{")?;
        let mut body = Body::new(self, inputs);
        let mut params = Vec::new();
        while body.p.is_word("uniform") {
            params.push(body.uniform(params.len())?);
        }
        body.variables()?;
        body.block_until(|p| p.is("}") || p.is_output())?;
        let mut outputs = Outputs::default();
        while !body.p.is("}") {
            body.output(&mut outputs)?;
        }
        let function = body.finish()?;
        let span = self.since(start);
        self.parsed.materials.push(Material {
            name: name.clone(),
            docs: Vec::new(),
            params,
            body: with_value(function, name, span),
            closures: outputs.closures,
            surface: outputs.surface,
            emission: outputs.emission,
            interior: outputs.interior,
            opacity: outputs.opacity,
            span,
        });
        Ok(())
    }

    /// `name =`
    fn is_output(&self) -> bool {
        matches!(self.peek(), Token::Ident(_)) && *self.ahead(1) == Token::Punct("=")
    }
}

/// Gives a material's body the value that no one uses.
fn with_value(mut f: Function, name: String, span: Span) -> Function {
    f.value = ExprId(f.exprs.len() as u32);
    f.exprs.push(Expr {
        kind: ExprKind::Const(Const::Float(vec![0.0])),
        ty: Type::Float,
        span,
        via: None,
        name: None,
    });
    Function { name, span, ..f }
}

impl Body<'_> {
    /// `uniform $0 name: type as surface_type = default in low .. high input`, the last three words only where they are so
    fn uniform(&mut self, next: usize) -> Result<MaterialParam> {
        self.p.next();
        let start = self.p.here();
        let (at, what) = self.param_index()?;
        if what.number() as usize != next {
            let message = format!("{what} is not the next uniform");
            return Err(Wrong::new(at, message).expected(format!("`${next}`")));
        }
        let local = self.p.local()?;
        self.declare(at, what, local.ty)?;
        let surface_type = self.surface_type(local.ty)?;
        self.p.expect("=")?;
        let default = self.p.constant()?;
        let range = if self.p.eat_word("in") {
            Some((
                self.limit()?,
                self.p.expect("..").and_then(|()| self.limit())?,
            ))
        } else {
            None
        };
        Ok(MaterialParam {
            name: local.name,
            docs: Vec::new(),
            surface_type,
            ty: local.ty,
            default,
            range,
            is_input: self.p.eat_word("input"),
            span: self.p.since(start),
        })
    }

    /// `as color`, or the machine type's own name.
    fn surface_type(&mut self, ty: Type) -> Result<&'static str> {
        let at = self.p.here();
        let written = if self.p.eat_word("as") {
            self.p.name("a type of the language")?
        } else {
            format!("{ty:?}").to_lowercase()
        };
        surface::surface_type(&written, ty).ok_or_else(|| {
            Wrong::new(at, format!("`{written}` is not a type of such uniforms"))
                .expected("a type of the language that is stored so, as in `vec3 as color`")
        })
    }

    fn limit(&mut self) -> Result<f64> {
        match *self.p.peek() {
            Token::Float(x) => {
                self.p.next();
                Ok(x)
            }
            _ => self.p.unexpected("a float"),
        }
    }

    /// `surface = closure`, `interior = medium(...)`, `opacity = operand`
    fn output(&mut self, outputs: &mut Outputs) -> Result<()> {
        let at = self.p.here();
        let name = self.p.name("an output")?;
        self.p.expect("=")?;
        let again = match name.as_str() {
            "surface" => {
                let root = self.closure(&mut outputs.closures, 0)?;
                outputs.surface.replace(root).is_some()
            }
            "emission" => {
                let root = self.closure(&mut outputs.closures, 0)?;
                outputs.emission.replace(root).is_some()
            }
            "interior" => {
                let medium = self.medium(at)?;
                outputs.interior.replace(medium).is_some()
            }
            "opacity" => outputs.opacity.replace(self.operand()?).is_some(),
            _ => {
                let unknown = Wrong::new(at, format!("unknown output `{name}`"));
                return Err(unknown.expected("`surface`, `emission`, `interior` or `opacity`"));
            }
        };
        if again {
            Err(Wrong::new(at, format!("`{name}` is there twice")))
        } else {
            Ok(())
        }
    }

    /// `medium(absorption, ior, priority, scattering, anisotropy) when condition`
    fn medium(&mut self, start: Span) -> Result<Interior> {
        self.p.expect_word("medium")?;
        self.p.expect("(")?;
        let mut parts = [self.operand()?; Interior::PARTS.len()];
        for part in &mut parts[1..] {
            self.p.expect(",")?;
            *part = self.operand()?;
        }
        self.p.expect(")")?;
        let when = if self.p.eat_word("when") {
            Some(self.operand()?)
        } else {
            None
        };
        Ok(Interior {
            when,
            parts,
            span: self.p.since(start),
        })
    }

    /// A node, followed by its children.
    fn closure(&mut self, all: &mut Vec<Closure>, depth: usize) -> Result<ClosureId> {
        let at = self.p.here();
        if depth >= MAX_NESTING {
            let deep = Wrong::new(at, "closures nest too deeply");
            return Err(deep.expected(format!("at most {MAX_NESTING} levels")));
        }
        let kinds = "`lobe`, `layer`, `mix`, `weight`, `add` or `select`";
        let word = self.p.name(kinds)?;
        let operand = match word.as_str() {
            "mix" | "weight" | "select" => self.operand()?,
            _ => ExprId(0),
        };
        let mut child = |body: &mut Self| body.closure(all, depth + 1);
        let node = match word.as_str() {
            "lobe" => Closure::Lobe(self.lobe(at)?),
            "layer" => Closure::Layer(child(self)?, child(self)?),
            "mix" => Closure::Mix(child(self)?, child(self)?, operand),
            "weight" => Closure::Weight(operand, child(self)?),
            "add" => Closure::Add(child(self)?, child(self)?),
            "select" => Closure::Select(operand, child(self)?, child(self)?),
            _ => return Err(Wrong::new(at, format!("unknown closure `{word}`")).expected(kinds)),
        };
        all.push(node);
        Ok(ClosureId(all.len() as u32 - 1))
    }

    /// `name(parameter: value, ...) normal %1 tangent %2`
    fn lobe(&mut self, start: Span) -> Result<Lobe> {
        let at = self.p.here();
        let name = self.p.name("the name of a bsdf or edf")?;
        let Some(&def) = self.p.closures.get(&name) else {
            let unknown = Wrong::new(at, format!("unknown bsdf or edf `{name}`"));
            return Err(unknown.expected("one defined above"));
        };
        self.p.expect("(")?;
        let params = &self.p.parsed.module.closures[def.index()].params;
        let labels: Vec<String> = params.iter().map(|p| p.name.clone()).collect();
        let mut args = Vec::new();
        for (i, label) in labels.iter().enumerate() {
            if i > 0 {
                self.p.expect(",")?;
            }
            self.p.expect_word(label)?;
            self.p.expect(":")?;
            args.push(self.operand()?);
        }
        self.p.expect(")")?;
        let mut framed = |word| {
            if self.p.eat_word(word) {
                self.operand().map(Some)
            } else {
                Ok(None)
            }
        };
        let (normal, tangent) = (framed("normal")?, framed("tangent")?);
        Ok(Lobe {
            def,
            args,
            normal,
            tangent,
            span: self.p.since(start),
            via: None,
        })
    }
}
