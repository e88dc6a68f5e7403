//! One IR function as WGSL that a person can review.
//!
//! A value that a `let` named keeps its name; one that is used once, nearby, stands where it is
//! used; the rest are numbered in order.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use super::helpers::Helpers;
use super::walk::{counters, stored, table_values};
use super::{inliner, type_name};
use crate::abi::{self, PARAMETERS, TextureSpace, sample_declares};
use crate::ir::ops::{Op, Shape, Wgsl};
use crate::ir::{Block, Const, ExprId, ExprKind, Function, LocalId, Stmt, Type};
use crate::parameters::{Place, TableLayout};
use crate::program::{Program, identifier, unique};
use crate::source::Span;

/// Prints a function under a name. One that reads the parameter table gets the first row of its instance
/// as its first parameter, and `layout` tells where they lie.
pub fn print(
    program: &Program,
    f: &Function,
    name: &str,
    layout: Option<&TableLayout>,
    helpers: &mut Helpers,
    out: &mut String,
) {
    let mut taken = called_names(program, f);
    let row = layout.map(|_| unique(&mut taken, "row"));
    let params: Vec<String> = f
        .params
        .iter()
        .map(|p| unique(&mut taken, &p.name))
        .collect();
    let counters = counters(&f.body);
    let locals = f
        .locals
        .iter()
        .map(|l| unique(&mut taken, &l.name))
        .collect();
    let mut printer = Printer {
        program,
        f,
        helpers,
        out,
        params,
        locals,
        names: vec![None; f.exprs.len()],
        inline: inliner::decide(f),
        taken,
        next: 0,
        origin: (f.span, program.origin(f.span)),
    };
    printer.function(name, &counters, row.as_deref().zip(layout));
}

/// Names that the function's text refers to, which its own variables must not hide.
fn called_names(program: &Program, f: &Function) -> BTreeMap<String, u32> {
    let functions = f.calls().map(|id| program.names.function(id.index()));
    let structs = f.exprs.iter().filter_map(|e| match e.ty {
        Type::Struct(id) => Some(program.names.structure(id)),
        _ => None,
    });
    let lookups = [
        abi::TEXTURE_FETCH,
        abi::TEXTURE_FETCH_AS,
        abi::TEXTURE_FETCH_WIDE,
    ];
    functions
        .chain(structs)
        .chain(lookups)
        .map(|name| (name.to_owned(), 1))
        .collect()
}

struct Printer<'a> {
    program: &'a Program,
    f: &'a Function,
    helpers: &'a mut Helpers,
    out: &'a mut String,
    params: Vec<String>,
    locals: Vec<String>,
    /// What each evaluated expression is called, or its text if it stands where it is used.
    names: Vec<Option<String>>,
    inline: Vec<bool>,
    taken: BTreeMap<String, u32>,
    next: u32,
    /// Where the last line came from: the next often comes from there too.
    origin: (Span, String),
}

