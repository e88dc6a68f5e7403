//! What can be written at a cursor.
//!
//! The text is broken there nearly always. So the grammar is told by tokens (`cursor`), scopes by the syntax tree, and
//! types by an analysis of a text in which a name stands at the cursor and brackets are closed.

use std::collections::HashSet;
use std::ops::Range;
use std::path::Path;

use impasto_compiler::analysis::manual::{self, Kind};
use impasto_compiler::analysis::{Analysis, Symbol, params};
use impasto_compiler::ast::{Field, ItemKind, Unit};
use impasto_compiler::sema::{ItemRef, words};
use impasto_stdlib::StdFile;

use super::cursor::{Around, Cursor, Place, cursor};
use super::describe::{self, Description};
use super::{imports, symbols};
use crate::documents;

/// A thing that can be written.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposal {
    /// What is shown, and what the author's letters are compared with.
    pub label: String,
    /// What kind of thing it is.
    pub kind: ProposalKind,
    /// What is written; `$1`, `${2:name}` and `$0` are places to go on at.
    pub snippet: String,
    /// What is shown beside it.
    pub detail: String,
    /// Its documentation, in Markdown.
    pub docs: String,
    /// How near it is: those with less are shown first.
    pub rank: u8,
    /// What to import for it.
    pub import: Option<String>,
}

/// Kinds of proposals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum ProposalKind {
    Keyword,
    Snippet,
    Function,
    Closure,
    Material,
    Struct,
    Constant,
    Variable,
    Parameter,
    Field,
    Input,
    Output,
    Type,
    Unit,
    Module,
    File,
}

/// Everything that can be written at a cursor, and the bytes that it takes the place of.
pub struct Proposals {
    /// The word at the cursor.
    pub word: Range<usize>,
    /// What can stand there, nearest first.
    pub list: Vec<Proposal>,
}

/// What is known of the text.
pub struct Known<'a> {
    /// The text as it is.
    pub text: &'a str,
    /// Its path, for files beside it.
    pub path: &'a str,
    /// What it means as it is.
    pub now: &'a Analysis,
    /// What it meant when it last had no syntax errors.
    pub last_good: Option<&'a Analysis>,
    /// Analyses the text with a range of it replaced.
    pub analyse: &'a mut dyn FnMut(Range<usize>, &str) -> Analysis,
}

/// A name that nobody else has, which stands at the cursor where types are asked for.
const STAND_IN: &str = "impasto_cursor";

/// What can be written at byte `at`.
pub fn complete(known: &mut Known<'_>, at: usize) -> Proposals {
    let cursor = cursor(known.text, at);
    let mut list = match &cursor.place {
        Place::Nothing => Vec::new(),
        Place::Item => items(),
        Place::PrivateItem => {
            let mut list = items();
            list.retain(|p| !["private", "use"].contains(&&*p.label));
            list
        }
        Place::Delta => vec![keyword("bsdf", "bsdf ", "how light is scattered")],
        Place::MaterialStatement => material_statements(known, &cursor),
        Place::Statement => statements(known, &cursor),
        Place::Value => values(known, &cursor),
        Place::Argument => {
            let mut list = arguments(known, &cursor);
            list.extend(values(known, &cursor));
            list
        }
        Place::Type => types(known),
        Place::Part(end) => parts(known, *end, &cursor),
        Place::Import(path) => imported(known, path, at),
        Place::Unit => units(),
        Place::MetadataKey(given) => metadata(given),
        Place::Path => pictures(known, &cursor),
        Place::Method => methods(known, at, &cursor),
    };
    let rest = known.text.get(cursor.word.end..).unwrap_or_default();
    let rest = rest.lines().next().unwrap_or_default();
    list.iter_mut().for_each(|proposal| proposal.fit(rest));
    list.sort_by(|a, b| (a.rank, &a.label).cmp(&(b.rank, &b.label)));
    list.dedup_by(|a, b| a.label == b.label && a.kind == b.kind);
    Proposals {
        word: cursor.word,
        list,
    }
}

