//! Forms: how the kernel of a plan treats its materials. [`Form`] names them, and one table says what
//! is to be known of each; names, queues and which forms a kernel may have follow from it.

use serde::{Deserialize, Serialize};

/// How a material kernel treats its members.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Form {
    /// One material, one queue.
    Own,
    /// A switch over one queue.
    Mixed,
    /// A queue a material and one dispatch over all of them, in which every workgroup evaluates one
    /// material.
    Binned,
    /// Evaluated where the hit is found, without a queue.
    Inline,
}

/// What is to be known of a form.
struct FormRow {
    form: Form,
    /// Its name in partition strings, plan files and reports.
    name: &'static str,
    members: Members,
    queues: Queues,
    /// Do the subgroups of a kernel evaluate several materials, one after the other?
    diverges: bool,
}

/// How many materials kernels of a form have.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Members {
    One,
    /// Of one material, the kernel would be that of [`Form::Own`].
    Several,
    Any,
}

/// The queues of a kernel.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Queues {
    None,
    One,
    OneEach,
}

/// Every form, in the order of the enum.
const FORMS: [FormRow; Form::COUNT] = [
    FormRow {
        form: Form::Own,
        name: "own",
        members: Members::One,
        queues: Queues::One,
        diverges: false,
    },
    FormRow {
        form: Form::Mixed,
        name: "mixed",
        members: Members::Several,
        queues: Queues::One,
        diverges: true,
    },
    FormRow {
        form: Form::Binned,
        name: "binned",
        members: Members::Several,
        queues: Queues::OneEach,
        diverges: false,
    },
    FormRow {
        form: Form::Inline,
        name: "inline",
        members: Members::Any,
        queues: Queues::None,
        diverges: true,
    },
];

impl Form {
    /// How many forms there are.
    pub(super) const COUNT: usize = 4;

    /// Every form.
    pub fn all() -> impl DoubleEndedIterator<Item = Form> {
        FORMS.iter().map(|row| row.form)
    }

    /// The form called `name`.
    pub fn from_name(name: &str) -> Option<Form> {
        Self::all().find(|form| form.name() == name)
    }

    fn row(self) -> &'static FormRow {
        &FORMS[self as usize]
    }

    /// Its name in partition strings, plan files and reports.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// Does a kernel of this form wait for a queue? What has none is part of the logic kernel.
    pub fn has_queue(self) -> bool {
        self.row().queues != Queues::None
    }

    /// The queues of a kernel of `members` materials.
    pub fn queues(self, members: usize) -> usize {
        match self.row().queues {
            Queues::None => 0,
            Queues::One => 1,
            Queues::OneEach => members,
        }
    }

    /// Do the subgroups of a kernel evaluate several materials, one after the other?
    pub fn diverges(self) -> bool {
        self.row().diverges
    }

    /// May a kernel have more than one material?
    pub fn takes_several(self) -> bool {
        self.row().members != Members::One
    }

    /// The forms that a kernel of `members` materials may have, each different from the others.
    pub fn of_members(members: usize) -> impl DoubleEndedIterator<Item = Form> {
        let other = if members == 1 {
            Members::Several
        } else {
            Members::One
        };
        Self::all().filter(move |form| form.row().members != other)
    }

    /// Those of them with a queue.
    pub fn queued_of_members(members: usize) -> impl DoubleEndedIterator<Item = Form> {
        Self::of_members(members).filter(|form| form.has_queue())
    }

    /// The form of a kernel that was to have this one and has `members` materials: a queue of one is the
    /// same in every form.
    pub fn with_members(self, members: usize) -> Form {
        if members == 1 && self.row().members == Members::Several {
            Form::Own
        } else {
            self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_stand_in_the_order_of_the_enum_and_are_called_as_in_files() {
        for (at, form) in Form::all().enumerate() {
            assert_eq!(form as usize, at);
            assert_eq!(Form::from_name(form.name()), Some(form));
            let written = serde_json::to_string(&form).expect("a name");
            assert_eq!(written, format!("\"{}\"", form.name()));
        }
        assert_eq!(Form::from_name("none"), None);
    }

    #[test]
    fn the_number_of_materials_leaves_some_forms() {
        use Form::{Binned, Inline, Mixed, Own};
        let of = |members| Form::of_members(members).collect::<Vec<_>>();
        assert_eq!(
            (of(1), of(3)),
            (vec![Own, Inline], vec![Mixed, Binned, Inline])
        );
        let queued = |members| Form::queued_of_members(members).collect::<Vec<_>>();
        assert_eq!((queued(1), queued(2)), (vec![Own], vec![Mixed, Binned]));
        let single = |form: Form| (form.with_members(1), form.with_members(2));
        assert_eq!(single(Mixed), (Own, Mixed));
        assert_eq!(single(Binned), (Own, Binned));
        assert_eq!(single(Inline), (Inline, Inline));
        let queues = Form::all().map(|form| form.queues(3));
        assert_eq!(queues.collect::<Vec<_>>(), [1, 1, 3, 0]);
    }
}
