//! Values whose numbers are sums of products.

use std::rc::Rc;

use super::sum::{Part, Sum, Why};
use crate::ir::{Const, Type};
use crate::source::{FileId, Span};

/// A value.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Sym {
    Bool(bool),
    Int(i32),
    /// A float or a vector.
    Floats(Vec<Part>),
    /// Three columns.
    Mat3(Vec<Vec<Part>>),
    Struct(Rc<Vec<Sym>>),
    Unknown(Why),
}

impl Why {
    pub fn new(span: Span, what: impl Into<Rc<str>>) -> Self {
        Self {
            span,
            what: what.into(),
        }
    }
}

impl Sym {
    pub fn constant(value: &Const) -> Self {
        match value {
            Const::Bool(b) => Self::Bool(*b),
            Const::Int(i) => Self::Int(*i),
            Const::Float(v) => Self::Floats(v.iter().map(|x| Ok(Sum::constant(*x))).collect()),
        }
    }

    /// The first reason within it.
    pub fn first_why(&self) -> Option<Why> {
        match self {
            Self::Unknown(why) => Some(why.clone()),
            Self::Floats(parts) => parts.iter().find_map(|p| p.as_ref().err().cloned()),
            Self::Mat3(columns) => {
                let mut parts = columns.iter().flatten();
                parts.find_map(|p| p.as_ref().err().cloned())
            }
            _ => None,
        }
    }

    /// Why it is not known, at `span` where nothing within it says so.
    pub fn why(&self, span: Span) -> Why {
        let varies = || Why::new(span, "what varies over the surface");
        self.first_why().unwrap_or_else(varies)
    }

    /// The same, where reasons within the library are those of the call of it.
    pub fn by_caller(self, why: &Why) -> Self {
        let part = |part: Part| part.map_err(|own| own.by_caller(why));
        match self {
            Self::Unknown(own) => Self::Unknown(own.by_caller(why)),
            Self::Floats(parts) => Self::Floats(parts.into_iter().map(part).collect()),
            Self::Mat3(columns) => Self::Mat3(
                columns
                    .into_iter()
                    .map(|column| column.into_iter().map(part).collect())
                    .collect(),
            ),
            Self::Struct(fields) => {
                let fields = fields.iter().cloned().map(|field| field.by_caller(why));
                Self::Struct(Rc::new(fields.collect()))
            }
            known => known,
        }
    }
}

impl Why {
    fn by_caller(self, caller: &Why) -> Why {
        if self.span.file.is_library() {
            caller.clone()
        } else {
            self
        }
    }
}

/// Assigns a variable, or a component of it.
pub(super) fn store(local: &mut Sym, component: Option<u8>, value: Sym) {
    let Some(component) = component else {
        *local = value;
        return;
    };
    match (&mut *local, value) {
        (Sym::Floats(parts), Sym::Floats(mut value)) if usize::from(component) < parts.len() => {
            parts[usize::from(component)] = value.swap_remove(0);
        }
        (Sym::Floats(parts), Sym::Unknown(why)) if usize::from(component) < parts.len() => {
            parts[usize::from(component)] = Err(why);
        }
        (_, other) => *local = Sym::Unknown(other.why(Span::new(FileId(0), 0..0))),
    }
}

/// A vector or matrix from parts.
pub(super) fn composed(args: &[Sym], ty: Type, span: Span) -> Sym {
    let parts = |arg: &Sym| match arg {
        Sym::Floats(parts) => Some(parts.clone()),
        _ => None,
    };
    let all: Option<Vec<Vec<Part>>> = args.iter().map(parts).collect();
    let Some(all) = all else {
        let why = args.iter().find_map(Sym::first_why);
        let why = why.unwrap_or_else(|| Why::new(span, "what varies over the surface"));
        // An unknown float is one component; which ones an unknown vector fills is of no use to anybody.
        return Sym::Unknown(why);
    };
    if ty == Type::Mat3 {
        return Sym::Mat3(all);
    }
    let mut components = all.concat();
    if let [only] = components.as_slice() {
        components = vec![only.clone(); ty.width().unwrap_or(1)];
    }
    Sym::Floats(components)
}

/// Components of a vector.
pub(super) fn swizzled(value: &Sym, picked: &[u8], span: Span) -> Sym {
    let Sym::Floats(parts) = value else {
        return Sym::Unknown(value.why(span));
    };
    let picked = picked.iter().map(|&c| parts.get(usize::from(c)).cloned());
    match picked.collect() {
        Some(parts) => Sym::Floats(parts),
        None => Sym::Unknown(value.why(span)),
    }
}
