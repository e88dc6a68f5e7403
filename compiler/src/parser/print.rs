//! The syntax tree as text: nested lists without places, for `emit --what ast` and for tests.
//!
//! A list is written on one line where that fits and with an entry a line where it does not.

use crate::ast::{
    Arg, Block, Body, ClosureDef, ClosureKind, Entry, Expr, ExprKind, IfExpr, Item, ItemKind,
    MaterialParam, Module, Name, Param, Stmt, StmtKind, Test, TypeName, UnaryOp, Use, UseName,
};

/// The width that lists are broken to, in characters.
const WIDTH: usize = 96;

/// The text of `module`.
pub fn print(module: &Module) -> String {
    let mut out = String::new();
    let uses = module.uses.iter().map(use_declaration);
    let items = module.items.iter().map(item);
    let tests = module.tests.iter().map(test);
    let all = docs(&module.docs).into_iter().chain(uses);
    for tree in all.chain(items).chain(tests) {
        tree.write(0, &mut out);
        out.push('\n');
    }
    out
}

/// The text of one expression.
pub fn print_expression(value: &Expr) -> String {
    let mut out = String::new();
    expr(value).write(0, &mut out);
    out
}

/// A word, or a list whose first entries, its head, stay on the first line.
enum Tree {
    Word(String),
    List { head: usize, entries: Vec<Tree> },
}

impl Tree {
    /// The length on one line; once above `WIDTH` it is not told exactly.
    fn width(&self) -> usize {
        match self {
            Tree::Word(word) => word.chars().count(),
            Tree::List { entries, .. } => {
                let mut width = 1 + entries.len().max(1);
                for entry in entries {
                    width += entry.width();
                    if width > WIDTH {
                        break;
                    }
                }
                width
            }
        }
    }

    fn write(&self, indent: usize, out: &mut String) {
        let Tree::List { head, entries } = self else {
            if let Tree::Word(word) = self {
                out.push_str(word);
            }
            return;
        };
        let fits = indent + self.width() <= WIDTH;
        out.push('(');
        for (i, entry) in entries.iter().enumerate() {
            if i > 0 && (fits || i < *head) {
                out.push(' ');
            } else if i > 0 {
                out.push('\n');
                out.extend(std::iter::repeat_n(' ', indent + 2));
            }
            entry.write(indent + 2, out);
        }
        out.push(')');
    }
}

fn word(text: impl Into<String>) -> Tree {
    Tree::Word(text.into())
}

fn name(name: &Name) -> Tree {
    word(name.node.clone())
}

fn type_name(ty: &TypeName) -> Tree {
    match &ty.array {
        None => word(ty.node.clone()),
        Some(array) => {
            let element = [name(&array.element)].into_iter();
            list("[]", 1, element.chain(array.count.as_ref().map(expr)))
        }
    }
}

/// A list that starts with `keyword`; `head` more entries stay on its line.
fn list(keyword: &str, head: usize, entries: impl IntoIterator<Item = Tree>) -> Tree {
    let entries = std::iter::once(word(keyword)).chain(entries).collect();
    Tree::List {
        head: head + 1,
        entries,
    }
}

fn docs(lines: &[String]) -> Option<Tree> {
    let lines = lines.iter().map(|line| word(format!("{line:?}")));
    (lines.len() > 0).then(|| list("doc", 1, lines))
}

fn use_declaration(declaration: &Use) -> Tree {
    let segments: Vec<&str> = declaration.path.iter().map(|s| s.node.as_str()).collect();
    let path = word(segments.join("::"));
    let names = declaration.names.iter().map(imported);
    list("use", 1, std::iter::once(path).chain(names))
}

fn imported(imported: &UseName) -> Tree {
    match &imported.alias {
        Some(alias) => list("as", 2, [name(&imported.name), name(alias)]),
        None => name(&imported.name),
    }
}

fn item(item: &Item) -> Tree {
    let private = item.private.then(|| word("private"));
    let head = [name(&item.name)].into_iter().chain(private);
    let docs = docs(&item.docs);
    match &item.kind {
        ItemKind::Material(material) => {
            let params = material.params.iter().map(material_param);
            let body = material.body.iter().map(stmt);
            list("material", 1, head.chain(docs).chain(params).chain(body))
        }
        ItemKind::Closure(definition) => closure(head.chain(docs), definition),
        ItemKind::Function(function) => {
            let params = function.params.iter().map(param);
            let result = list("->", 1, [type_name(&function.result)]);
            let rest = params.chain([result]).chain(body(&function.body));
            list("fn", 1, head.chain(docs).chain(rest))
        }
        ItemKind::Struct(fields) => {
            let fields = fields.iter().map(|field| {
                let parts = [name(&field.name), type_name(&field.ty)];
                list("field", 2, parts.into_iter().chain(self::docs(&field.docs)))
            });
            list("struct", 1, head.chain(docs).chain(fields))
        }
        ItemKind::Const(constant) => {
            let parts = [type_name(&constant.ty), expr(&constant.value)];
            list("const", 1, head.chain(docs).chain(parts))
        }
    }
}

fn test(test: &Test) -> Tree {
    let title = word(format!("{:?}", test.title.node));
    list("test", 1, [title].into_iter().chain(contents(&test.body)))
}

