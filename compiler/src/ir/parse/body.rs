//! The inside of a function or material: variables, statements and expressions.

use std::collections::BTreeMap;

use super::{MAX_NESTING, Parser, Result, Token, Wrong};
use crate::ir::build::const_type;
use crate::ir::{Block, Const, Expr, ExprId, ExprKind, Function, Local, LocalId, Stmt, Type};
use crate::ops::Op;
use crate::source::Span;

/// Uniforms are numbered below this.
const MAX_UNIFORMS: u32 = 1 << 16;

/// A body while it is read.
pub(super) struct Body<'p> {
    pub(super) p: &'p mut Parser,
    /// What is known of the function so far.
    function: Function,
    params: BTreeMap<String, u32>,
    /// What `%n` and `$n` are.
    values: BTreeMap<u32, ExprId>,
    uniforms: BTreeMap<u32, Type>,
    depth: usize,
}

impl<'p> Body<'p> {
    pub(super) fn new(p: &'p mut Parser, params: Vec<Local>) -> Self {
        let names = params.iter().enumerate();
        let names = names.map(|(i, l)| (l.name.clone(), i as u32)).collect();
        let span = p.here();
        Self {
            p,
            function: Function {
                name: String::new(),
                params,
                result: Type::Float,
                locals: Vec::new(),
                exprs: Vec::new(),
                body: Vec::new(),
                value: ExprId(0),
                turns: 1,
                span,
            },
            params: names,
            values: BTreeMap::new(),
            uniforms: BTreeMap::new(),
            depth: 0,
        }
    }

    /// `{` and the declarations of a function.
    pub(super) fn open(&mut self) -> Result<()> {
        self.p.expect("{")?;
        while self.p.eat_word("uniform") {
            let (at, index) = self.uniform_index()?;
            self.p.expect(":")?;
            let ty = self.p.ty()?;
            self.declare_uniform(at, index, ty)?;
        }
        self.variables()
    }

    /// `var @0.name: type ...`
    pub(super) fn variables(&mut self) -> Result<()> {
        while self.p.eat_word("var") {
            let next = self.function.locals.len();
            match self.p.peek() {
                Token::Local(n) if *n as usize == next => self.p.next(),
                _ => return self.p.unexpected(&format!("`@{next}`, the next variable")),
            };
            self.p.expect(".")?;
            let local = self.p.local()?;
            self.function.locals.push(local);
        }
        Ok(())
    }

    /// `$3` in a declaration.
    pub(super) fn uniform_index(&mut self) -> Result<(Span, u32)> {
        let at = self.p.here();
        let Token::Uniform(index) = *self.p.peek() else {
            return self.p.unexpected("a uniform such as `$0`");
        };
        self.p.next();
        Ok((at, index))
    }

    pub(super) fn declare_uniform(&mut self, at: Span, index: u32, ty: Type) -> Result<()> {
        if index >= MAX_UNIFORMS {
            let far = Wrong::new(at, "the number of the uniform is too large");
            return Err(far.expected(format!("a number below {MAX_UNIFORMS}")));
        }
        match self.uniforms.insert(index, ty) {
            None => Ok(()),
            Some(_) => Err(Wrong::new(at, format!("`${index}` is declared twice"))),
        }
    }

    /// Statements into the function's body, up to where `end` holds.
    pub(super) fn block_until(&mut self, end: fn(&Parser) -> bool) -> Result<()> {
        let mut block = Block::new();
        while !end(self.p) {
            block.push(self.stmt()?);
        }
        self.function.body = block;
        Ok(())
    }

    /// `return value }`
    pub(super) fn returned(&mut self) -> Result<ExprId> {
        self.p.expect_word("return")?;
        self.operand()
    }

    /// `}`, and the function without what its head says.
    pub(super) fn finish(self) -> Result<Function> {
        self.p.expect("}")?;
        Ok(self.function)
    }

    // ---- Statements --------------------------------------------------------------------

    fn stmt(&mut self) -> Result<Stmt> {
        match self.p.peek().clone() {
            Token::Value(number) => self.eval(number),
            Token::Local(_) => self.store(),
            Token::Ident(word) => match word.as_str() {
                "if" => self.branch(),
                "for" => self.for_loop(),
                "loop" => self.while_loop(),
                "break" => {
                    self.p.next();
                    Ok(Stmt::Break)
                }
                "continue" => {
                    self.p.next();
                    Ok(Stmt::Continue)
                }
                _ => self.p.unexpected("a statement"),
            },
            _ => self.p.unexpected("a statement"),
        }
    }

