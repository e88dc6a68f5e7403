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
    /// A key of a parameter's metadata.
    MetadataKey,
    /// The inside of a string, which begins at this byte.
    Text(usize),
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

/// What is defined around a cursor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Around {
    /// Nothing.
    File,
    /// A material.
    Material,
    /// A function.
    Function,
    /// A bsdf or edf.
    Closure,
    /// A struct.
    Struct,
}

type Tokens = Vec<(Token, Range<usize>)>;

/// The cursor at byte `at` of a text.
pub fn cursor(text: &str, at: usize) -> Cursor {
    let (tokens, _) = lex(FileId(0), text);
    let tokens: Tokens = tokens.into_iter().map(|(t, s)| (t, s.range())).collect();
    let index = tokens.partition_point(|(_, range)| range.start < at);
    let last = index.checked_sub(1).map(|i| &tokens[i]);
    let is_word = |t: &Token| *t == Token::Ident || t.is_keyword();
    if let Some((token, range)) = last
        && at <= range.end
        && matches!(
            token,
            Token::Str | Token::DocInner | Token::DocOuter | Token::Int | Token::Float | Token::Hex
        )
    {
        let inside = *token == Token::Str && (at < range.end || !closes(text, range));
        let place = if inside {
            Place::Text(range.start + 1)
        } else {
            Place::Nothing
        };
        return Cursor::nowhere(place, text, at);
    }
    if in_comment(text, last.map_or(0, |(_, r)| r.end), at) {
        return Cursor::nowhere(Place::Nothing, text, at);
    }
    let word = match last {
        Some((token, range)) if is_word(token) && at <= range.end => range.clone(),
        _ => match tokens.get(index) {
            Some((token, range)) if is_word(token) && range.start == at => range.clone(),
            _ => at..at,
        },
    };
    let before = tokens.partition_point(|(_, range)| range.end <= word.start);
    let before = &tokens[..before];
    let open = open_brackets(before);
    let around = around(text, before, &open);
    let place = place(text, before, &open, around);
    let calls = calls(text, before, &open);
    Cursor {
        place,
        prefix: text[word.start..at].to_owned(),
        word,
        calls,
        around,
    }
}

impl Cursor {
    fn nowhere(place: Place, text: &str, at: usize) -> Self {
        let from = match place {
            Place::Text(start) => start,
            _ => at,
        };
        Self {
            place,
            prefix: text.get(from..at).unwrap_or_default().to_owned(),
            word: from..at,
            calls: Vec::new(),
            around: Around::File,
        }
    }
}

/// Does a string end in a quote?
fn closes(text: &str, range: &Range<usize>) -> bool {
    range.len() > 1 && text[range.clone()].ends_with('"')
}

/// Is a byte in a comment that begins behind the last token?
fn in_comment(text: &str, from: usize, at: usize) -> bool {
    let mut rest = text.get(from..at).unwrap_or_default();
    loop {
        let (line, block) = (rest.find("//"), rest.find("/*"));
        match (line, block) {
            (None, None) => return false,
            (Some(l), b) if b.is_none_or(|b| l < b) => match rest[l..].find('\n') {
                Some(end) => rest = &rest[l + end..],
                None => return true,
            },
            (_, Some(b)) => match rest[b..].find("*/") {
                Some(end) => rest = &rest[b + end + 2..],
                None => return true,
            },
            (Some(_), None) => return true,
        }
    }
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
                    return Around::Closure;
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
                Token::Private
                | Token::Delta
                | Token::Semicolon
                | Token::RightBrace
                | Token::DocOuter
                | Token::DocInner => Place::Item,
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
        return match last {
            Token::LeftBrace | Token::Comma => Place::MetadataKey,
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
                (Around::Closure, 1) => Place::Method,
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
            Token::Ident
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
    let names = segments.filter(|(t, _)| *t == Token::Ident);
    Some(names.map(|(_, r)| text[r.clone()].to_owned()).collect())
}

/// Is a bracket that of a definition's parameters?
fn is_declaration(tokens: &[(Token, Range<usize>)], bracket: usize) -> bool {
    let name = bracket.checked_sub(1).map(|i| tokens[i].0);
    let word = bracket.checked_sub(2).map(|i| tokens[i].0);
    name == Some(Token::Ident) && matches!(word, Some(Token::Fn | Token::Bsdf | Token::Edf))
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
