//! Where in the grammar a cursor stands, told by the tokens before it: they are there however broken the rest is.

use std::ops::Range;

use impasto_compiler::lexer::{Token, lex};
use impasto_compiler::source::FileId;

/// A cursor in a text.
#[derive(Clone, Debug, PartialEq)]
pub struct Cursor {
    /// What may stand there.
    pub place: Place,
    /// The part of the word that is before it.
    pub prefix: String,
    /// The word that it is in, empty if it is in none.
    pub word: Range<usize>,
    /// The call whose arguments it is among, innermost first.
    pub calls: Vec<Call>,
    /// What is defined around it.
    pub around: Around,
}

/// What may stand at a cursor.
#[derive(Clone, Debug, PartialEq)]
pub enum Place {
    /// Nothing that could be told.
    Nothing,
    /// A definition.
    Item,
    /// A definition behind `private`.
    PrivateItem,
    /// What `delta` goes before.
    Delta,
    /// A statement, or the last value of a block.
    Statement,
    /// A value.
    Value,
    /// An argument of the innermost call: a value, or the name of a parameter.
    Argument,
    /// A type.
    Type,
    /// A part of what ends at this byte, before the dot.
    Part(usize),
    /// A segment of an import, after these.
    Import(Vec<String>),
    /// A unit, after a number.
    Unit,
    /// A key of a parameter's metadata, after these.
    MetadataKey(Vec<String>),
    /// The inside of a string that may be the path of a picture.
    Path,
    /// A method of a closure.
    Method,
    /// A statement of a material, where parameters may be declared.
    MaterialStatement,
}

/// A call that is not closed before the cursor.
#[derive(Clone, Debug, PartialEq)]
pub struct Call {
    /// The name before the bracket, and where it stands.
    pub callee: String,
    /// Where it stands.
    pub at: usize,
    /// How many commas there are before the cursor.
    pub position: usize,
    /// The parameter that the argument at the cursor names.
    pub named: Option<String>,
    /// All parameters that arguments before the cursor name.
    pub given: Vec<String>,
    /// The byte behind the bracket.
    pub open: usize,
}

impl Call {
    /// How many parameters the arguments before the cursor gave by their places.
    pub fn by_place(&self) -> usize {
        self.position.saturating_sub(self.given.len())
    }
}

/// What is defined around a cursor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Around {
    /// Nothing.
    File,
    /// A material.
    Material,
    /// A function.
    Function,
    /// A bsdf.
    Bsdf,
    /// An edf.
    Edf,
    /// A struct.
    Struct,
}

/// Tokens with their bytes.
pub type Tokens = Vec<(Token, Range<usize>)>;

/// The cursor at byte `at` of a text.
pub fn cursor(text: &str, at: usize) -> Cursor {
    let tokens = tokens(text);
    let index = tokens.partition_point(|(_, range)| range.start < at);
    let last = index.checked_sub(1).map(|i| &tokens[i]);
    let is_comment = matches!(last, Some((Token::DocInner | Token::DocOuter, r)) if at <= r.end);
    if is_comment || comment(text, &tokens, at).is_some() {
        return Cursor {
            place: Place::Nothing,
            prefix: String::new(),
            word: at..at,
            calls: Vec::new(),
            around: Around::File,
        };
    }
    let is_word = |t: &Token| *t == Token::Ident || t.is_keyword();
    // The word, number or string that the cursor is in or behind. What begins there is not touched.
    let (word, is_string, is_number) = match last {
        Some((token, range)) if at <= range.end && is_word(token) => (range.clone(), false, false),
        Some((Token::Str, range)) if at < range.end || !closes(text, range) => {
            let end = range.end - usize::from(closes(text, range));
            (range.start + 1..end, true, false)
        }
        Some((Token::Str | Token::Int | Token::Float | Token::Hex, range)) if at <= range.end => {
            (range.start..at, false, true)
        }
        _ => (at..at, false, false),
    };
    let before = tokens.partition_point(|(_, range)| {
        range.end <= word.start && (!is_string || range.end < word.start)
    });
    let before = &tokens[..before];
    let open = open_brackets(before);
    let around = around(text, before, &open);
    let place = match (is_string, is_number) {
        (true, _) if is_metadata(before, &open) => Place::Nothing,
        (true, _) => Place::Path,
        (_, true) => Place::Nothing,
        _ => place(text, before, &open, around),
    };
    let calls = calls(text, before, &open);
    let prefix = text.get(word.start..at).unwrap_or_default().to_owned();
    let word = if is_number { at..at } else { word };
    Cursor {
        place,
        prefix,
        word,
        calls,
        around,
    }
}

