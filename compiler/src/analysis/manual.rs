//! What the language manual says of built-in functions, types, inputs and outputs.
//!
//! The manual (docs/language.md) is the one place where they are described. Its tables are read: each row
//! describes the names that its first cells show as code.

use std::sync::OnceLock;

/// The manual.
const TEXT: &str = include_str!("../../../docs/language.md");

/// The manual of pictures, with the arguments of the functions that read them.
const TEXTURES: &str = include_str!("../../../docs/textures.md");

/// What the manual says of a name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// The name.
    pub name: String,
    /// What kind of thing it is.
    pub kind: Kind,
    /// How it is written, such as `clamp(x, low, high)`; more than one of what takes various arguments.
    pub written: Vec<String>,
    /// Its type, where the manual has a column for it.
    pub ty: Option<String>,
    /// What it is, as Markdown.
    pub about: String,
}

/// Kinds of things that the manual has tables of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A function of values.
    Function,
    /// A way to combine closures.
    Form,
    /// A type.
    Type,
    /// An input of a material.
    Input,
    /// An output of a material.
    Output,
    /// A method of a closure.
    Method,
    /// A unit of lengths or angles.
    Unit,
}

/// The tables, by their first lines: what their rows describe, the cells with names, whether a cell has a type, and
/// the cells with text.
const TABLES: [(&str, Kind, usize, Option<usize>, usize); 8] = [
    ("| name | written | is |", Kind::Function, 1, None, 2),
    ("| function | is |", Kind::Function, 0, None, 1),
    ("| form | meaning |", Kind::Form, 0, None, 1),
    ("| type | what it is |", Kind::Type, 0, None, 1),
    ("| input | type | is |", Kind::Input, 0, Some(1), 2),
    (
        "| output | type | meaning | when it is missing |",
        Kind::Output,
        0,
        Some(1),
        2,
    ),
    ("| method | gives |", Kind::Method, 0, None, 1),
    ("| unit | is |", Kind::Unit, 0, None, 1),
];

/// Everything that the manual has tables of, in its order.
pub fn entries() -> &'static [Entry] {
    static ENTRIES: OnceLock<Vec<Entry>> = OnceLock::new();
    ENTRIES.get_or_init(|| read(TEXT))
}

/// What the manual says of `name` as one of some kinds.
pub fn entry(name: &str, kinds: &[Kind]) -> Option<&'static Entry> {
    let mut entries = entries().iter();
    entries.find(|e| e.name == name && kinds.contains(&e.kind))
}

/// The rules of the grammar that begin with or hold a keyword, each with what the manual says beside it.
pub fn grammar(keyword: &str) -> Vec<&'static str> {
    static RULES: OnceLock<Vec<&str>> = OnceLock::new();
    let rules = RULES.get_or_init(|| {
        let grammar = TEXT.split("## Grammar\n").nth(1).unwrap_or_default();
        let lines = grammar.lines().skip_while(|l| l.is_empty());
        let lines = lines.take_while(|l| l.starts_with("    "));
        lines.map(|l| l.trim().trim_start_matches("| ")).collect()
    });
    let quoted = format!("\"{keyword}\"");
    let of_it = rules.iter().filter(|rule| rule.contains(&quoted));
    of_it.copied().collect()
}

/// The functions of pictures take more than the manual of the language shows.
fn with_all_arguments(entries: &mut [Entry]) {
    let rows = TEXTURES
        .lines()
        .skip_while(|l| *l != "| argument | default | means |");
    let mut arguments: Vec<String> = Vec::new();
    for row in rows.skip(2).take_while(|l| l.starts_with('|')) {
        let cells = cells(row);
        let default = spans(cells.get(1).map_or("", |c| c)).next();
        let default = default.map_or(String::new(), |d| format!(" = {d}"));
        let names = spans(cells.first().map_or("", |c| c)).flat_map(|c| c.split(", "));
        arguments.extend(names.map(|name| format!("{name}{default}")));
    }
    for entry in entries {
        if ["image", "image_data", "image_alpha"].contains(&&*entry.name) {
            entry.written = vec![format!("{}({})", entry.name, arguments.join(", "))];
        }
    }
}

