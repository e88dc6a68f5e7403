//! Runs the tests of a file: which of their assertions fail, and what the parts of those were.

use crate::diag::{Code, Diagnostic};
use crate::driver::Checked;
use crate::ir::interp::Interpreter;
use crate::ir::value::Real;
use crate::sema::Test;

use super::values::Shown;
use super::{FUEL, Precision, too_long};

/// Runs a test of `checked` in single and in double precision; gives what is wrong, each assertion once.
pub fn run_test(checked: &Checked, test: &Test) -> Vec<Diagnostic> {
    let single = run::<f32>(checked, test, Precision::F32);
    if !single.is_empty() {
        return single;
    }
    run::<f64>(checked, test, Precision::F64)
}

fn run<F: Real>(checked: &Checked, test: &Test, precision: Precision) -> Vec<Diagnostic> {
    let mut run = Interpreter::<F>::new(&checked.ir, FUEL).with_parts();
    let value = match super::run::value(&mut run, &test.function, Vec::new()) {
        Ok(value) => value,
        Err(spent) => {
            let mut long = too_long(&test.title, spent);
            long.span = long.span.or(Some(test.span));
            return vec![long];
        }
    };
    let Shown::Fields(fields) = Shown::new(&value, test.function.result, &checked.ir) else {
        return Vec::new();
    };
    let mut fields = fields.into_iter().map(|(_, value)| value);
    let mut found: Vec<Diagnostic> = Vec::new();
    for assertion in &test.assertions {
        let failed = fields.next() == Some(Shown::Bool(true));
        let parts: Vec<Shown> = fields.by_ref().take(assertion.parts.len()).collect();
        // Of the turns of a loop that is unrolled, the first.
        let known = |d: &Diagnostic| d.span == Some(assertion.condition);
        if !failed || found.iter().any(known) {
            continue;
        }
        let message = format!("\"{}\" fails", test.title);
        let wrong = Diagnostic::new(Code::FailedAssertion, assertion.condition, message);
        let wrong = match precision {
            Precision::F32 => wrong,
            Precision::F64 => wrong.hint("it holds in single precision, and not in double"),
        };
        let told = assertion.parts.iter().zip(parts);
        found.push(told.fold(wrong, |d, (span, value)| d.label(*span, format!("{value}"))));
    }
    found
}