/// The tokens of a text with their bytes.
pub fn tokens(text: &str) -> Tokens {
    let (tokens, _) = lex(FileId(0), text);
    tokens.into_iter().map(|(t, s)| (t, s.range())).collect()
}

/// Does a string end in a quote?
fn closes(text: &str, range: &Range<usize>) -> bool {
    range.len() > 1 && text[range.clone()].ends_with('"')
}

/// The comment that byte `at` is in, without the break of its line.
pub fn comment(text: &str, tokens: &[(Token, Range<usize>)], at: usize) -> Option<Range<usize>> {
    let next = tokens.partition_point(|(_, range)| range.end <= at);
    let start = next.checked_sub(1).map_or(0, |i| tokens[i].1.end);
    let end = tokens
        .get(next)
        .map_or(text.len(), |(_, range)| range.start);
    let mut from = start;
    // Between tokens there are comments and white space only.
    while let Some(rest) = text.get(from..end) {
        let begin = from + rest.find('/')?;
        let rest = &text[begin..end];
        let (length, reaches) = if rest.starts_with("/*") {
            let close = rest.get(2..).and_then(|inside| inside.find("*/"));
            // One that is not closed goes on to the end.
            (close.map_or(rest.len(), |n| n + 4), close.is_none())
        } else {
            (rest.find('\n').unwrap_or(rest.len()), true)
        };
        let whole = begin..begin + length;
        if at <= begin {
            return None;
        }
        if at < whole.end || (reaches && at == whole.end) {
            return Some(whole);
        }
        from = whole.end.max(begin + 1);
    }
    None
}

/// The indices of brackets that are not closed, outermost first. A brace closes brackets that were forgotten.
fn open_brackets(tokens: &[(Token, Range<usize>)]) -> Vec<usize> {
    let mut open: Vec<usize> = Vec::new();
    for (index, (token, _)) in tokens.iter().enumerate() {
        match token {
            Token::LeftParen | Token::LeftBracket | Token::LeftBrace => open.push(index),
            Token::RightParen | Token::RightBracket => {
                let partner = if *token == Token::RightParen {
                    Token::LeftParen
                } else {
                    Token::LeftBracket
                };
                if open.last().is_some_and(|i| tokens[*i].0 == partner) {
                    open.pop();
                }
            }
            Token::RightBrace => {
                let brace = open.iter().rposition(|i| tokens[*i].0 == Token::LeftBrace);
                if let Some(brace) = brace {
                    open.truncate(brace);
                }
            }
            // A definition cannot stand in brackets: what is open before it was forgotten.
            Token::Material | Token::Fn | Token::Struct | Token::Use
                if is_at_start(tokens, index) =>
            {
                open.clear();
            }
            // A statement ends what its brackets lack.
            Token::Semicolon | Token::Let | Token::Var | Token::Param => {
                while open
                    .last()
                    .is_some_and(|i| tokens[*i].0 != Token::LeftBrace)
                {
                    open.pop();
                }
            }
            _ => {}
        }
    }
    open
}

/// May a definition begin at a token?
fn is_at_start(tokens: &[(Token, Range<usize>)], index: usize) -> bool {
    // `material = ...;` and `material` behind `=` are none.
    let next = tokens.get(index + 1).map(|t| t.0);
    let is_material = tokens[index].0 == Token::Material;
    next == Some(Token::Ident) || (!is_material && next.is_some())
}

fn around(text: &str, tokens: &[(Token, Range<usize>)], open: &[usize]) -> Around {
    let Some(first) = open.first().filter(|i| tokens[**i].0 == Token::LeftBrace) else {
        return Around::File;
    };
    // Back to what begins the definition: the keyword behind the last `;` or `}`.
    for (token, range) in tokens[..*first].iter().rev() {
        match token {
            Token::Material => return Around::Material,
            Token::Fn => return Around::Function,
            Token::Bsdf | Token::Edf => {
                // The type of a result or parameter is no beginning of a definition.
                let before = text[..range.start].trim_end();
                if !before.ends_with("->") && !before.ends_with(':') {
                    let is_bsdf = *token == Token::Bsdf;
                    return if is_bsdf { Around::Bsdf } else { Around::Edf };
                }
            }
            Token::Struct => return Around::Struct,
            Token::Semicolon | Token::RightBrace => return Around::File,
            _ => {}
        }
    }
    Around::File
}

