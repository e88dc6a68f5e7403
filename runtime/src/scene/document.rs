//! A TOML file read strictly: every value knows its place, and keys nobody asked for are errors. Scenes are read by it,
//! and so are studies of experiments.

use std::borrow::Cow;
use std::ops::Range;
use std::path::Path;

use glam::{DVec3, Vec3};
use impasto_compiler::WrittenParam;
use impasto_compiler::diag::nearest;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::mesh::check_reach;
use crate::error::{Excerpt, SceneError};

/// The text of a TOML file.
pub struct Document<'d> {
    path: &'d Path,
    text: &'d str,
}

impl<'d> Document<'d> {
    /// The text of the file at `path`.
    pub fn new(path: &'d Path, text: &'d str) -> Self {
        Self { path, text }
    }

    /// Its tables, of which [`Table::new`] takes the outermost.
    ///
    /// # Errors
    /// If it is no TOML, with the place.
    pub fn parse(&self) -> Result<Spanned<DeTable<'d>>, SceneError> {
        DeTable::parse(self.text).map_err(|e| {
            let place = e.span().unwrap_or(0..0);
            self.error(place, format!("not valid TOML: {}", e.message()))
        })
    }

    /// An error at a byte range of the text.
    pub fn error(&self, place: Range<usize>, message: impl Into<String>) -> SceneError {
        SceneError::at(self.excerpt(place), message)
    }

    /// What stands at a byte range of the text.
    fn excerpt(&self, place: Range<usize>) -> Excerpt {
        Excerpt::new(self.path, self.text, place)
    }
}

/// A table whose keys are taken one by one; [`Table::finish`] refuses the rest.
pub struct Table<'d> {
    document: &'d Document<'d>,
    /// The table in words, such as `[camera]`.
    name: String,
    place: Range<usize>,
    entries: &'d DeTable<'d>,
    /// Values that take the place of those of the same key.
    held: Vec<(&'d str, Value<'d>)>,
    asked: Vec<&'static str>,
}

impl<'d> Table<'d> {
    /// The whole of `document`, which errors call `name`.
    pub fn new(
        document: &'d Document<'d>,
        name: impl Into<String>,
        table: &'d Spanned<DeTable<'d>>,
    ) -> Self {
        Self::at(document, name, table.span(), table.get_ref())
    }

    fn at(
        document: &'d Document<'d>,
        name: impl Into<String>,
        place: Range<usize>,
        entries: &'d DeTable<'d>,
    ) -> Self {
        Self {
            document,
            name: name.into(),
            place,
            entries,
            held: Vec::new(),
            asked: Vec::new(),
        }
    }

    /// Takes `value` for that of a key from now on.
    pub(super) fn hold(&mut self, key: &'d str, value: Value<'d>) {
        self.held.push((key, value));
    }

    /// An error about the table as a whole.
    pub fn error(&self, message: impl Into<String>) -> SceneError {
        self.document.error(self.place.clone(), message)
    }

    /// The value of an optional key.
    pub fn get(&mut self, key: &'static str) -> Option<Value<'d>> {
        self.asked.push(key);
        if let Some((_, value)) = self.held.iter().find(|(name, _)| *name == key) {
            return Some(value.clone());
        }
        let item = self.entries.get(key)?;
        Some(self.value(key, item))
    }

    /// The value of a key that must be there.
    ///
    /// # Errors
    /// If it is not, with the key that may have been meant for it.
    pub fn require(&mut self, key: &'static str) -> Result<Value<'d>, SceneError> {
        if let Some(value) = self.get(key) {
            return Ok(value);
        }
        let meant = |k: &&Spanned<Cow<str>>| nearest(k.get_ref(), [key]).is_some();
        Err(match self.unknown().find(meant) {
            Some(misspelled) => self.no_such_key(misspelled.get_ref(), misspelled.span()),
            None => self.error(format!("{} needs `{key}`", self.name)),
        })
    }

    /// All entries in the order of the file, for tables whose keys are names.
    pub fn named(&self) -> Vec<(&'d str, Value<'d>)> {
        let mut entries: Vec<_> = self.entries.iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        let value = |(key, item): (&'d Spanned<_>, _)| {
            let name: &'d Cow<str> = key.get_ref();
            let place = self.value(key.get_ref(), item);
            let value = Value {
                key: Some(key.span()),
                ..place
            };
            (name.as_ref(), value)
        };
        entries.into_iter().map(value).collect()
    }

    /// Refuses the first key that was not asked for.
    ///
    /// # Errors
    /// Its place, and what may have been meant.
    pub fn finish(self) -> Result<(), SceneError> {
        let first = self.unknown().min_by_key(|k| k.span().start);
        if let Some(key) = first {
            return Err(self.no_such_key(key.get_ref(), key.span()));
        }
        let mut held = self.held.iter();
        let unknown = held.find(|(key, _)| !self.asked.contains(key));
        unknown.map_or(Ok(()), |(key, value)| {
            Err(self.no_such_key(key, value.key.clone().unwrap_or_else(|| value.range())))
        })
    }

    /// Keys that were not asked for (yet).
    fn unknown(&self) -> impl Iterator<Item = &'d Spanned<Cow<'d, str>>> {
        let keys = self.entries.keys();
        keys.filter(|key| !self.asked.contains(&key.get_ref().as_ref()))
    }

    fn no_such_key(&self, key: &str, place: Range<usize>) -> SceneError {
        let message = format!("{} has no key `{key}`", self.name);
        let error = self.document.error(place, message);
        let known = self.asked.iter().copied();
        match nearest(key, known.clone()) {
            Some(best) => error.hint(format!("did you mean `{best}`?")),
            None => error.hint(format!("its keys are {}", list(known))),
        }
    }

    fn value(&self, key: &str, item: &'d Spanned<DeValue<'d>>) -> Value<'d> {
        Value {
            document: self.document,
            name: format!("`{key}` of {}", self.name),
            item,
            key: None,
            held: None,
        }
    }
}

/// One value with its place.
#[derive(Clone)]
pub struct Value<'d> {
    document: &'d Document<'d>,
    /// The value in words, such as `` `fov` of [camera] ``.
    name: String,
    item: &'d Spanned<DeValue<'d>>,
    /// The place of its key, if the key is a name of the scene's own.
    key: Option<Range<usize>>,
    /// The number, or the numbers of a list, that it stands for instead of what is written.
    held: Option<Vec<f64>>,
}

