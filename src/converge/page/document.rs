//! A document of headings, texts, tables and figures, and its two forms: Markdown and HTML.

use super::numbers::address;
use crate::plot::printable;

/// A part of a document. All texts are plain: whatever is in them is shown as it is.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Block {
    /// A heading of a level from 1.
    Heading(u8, String),
    /// A paragraph.
    Text(String),
    /// What is typed.
    Code(String),
    /// Points that need attention.
    Flags(Vec<String>),
    /// A table.
    Table(Table),
    /// Pictures, side by side where there is room.
    Figures(Vec<Figure>),
}

/// A table; every row has as many cells as the head.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Table {
    pub head: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

/// A picture in a file, relative to the document.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Figure {
    pub file: String,
    pub caption: String,
}

impl Table {
    pub(super) fn new<S: Into<String>>(head: impl IntoIterator<Item = S>) -> Self {
        Self {
            head: head.into_iter().map(Into::into).collect(),
            rows: Vec::new(),
        }
    }
}

/// As Markdown.
pub(super) fn markdown(blocks: &[Block]) -> String {
    let blocks: Vec<String> = blocks.iter().map(markdown_block).collect();
    blocks.join("\n")
}

fn markdown_block(block: &Block) -> String {
    match block {
        Block::Heading(level, text) => {
            format!("{} {}\n", "#".repeat(usize::from(*level)), plain(text))
        }
        Block::Text(text) => format!("{}\n", plain(text)),
        // Indented, so that no text can end it.
        Block::Code(text) => format!("    {}\n", printable(text)),
        Block::Flags(flags) => flags.iter().map(|f| format!("- {}\n", plain(f))).collect(),
        Block::Table(table) => markdown_table(table),
        Block::Figures(figures) => {
            let link = |f: &Figure| format!("![{}]({})\n", plain(&f.caption), address(&f.file));
            figures.iter().map(link).collect()
        }
    }
}

/// The first column is text, the others are numbers.
fn markdown_table(table: &Table) -> String {
    let row = |cells: &[String]| {
        let cells: Vec<String> = cells.iter().map(|c| plain(c)).collect();
        format!("| {} |\n", cells.join(" | "))
    };
    let rule = "| --: ".repeat(table.head.len().saturating_sub(1));
    let rows: String = table.rows.iter().map(|r| row(r)).collect();
    format!("{}| :-- {rule}|\n{rows}", row(&table.head))
}

/// Text in which Markdown finds nothing.
fn plain(text: &str) -> String {
    let mut out = String::new();
    for c in printable(text).chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '\\' | '`' | '*' | '_' | '[' | ']' | '#' | '|' | '~' | '!' => out.extend(['\\', c]),
            c => out.push(c),
        }
    }
    out
}

/// As a page of HTML that needs nothing but the files of its figures.
pub(super) fn html(title: &str, blocks: &[Block]) -> String {
    let body: String = blocks.iter().map(html_block).collect();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
         <title>{}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n{body}</main>\n</body>\n</html>\n",
        escaped(title)
    )
}

/// Pictures keep their white ground in the dark, like prints.
const STYLE: &str = include_str!("page.css");

fn html_block(block: &Block) -> String {
    match block {
        Block::Heading(level, text) => format!("<h{level}>{}</h{level}>\n", escaped(text)),
        Block::Text(text) => format!("<p>{}</p>\n", escaped(text)),
        Block::Code(text) => format!("<pre>{}</pre>\n", escaped(text)),
        Block::Flags(flags) => {
            let item = |flag: &String| format!("<li>{}</li>\n", escaped(flag));
            let items: String = flags.iter().map(item).collect();
            format!("<ul class=\"flags\">\n{items}</ul>\n")
        }
        Block::Table(table) => html_table(table),
        Block::Figures(figures) => {
            // Plots have letters, which must stay readable.
            let plots = figures.iter().any(|f| f.file.ends_with(".svg"));
            let class = if plots { "figures plots" } else { "figures" };
            let figures: String = figures.iter().map(html_figure).collect();
            format!("<div class=\"{class}\">\n{figures}</div>\n")
        }
    }
}

fn html_table(table: &Table) -> String {
    let row = |tag: &str, cells: &[String]| {
        let cell = |c: &String| format!("<{tag}>{}</{tag}>", escaped(c));
        let cells: String = cells.iter().map(cell).collect();
        format!("<tr>{cells}</tr>\n")
    };
    let rows: String = table.rows.iter().map(|r| row("td", r)).collect();
    let head = row("th", &table.head);
    format!(
        "<div class=\"table\"><table>\n<thead>{head}</thead>\n<tbody>\n{rows}</tbody>\n</table></div>\n"
    )
}

fn html_figure(figure: &Figure) -> String {
    let (file, caption) = (address(&figure.file), escaped(&figure.caption));
    format!(
        "<figure><a href=\"{file}\"><img src=\"{file}\" alt=\"{caption}\" loading=\"lazy\"/></a>\
         <figcaption>{caption}</figcaption></figure>\n"
    )
}

/// Text as XML and HTML have it.
fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in printable(text).chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blocks() -> Vec<Block> {
        let mut table = Table::new(["a|b", "n"]);
        table.rows.push(vec!["<script>".into(), "1".into()]);
        vec![
            Block::Heading(1, "*A* & B".into()),
            Block::Code("impasto ```x`".into()),
            Block::Table(table),
            Block::Figures(vec![Figure {
                file: "a b.svg".into(),
                caption: "\"quoted\" ]( x".into(),
            }]),
        ]
    }

    #[test]
    fn markdown_shows_texts_as_they_are() {
        let expected = "# \\*A\\* &amp; B\n\n    impasto ```x`\n\n| a\\|b | n |\n| :-- | --: |\n\
                        | &lt;script> | 1 |\n\n![\"quoted\" \\]( x](a%20b.svg)\n";
        assert_eq!(markdown(&blocks()), expected);
    }

    #[test]
    fn html_shows_texts_as_they_are() {
        let page = html("a < b", &blocks());
        assert!(page.contains("<title>a &lt; b</title>"), "{page}");
        assert!(page.contains("<td>&lt;script&gt;</td><td>1</td>"), "{page}");
        assert!(page.contains("alt=\"&quot;quoted&quot; ]( x\""), "{page}");
        assert!(!page.contains("<script"), "{page}");
        assert!(
            !page.contains("http"),
            "a page needs nothing from elsewhere"
        );
    }
}