fn place(text: &str, before: &[(Token, Range<usize>)], open: &[usize], around: Around) -> Place {
    let Some((last, _)) = before.last() else {
        return Place::Item;
    };
    let from = before
        .iter()
        .rposition(|(t, _)| matches!(t, Token::Semicolon | Token::LeftBrace | Token::RightBrace));
    let statement = &before[from.map_or(0, |i| i + 1)..];
    let first = statement.first().map(|t| t.0);
    if let Some(path) = import(text, before) {
        return Place::Import(path);
    }
    match last {
        Token::Dot => {
            let end = before.get(before.len().wrapping_sub(2)).map(|t| t.1.end);
            return end.map_or(Place::Nothing, Place::Part);
        }
        Token::Arrow => return Place::Type,
        Token::Fn
        | Token::Struct
        | Token::Const
        | Token::Let
        | Token::Var
        | Token::Param
        | Token::For
        | Token::As => return Place::Nothing,
        Token::Material if around == Around::File => return Place::Nothing,
        _ => {}
    }
    let number = matches!(last, Token::Int | Token::Float);
    let innermost = open.last().map(|i| (before[*i].0, *i));
    match innermost {
        None => {
            let is_const = first == Some(Token::Const);
            return match last {
                Token::Colon if is_const => Place::Type,
                _ if is_const && number => Place::Unit,
                _ if is_const && statement.iter().any(|t| t.0 == Token::Assign) => Place::Value,
                _ if is_const => Place::Nothing,
                Token::Private => Place::PrivateItem,
                Token::Delta => Place::Delta,
                Token::Semicolon | Token::RightBrace | Token::DocOuter | Token::DocInner => {
                    Place::Item
                }
                Token::Assign => Place::Value,
                _ if statement.iter().any(|t| t.0 == Token::Assign) => {
                    if number {
                        Place::Unit
                    } else {
                        Place::Value
                    }
                }
                _ => Place::Nothing,
            };
        }
        Some((Token::LeftParen, index)) => {
            if matches!(around, Around::Bsdf | Around::Edf) && is_head(before, open) {
                return Place::Nothing;
            }
            if is_declaration(before, index) {
                return match last {
                    Token::Colon => Place::Type,
                    Token::Assign => Place::Value,
                    _ if number => Place::Unit,
                    _ => Place::Nothing,
                };
            }
            let is_call = index > 0 && before[index - 1].0 == Token::Ident;
            return match last {
                _ if number => Place::Unit,
                Token::LeftParen | Token::Comma if is_call => Place::Argument,
                _ => Place::Value,
            };
        }
        Some((Token::LeftBracket, _)) => {
            return if number { Place::Unit } else { Place::Value };
        }
        Some(_) => {}
    }
    if is_metadata(before, open) {
        let inside = innermost.map_or(&[][..], |(_, i)| &before[i + 1..]);
        let keys = names(text, inside);
        let is_unit = *last == Token::Colon && keys.last().is_some_and(|k| k == "unit");
        return match last {
            Token::LeftBrace | Token::Comma => Place::MetadataKey(keys),
            Token::Colon if is_unit => Place::Unit,
            Token::Colon => Place::Value,
            _ if number => Place::Unit,
            _ => Place::Nothing,
        };
    }
    let depth = open
        .iter()
        .filter(|i| before[**i].0 == Token::LeftBrace)
        .count();
    match last {
        Token::LeftBrace | Token::Semicolon | Token::RightBrace | Token::DocOuter => {
            match (around, depth) {
                (Around::Material, 1) => Place::MaterialStatement,
                (Around::Bsdf | Around::Edf, 1) => Place::Method,
                (Around::Struct, _) => Place::Nothing,
                _ => Place::Statement,
            }
        }
        Token::Comma if around == Around::Struct => Place::Nothing,
        Token::Colon if around == Around::Struct => Place::Type,
        Token::Colon
            if matches!(
                first,
                Some(Token::Let | Token::Var | Token::Param | Token::DocOuter)
            ) =>
        {
            Place::Type
        }
        _ if number => Place::Unit,
        _ => Place::Value,
    }
}