    /// `{ ... }`
    fn braces(&mut self) -> Result<Block> {
        if self.depth >= MAX_NESTING {
            let deep = Wrong::new(self.p.here(), "blocks nest too deeply");
            return Err(deep.expected(format!("at most {MAX_NESTING} levels")));
        }
        self.p.expect("{")?;
        self.depth += 1;
        let mut block = Block::new();
        while !self.p.eat("}") {
            block.push(self.stmt()?);
        }
        self.depth -= 1;
        Ok(block)
    }

    /// `%3 name: type = what`
    fn eval(&mut self, number: u32) -> Result<Stmt> {
        let start = self.p.here();
        self.p.next();
        let name = match self.p.is(":") {
            true => None,
            false => Some(self.p.name("`:` or a name")?),
        };
        self.p.expect(":")?;
        let ty = self.p.ty()?;
        self.p.expect("=")?;
        let kind = self.value(ty)?;
        let id = self.add(kind, ty, self.p.since(start));
        self.function.exprs[id.index()].name = name;
        if self.values.insert(number, id).is_some() {
            let twice = Wrong::new(start, format!("`%{number}` is evaluated twice"));
            return Err(twice.expected("a new number"));
        }
        Ok(Stmt::Eval(id))
    }

    /// `@0.name.x = operand`
    fn store(&mut self) -> Result<Stmt> {
        let local = self.variable()?;
        let part = match self.p.eat(".") {
            true => {
                let at = self.p.here();
                let letters = self.p.name("x, y, z or w")?;
                match components(&letters).as_deref() {
                    Some([one]) => Some(*one),
                    _ => return Err(Wrong::new(at, "no component").expected("x, y, z or w")),
                }
            }
            false => None,
        };
        self.p.expect("=")?;
        Ok(Stmt::Store(local, part, self.operand()?))
    }

    fn branch(&mut self) -> Result<Stmt> {
        self.p.next();
        let cond = self.operand()?;
        let then = self.braces()?;
        let otherwise = match self.p.eat_word("else") {
            true => self.braces()?,
            false => Block::new(),
        };
        Ok(Stmt::If(cond, then, otherwise))
    }

    /// `for @0.i in low .. high { ... }`
    fn for_loop(&mut self) -> Result<Stmt> {
        self.p.next();
        let local = self.variable()?;
        self.p.expect_word("in")?;
        let low = self.operand()?;
        self.p.expect("..")?;
        let high = self.operand()?;
        let body = self.braces()?;
        Ok(Stmt::For {
            local,
            low,
            high,
            body,
        })
    }

    /// `loop limit 8 { head } while test { body }`
    fn while_loop(&mut self) -> Result<Stmt> {
        self.p.next();
        self.p.expect_word("limit")?;
        let limit = self.p.count(u64::from(u32::MAX), "a number of turns")? as u32;
        let head = self.braces()?;
        self.p.expect_word("while")?;
        let test = self.operand()?;
        let body = self.braces()?;
        Ok(Stmt::While {
            head,
            test,
            limit,
            body,
        })
    }

    /// `@0.name`
    fn variable(&mut self) -> Result<LocalId> {
        let at = self.p.here();
        let Token::Local(index) = *self.p.peek() else {
            return self.p.unexpected("a variable such as `@0.name`");
        };
        self.p.next();
        self.p.expect(".")?;
        let name = self.p.name("the variable's name")?;
        match self.function.locals.get(index as usize) {
            Some(local) if local.name == name => Ok(LocalId(index)),
            Some(local) => Err(
                Wrong::new(at, format!("`@{index}` is called `{}`", local.name))
                    .expected(format!("`@{index}.{}`", local.name)),
            ),
            None => Err(Wrong::new(at, format!("unknown variable `@{index}`"))
                .expected("a variable declared by `var` at the top")),
        }
    }

    // ---- Expressions -------------------------------------------------------------------

    fn add(&mut self, kind: ExprKind, ty: Type, span: Span) -> ExprId {
        self.function.exprs.push(Expr {
            kind,
            ty,
            span,
            name: None,
        });
        ExprId(self.function.exprs.len() as u32 - 1)
    }

    /// What an expression of type `ty` computes.
    fn value(&mut self, ty: Type) -> Result<ExprKind> {
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

    /// A value that is there: `%3`, `$0`, a parameter or a constant.
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
            Token::Uniform(index) => {
                let ty = self.uniforms.get(&index).copied().ok_or_else(|| {
                    Wrong::new(at, format!("unknown uniform `${index}`"))
                        .expected("a uniform declared by `uniform` at the top")
                })?;
                self.p.next();
                Ok(self.add(ExprKind::Uniform(index), ty, at))
            }
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
fn components(letters: &str) -> Option<Vec<u8>> {
    let index = |c| "xyzw".find(c).map(|i| i as u8);
    let all: Option<Vec<u8>> = letters.chars().map(index).collect();
    all.filter(|all| (1..=4).contains(&all.len()))
}
