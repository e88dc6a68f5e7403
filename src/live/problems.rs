//! What is wrong, as a window lists it.

use impasto_compiler::diag::{self, Diagnostic, Severity};
use impasto_compiler::source::SourceMap;
use impasto_runtime::error::{RuntimeError, SceneError};
use impasto_viewer::engine::Problem;

/// What the compiler has to say.
pub(super) fn of_sources(sources: &SourceMap, diagnostics: &[Diagnostic]) -> Vec<Problem> {
    let problem = |d: &Diagnostic| Problem {
        is_warning: d.code.severity() != Severity::Error,
        code: Some(d.code.id().to_owned()),
        message: d.message.clone(),
        place: d.span.map(|span| {
            let (line, column) = sources.line_column(span);
            let name = sources.file(span.file).name.clone();
            (name, line as u32, column as u32)
        }),
        text: diag::render::text(sources, std::slice::from_ref(d), false),
    };
    let ordered = diag::render::ordered(sources, diagnostics);
    ordered.iter().map(problem).collect()
}

/// What is wrong with a scene.
pub(super) fn of_scene(error: &SceneError) -> Problem {
    let place = error.path.as_ref().map(|path| {
        let number = |n: Option<usize>| n.map_or(1, |n| n as u32);
        let path = path.display().to_string();
        (path, number(error.line), number(error.column))
    });
    Problem {
        is_warning: false,
        code: None,
        message: error.message.clone(),
        place,
        text: error.to_string(),
    }
}

/// What is odd about a scene.
pub(super) fn warning(message: &str) -> Problem {
    Problem {
        is_warning: true,
        code: None,
        message: message.to_owned(),
        place: None,
        text: format!("warning: {message}"),
    }
}

/// What keeps the device from rendering.
pub(super) fn of_render(error: &RuntimeError) -> Problem {
    match error {
        RuntimeError::Scene(error) => of_scene(error),
        error => of_order_as(error.to_string(), false),
    }
}

/// Why an order is not followed.
pub(super) fn of_order(why: String) -> Problem {
    of_order_as(why, true)
}

fn of_order_as(text: String, is_warning: bool) -> Problem {
    let message = text.lines().next().unwrap_or_default().to_owned();
    Problem {
        is_warning,
        code: None,
        message,
        place: None,
        text,
    }
}

/// Is one of them an error?
pub(super) fn has_errors(problems: &[Problem]) -> bool {
    problems.iter().any(|problem| !problem.is_warning)
}
