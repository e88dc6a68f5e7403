//! Where in a scene file a cursor stands, told by the text before it.

use std::ops::Range;

/// A cursor in a scene file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SceneCursor {
    /// The names of the last header before it: `materials` and `brass` of `[materials.brass]`.
    pub section: Vec<String>,
    /// Keys whose inline tables it is in, outermost first.
    pub inside: Vec<String>,
    /// What stands there.
    pub part: Part,
    /// The word that it is in, without quotes.
    pub word: Range<usize>,
    /// The part of the word before it.
    pub prefix: String,
}

/// What stands at a cursor.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Part {
    /// Nothing to tell of.
    #[default]
    Nothing,
    /// A header.
    Header,
    /// A key.
    Key,
    /// The value of a key; in quotes or not.
    Value {
        /// The key.
        key: String,
        /// Is it in quotes?
        quoted: bool,
    },
}

/// The cursor at byte `at`.
pub fn cursor(text: &str, at: usize) -> SceneCursor {
    let before = &text[..at];
    let line_start = before.rfind('\n').map_or(0, |n| n + 1);
    let line = &before[line_start..];
    let word = word(text, at);
    let mut cursor = SceneCursor {
        prefix: text[word.start..at].to_owned(),
        word,
        ..SceneCursor::default()
    };
    if line.trim_start().starts_with('[') && !line.contains('=') {
        cursor.part = Part::Header;
        cursor.section = names(line.trim());
        return cursor;
    }
    let header = headers(before).last();
    cursor.section = header
        .as_ref()
        .map_or(Vec::new(), |(_, names)| names.clone());
    let from = header.map_or(0, |(end, _)| end);
    state(&before[from..], &mut cursor);
    cursor
}

/// The headers of a text: where each line ends, and its names.
fn headers(text: &str) -> impl Iterator<Item = (usize, Vec<String>)> {
    let mut at = 0;
    let lines = text.split_inclusive('\n').map(move |line| {
        at += line.len();
        (at, line)
    });
    lines.filter_map(|(end, line)| {
        let is_header = line.trim_start().starts_with('[') && line.ends_with('\n');
        // A line of a list that goes over lines is none.
        let is_list = line
            .trim_start()
            .trim_start_matches('[')
            .starts_with(|c: char| c.is_ascii_digit() || c == '"' && !line.contains(']'));
        (is_header && !is_list && !line.contains('=')).then(|| (end, names(line.trim())))
    })
}

/// The names of a header.
pub fn names(header: &str) -> Vec<String> {
    let inside = header.trim_start_matches('[');
    let inside = inside.split(']').next().unwrap_or(inside);
    let (mut names, mut name, mut quote) = (Vec::new(), String::new(), None);
    for c in inside.chars() {
        match (c, quote) {
            ('"' | '\'', None) => quote = Some(c),
            (c, Some(q)) if c == q => quote = None,
            ('.', None) => names.push(std::mem::take(&mut name).trim().to_owned()),
            (c, _) => name.push(c),
        }
    }
    names.push(name.trim().to_owned());
    names.retain(|n| !n.is_empty());
    names
}

/// Reads a section up to the cursor, and leaves what is open there.
fn state(text: &str, cursor: &mut SceneCursor) {
    let mut quote = None;
    let mut key = String::new();
    let mut is_value = false;
    // What is open: tables with the key that they belong to, and lists.
    let mut open: Vec<(char, String)> = Vec::new();
    let mut comment = false;
    for c in text.chars() {
        if comment {
            comment = c != '\n';
            if comment {
                continue;
            }
        }
        match (c, quote) {
            (c, Some(q)) if c == q => quote = None,
            ('\n', Some(_)) => quote = None,
            (c, Some(_)) if !is_value => key.push(c),
            (_, Some(_)) => {}
            ('#', None) => comment = true,
            ('"' | '\'', None) => quote = Some(c),
            ('=', None) => is_value = true,
            ('{', None) => {
                open.push(('{', std::mem::take(&mut key).trim().to_owned()));
                is_value = false;
            }
            ('[', None) if is_value => open.push(('[', key.trim().to_owned())),
            ('}' | ']', None) => {
                if let Some((_, owner)) = open.pop() {
                    key = owner;
                    is_value = true;
                }
            }
            (',', None) if open.last().is_none_or(|o| o.0 == '{') => {
                key.clear();
                is_value = false;
            }
            ('\n', None) if open.is_empty() => {
                key.clear();
                is_value = false;
            }
            (c, None) if !is_value => key.push(c),
            _ => {}
        }
    }
    cursor.inside = open
        .iter()
        .filter(|o| o.0 == '{' && !o.1.is_empty())
        .map(|o| o.1.clone())
        .collect();
    cursor.part = match (comment, is_value, quote) {
        (true, ..) => Part::Nothing,
        (_, true, quote) => Part::Value {
            key: key.trim().to_owned(),
            quoted: quote.is_some(),
        },
        _ => Part::Key,
    };
}

/// The word around a byte: of what names and paths are made of.
fn word(text: &str, at: usize) -> Range<usize> {
    let is_word = |c: char| c.is_alphanumeric() || "_-./$*:".contains(c);
    let start = text[..at].rfind(|c| !is_word(c)).map_or(0, |i| {
        i + text[i..].chars().next().map_or(1, char::len_utf8)
    });
    let end = text[at..]
        .find(|c| !is_word(c))
        .map_or(text.len(), |i| at + i);
    start..end
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> SceneCursor {
        let at = text.find('|').expect("a mark");
        cursor(&text.replace('|', ""), at)
    }

    #[test]
    fn a_cursor_knows_its_section_and_what_stands_there() {
        let value = |key: &str, quoted| Part::Value {
            key: key.into(),
            quoted,
        };
        for (text, section, inside, part) in [
            ("na|", &[][..], &[][..], Part::Key),
            ("[came|", &["came"], &[], Part::Header),
            ("[camera]\nfo|", &["camera"], &[], Part::Key),
            ("[camera]\nfov = 4|", &["camera"], &[], value("fov", false)),
            ("[camera]\nfov = 4\nlook|", &["camera"], &[], Part::Key),
            (
                "[materials.\"a b\"]\nfile = \"x/|\"",
                &["materials", "a b"],
                &[],
                value("file", true),
            ),
            (
                "[materials.a]\nparams = { rough|",
                &["materials", "a"],
                &["params"],
                Part::Key,
            ),
            (
                "[materials.a]\nparams = { x = [1, 2], y = \"3 |",
                &["materials", "a"],
                &["params"],
                value("y", true),
            ),
            (
                "[[geometry]]\nplacements = [\n  { translate = [0, 0, 0] },\n  { sca|",
                &["geometry"],
                &["placements"],
                Part::Key,
            ),
            ("[camera] # a\n# fo|", &["camera"], &[], Part::Nothing),
        ] {
            let found = of(text);
            assert_eq!(found.section, section, "{text}");
            assert_eq!(found.inside, inside, "{text}");
            assert_eq!(found.part, part, "{text}");
        }
    }
}
