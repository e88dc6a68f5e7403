//! The snippets of Visual Studio Code are Impasto, with what stands in their gaps.

use serde_json::Value;

use crate::{root, tree};

/// The text of a snippet: `${1:text}` is the text, `${1|a,b|}` the first choice, `$4` what gap 4 holds, `$0` nothing.
fn filled(snippet: &str) -> String {
    let mut gaps = vec![String::new(); 20];
    let mut out = String::new();
    let mut rest = snippet;
    while let Some(at) = rest.find('$') {
        out += &rest[..at];
        rest = &rest[at + 1..];
        let braced = rest.starts_with('{');
        rest = rest.trim_start_matches('{');
        let digits = rest.chars().take_while(char::is_ascii_digit).count();
        let gap: usize = rest[..digits].parse().expect("the number of a gap");
        rest = &rest[digits..];
        if braced {
            let end = rest.find('}').expect("the end of a gap");
            let inner = rest[..end].trim_start_matches(':').trim_matches('|');
            let first = inner.split(',').next().unwrap_or("");
            let inner = if rest.starts_with('|') { first } else { inner };
            gaps[gap] = filled_by(inner, &gaps);
            rest = &rest[end + 1..];
        }
        out += &gaps[gap];
    }
    out + rest
}

/// A default that names other gaps.
fn filled_by(text: &str, gaps: &[String]) -> String {
    let mut text = text.to_owned();
    for (number, gap) in gaps.iter().enumerate().rev() {
        text = text.replace(&format!("${number}"), gap);
    }
    text
}

#[test]
fn every_snippet_is_impasto() {
    let path = root().join("editors/vscode/snippets/impasto.json");
    let text = std::fs::read_to_string(path).expect("the snippets");
    let all: Value = serde_json::from_str(&text).expect("JSON");
    let all = all.as_object().expect("an object");
    assert!(all.len() > 5);
    for (name, snippet) in all {
        let body = match &snippet["body"] {
            Value::String(line) => line.clone(),
            lines => {
                let lines = lines.as_array().expect("lines").iter();
                let lines: Vec<&str> = lines.filter_map(Value::as_str).collect();
                lines.join("\n")
            }
        };
        let body = filled(&body);
        let places = [
            body.clone(),
            format!("material a {{ {body}\n surface = b; }}"),
            format!("fn f() -> float {{ {body}\n a }}"),
        ];
        let fits = places
            .iter()
            .any(|text| !tree(text).root_node().has_error());
        assert!(fits, "{name}: {body}");
    }
}
