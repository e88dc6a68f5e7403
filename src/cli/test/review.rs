//! `impasto test --review`: shows what is not as its snapshot has it, side by side, and asks.

use std::io::{self, BufRead, IsTerminal, Write};

use impasto::snapshots::{self, Aspect, Changed, Subject};
use impasto::verify::check::File;

use super::super::{Failure, Global, progress};
use super::pictures;
use super::snapshots::Review;

/// Lines that are shown around those that differ.
const AROUND: usize = 2;
/// Most lines of one difference that are shown.
const LONGEST: usize = 40;
/// Columns of a terminal that does not tell how wide it is.
const COLUMNS: usize = 140;

/// What the author says of one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Answer {
    Accept,
    Reject,
    Skip,
    Quit,
}

/// Asks about each of `all`; tells of each whether it was accepted.
pub(super) fn ask(
    all: &[(&File, Subject<'_>, &Review)],
    global: &Global,
) -> Result<Vec<bool>, Failure> {
    let mut accepted = vec![false; all.len()];
    let mut input = io::stdin().lock();
    for (i, (file, subject, review)) in all.iter().enumerate() {
        show(file, *subject, review, (i + 1, all.len()), global)?;
        match answer(&mut input)? {
            Answer::Accept => {
                snapshots::accept(*subject, &review.taken).map_err(Failure::Error)?;
                accepted[i] = true;
            }
            Answer::Reject | Answer::Skip => {}
            Answer::Quit => break,
        }
    }
    Ok(accepted)
}

fn answer(input: &mut impl BufRead) -> Result<Answer, Failure> {
    loop {
        say("(a)ccept, (r)eject, (s)kip, (q)uit? ")?;
        let mut line = String::new();
        let read = input.read_line(&mut line);
        let read = read.map_err(|why| Failure::Error(format!("cannot read an answer: {why}")))?;
        match line.trim().to_ascii_lowercase().as_str() {
            // Nobody is there to answer.
            _ if read == 0 => return Ok(Answer::Quit),
            "a" | "accept" => return Ok(Answer::Accept),
            "r" | "reject" => return Ok(Answer::Reject),
            "s" | "skip" | "" => return Ok(Answer::Skip),
            "q" | "quit" => return Ok(Answer::Quit),
            _ => {}
        }
    }
}

fn say(text: &str) -> Result<(), Failure> {
    let written = progress::aside(|| {
        let mut out = io::stderr().lock();
        out.write_all(text.as_bytes()).and_then(|()| out.flush())
    });
    written.map_err(|why| Failure::Error(format!("cannot write to the terminal: {why}")))
}

fn show(
    file: &File,
    subject: Subject<'_>,
    review: &Review,
    (number, of): (usize, usize),
    global: &Global,
) -> Result<(), Failure> {
    say(&format!(
        "\n[{number}/{of}] {}::{}\n",
        subject.file, subject.name
    ))?;
    let Some(stored) = &review.stored else {
        say("There is no snapshot of it yet.\n")?;
        return pictures::show(None, &review.taken.picture.film);
    };
    for difference in &review.differences {
        global.report(&file.sources, std::slice::from_ref(&difference.diagnostic));
        match difference.aspect {
            Aspect::Wgsl => {
                let sides = Sides {
                    old: stored.wgsl.lines().collect(),
                    new: review.taken.wgsl.lines().collect(),
                    from: &review.taken.from,
                    width: width(),
                    colored: global.colored(),
                };
                say(&sides.text(&difference.changed))?;
            }
            Aspect::Picture => {
                pictures::show(Some(&stored.picture), &review.taken.picture.film)?;
            }
            Aspect::Cost | Aspect::Parameters => {}
        }
    }
    Ok(())
}

fn width() -> usize {
    let told = std::env::var("COLUMNS").ok().and_then(|c| c.parse().ok());
    let known = io::stderr().is_terminal().then(|| {
        let (_, columns) = console::Term::stderr().size();
        usize::from(columns)
    });
    told.or(known).unwrap_or(COLUMNS).max(60)
}

/// Two texts beside each other.
struct Sides<'a> {
    old: Vec<&'a str>,
    new: Vec<&'a str>,
    /// Where the lines of the new one come from.
    from: &'a [Option<(String, usize)>],
    width: usize,
    colored: bool,
}

impl Sides<'_> {
    fn text(&self, changed: &[Changed]) -> String {
        let mut out = String::new();
        for change in changed {
            out += &self.heading(change);
            let before = change.old.start.min(change.new.start).min(AROUND);
            for back in (1..=before).rev() {
                out += &self.row(
                    Some(change.old.start - back),
                    Some(change.new.start - back),
                    false,
                );
            }
            let lines = change.old.len().max(change.new.len());
            for i in 0..lines.min(LONGEST) {
                let within = |range: &std::ops::Range<usize>| range.clone().nth(i);
                out += &self.row(within(&change.old), within(&change.new), true);
            }
            if lines > LONGEST {
                out += &format!("  ... {} more lines\n", lines - LONGEST);
            }
            for after in 0..AROUND {
                let (old, new) = (change.old.end + after, change.new.end + after);
                if old < self.old.len() && new < self.new.len() {
                    out += &self.row(Some(old), Some(new), false);
                }
            }
        }
        out
    }

    /// The lines of sources that a difference comes from.
    fn heading(&self, change: &Changed) -> String {
        let lines = change.new.start..change.new.end.max(change.new.start + 1);
        let mut places: Vec<String> = Vec::new();
        for place in lines.filter_map(|line| self.from.get(line)?.as_ref()) {
            let text = format!("{}:{}", place.0, place.1);
            if places.last() != Some(&text) && places.len() < 4 {
                places.push(text);
            }
        }
        let from = if places.is_empty() {
            String::new()
        } else {
            format!(" from {}", places.join(", "))
        };
        format!("@@ line {}{from}\n", change.new.start + 1)
    }

    fn row(&self, old: Option<usize>, new: Option<usize>, differs: bool) -> String {
        let texts = (
            old.and_then(|l| self.old.get(l)),
            new.and_then(|l| self.new.get(l)),
        );
        // A number of five digits, a mark and a blank on both sides, and a bar between them.
        let side = (self.width.saturating_sub(17)) / 2;
        let skipped = match texts {
            (Some(old), Some(new)) if differs => skipped(old, new, side),
            _ => 0,
        };
        let cell = |line: Option<usize>, texts: &[&str], mark: char| {
            let Some((number, text)) = line.and_then(|l| Some((l + 1, texts.get(l)?))) else {
                return format!("{:7}{:side$}", "", "");
            };
            let mark = if differs { mark } else { ' ' };
            let cut: String = if skipped > 0 {
                let rest = text.chars().skip(skipped).take(side.saturating_sub(4));
                format!("... {}", rest.collect::<String>())
            } else {
                text.chars().take(side).collect()
            };
            format!("{number:5}{mark} {cut:side$}")
        };
        let (left, right) = (cell(old, &self.old, '-'), cell(new, &self.new, '+'));
        if self.colored && differs {
            format!("\x1b[31m{left}\x1b[0m | \x1b[32m{right}\x1b[0m\n")
        } else {
            format!("{} | {}\n", left, right.trim_end())
        }
    }
}