/// Does a character that was typed ask for a list by itself?
pub fn is_asked_by(text: &str, at: usize, trigger: Option<&str>) -> bool {
    let place = |wanted: fn(&Place) -> bool| wanted(&cursor(text, at).place);
    match trigger {
        Some(" ") => place(|p| matches!(p, Place::Unit | Place::Import(_))),
        Some(":") => place(|p| matches!(p, Place::Type | Place::Import(_))),
        Some("/" | "\"") => place(|p| matches!(p, Place::Path)),
        _ => true,
    }
}

impl Proposal {
    fn new(label: &str, kind: ProposalKind, rank: u8) -> Self {
        Self {
            label: label.to_owned(),
            kind,
            snippet: label.replace('$', "\\$"),
            detail: String::new(),
            docs: String::new(),
            rank,
            import: None,
        }
    }

    /// Leaves out what stands behind the cursor already, in the `rest` of the line.
    fn fit(&mut self, rest: &str) {
        let next = rest.trim_start();
        let (label, snippet) = (&self.label, &self.snippet);
        let name = label.trim_end_matches(':');
        let behind = snippet.strip_prefix(name).unwrap_or_default().trim_start();
        let is_there = |mark: &str, longer: &str| {
            behind.starts_with(mark) && next.starts_with(mark) && !next.starts_with(longer)
        };
        let goes_on = !next.is_empty() && !next.starts_with(['}', ')', ']', ';', ',', '/']);
        let is_form = matches!(self.kind, ProposalKind::Keyword | ProposalKind::Snippet);
        if is_there("(", "((") || is_there(":", "::") || is_there("=", "==") {
            self.snippet = name.to_owned();
        } else if is_form && goes_on && snippet != label {
            let has_space = rest.starts_with([' ', '\t']);
            self.snippet = format!("{label}{}", if has_space { "" } else { " " });
        } else if next.starts_with(';') && snippet.ends_with(';') {
            self.snippet.pop();
        }
    }

    fn snippet(mut self, snippet: impl Into<String>) -> Self {
        self.snippet = snippet.into();
        self
    }

    fn described(mut self, description: &Description) -> Self {
        let mut lines = description.declaration.lines();
        self.detail = lines.next().unwrap_or_default().to_owned();
        self.docs = description.markdown();
        self
    }

    fn detail(mut self, detail: &str) -> Self {
        self.detail = detail.to_owned();
        self
    }
}

/// Words and forms that begin a definition.
fn items() -> Vec<Proposal> {
    let form = |label: &str, snippet: &str, detail: &str| {
        Proposal::new(label, ProposalKind::Snippet, 0)
            .snippet(snippet)
            .detail(detail)
    };
    vec![
        form(
            "material",
            "/// $1\nmaterial ${2:name} {\n    surface = ${0:diffuse(0.5)};\n}",
            "a material",
        ),
        form(
            "fn",
            "fn ${1:name}(${2:x}: ${3:float}) -> ${4:float} = $0;",
            "a function",
        ),
        form("const", "const ${1:NAME}: ${2:float} = $0;", "a constant"),
        form("struct", "struct ${1:Name} {\n    $0\n}", "a struct"),
        form("use", "use std::${1:bsdf}::${0:diffuse};", "an import"),
        form("private", "private ", "for this file alone"),
        form(
            "bsdf",
            "/// $1\nbsdf ${2:name}(${3:reflectance}: ${4:color}) {\n    eval(wo, wi) = $0;\n    \
             sample(wo, u) = flip_to(wo, cosine_hemisphere(u.xy));\n    \
             pdf(wo, wi) = INV_PI * abs_cos(wi) when same_side(wo, wi);\n    albedo(wo) = ${3:reflectance};\n}",
            "how light is scattered",
        ),
        form(
            "edf",
            "/// $1\nedf ${2:name}(${3:radiance}: ${4:color}) {\n    emit(wo) = ${0:radiance};\n}",
            "how light is emitted",
        ),
        form("delta", "delta bsdf ", "a bsdf of discrete directions"),
    ]
}

fn keyword(word: &str, snippet: &str, detail: &str) -> Proposal {
    Proposal::new(word, ProposalKind::Keyword, 2)
        .snippet(snippet)
        .detail(detail)
}

