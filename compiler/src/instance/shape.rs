//! What sums of products are as a value that other formats have: numbers, a picture with a factor, or a normal map.

use super::evaluate::{Bent, Evaluator, Looked};
use super::sum::{Atom, COLOR, Sum, Why};
use super::value::Sym;
use super::{Channels, Lookup, NormalMap, Place, Texel, Value, Varying};
use crate::ir::Type;
use crate::source::Span;

/// A value, or an input of the surface as it is.
pub(super) enum Shape {
    Value(Value),
    Input(String),
}

/// Finds shapes, and keeps the lookups that they have.
pub(super) struct Shapes<'e> {
    looked: &'e [Looked],
    bent: &'e [Bent],
    /// The fields of the surface point.
    fields: &'e [(String, Type)],
    pub lookups: Vec<Lookup>,
    /// The textures that these look up, by their numbers in the module.
    pub textures: Vec<usize>,
}

impl<'e> Shapes<'e> {
    pub fn new(evaluator: &'e Evaluator<'_>, fields: &'e [(String, Type)]) -> Self {
        Self {
            looked: &evaluator.lookups,
            bent: &evaluator.bent,
            fields,
            lookups: Vec::new(),
            textures: Vec::new(),
        }
    }

    /// The shape of a value at `span`, or what of it has none.
    pub fn of(&mut self, value: &Sym, span: Span) -> Result<Shape, Why> {
        Ok(Shape::Value(match value {
            Sym::Bool(b) => Value::Bool(*b),
            Sym::Int(i) => Value::Int(*i),
            Sym::Floats(parts) => {
                let sums: Result<Vec<Sum>, Why> = parts.iter().cloned().collect();
                let sums = sums?;
                let known: Option<Vec<f64>> = sums.iter().map(Sum::known).collect();
                if let Some(numbers) = known {
                    Value::Numbers(numbers)
                } else if let Some(atoms) = direction(&sums) {
                    return self.direction(atoms, span);
                } else {
                    Value::Varying(self.varying(&sums, span)?)
                }
            }
            other => return Err(other.why(span)),
        }))
    }

    /// An input, or a bent normal.
    fn direction(&mut self, first: Atom, span: Span) -> Result<Shape, Why> {
        match first {
            Atom::Bent(index, _) => {
                let bent = &self.bent[index as usize];
                Ok(Shape::Value(Value::Normal(NormalMap {
                    map: self.varying(&bent.map, span)?,
                    scale: bent.scale,
                    flip_green: bent.flip_green,
                })))
            }
            Atom::Input(field, _) if self.field(field) != "vertex_color" => {
                Ok(Shape::Input(self.field(field).to_owned()))
            }
            atom => {
                let sums: [Sum; 3] = [0, 1, 2].map(|c| Sum::atom(atom.component(c)));
                Ok(Shape::Value(Value::Varying(self.varying(&sums, span)?)))
            }
        }
    }

    fn varying(&mut self, sums: &[Sum], span: Span) -> Result<Varying, Why> {
        let mut terms = Vec::new();
        for sum in sums {
            terms.push(self.term(sum, span)?);
        }
        let varying = || terms.iter().flatten();
        let mut lookups = varying().filter_map(|term| term.texel.map(|(lookup, _)| lookup));
        let lookup = lookups.next();
        let is_one = lookups.all(|own| Some(own) == lookup);
        let all_look = varying().all(|term| term.texel.is_some() == lookup.is_some());
        let has_vertex_color = varying().any(|term| term.vertex_color.is_some());
        let by_component = terms.iter().enumerate().all(|(c, term)| {
            let own = term.as_ref().map(|term| term.vertex_color);
            own.is_none_or(|own| own == has_vertex_color.then_some(c as u8))
        });
        if !is_one || !all_look {
            return Err(Why::new(span, "several pictures"));
        }
        if !by_component || (has_vertex_color && sums.len() != 3) {
            return Err(Why::new(span, "components of `vertex_color` apart"));
        }
        let texel = match lookup {
            Some(lookup) => {
                let channels: Vec<Option<u8>> = terms
                    .iter()
                    .map(|term| Some(term.as_ref()?.texel?.1))
                    .collect();
                let channels = channels_of(&channels)
                    .ok_or_else(|| Why::new(span, "channels of a picture in another order"))?;
                let lookup = self.lookup(lookup, span)?;
                Some(Texel { lookup, channels })
            }
            None => None,
        };
        let factor = |term: &Option<Term>| term.as_ref().map_or(0.0, |term| term.factor);
        Ok(Varying {
            offset: sums.iter().map(Sum::constant_term).collect(),
            factor: terms.iter().map(factor).collect(),
            texel,
            has_vertex_color,
        })
    }

