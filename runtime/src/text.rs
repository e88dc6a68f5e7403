//! Small tools on WGSL text: conditional lines, predicates, and who mentions whom.
//!
//! A line `#if NAME`, `#else` or `#endif` in a kernel file keeps or drops the lines between,
//! so that what a scene does not need is absent from its kernels.

/// `text` with conditional lines resolved by `flags`. A name that is no flag counts as unset;
/// the lines that then miss make validation fail.
pub(crate) fn preprocess(text: &str, flags: &[(&str, bool)]) -> String {
    let mut out = String::with_capacity(text.len());
    let mut open: Vec<bool> = Vec::new();
    for line in text.lines() {
        if let Some(name) = line.strip_prefix("#if ") {
            open.push(flags.iter().any(|(flag, set)| *flag == name && *set));
        } else if line == "#else" {
            if let Some(last) = open.last_mut() {
                *last = !*last;
            }
        } else if line == "#endif" {
            open.pop();
        } else if open.iter().all(|kept| *kept) {
            out.push_str(line);
            out.push('\n');
        }
    }
    out
}

/// Whether the identifier `name` occurs in `text`.
pub(crate) fn mentions(text: &str, name: &str) -> bool {
    let in_identifier = |c: char| c.is_ascii_alphanumeric() || c == '_';
    text.match_indices(name).any(|(at, _)| {
        let before = text[..at].chars().next_back();
        let after = text[at + name.len()..].chars().next();
        !before.is_some_and(in_identifier) && !after.is_some_and(in_identifier)
    })
}

/// `text` without its `//` comments.
pub(crate) fn without_comments(text: &str) -> String {
    let code = |line: &str| line.split("//").next().unwrap_or("").to_string();
    let lines: Vec<String> = text.lines().map(code).collect();
    lines.join("\n")
}

/// A function of an instance, of some material `among` a few, that is true if that is one for which
/// a condition `holds`. Where all are alike, nothing is looked up.
pub(crate) fn predicate(name: &str, among: &[usize], holds: impl Fn(usize) -> bool) -> String {
    let members: Vec<usize> = among.iter().copied().filter(|i| holds(*i)).collect();
    let body = match members.len() {
        0 => "return false;".to_string(),
        n if n == among.len() => "return true;".to_string(),
        _ => format!(
            "switch material_of(instance) {{ case {}: {{ return true; }} default: {{ return false; }} }}",
            case_labels(&members)
        ),
    };
    format!("fn {name}(instance: u32) -> bool {{ {body} }}\n")
}

/// `0u, 2u, 5u`
pub(crate) fn case_labels(values: &[usize]) -> String {
    let labels: Vec<String> = values.iter().map(|v| format!("{v}u")).collect();
    labels.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditional_lines_nest() {
        let text = "a\n#if x\nb\n#if y\nc\n#else\nd\n#endif\n#endif\ne\n";
        let with = |x, y| preprocess(text, &[("x", x), ("y", y)]);
        assert_eq!(with(true, true), "a\nb\nc\ne\n");
        assert_eq!(with(true, false), "a\nb\nd\ne\n");
        assert_eq!(with(false, true), "a\ne\n");
    }

    #[test]
    fn predicates_look_up_what_differs() {
        let none = predicate("p", &[0, 1, 2], |_| false);
        assert_eq!(none, "fn p(instance: u32) -> bool { return false; }\n");
        let all = predicate("p", &[0, 2], |i| i != 1);
        assert_eq!(all, "fn p(instance: u32) -> bool { return true; }\n");
        let some = predicate("p", &[0, 1, 2], |i| i != 1);
        assert!(some.contains("switch material_of(instance) { case 0u, 2u: { return true; }"));
    }

    #[test]
    fn mentions_are_whole_identifiers() {
        assert!(mentions("state[0]", "state"));
        assert!(!mentions("my_state[0] + states", "state"));
    }

    #[test]
    fn a_kernel_file_balances_its_conditions() {
        for entry in std::fs::read_dir("src/kernels").expect("the folder of kernels") {
            let path = entry.expect("an entry").path();
            let Ok(text) = std::fs::read_to_string(&path) else {
                continue;
            };
            let count = |start: &str| text.lines().filter(|l| l.starts_with(start)).count();
            assert_eq!(count("#if "), count("#endif"), "{}", path.display());
        }
    }
}
