//! docs/tutorial.md as a newcomer goes through it: in an empty folder and from top to bottom, every file is saved,
//! every edit made and every command run, and what they print and paint is what the page shows.
//!
//! What the page says is what is done. A block of Impasto after "Save this as `F`:" is saved, and elsewhere it is what
//! the file of the page then holds. "replace `A` by `B` in `F`" is an edit. Blocks of `sh` and commands within the text
//! are run; blocks of `text` are what the last of them printed, "something like" it where times and devices differ.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crate::cli::common::{Run, command, folder};

/// The file that the steps 1 to 7 are about.
const FILE: &str = "first.impasto";

/// A paragraph, or a fenced block with its language.
enum Piece {
    Text(String),
    Block(String, String),
}

#[test]
fn the_tutorial_does_what_it_says() {
    let pieces = pieces(&page("docs/tutorial.md"));
    let temporary = folder();
    let mut reader = Newcomer::new(temporary.path());
    for piece in &pieces {
        reader.reads(piece);
    }
    reader.settle(0);
    assert!(reader.watching.is_none(), "nobody ends `--watch`");
    // The page did not lose what is tested.
    let done = [reader.saved, reader.edits, reader.commands, reader.outputs];
    assert!(
        done.iter()
            .zip([6, 3, 10, 5])
            .all(|(is, least)| *is >= least),
        "files, edits, commands and outputs: {done:?}"
    );
    assert_eq!(reader.pictures, 8);
}

#[test]
fn what_a_broken_step_prints_is_noticed() {
    let like = "wrote first.png (64 samples per pixel, 3.4 s)";
    assert!(resembles(like, "wrote first.png (16 samples per pixel)\n"));
    assert!(!resembles(
        like,
        "wrote second.png (64 samples per pixel)\n"
    ));
    assert!(!resembles("a\nb", "b\na\n"));
}

/// One who does what the page says, in a folder.
struct Newcomer<'f> {
    folder: &'f Path,
    /// The text since the last block.
    before: String,
    /// Commands whose exit code is not known to be right yet, since the text after them may say it.
    open: Vec<(String, Run)>,
    watching: Option<Watching>,
    saved: usize,
    edits: usize,
    commands: usize,
    outputs: usize,
    pictures: usize,
    /// The picture that was written last.
    picture: PathBuf,
}

impl<'f> Newcomer<'f> {
    fn new(folder: &'f Path) -> Self {
        Self {
            folder,
            before: String::new(),
            open: Vec::new(),
            watching: None,
            saved: 0,
            edits: 0,
            commands: 0,
            outputs: 0,
            pictures: 0,
            picture: PathBuf::new(),
        }
    }

    fn reads(&mut self, piece: &Piece) {
        match piece {
            Piece::Text(text) => self.reads_text(text),
            Piece::Block(language, block) => {
                match language.as_str() {
                    "impasto" => self.source(block),
                    "sh" => {
                        self.settle(0);
                        block.lines().for_each(|line| self.run(line));
                    }
                    "text" => self.output(block),
                    "toml" => self.entry(block),
                    other => panic!("a block of {other}"),
                }
                self.before.clear();
            }
        }
    }

    fn reads_text(&mut self, text: &str) {
        if !text.ends_with(':') {
            self.settle(0);
        }
        if let Some(name) = between(text, "](images/", ")") {
            self.compare(name);
        }
        let words = text.to_lowercase();
        let mut rest = text;
        for _ in words.match_indices("replace `") {
            rest = self.edit(rest);
        }
        for span in text.split('`').skip(1).step_by(2) {
            let arguments = span.strip_prefix("impasto ");
            if arguments.is_some_and(|arguments| arguments.contains(' ')) {
                self.settle(0);
                self.run(span);
            }
        }
        if text.contains("Ctrl-C") && text.contains("ends `--watch`") {
            self.watching.take().expect("something watches").end();
        }
        self.before += text;
        self.before.push('\n');
    }

