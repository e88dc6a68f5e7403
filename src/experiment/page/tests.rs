//! Pages: those that are committed, and what is left out or refused.

use super::text::page;
use super::*;
use crate::experiment::results::Row;

/// Whoever changes a page's text, its numbers or what draws it writes it anew: `impasto experiment
/// docs/studies/NAME.toml --page`.
#[test]
fn every_committed_page_is_that_of_its_study() {
    for name in ["partition", "paper", "convergence", "mixes"] {
        let study = Study::read(Path::new(&format!("docs/studies/{name}.toml")));
        let study = study.unwrap_or_else(|why| panic!("{why}"));
        let base = study.publish.clone().expect("it is published");
        let is_measured = study.data.as_ref().is_none_or(|data| data.exists());
        assert_eq!(
            is_measured,
            suffixed(&base, "md").exists(),
            "{name}: one without the other"
        );
        if !is_measured {
            continue;
        }
        let made = Committed::read(&study, &base, None);
        let made = made.unwrap_or_else(|why| panic!("{why}"));
        let files = files(&made.content(&study), &base);
        let files = files.unwrap_or_else(|why| panic!("{why}"));
        assert_eq!(files[0].0, Path::new("docs").join(format!("{name}.md")));
        for (path, text) in files {
            let written = std::fs::read_to_string(&path).unwrap_or_default();
            assert!(
                written == text,
                "{}: run `impasto experiment docs/studies/{name}.toml --page`",
                path.display()
            );
        }
    }
}

#[test]
fn results_are_written_as_they_are_read() {
    let study = Study::read(Path::new("docs/studies/partition.toml")).expect("the study");
    let path = Path::new("docs/partition.json");
    let results = Results::load(path, &study).expect("the results");
    assert!(results.rows.len() > 40);
    let text = results.text().expect("text");
    let file = std::fs::read_to_string(path).expect("the file");
    assert_eq!(text.lines().count(), file.lines().count());
    let kernels = |text: &str| -> Vec<String> {
        let lines = text.lines().filter(|line| line.starts_with("  [\""));
        lines.map(String::from).collect()
    };
    let measured = results.rows.iter().filter_map(|row| row.kernels.as_ref());
    let measured: usize = measured.map(|scene| scene.kernels.len()).sum();
    assert!(measured > 2000);
    assert_eq!(kernels(&text).len(), measured);
    assert!(
        kernels(&text) == kernels(&file),
        "a kernel is written otherwise"
    );
}

#[test]
fn sections_without_numbers_are_left_out_and_failures_are_not() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = "[[scenes]]\nname = 'a'\nfile = 'a.toml'\n[[studies]]\nkind = 'rates'\nstrategies = ['own']\n";
    let mut study = Study::parse(Path::new("s.toml"), text).expect("a study");
    let path = folder.path().join("page.md");
    std::fs::write(
        &path,
        "# {{title}} by {{machine}}.\n\n## Rates\n\nText.\n\n{{table}}\n",
    )
    .expect("written");
    study.template = Some(path.clone());
    let mut results = Results::new("s");
    let page_of = |results: &Results| {
        page(&Content {
            study: &study,
            results,
            data: None,
            convergence: (folder.path(), "."),
        })
    };
    assert_eq!(page_of(&results).as_deref(), Ok("# s by .\n"));
    results.rows.push(Row {
        part: "rates".into(),
        scene: "a".into(),
        variant: "own".into(),
        failed: Some("a | b".into()),
        ..Row::default()
    });
    let failed = page_of(&results).expect("a page");
    assert!(failed.ends_with("## What failed\n\n| part | scene | | why |\n|---|---|---|---|\n| rates | a | own | a \\| b |\n"), "{failed}");
    for (text, says) in [
        ("{{tabel}}", "did you mean `{{table}}`?"),
        ("x {{table", "has no `}}`"),
        ("{{table b}}", "no part `b`"),
        ("{{regret rates}}", "of the kind `rates`"),
    ] {
        std::fs::write(&path, text).expect("written");
        let why = page_of(&results).expect_err(text);
        assert!(why.contains(says) && why.contains("page.md:1: "), "{why}");
    }
}
