//! The inside of a function or material: variables and statements.

use std::collections::BTreeMap;
use std::fmt;

use super::expr::components;
use super::{MAX_NESTING, Parser, Result, Token, Wrong};
use crate::ir::{Block, ExprId, ExprKind, Function, Local, LocalId, Stmt, Type};
use crate::source::Span;

/// Parameters of materials, and values of the table, are numbered below this.
const MAX_DECLARED: u32 = 1 << 16;

/// What a body reads from outside, and so declares.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Declared {
    /// `$0`: a parameter of the material.
    Param(u32),
    /// `#0`: a value of the parameter table.
    Table(u32),
}

impl Declared {
    pub(super) fn number(self) -> u32 {
        match self {
            Declared::Param(n) | Declared::Table(n) => n,
        }
    }

    fn kind(self) -> ExprKind {
        match self {
            Declared::Param(n) => ExprKind::MaterialParam(n),
            Declared::Table(n) => ExprKind::TableValue(n),
        }
    }
}

impl fmt::Display for Declared {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Declared::Param(n) => write!(f, "`${n}`"),
            Declared::Table(n) => write!(f, "`#{n}`"),
        }
    }
}

/// A body while it is read.
pub(super) struct Body<'p> {
    pub(super) p: &'p mut Parser,
    /// What is known of the function so far.
    pub(super) function: Function,
    pub(super) params: BTreeMap<String, u32>,
    /// What `%n` are.
    pub(super) values: BTreeMap<u32, ExprId>,
    /// The types of `$n` and `#n`, by their tokens.
    pub(super) declared: BTreeMap<Declared, Type>,
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
            declared: BTreeMap::new(),
            depth: 0,
        }
    }

    /// `{` and the declarations of a function.
    pub(super) fn open(&mut self) -> Result<()> {
        self.p.expect("{")?;
        self.declarations("uniform", Self::param_index)?;
        self.declarations("table", Self::table_index)?;
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

    /// `uniform $0: type`, or `table #0: type`, as often as it is there.
    fn declarations(
        &mut self,
        word: &str,
        name: fn(&mut Self) -> Result<(Span, Declared)>,
    ) -> Result<()> {
        while self.p.eat_word(word) {
            let (at, what) = name(self)?;
            self.p.expect(":")?;
            let ty = self.p.ty()?;
            self.declare(at, what, ty)?;
        }
        Ok(())
    }

    /// `$3` in a declaration.
    pub(super) fn param_index(&mut self) -> Result<(Span, Declared)> {
        let at = self.p.here();
        let Token::MaterialParam(index) = *self.p.peek() else {
            return self.p.unexpected("a uniform such as `$0`");
        };
        self.p.next();
        Ok((at, Declared::Param(index)))
    }

    /// `#3` in a declaration.
    fn table_index(&mut self) -> Result<(Span, Declared)> {
        let at = self.p.here();
        let Token::TableValue(index) = *self.p.peek() else {
            return self.p.unexpected("a value of the table such as `#0`");
        };
        self.p.next();
        Ok((at, Declared::Table(index)))
    }

    pub(super) fn declare(&mut self, at: Span, what: Declared, ty: Type) -> Result<()> {
        if what.number() >= MAX_DECLARED {
            let far = Wrong::new(at, format!("the number of {what} is too large"));
            return Err(far.expected(format!("a number below {MAX_DECLARED}")));
        }
        match self.declared.insert(what, ty) {
            None => Ok(()),
            Some(_) => Err(Wrong::new(at, format!("{what} is declared twice"))),
        }
    }

    /// What was declared by this name, as an expression.
    pub(super) fn outside(&mut self, at: Span, what: Declared, word: &str) -> Result<ExprId> {
        let ty = self.declared.get(&what).copied().ok_or_else(|| {
            Wrong::new(at, format!("unknown {word} {what}"))
                .expected(format!("one declared by `{word}` at the top"))
        })?;
        self.p.next();
        Ok(self.add(what.kind(), ty, at))
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
        let name = if self.p.is(":") {
            None
        } else {
            Some(self.p.name("`:` or a name")?)
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
        let part = if self.p.eat(".") {
            let at = self.p.here();
            let letters = self.p.name("x, y, z or w")?;
            match components(&letters).as_deref() {
                Some([one]) => Some(*one),
                _ => return Err(Wrong::new(at, "no component").expected("x, y, z or w")),
            }
        } else {
            None
        };
        self.p.expect("=")?;
        Ok(Stmt::Store(local, part, self.operand()?))
    }

    fn branch(&mut self) -> Result<Stmt> {
        self.p.next();
        let cond = self.operand()?;
        let then = self.braces()?;
        let otherwise = if self.p.eat_word("else") {
            self.braces()?
        } else {
            Block::new()
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