fn read(text: &str) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    let mut table = None;
    for line in text.lines() {
        if !line.starts_with('|') {
            table = None;
            continue;
        }
        table = table.or_else(|| TABLES.iter().find(|t| t.0 == line));
        let Some((_, kind, names, ty, about)) = table else {
            continue;
        };
        let cells = cells(line);
        let Some(about) = cells.get(*about..).filter(|rest| !rest.is_empty()) else {
            continue;
        };
        let about: Vec<&str> = about.iter().map(|c| c.as_str()).collect();
        let about = match kind {
            Kind::Output => format!(
                "{}; when it is missing: {}",
                about[0],
                about[1..].join("; ")
            ),
            _ => about.join("; "),
        };
        let ty = ty.and_then(|i| cells.get(i));
        for written in spans(cells.get(*names).map_or("", |c| c.as_str())) {
            let is_name = |c: char| c == '_' || c.is_ascii_alphanumeric();
            let end = written.find(|c| !is_name(c)).unwrap_or(written.len());
            let name = &written[..end];
            let is_call = !matches!(kind, Kind::Function | Kind::Form | Kind::Method)
                || written[end..].starts_with('(');
            if name.is_empty() || !is_call {
                continue;
            }
            match entries
                .iter_mut()
                .find(|e| e.name == name && e.kind == *kind)
            {
                Some(known) => {
                    if !known.written.iter().any(|w| w == written) {
                        known.written.push(written.to_owned());
                    }
                    if !known.about.contains(&about) {
                        known.about = format!("{}\n\n{about}", known.about);
                    }
                }
                None => entries.push(Entry {
                    name: name.to_owned(),
                    kind: *kind,
                    written: vec![written.to_owned()],
                    ty: ty.map(|ty| ty.trim_matches('`').to_owned()),
                    about: about.clone(),
                }),
            }
        }
    }
    with_all_arguments(&mut entries);
    entries
}

/// The cells of a row, without the bars; `\|` is a bar within one.
fn cells(line: &str) -> Vec<String> {
    let inner = line.trim().trim_start_matches('|');
    let inner = inner.strip_suffix('|').unwrap_or(inner);
    let inner = inner.replace("\\|", "\u{1}");
    let cells = inner.split('|').map(|cell| cell.trim());
    cells.map(|cell| cell.replace('\u{1}', "|")).collect()
}

/// What stands between backquotes.
fn spans(cell: &str) -> impl Iterator<Item = &str> {
    cell.split('`').skip(1).step_by(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ast::Unit;
    use crate::sema::words;

    #[test]
    fn the_manual_describes_all_that_is_built_in() {
        let has = |name: &str, kinds: &[Kind]| {
            let found = entry(name, kinds);
            assert!(found.is_some(), "docs/language.md has no row for `{name}`");
        };
        words::built_in_functions().for_each(|f| has(f, &[Kind::Function, Kind::Form]));
        words::type_names().for_each(|ty| has(ty, &[Kind::Type]));
        words::input_names().for_each(|input| has(input, &[Kind::Input]));
        words::output_names().for_each(|output| has(output, &[Kind::Output]));
        Unit::ALL
            .iter()
            .for_each(|(_, unit, _)| has(unit, &[Kind::Unit]));
    }

    #[test]
    fn the_grammar_shows_every_keyword() {
        for keyword in crate::lexer::Token::KEYWORDS {
            let rules = grammar(keyword);
            assert!(
                !rules.is_empty(),
                "docs/language.md has no rule of `{keyword}`"
            );
        }
        assert!(grammar("use")[0].starts_with("use      = \"use\" path"));
    }

    #[test]
    fn functions_of_pictures_show_all_arguments() {
        let image = entry("image", &[Kind::Function]).expect("a row");
        let all = "image(picture: texture, uv: vec2, width: vec2 = vec2(0.0), wrap: int = REPEAT, \
                   wrap_u: int = wrap, wrap_v: int = wrap, filter: int = BILINEAR)";
        assert_eq!(image.written, [all]);
    }

    #[test]
    fn rows_are_read_with_all_their_forms() {
        let hash = entry("hash", &[Kind::Function]).expect("a row");
        assert_eq!(hash.written, ["hash(i)", "hash(i, j)", "hash(i, j, k)"]);
        let opacity = entry("opacity", &[Kind::Output]).expect("a row");
        assert_eq!(opacity.ty.as_deref(), Some("float"));
        assert!(opacity.about.ends_with("when it is missing: 1"));
    }
}