fn material_statements(known: &mut Known<'_>, cursor: &Cursor) -> Vec<Proposal> {
    let mut list = vec![keyword(
        "param",
        "param ${1:name}: ${2:float} = ${3:0.5} in ${4:0.0} .. ${5:1.0};",
        "what a scene can set",
    )];
    list[0].rank = 0;
    list.push(keyword(
        "material",
        "material = $0;",
        "all outputs of a material",
    ));
    for output in words::output_names() {
        let mut proposal =
            Proposal::new(output, ProposalKind::Output, 0).snippet(format!("{output} = $0;"));
        if let Some(entry) = manual::entry(output, &[Kind::Output]) {
            proposal = proposal.described(&describe::of_manual(entry));
        }
        list.push(proposal);
    }
    list.extend(flow());
    list.extend(scope(known, cursor).names);
    list
}

/// Statements of any block.
fn flow() -> Vec<Proposal> {
    vec![
        keyword("let", "let ${1:name} = $0;", "a name for a value"),
        keyword("var", "var ${1:name} = $0;", "a variable"),
        keyword(
            "for",
            "for ${1:i} in ${2:0} .. ${3:4} {\n    $0\n}",
            "a loop",
        ),
        keyword(
            "while",
            "while $1 limit ${2:64} {\n    $0\n}",
            "a loop with a bound",
        ),
        keyword("if", "if $1 {\n    $0\n}", "a condition"),
    ]
}

fn statements(known: &mut Known<'_>, cursor: &Cursor) -> Vec<Proposal> {
    let mut list = flow();
    list.push(keyword("break", "break;", "ends the loop"));
    list.push(keyword(
        "continue",
        "continue;",
        "goes on with the next turn",
    ));
    // The last expression of a block is its value.
    list.extend(values(known, cursor));
    list
}

/// What is in scope at a cursor.
#[derive(Default)]
struct Scope {
    /// Local names.
    names: Vec<Proposal>,
    /// The definition around it.
    own: Option<String>,
}

/// What is in scope at a cursor: of a text with syntax errors, by the repair that leaves most of it.
fn scope(known: &mut Known<'_>, cursor: &Cursor) -> Scope {
    let word = &cursor.word;
    let mut best = Scope::of(known.now, word.start);
    if !documents::has_syntax_errors(known.now) {
        return best;
    }
    for patch in patches(known, cursor) {
        let analysis = (known.analyse)(patch.range, &patch.text);
        let found = Scope::of(&analysis, word.start + patch.shift);
        if found.names.len() > best.names.len() || best.own.is_none() {
            best = found;
        }
        if !documents::has_syntax_errors(&analysis) {
            break;
        }
    }
    best
}

impl Scope {
    fn of(analysis: &Analysis, at: usize) -> Self {
        let visible = analysis.visible_at(at as u32);
        let proposal = |(name, symbol): (&str, Symbol)| {
            let kind = match symbol {
                Symbol::Param(..) => ProposalKind::Parameter,
                _ => ProposalKind::Variable,
            };
            let mut proposal = Proposal::new(name, kind, 1);
            if let Some(description) = describe::describe(analysis, &symbol) {
                proposal = proposal.described(&description);
            }
            proposal
        };
        let visible = visible.into_iter().filter(|(name, _)| *name != STAND_IN);
        Self {
            names: visible.map(proposal).collect(),
            own: analysis
                .item_at(at as u32)
                .map(|(_, item)| item.name.node.clone()),
        }
    }
}

fn values(known: &mut Known<'_>, cursor: &Cursor) -> Vec<Proposal> {
    let scope = scope(known, cursor);
    let mut list = scope.names;
    let hidden: HashSet<String> = list.iter().map(|p| p.label.clone()).collect();
    let is_free = |name: &str| !hidden.contains(name);
    if cursor.around == Around::Material {
        for input in words::input_names().filter(|i| is_free(i)) {
            let mut proposal = Proposal::new(input, ProposalKind::Input, 3);
            if let Some(entry) = manual::entry(input, &[Kind::Input]) {
                proposal = proposal.described(&describe::of_manual(entry));
            }
            list.push(proposal);
        }
    }
    for function in words::built_in_functions().filter(|f| is_free(f)) {
        list.push(built_in(function));
    }
    for ty in words::type_names().filter(|ty| is_free(ty)) {
        // Conversions; closures are not made by their types.
        if ![
            "bsdf", "edf", "medium", "texture", "length", "angle", "bool",
        ]
        .contains(&ty)
        {
            list.push(
                Proposal::new(ty, ProposalKind::Type, 6)
                    .snippet(format!("{ty}($1)"))
                    .detail("conversion"),
            );
        }
    }
    for word in ["true", "false"] {
        list.push(keyword(word, word, "bool"));
    }
    list.push(keyword(
        "if",
        "if $1 { $2 } else { $0 }",
        "one value or the other",
    ));
    // Nothing calls itself, and only materials call materials.
    let mut named = hidden;
    named.extend(scope.own);
    let is_callable = |kind: &ItemKind| {
        cursor.around == Around::Material || !matches!(kind, ItemKind::Material(_))
    };
    list.extend(definitions(known, &mut named, is_callable));
    let mut library = library(&named);
    library.retain(|p| cursor.around == Around::Material || p.kind != ProposalKind::Material);
    list.extend(library);
    list
}