/// How many characters at the start of two lines are left out, so that where they part is seen in `side` columns.
fn skipped(old: &str, new: &str, side: usize) -> usize {
    let same = old.chars().zip(new.chars()).take_while(|(a, b)| a == b);
    let same = same.count();
    if same > side * 2 / 3 {
        same - side / 3
    } else {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lines_are_shown_from_before_where_they_part() {
        let old = format!("{}1.5", "x".repeat(200));
        let new = old.replace("1.5", "2.5");
        assert_eq!(skipped(&old, &new, 30), 190);
        assert_eq!(skipped("ab", "ac", 30), 0);
    }

    #[test]
    fn changed_lines_stand_beside_each_other_under_their_sources() {
        let from = [None, Some(("m.impasto".to_owned(), 7)), None, None];
        let sides = Sides {
            old: vec!["a", "b", "d"],
            new: vec!["a", "x", "y", "d"],
            from: &from,
            width: 37,
            colored: false,
        };
        let change = Changed {
            old: 1..2,
            new: 1..3,
        };
        assert_eq!(
            sides.text(&[change]),
            "@@ line 2 from m.impasto:7\n    1  a          |     1  a\n    2- b          |     2+ x\n                  \
             |     3+ y\n    3  d          |     4  d\n"
        );
    }

    #[test]
    fn answers_are_words_or_letters_and_nobody_is_quit() {
        let mut said: &[u8] = b"what\nAccept\nr\n\n";
        let all: Vec<Answer> = (0..4)
            .map(|_| answer(&mut said).ok().expect("an answer"))
            .collect();
        assert_eq!(
            all,
            [Answer::Accept, Answer::Reject, Answer::Skip, Answer::Quit]
        );
    }
}
