//! Files of WGSL with conditional lines, so that what a scene does not need is absent from its kernels.
//!
//! | line | the lines after it |
//! |---|---|
//! | `#if CONDITION` | stay if the condition holds |
//! | `#else` | stay if it does not |
//! | `#endif` | stay as they did before `#if` |
//! | `#each SET`, until `#end` | are repeated for each member of a set, with its words in place of `$WORD` |
//!
//! A condition is one flag or several, all of which must be set: `a && !b`; `!` asks that a flag is not.
//! Directives nest. Whoever makes text of a file names every flag that the file asks for: one that was not
//! named is a mistake, in lines that go as in lines that stay, and so is a directive without its other end.

use std::fmt;

/// A name of conditions, and whether it is set.
pub(crate) type Flag = (&'static str, bool);

/// Words by the names that a text has for them.
pub(crate) type Words = Vec<(&'static str, String)>;

/// The name of a set, and the words of its members.
pub(crate) type Set = (&'static str, Vec<Words>);

/// A file of WGSL.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Template {
    /// The file as the source that includes it names it.
    pub file: &'static str,
    /// That source.
    pub source: &'static str,
    /// What the file says.
    pub text: &'static str,
}

/// The template in a file, by its path from the source that includes it.
macro_rules! template {
    ($file:literal) => {
        $crate::wgsl::template::Template {
            file: $file,
            source: file!(),
            text: include_str!($file),
        }
    };
}
pub(crate) use template;

/// What is wrong with a template, and where.
#[derive(Debug, PartialEq, Eq)]
struct Mistake {
    line: usize,
    what: String,
}

/// What a directive says.
enum Directive<'a> {
    If(&'a str),
    Else,
    Endif,
}

/// An `#if` that is not ended yet.
struct Open {
    line: usize,
    keeps: bool,
    has_else: bool,
}

impl Template {
    /// The text, with conditional lines resolved by `flags`.
    ///
    /// # Panics
    /// If the file has a mistake, which names the file, the line and the flag. No scene can bring it
    /// about: files are part of the program, and the flags that they are given are fixed in its sources.
    pub(crate) fn wgsl(&self, flags: &[Flag]) -> String {
        self.with_sets(flags, &[])
    }

    /// The same of a text that repeats lines for the members of sets.
    ///
    /// # Panics
    /// As [`Template::wgsl`].
    pub(crate) fn with_sets(&self, flags: &[Flag], sets: &[Set]) -> String {
        let repeated = repeat(self.text, sets);
        let resolved = repeated.and_then(|text| resolve(&text, flags));
        resolved.unwrap_or_else(|mistake| panic!("{self}: {mistake}"))
    }
}

impl fmt::Display for Template {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (included by {})", self.file, self.source)
    }
}

impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.line, self.what)
    }
}

/// `text` with lines between `#each` and `#end` repeated for the members of a set.
fn repeat(text: &str, sets: &[(&str, Vec<Words>)]) -> Result<String, Mistake> {
    let mut out = String::with_capacity(text.len());
    let mut lines = (1..).zip(text.lines());
    while let Some((number, line)) = lines.next() {
        let Some(name) = line.strip_prefix("#each ") else {
            out += line;
            out.push('\n');
            continue;
        };
        let mistake = |what| Mistake { line: number, what };
        let set = sets.iter().find(|(set, _)| *set == name);
        let (_, members) =
            set.ok_or_else(|| mistake(format!("`{name}` is no set of this text")))?;
        let mut repeated = String::new();
        loop {
            let (_, line) = lines
                .next()
                .ok_or_else(|| mistake("`#each` without `#end`".into()))?;
            if line == "#end" {
                break;
            }
            repeated += line;
            repeated.push('\n');
        }
        out.extend(members.iter().map(|words| filled(&repeated, words)));
    }
    Ok(out)
}

fn filled(text: &str, words: &Words) -> String {
    let fill =
        |text: String, (name, word): &(&str, String)| text.replace(&format!("${name}"), word);
    words.iter().fold(text.to_owned(), fill)
}