fn built_in(function: &str) -> Proposal {
    let mut proposal = Proposal::new(function, ProposalKind::Function, 5);
    let entry = manual::entry(function, &[Kind::Function, Kind::Form]);
    let Some(entry) = entry else {
        return proposal.snippet(format!("{function}($1)"));
    };
    proposal = proposal.described(&describe::of_manual(entry));
    let written = entry.written.first().map_or("", String::as_str);
    let inside = written
        .split_once('(')
        .and_then(|(_, rest)| rest.rsplit_once(')'))
        .map_or("", |(inside, _)| inside);
    let required = inside
        .split(", ")
        .filter(|a| !a.contains('=') && *a != "...");
    let places: Vec<String> = required
        .enumerate()
        .map(|(i, name)| {
            let name = name.split(':').next().unwrap_or(name);
            format!("${{{}:{}}}", i + 1, name.replace(['$', '}'], ""))
        })
        .collect();
    let simple = inside
        .chars()
        .all(|c| c.is_alphanumeric() || " ,_.".contains(c));
    let places = if simple {
        places.join(", ")
    } else {
        "$1".into()
    };
    proposal.snippet(format!("{function}({places})"))
}

/// Definitions that the file sees, or saw last.
fn definitions(
    known: &Known<'_>,
    named: &mut HashSet<String>,
    wanted: impl Fn(&ItemKind) -> bool,
) -> Vec<Proposal> {
    let mut list = Vec::new();
    for analysis in [Some(known.now), known.last_good].into_iter().flatten() {
        let Some(module) = analysis.module else {
            continue;
        };
        let own = &analysis.modules[module.0].names;
        let all = own
            .iter()
            .map(|n| (n, 4))
            .chain(analysis.core.iter().map(|n| (n, 7)));
        for ((name, item), rank) in all {
            if !wanted(&analysis.item(*item).kind) || !named.insert(name.clone()) {
                continue;
            }
            list.push(definition(analysis, *item, name, rank));
        }
    }
    list
}

fn definition(analysis: &Analysis, item: ItemRef, name: &str, rank: u8) -> Proposal {
    let found = analysis.item(item);
    let kind = kind_of(&found.kind);
    let proposal = Proposal::new(name, kind, rank);
    let proposal = proposal.described(&describe::describe_item(analysis, item));
    if kind == ProposalKind::Constant {
        return proposal;
    }
    let required: Vec<String> = match &found.kind {
        ItemKind::Struct(fields) => fields.iter().map(|f| f.name.node.clone()).collect(),
        _ => {
            let params = params(found);
            let required = params.iter().filter(|p| p.default.is_none());
            required.map(|p| p.name.node.clone()).collect()
        }
    };
    proposal.snippet(call(name, &required, !params(found).is_empty()))
}

/// A call with a place for each argument that must be there.
fn call(name: &str, required: &[String], has_more: bool) -> String {
    let places = required.iter().enumerate();
    let places: Vec<String> = places
        .map(|(i, name)| format!("${{{}:{name}}}", i + 1))
        .collect();
    match (places.is_empty(), has_more) {
        (true, true) => format!("{name}($1)"),
        _ => format!("{name}({})", places.join(", ")),
    }
}

/// The kind of a definition.
pub fn kind_of(kind: &ItemKind) -> ProposalKind {
    match kind {
        ItemKind::Material(_) => ProposalKind::Material,
        ItemKind::Closure(_) => ProposalKind::Closure,
        ItemKind::Function(_) => ProposalKind::Function,
        ItemKind::Struct(_) => ProposalKind::Struct,
        ItemKind::Const(_) => ProposalKind::Constant,
    }
}

