//! Whether a table of stages can be made kernels of: what is wrong is said of the stage that it is wrong with,
//! before any text is composed.

use crate::error::RuntimeError;
use crate::kernels::stages::{Phase, Stage, Work};
use crate::kernels::state;

/// What a stage that casts rays gives beside its own function, for threads that take up one after another.
const RAY_FUNCTIONS: [&str; 3] = ["NAME_ray", "is_NAME_decided", "end_NAME"];

/// Fails if rows contradict each other, or a body does not do what its row says.
pub(crate) fn check(stages: &[Stage]) -> Result<(), RuntimeError> {
    // Rows before bodies: what these do is judged by all rows.
    for check in [Row::check_row, Row::check_body] {
        for (at, stage) in stages.iter().enumerate() {
            let row = Row { stages, at, stage };
            check(&row).map_err(|problem| RuntimeError::Stage {
                stage: stage.name.to_string(),
                problem,
            })?;
        }
    }
    Ok(())
}

/// A row among the others.
struct Row<'a> {
    stages: &'a [Stage],
    at: usize,
    stage: &'a Stage,
}

impl Row<'_> {
    fn check_row(&self) -> Result<(), String> {
        self.check_name()?;
        self.check_functions()?;
        self.check_order()?;
        self.check_work()
    }

    fn check_body(&self) -> Result<(), String> {
        self.check_requests()?;
        self.check_state()
    }

    fn check_name(&self) -> Result<(), String> {
        let same = self.stages.iter().filter(|s| s.name == self.stage.name);
        require(same.count() == 1, || "is in the table twice".into())
    }

    fn check_functions(&self) -> Result<(), String> {
        let of_rays = RAY_FUNCTIONS.iter().filter(|_| self.stage.casts.is_some());
        let of_rays = of_rays.map(|name| name.replace("NAME", self.stage.name));
        let mut functions = std::iter::once(self.stage.name.to_string()).chain(of_rays);
        let missing =
            functions.find(|name| !self.stage.body.text.contains(&format!("\nfn {name}(")));
        missing.map_or(Ok(()), |name| {
            Err(format!("lacks its function `{name}` in its file"))
        })
    }

    fn check_order(&self) -> Result<(), String> {
        let place = |phase| Phase::ALL.iter().position(|(p, _)| *p == phase);
        let after = &self.stages[self.at + 1..];
        let ordered = after
            .iter()
            .all(|s| place(s.phase) >= place(self.stage.phase));
        require(ordered, || {
            "comes before a stage of an earlier phase".into()
        })?;
        for name in self.stage.before {
            let found = after.iter().any(|s| s.name == *name);
            require(found, || {
                format!("is to run before `{name}`, and does not come before it in the table")
            })?;
        }
        Ok(())
    }

    fn check_work(&self) -> Result<(), String> {
        if let Work::Sort { of } = self.stage.work {
            let sorted = self.find(of).filter(|sorted| sorted.takes_rays());
            require(sorted.is_some(), || {
                format!("sorts the rays of `{of}`, which has no queue of rays")
            })?;
            return require(self.stage.before.contains(&of), || {
                format!("sorts the rays of `{of}`, and is not to run before that")
            });
        }
        let from = self.stage.work.from();
        require(!from.is_empty() || !self.stage.work.is_asked_for(), || {
            "has a queue that no stage fills".into()
        })?;
        for name in from {
            let asking = self.find(name);
            let asking =
                asking.ok_or_else(|| format!("is asked for by `{name}`, which is no stage"))?;
            require(asking.phase != self.stage.phase, || {
                format!("is asked for by `{name}`, which runs in the same phase")
            })?;
            let call = self.stage.call_of_request();
            require(asking.body.text.contains(&call), || {
                format!("is asked for by `{name}`, which never calls `{call})`")
            })?;
        }
        Ok(())
    }

    /// What the body asks for has queues that say so.
    fn check_requests(&self) -> Result<(), String> {
        for (at, prefix) in self.stage.body.text.match_indices("request_") {
            let before = self.stage.body.text[..at].chars().next_back();
            let rest = &self.stage.body.text[at + prefix.len()..];
            let end = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
            let (name, rest) = rest.split_at(end.unwrap_or(rest.len()));
            let is_call = rest.starts_with('(') && before.is_some_and(|c| c.is_whitespace());
            let listed = self.find(name).is_some_and(|asked| {
                let from = asked.work.from();
                from.contains(&self.stage.name)
            });
            require(listed || !is_call, || {
                format!("calls `request_{name}()`, and no queue of that name lists it")
            })?;
        }
        Ok(())
    }

    /// The body accesses the state that its row lists, and no other.
    fn check_state(&self) -> Result<(), String> {
        let accesses = [("load", self.stage.loads), ("store", self.stage.stores)];
        for (access, uses) in accesses {
            let listed = || uses.iter().flat_map(|(_, names)| names.iter());
            for name in listed() {
                require(state::names().any(|known| known == *name), || {
                    format!("lists `{name}`, which no field of the state is used as")
                })?;
            }
            for name in state::names() {
                let function = format!("{access}_{name}");
                let called = self.stage.body.text.contains(&format!("{function}("));
                require(called == listed().any(|n| *n == name), || {
                    if called {
                        format!("calls `{function}()`, and its row does not list `{name}`")
                    } else {
                        format!("lists `{name}`, and never calls `{function}()`")
                    }
                })?;
            }
        }
        Ok(())
    }

    fn find(&self, name: &str) -> Option<&Stage> {
        self.stages.iter().find(|s| s.name == name)
    }
}

fn require(holds: bool, problem: impl FnOnce() -> String) -> Result<(), String> {
    if holds { Ok(()) } else { Err(problem()) }
}
