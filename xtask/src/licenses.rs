//! Every dependency has a license that `deny.toml` allows. cargo-deny says the same and more, where it can be had;
//! this needs nothing but cargo.

use xtask::shell::{capture, cargo, root};

/// The licenses that `deny.toml` allows.
fn allowed() -> Vec<String> {
    let text = std::fs::read_to_string(root().join("deny.toml")).expect("deny.toml");
    let list = text.split_once("\nallow = [").expect("a list `allow`").1;
    let list = list.split_once(']').expect("its end").0;
    let quoted = list.split('"').skip(1).step_by(2);
    quoted.map(str::to_owned).collect()
}

/// The packages that this machine builds, with their licenses: `None` if a package states none.
fn licenses() -> Vec<(String, Option<String>)> {
    let version = capture(cargo().arg("-vV")).expect("cargo runs");
    let host = version.lines().find_map(|line| line.strip_prefix("host: "));
    let host = host.expect("cargo tells its host");
    let arguments = [
        "metadata",
        "--format-version",
        "1",
        "--locked",
        "--filter-platform",
        host,
    ];
    let metadata = capture(cargo().args(arguments)).expect("cargo metadata");
    // In texts a quote has a backslash before it, so that this is found where it is a key.
    let packages = metadata.split("{\"name\":\"").skip(1);
    let packages = packages.filter_map(|text| {
        let name = text.split('"').next()?;
        let license = text.split_once(",\"license\":")?.1;
        let license = license.strip_prefix('"').and_then(|l| l.split('"').next());
        Some((name.to_owned(), license.map(str::to_owned)))
    });
    packages.collect()
}

/// Does an SPDX expression leave a choice of what is allowed? `OR` binds less than `AND`; a slash is an old `OR`.
fn is_allowed(expression: &str, allowed: &[String]) -> bool {
    let spaced = expression.replace('/', " OR ");
    let spaced = spaced.replace('(', " ( ").replace(')', " ) ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut rest = words.as_slice();
    either(&mut rest, allowed) && rest.is_empty()
}

fn either(words: &mut &[&str], allowed: &[String]) -> bool {
    let mut found = both(words, allowed);
    while let Some(rest) = words.strip_prefix(&["OR"]) {
        *words = rest;
        found |= both(words, allowed);
    }
    found
}

fn both(words: &mut &[&str], allowed: &[String]) -> bool {
    let mut found = single(words, allowed);
    while let Some(rest) = words.strip_prefix(&["AND"]) {
        *words = rest;
        found &= single(words, allowed);
    }
    found
}

fn single(words: &mut &[&str], allowed: &[String]) -> bool {
    let Some((first, rest)) = words.split_first() else {
        return false;
    };
    *words = rest;
    if *first == "(" {
        let found = either(words, allowed);
        let closed = words.strip_prefix(&[")"]);
        *words = closed.unwrap_or(&["a parenthesis that is not closed"]);
        return found;
    }
    if let [with, exception, rest @ ..] = *words
        && *with == "WITH"
    {
        *words = rest;
        return allowed.contains(&format!("{first} WITH {exception}"));
    }
    allowed.iter().any(|license| license == first)
}

#[test]
fn every_dependency_has_an_allowed_license() {
    let (allowed, licenses) = (allowed(), licenses());
    assert!(
        licenses.len() > 100,
        "only {} packages are found",
        licenses.len()
    );
    let is_refused = |license: &Option<String>| {
        license
            .as_ref()
            .is_none_or(|license| !is_allowed(license, &allowed))
    };
    let refused: Vec<_> = licenses
        .iter()
        .filter(|(_, license)| is_refused(license))
        .collect();
    assert!(refused.is_empty(), "deny.toml does not allow {refused:?}");
}

#[test]
fn expressions_leave_a_choice_or_none() {
    let allowed = ["MIT", "Zlib", "A WITH E"].map(str::to_owned);
    for fine in [
        "MIT",
        "GPL-3.0 OR MIT",
        "GPL-3.0/MIT",
        "MIT AND Zlib",
        "(GPL-3.0 OR MIT) AND Zlib",
        "A WITH E",
    ] {
        assert!(is_allowed(fine, &allowed), "{fine}");
    }
    for bad in [
        "",
        "GPL-3.0",
        "MIT AND GPL-3.0",
        "(MIT OR Zlib) AND GPL-3.0",
        "A",
        "MIT WITH E",
        "(MIT",
        "MIT MIT",
    ] {
        assert!(!is_allowed(bad, &allowed), "{bad}");
    }
}