/// Definitions of the library that would have to be imported.
fn library(named: &HashSet<String>) -> Vec<Proposal> {
    let mut list = Vec::new();
    for entry in symbols::library() {
        let (file, item) = (entry.file, &entry.item);
        if file.folder == "core" || named.contains(&item.name) {
            continue;
        }
        let path = format!("std::{}::{}", file.folder, item.name);
        let mut proposal = Proposal::new(&item.name, item.kind, 8);
        proposal.detail = format!("use {path}");
        proposal.docs = format!("```impasto\n{}\n```\n\n{}", item.declaration, item.docs);
        proposal.snippet = item.snippet.clone();
        proposal.import = Some(path);
        list.push(proposal);
    }
    list
}

/// What is told of a definition of the library, for lists of them.
#[derive(Clone, Debug)]
pub struct Listed {
    /// Its name.
    pub name: String,
    /// What it is.
    pub kind: ProposalKind,
    /// Its declaration.
    pub declaration: String,
    /// Its documentation.
    pub docs: String,
    /// What is written for it.
    pub snippet: String,
    /// Where its name stands in the file.
    pub place: Range<usize>,
}

/// The public definitions of a file of the library.
pub fn listed(file: &StdFile) -> Vec<Listed> {
    let mut nothing = impasto_compiler::MemoryLoader::default();
    let path = format!("std::{}::{}", file.folder, file.name);
    let analysis = impasto_compiler::analysis::analyse(&path, &mut nothing);
    let Some((module, ast)) = analysis.module.zip(analysis.ast()) else {
        return Vec::new();
    };
    let public = ast
        .items
        .iter()
        .enumerate()
        .filter(|(_, item)| !item.private);
    let one = |(index, item): (usize, &impasto_compiler::ast::Item)| {
        let itself = ItemRef { module, index };
        let proposal = definition(&analysis, itself, &item.name.node, 8);
        let description = describe::describe_item(&analysis, itself);
        Listed {
            name: item.name.node.clone(),
            kind: proposal.kind,
            declaration: description.declaration,
            docs: description.docs,
            snippet: proposal.snippet,
            place: item.name.span.range(),
        }
    };
    public.map(one).collect()
}

