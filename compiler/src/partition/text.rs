//! Partitions as strings: `own:paint|binned:wood,marble|inline:*`.
//!
//! Groups are separated by `|`, the materials of a group by `,`. A form and `:` may stand before;
//! without one, a single material is own and several are mixed. `*` stands for all materials
//! that are named nowhere; `own:*` gives each of them a kernel of its own. `own/384:paint` has
//! workgroups of 384 threads.

use super::error::list;
use super::{Form, Plan, PlanError, PlanKernel};
use crate::diag::nearest;

/// The strategy that plans made from strings say they have.
pub const STRATEGY: &str = "partition";

/// The plan that `text` describes, for materials called `names`. Those of `unused` need not be
/// named.
///
/// # Errors
/// What is wrong with the text, with a hint.
pub fn parse(text: &str, names: &[String], unused: &[usize]) -> Result<Plan, PlanError> {
    let groups = text.split('|').enumerate();
    let groups = groups.map(|(i, group)| Group::parse(i + 1, group));
    let groups: Vec<Group> = groups.collect::<Result<_, _>>()?;
    let mut kernel_of = vec![None; names.len()];
    for group in &groups {
        for name in &group.names {
            place(group.number, name, names, &mut kernel_of)?;
        }
    }
    if groups.iter().filter(|g| g.rest > 0).count() > 1 || groups.iter().any(|g| g.rest > 1) {
        let error = PlanError::new("`*` stands twice in the partition");
        return Err(error.hint("it means all materials not named, which go to one group"));
    }
    let rest = (0..names.len()).filter(|m| kernel_of[*m].is_none() && !unused.contains(m));
    let rest: Vec<usize> = rest.collect();
    if !rest.is_empty() && groups.iter().all(|g| g.rest == 0) {
        let missing = list(rest.iter().map(|m| names[*m].as_str()));
        let error = PlanError::new(format!("the partition leaves out {missing}"));
        return Err(error.hint("`*` in one of the groups takes all materials that are not named"));
    }
    let mut kernels = Vec::new();
    for group in &groups {
        let named = (0..names.len()).filter(|m| kernel_of[*m] == Some(group.number));
        kernels.extend(group.kernels(named.collect(), &rest, names)?);
    }
    one_inline(&kernels)?;
    let left = unused.iter().copied().filter(|m| kernel_of[*m].is_none());
    let plan = Plan::of_kernels(STRATEGY, kernels, left.collect());
    plan.check_named(names)?;
    Ok(plan)
}

/// A plan's kernels as a string that [`parse`] takes. What is unused is left out, and a
/// megakernel reads as a wavefront that is all inline.
pub fn print(plan: &Plan, names: &[String]) -> String {
    let name = |m: &usize| names.get(*m).map_or("?", String::as_str);
    let groups = plan.kernels.iter().map(|kernel| {
        let members: Vec<&str> = kernel.materials.iter().map(name).collect();
        let workgroup = kernel.workgroup.map(|threads| format!("/{threads}"));
        let workgroup = workgroup.unwrap_or_default();
        format!("{}{workgroup}:{}", kernel.form.name(), members.join(","))
    });
    groups.collect::<Vec<_>>().join("|")
}

/// What stands between two `|`.
struct Group<'t> {
    /// Counted from 1.
    number: usize,
    form: Option<Form>,
    workgroup: Option<u32>,
    names: Vec<&'t str>,
    /// How often it says `*`.
    rest: usize,
}

impl<'t> Group<'t> {
    fn parse(number: usize, text: &'t str) -> Result<Self, PlanError> {
        let (form, members) = match text.split_once(':') {
            Some((form, members)) => (Some(form), members),
            None => (None, text),
        };
        let (form, threads) = match form.and_then(|form| form.split_once('/')) {
            Some((form, threads)) => (Some(form), Some(threads)),
            None => (form, None),
        };
        let form = form.map(|form| parse_form(number, form.trim()));
        let workgroup = threads.map(|threads| parse_threads(number, threads));
        let (form, workgroup) = (form.transpose()?, workgroup.transpose()?);
        if members.trim().is_empty() {
            let error = PlanError::new(format!("group {number} of the partition is empty"));
            return Err(error.hint("groups are separated by `|`, as in `a,b|binned:c,d|inline:*`"));
        }
        let members: Vec<&str> = members.split(',').map(str::trim).collect();
        if members.contains(&"") {
            let message = format!("group {number} of the partition has a comma too many");
            return Err(PlanError::new(message));
        }
        let (rest, names): (Vec<&str>, Vec<&str>) = members.iter().partition(|m| **m == "*");
        let rest = rest.len();
        Ok(Self {
            number,
            form,
            workgroup,
            names,
            rest,
        })
    }

