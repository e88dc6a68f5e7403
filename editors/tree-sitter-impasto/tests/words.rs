//! The words of the grammars for editors are those of the compiler's own tables.

use std::collections::BTreeSet;
use std::fs;

use impasto_compiler::ast::Unit;
use impasto_compiler::lexer::Token;
use impasto_compiler::sema::words::{input_names, output_names, type_names};
use serde_json::Value;
use tree_sitter::Language;

use crate::{errors, root, tree};

type Words = BTreeSet<String>;

fn set<'a>(words: impl IntoIterator<Item = &'a str>) -> Words {
    words.into_iter().map(str::to_owned).collect()
}

fn keywords() -> Words {
    set(Token::KEYWORDS.iter().copied())
}

fn units() -> Words {
    set(Unit::ALL.iter().map(|(_, name, _)| *name))
}

/// What a material can ask of its surface, and what it assigns.
pub(crate) fn inputs_and_outputs() -> Words {
    set(input_names().chain(output_names()))
}

fn json(path: &str) -> Value {
    let path = root().join("editors").join(path);
    let text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Every spelling that is a node of its own.
fn spellings() -> Words {
    let language = Language::from(tree_sitter_impasto::LANGUAGE);
    let count = u16::try_from(language.node_kind_count()).expect("few kinds");
    let own = |id: &u16| language.node_kind_is_visible(*id) && !language.node_kind_is_named(*id);
    let kinds = (0..count).filter(own);
    let kinds = kinds.filter_map(|id| language.node_kind_for_id(id));
    set(kinds.filter(|kind| *kind != "end"))
}

/// What is a word of the grammar only before a title, and a name elsewhere.
const CONTEXTUAL: &str = "test";

fn is_word(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic())
}

#[test]
fn the_grammars_keywords_are_the_compilers() {
    let mut words: Words = spellings().into_iter().filter(|s| is_word(s)).collect();
    assert!(words.remove(CONTEXTUAL), "it is no longer in the grammar");
    assert_eq!(words, keywords());
}

/// Or else a half-typed line takes the keyword below it for a name.
#[test]
fn every_keyword_is_reserved() {
    let grammar = json("tree-sitter-impasto/src/grammar.json");
    let reserved = grammar["reserved"]["global"].as_array().expect("a list");
    let reserved = reserved.iter().filter_map(|r| r["value"].as_str());
    assert_eq!(set(reserved), keywords());
}

#[test]
fn the_grammars_marks_are_the_compilers() {
    let marks: Words = spellings().into_iter().filter(|s| !is_word(s)).collect();
    let mut expected = set(Token::MARKS.iter().copied());
    // A string is one token to the compiler, and three nodes here.
    expected.insert("\"".to_owned());
    assert_eq!(marks, expected);
}

#[test]
fn the_scanners_units_are_the_compilers() {
    let path = root().join("editors/tree-sitter-impasto/src/scanner.c");
    let text = fs::read_to_string(path).expect("the scanner");
    let list = text.split_once("UNITS[] = {").expect("a list of units").1;
    let list = list.split_once('}').expect("its end").0;
    assert_eq!(set(list.split('"').skip(1).step_by(2)), units());
    for unit in units() {
        let source = format!("const A: length = 0.5{unit} + 2 {unit};");
        let tree = tree(&source);
        assert_eq!(errors(&tree), Vec::<String>::new(), "{source}");
        assert_eq!(tree.root_node().to_sexp().matches("(unit)").count(), 2);
    }
}

/// The words of the last group of a pattern: `(a|b)`.
fn alternatives(pattern: &str) -> Words {
    let inner = pattern.rsplit_once('(').map_or(pattern, |(_, rest)| rest);
    let inner = inner.trim_start_matches("?:");
    set(inner.split(')').next().unwrap_or("").split('|'))
}

fn matches<'a>(grammar: &'a Value, name: &str) -> Vec<&'a str> {
    let rule = &grammar["repository"][name];
    let patterns = rule["patterns"]
        .as_array()
        .map_or(std::slice::from_ref(rule), |p| p);
    let found: Vec<&str> = patterns
        .iter()
        .filter_map(|p| p["match"].as_str())
        .collect();
    assert!(!found.is_empty(), "no `{name}` in the TextMate grammar");
    found
}

