//! What is to be written, before it is known where lines break.
//!
//! A document is a tree of texts and possible line breaks; `render` decides which of them break.
//! Source: Wadler 2003, "A prettier printer", with the groups and fills that later printers added.

/// A part of the output, with its width where all of it stands on one line.
pub(super) struct Doc<'t> {
    pub(super) kind: Kind<'t>,
    /// In characters; `None` when it cannot stand on one line.
    pub(super) flat: Option<usize>,
}

pub(super) enum Kind<'t> {
    /// Text without line breaks.
    Text(&'t str),
    /// A blank, unless a line starts or ends here.
    Space,
    /// A line break in a broken group, else this text.
    Line(&'static str),
    /// A line break, and an empty line before it if `blank`. Nothing more where a line starts.
    Hard {
        blank: bool,
    },
    /// A comment; the line ends behind it if `ends_line`.
    Comment {
        text: &'t str,
        ends_line: bool,
    },
    /// Text that appears in a broken group only.
    WhenBroken(&'static str),
    /// Nothing, but what holds it cannot stand on one line.
    Forced,
    Concat(Vec<Doc<'t>>),
    /// Indented by one level.
    Nest(Box<Doc<'t>>),
    /// On one line if it fits there; else all of its own [`Kind::Line`]s break.
    Group(Box<Doc<'t>>),
    /// Operands between operators; see [`Fill`].
    Fill(Box<Fill<'t>>),
    /// What follows a `=`; see [`Assign`].
    Assign(Box<Assign<'t>>),
}

/// A chain of operators of one binding power. Where it does not fit on one line, it breaks before
/// the operators that its author broke it at, and before those whose operand does not fit.
pub(super) struct Fill<'t> {
    pub(super) first: Doc<'t>,
    pub(super) rest: Vec<Operation<'t>>,
}

pub(super) struct Operation<'t> {
    pub(super) operator: Doc<'t>,
    pub(super) operand: Doc<'t>,
    /// Does a line of the source break beside the operator?
    pub(super) breaks: bool,
}

/// `value when condition` behind a `=`: on the same line, or on the next one if all of it fits
/// there, or broken within.
pub(super) struct Assign<'t> {
    pub(super) value: Doc<'t>,
    pub(super) when: Option<Doc<'t>>,
    /// Does the value start on the next line if it cannot stand on one?
    pub(super) breaks: bool,
}

impl<'t> Doc<'t> {
    fn new(kind: Kind<'t>, flat: Option<usize>) -> Self {
        Self { kind, flat }
    }

    pub(super) fn nothing() -> Self {
        Self::new(Kind::Concat(Vec::new()), Some(0))
    }

    pub(super) fn text(text: &'t str) -> Self {
        Self::new(Kind::Text(text), Some(text.chars().count()))
    }

    pub(super) fn space() -> Self {
        Self::new(Kind::Space, Some(1))
    }

    pub(super) fn line(flat: &'static str) -> Self {
        Self::new(Kind::Line(flat), Some(flat.len()))
    }

    pub(super) fn hard(blank: bool) -> Self {
        Self::new(Kind::Hard { blank }, None)
    }

    pub(super) fn comment(text: &'t str, ends_line: bool) -> Self {
        let inline = !ends_line && !text.contains('\n');
        let flat = inline.then(|| text.chars().count());
        Self::new(Kind::Comment { text, ends_line }, flat)
    }

    pub(super) fn when_broken(text: &'static str) -> Self {
        Self::new(Kind::WhenBroken(text), Some(0))
    }

    pub(super) fn forced() -> Self {
        Self::new(Kind::Forced, None)
    }

    pub(super) fn concat(parts: Vec<Doc<'t>>) -> Self {
        let flat = parts.iter().map(|part| part.flat).sum();
        Self::new(Kind::Concat(parts), flat)
    }

    pub(super) fn nest(self) -> Self {
        let flat = self.flat;
        Self::new(Kind::Nest(Box::new(self)), flat)
    }

    pub(super) fn group(self) -> Self {
        let flat = self.flat;
        Self::new(Kind::Group(Box::new(self)), flat)
    }

    pub(super) fn fill(first: Doc<'t>, rest: Vec<Operation<'t>>) -> Self {
        let width = |o: &Operation<'t>| Some(2 + o.operator.flat? + o.operand.flat?);
        let more: Option<usize> = rest.iter().map(width).sum();
        let flat = first.flat.zip(more).map(|(a, b)| a + b);
        Self::new(Kind::Fill(Box::new(Fill { first, rest })), flat)
    }

    /// Starts with the blank behind the `=`. `breaks` if a line of the source breaks there, which
    /// counts for chains of operators.
    pub(super) fn assign(value: Doc<'t>, when: Option<Doc<'t>>, breaks: bool) -> Self {
        let breaks = breaks && matches!(value.kind, Kind::Fill(_));
        let more = match &when {
            Some(when) => when.flat.map(|width| 1 + width),
            None => Some(0),
        };
        let flat = value.flat.zip(more).map(|(a, b)| 1 + a + b);
        Self::new(
            Kind::Assign(Box::new(Assign {
                value,
                when,
                breaks,
            })),
            flat,
        )
    }
}
