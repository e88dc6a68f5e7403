//! The search: mutates the corpus until the time is over, and keeps what fails.

use std::time::{Duration, Instant};

use crate::corpus::{Corpus, root};
use crate::mutate::{mutate, soup};
use crate::{Failure, Random, Target, run};

/// What is asked for on the command line.
struct Options {
    seconds: u64,
    seed: u64,
}

fn options() -> Result<Options, String> {
    let mut options = Options {
        seconds: 60,
        seed: 1,
    };
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        let value = args.next().and_then(|v| v.parse().ok());
        let value = value.ok_or_else(|| format!("`{arg}` needs a number"))?;
        match arg.as_str() {
            "--seconds" => options.seconds = value,
            "--seed" => options.seed = value,
            _ => {
                return Err(format!(
                    "unknown argument `{arg}`; there are --seconds and --seed"
                ));
            }
        }
    }
    Ok(options)
}

/// Searches as the command line says. Gives the exit status: 0 if nothing failed.
pub fn main(name: &str, end: &str, target: Target, corpus: &Corpus) -> std::process::ExitCode {
    let options = match options() {
        Ok(options) => options,
        Err(problem) => {
            eprintln!("{problem}");
            return 2.into();
        }
    };
    let folder = root().join("target/fuzz");
    if let Err(e) = std::fs::create_dir_all(&folder) {
        eprintln!("{}: {e}", folder.display());
        return 2.into();
    }
    // An exhausted stack ends the process: the input is there before it is run.
    let current = folder.join(format!("{name}-current{end}"));
    let mut random = Random(options.seed);
    let (start, mut count, mut failures) = (Instant::now(), 0_u64, Vec::new());
    while start.elapsed() < Duration::from_secs(options.seconds) && failures.len() < 20 {
        let input = input(&mut random, corpus);
        if let Err(e) = std::fs::write(&current, &input) {
            eprintln!("{}: {e}", current.display());
            return 2.into();
        }
        if let Err(failure) = run(target, &input) {
            if failures.iter().any(|f| like(f, &failure)) {
                continue;
            }
            let kept = folder.join(format!("{name}-{}{end}", failures.len()));
            eprintln!("{}: {failure:?}", kept.display());
            let _ = std::fs::write(&kept, &input);
            failures.push(failure);
        }
        count += 1;
    }
    let _ = std::fs::remove_file(&current);
    eprintln!("{count} inputs, {} kinds of failures", failures.len());
    u8::from(!failures.is_empty()).into()
}

/// A random input: mostly a good one with changes.
pub fn input(random: &mut Random, corpus: &Corpus) -> Vec<u8> {
    if random.below(8) == 0 {
        let count = [20, 200, 2000][random.below(3)];
        return soup(random, &corpus.words, count);
    }
    let text = &corpus.texts[random.below(corpus.texts.len())];
    mutate(random, text, &corpus.texts, &corpus.words)
}

/// Are two failures likely to be one?
fn like(a: &Failure, b: &Failure) -> bool {
    let head = |s: &str| s.chars().take(40).collect::<String>();
    match (a, b) {
        (Failure::Panic(a), Failure::Panic(b)) => head(a) == head(b),
        (a, b) => std::mem::discriminant(a) == std::mem::discriminant(b),
    }
}