impl<'d> Value<'d> {
    /// A value of these numbers which errors show as this one.
    pub(super) fn holding(self, numbers: Vec<f64>) -> Self {
        Self {
            held: Some(numbers),
            ..self
        }
    }

    fn number(&self) -> Option<f64> {
        match self.held.as_deref() {
            Some([one]) => Some(*one),
            Some(_) => None,
            None => number(self.item()),
        }
    }

    /// A finite number, or a list of such.
    pub fn numbers(&self) -> Option<Vec<f64>> {
        let held = self.held.clone();
        let one = || number(self.item()).map(|x| vec![x]);
        held.or_else(one).or_else(|| numbers(self.item()))
    }

    /// An error at the value.
    pub fn error(&self, message: impl Into<String>) -> SceneError {
        self.document.error(self.item.span(), message)
    }

    /// What stands there.
    pub(super) fn excerpt(&self) -> Excerpt {
        self.document.excerpt(self.item.span())
    }

    /// Where a parameter is set.
    pub(super) fn written(&self, name: &str) -> WrittenParam {
        let value = self.item.span();
        WrittenParam {
            name: name.to_owned(),
            key: self.key.clone().unwrap_or_else(|| value.clone()),
            value,
        }
    }

    /// The bytes of the text that it takes.
    pub(super) fn range(&self) -> Range<usize> {
        self.item.span()
    }

    /// The text of the file, and the file's name.
    pub(super) fn source(&self) -> (&'d str, &'d Path) {
        (self.document.text, self.document.path)
    }

    /// `` `fov` of [camera] must be ..., but it is ... ``
    pub fn mismatch(&self, expected: &str) -> SceneError {
        let found = &self.document.text[self.item.span()];
        let shown: String = found.chars().take(40).take_while(|c| *c != '\n').collect();
        let more = if shown.len() < found.len() { "..." } else { "" };
        self.error(format!(
            "{} must be {expected}, not `{shown}{more}`",
            self.name
        ))
    }

    pub(super) fn item(&self) -> &'d DeValue<'d> {
        self.item.get_ref()
    }

