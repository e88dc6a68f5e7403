//! Documents to text: which line breaks are taken, given the width of a line.

use super::doc::{Assign, Doc, Fill, Kind, Operation};
use super::output::Output;

/// Columns of a line.
const WIDTH: usize = 100;
/// Columns of one level of indentation.
const INDENT: usize = 4;

/// The text of `doc`.
pub(super) fn render(doc: &Doc<'_>) -> String {
    let mut renderer = Renderer {
        out: Output::default(),
        todo: vec![Task::broken(0, doc)],
    };
    while let Some(task) = renderer.todo.pop() {
        renderer.step(task);
    }
    renderer.out.finish()
}

/// A part that is still to be written.
#[derive(Clone, Copy)]
struct Task<'d, 't> {
    indent: usize,
    /// Does it stand on one line?
    flat: bool,
    part: Part<'d, 't>,
}

#[derive(Clone, Copy)]
enum Part<'d, 't> {
    Doc(&'d Doc<'t>),
    /// Operations of a chain from `next` on; `broke` if a line broke in it already.
    Chain {
        fill: &'d Fill<'t>,
        next: usize,
        broke: bool,
    },
    Space,
    Break,
    /// A blank if this fits behind it, else a break.
    BreakUnlessFits(&'d Doc<'t>),
}

impl<'d, 't> Task<'d, 't> {
    fn broken(indent: usize, doc: &'d Doc<'t>) -> Self {
        let part = Part::Doc(doc);
        Self {
            indent,
            flat: false,
            part,
        }
    }
}

struct Renderer<'d, 't> {
    out: Output,
    /// The next one last.
    todo: Vec<Task<'d, 't>>,
}

impl<'d, 't> Renderer<'d, 't> {
    fn step(&mut self, task: Task<'d, 't>) {
        match task.part {
            Part::Doc(doc) => self.doc(task, doc),
            Part::Space => self.out.space(),
            Part::Break => self.out.newline(task.indent),
            Part::Chain { fill, next, broke } => self.operation(task, fill, next, broke),
            Part::BreakUnlessFits(doc) => {
                self.out.space();
                if !self.fits_flat_behind(task, doc) {
                    self.out.newline(task.indent);
                }
            }
        }
    }

    fn doc(&mut self, task: Task<'d, 't>, doc: &'d Doc<'t>) {
        let Task { indent, flat, .. } = task;
        match &doc.kind {
            Kind::Text(text) => self.out.text(text, indent),
            Kind::Space => self.out.space(),
            Kind::Line(text) if flat => match *text {
                " " => self.out.space(),
                text => self.out.text(text, indent),
            },
            Kind::Line(_) => self.out.newline(indent),
            Kind::Hard { blank } => self.out.line_start(indent, *blank),
            Kind::Comment { text, ends_line } => self.out.comment(text, indent, *ends_line),
            Kind::WhenBroken(text) if !flat => self.out.text(text, indent),
            Kind::WhenBroken(_) | Kind::Forced => {}
            Kind::Concat(parts) => {
                let tasks = parts.iter().rev().map(|part| Task {
                    part: Part::Doc(part),
                    ..task
                });
                self.todo.extend(tasks);
            }
            Kind::Nest(inner) => self.todo.push(Task {
                indent: indent + INDENT,
                part: Part::Doc(inner),
                ..task
            }),
            Kind::Group(inner) => {
                let flat = flat || self.fits_flat(task, inner);
                self.todo.push(Task {
                    flat,
                    part: Part::Doc(inner),
                    ..task
                });
            }
            Kind::Fill(fill) => {
                let flat = flat || self.fits_flat(task, doc);
                let (next, broke) = (0, false);
                self.todo.push(Task {
                    flat,
                    part: Part::Chain { fill, next, broke },
                    ..task
                });
                self.todo.push(Task {
                    flat,
                    part: Part::Doc(&fill.first),
                    ..task
                });
            }
            Kind::Assign(assign) => self.assign(task, doc, assign),
        }
    }

