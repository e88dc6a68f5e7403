//! A time model that remembers its answers. Moves offer the same kernels again and again, from each
//! start and in every round, and an answer takes longer than finding it again.

use std::cell::RefCell;
use std::collections::HashMap;

use super::super::{Form, TimeModel};

/// Asks `model` once a kernel.
pub(super) struct Remembered<'a> {
    model: &'a dyn TimeModel,
    /// Seconds by the members of the kernel, a map for each form.
    known: [RefCell<HashMap<Box<[usize]>, f64>>; Form::COUNT],
}

impl<'a> Remembered<'a> {
    pub(super) fn new(model: &'a dyn TimeModel) -> Self {
        let known = std::array::from_fn(|_| RefCell::default());
        Self { model, known }
    }
}

impl TimeModel for Remembered<'_> {
    fn seconds(&self, form: Form, members: &[usize]) -> f64 {
        let known = &self.known[form as usize];
        if let Some(seconds) = known.borrow().get(members) {
            return *seconds;
        }
        // The map is free meanwhile: a model may ask others.
        let seconds = self.model.seconds(form, members);
        known.borrow_mut().insert(members.into(), seconds);
        seconds
    }
}