/// The segments before the cursor, if it is in an import.
fn import(text: &str, before: &[(Token, Range<usize>)]) -> Option<Vec<String>> {
    let start = before.iter().rposition(|(t, _)| *t == Token::Use)?;
    let rest = &before[start + 1..];
    if rest.iter().any(|(t, _)| *t == Token::Semicolon) {
        return None;
    }
    // An import that was not ended does not reach into what follows.
    let is_of_import = |t: &Token| {
        matches!(
            t,
            // Folders of the library may have the names of keywords.
            Token::Ident
                | Token::Bsdf
                | Token::Edf
                | Token::PathSeparator
                | Token::LeftBrace
                | Token::Comma
                | Token::RightBrace
                | Token::As
        )
    };
    if !rest.iter().all(|(t, _)| is_of_import(t)) {
        return None;
    }
    match rest.last().map(|t| t.0) {
        None | Some(Token::PathSeparator | Token::LeftBrace | Token::Comma) => {}
        _ => return None,
    }
    let segments = rest.iter().take_while(|(t, _)| *t != Token::LeftBrace);
    let names = segments.filter(|(t, _)| *t != Token::PathSeparator);
    Some(names.map(|(_, r)| text[r.clone()].to_owned()).collect())
}

/// Is a bracket that of a definition's parameters?
fn is_declaration(tokens: &[(Token, Range<usize>)], bracket: usize) -> bool {
    let name = bracket.checked_sub(1).map(|i| tokens[i].0);
    let word = bracket.checked_sub(2).map(|i| tokens[i].0);
    name == Some(Token::Ident) && matches!(word, Some(Token::Fn | Token::Bsdf | Token::Edf))
}

/// Is the innermost bracket that of a method's arguments, which an author names?
fn is_head(tokens: &[(Token, Range<usize>)], open: &[usize]) -> bool {
    let [block, bracket] = open else {
        return false;
    };
    let token = |i: Option<usize>| i.and_then(|i| tokens.get(i)).map(|t| t.0);
    let begins = matches!(
        token(bracket.checked_sub(2)),
        Some(Token::LeftBrace | Token::Semicolon | Token::RightBrace)
    );
    token(Some(*block)) == Some(Token::LeftBrace)
        && token(bracket.checked_sub(1)) == Some(Token::Ident)
        && begins
}

/// The names before colons, in no further brackets.
fn names(text: &str, tokens: &[(Token, Range<usize>)]) -> Vec<String> {
    let (mut depth, mut names) = (0, Vec::new());
    for (i, (token, _)) in tokens.iter().enumerate() {
        match token {
            Token::LeftParen | Token::LeftBracket | Token::LeftBrace => depth += 1,
            Token::RightParen | Token::RightBracket | Token::RightBrace => depth -= 1,
            Token::Colon if depth == 0 => {
                let name = i.checked_sub(1).map(|i| &tokens[i]);
                let name = name.filter(|(t, _)| *t == Token::Ident);
                names.extend(
                    name.and_then(|(_, r)| text.get(r.clone()))
                        .map(str::to_owned),
                );
            }
            _ => {}
        }
    }
    names
}

/// Is the innermost bracket the block behind a parameter?
fn is_metadata(tokens: &[(Token, Range<usize>)], open: &[usize]) -> bool {
    let Some(brace) = open.last() else {
        return false;
    };
    let before = tokens[..*brace].iter().rev();
    let mut statement = before
        .take_while(|(t, _)| !matches!(t, Token::Semicolon | Token::LeftBrace | Token::RightBrace));
    statement.any(|(t, _)| *t == Token::Param)
}

fn calls(text: &str, tokens: &[(Token, Range<usize>)], open: &[usize]) -> Vec<Call> {
    let mut calls = Vec::new();
    for index in open.iter().rev() {
        match tokens[*index].0 {
            Token::LeftBrace => break,
            Token::LeftBracket => continue,
            _ => {}
        }
        let Some((Token::Ident, name)) = index.checked_sub(1).map(|i| tokens[i].clone()) else {
            continue;
        };
        if is_declaration(tokens, *index) {
            break;
        }
        let mut call = Call {
            callee: text[name.clone()].to_owned(),
            at: name.start,
            position: 0,
            named: None,
            given: Vec::new(),
            open: tokens[*index].1.end,
        };
        let mut depth = 0;
        let inside = &tokens[index + 1..];
        for (i, (token, _)) in inside.iter().enumerate() {
            match token {
                Token::LeftParen | Token::LeftBracket | Token::LeftBrace => depth += 1,
                Token::RightParen | Token::RightBracket | Token::RightBrace => depth -= 1,
                Token::Comma if depth == 0 => {
                    call.position += 1;
                    call.named = None;
                }
                Token::Colon if depth == 0 && i > 0 && inside[i - 1].0 == Token::Ident => {
                    let name = text[inside[i - 1].1.clone()].to_owned();
                    call.given.push(name.clone());
                    call.named = Some(name);
                }
                _ => {}
            }
        }
        calls.push(call);
    }
    calls
}
