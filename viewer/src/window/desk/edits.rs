//! Values that hands give to parameters: they are shown until the engine has taken them over, and can be taken back.

use std::sync::Arc;

use impasto_compiler::interface::Value;

use super::super::values;
use super::{Desk, Edit, UNDO, param_of};
use crate::engine::{Order, Param, ParamId};

impl Desk {
    /// The value that is shown for a parameter: a hand's, or else the engine's.
    pub fn value<'a>(&'a self, id: &ParamId, param: &'a Param) -> &'a Value {
        self.edits.get(id).map_or(&param.value, |edit| &edit.value)
    }

    /// Does a parameter have another value than the scene has?
    pub fn is_set(&self, id: &ParamId, param: &Param) -> bool {
        param.is_set || self.edits.contains_key(id)
    }

    /// Gives a parameter a value, within its limits.
    pub fn set(&mut self, id: &ParamId, value: Value) {
        let Some(before) = self.put(id, value) else {
            return;
        };
        if let Some(before) = before {
            self.undo.push((id.clone(), before));
            if self.undo.len() > UNDO {
                self.undo.remove(0);
            }
            self.redo.clear();
        }
    }

    /// Gives a value. What was there before, unless a hand already holds it; nothing if nothing changes.
    fn put(&mut self, id: &ParamId, value: Value) -> Option<Option<Value>> {
        let project = Arc::clone(&self.news.project);
        let param = param_of(&project, id)?;
        if param.is_animated || !param.interface.settable {
            return None;
        }
        let value = values::held(&param.interface, value);
        let before = self.value(id, param).clone();
        let is_held = self.edits.get(id).is_some_and(|edit| edit.is_held);
        if before == value {
            return None;
        }
        self.edits.insert(
            id.clone(),
            Edit {
                value,
                is_new: true,
                is_held: true,
                released: 0.0,
            },
        );
        Some((!is_held).then_some(before))
    }

    /// Takes the last value back.
    pub(super) fn undo(&mut self) {
        if let Some((id, value)) = self.undo.pop()
            && let Some(Some(before)) = self.put(&id, value)
        {
            self.redo.push((id, before));
        }
    }

    pub(super) fn redo(&mut self) {
        if let Some((id, value)) = self.redo.pop()
            && let Some(Some(before)) = self.put(&id, value)
        {
            self.undo.push((id, before));
        }
    }

    /// A parameter as it is written.
    pub fn reset(&mut self, id: &ParamId) {
        self.edits.remove(id);
        self.order(Order::Reset(id.clone()));
    }

    /// All of them.
    pub fn reset_all(&mut self) {
        self.edits.clear();
        self.order(Order::ResetAll);
    }

    /// How many parameters have another value than the scene has.
    pub fn count_set(&self) -> usize {
        let bindings = self.news.project.bindings.iter();
        let params = bindings.flat_map(|binding| {
            binding.params.iter().map(|param| {
                let id = ParamId {
                    binding: binding.name.clone(),
                    param: param.interface.name.clone(),
                };
                self.is_set(&id, param)
            })
        });
        params.filter(|is_set| *is_set).count()
    }
}