    /// Its kernels, where it names `members` and `rest` are those that no group names.
    fn kernels(
        &self,
        mut members: Vec<usize>,
        rest: &[usize],
        names: &[String],
    ) -> Result<Vec<PlanKernel>, PlanError> {
        let kernel = |form, materials| PlanKernel {
            workgroup: self.workgroup,
            ..PlanKernel::new(form, materials, names)
        };
        let only_rest = members.is_empty();
        if self.rest > 0 {
            members.extend(rest);
        }
        let form = match (self.form, members.len()) {
            // `*` for what there is no more of.
            (_, 0) => return Ok(Vec::new()),
            (Some(Form::Own), _) if only_rest => {
                let each = members.into_iter().map(|m| kernel(Form::Own, vec![m]));
                return Ok(each.collect());
            }
            (Some(Form::Own), 2..) => {
                let all = self
                    .names
                    .iter()
                    .copied()
                    .chain((self.rest > 0).then_some("*"));
                let all: Vec<String> = all.map(|n| format!("own:{n}")).collect();
                let message = format!(
                    "group {} of the partition is own and has several",
                    self.number
                );
                let hint = format!(
                    "a kernel each is `{}`, one for all is `mixed:` or `binned:`",
                    all.join("|")
                );
                return Err(PlanError::new(message).hint(hint));
            }
            (Some(form), _) => form,
            (None, 1) => Form::Own,
            (None, _) => Form::Mixed,
        };
        Ok(vec![kernel(form, members)])
    }
}

fn parse_threads(number: usize, text: &str) -> Result<u32, PlanError> {
    text.trim().parse().map_err(|_| {
        let message = format!("group {number} of the partition has workgroups of `{text}`");
        PlanError::new(message).hint("a number of threads stands after `/`, as in `own/384:a`")
    })
}

fn parse_form(number: usize, name: &str) -> Result<Form, PlanError> {
    let known = || Form::all().map(Form::name);
    Form::from_name(name).ok_or_else(|| {
        let error = PlanError::new(format!(
            "group {number} of the partition has the unknown form `{name}`"
        ));
        match nearest(name, known()) {
            Some(near) => error.hint(format!("did you mean `{near}`?")),
            None => error.hint(format!("forms are {}", list(known()))),
        }
    })
}

/// Notes that group `number` has the material called `name`.
fn place(
    number: usize,
    name: &str,
    names: &[String],
    kernel_of: &mut [Option<usize>],
) -> Result<(), PlanError> {
    let m = find(name, names).map_err(|hint| {
        PlanError::new(format!(
            "the partition names `{name}`, which is no material here"
        ))
        .hint(hint)
    })?;
    match kernel_of[m].replace(number) {
        None => Ok(()),
        Some(_) => Err(
            PlanError::new(format!("the partition names `{name}` twice"))
                .hint("each material is in one group"),
        ),
    }
}

/// The material called `name`; what to say if there is none.
pub(super) fn find(name: &str, names: &[String]) -> Result<usize, String> {
    let known = || names.iter().map(String::as_str);
    known()
        .position(|n| n == name)
        .ok_or_else(|| match nearest(name, known()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("the materials are {}", list(known())),
        })
}