    /// Saves a source where the text says so; otherwise the file is there already and reads like this.
    fn source(&mut self, block: &str) {
        let path = self.folder.join(FILE);
        if self
            .before
            .trim_end()
            .ends_with(&format!("Save this as `{FILE}`:"))
        {
            let seen = self.watching.as_ref().map(Watching::pictures);
            std::fs::write(path, block).expect("the source is saved");
            self.saved += 1;
            if let (Some(watching), Some(seen)) = (&self.watching, seen) {
                watching.wait_for(seen + 1);
                self.picture = self.folder.join("first.png");
            }
        } else {
            let is = std::fs::read_to_string(path).expect("the source is there");
            assert_eq!(is, block, "{FILE} as the page shows it");
        }
    }

    /// A part of the scene, as the edits left it.
    fn entry(&self, block: &str) {
        let scene = std::fs::read_to_string(self.folder.join("show/scene.toml"));
        let scene = scene.expect("the scene");
        assert!(scene.contains(block), "{block}is not in\n{scene}");
    }

    /// Does the first edit of a text, and gives the text after it.
    fn edit<'t>(&mut self, text: &'t str) -> &'t str {
        let at = text.to_lowercase().find("eplace `").expect("an edit");
        let mut parts = text[at..].splitn(7, '`').skip(1);
        let mut next = || parts.next().expect("replace `A` by `B` in `F`");
        let (from, by, to, within, file, rest) = (next(), next(), next(), next(), next(), next());
        assert_eq!((by.trim(), within.trim()), ("by", "in"), "{text}");
        let path = self.folder.join(file);
        let old = std::fs::read_to_string(&path).expect("the file to edit");
        assert_eq!(old.matches(from).count(), 1, "`{from}` in\n{old}");
        std::fs::write(path, old.replace(from, to)).expect("the edit is saved");
        self.edits += 1;
        rest
    }

    fn run(&mut self, line: &str) {
        let words = words(line);
        assert_eq!(words[0], "impasto", "{line}");
        let mut command = command(&[]);
        command.args(&words[1..]).current_dir(self.folder);
        self.commands += 1;
        if line.ends_with("--watch") {
            let watching = Watching::of(command.stderr(Stdio::piped()).spawn());
            watching.wait_for(1);
            self.watching = Some(watching);
            return;
        }
        let run: Run = command.output().expect("the command starts").into();
        let mut wrote = run
            .stderr
            .lines()
            .filter_map(|line| between(line, "wrote ", " "));
        if let Some(name) = wrote.rfind(|name| name.ends_with(".png")) {
            self.picture = self.folder.join(name);
        }
        self.open.push((line.to_owned(), run));
    }

    /// Commands end with exit code 0, or the one that the page says.
    fn settle(&mut self, code: i32) {
        for (line, run) in self.open.drain(..) {
            assert_eq!(run.code, code, "{line}\n{run:#?}");
        }
    }

    fn output(&mut self, block: &str) {
        let (line, run) = self.open.last().expect("a command that printed this");
        let printed = format!("{}{}", run.stdout, run.stderr);
        if !self.before.contains("something like") {
            assert_eq!(printed, block, "{line}");
        } else if !self.before.contains("Without a GPU") || printed.contains("the processor") {
            assert!(
                resembles(block, &printed),
                "{line} printed\n{printed}and not\n{block}"
            );
        }
        self.outputs += 1;
        self.settle(i32::from(self.before.contains("exit code 1")));
    }

    /// The picture that was written last is the one of the page, but for noise.
    fn compare(&mut self, name: &str) {
        let shown = format!("docs/images/{name}");
        let shown = Path::new(env!("CARGO_MANIFEST_DIR")).join(shown);
        let (of_page, written) = (opened(&shown), opened(&self.picture));
        assert_eq!(of_page.dimensions(), written.dimensions(), "{name}");
        let sides = (of_page.width() / 8, of_page.height() / 8);
        let small = |picture| {
            let filter = image::imageops::FilterType::Triangle;
            image::imageops::resize(picture, sides.0, sides.1, filter).into_raw()
        };
        let (a, b) = (small(&of_page), small(&written));
        let apart = a.iter().zip(&b).map(|(a, b)| f64::from(a.abs_diff(*b)));
        let mean = apart.sum::<f64>() / a.len() as f64;
        assert!(
            mean < 3.0,
            "{name} is {mean:.2} of 255 away from its command's picture"
        );
        self.pictures += 1;
    }
}