/// Names of parameters of the innermost call that no argument has given.
fn arguments<'a>(known: &Known<'a>, cursor: &Cursor) -> Vec<Proposal> {
    let Some(call) = cursor.calls.first().filter(|c| c.named.is_none()) else {
        return Vec::new();
    };
    let is_new = |name: &str| !call.given.iter().any(|given| given == name);
    let name = |name: &str, docs: Option<Description>| {
        let mut proposal = Proposal::new(&format!("{name}:"), ProposalKind::Parameter, 0)
            .snippet(format!("{name}: "));
        if let Some(docs) = docs {
            proposal = proposal.described(&docs);
        }
        proposal
    };
    for analysis in [Some(known.now), known.last_good].into_iter().flatten() {
        let item = analysis
            .module
            .and_then(|m| analysis.lookup(m, &call.callee));
        let Some(item) = item else { continue };
        let found = analysis.item(item);
        let all: Vec<(&str, Symbol)> = match &found.kind {
            ItemKind::Struct(fields) => {
                let fields = fields.iter().enumerate();
                let field = |(i, f): (usize, &'a Field)| (&*f.name.node, Symbol::Field(item, i));
                fields.map(field).collect()
            }
            _ => {
                let params = params(found).into_iter().enumerate();
                params
                    .map(|(i, p)| (&*p.name.node, Symbol::Param(item, i)))
                    .collect()
            }
        };
        let mut list: Vec<Proposal> = all
            .into_iter()
            .skip(call.by_place())
            .filter(|(n, _)| is_new(n))
            .map(|(n, symbol)| name(n, describe::describe(analysis, &symbol)))
            .collect();
        if matches!(found.kind, ItemKind::Closure(_)) {
            for axis in ["normal", "tangent"] {
                if is_new(axis) {
                    list.push(name(axis, None).detail("an axis of the local frame"));
                }
            }
        }
        return list;
    }
    let entry = manual::entry(&call.callee, &[Kind::Function]);
    let mut written = entry.into_iter().flat_map(|e| &e.written);
    let params = written.find_map(|w| w.split_once('(').filter(|(_, inside)| inside.contains(':')));
    let inside = params.map_or("", |(_, inside)| inside.trim_end_matches(')'));
    let all = describe::parts(inside).into_iter().skip(call.by_place());
    let names = all.filter_map(|p| p.split_once(':'));
    names
        .filter(|(n, _)| is_new(n))
        .map(|(n, ty)| name(n, None).detail(ty.trim()))
        .collect()
}

fn types(known: &Known<'_>) -> Vec<Proposal> {
    let mut list: Vec<Proposal> = words::type_names()
        .map(|ty| {
            let proposal = Proposal::new(ty, ProposalKind::Type, 0);
            match manual::entry(ty, &[Kind::Type]) {
                Some(entry) => proposal.described(&describe::of_manual(entry)),
                None => proposal,
            }
        })
        .collect();
    let mut named = HashSet::new();
    let structs = definitions(known, &mut named, |k| matches!(k, ItemKind::Struct(_)));
    list.extend(structs.into_iter().map(|p| {
        let name = p.label.clone();
        p.snippet(name)
    }));
    list
}

/// Components, fields and outputs of what ends at byte `end`.
fn parts(known: &mut Known<'_>, end: usize, cursor: &Cursor) -> Vec<Proposal> {
    for patch in patches(known, cursor) {
        let end = end + patch.shift;
        let analysis = (known.analyse)(patch.range, &patch.text);
        let of_base = |(span, _): &&(impasto_compiler::source::Span, _)| span.end as usize == end;
        let around = analysis.types_around(end as u32);
        // Of all that ends there the largest: `f(x)` and not `x)`.
        let Some((_, ty)) = around.iter().rev().find(of_base) else {
            continue;
        };
        return parts_of(&analysis, ty);
    }
    Vec::new()
}

/// A change of a text in which the name at the cursor stands for itself.
struct Patch {
    /// What is replaced.
    range: Range<usize>,
    /// What takes its place.
    text: String,
    /// How many bytes come to what stands before the cursor.
    shift: usize,
}

/// Repairs of a text for a cursor, from the gentlest on.
fn patches(known: &Known<'_>, cursor: &Cursor) -> Vec<Patch> {
    let (text, word) = (known.text, cursor.word.clone());
    let line_end = text[word.end..]
        .find('\n')
        .map_or(text.len(), |n| word.end + n);
    let line_start = text[..word.start].rfind('\n').map_or(0, |n| n + 1);
    let before = &text[line_start..word.start];
    let mut open = Vec::new();
    for c in before.chars() {
        match c {
            '(' => open.push(')'),
            '[' => open.push(']'),
            ')' | ']' => drop(open.pop()),
            _ => {}
        }
    }
    let closed: String = open.iter().rev().collect();
    let patch = |range: Range<usize>, text: String| Patch {
        range,
        text,
        shift: 0,
    };
    // What is assigned has a type as a value.
    let bound = format!("let {STAND_IN}_line = ");
    let mut all = vec![
        patch(word.clone(), STAND_IN.to_owned()),
        patch(word.clone(), format!("{STAND_IN};")),
        patch(word.start..line_end, format!("{STAND_IN}{closed};")),
        patch(word.start..line_end, format!("{STAND_IN}{closed}")),
        Patch {
            range: line_start..line_end,
            text: format!("{bound}{before}{STAND_IN}{closed};"),
            shift: bound.len(),
        },
    ];
    // Other lines that are broken go, and leave their bytes.
    let lines: Vec<Range<usize>> = documents::syntax_errors(known.now)
        .map(|at| at.min(text.len()))
        .map(|at| {
            let start = text[..text.floor_char_boundary(at)].rfind('\n');
            let end = text[text.floor_char_boundary(at)..].find('\n');
            start.map_or(0, |n| n + 1)..end.map_or(text.len(), |n| at + n)
        })
        .filter(|line| line.end < line_start || line_end < line.start)
        .collect();
    if !lines.is_empty() {
        let mut without: Vec<u8> = text.as_bytes().to_vec();
        for line in lines {
            without[line].fill(b' ');
        }
        for end in [
            format!("{STAND_IN}{closed};"),
            format!("{STAND_IN}{closed}"),
        ] {
            let mut bytes = without.clone();
            bytes.splice(word.start..line_end, end.into_bytes());
            all.extend(
                String::from_utf8(bytes)
                    .ok()
                    .map(|new| patch(0..text.len(), new)),
            );
        }
    }
    all
}

fn parts_of(analysis: &Analysis, ty: &impasto_compiler::analysis::TypeOf) -> Vec<Proposal> {
    let letters = |letters: &str, each: &str| {
        let one = |c: char| Proposal::new(&c.to_string(), ProposalKind::Field, 0).detail(each);
        letters.chars().map(one).collect::<Vec<_>>()
    };
    if let Some(item) = ty.item
        && let ItemKind::Struct(fields) = &analysis.item(item).kind
    {
        let field = |(index, field): (usize, &impasto_compiler::ast::Field)| {
            let proposal = Proposal::new(&field.name.node, ProposalKind::Field, 0);
            match describe::describe(analysis, &Symbol::Field(item, index)) {
                Some(description) => proposal.described(&description),
                None => proposal,
            }
        };
        return fields.iter().enumerate().map(field).collect();
    }
    match &*ty.text {
        "color" => letters("rgb", "float"),
        "vec2" => {
            let mut all = letters("xy", "float");
            all.push(Proposal::new("yx", ProposalKind::Field, 1).detail("vec2"));
            all
        }
        "vec3" | "point" | "vector" | "normal" => {
            let mut all = letters("xyz", "float");
            for two in ["xy", "xz", "yz"] {
                all.push(Proposal::new(two, ProposalKind::Field, 1).detail("vec2"));
            }
            all
        }
        "vec4" => {
            let mut all = letters("xyzw", "float");
            all.push(Proposal::new("xyz", ProposalKind::Field, 1).detail("vec3"));
            all
        }
        "mat2" => letters("xy", "column"),
        "mat3" => letters("xyz", "column"),
        "material" => words::output_names()
            .map(|output| {
                let proposal = Proposal::new(output, ProposalKind::Output, 0);
                match manual::entry(output, &[Kind::Output]) {
                    Some(entry) => proposal.described(&describe::of_manual(entry)),
                    None => proposal,
                }
            })
            .collect(),
        _ => Vec::new(),
    }
}

/// Modules and names that an import can name after `path`.
fn imported(known: &Known<'_>, path: &[String], at: usize) -> Vec<Proposal> {
    let module = |name: &str, detail: &str| {
        Proposal::new(name, ProposalKind::Module, 1)
            .snippet(name)
            .detail(detail)
    };
    let parts: Vec<&str> = path.iter().map(String::as_str).collect();
    let is_imported = |name: &str| {
        let uses = known.now.ast().into_iter().flat_map(|ast| &ast.uses);
        let of_path = uses.filter(|u| u.path.iter().map(|n| &n.node).eq(path));
        let mut names = of_path.flat_map(|u| &u.names).map(|n| &n.name);
        names
            .any(|n| n.node == name && !(n.span.start as usize..=n.span.end as usize).contains(&at))
    };
    match parts.as_slice() {
        [] => {
            let mut list = vec![module("std", "the library")];
            let own = Path::new(known.path);
            let beside = own.parent().map(|f| documents::names(f, "impasto"));
            for name in beside.unwrap_or_default() {
                let stem = name.trim_end_matches(".impasto");
                if own.file_name().is_some_and(|own| *own != *name) {
                    list.push(module(stem, "a file beside this one"));
                }
            }
            list
        }
        ["std"] => {
            let files = impasto_stdlib::files().iter();
            let mut folders: Vec<&str> = files.map(|f| f.folder).collect();
            folders.dedup();
            let importable = folders.into_iter().filter(|f| *f != "core");
            importable
                .map(|f| module(f, "a folder of the library"))
                .collect()
        }
        ["std", folder] => symbols::library()
            .filter(|entry| entry.file.folder == *folder && !is_imported(&entry.item.name))
            .map(|entry| {
                let item = &entry.item;
                let mut proposal = Proposal::new(&item.name, item.kind, 0);
                proposal.detail = item.declaration.lines().next().unwrap_or("").to_owned();
                proposal.docs = format!("```impasto\n{}\n```\n\n{}", item.declaration, item.docs);
                proposal
            })
            .collect(),
        _ => {
            let path = Path::new(known.path).with_file_name(parts.join("/") + ".impasto");
            let text = documents::text_at(&path.to_string_lossy()).unwrap_or_default();
            let (ast, _) =
                impasto_compiler::parser::parse(impasto_compiler::source::FileId(0), &text);
            let public = ast.items.iter().filter(|item| !item.private);
            let new = public.filter(|item| !is_imported(&item.name.node));
            new.map(|item| Proposal::new(&item.name.node, kind_of(&item.kind), 0))
                .collect()
        }
    }
}

fn units() -> Vec<Proposal> {
    let unit = |(rank, (_, name, _)): (usize, &(Unit, &str, f64))| {
        let proposal = Proposal::new(name, ProposalKind::Unit, rank as u8);
        match manual::entry(name, &[Kind::Unit]) {
            Some(entry) => proposal.described(&describe::of_manual(entry)),
            None => proposal,
        }
    };
    Unit::ALL.iter().enumerate().map(unit).collect()
}

fn metadata(given: &[String]) -> Vec<Proposal> {
    let key = |key: &str, snippet: &str, detail: &str| {
        Proposal::new(key, ProposalKind::Field, 0)
            .snippet(snippet)
            .detail(detail)
    };
    let mut keys = vec![
        key("label", "label: \"$1\"", "the name that people see"),
        key("group", "group: \"$1\"", "what it stands together with"),
        key("soft", "soft: ${1:0.0} .. ${2:1.0}", "the ends of a slider"),
        key("unit", "unit: ${1:mm}", "what its values are shown in"),
    ];
    keys.retain(|k| !given.contains(&k.label));
    keys
}

/// Files of pictures beside the source, for a texture.
fn pictures(known: &Known<'_>, cursor: &Cursor) -> Vec<Proposal> {
    let (folder, _) = cursor.prefix.rsplit_once('/').unwrap_or(("", ""));
    let own = Path::new(known.path).parent().map(|f| f.join(folder));
    let Some(here) = own else { return Vec::new() };
    let names = words::PICTURES
        .iter()
        .flat_map(|extension| documents::names(&here, extension));
    let path = |name: String| {
        let path = if folder.is_empty() {
            name
        } else {
            format!("{folder}/{name}")
        };
        Proposal::new(&path, ProposalKind::File, 0)
    };
    names.map(path).collect()
}

fn methods(known: &Known<'_>, at: usize, cursor: &Cursor) -> Vec<Proposal> {
    let mut list = vec![keyword("let", "let ${1:name} = $0;", "for all methods")];
    let item = known.now.item_at(at as u32);
    let defined: Vec<String> = match item.map(|(_, i)| &i.kind) {
        Some(ItemKind::Closure(c)) => c.methods.iter().map(|m| m.name.node.clone()).collect(),
        _ => Vec::new(),
    };
    if cursor.around == Around::Edf {
        list.push(
            Proposal::new("emit", ProposalKind::Function, 0)
                .snippet("emit(wo) = $0;")
                .detail("emit(wo: vector) -> color"),
        );
        list.retain(|p| !defined.contains(&p.label));
        return list;
    }
    for entry in manual::entries().iter().filter(|e| e.kind == Kind::Method) {
        if defined.contains(&entry.name) {
            continue;
        }
        let written = entry.written.first().map_or("", String::as_str);
        let inside = written
            .split_once('(')
            .and_then(|(_, rest)| rest.split_once(')'))
            .map_or("", |(inside, _)| inside);
        let names = inside.split(", ").map(|p| p.split(':').next().unwrap_or(p));
        let names = names.collect::<Vec<_>>().join(", ");
        list.push(
            Proposal::new(&entry.name, ProposalKind::Function, 0)
                .described(&describe::of_manual(entry))
                .snippet(format!("{}({names}) = $0;", entry.name)),
        );
    }
    list
}

/// The edit that imports what a proposal needs.
pub fn import_edit(known: &Analysis, text: &str, path: &str) -> Option<(Range<usize>, String)> {
    imports::added(known.ast()?, text, path)
}