impl Printer<'_> {
    fn function(
        &mut self,
        name: &str,
        counters: &BTreeSet<LocalId>,
        table: Option<(&str, &TableLayout)>,
    ) {
        let ty = |t| type_name(self.program, t);
        let own = self.params.iter().zip(&self.f.params);
        let params: Vec<String> = table
            .map(|(row, _)| format!("{row}: u32"))
            .into_iter()
            .chain(own.map(|(n, p)| format!("{n}: {}", ty(p.ty))))
            .collect();
        let result = ty(self.f.result);
        let origin = self.program.origin(self.f.span);
        let _ = writeln!(
            self.out,
            "// {origin}\nfn {name}({}) -> {result} {{",
            params.join(", ")
        );
        let stored = stored(self.f);
        for (i, local) in self.f.locals.iter().enumerate() {
            let id = LocalId(i as u32);
            if !counters.contains(&id) && stored.contains(&id) {
                let _ = writeln!(self.out, "    var {}: {};", self.locals[i], ty(local.ty));
            }
        }
        if let Some((row, layout)) = table {
            self.table(row, layout);
        }
        self.block(&self.f.body, 1);
        let value = self.operand(self.f.value);
        self.line_of(self.f.value, 1, &format!("return {value};"));
        self.out.push_str("}\n\n");
    }

    /// Reads what the function uses of the parameter table.
    fn table(&mut self, row: &str, layout: &TableLayout) {
        let mut read: BTreeMap<u32, String> = BTreeMap::new();
        for id in table_values(self.f) {
            let e = self.f.expr(id);
            let ExprKind::TableValue(i) = e.kind else {
                continue;
            };
            let Some(place) = layout.places.get(i as usize) else {
                continue;
            };
            let name = match read.get(&i) {
                Some(name) => name.clone(),
                None => {
                    let name = unique(&mut self.taken, e.name.as_deref().unwrap_or("given"));
                    let text = table_value(row, *place, type_name(self.program, place.ty));
                    self.line_of(id, 1, &format!("let {name} = {text};"));
                    read.insert(i, name.clone());
                    name
                }
            };
            self.names[id.index()] = Some(name);
        }
    }

    fn block(&mut self, block: &[Stmt], depth: usize) {
        block.iter().for_each(|stmt| self.stmt(stmt, depth));
    }

    fn line(&mut self, depth: usize, text: &str) {
        let indent = 4 * depth;
        let _ = writeln!(self.out, "{:indent$}{text}", "");
    }

    /// A line with where the expression `id` of the source stands that it comes from.
    fn line_of(&mut self, id: ExprId, depth: usize, text: &str) {
        let span = self.f.expr(id).span;
        if span != self.origin.0 {
            self.origin = (span, self.program.origin(span));
        }
        let (indent, origin) = (4 * depth, &self.origin.1);
        let _ = writeln!(self.out, "{:indent$}{text} // {origin}", "");
    }

    fn stmt(&mut self, stmt: &Stmt, depth: usize) {
        match stmt {
            Stmt::Eval(id) => self.eval(*id, depth),
            Stmt::Store(local, part, value) => {
                let part = part.map_or(String::new(), |p| format!(".{}", letter(p)));
                let text = format!(
                    "{}{part} = {};",
                    self.locals[local.index()],
                    self.operand(*value)
                );
                self.line_of(*value, depth, &text);
            }
            Stmt::If(cond, then, otherwise) => self.branch("", *cond, then, otherwise, depth),
            Stmt::For {
                local,
                low,
                high,
                body,
            } => {
                let bound = high;
                let (name, low, high) = (
                    &self.locals[local.index()],
                    self.operand(*low),
                    self.operand(*high),
                );
                let head = format!("for (var {name} = {low}; {name} < {high}; {name}++) {{");
                self.line_of(*bound, depth, &head);
                self.block(body, depth + 1);
                self.line(depth, "}");
            }
            Stmt::While {
                head,
                test,
                limit,
                body,
            } => {
                let turn = unique(&mut self.taken, "turns");
                let first = format!("for (var {turn} = 0i; {turn} < {limit}i; {turn}++) {{");
                self.line_of(*test, depth, &first);
                self.block(head, depth + 1);
                let text = format!("if !({}) {{ break; }}", self.operand(*test));
                self.line_of(*test, depth + 1, &text);
                self.block(body, depth + 1);
                self.line(depth, "}");
            }
            Stmt::Break => self.line(depth, "break;"),
            Stmt::Continue => self.line(depth, "continue;"),
        }
    }

    /// `if`, or `before` with `if`, and what follows.
    fn branch(
        &mut self,
        before: &str,
        cond: ExprId,
        then: &Block,
        otherwise: &Block,
        depth: usize,
    ) {
        let head = format!("{before}if {} {{", self.operand(cond));
        self.line_of(cond, depth, &head);
        self.block(then, depth + 1);
        // A branch whose only content is another continues the chain on one level.
        match otherwise.split_last() {
            None => self.line(depth, "}"),
            Some((Stmt::If(cond, a, b), before)) if self.prints_nothing(before) => {
                self.block(before, depth);
                self.branch("} else ", *cond, a, b, depth);
            }
            _ => {
                self.line(depth, "} else {");
                self.block(otherwise, depth + 1);
                self.line(depth, "}");
            }
        }
    }

    /// Do statements only compute values that stand where they are used?
    fn prints_nothing(&self, stmts: &[Stmt]) -> bool {
        stmts
            .iter()
            .all(|s| matches!(s, Stmt::Eval(id) if self.inline[id.index()]))
    }

    fn eval(&mut self, id: ExprId, depth: usize) {
        let text = self.expression(id);
        if self.inline[id.index()] {
            self.names[id.index()] = Some(text);
            return;
        }
        let expr = self.f.expr(id);
        let name = match &expr.name {
            Some(name) => unique(&mut self.taken, name),
            None => {
                self.next += 1;
                format!("v{}", self.next)
            }
        };
        self.line_of(id, depth, &format!("let {name} = {text};"));
        self.names[id.index()] = Some(name);
    }

    /// An expression where it is used.
    fn operand(&self, id: ExprId) -> Cow<'_, str> {
        match &self.f.expr(id).kind {
            ExprKind::Const(c) => constant(c).into(),
            ExprKind::Param(i) => self.params[*i as usize].as_str().into(),
            _ => self.names[id.index()].as_deref().unwrap_or("0.0").into(),
        }
    }

    /// As `operand`, in parentheses where it is an operator or negative.
    fn tight(&self, id: ExprId) -> Cow<'_, str> {
        let text = self.operand(id);
        let inline_operator = self.inline[id.index()] && self.is_operator(id);
        if inline_operator || text.starts_with('-') {
            format!("({text})").into()
        } else {
            text
        }
    }

    fn is_operator(&self, id: ExprId) -> bool {
        let ExprKind::Op(op, args) = &self.f.expr(id).kind else {
            return false;
        };
        matches!(self.spelling(*op, args), Wgsl::Prefix(_) | Wgsl::Infix(_))
    }

    /// How an op is written for its operands.
    fn spelling(&self, op: Op, args: &[ExprId]) -> Wgsl {
        let info = op.info();
        let ints = args.iter().all(|&a| self.f.ty(a) == Type::Int);
        let row = info.wgsl_int.filter(|_| ints).unwrap_or(info.wgsl);
        // A divisor that is known not to be zero needs no guard.
        match (op, args.get(1).and_then(|&d| self.f.constant(d))) {
            (Op::Div, Some(d)) if nonzero(d) => Wgsl::Infix("/"),
            (Op::Rem, Some(d)) if nonzero(d) => Wgsl::Infix("%"),
            _ => row,
        }
    }

    fn expression(&mut self, id: ExprId) -> String {
        let f = self.f;
        let expr = f.expr(id);
        match &expr.kind {
            ExprKind::Const(_)
            | ExprKind::Param(_)
            | ExprKind::MaterialParam(_)
            | ExprKind::TableValue(_) => self.operand(id).into_owned(),
            ExprKind::Load(local) => self.locals[local.index()].clone(),
            ExprKind::Op(op, args) => self.op(*op, args, expr.ty),
            ExprKind::Compose(args) => {
                format!("{}({})", type_name(self.program, expr.ty), self.list(args))
            }
            ExprKind::Swizzle(v, parts) => {
                let letters: String = parts.iter().map(|&p| letter(p)).collect();
                format!("{}.{letters}", self.tight(*v))
            }
            ExprKind::Call(callee, args) => format!(
                "{}({})",
                self.program.names.function(callee.index()),
                self.list(args)
            ),
            ExprKind::Make(s, args) => {
                let fields = &self.program.module.structs[s.index()].fields;
                let of_sample = *s == self.program.core.material_sample;
                let walks = self.helpers.walks || !of_sample;
                let declared = fields.iter().zip(args);
                let declared = declared.filter(|((name, _), _)| sample_declares(name, walks));
                let args: Vec<ExprId> = declared.map(|(_, arg)| *arg).collect();
                format!("{}({})", self.program.names.structure(*s), self.list(&args))
            }
            ExprKind::Field(v, i) => match f.ty(*v) {
                Type::Struct(s) => {
                    let name = &self.program.module.structs[s.index()].fields[*i as usize].0;
                    format!("{}.{}", self.tight(*v), identifier(name))
                }
                _ => self.operand(*v).into_owned(),
            },
        }
    }

    fn list(&self, args: &[ExprId]) -> String {
        joined(args.iter().map(|&a| self.operand(a)).collect())
    }

    fn op(&mut self, op: Op, args: &[ExprId], ty: Type) -> String {
        if let Some(space) = op.texture_space() {
            return self.texture(op, space, args);
        }
        match self.spelling(op, args) {
            Wgsl::Prefix(symbol) => format!("{symbol}{}", self.tight(args[0])),
            Wgsl::Infix(symbol) => {
                format!("{} {symbol} {}", self.tight(args[0]), self.tight(args[1]))
            }
            Wgsl::Builtin("select") => {
                let name = self.helpers.select(self.program, ty);
                format!("{name}({})", self.list(&[args[2], args[1], args[0]]))
            }
            Wgsl::Builtin(name) => format!("{name}({})", self.widened(op, args, ty)),
            Wgsl::Helper(text, _) => {
                let operand_ty = if matches!(op.info().shape, Shape::Float(_) | Shape::Number(_)) {
                    ty
                } else {
                    self.f.ty(args[0])
                };
                let name = self.helpers.name(op, operand_ty, text);
                format!("{name}({})", self.widened(op, args, ty))
            }
        }
    }

    /// Operands of a function, scalars widened to the vectors they combine with.
    fn widened(&self, op: Op, args: &[ExprId], ty: Type) -> String {
        let by_component = matches!(op.info().shape, Shape::Float(_) | Shape::Number(_));
        let widen = |&a: &ExprId| {
            let text = self.operand(a);
            let narrow = by_component && self.f.ty(a) == Type::Float && ty != Type::Float;
            if narrow {
                format!("{}({text})", type_name(self.program, ty)).into()
            } else {
                text
            }
        };
        joined(args.iter().map(widen).collect())
    }

    fn texture(&mut self, op: Op, space: TextureSpace, args: &[ExprId]) -> String {
        let slot = match self.f.constant(args[0]) {
            Some(Const::Int(t)) => format!("{}u", self.program.slot(*t as usize, space)),
            _ => {
                self.helpers.texture_slots.insert(space);
                let name = super::helpers::texture_slot_name(space);
                format!("{name}({})", self.operand(args[0]))
            }
        };
        let name = match (args.len(), self.f.ty(args[1])) {
            (2, _) => abi::TEXTURE_FETCH,
            (_, Type::Vec4) => abi::TEXTURE_FETCH_WIDE,
            _ => abi::TEXTURE_FETCH_AS,
        };
        let part = match op.texel_part() {
            whole if whole.len() == 4 => "",
            color if color.len() == 3 => ".xyz",
            _ => ".w",
        };
        format!("{name}({slot}, {}){part}", self.list(&args[1..]))
    }
}