    /// Does `doc`, which is the next to be written, fit on the rest of the line?
    fn fits_flat_behind(&self, task: Task<'d, 't>, doc: &'d Doc<'t>) -> bool {
        let later = self.todo.len().saturating_sub(1);
        let rest = self.todo.get(..later).unwrap_or_default();
        let part = Part::Doc(doc);
        let first = Task {
            flat: true,
            part,
            ..task
        };
        doc.flat.is_some() && fits(self.out.column(), vec![first], rest, Inner::Flat)
    }

    /// Does `doc` fit on the rest of the line?
    fn fits_flat(&self, task: Task<'d, 't>, doc: &'d Doc<'t>) -> bool {
        let flat = Task {
            flat: true,
            part: Part::Doc(doc),
            ..task
        };
        doc.flat.is_some() && self.fits(self.out.column(), vec![flat], Inner::Flat)
    }

    /// One operator of a chain with its operand, and the rest after it.
    fn operation(&mut self, task: Task<'d, 't>, fill: &'d Fill<'t>, next: usize, broke: bool) {
        let Some(operation) = fill.rest.get(next) else {
            return;
        };
        let breaks = !task.flat && (operation.breaks || !self.continues(task, fill, next));
        let broke = broke || breaks;
        let indent = task.indent + if broke { INDENT } else { 0 };
        self.todo.push(Task {
            part: Part::Chain {
                fill,
                next: next + 1,
                broke,
            },
            ..task
        });
        let parts = [
            Part::Doc(&operation.operand),
            Part::Space,
            Part::Doc(&operation.operator),
            if breaks { Part::Break } else { Part::Space },
        ];
        self.todo.extend(parts.map(|part| Task {
            indent,
            part,
            ..task
        }));
    }

    /// Does an operation go on the line? Up to the next one, all of it if it could stand on a line
    /// of its own, else its start.
    fn continues(&self, task: Task<'d, 't>, fill: &'d Fill<'t>, next: usize) -> bool {
        let Some(operation) = fill.rest.get(next) else {
            return true;
        };
        let more = (next + 1 < fill.rest.len()).then_some(Part::Break);
        let parts = [
            Part::Doc(&operation.operand),
            Part::Space,
            Part::Doc(&operation.operator),
            Part::Space,
        ];
        let tasks = |flat| {
            let parts = more.into_iter().chain(parts);
            parts.map(|part| Task { flat, part, ..task }).collect()
        };
        let is_flat = operation.operator.flat.is_some() && operation.operand.flat.is_some();
        // The blank before the operator is the last of the indentation.
        let alone = is_flat && self.fits(task.indent + INDENT - 1, tasks(true), Inner::Flat);
        let inner = if alone { Inner::Flat } else { Inner::Broken };
        self.fits(self.out.column(), tasks(alone), inner)
    }

    /// On the line of the `=` if all fits there, or the value alone if `when` follows it; else on
    /// the next line if it fits there; else broken within.
    fn assign(&mut self, task: Task<'d, 't>, doc: &'d Doc<'t>, assign: &'d Assign<'t>) {
        let same_line = task.flat || self.fits_flat(task, doc);
        let next_start = task.indent + INDENT;
        let (value, when) = (&assign.value, assign.when.as_ref());
        let is_flat = value.flat.is_some();
        let part = |part| Task {
            indent: next_start,
            flat: true,
            part,
        };
        let fits_alone = |column| {
            let more = when.map(|_| part(Part::Break));
            let tasks = more.into_iter().chain([part(Part::Doc(value))]);
            is_flat && self.fits(column, tasks.collect(), Inner::Flat)
        };
        let fits_here = same_line || (when.is_some() && fits_alone(self.out.column() + 1));
        let fits_next = !fits_here && fits_alone(next_start);
        let breaks_value = fits_next || (!fits_here && assign.breaks);
        if let Some(when) = when {
            self.todo.push(part(Part::Doc(when)));
            self.todo.push(part(match (same_line, fits_here) {
                (true, _) => Part::Space,
                (false, true) => Part::Break,
                (false, false) => Part::BreakUnlessFits(when),
            }));
        }
        self.todo.push(Task {
            flat: fits_here || fits_next,
            indent: if breaks_value {
                next_start
            } else {
                task.indent
            },
            part: Part::Doc(value),
        });
        let first = if breaks_value {
            Part::Break
        } else {
            Part::Space
        };
        self.todo.push(part(first));
    }

