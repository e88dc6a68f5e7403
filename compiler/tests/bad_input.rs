//! Input that is not what it should be, at random: no panic, no hang, no flood of memory. What was
//! found once is in `regressions/` and stays found.

use std::sync::LazyLock;

use impasto_fuzz::corpus::{self, Corpus};
use impasto_fuzz::{Failure, Random, Target, ir, run, search, source};
use proptest::prelude::*;

static SOURCES: LazyLock<Corpus> = LazyLock::new(corpus::sources);
static IRS: LazyLock<Corpus> = LazyLock::new(corpus::irs);

/// Tests run beside each other, so memory is measured in `limits.rs`, which is alone.
fn holds(target: Target, input: &[u8]) -> Result<(), TestCaseError> {
    match run(target, input) {
        Ok(()) | Err(Failure::Memory(_)) => Ok(()),
        Err(failure) => Err(TestCaseError::fail(format!(
            "{failure:?}\n{}",
            String::from_utf8_lossy(input)
        ))),
    }
}

/// Words of a language in any order.
fn soup(words: &'static [&'static str]) -> impl Strategy<Value = String> {
    let word = prop::sample::select(words);
    prop::collection::vec(word, 0..300).prop_map(|words| words.join(" "))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes_are_refused_or_compiled(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
        holds(source, &bytes)?;
        holds(ir, &bytes)?;
    }

    #[test]
    fn words_in_any_order_are_refused_or_compiled(text in soup(&SOURCES.words)) {
        holds(source, text.as_bytes())?;
        holds(source, format!("material m {{ {text} }}").as_bytes())?;
    }

    #[test]
    fn words_of_ir_in_any_order_are_refused_or_run(text in soup(&IRS.words)) {
        holds(ir, text.as_bytes())?;
        holds(ir, format!("fn f(a: float) -> float {{ {text} }}").as_bytes())?;
    }

    #[test]
    fn changed_sources_are_refused_or_compiled(seed in any::<u64>()) {
        holds(source, &search::input(&mut Random(seed), &SOURCES))?;
    }

    #[test]
    fn changed_ir_is_refused_or_run(seed in any::<u64>()) {
        holds(ir, &search::input(&mut Random(seed), &IRS))?;
    }
}

#[test]
fn what_was_found_stays_found() {
    let found = [
        (
            source as Target,
            corpus::files("compiler/tests/regressions", ".impasto"),
        ),
        (ir, corpus::files("compiler/tests/regressions", ".ir")),
    ];
    assert!(
        found.iter().any(|(_, files)| !files.is_empty()),
        "the folder is empty"
    );
    for (target, files) in found {
        for text in files {
            if let Err(failure) = run(target, &text) {
                panic!("{failure:?}\n{}", String::from_utf8_lossy(&text));
            }
        }
    }
}
