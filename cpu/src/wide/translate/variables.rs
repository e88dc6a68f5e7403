//! Variables: the value that each holds now, as far as it is known, and its cell of memory.

use super::{Inst, Translator, Value};

/// A variable, by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Variable(usize);

#[derive(Clone, Copy, Debug)]
struct Held {
    /// Its value, if no path that leads here could have changed it unseen.
    now: Option<Value>,
    /// Whether memory does not hold it yet.
    dirty: bool,
    home: Option<i32>,
    /// The lanes that it began with: others never read it.
    mask: Value,
    /// Whether it is part of an array, which is read from memory.
    array: bool,
}

#[derive(Debug, Default)]
pub(super) struct Variables {
    all: Vec<Held>,
    /// Those whose memory does not hold them.
    dirty: Vec<Variable>,
    /// In each part that may be jumped over: which changed there, and what was known of them before.
    changed: Vec<Vec<(Variable, Option<Value>, bool)>>,
}

impl Variables {
    fn add(&mut self, held: Held) -> Variable {
        self.all.push(held);
        Variable(self.all.len() - 1)
    }

    /// One that begins with a value.
    pub(super) fn begin(&mut self, value: Value, mask: Value) -> Variable {
        let variable = self.add(Held {
            now: Some(value),
            dirty: true,
            home: None,
            mask,
            array: false,
        });
        self.dirty.push(variable);
        variable
    }

    /// One that lies in memory.
    pub(super) fn in_memory(&mut self, home: i32, mask: Value) -> Variable {
        self.add(Held {
            now: None,
            dirty: false,
            home: Some(home),
            mask,
            array: false,
        })
    }

    /// An element of an array.
    pub(super) fn of_array(&mut self, home: i32, mask: Value) -> Variable {
        self.add(Held {
            now: None,
            dirty: false,
            home: Some(home),
            mask,
            array: true,
        })
    }

    /// Where it lies in memory, if it does.
    pub(super) fn home(&self, variable: Variable) -> Option<i32> {
        self.all[variable.0].home
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.all.len()
    }

    /// Nobody reads those from `first` on any more.
    pub(super) fn end(&mut self, first: usize) {
        self.dirty.retain(|variable| variable.0 < first);
        for held in &mut self.all[first..] {
            held.dirty = false;
        }
    }

    /// Something else changed it.
    pub(super) fn renew(&mut self, variable: Variable) {
        self.note(variable, true);
        self.all[variable.0].now = None;
    }

    /// All may have changed.
    pub(super) fn forget(&mut self) {
        for index in 0..self.all.len() {
            if self.all[index].now.is_some() {
                self.renew(Variable(index));
            }
        }
    }

    /// Remembers what was known of a variable before it changes, or becomes known.
    fn note(&mut self, variable: Variable, assigned: bool) {
        let now = self.all[variable.0].now;
        if let Some(changed) = self.changed.last_mut() {
            changed.push((variable, now, assigned));
        }
    }

    /// Begins a part that may be jumped over.
    pub(super) fn enter(&mut self) {
        self.changed.push(Vec::new());
    }

    /// Ends it: of what was assigned in it nothing is known.
    pub(super) fn leave(&mut self) {
        let changed = self.changed.pop().unwrap_or_default();
        for (variable, before, _) in changed.iter().rev() {
            self.all[variable.0].now = *before;
        }
        let assigned = changed.iter().filter(|(_, _, assigned)| *assigned);
        for (variable, ..) in assigned {
            if self.all[variable.0].now.is_some() {
                self.note(*variable, true);
            }
            self.all[variable.0].now = None;
        }
    }
}

impl Translator<'_> {
    /// What a variable holds.
    pub(super) fn get(&mut self, variable: Variable) -> Value {
        let held = self.variables.all[variable.0];
        if let Some(value) = held.now {
            return value;
        }
        let value = match held.home {
            Some(home) => self.load(home),
            None => self.bits(0),
        };
        if !held.array {
            self.variables.note(variable, false);
            self.variables.all[variable.0].now = Some(value);
        }
        value
    }

    /// Gives a variable a value in the present lanes.
    pub(super) fn assign(&mut self, variable: Variable, value: Value) {
        let began = self.variables.all[variable.0].mask;
        let value = if began == self.mask {
            value
        } else {
            let before = self.get(variable);
            self.select_lanes(self.mask, value, before)
        };
        self.assign_all(variable, value);
    }

    /// Gives it a value in all lanes.
    pub(super) fn assign_all(&mut self, variable: Variable, value: Value) {
        self.variables.note(variable, true);
        let held = &mut self.variables.all[variable.0];
        if held.array {
            if let Some(home) = held.home {
                self.store(home, value);
            }
            return;
        }
        held.now = Some(value);
        if !held.dirty {
            held.dirty = true;
            self.variables.dirty.push(variable);
        }
    }

    /// Brings all variables to memory.
    pub(super) fn flush(&mut self) {
        for variable in std::mem::take(&mut self.variables.dirty) {
            let held = &mut self.variables.all[variable.0];
            held.dirty = false;
            let home = *held.home.get_or_insert_with(|| self.memory.cell());
            if let Some(value) = held.now {
                self.insts.push(Inst::Store {
                    to: home,
                    from: value,
                });
            }
        }
    }
}
