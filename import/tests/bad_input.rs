//! Documents that are refused, and how long that takes.

use std::fmt::Write;
use std::time::{Duration, Instant};

use impasto_import::{MemoryFiles, Options, import};
use proptest::prelude::*;

use crate::common::{Disk, compiled, documents, of_text};

#[test]
fn bad_documents_are_refused_with_the_reason() {
    let mut said = String::new();
    for path in documents("bad") {
        let path = path.to_string_lossy().replace('\\', "/");
        let errors = import(&path, &mut Disk, &Options::default()).expect_err(&path);
        for error in errors {
            writeln!(said, "{error}\n").expect("memory");
        }
    }
    insta::assert_snapshot!("bad_documents", said);
}

/// A chain of nodes, each after the one before it.
fn chain(count: usize) -> String {
    let mut text = String::from("<materialx version=\"1.39\">");
    for i in 1..=count {
        let before = match i {
            1 => "value=\"1\"".to_owned(),
            i => format!("nodename=\"add{}\"", i - 1),
        };
        write!(
            text,
            "<add name=\"add{i}\" type=\"float\"><input name=\"in1\" type=\"float\" {before}/>\
             <input name=\"in2\" type=\"float\" value=\"1\"/></add>"
        )
        .expect("memory");
    }
    text + &format!("<output name=\"out\" type=\"float\" nodename=\"add{count}\"/></materialx>")
}

#[test]
fn long_chains_take_time_by_their_length() {
    let imported = of_text(&chain(500)).expect("imported");
    compiled(&imported);
    let start = Instant::now();
    let _ = of_text(&chain(100_000));
    assert!(
        start.elapsed() < Duration::from_secs(60),
        "{:?}",
        start.elapsed()
    );
}

#[test]
fn wide_documents_are_refused() {
    let nodes = (0..100_000).map(|i| format!("<noise2d name=\"n{i}\" type=\"float\"/>"));
    let text = format!(
        "<materialx version=\"1.39\">{}</materialx>",
        nodes.collect::<String>()
    );
    let start = Instant::now();
    let errors = of_text(&text).expect_err("too many materials");
    assert!(
        errors[0].message.contains("100000 materials"),
        "{}",
        errors[0]
    );
    assert!(start.elapsed() < Duration::from_secs(60));
}

#[test]
fn definitions_that_multiply_are_refused() {
    let mut text = String::from("<materialx version=\"1.39\">");
    for i in 0..40 {
        let inner = match i {
            0 => "<constant name=\"x\" type=\"float\"/><constant name=\"y\" type=\"float\"/>"
                .to_owned(),
            i => format!(
                "<d{0} name=\"x\" type=\"float\"/><d{0} name=\"y\" type=\"float\"/>",
                i - 1
            ),
        };
        write!(
            text,
            "<nodedef name=\"ND_{i}\" node=\"d{i}\"><output name=\"out\" type=\"float\"/></nodedef>\
             <nodegraph name=\"NG_{i}\" nodedef=\"ND_{i}\">{inner}<add name=\"s\" type=\"float\">\
             <input name=\"in1\" type=\"float\" nodename=\"x\"/><input name=\"in2\" type=\"float\" nodename=\"y\"/></add>\
             <output name=\"out\" type=\"float\" nodename=\"s\"/></nodegraph>"
        )
        .expect("memory");
    }
    text += "<d39 name=\"top\" type=\"float\"/><output name=\"o\" type=\"float\" nodename=\"top\"/></materialx>";
    let start = Instant::now();
    let errors = of_text(&text).expect_err("too many");
    assert!(
        errors[0].message.contains("grows to more than"),
        "{}",
        errors[0]
    );
    assert!(start.elapsed() < Duration::from_secs(60));
}

#[test]
fn deep_documents_are_refused() {
    let text = "<materialx version=\"1.39\">".to_owned() + &"<a>".repeat(200_000);
    let errors = of_text(&text).expect_err("too deep");
    assert!(errors[0].message.contains("levels deep"), "{}", errors[0]);
}

#[test]
fn files_that_include_each_other_count_once() {
    let mut files = MemoryFiles::default();
    let including = |other: &str, body: &str| {
        format!(
            "<materialx version=\"1.39\" colorspace=\"srgb_texture\"><include href=\"{other}\"/>{body}</materialx>"
        )
    };
    files.add("a.mtlx", including("sub/b.mtlx", ""));
    let surface = "<standard_surface name=\"s\" type=\"surfaceshader\">\
        <input name=\"base_color\" type=\"color3\" value=\"0.5, 0.5, 0.5\"/></standard_surface>";
    files.add("sub/b.mtlx", including("../a.mtlx", surface));
    let options = Options {
        allow_outside: true,
        ..Options::default()
    };
    let imported = import("a.mtlx", &mut files, &options).expect("imported");
    assert!(compiled(&imported).contains("base_color: srgb(0.5, 0.5, 0.5)"));
    assert!(import("a.mtlx", &mut files, &Options::default()).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn random_changes_do_not_panic(at in 0usize..4000, with in "[ -~]{0,6}", cut in 0usize..12) {
        for path in documents("documents") {
            let text = std::fs::read_to_string(path).expect("a text");
            let at = at % text.len();
            let end = (at + cut).min(text.len());
            if let (Some(before), Some(after)) = (text.get(..at), text.get(end..)) {
                let _ = of_text(&format!("{before}{with}{after}"));
            }
        }
    }
}
