//! The editors' tree is the compiler's: same operands, same precedence, same statements.

use impasto_compiler::lexer::{Token, lex};
use impasto_compiler::parser;
use impasto_compiler::source::FileId;

use crate::printed::printed;
use crate::random::{Random, expression};
use crate::{compiled, errors, good_sources, tree};

/// Text whose runs of blanks are one blank.
fn flat(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Compares the trees of a source that both read.
fn compare(what: &str, text: &str) {
    let tree = tree(text);
    assert!(
        !tree.root_node().has_error(),
        "{what}: {:#?}\n{text}",
        errors(&tree)
    );
    let (module, _) = compiled(text);
    assert_eq!(
        flat(&printed(text, tree.root_node())),
        flat(&parser::print(&module)),
        "{what}\n{text}"
    );
}

#[test]
fn good_sources_have_the_compilers_tree() {
    for (path, text) in good_sources() {
        compare(&path.display().to_string(), &text);
    }
}

#[test]
fn random_expressions_have_the_compilers_tree() {
    let mut random = Random(1);
    let mut read = 0;
    for case in 0..4000 {
        let value = expression(&mut random, 1 + case % 5);
        let text = format!("const A: float = {value};\n");
        let (_, diagnostics) = compiled(&text);
        // An `if` at the start of a block ends there, so that an operator behind it is an error.
        if diagnostics
            .iter()
            .all(|d| d.message == "comparisons cannot be chained")
        {
            read += 1;
            compare(&format!("case {case}"), &text);
        }
    }
    assert!(read > 3000, "only {read} were fit to compare");
}

/// Every pair of operators, so that no level is left to chance.
#[test]
fn operators_bind_as_in_the_compiler() {
    let marks = Token::MARKS;
    let is_infix = |mark: &&&str| {
        let text = format!("const A: float = a {mark} 1;");
        compiled(&text).1.is_empty()
    };
    let infix: Vec<&&str> = marks.iter().filter(is_infix).collect();
    assert_eq!(infix.len(), 18, "{infix:?}");
    for a in &infix {
        for b in &infix {
            let what = format!("{a} and {b}");
            compare(&what, &format!("const A: float = x {a} y {b} -z.w;"));
            compare(&what, &format!("const A: float = -x[0] {a} !y {b} z;"));
        }
    }
}

/// An `if` or block at the start of a statement ends it, but not elsewhere.
#[test]
fn statements_end_where_the_compilers_do() {
    for body in [
        "if a { b = 1; } -c",
        "if a { b = 1; } [c, d]",
        "if a { b = 1; } (c + d)",
        "if a { 1 } else { 2 }",
        "if a { 1 } else if b { 2 } else { 3 }",
        "if a { b = 1; } else if b { b = 2; }",
        "if a { b = 1; } !c",
        "let x = if a { 1 } else { 2 }.x; x",
        "let x = if a { 1 } else { 2 } + 3; x",
        "{ 1 } + 2",
        "{ a }.x = 3; b",
        "for i in 0..8 { a[i] += 1.0; } a[0]",
        "for i in 0. .. 8 { break; } -a",
        "while a < 2 limit 8 { a += 1; continue; } a",
        "while a { } a",
        "var a: float[2] = [1, 2]; a[0] <<= 2; a",
        "",
    ] {
        compare(body, &format!("fn f(a: float) -> float {{ {body} }}\n"));
    }
}

/// Sources that somebody edited by a token or two: what the compiler reads without a complaint is the same tree here.
#[test]
fn edited_sources_agree_as_far_as_the_compiler_reads_them() {
    let mut random = Random(2);
    let sources = good_sources();
    let mut read = 0;
    for _ in 0..4000 {
        let (path, text) = &sources[random.below(sources.len())];
        let edited = edit(&mut random, text);
        let (_, diagnostics) = compiled(&edited);
        if diagnostics.is_empty() {
            read += 1;
            compare(&path.display().to_string(), &edited);
        }
    }
    assert!(
        read > 200,
        "only {read} edits were harmless: the test is idle"
    );
}

/// What is an error to the compiler's grammar is one here. Other complaints are not about the shape of a source.
#[test]
fn what_the_compiler_cannot_read_has_an_error_here() {
    let wider = [
        "comparisons cannot be chained",
        "`use` after a definition",
        "`let` after a method",
    ];
    let mut random = Random(3);
    let sources = good_sources();
    let mut refused = 0;
    for _ in 0..4000 {
        let (path, text) = &sources[random.below(sources.len())];
        let edited = edit(&mut random, text);
        let (_, diagnostics) = compiled(&edited);
        let wrong = diagnostics.iter().find(|d| {
            d.code.id() == "E0107" && !wider.iter().any(|message| d.message.contains(message))
        });
        if let Some(wrong) = wrong {
            refused += 1;
            assert!(
                tree(&edited).root_node().has_error(),
                "{}: {wrong:?}\n{edited}",
                path.display()
            );
        }
    }
    assert!(
        refused > 200,
        "only {refused} edits did harm: the test is idle"
    );
}

/// A source with one token deleted, doubled, or put in the place of another.
pub(crate) fn edit(random: &mut Random, text: &str) -> String {
    let (mut tokens, _) = lex(FileId(0), text);
    // Documentation where none belongs is a comment to an editor.
    tokens.retain(|(token, _)| !matches!(token, Token::DocOuter | Token::DocInner));
    let at = tokens[random.below(tokens.len())].1.range();
    let other = &text[tokens[random.below(tokens.len())].1.range()];
    let (before, after) = (&text[..at.start], &text[at.end..]);
    match random.below(4) {
        0 => format!("{before}{after}"),
        1 => format!("{before}{0} {0}{after}", &text[at.clone()]),
        2 => format!("{before}{other}{after}"),
        _ => format!("{before}{other}\n{}{after}", &text[at.clone()]),
    }
}
