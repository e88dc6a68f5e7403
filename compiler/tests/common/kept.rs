//! Interpreters that stay with their modules: what they make of a function when it is first called is
//! more work than to call it.

use std::any::{Any, TypeId};
use std::cell::RefCell;
use std::collections::HashMap;

use impasto_compiler::ir::Module;
use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::value::Real;

/// The address of a module, and the type of numbers.
type Key = (usize, TypeId);

thread_local! {
    static KEPT: RefCell<HashMap<Key, Box<dyn Any>>> = RefCell::default();
}

/// Lets `work` use this thread's interpreter of a module.
pub fn interpreter<F: Real + 'static, T>(
    module: &'static Module,
    work: impl FnOnce(&mut Interpreter<'static, F>) -> T,
) -> T {
    KEPT.with_borrow_mut(|kept| {
        let key = (std::ptr::from_ref(module) as usize, TypeId::of::<F>());
        let one = || Box::new(Interpreter::<F>::new(module, u64::MAX)) as Box<dyn Any>;
        let one = kept.entry(key).or_insert_with(one);
        work(one.downcast_mut().expect("an interpreter of these numbers"))
    })
}