fn resolve(text: &str, flags: &[(&str, bool)]) -> Result<String, Mistake> {
    let mut out = String::with_capacity(text.len());
    let mut open: Vec<Open> = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let mistake = |what| Mistake { line: number, what };
        match directive(line).map_err(mistake)? {
            None if open.iter().all(|o| o.keeps) => {
                out.push_str(line);
                out.push('\n');
            }
            None => {}
            Some(Directive::If(condition)) => open.push(Open {
                line: number,
                keeps: holds(condition, flags).map_err(mistake)?,
                has_else: false,
            }),
            Some(Directive::Else) => {
                let last = open.last_mut().filter(|o| !o.has_else);
                let last = last.ok_or_else(|| mistake("`#else` without `#if`".into()))?;
                last.keeps = !last.keeps;
                last.has_else = true;
            }
            Some(Directive::Endif) => {
                let last = open.pop();
                last.ok_or_else(|| mistake("`#endif` without `#if`".into()))?;
            }
        }
    }
    match open.last() {
        Some(Open { line, .. }) => Err(Mistake {
            line: *line,
            what: "`#if` without `#endif`".into(),
        }),
        None => Ok(out),
    }
}

/// The directive of a line, if it is one. WGSL has no `#` of its own.
fn directive(line: &str) -> Result<Option<Directive<'_>>, String> {
    match line {
        "#else" => Ok(Some(Directive::Else)),
        "#endif" => Ok(Some(Directive::Endif)),
        _ if !line.trim_start().starts_with('#') => Ok(None),
        _ => match line.strip_prefix("#if ") {
            Some(condition) => Ok(Some(Directive::If(condition))),
            None => Err(format!("`{line}` is no directive")),
        },
    }
}

/// Whether all terms of a condition hold.
fn holds(condition: &str, flags: &[(&str, bool)]) -> Result<bool, String> {
    let mut all = true;
    for term in condition.split(" && ") {
        let (name, wanted) = match term.strip_prefix('!') {
            Some(name) => (name, false),
            None => (term, true),
        };
        let flag = flags.iter().find(|(flag, _)| *flag == name);
        let (_, set) = flag.ok_or_else(|| unknown(name, flags))?;
        all &= *set == wanted;
    }
    Ok(all)
}

fn unknown(name: &str, flags: &[(&str, bool)]) -> String {
    let known: Vec<&str> = flags.iter().map(|(name, _)| *name).collect();
    let known = known.join("`, `");
    format!("`{name}` is no flag of this text; its flags are `{known}`")
}

#[cfg(test)]
mod tests {
    use std::path::{Path, PathBuf};

    use super::*;

    fn with(text: &str, x: bool, y: bool) -> String {
        resolve(text, &[("x", x), ("y", y)]).unwrap_or_else(|m| panic!("{m}"))
    }

    #[track_caller]
    fn refused(text: &str, line: usize, what: &str) {
        let mistake = resolve(text, &[("x", false), ("y", true)]).expect_err("a mistake");
        assert_eq!(mistake.line, line, "{mistake}");
        assert!(mistake.what.contains(what), "{mistake}");
    }

    #[test]
    fn conditional_lines_nest() {
        let text = "a\n#if x\nb\n#if y\nc\n#else\nd\n#endif\n#endif\ne\n";
        assert_eq!(with(text, true, true), "a\nb\nc\ne\n");
        assert_eq!(with(text, true, false), "a\nb\nd\ne\n");
        assert_eq!(with(text, false, true), "a\ne\n");
    }

    #[test]
    fn conditions_are_negated_and_joined() {
        let text = "#if !x\na\n#else\nb\n#endif\n#if x && !y\nc\n#endif\n#if !x && !y\nd\n#else\ne\n#endif\n";
        assert_eq!(with(text, true, true), "b\ne\n");
        assert_eq!(with(text, true, false), "b\nc\ne\n");
        assert_eq!(with(text, false, true), "a\ne\n");
        assert_eq!(with(text, false, false), "a\nd\n");
    }

    #[test]
    fn a_flag_that_nobody_gave_is_named_with_its_line() {
        refused(
            "a\n#if z\nb\n#endif\n",
            2,
            "`z` is no flag of this text; its flags are `x`, `y`",
        );
        refused("#if y && !z\n#endif\n", 1, "`z`");
        // In lines that go as well.
        refused("#if x\n\n#if z\n#endif\n#endif\n", 3, "`z`");
        refused("#if x && z\n#endif\n", 1, "`z`");
        // Other operators are no flags either.
        refused("#if x || y\n#endif\n", 1, "`x || y`");
        refused("#if x&&y\n#endif\n", 1, "`x&&y`");
    }