fn one_inline(kernels: &[PlanKernel]) -> Result<(), PlanError> {
    match kernels.iter().filter(|k| !k.form.has_queue()).count() {
        0 | 1 => Ok(()),
        _ => Err(PlanError::new("the partition has several inline groups")
            .hint("what is inline is part of one kernel, logic: make them one group, as in `inline:a,b`")),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn names() -> Vec<String> {
        ["paint", "glass", "wall", "wood", "gold"]
            .map(String::from)
            .to_vec()
    }

    #[track_caller]
    fn reads(text: &str, canonical: &str) {
        let plan = parse(text, &names(), &[]).unwrap_or_else(|e| panic!("{text}: {e}"));
        assert_eq!(plan.check_named(&names()), Ok(()), "{text}");
        assert_eq!(print(&plan, &names()), canonical, "{text}");
    }

    #[track_caller]
    fn refused(text: &str, message: &str, hint: &str) {
        let error = parse(text, &names(), &[]).expect_err(text);
        assert!(error.message().contains(message), "{text}: {error}");
        assert!(error.to_string().contains(hint), "{text}: {error}");
    }

    #[test]
    fn the_grammar_is_read() {
        let all = "paint,glass,wall,wood,gold";
        reads("*", &format!("mixed:{all}"));
        reads("binned:*", &format!("binned:{all}"));
        reads("own:*", "own:paint|own:glass|own:wall|own:wood|own:gold");
        reads(
            " gold , paint |wood|binned: wall|inline:*",
            "mixed:paint,gold|own:wood|binned:wall|inline:glass",
        );
        reads(
            "binned:wood,*|own:wall",
            "binned:paint,glass,wood,gold|own:wall",
        );
        reads(&format!("inline:{all}|*"), &format!("inline:{all}"));
        reads(
            "wood|paint,glass,wall|*",
            "own:wood|mixed:paint,glass,wall|own:gold",
        );
        reads(
            "own/384:wood|mixed / 64 :paint,glass|own/32:*",
            "own/384:wood|mixed/64:paint,glass|own/32:wall|own/32:gold",
        );
    }

    #[test]
    fn what_is_wrong_is_said() {
        refused("pant|*", "names `pant`", "did you mean `paint`?");
        refused(
            "zebra|*",
            "names `zebra`",
            "the materials are `paint`, `glass`",
        );
        refused("paint|wall,paint|*", "names `paint` twice", "one group");
        refused("paint,paint|*", "names `paint` twice", "one group");
        refused("paint|wall", "leaves out `glass`, `wood` and `gold`", "`*`");
        refused(
            "own:paint,wall|*",
            "group 1 of the partition is own",
            "`own:paint|own:wall`",
        );
        refused(
            "gold|own:paint,*",
            "group 2 of the partition is own",
            "`own:paint|own:*`",
        );
        refused(
            "paint||*",
            "group 2 of the partition is empty",
            "separated by `|`",
        );
        refused("", "group 1 of the partition is empty", "separated by `|`");
        refused(
            "binned:|*",
            "group 1 of the partition is empty",
            "separated by `|`",
        );
        refused("paint,,wall|*", "a comma too many", "");
        refused(
            "bined:paint|*",
            "unknown form `bined`",
            "did you mean `binned`?",
        );
        refused(
            "x:y:z",
            "unknown form `x`",
            "forms are `own`, `mixed`, `binned` and `inline`",
        );
        refused(
            "inline:paint|inline:*",
            "several inline groups",
            "`inline:a,b`",
        );
        refused("*|binned:*", "`*` stands twice", "one group");
        refused(
            "own/many:paint|*",
            "group 1 of the partition has workgroups of `many`",
            "`own/384:a`",
        );
        refused("own/-1:paint|*", "workgroups of `-1`", "`own/384:a`");
        refused("own/0:paint|*", "has workgroups of 0 threads", "1 to 1024");
        refused(
            "own/1025:paint|*",
            "workgroups of 1025 threads",
            "1 to 1024",
        );
        refused(
            "inline/64:paint|*",
            "is inline and has workgroups of its own",
            "part of other kernels",
        );
        refused("*,*", "`*` stands twice", "one group");
    }

    #[test]
    fn unused_materials_need_no_place() {
        let plan = parse("paint|mixed:*", &names(), &[2, 3]).expect("it fits");
        assert_eq!(print(&plan, &names()), "own:paint|mixed:glass,gold");
        assert_eq!(plan.unused, [2, 3]);
        assert_eq!(plan.check(5), Ok(()));
        let plan = parse("paint|glass|gold|wall", &names(), &[2, 3]).expect("it fits");
        assert_eq!((plan.unused.as_slice(), plan.kernels.len()), (&[3][..], 4));
    }

    proptest! {
        #[test]
        fn what_is_printed_reads_back(forms in prop::collection::vec(0..4usize, 5), groups in prop::collection::vec(0..5usize, 5)) {
            let mut kernels: Vec<(Form, Vec<usize>)> = Vec::new();
            for (group, form) in forms.into_iter().enumerate() {
                let members: Vec<usize> = (0..5).filter(|m| groups[*m] == group).collect();
                let form = match (form, members.len()) {
                    (_, 0) => continue,
                    (0, 2..) => Form::Mixed,
                    (3, _) if kernels.iter().any(|(f, _)| *f == Form::Inline) => Form::Binned,
                    (other, _) => Form::all().nth(other).expect("four forms"),
                };
                kernels.push((form, members));
            }
            let mut plan = Plan::wavefront(STRATEGY, kernels, Vec::new(), &names());
            for (at, kernel) in plan.kernels.iter_mut().enumerate() {
                kernel.workgroup = (at % 2 == 1 && kernel.form.has_queue()).then_some(96);
            }
            prop_assert_eq!(plan.check(5), Ok(()));
            let back = parse(&print(&plan, &names()), &names(), &[]);
            prop_assert_eq!(back, Ok(plan));
        }

        #[test]
        fn no_text_makes_it_panic(text in "[paintglswod,|:*/1 ]{0,40}") {
            if let Ok(plan) = parse(&text, &names(), &[]) {
                prop_assert_eq!(plan.check(5), Ok(()));
            }
        }
    }
}
