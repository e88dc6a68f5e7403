//! Annotated fixtures: `fixtures/*.txt`, most of them of code that is being written.
//!
//! A file has cases. A case begins with `=== what it shows`; then come lines `? question: expected`, an empty line, and the
//! source, with `<|>` where the cursor is. Questions:
//!
//! | question | expected |
//! |---|---|
//! | `completes` | names that are proposed, separated by commas |
//! | `omits` | names that are not |
//! | `first` | names, one of which is proposed before all others |
//! | `writes` | `label => text`: the line of the cursor after the proposal is taken, `$0` and such left in |
//! | `imports` | `label => line`: a line that taking the proposal adds |
//! | `hover` | words that it shows; `-` if nothing |
//! | `signature` | the call, with `[` and `]` around the parameter that the cursor is at; `-` if none |
//! | `leads` | the line, from 1, that the definition is in, or the URI of the library; `-` if nowhere |
//! | `uses` | the lines of all references |
//! | `codes` | the codes of all diagnostics; `-` if there are none |
//! | `fix` | `title => line`: a quick fix at the cursor, and a line that there is after it; `-` if nothing is left |
//! | `fixes` | the titles of all quick fixes at the cursor, separated by ` | `; `-` if there are none |
//! | `renames` | `name => line`: the line of the cursor after renaming; `name => !words` if it is refused |
//! | `prepares` | what renaming would take the place of; `!words` if it is refused |
//! | `marks` | the lines of what is highlighted along with the name at the cursor; `-` if nothing is |
//! | `selects` | texts that enclose the cursor, innermost first, separated by ` < ` |
//!
//! Beside each source lie `paints.impasto`, with a function `half` and a material `gloss`, and a picture `wood.png`.

use std::path::Path;

use serde_json::{Value, json};

use crate::client::{Client, edited, offset, position};

const PAINTS: &str = "use std::bsdf::diffuse;\n\n/// Half of it.\nfn half(x: float) -> float = 0.5 * x;\n\n\
    private fn secret(x: float) -> float = x;\n\n/// A gloss.\nmaterial gloss {\n    param tint: color = 0.5;\n    \
    surface = diffuse(half(secret(1.0)) * tint);\n}\n";

struct Case {
    title: String,
    questions: Vec<(String, String)>,
    text: String,
    at: usize,
}

fn cases(path: &Path) -> Vec<Case> {
    let text = std::fs::read_to_string(path).expect("a fixture");
    let parts = text.split("\n=== ").enumerate();
    let parts = parts.map(|(i, part)| {
        if i == 0 {
            part.trim_start_matches("=== ")
        } else {
            part
        }
    });
    let case = |part: &str| {
        let (title, rest) = part.split_once('\n').expect("a title");
        let (head, source) = rest.split_once("\n\n").unwrap_or((rest, ""));
        let questions = head.lines().map(|line| {
            let line = line
                .strip_prefix("? ")
                .unwrap_or_else(|| panic!("{title}: {line}"));
            let (name, expected) = line.split_once(':').expect("a question");
            (name.trim().to_owned(), expected.trim().to_owned())
        });
        let at = source
            .find("<|>")
            .unwrap_or_else(|| panic!("{title}: no cursor"));
        Case {
            title: title.to_owned(),
            questions: questions.collect(),
            text: source.replacen("<|>", "", 1),
            at,
        }
    };
    parts.map(case).collect()
}

#[test]
fn fixtures_are_answered_as_annotated() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures");
    let mut paths: Vec<_> = std::fs::read_dir(folder)
        .expect("fixtures")
        .map(|e| e.expect("an entry").path())
        .collect();
    paths.sort();
    let mut client = Client::new();
    client.write("paints.impasto", PAINTS);
    client.write("wood.png", "");
    let (mut wrong, mut count) = (Vec::new(), 0);
    for path in paths {
        for case in cases(&path) {
            count += 1;
            let name = format!("case{count}.impasto");
            let uri = client.open(&name, &case.text);
            for (question, expected) in &case.questions {
                let found = answer(&mut client, &uri, &case, question, expected);
                if let Err(found) = found {
                    let file = path.file_name().unwrap_or_default().to_string_lossy();
                    wrong.push(format!(
                        "{file}, {}\n  {question}: {expected}\n  but: {found}",
                        case.title
                    ));
                }
            }
            client.tell(
                "textDocument/didClose",
                json!({ "textDocument": { "uri": uri } }),
            );
        }
    }
    assert!(count >= 100, "only {count} cases");
    assert!(
        wrong.is_empty(),
        "{} of {count} cases:\n{}",
        wrong.len(),
        wrong.join("\n")
    );
}