    /// The only product of a sum, if it has one.
    fn term(&self, sum: &Sum, span: Span) -> Result<Option<Term>, Why> {
        let mut products = sum.products();
        let Some((factors, factor)) = products.next() else {
            return Ok(None);
        };
        let mut term = Term {
            factor,
            texel: None,
            vertex_color: None,
        };
        for atom in factors {
            match *atom {
                Atom::Texel(lookup, channel) if term.texel.is_none() => {
                    term.texel = Some((lookup, channel));
                }
                Atom::Texel(..) => return Err(Why::new(span, "a product of texels")),
                Atom::Input(field, c)
                    if self.field(field) == "vertex_color" && term.vertex_color.is_none() =>
                {
                    term.vertex_color = Some(c);
                }
                Atom::Input(field, _) => {
                    return Err(Why::new(span, format!("`{}`", self.field(field))));
                }
                Atom::Bent(..) => return Err(Why::new(span, "components of a bent normal")),
            }
        }
        if let Some((others, _)) = products.next() {
            let other = others.iter().find_map(|atom| match *atom {
                Atom::Input(field, _) => Some(format!("`{}`", self.field(field))),
                _ => None,
            });
            let what = other.unwrap_or_else(|| "a sum of texels".to_owned());
            return Err(Why::new(span, what));
        }
        Ok(Some(term))
    }

    fn lookup(&mut self, index: u32, span: Span) -> Result<usize, Why> {
        let looked = &self.looked[index as usize];
        let place = self.place(&looked.at, span)?;
        let picture = position(&mut self.textures, looked.texture);
        let bits = |shift: i32, count: i32| ((looked.mode >> shift) & (count - 1)) as usize;
        let lookup = Lookup {
            picture,
            place,
            wrap: [bits(0, 4), bits(2, 4)],
            filter: bits(4, 4),
        };
        Ok(position(&mut self.lookups, lookup))
    }

    fn place(&self, at: &[Sum; 2], span: Span) -> Result<Place, Why> {
        let mut place = Place {
            set: 0,
            matrix: [[0.0; 2]; 2],
            offset: at.each_ref().map(Sum::constant_term),
        };
        let mut set = None;
        for (row, sum) in at.iter().enumerate() {
            for (factors, coefficient) in sum.products() {
                let &[Atom::Input(field, c)] = factors else {
                    return Err(Why::new(span, "a place in a picture that is computed"));
                };
                let own = ["uv", "uv1"].iter().position(|n| *n == self.field(field));
                if own.is_none() || set.is_some_and(|set| Some(set) != own) {
                    let name = self.field(field);
                    let what = format!("a place in a picture that depends on `{name}`");
                    return Err(Why::new(span, what));
                }
                set = own;
                place.matrix[row][usize::from(c)] = coefficient;
            }
        }
        place.set = set.unwrap_or(0) as u8;
        Ok(place)
    }

    fn field(&self, index: u32) -> &'e str {
        let field = self.fields.get(index as usize);
        field.map_or("the surface", |(name, _)| name.as_str())
    }
}

/// A product of a number with a channel of a lookup, and with a component of the vertex color.
struct Term {
    factor: f64,
    texel: Option<(u32, u8)>,
    vertex_color: Option<u8>,
}

impl Atom {
    /// The same of another component.
    fn component(self, c: u8) -> Self {
        match self {
            Atom::Input(field, _) => Atom::Input(field, c),
            Atom::Texel(lookup, _) => Atom::Texel(lookup, c),
            Atom::Bent(index, _) => Atom::Bent(index, c),
        }
    }
}

/// The first component of an input or a bent normal whose three components `sums` are, as they are.
fn direction(sums: &[Sum]) -> Option<Atom> {
    let [first, ..] = sums else { return None };
    let (&[atom], _) = first.products().next()? else {
        return None;
    };
    let is_direction = matches!(atom, Atom::Bent(..) | Atom::Input(..)) && sums.len() == 3;
    let own = |(c, sum): (usize, &Sum)| *sum == Sum::atom(atom.component(c as u8));
    (is_direction && sums.iter().enumerate().all(own)).then_some(atom)
}

/// The channels that components are; none of a component that is nothing.
fn channels_of(channels: &[Option<u8>]) -> Option<Channels> {
    let in_order = |first: u8| {
        let mut each = channels.iter().zip(first..);
        channels.len() == 3 && each.all(|(own, c)| own.is_none_or(|own| own == c))
    };
    if in_order(COLOR) {
        return Some(Channels::Color);
    }
    if in_order(0) {
        return Some(Channels::Data);
    }
    let mut given = channels.iter().flatten();
    let first = *given.next()?;
    given
        .all(|c| *c == first)
        .then_some(match first.checked_sub(COLOR) {
            Some(channel) => Channels::OneOfColor(channel),
            None => Channels::One(first),
        })
}

/// The place of an entry in a list, which is added if it is new.
fn position<T: PartialEq>(list: &mut Vec<T>, entry: T) -> usize {
    let found = list.iter().position(|own| *own == entry);
    found.unwrap_or_else(|| {
        list.push(entry);
        list.len() - 1
    })
}
