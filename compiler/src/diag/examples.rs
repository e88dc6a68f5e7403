//! For every diagnostic a source that provokes it, and the same source repaired.
//!
//! `examples/E0201.txt` holds both, with lines that start with `===` between the parts:
//! `=== repaired`, `=== file NAME` for a module beside it, `=== set NAME = VALUE` for a parameter
//! that a scene sets, `=== bytes N` for blanks up to so many bytes, `=== byte 0xff` for one byte
//! that is no text. A test compiles all of them.

use std::fmt::Write;

use super::{Code, Severity};

/// The file that examples are in.
pub const FILE: &str = "example.impasto";

/// A source with what belongs to it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Example {
    /// Names and texts; the first is [`FILE`].
    pub files: Vec<(String, String)>,
    /// Parameters that a scene sets: name and value.
    pub params: Vec<(String, String)>,
    /// What a text cannot show.
    pub odd: Option<Odd>,
}

/// What makes a file odd that cannot be shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Odd {
    /// It is filled with blanks up to so many bytes.
    Bytes(usize),
    /// This byte is in it.
    Byte(u8),
}

macro_rules! examples {
    ($($code:literal)*) => {
        fn text(code: Code) -> Option<&'static str> {
            match code.id() {
                $($code => Some(include_str!(concat!("examples/", $code, ".txt"))),)*
                _ => None,
            }
        }
    };
}

examples! {
    "E0101" "E0102" "E0103" "E0104" "E0105" "E0106" "E0107" "E0108" "E0109"
    "E0201" "E0202" "E0203" "E0204" "E0205" "E0206" "E0207" "E0208" "E0209" "E0210" "E0211"
    "E0212" "E0213" "E0214" "E0215"
    "E0301" "E0302" "E0303" "E0304" "E0305" "E0306" "E0307" "E0308" "E0309" "E0310" "E0311"
    "E0312" "E0313" "E0314" "E0315" "E0316" "E0317"
    "E0401"
    "E0501" "E0502" "E0503" "E0504" "E0505" "E0506" "E0507" "E0509"
    "W0001" "W0002" "W0003" "W0004" "W0005" "W0006"
}

impl Code {
    /// A source that provokes this diagnostic, and the same repaired. Defects of the compiler have
    /// none, nor has what takes very long.
    pub fn example(self) -> Option<(Example, Example)> {
        let (broken, repaired) = text(self)?.split_once("=== repaired\n")?;
        Some((read(broken), read(repaired)))
    }
}

fn read(text: &str) -> Example {
    let mut example = Example {
        files: vec![(FILE.into(), String::new())],
        ..Example::default()
    };
    for line in text.lines() {
        let Some(what) = line.strip_prefix("=== ") else {
            if let Some((_, text)) = example.files.last_mut() {
                *text += line;
                text.push('\n');
            }
            continue;
        };
        let (word, rest) = what.split_once(' ').unwrap_or((what, ""));
        match word {
            "file" => example.files.push((rest.into(), String::new())),
            "set" => {
                let (name, value) = rest.split_once(" = ").unwrap_or((rest, ""));
                example.params.push((name.into(), value.into()));
            }
            "bytes" => example.odd = rest.parse().ok().map(Odd::Bytes),
            _ => {
                let digits = rest.strip_prefix("0x").unwrap_or(rest);
                example.odd = u8::from_str_radix(digits, 16).ok().map(Odd::Byte);
            }
        }
    }
    example
}

impl Example {
    /// What its main file holds, byte by byte.
    pub fn bytes(&self) -> Vec<u8> {
        let text = self.files.first().map_or("", |(_, text)| text);
        let mut bytes = text.as_bytes().to_vec();
        match self.odd {
            None => {}
            Some(Odd::Bytes(count)) => bytes.resize(count, b' '),
            Some(Odd::Byte(byte)) => bytes.push(byte),
        }
        bytes
    }

    /// What a reader has to know besides the files; empty if there is nothing.
    pub fn notes(&self) -> Vec<String> {
        let params = self.params.iter();
        let set = params.map(|(name, value)| format!("A scene sets `{name}` to `{value}`."));
        let odd = self.odd.map(|odd| match odd {
            Odd::Bytes(count) => format!("Blanks fill the file up to {count} bytes."),
            Odd::Byte(byte) => format!("The file ends in the byte 0x{byte:x}, which is no text."),
        });
        set.chain(odd).collect()
    }
}

/// Every code as a page of Markdown: docs/diagnostics.md.
pub fn page() -> String {
    let mut out = String::from(
        "# Diagnostics\n\n\
         What the compiler says, by code: what it means, a source that provokes it, and the same\n\
         source repaired. `impasto explain E0201` prints one of them. This page is written by\n\
         `impasto explain --markdown`.\n\n\
         | code | |\n|---|---|\n",
    );
    for code in Code::ALL {
        let id = code.id();
        // Writing to a string cannot fail.
        let _ = writeln!(out, "| [{id}](#{}) | {} |", id.to_lowercase(), code.title());
    }
    for code in Code::ALL {
        let kind = match code.severity() {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        let _ = write!(
            out,
            "\n## {}\n\n**{kind}: {}.** {}\n",
            code.id(),
            code.title(),
            code.explanation()
        );
        if let Some((broken, repaired)) = code.example() {
            section(&mut out, "It comes from", &broken);
            section(&mut out, "Repaired", &repaired);
        }
    }
    out
}

fn section(out: &mut String, title: &str, example: &Example) {
    let notes = example.notes();
    let _ = write!(out, "\n{title}:");
    for note in &notes {
        let _ = write!(out, " {note}");
    }
    out.push('\n');
    for (name, text) in &example.files {
        if name != FILE {
            let _ = write!(out, "\nwith `{name}`:\n");
        }
        let _ = write!(out, "\n```text\n{text}```\n");
    }
}