    /// Does what `todo` (the next one last) writes from `column` on, and what follows it up to the
    /// next possible break, end within the line?
    fn fits(&self, column: usize, todo: Vec<Task<'d, 't>>, inner: Inner) -> bool {
        fits(column, todo, &self.todo, inner)
    }
}

/// See [`Renderer::fits`]; `later` is what follows `todo`, the next one last as well.
fn fits<'d, 't>(
    column: usize,
    mut todo: Vec<Task<'d, 't>>,
    later: &[Task<'d, 't>],
    inner: Inner,
) -> bool {
    let mut left = WIDTH.saturating_sub(column);
    let mut later = later.iter().rev();
    loop {
        let Some(task) = todo.pop().or_else(|| later.next().copied()) else {
            return true;
        };
        let width = match task.part {
            Part::Space => Some(1),
            Part::Break | Part::BreakUnlessFits(_) => None,
            Part::Chain { fill, next, .. } => width_of_chain(task, fill, next),
            Part::Doc(doc) => width_of(task, doc, inner, &mut todo),
        };
        match width {
            None => return true,
            Some(width) if width > left => return false,
            Some(width) => left -= width,
        }
    }
}

/// How what could stand on one line is measured in something that does not.
#[derive(Clone, Copy, PartialEq)]
enum Inner {
    /// On one line.
    Flat,
    /// Up to the first place where it may break.
    Broken,
}

/// The width of the rest of a chain; `None` where a line may end.
fn width_of_chain(task: Task<'_, '_>, fill: &Fill<'_>, next: usize) -> Option<usize> {
    let rest = fill.rest.get(next..).unwrap_or_default();
    if !task.flat {
        return rest.is_empty().then_some(0);
    }
    let width = |o: &Operation<'_>| 2 + o.operator.flat.unwrap_or(0) + o.operand.flat.unwrap_or(0);
    Some(rest.iter().map(width).sum())
}

/// The width of `doc` itself, its parts being added to `todo`; `None` where a line may end.
fn width_of<'d, 't>(
    task: Task<'d, 't>,
    doc: &'d Doc<'t>,
    inner: Inner,
    todo: &mut Vec<Task<'d, 't>>,
) -> Option<usize> {
    if let (true, Some(width)) = (task.flat, doc.flat) {
        return Some(width);
    }
    let is_flat = |doc: &Doc<'_>| inner == Inner::Flat && doc.flat.is_some();
    let mut push = |doc, flat| {
        let part = Part::Doc(doc);
        todo.push(Task { flat, part, ..task });
    };
    match &doc.kind {
        Kind::Line(_) | Kind::Hard { .. } => return None,
        // Long lines may end in a comment of their own kind; a block comment counts wherever it is.
        Kind::Comment { text, .. } if text.starts_with("//") => return None,
        Kind::Comment { text, ends_line } if *ends_line || text.contains('\n') => {
            let part = Part::Break;
            todo.push(Task { part, ..task });
            return text.lines().next().map(|line| line.chars().count());
        }
        Kind::Text(_) | Kind::Space | Kind::Comment { .. } => return doc.flat,
        Kind::WhenBroken(text) => return Some(text.len()),
        Kind::Forced => {}
        Kind::Concat(parts) => parts.iter().rev().for_each(|part| push(part, false)),
        Kind::Nest(inner) => push(inner, false),
        Kind::Group(inner) => push(inner, is_flat(inner)),
        Kind::Fill(fill) => {
            let flat = is_flat(doc);
            let (next, broke) = (0, false);
            let part = Part::Chain { fill, next, broke };
            todo.push(Task { flat, part, ..task });
            let part = Part::Doc(&fill.first);
            todo.push(Task { flat, part, ..task });
        }
        // It may go on the next line.
        Kind::Assign(assign) if assign.value.flat.is_some() => return None,
        Kind::Assign(assign) => {
            push(&assign.value, false);
            return Some(1);
        }
    }
    Some(0)
}