    /// The items of a list.
    pub fn items(&self) -> Option<Vec<Value<'d>>> {
        // Of a part of a part the excerpt says enough.
        let whole = self.name.trim_start_matches("a part of ");
        let item = |item: &'d Spanned<DeValue<'d>>| Value {
            document: self.document,
            name: format!("a part of {whole}"),
            item,
            key: None,
            held: None,
        };
        Some(self.item().as_array()?.iter().map(item).collect())
    }

    /// A string.
    ///
    /// # Errors
    /// If it is something else; so those of what follows.
    pub fn string(&self) -> Result<&'d str, SceneError> {
        let text = self.item().as_str();
        text.ok_or_else(|| self.mismatch("a string in quotes"))
    }

    /// True or false.
    pub fn boolean(&self) -> Result<bool, SceneError> {
        let value = self.item().as_bool();
        value.ok_or_else(|| self.mismatch("true or false"))
    }

    /// An integer in `range`.
    pub fn integer(&self, range: std::ops::RangeInclusive<u32>) -> Result<u32, SceneError> {
        let (low, high) = (range.start(), range.end());
        let value = self.item().as_integer().and_then(|i| {
            let value = u32::from_str_radix(i.as_str(), i.radix()).ok()?;
            range.contains(&value).then_some(value)
        });
        value.ok_or_else(|| self.mismatch(&format!("an integer from {low} to {high}")))
    }

    /// A finite number.
    pub fn float(&self) -> Result<f32, SceneError> {
        let value = self.number().map(|v| v as f32);
        value.ok_or_else(|| self.mismatch("a finite number"))
    }

    /// A finite number for which `holds`.
    pub fn float_where(
        &self,
        expected: &str,
        holds: impl Fn(f32) -> bool,
    ) -> Result<f32, SceneError> {
        let value = self.number().map(|v| v as f32);
        value
            .filter(|&v| holds(v))
            .ok_or_else(|| self.mismatch(expected))
    }

    /// Three finite numbers: a direction, factors by axis.
    pub(crate) fn vector(&self) -> Result<Vec3, SceneError> {
        Ok(self.three_numbers()?.as_vec3())
    }

    /// Where something is, or how far an edge reaches from there, in metres. Single precision would lose
    /// what is small against its distance from the origin.
    pub(crate) fn place(&self) -> Result<DVec3, SceneError> {
        let place = self.three_numbers()?;
        let reach = place.abs().max_element();
        check_reach(&self.name, reach, |message| self.error(message))?;
        Ok(place)
    }

    fn three_numbers(&self) -> Result<DVec3, SceneError> {
        let numbers: [f64; 3] = self.array("three finite numbers, as [x, y, z]")?;
        Ok(numbers.into())
    }

    /// Linear RGB, not negative: three numbers, or one for a grey.
    pub(crate) fn rgb(&self) -> Result<Vec3, SceneError> {
        let rgb = match self.number() {
            Some(grey) => Some([grey; 3]),
            None => self.numbers().and_then(|v| v.try_into().ok()),
        };
        let rgb = rgb.filter(|rgb| rgb.iter().all(|&c| c >= 0.0));
        let expected = "a number or [r, g, b], finite and not negative";
        let rgb = rgb.ok_or_else(|| self.mismatch(expected))?;
        Ok(DVec3::from(rgb).as_vec3())
    }

    /// The table, which errors call `name`.
    pub fn table(&self, name: impl Into<String>) -> Result<Table<'d>, SceneError> {
        let entries = self.item().as_table();
        let entries = entries.ok_or_else(|| self.mismatch("a table"))?;
        Ok(Table::at(self.document, name, self.item.span(), entries))
    }

    /// The tables of `[[name]]`.
    pub fn tables(&self, name: &str) -> Result<Vec<Table<'d>>, SceneError> {
        let expected = format!("a list of tables: write [[{name}]]");
        self.list_of_tables(&format!("[[{name}]]"), &expected)
    }

    /// The tables of a list, each of which errors call `name`.
    pub fn list_of_tables(&self, name: &str, expected: &str) -> Result<Vec<Table<'d>>, SceneError> {
        let list = self.item().as_array();
        let list = list.ok_or_else(|| self.mismatch(expected))?;
        let table = |item: &'d Spanned<DeValue<'d>>| {
            let entries = item.get_ref().as_table();
            let entries = entries.ok_or_else(|| self.mismatch(expected))?;
            Ok(Table::at(self.document, name, item.span(), entries))
        };
        list.iter().map(table).collect()
    }

    /// `N` finite numbers.
    pub(super) fn array<const N: usize>(&self, expected: &str) -> Result<[f64; N], SceneError> {
        let array = self.numbers().filter(|_| self.number().is_none());
        let array = array.and_then(|v| v.try_into().ok());
        array.ok_or_else(|| self.mismatch(expected))
    }
}

/// `` `a`, `b`, `c` ``
pub(super) fn list<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let quoted: Vec<String> = names.map(|n| format!("`{n}`")).collect();
    quoted.join(", ")
}

/// A finite number in the range of `f32`.
pub(super) fn number(value: &DeValue) -> Option<f64> {
    let number: f64 = match value {
        DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()).ok()? as f64,
        DeValue::Float(f) => f.as_str().parse().ok()?,
        _ => return None,
    };
    (number as f32).is_finite().then_some(number)
}

/// An array of finite numbers.
pub(super) fn numbers(value: &DeValue) -> Option<Vec<f64>> {
    let items = value.as_array()?.iter();
    items.map(|item| number(item.get_ref())).collect()
}
