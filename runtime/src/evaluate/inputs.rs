//! What is given of each item: arrays with a row an item, or one row for all. They are checked as `impasto eval` checks
//! a point, and directions are made unit vectors.

use std::borrow::Cow;
use std::fmt;

/// Something that can be given.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// Its name, that of `impasto eval --at`.
    pub name: &'static str,
    /// Numbers of an item.
    pub width: usize,
    /// What it is where nothing is given: the row of another field, or these numbers.
    otherwise: Otherwise,
    /// What its numbers must be.
    kind: Kind,
}

#[derive(Clone, Copy, Debug)]
enum Otherwise {
    Field(&'static str),
    Numbers(&'static [f32]),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// Finite numbers.
    Finite,
    /// A direction, which is made a unit vector.
    Direction,
    /// A direction or zero.
    DirectionOrZero,
    /// In [0, 1).
    Random,
    /// Above 0.
    Positive,
    /// At least 0.
    NotNegative,
    /// A whole number from 0.
    Index,
}

/// What can be given, in the order in which kernels find it.
pub const FIELDS: [Field; 14] = [
    field("position", 3, &[0.1, 0.2, 0.3], Kind::Finite),
    field("normal", 3, &[0.0, 0.0, 1.0], Kind::Direction),
    like("geometric_normal", 3, "normal", Kind::Direction),
    field("tangent", 3, &[1.0, 0.0, 0.0], Kind::DirectionOrZero),
    field("uv", 2, &[0.25, 0.75], Kind::Finite),
    field("exterior_ior", 1, &[1.0], Kind::Positive),
    field("footprint", 1, &[0.0], Kind::NotNegative),
    like("object_position", 3, "position", Kind::Finite),
    field("instance_id", 1, &[0.0], Kind::Index),
    like("uv1", 2, "uv", Kind::Finite),
    field("vertex_color", 3, &[1.0, 1.0, 1.0], Kind::Finite),
    field("wo", 3, &[0.6, 0.0, 0.8], Kind::Direction),
    field("wi", 3, &[-0.48, 0.36, 0.8], Kind::Direction),
    field("u", 4, &[0.5, 0.5, 0.5, 0.5], Kind::Random),
];

const fn field(name: &'static str, width: usize, numbers: &'static [f32], kind: Kind) -> Field {
    Field {
        name,
        width,
        otherwise: Otherwise::Numbers(numbers),
        kind,
    }
}

const fn like(name: &'static str, width: usize, other: &'static str, kind: Kind) -> Field {
    Field {
        name,
        width,
        otherwise: Otherwise::Field(other),
        kind,
    }
}

/// Words before the numbers: for each field where its numbers begin and how far apart items are; and how many items
/// there are.
pub(super) const HEADER: usize = 2 * FIELDS.len() + 2;

/// Where the header has the number of items.
pub(super) const COUNT: usize = 2 * FIELDS.len();

/// An array that is given: rows of a field's numbers, one an item or one for all.
#[derive(Clone, Debug)]
pub struct Given<'a> {
    /// The field's name.
    pub name: &'a str,
    /// Its numbers, row by row.
    pub numbers: Cow<'a, [f32]>,
}

/// Why arrays cannot be evaluated.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputError(String);

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for InputError {}

/// Checked inputs of some items.
#[derive(Clone, Debug)]
pub struct Inputs {
    items: usize,
    /// Of each field its numbers, and whether they are the same for all items.
    fields: Vec<(Vec<f32>, bool)>,
}

impl Inputs {
    /// Checks what is given for so many items. Whatever is not given has the value that `impasto eval` shows.
    ///
    /// # Errors
    /// The first array that is none of a field, has another length, or holds what the field cannot be.
    pub fn new(items: usize, given: Vec<Given<'_>>) -> Result<Self, InputError> {
        let mut found: [Option<(Vec<f32>, bool)>; FIELDS.len()] = Default::default();
        for Given { name, numbers } in given {
            let Some(index) = FIELDS.iter().position(|field| field.name == name) else {
                let known: Vec<&str> = FIELDS.iter().map(|field| field.name).collect();
                let known = known.join(", ");
                return Err(InputError(format!(
                    "there is no input `{name}`; the inputs are {known}"
                )));
            };
            let field = &FIELDS[index];
            let rows = numbers.len() / field.width;
            if numbers.len() % field.width != 0 || (rows != items && rows != 1) {
                let (width, count) = (field.width, numbers.len());
                return Err(InputError(format!(
                    "`{name}` has {count} numbers: expected {width} an item of {items}, or {width} for all"
                )));
            }
            let mut numbers = numbers.into_owned();
            for (row, numbers) in numbers.chunks_exact_mut(field.width).enumerate() {
                check(field, row, numbers)?;
            }
            found[index] = Some((numbers, rows == 1));
        }
        let fields = (0..FIELDS.len()).map(|index| value(&found, index));
        Ok(Self {
            items,
            fields: fields.collect(),
        })
    }

    /// How many items there are.
    pub fn items(&self) -> usize {
        self.items
    }

