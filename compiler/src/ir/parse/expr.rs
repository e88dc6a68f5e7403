//! Expressions: what is evaluated, operands and constants.

use super::body::{Body, Declared};
use super::{Parser, Result, Token, Wrong};
use crate::ir::build::const_type;
use crate::ir::ops::Op;
use crate::ir::{Const, Expr, ExprId, ExprKind, Type};
use crate::source::Span;

impl Body<'_> {
    pub(super) fn add(&mut self, kind: ExprKind, ty: Type, span: Span) -> ExprId {
        self.function.exprs.push(Expr {
            kind,
            ty,
            span,
            via: None,
            name: None,
        });
        ExprId(self.function.exprs.len() as u32 - 1)
    }

    /// What an expression of type `ty` computes.
    pub(super) fn value(&mut self, ty: Type) -> Result<ExprKind> {
        let Token::Ident(word) = self.p.peek().clone() else {
            return self.projection();
        };
        match self.p.ahead(1) {
            Token::Punct(".") => self.projection(),
            Token::Punct("{") => self.make(),
            Token::Punct("(") if self.p.type_named(&word).is_some() => self.compose(ty),
            Token::Local(_) if word == "load" => {
                self.p.next();
                Ok(ExprKind::Load(self.variable()?))
            }
            Token::Ident(_) if word == "call" && *self.p.ahead(2) == Token::Punct("(") => {
                self.p.next();
                let callee = self.p.callee()?;
                self.p.expect("(")?;
                Ok(ExprKind::Call(callee, self.operands(")")?))
            }
            _ => self.operation(&word),
        }
    }

    /// `op a, b`: of ops with one name, the one for as many operands.
    fn operation(&mut self, name: &str) -> Result<ExprKind> {
        let at = self.p.here();
        self.p.next();
        let mut found = Op::ALL
            .iter()
            .filter(|op| op.info().text == name)
            .peekable();
        if found.peek().is_none() {
            let unknown = Wrong::new(at, format!("unknown operation `{name}`"));
            return Err(unknown.expected("an op, `load`, `call`, a type or an operand"));
        }
        let mut args = vec![self.operand()?];
        while self.p.eat(",") {
            args.push(self.operand()?);
        }
        match found.find(|op| op.arity() == args.len()) {
            Some(op) => Ok(ExprKind::Op(*op, args)),
            None => Err(Wrong::new(
                at,
                format!("`{name}` does not take {} operands", args.len()),
            )),
        }
    }

    fn operands(&mut self, end: &str) -> Result<Vec<ExprId>> {
        let mut out = Vec::new();
        while !self.p.is(end) {
            out.push(self.operand()?);
            if !self.p.eat(",") {
                break;
            }
        }
        self.p.expect(end)?;
        Ok(out)
    }

    /// `vec3(a, b)`
    fn compose(&mut self, ty: Type) -> Result<ExprKind> {
        let at = self.p.here();
        if self.p.ty()? != ty {
            return Err(Wrong::new(
                at,
                "the value has another type than it is said to have",
            ));
        }
        self.p.expect("(")?;
        Ok(ExprKind::Compose(self.operands(")")?))
    }

    /// `Name { a, b }`
    fn make(&mut self) -> Result<ExprKind> {
        let at = self.p.here();
        let Type::Struct(id) = self.p.ty()? else {
            return Err(Wrong::new(at, "this type has no fields").expected("a struct"));
        };
        self.p.expect("{")?;
        Ok(ExprKind::Make(id, self.operands("}")?))
    }

    /// `operand.field` or `operand.xyz`
    fn projection(&mut self) -> Result<ExprKind> {
        let base = self.operand()?;
        self.p.expect(".")?;
        let at = self.p.here();
        let name = self.p.name("a field or components")?;
        let (part, expected) = match self.function.ty(base) {
            Type::Struct(id) => {
                let fields = &self.p.parsed.module.structs[id.index()].fields;
                let index = fields.iter().position(|(n, _)| *n == name);
                (index.map(|i| ExprKind::Field(base, i as u32)), "a field")
            }
            _ => {
                let letters = components(&name);
                (
                    letters.map(|c| ExprKind::Swizzle(base, c)),
                    "up to four of x, y, z, w",
                )
            }
        };
        part.ok_or_else(|| Wrong::new(at, format!("there is no `{name}`")).expected(expected))
    }

    /// A value that is there: `%3`, `$0`, `#0`, a parameter or a constant.
    pub(super) fn operand(&mut self) -> Result<ExprId> {
        let at = self.p.here();
        match self.p.peek().clone() {
            Token::Value(number) => {
                let id = self.values.get(&number).copied().ok_or_else(|| {
                    Wrong::new(at, format!("`%{number}` is used before it is evaluated"))
                })?;
                self.p.next();
                Ok(id)
            }
            Token::MaterialParam(index) => self.outside(at, Declared::Param(index), "uniform"),
            Token::TableValue(index) => self.outside(at, Declared::Table(index), "table"),
            Token::Ident(name) if name != "true" && name != "false" => {
                let index = self.params.get(&name).copied().ok_or_else(|| {
                    Wrong::new(at, format!("unknown name `{name}`"))
                        .expected("`%3`, `$0`, a parameter or a constant")
                })?;
                self.p.next();
                let ty = self.function.params[index as usize].ty;
                Ok(self.add(ExprKind::Param(index), ty, at))
            }
            _ => {
                let value = self.p.constant()?;
                let ty = const_type(&value);
                Ok(self.add(ExprKind::Const(value), ty, at))
            }
        }
    }
}

impl Parser {
    /// `true`, `3`, `0.5` or `(0.5, 1.0)`; a float in parentheses is a float.
    pub(super) fn constant(&mut self) -> Result<Const> {
        let at = self.here();
        match self.next() {
            Token::Ident(word) if word == "true" || word == "false" => {
                Ok(Const::Bool(word == "true"))
            }
            Token::Int(n) => i32::try_from(n).map(Const::Int).map_err(|_| {
                Wrong::new(at, "the int does not fit 32 bits").expected("a point, if it is a float")
            }),
            Token::Float(x) => Ok(Const::Float(vec![x])),
            Token::Punct("(") => {
                let parts = self.list(")", |p| match *p.peek() {
                    Token::Float(x) => {
                        p.next();
                        Ok(x)
                    }
                    _ => p.unexpected("a float"),
                })?;
                match parts.len() {
                    1..=4 => Ok(Const::Float(parts)),
                    n => Err(Wrong::new(at, format!("a vector of {n} floats")).expected("1 to 4")),
                }
            }
            found => {
                let message = format!("unexpected {}", found.describe());
                Err(Wrong::new(at, message).expected("a value"))
            }
        }
    }
}

/// The indices of `xyzw` letters, one to four.
pub(super) fn components(letters: &str) -> Option<Vec<u8>> {
    let index = |c| "xyzw".find(c).map(|i| i as u8);
    let all: Option<Vec<u8>> = letters.chars().map(index).collect();
    all.filter(|all| (1..=4).contains(&all.len()))
}
