//! What doc comments promise: lines that begin with a word and a colon.

/// How exact the documentation says that something is: `exact` or `within X`.
pub fn promise(docs: &str, topic: &str) -> Option<f64> {
    let rest = docs.split_once(topic)?.1.trim_start();
    if rest.starts_with("exact") {
        return Some(0.0);
    }
    let number = rest.strip_prefix("within ")?.split(' ').next()?;
    number.trim_end_matches([',', '.', ';']).parse().ok()
}

/// The lines of a doc comment, where one that ends with a comma or `&&` goes on in the next.
pub fn whole_lines(docs: &[String]) -> Vec<String> {
    joined_lines(docs)
        .into_iter()
        .map(|(line, _)| line)
        .collect()
}

/// The same, and of how many lines each is made.
pub fn joined_lines(docs: &[String]) -> Vec<(String, usize)> {
    let mut lines: Vec<(String, usize)> = Vec::new();
    for line in docs.iter().map(|l| l.trim()) {
        match lines.last_mut().filter(|(l, _)| l.ends_with([',', '&'])) {
            Some((begun, count)) => {
                *begun = format!("{begun} {line}");
                *count += 1;
            }
            None => lines.push((line.to_owned(), 1)),
        }
    }
    lines
}

/// What a doc comment says on lines that begin with `topic`.
pub fn said<'a>(lines: &'a [String], topic: &'a str) -> impl Iterator<Item = &'a str> {
    let lines = lines.iter();
    lines.filter_map(move |l| Some(l.strip_prefix(topic)?.trim()))
}