    /// The words that a kernel reads for some items: the header, and the numbers as bits.
    pub(super) fn words(&self, first: usize, count: usize) -> Vec<u32> {
        let mut words = vec![0; HEADER];
        for (index, ((numbers, same), field)) in self.fields.iter().zip(&FIELDS).enumerate() {
            words[2 * index] = words.len() as u32;
            words[2 * index + 1] = if *same { 0 } else { field.width as u32 };
            let part = if *same {
                &numbers[..]
            } else {
                &numbers[first * field.width..(first + count) * field.width]
            };
            words.extend(part.iter().map(|number| number.to_bits()));
        }
        words[COUNT] = count as u32;
        words
    }
}

/// The numbers of a field: those given, or what stands for them.
fn value(found: &[Option<(Vec<f32>, bool)>], index: usize) -> (Vec<f32>, bool) {
    match (&found[index], FIELDS[index].otherwise) {
        (Some(given), _) => given.clone(),
        (None, Otherwise::Numbers(numbers)) => (numbers.to_vec(), true),
        (None, Otherwise::Field(other)) => {
            // Fields stand behind those that they are like.
            let other = FIELDS[..index].iter().position(|f| f.name == other);
            value(found, other.unwrap_or_default())
        }
    }
}

/// Checks a row, and makes a direction a unit vector.
fn check(field: &Field, row: usize, numbers: &mut [f32]) -> Result<(), InputError> {
    let refuse = |expected: &str| {
        let (name, shown) = (field.name, &*numbers);
        Err(InputError(format!(
            "`{name}` has {shown:?} in row {row}: expected {expected}"
        )))
    };
    if !numbers.iter().all(|x| x.is_finite()) {
        return refuse("finite numbers");
    }
    let all = |holds: fn(f32) -> bool| numbers.iter().all(|x| holds(*x));
    match field.kind {
        Kind::Random if !all(|x| (0.0..1.0).contains(&x)) => refuse("numbers in [0, 1)"),
        Kind::Positive if !all(|x| x > 0.0) => refuse("a number above 0"),
        Kind::NotNegative if !all(|x| x >= 0.0) => refuse("a number of at least 0"),
        Kind::Index if !all(|x| x.fract() == 0.0 && (0.0..2e9).contains(&x)) => {
            refuse("a whole number from 0")
        }
        Kind::Direction if all(|x| x == 0.0) => refuse("a direction, which is not zero"),
        Kind::Direction | Kind::DirectionOrZero => {
            normalize(numbers);
            Ok(())
        }
        _ => Ok(()),
    }
}

/// Makes a vector one of length 1, unless it is zero. Double precision holds the squares of all floats.
fn normalize(numbers: &mut [f32]) {
    let length = numbers.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>();
    if length > 0.0 {
        let length = length.sqrt();
        let unit = |x: &mut f32| *x = (f64::from(*x) / length) as f32;
        numbers.iter_mut().for_each(unit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn given<'a>(name: &'a str, numbers: &[f32]) -> Given<'a> {
        Given {
            name,
            numbers: numbers.to_vec().into(),
        }
    }

    #[test]
    fn what_is_wrong_is_said() {
        for (name, numbers, said) in [
            ("colour", &[1.0][..], "there is no input `colour`"),
            (
                "wo",
                &[0.0, 0.0, 1.0, 0.0],
                "`wo` has 4 numbers: expected 3",
            ),
            (
                "wo",
                &[0.0; 9],
                "`wo` has 9 numbers: expected 3 an item of 2",
            ),
            (
                "wi",
                &[0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
                "in row 1: expected a direction",
            ),
            ("uv", &[0.0, f32::NAN], "expected finite numbers"),
            ("u", &[0.0, 0.5, 0.5, 1.0], "expected numbers in [0, 1)"),
            ("exterior_ior", &[0.0], "above 0"),
            ("footprint", &[-1.0], "at least 0"),
            ("instance_id", &[0.5], "a whole number"),
        ] {
            let error = Inputs::new(2, vec![given(name, numbers)]).expect_err(said);
            assert!(error.to_string().contains(said), "{error}");
        }
    }

    #[test]
    fn what_is_not_given_stands_as_impasto_eval_has_it() {
        let normals = given("normal", &[0.0, 2.0, 0.0, 3e30, 0.0, 0.0]);
        let inputs = Inputs::new(2, vec![normals]).expect("fine");
        let at = |name: &str| FIELDS.iter().position(|f| f.name == name).expect("a field");
        let unit = vec![0.0, 1.0, 0.0, 1.0, 0.0, 0.0];
        assert_eq!(inputs.fields[at("normal")], (unit.clone(), false));
        assert_eq!(inputs.fields[at("geometric_normal")], (unit, false));
        let defaults = impasto_compiler::inspect::At::default();
        let entries = defaults.entries();
        for field in FIELDS.iter().filter(|f| !f.name.contains("normal")) {
            let Some((_, numbers)) = entries.iter().find(|(name, _)| *name == field.name) else {
                continue;
            };
            let ours: Vec<f64> = inputs.fields[at(field.name)]
                .0
                .iter()
                .map(|x| f64::from(*x))
                .collect();
            let near = ours.iter().zip(numbers).all(|(a, b)| (a - b).abs() < 1e-7);
            assert!(
                near && ours.len() == numbers.len(),
                "{}: {ours:?}",
                field.name
            );
        }
    }

    #[test]
    fn a_portion_has_the_rows_of_its_items() {
        let u = given(
            "u",
            &[0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99],
        );
        let inputs = Inputs::new(3, vec![u]).expect("fine");
        let words = inputs.words(1, 2);
        let last = FIELDS.len() - 1;
        let first = words[2 * last] as usize;
        assert_eq!((words[2 * last + 1], words[COUNT]), (4, 2));
        assert_eq!(f32::from_bits(words[first]), 0.4);
        assert_eq!(words.len(), first + 8);
    }
}