/// A value of the parameter table.
fn table_value(row: &str, place: Place, ty: &str) -> String {
    let row = match place.row {
        0 => row.to_owned(),
        n => format!("{row} + {n}u"),
    };
    let first = usize::from(place.word);
    let letters = &"xyzw"[first..first + place.ty.width().unwrap_or(1)];
    let words = format!("{PARAMETERS}[{row}].{letters}");
    match place.ty {
        Type::Bool => format!("{words} != 0u"),
        _ => format!("bitcast<{ty}>({words})"),
    }
}

fn letter(component: u8) -> char {
    ['x', 'y', 'z', 'w'][usize::from(component) & 3]
}

fn nonzero(c: &Const) -> bool {
    match c {
        Const::Float(v) => v.iter().all(|&x| x as f32 != 0.0),
        // i32::MIN / -1 overflows, which WGSL leaves to the implementation only in constants.
        Const::Int(i) => *i != 0 && *i != -1,
        Const::Bool(_) => false,
    }
}

/// A constant as a WGSL literal.
fn constant(c: &Const) -> String {
    match c {
        Const::Bool(b) => b.to_string(),
        Const::Int(i32::MIN) => "i32(-2147483648)".into(),
        Const::Int(i) => format!("{i}i"),
        Const::Float(v) => {
            let parts: Vec<String> = v.iter().map(|&x| float(x)).collect();
            match parts.as_slice() {
                [x] => x.clone(),
                [first, rest @ ..] if rest.iter().all(|p| p == first) => {
                    format!("vec{}f({first})", parts.len())
                }
                _ => format!("vec{}f({})", parts.len(), parts.join(", ")),
            }
        }
    }
}

/// The shortest text that reads back as the same f32.
fn float(x: f64) -> String {
    let x = x as f32;
    if x.is_finite() {
        format!("{x:?}")
    } else {
        format!("{:?}", f32::MAX.copysign(x))
    }
}

/// Arguments with commas between them. `a < b, c > d` would begin a template list in WGSL, so
/// comparisons that face each other like that get parentheses.
fn joined(mut args: Vec<Cow<'_, str>>) -> String {
    let less = args.iter().position(|a| a.contains(" <"));
    let greater = args.iter().rposition(|a| a.contains(" >"));
    if less
        .zip(greater)
        .is_some_and(|(less, greater)| less < greater)
    {
        for arg in args
            .iter_mut()
            .filter(|a| a.contains(" <") || a.contains(" >"))
        {
            *arg = format!("({arg})").into();
        }
    }
    args.join(", ")
}