/// Asks a question; what was found instead if it is not what is expected.
fn answer(
    client: &mut Client,
    uri: &str,
    case: &Case,
    question: &str,
    expected: &str,
) -> Result<(), String> {
    let at = Client::at(uri, &case.text, case.at);
    let same = |found: String| {
        if found == expected {
            Ok(())
        } else {
            Err(found)
        }
    };
    match question {
        "completes" | "omits" | "first" => {
            let items = completions(client, at);
            let labels: Vec<&str> = items.iter().filter_map(|i| i["label"].as_str()).collect();
            let wanted: Vec<&str> = expected.split(',').map(str::trim).collect();
            let ok = match question {
                "completes" => wanted.iter().all(|w| labels.contains(w)),
                "omits" => !wanted.iter().any(|w| labels.contains(w)),
                _ => labels.first().is_some_and(|l| wanted.contains(l)),
            };
            if ok {
                Ok(())
            } else {
                Err(labels
                    .iter()
                    .take(40)
                    .copied()
                    .collect::<Vec<_>>()
                    .join(", "))
            }
        }
        "writes" | "imports" => {
            let (label, line) = expected.split_once(" => ").expect("`label => text`");
            let items = completions(client, at);
            let item = items.iter().find(|i| i["label"] == label);
            let item = item.ok_or_else(|| format!("no `{label}`"))?;
            let mut edits = vec![item["textEdit"].clone()];
            edits.extend(
                item["additionalTextEdits"]
                    .as_array()
                    .cloned()
                    .unwrap_or_default(),
            );
            let after = edited(&case.text, &edits);
            let has = if question == "writes" {
                line_of(&after, &case.text, case.at).trim() == line
            } else {
                after.lines().any(|l| l == line)
            };
            if has { Ok(()) } else { Err(after) }
        }
        "hover" => {
            let hover = client.ask("textDocument/hover", at);
            let text = hover["contents"]["value"].as_str().unwrap_or("-");
            if text.contains(expected) {
                Ok(())
            } else {
                Err(text.to_owned())
            }
        }
        "signature" => {
            let help = client.ask("textDocument/signatureHelp", at);
            let first = &help["signatures"][0];
            let Some(label) = first["label"].as_str() else {
                return same("-".into());
            };
            let mut marked = label.to_owned();
            if let Some(active) = first["activeParameter"].as_u64() {
                let range = &first["parameters"][active as usize]["label"];
                let end = range[1].as_u64().expect("an end") as usize;
                let start = range[0].as_u64().expect("a start") as usize;
                marked.insert(end, ']');
                marked.insert(start, '[');
            }
            same(marked)
        }
        "leads" => {
            let found = client.ask("textDocument/definition", at);
            let Some(target) = found["uri"].as_str() else {
                return same("-".into());
            };
            let line = found["range"]["start"]["line"].as_u64().unwrap_or(0) + 1;
            same(if target == uri {
                line.to_string()
            } else {
                target.to_owned()
            })
        }
        "uses" => {
            let found = client.ask("textDocument/references", at);
            let lines = found.as_array().cloned().unwrap_or_default();
            let lines = lines.iter().map(|l| {
                let line = l["range"]["start"]["line"].as_u64().unwrap_or(0) + 1;
                line.to_string()
            });
            same(lines.collect::<Vec<_>>().join(", "))
        }
        "codes" => {
            let found = client.diagnostics(uri);
            let codes = found.iter().filter_map(|d| d["code"].as_str());
            let codes = codes.collect::<Vec<_>>().join(", ");
            same(if codes.is_empty() { "-".into() } else { codes })
        }
        "fix" | "fixes" => {
            let here = position(&case.text, case.at);
            let params = json!({
                "textDocument": { "uri": uri },
                "range": { "start": here, "end": here },
                "context": { "diagnostics": [] },
            });
            let actions = client.ask("textDocument/codeAction", params);
            let actions = actions.as_array().cloned().unwrap_or_default();
            if question == "fixes" {
                let titles = actions.iter().filter_map(|a| a["title"].as_str());
                let titles = titles.collect::<Vec<_>>().join(" | ");
                return same(if titles.is_empty() {
                    "-".into()
                } else {
                    titles
                });
            }
            let (title, line) = expected.split_once(" => ").expect("`title => line`");
            let titles: Vec<&str> = actions.iter().filter_map(|a| a["title"].as_str()).collect();
            let action = actions.iter().find(|a| a["title"] == title);
            let action = action.ok_or_else(|| format!("there are {titles:?}"))?;
            let edits = action["edit"]["changes"][uri].as_array().cloned();
            let after = edited(&case.text, &edits.unwrap_or_default());
            let has =
                after.lines().any(|l| l.trim() == line) || (line == "-" && after.trim().is_empty());
            if has { Ok(()) } else { Err(after) }
        }
        "renames" => {
            let (name, line) = expected.split_once("=> ").expect("`name => line`");
            let name = name.trim();
            let mut params = at;
            params["newName"] = json!(name);
            let answer = client.try_ask("textDocument/rename", params);
            match (answer, line.strip_prefix('!')) {
                (Err(why), Some(words)) if why.contains(words) => Ok(()),
                (Err(why), _) => Err(why),
                (Ok(changes), Some(_)) => Err(changes.to_string()),
                (Ok(answer), None) => {
                    let edits = answer["changes"][uri].as_array().cloned();
                    let after = edited(&case.text, &edits.unwrap_or_default());
                    if line_of(&after, &case.text, case.at).trim() == line {
                        Ok(())
                    } else {
                        Err(after)
                    }
                }
            }
        }
        "prepares" => match client.try_ask("textDocument/prepareRename", at) {
            Err(why) if expected.strip_prefix('!').is_some_and(|w| why.contains(w)) => Ok(()),
            Err(why) => Err(why),
            Ok(found) => {
                let range = &found["range"];
                let start = offset(&case.text, &range["start"]);
                let text = &case.text[start..offset(&case.text, &range["end"])];
                same(text.to_owned())
            }
        },
        "marks" => {
            let found = client.ask("textDocument/documentHighlight", at);
            let found = found.as_array().cloned().unwrap_or_default();
            let lines = found.iter().map(|l| {
                let line = l["range"]["start"]["line"].as_u64().unwrap_or(0) + 1;
                line.to_string()
            });
            let lines = lines.collect::<Vec<_>>().join(", ");
            same(if lines.is_empty() { "-".into() } else { lines })
        }
        "selects" => {
            let params = json!({
                "textDocument": { "uri": uri },
                "positions": [position(&case.text, case.at)],
            });
            let found = client.ask("textDocument/selectionRange", params);
            let mut here = &found[0];
            let mut texts = Vec::new();
            while !here.is_null() && texts.len() < expected.split(" < ").count() {
                let range = &here["range"];
                let (start, end) = (
                    offset(&case.text, &range["start"]),
                    offset(&case.text, &range["end"]),
                );
                texts.push(case.text[start..end].to_owned());
                here = &here["parent"];
            }
            same(texts.join(" < "))
        }
        other => panic!("{}: there is no question `{other}`", case.title),
    }
}

fn completions(client: &mut Client, at: Value) -> Vec<Value> {
    let list = client.ask("textDocument/completion", at);
    list["items"].as_array().cloned().unwrap_or_default()
}

/// The line of a text that the cursor's line of the old text has become: as far from the end.
fn line_of<'t>(after: &'t str, before: &str, at: usize) -> &'t str {
    let from_end = before[at..].matches('\n').count();
    let lines: Vec<&str> = after.split('\n').collect();
    lines
        .get(lines.len().saturating_sub(1 + from_end))
        .copied()
        .unwrap_or("")
}