/// Visual Studio Code has no node where the tests run: its grammar is held here.
#[test]
fn the_textmate_grammars_words_are_the_compilers() {
    let grammar = json("vscode/syntaxes/impasto.tmLanguage.json");
    let all = |name| {
        matches(&grammar, name)
            .into_iter()
            .flat_map(alternatives)
            .collect::<Words>()
    };
    assert_eq!(all("keywords"), keywords());
    assert_eq!(all("types"), set(type_names()));
    assert_eq!(all("surface"), inputs_and_outputs());
    assert_eq!(all("units"), units());
}

/// Words between two marks of a text, by blanks or quotes.
fn words_between<'t>(text: &'t str, start: &str, end: &str) -> Vec<&'t str> {
    let list = text
        .split_once(start)
        .unwrap_or_else(|| panic!("no {start:?}"))
        .1;
    let list = list.split_once(end).expect("its end").0;
    list.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'))
        .filter(|word| !word.is_empty())
        .collect()
}

#[test]
fn emacss_words_are_the_compilers() {
    let text = fs::read_to_string(root().join("editors/emacs/impasto-mode.el")).expect("the mode");
    let words = |name: &str| {
        set(words_between(
            &text,
            &format!("(defconst {name}\n  '("),
            ")",
        ))
    };
    assert_eq!(words("impasto-keywords"), keywords());
    assert_eq!(words("impasto-types"), set(type_names()));
    assert_eq!(words("impasto-surface"), inputs_and_outputs());
    assert_eq!(words("impasto-units"), units());
}

#[test]
fn vims_words_are_the_compilers() {
    let path = "editors/neovim/syntax/impasto.vim";
    let text = fs::read_to_string(root().join(path)).expect("the syntax");
    let words = |group: &str| {
        let start = format!("syntax keyword {group} ");
        let lines = text
            .lines()
            .filter_map(|line| line.strip_prefix(start.as_str()));
        // An option of the command, not a word.
        let words = lines.flat_map(str::split_whitespace);
        set(words.filter(|word| *word != "contained"))
    };
    let keyword_groups = [
        "impastoKeyword",
        "impastoConditional",
        "impastoRepeat",
        "impastoStatement",
        "impastoBoolean",
    ];
    let all = keyword_groups
        .into_iter()
        .flat_map(words)
        .collect::<Words>();
    assert_eq!(all, keywords());
    // `bsdf` and `edf` are keywords to Vim.
    let types = set(type_names());
    assert_eq!(
        words("impastoType"),
        types.difference(&keywords()).cloned().collect()
    );
    assert_eq!(words("impastoSurface"), inputs_and_outputs());
    let line = text
        .lines()
        .find(|line| line.starts_with("syntax match impastoUnit "));
    let list = line
        .and_then(|line| line.rsplit_once("\\%("))
        .expect("the units")
        .1;
    let list = list.split_once("\\)").expect("their end").0;
    assert_eq!(set(list.split("\\|")), units());
}

#[test]
fn kates_words_are_the_compilers() {
    let path = root().join("editors/kate/impasto.xml");
    let text = fs::read_to_string(path).expect("the syntax");
    let words = |name: &str| {
        let list = text.split_once(&format!("<list name=\"{name}\">"));
        let list = list.unwrap_or_else(|| panic!("no list `{name}`")).1;
        let list = list.split_once("</list>").expect("its end").0;
        set(list
            .split("<item>")
            .skip(1)
            .filter_map(|i| i.split('<').next()))
    };
    let all: Words = ["keywords", "control"]
        .into_iter()
        .flat_map(words)
        .collect();
    assert_eq!(all, keywords());
    let types = set(type_names());
    assert_eq!(
        words("types"),
        types.difference(&keywords()).cloned().collect()
    );
    assert_eq!(words("surface"), inputs_and_outputs());
    assert_eq!(words("units"), units());
}
