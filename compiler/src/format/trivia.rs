//! Tokens with the comments and empty lines around them.
//!
//! The lexer drops comments; here they are found again between tokens, and each is given a place
//! that formatting again finds the same: behind a token at the end of its line, on lines of their
//! own before a token, or within a line. No comment stands before a `,` or `;`: it moves behind.

use crate::lexer::Token;
use crate::source::Span;

/// A token and what belongs to it.
#[derive(Default)]
pub(super) struct Piece<'t> {
    /// `None` at the end of the file.
    pub(super) token: Option<Token>,
    pub(super) text: &'t str,
    /// Comments before it.
    pub(super) lead: Vec<Lead<'t>>,
    /// Is there an empty line before it, behind its comments?
    pub(super) blank: bool,
    /// Is there a line break between the token before and this one?
    pub(super) breaks: bool,
    /// Comments behind it, with more of the line behind them.
    pub(super) inline: Vec<&'t str>,
    /// Comments behind it, which end the line.
    pub(super) trailing: Vec<&'t str>,
    /// Of a closing bracket: comments at the end of the line before it.
    pub(super) dangling: Vec<&'t str>,
}

/// A comment before a token.
#[derive(Clone, Copy)]
pub(super) struct Lead<'t> {
    pub(super) text: &'t str,
    /// Does the line end behind it?
    pub(super) own_line: bool,
    /// Is there an empty line before it?
    pub(super) blank: bool,
}

/// The tokens of `text` with their comments; the last one is the end of the file.
pub(super) fn pieces<'t>(text: &'t str, tokens: &[(Token, Span)]) -> Vec<Piece<'t>> {
    let mut attach = Attach::default();
    let mut end = 0;
    for (token, span) in tokens {
        let range = span.range();
        let piece = Piece {
            token: Some(*token),
            text: text.get(range.clone()).unwrap_or("").trim_end(),
            ..Piece::default()
        };
        attach.push(gap(text.get(end..range.start).unwrap_or("")), piece);
        end = range.end;
    }
    let mut rest = gap(text.get(end..).unwrap_or(""));
    // The end is not on the line of the last comment.
    rest.lines.push(Line::default());
    attach.push(rest, Piece::default());
    attach.pieces
}

/// Every comment of `text`, in order.
pub(super) fn comments<'t>(text: &'t str, tokens: &[(Token, Span)]) -> Vec<&'t str> {
    let mut found = Vec::new();
    let mut end = 0;
    let ends = [text.len()];
    let starts = tokens.iter().map(|(_, span)| span.start as usize);
    let tokens = tokens.iter().map(|(_, span)| span.end as usize);
    for (start, next) in starts.chain(ends).zip(tokens.chain(ends)) {
        found.extend(gap(text.get(end..start).unwrap_or("")).comments());
        end = next;
    }
    found
}

/// What stands between two tokens, line by line. The first line is that of the token before, the
/// last one that of the token behind.
struct Gap<'t> {
    lines: Vec<Line<'t>>,
}

#[derive(Default)]
struct Line<'t> {
    comments: Vec<&'t str>,
    /// Empty lines above.
    blank: bool,
}

impl<'t> Gap<'t> {
    fn comments(self) -> impl Iterator<Item = &'t str> {
        self.lines.into_iter().flat_map(|line| line.comments)
    }
}

fn gap(text: &str) -> Gap<'_> {
    let mut lines = vec![Line::default()];
    let mut rest = text;
    let mut newlines = 0;
    loop {
        if let Some(after) = rest.strip_prefix('\n') {
            newlines += 1;
            rest = after;
            continue;
        }
        let length = match rest.get(..2) {
            Some("//") => rest.find('\n').unwrap_or(rest.len()),
            Some("/*") => rest.find("*/").map_or(rest.len(), |at| at + 2),
            _ => {
                let Some(first) = rest.chars().next() else {
                    break;
                };
                rest = &rest[first.len_utf8()..];
                continue;
            }
        };
        start_line(&mut lines, &mut newlines);
        if let Some(line) = lines.last_mut() {
            line.comments.push(rest[..length].trim_end());
        }
        rest = &rest[length..];
    }
    start_line(&mut lines, &mut newlines);
    Gap { lines }
}