fn closure(head: impl Iterator<Item = Tree>, definition: &ClosureDef) -> Tree {
    let keyword = match definition.kind {
        ClosureKind::Bsdf => "bsdf",
        ClosureKind::DeltaBsdf => "delta-bsdf",
        ClosureKind::Edf => "edf",
    };
    let params = definition.params.iter().map(param);
    let lets = definition.lets.iter().map(stmt);
    let methods = definition.methods.iter().map(|method| {
        let args = Tree::List {
            head: usize::MAX,
            entries: method.args.iter().map(name).collect(),
        };
        let head = [name(&method.name), args];
        list("method", 2, head.into_iter().chain(body(&method.body)))
    });
    list(keyword, 1, head.chain(params).chain(lets).chain(methods))
}

fn material_param(param: &MaterialParam) -> Tree {
    let parts = [
        name(&param.name),
        type_name(&param.ty),
        expr(&param.default),
    ];
    let range = param.range.as_ref();
    let range = range.map(|(low, high)| list("in", 0, [expr(low), expr(high)]));
    let metadata = param.metadata.iter().map(entry);
    let parts = parts.into_iter().chain(range).chain(metadata);
    list("param", 2, parts.chain(docs(&param.docs)))
}

fn entry(entry: &Entry) -> Tree {
    let values = [&entry.value].into_iter().chain(&entry.high).map(expr);
    list(&format!("{}:", entry.key.node), 0, values)
}

fn param(param: &Param) -> Tree {
    let parts = [name(&param.name), type_name(&param.ty)];
    let default = param.default.as_ref().map(expr);
    list("param", 2, parts.into_iter().chain(default))
}

fn body(body: &Body) -> Vec<Tree> {
    match body {
        Body::Expr { value, when: None } => vec![expr(value)],
        Body::Expr {
            value,
            when: Some(condition),
        } => vec![list("when", 0, [expr(condition), expr(value)])],
        Body::Block(block) => contents(block),
    }
}

/// Statements and value of a block, the value marked as such.
fn contents(block: &Block) -> Vec<Tree> {
    let value = block.value.as_deref().map(|v| list("value", 0, [expr(v)]));
    block.stmts.iter().map(stmt).chain(value).collect()
}

fn block(keyword: &str, block: &Block) -> Tree {
    list(keyword, 0, contents(block))
}

fn stmt(stmt: &Stmt) -> Tree {
    match &stmt.kind {
        StmtKind::Let {
            mutable,
            name: bound,
            ty,
            value,
        } => {
            let keyword = if *mutable { "var" } else { "let" };
            let ty = ty.as_ref().map(|ty| list(":", 1, [type_name(ty)]));
            let parts = [name(bound)].into_iter().chain(ty);
            list(keyword, 1, parts.chain([expr(value)]))
        }
        StmtKind::Assign { place, op, value } => {
            let keyword = format!("{}=", op.map_or("", |op| op.symbol()));
            list(&keyword, 1, [expr(place), expr(value)])
        }
        StmtKind::If(chosen) => if_expr(chosen),
        StmtKind::For {
            name: turn,
            low,
            high,
            body,
        } => {
            let head = [name(turn), expr(low), expr(high)];
            list("for", 3, head.into_iter().chain(contents(body)))
        }
        StmtKind::While { cond, limit, body } => {
            let limit = limit.as_ref().map(|limit| list("limit", 1, [expr(limit)]));
            let head = [expr(cond)].into_iter().chain(limit);
            list("while", 2, head.chain(contents(body)))
        }
        StmtKind::Break => list("break", 0, []),
        StmtKind::Continue => list("continue", 0, []),
        StmtKind::Assert(condition) => list("assert", 0, [expr(condition)]),
    }
}

fn if_expr(chosen: &IfExpr) -> Tree {
    let otherwise = chosen.otherwise.as_ref().map(|b| block("else", b));
    let parts = [expr(&chosen.cond), block("then", &chosen.then)];
    list("if", 1, parts.into_iter().chain(otherwise))
}

fn expr(value: &Expr) -> Tree {
    match &value.kind {
        ExprKind::Bool(value) => word(value.to_string()),
        ExprKind::Int(value) => word(value.to_string()),
        ExprKind::Uint(value) => word(format!("{value}u")),
        ExprKind::Float(value) => word(format!("{value:?}")),
        ExprKind::Quantity(value, unit) => word(format!("{value:?}{}", unit.node.name())),
        ExprKind::Str(text) => word(format!("{text:?}")),
        ExprKind::Name(name) => word(name.clone()),
        ExprKind::Call { callee, args } => {
            let args = args.iter().map(arg);
            list("call", 1, [name(callee)].into_iter().chain(args))
        }
        ExprKind::Field(base, field) => list(".", 0, [expr(base), name(field)]),
        ExprKind::Array(elements) => list("array", 0, elements.iter().map(expr)),
        ExprKind::Index(base, index) => list("at", 0, [expr(base), expr(index)]),
        ExprKind::Unary(op, value) => {
            let keyword = match op {
                UnaryOp::Neg => "-",
                UnaryOp::Not => "!",
            };
            list(keyword, 0, [expr(value)])
        }
        ExprKind::Binary(op, a, b) => list(op.symbol(), 0, [expr(a), expr(b)]),
        ExprKind::If(chosen) => if_expr(chosen),
        ExprKind::Block(inner) => block("block", inner),
        ExprKind::Error => word("<error>"),
    }
}

fn arg(arg: &Arg) -> Tree {
    match &arg.name {
        Some(given) => list(&format!("{}:", given.node), 0, [expr(&arg.value)]),
        None => expr(&arg.value),
    }
}