    #[test]
    fn directives_without_their_other_end_are_mistakes() {
        refused("a\n#if x\n#if y\n#endif\nb\n", 2, "`#if` without `#endif`");
        refused("#if x\n#endif\n#endif\n", 3, "`#endif` without `#if`");
        refused("#else\n", 1, "`#else` without `#if`");
        refused("#if x\n#else\n#else\n#endif\n", 3, "`#else` without `#if`");
        refused("#if x\n#elif y\n#endif\n", 2, "`#elif y` is no directive");
        refused("#if\n#endif\n", 1, "`#if` is no directive");
        refused("    #if x\n#endif\n", 1, "is no directive");
    }

    #[test]
    fn lines_are_repeated_for_the_members_of_a_set() {
        let text = "a\n#each ray\n$name wants_$name\n#if x\n#endif\n#end\nb\n";
        let members = ["c", "d"].map(|name| vec![("name", name.to_owned())]);
        let repeated = |sets: &[(&str, Vec<Words>)]| repeat(text, sets);
        assert_eq!(
            repeated(&[("ray", members.into())]),
            Ok("a\nc wants_c\n#if x\n#endif\nd wants_d\n#if x\n#endif\nb\n".into())
        );
        assert_eq!(repeated(&[("ray", Vec::new())]), Ok("a\nb\n".into()));
        let mistake = repeated(&[("rays", Vec::new())]).expect_err("no such set");
        assert_eq!(mistake.to_string(), "line 2: `ray` is no set of this text");
        let endless = repeat("#each ray\na\n", &[("ray", Vec::new())]);
        let mistake = endless.expect_err("no end");
        assert_eq!(mistake.to_string(), "line 1: `#each` without `#end`");
        refused("a\n#end\n", 2, "`#end` is no directive");
    }

    #[test]
    #[should_panic(expected = "a.wgsl (included by b.rs): line 1: `shadow_ray` is no flag")]
    fn a_mistake_names_the_file() {
        let template = Template {
            file: "a.wgsl",
            source: "b.rs",
            text: "#if shadow_ray\n#endif\n",
        };
        template.wgsl(&[("shadow_rays", true)]);
    }

    /// Files below `folder` whose names end in `end`, with their texts.
    fn files(folder: &Path, end: &str) -> Vec<(PathBuf, String)> {
        let mut found = Vec::new();
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                found.extend(files(&path, end));
            } else if path.to_string_lossy().ends_with(end) {
                let text = std::fs::read_to_string(&path).expect("a text");
                found.push((path, text));
            }
        }
        found
    }

    /// Whoever resolves a template checks its flags; this finds the mistakes of those that no test resolves.
    #[test]
    fn every_file_can_be_resolved_by_flags_that_the_sources_name() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        let sources = files(&folder, ".rs");
        let mut conditions = 0;
        for (path, text) in files(&folder, ".wgsl") {
            let of_file = text.lines().filter_map(|line| line.strip_prefix("#if "));
            let names = of_file.flat_map(|c| c.split(" && ").map(|t| t.trim_start_matches('!')));
            let names: Vec<&str> = names.collect();
            for name in &names {
                let literal = format!("\"{name}\"");
                let named = sources.iter().any(|(_, source)| source.contains(&literal));
                assert!(named, "{}: no source has the flag `{name}`", path.display());
            }
            let flags: Vec<(&str, bool)> = names.iter().map(|name| (*name, true)).collect();
            let sets = text.lines().filter_map(|line| line.strip_prefix("#each "));
            let sets: Vec<(&str, Vec<Words>)> = sets.map(|set| (set, vec![Vec::new()])).collect();
            for (set, _) in &sets {
                let literal = format!("\"{set}\"");
                let named = sources.iter().any(|(_, source)| source.contains(&literal));
                assert!(named, "{}: no source has the set `{set}`", path.display());
            }
            if let Err(mistake) = repeat(&text, &sets).and_then(|text| resolve(&text, &flags)) {
                panic!("{}: {mistake}", path.display());
            }
            conditions += flags.len();
        }
        assert!(conditions > 100, "{conditions} conditions");
    }
}