fn start_line(lines: &mut Vec<Line<'_>>, newlines: &mut usize) {
    if *newlines > 0 {
        let blank = *newlines > 1;
        lines.push(Line {
            blank,
            ..Line::default()
        });
        *newlines = 0;
    }
}

/// Gives comments to tokens, one gap after the other.
#[derive(Default)]
struct Attach<'t> {
    pieces: Vec<Piece<'t>>,
    /// Comments that stood before the last token and move before the next one.
    carried: Vec<Lead<'t>>,
}

impl<'t> Attach<'t> {
    fn push(&mut self, gap: Gap<'t>, mut piece: Piece<'t>) {
        let mut lines = gap.lines;
        piece.breaks = lines.len() > 1;
        let last = lines.pop().unwrap_or_default();
        piece.blank = last.blank;
        let inline = last.comments;
        let mut lines = lines.into_iter();
        let behind = lines.next().map_or(Vec::new(), |line| line.comments);
        let own_lines = lines.filter(|line| !line.comments.is_empty());
        let mut own: Vec<Lead<'t>> = own_lines.flat_map(lead_lines).collect();
        match piece.token {
            Some(Token::Comma | Token::Semicolon) => {
                piece.trailing = behind;
                self.extend_inline(inline);
                self.pieces.push(piece);
                self.carried.append(&mut own);
                return;
            }
            Some(token) if token.is_closer() => self.before_closer(&mut piece, behind, own, inline),
            _ => {
                piece.lead = std::mem::take(&mut self.carried);
                self.behind_previous(&mut piece, behind);
                piece.lead.append(&mut own);
                piece.lead.extend(inline.into_iter().map(within));
            }
        }
        self.pieces.push(piece);
    }

    fn before_closer(
        &mut self,
        piece: &mut Piece<'t>,
        behind: Vec<&'t str>,
        mut own: Vec<Lead<'t>>,
        inline: Vec<&'t str>,
    ) {
        piece.lead = std::mem::take(&mut self.carried);
        let is_empty = self.previous_opens();
        if is_empty && !piece.breaks {
            piece.lead.extend(inline.into_iter().map(within));
            return;
        }
        if is_empty {
            piece.lead.extend(behind.into_iter().map(own_line));
        } else if self.previous_is_full() {
            self.behind_previous(piece, behind);
        } else {
            piece.dangling = behind;
        }
        piece.lead.append(&mut own);
        if piece.breaks {
            piece.lead.extend(inline.into_iter().map(own_line));
        } else {
            self.extend_inline(inline);
        }
    }

    /// Puts comments at the end of the previous token's line.
    fn behind_previous(&mut self, piece: &mut Piece<'t>, behind: Vec<&'t str>) {
        let is_full = self.previous_is_full() || !piece.lead.is_empty();
        match self.pieces.last_mut() {
            Some(previous) if !is_full => previous.trailing = behind,
            _ => piece.lead.extend(behind.into_iter().map(own_line)),
        }
    }

    fn extend_inline(&mut self, comments: Vec<&'t str>) {
        match self.pieces.last_mut() {
            Some(previous) => previous.inline.extend(comments),
            None => self.carried.extend(comments.into_iter().map(within)),
        }
    }

    fn previous_opens(&self) -> bool {
        let token = self.pieces.last().and_then(|p| p.token);
        token.is_some_and(|t| t.closer().is_some())
    }

    /// Does the line behind the previous token end in comments that were moved there?
    fn previous_is_full(&self) -> bool {
        let previous = self.pieces.last();
        previous.is_some_and(|p| !p.trailing.is_empty())
    }
}

/// The comments of a line without tokens.
fn lead_lines(line: Line<'_>) -> impl Iterator<Item = Lead<'_>> {
    let blank = line.blank;
    let leads = line.comments.into_iter().map(own_line);
    leads.enumerate().map(move |(index, lead)| Lead {
        blank: blank && index == 0,
        ..lead
    })
}

fn own_line(text: &str) -> Lead<'_> {
    Lead {
        text,
        own_line: true,
        blank: false,
    }
}

fn within(text: &str) -> Lead<'_> {
    Lead {
        text,
        own_line: false,
        blank: false,
    }
}