/// A command that runs until it is ended.
struct Watching {
    child: Child,
    said: Arc<Mutex<String>>,
}

impl Watching {
    fn of(child: std::io::Result<Child>) -> Self {
        let mut child = child.expect("the command starts");
        let mut stderr = child.stderr.take().expect("a pipe");
        let said = Arc::new(Mutex::new(String::new()));
        let all = Arc::clone(&said);
        std::thread::spawn(move || {
            let mut part = [0; 4096];
            while let Ok(count @ 1..) = stderr.read(&mut part) {
                let text = String::from_utf8_lossy(&part[..count]);
                all.lock().expect("a text").push_str(&text);
            }
        });
        Self { child, said }
    }

    /// How many pictures it has written.
    fn pictures(&self) -> usize {
        let said = self.said.lock().expect("a text");
        said.matches("wrote ").count()
    }

    fn wait_for(&self, pictures: usize) {
        let begun = Instant::now();
        while self.pictures() < pictures {
            let said = self.said.lock().expect("a text").clone();
            assert!(!said.contains("error"), "{said}");
            assert!(
                begun.elapsed() < Duration::from_secs(120),
                "no picture: {said}"
            );
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    fn end(mut self) {
        let running = self.child.try_wait().expect("a process");
        assert!(running.is_none(), "it ended by itself: {running:?}");
        self.kill();
    }

    fn kill(&mut self) {
        // One that has ended cannot be killed, and need not be.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Watching {
    fn drop(&mut self) {
        self.kill();
    }
}

fn page(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    std::fs::read_to_string(path).expect("a page")
}

fn opened(path: &Path) -> image::RgbImage {
    let picture = image::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    picture.to_rgb8()
}

/// The paragraphs and blocks of a page, in order; the lines of a paragraph are joined by spaces.
fn pieces(page: &str) -> Vec<Piece> {
    let mut pieces = Vec::new();
    let mut lines = page.lines();
    let mut text = String::new();
    while let Some(line) = lines.next() {
        let language = line.strip_prefix("```");
        if (language.is_some() || line.is_empty()) && !text.is_empty() {
            pieces.push(Piece::Text(std::mem::take(&mut text)));
        }
        if let Some(language) = language {
            let block = lines.by_ref().take_while(|line| *line != "```");
            let block = block.map(|line| format!("{line}\n")).collect();
            pieces.push(Piece::Block(language.to_owned(), block));
        } else if !line.is_empty() {
            let space = if text.is_empty() { "" } else { " " };
            text += &format!("{space}{line}");
        }
    }
    if !text.is_empty() {
        pieces.push(Piece::Text(text));
    }
    pieces
}

/// The words of a command line; quotes hold words together.
fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut is_quoted = false;
    for c in line.chars() {
        match c {
            '"' => is_quoted = !is_quoted,
            ' ' if !is_quoted => words.push(String::new()),
            c => words.last_mut().expect("a word").push(c),
        }
    }
    words
}

/// Whether the lines of a block are among those printed, in this order, each up to its first number or bracket.
fn resembles(block: &str, printed: &str) -> bool {
    let mut printed = printed.lines();
    let mut shown = block.lines().filter(|line| !line.is_empty());
    shown.all(|line| {
        // The number of a line comes first.
        let line = line.trim_start_matches(|c: char| c == ' ' || c.is_ascii_digit());
        let start = line.split(|c: char| c == '(' || c.is_ascii_digit()).next();
        let start = start.unwrap_or(line).trim_end();
        let start = start
            .strip_suffix("AMD EPYC, the processor")
            .unwrap_or(start);
        printed.any(|line| {
            let line = line.trim_start_matches(|c: char| c == ' ' || c.is_ascii_digit());
            line.starts_with(start)
        })
    })
}

fn between<'t>(text: &'t str, from: &str, to: &str) -> Option<&'t str> {
    let (_, rest) = text.split_once(from)?;
    rest.split_once(to).map(|(inside, _)| inside)
}
