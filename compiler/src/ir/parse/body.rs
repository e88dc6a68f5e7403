//! The inside of a function or material: variables and statements.

use std::collections::BTreeMap;

use super::expr::components;
use super::{MAX_NESTING, Parser, Result, Token, Wrong};
use crate::ir::{Block, ExprId, Function, Local, LocalId, Stmt, Type};
use crate::source::Span;

/// Uniforms are numbered below this.
const MAX_UNIFORMS: u32 = 1 << 16;

/// A body while it is read.
pub(super) struct Body<'p> {
    pub(super) p: &'p mut Parser,
    /// What is known of the function so far.
    pub(super) function: Function,
    pub(super) params: BTreeMap<String, u32>,
    /// What `%n` and `$n` are.
    pub(super) values: BTreeMap<u32, ExprId>,
    pub(super) uniforms: BTreeMap<u32, Type>,
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
                sites: Vec::new(),
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
    pub(super) fn variable(&mut self) -> Result<LocalId> {
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
}
