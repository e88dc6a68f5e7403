//! The parts of a study file: `[[studies]]`, each of a kind.

use std::path::Path;

use impasto_compiler::partition::Strategy;
use impasto_runtime::error::SceneError;
use impasto_runtime::scene::{Table, Value as Read};
use impasto_runtime::technique::{Choice, Sampler};

use super::read::{joined, list, name, one_of, optional, strings};
use super::{Kind, Options, Part, Partition, Rates, Scene, Variant};

/// Seconds after which a measurement is given up, unless the file says otherwise.
const LIMIT: u32 = 1800;

/// Which whole renders a partition study makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Renders {
    /// None.
    None,
    /// By the chosen plan, mega and own with the smallest pool; of the scenes of `all_strategies` by every strategy with the
    /// smallest pool, and by those three with the others.
    Some,
    /// By every strategy of every scene.
    All,
}

/// The table that a page has of renders.
#[derive(Clone, Debug, PartialEq)]
pub enum Layout {
    /// A row a scene.
    Scenes(Vec<Column>),
    /// A table a family of scenes, a row a scene.
    Families(Vec<Column>),
    /// A row a variant, and a column a scene; ratios are to the first variant.
    Variants,
    /// Times of the stages of a variant, with the shares that `given` has of them.
    Stages {
        /// The variant's label.
        of: String,
        /// The name of the given numbers.
        given: Option<String>,
    },
    /// The share of lanes at work: of the megakernel of one variant, and of the stages of another.
    Lanes {
        /// The variant that is a megakernel.
        mega: String,
        /// The other.
        of: String,
    },
}

/// A column of a table of renders.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// What stands above it.
    pub head: String,
    /// What stands in it.
    pub value: Value,
    /// Is it set in bold?
    pub is_bold: bool,
}

/// What stands in a column.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Millions of paths a second of a variant.
    Rate(String),
    /// The rate of a variant over the best of others.
    Ratio(Over),
    /// The triangles of the scene.
    Triangles,
    /// A number that the scene was given.
    Given(String),
}

/// A ratio of rates.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Over {
    /// The variant.
    pub of: String,
    /// Those of which the best counts.
    pub over: Vec<String>,
}

/// A part.
pub(super) fn read(
    mut table: Table<'_>,
    scenes: &[Scene],
    before: &[Part],
    folder: &Path,
) -> Result<Part, SceneError> {
    const KINDS: [(&str, usize); 4] = [
        ("partition", 0),
        ("rates", 1),
        ("rays", 2),
        ("convergence", 3),
    ];
    let kind = one_of(&table.require("kind")?, &KINDS)?;
    let named = optional(&mut table, "name", |v| name(v, "a part"))?;
    let name = named.unwrap_or_else(|| KINDS[kind].0.to_owned());
    if before.iter().any(|part| part.name == name) {
        let error = table.error(format!("there are two parts `{name}`"));
        return Err(error.hint("give one of them another `name`"));
    }
    let about = optional(&mut table, "about", |v| Ok(v.string()?.to_owned()))?;
    let chosen = optional(&mut table, "scenes", |v| chosen(v, scenes))?;
    let chosen = chosen.unwrap_or_else(|| (0..scenes.len()).collect());
    if chosen.is_empty() {
        let error = table.error(format!("the part `{name}` has no scenes"));
        return Err(error.hint("write [[scenes]], [[mix]] or [[mixes]]"));
    }
    let limit = optional(&mut table, "limit", |v| v.integer(1..=1_000_000))?;
    let kind = match kind {
        0 => Kind::Partition(partition(&mut table, scenes, folder)?),
        1 => Kind::Rates(rates(&mut table)?),
        2 => Kind::Rays(options(&mut table)?),
        _ => Kind::Convergence(options(&mut table)?),
    };
    table.finish()?;
    Ok(Part {
        name,
        about: about.unwrap_or_default(),
        scenes: chosen,
        kind,
        limit: limit.unwrap_or(LIMIT).into(),
    })
}

/// Scenes by name; `mixes` are all mixes.
fn chosen(value: &Read<'_>, scenes: &[Scene]) -> Result<Vec<usize>, SceneError> {
    let one = |item: &Read<'_>| {
        if item.string()? == "mixes" {
            let all = 0..scenes.len();
            return Ok(all.filter(|i| scenes[*i].mix().is_some()).collect());
        }
        let known: Vec<(&str, usize)> = scenes.iter().map(|s| s.name.as_str()).zip(0..).collect();
        Ok(vec![one_of(item, &known)?])
    };
    Ok(list(value, "a list of names of scenes", one)?.concat())
}

fn options(table: &mut Table<'_>) -> Result<Options, SceneError> {
    Ok(optional(table, "options", strings)?.unwrap_or_default())
}

fn pools(value: &Read<'_>) -> Result<Vec<u32>, SceneError> {
    list(value, "a list of numbers of paths", |item| {
        item.integer(1..=1 << 30)
    })
}

fn partition(
    table: &mut Table<'_>,
    scenes: &[Scene],
    folder: &Path,
) -> Result<Partition, SceneError> {
    const RENDERS: [(&str, Renders); 3] = [
        ("none", Renders::None),
        ("some", Renders::Some),
        ("all", Renders::All),
    ];
    let given = optional(table, "pools", |value| {
        let pools = pools(value)?;
        match pools.as_slice() {
            [] => Err(value.mismatch("a list of at least one number of paths")),
            _ => Ok(pools),
        }
    })?;
    Ok(Partition {
        pools: given.unwrap_or_else(|| vec![1 << 20]),
        repetitions: optional(table, "repetitions", |v| v.integer(1..=1000))?,
        kernels: optional(table, "kernels", |v| v.integer(1..=100_000))?,
        model: optional(table, "model", |v| model(v, folder))?,
        renders: optional(table, "renders", |v| one_of(v, &RENDERS))?.unwrap_or(Renders::None),
        rounds: optional(table, "rounds", |v| v.integer(1..=99))?.unwrap_or(2),
        all_strategies: optional(table, "all_strategies", |v| chosen(v, scenes))?
            .unwrap_or_default(),
        options: options(table)?,
    })
}

/// A device profile: one that is part of the program, or a file.
fn model(value: &Read<'_>, folder: &Path) -> Result<String, SceneError> {
    let text = value.string()?;
    if !text.ends_with(".json") {
        return Ok(text.to_owned());
    }
    Ok(joined(folder, value)?.to_string_lossy().into_owned())
}

fn rates(table: &mut Table<'_>) -> Result<Rates, SceneError> {
    let mut variants = match table.get("variants") {
        Some(value) => value
            .tables("studies.variants")?
            .into_iter()
            .map(variant)
            .collect::<Result<Vec<_>, _>>()?,
        None => Vec::new(),
    };
    variants.extend(product(table)?);
    if variants.is_empty() {
        variants.push(Variant::default());
    }
    for (i, variant) in variants.iter().enumerate() {
        if variants[..i]
            .iter()
            .any(|known| known.label == variant.label)
        {
            let label = &variant.label;
            return Err(table.error(format!("there are two variants `{label}`")));
        }
    }
    let share = optional(table, "share", |v| {
        v.float_where("a number above 0 and at most 1", |x| x > 0.0 && x <= 1.0)
    })?;
    Ok(Rates {
        options: options(table)?,
        repeats: optional(table, "repeats", |v| v.integer(1..=99))?.unwrap_or(1),
        samples: optional(table, "samples", |v| v.integer(1..=1 << 24))?,
        share: share.unwrap_or(1.0).into(),
        layout: layout(table, &variants)?,
        variants,
    })
}

fn variant(mut table: Table<'_>) -> Result<Variant, SceneError> {
    let label = optional(&mut table, "label", |v| Ok(v.string()?.to_owned()))?;
    let group = optional(&mut table, "group", |v| Ok(v.string()?.to_owned()))?;
    let options = options(&mut table)?;
    table.finish()?;
    Ok(Variant {
        label: label.unwrap_or_else(|| options.join(" ")),
        group: group.unwrap_or_default(),
        options,
    })
}

/// All combinations of what `strategies`, `samplers`, `pools` and `params` list.
fn product(table: &mut Table<'_>) -> Result<Vec<Variant>, SceneError> {
    type Axis = Vec<(String, String)>;
    let mut axes: Vec<Axis> = Vec::new();
    let strategies = optional(table, "strategies", |v| {
        list(v, "a list of strategies", |item| {
            let name = item.string()?;
            Strategy::parse(name).map_err(|why| item.error(why.to_string()))?;
            Ok((name.to_owned(), format!("--strategy={name}")))
        })
    })?;
    let known = Sampler::ALL.iter().map(|(_, name, _)| (*name, *name));
    let known: Vec<(&str, &str)> = known.collect();
    let samplers = optional(table, "samplers", |v| {
        list(v, "a list of samplers", |item| {
            let name = one_of(item, &known)?;
            Ok((name.to_owned(), format!("--sampler={name}")))
        })
    })?;
    let pools = optional(table, "pools", pools)?;
    let pool = |pool: u32| (format!("pool {pool}"), format!("--pool={pool}"));
    axes.extend(strategies);
    axes.extend(samplers);
    axes.extend(pools.map(|pools| pools.into_iter().map(pool).collect()));
    if let Some(params) = table.get("params") {
        for (param, value) in params.table("`params`")?.named() {
            let values = list(&value, "a list of values", |item| match item.numbers() {
                Some(numbers) if numbers.len() == 1 => Ok(numbers[0].to_string()),
                _ => Ok(item.string()?.to_owned()),
            })?;
            let of = |value: String| {
                (
                    format!("{param} {value}"),
                    format!("--param={param}={value}"),
                )
            };
            axes.push(values.into_iter().map(of).collect());
        }
    }
    if axes.is_empty() {
        return Ok(Vec::new());
    }
    let mut all = vec![Variant::default()];
    for axis in axes {
        let with = |variant: &Variant| -> Vec<Variant> {
            let each = axis.iter().map(|(label, option)| {
                let mut new = variant.clone();
                if !new.label.is_empty() {
                    new.label += ", ";
                }
                new.label += label;
                new.options.push(option.clone());
                new
            });
            each.collect()
        };
        all = all.iter().flat_map(with).collect();
    }
    Ok(all)
}

fn layout(table: &mut Table<'_>, variants: &[Variant]) -> Result<Layout, SceneError> {
    const LAYOUTS: [(&str, usize); 5] = [
        ("scenes", 0),
        ("families", 1),
        ("variants", 2),
        ("stages", 3),
        ("lanes", 4),
    ];
    let known: Vec<(&str, &str)> = variants.iter().map(|v| (&*v.label, &*v.label)).collect();
    let label = |v: &Read<'_>| Ok(one_of(v, &known)?.to_owned());
    let given = optional(table, "layout", |v| one_of(v, &LAYOUTS))?;
    let columns = optional(table, "columns", |v| {
        let tables = v.list_of_tables("a column", "a list of tables such as { of = \"own\" }")?;
        tables
            .into_iter()
            .map(|table| column(table, &known))
            .collect()
    })?;
    let rate = |variant: &Variant| Column {
        head: variant.label.clone(),
        value: Value::Rate(variant.label.clone()),
        is_bold: false,
    };
    let columns: Vec<Column> = columns.unwrap_or_else(|| variants.iter().map(rate).collect());
    Ok(match given.unwrap_or(0) {
        0 => Layout::Scenes(columns),
        1 => Layout::Families(columns),
        2 => Layout::Variants,
        3 => Layout::Stages {
            of: label(&table.require("of")?)?,
            given: optional(table, "given", |v| Ok(v.string()?.to_owned()))?,
        },
        _ => Layout::Lanes {
            mega: label(&table.require("mega")?)?,
            of: label(&table.require("of")?)?,
        },
    })
}

fn column(mut table: Table<'_>, known: &[(&str, &str)]) -> Result<Column, SceneError> {
    let head = optional(&mut table, "head", |v| Ok(v.string()?.to_owned()))?;
    let is_bold = optional(&mut table, "bold", |v| v.boolean())?;
    let of = optional(&mut table, "of", |v| Ok(one_of(v, known)?.to_owned()))?;
    let over = optional(&mut table, "over", |v| {
        list(v, "a list of variants", |item| {
            Ok(one_of(item, known)?.to_owned())
        })
    })?;
    let given = optional(&mut table, "given", |v| Ok(v.string()?.to_owned()))?;
    let triangles = optional(&mut table, "triangles", |v| v.boolean())?.unwrap_or(false);
    let value = match (of, over, given, triangles) {
        (Some(of), Some(over), None, false) => Value::Ratio(Over { of, over }),
        (Some(of), None, None, false) => Value::Rate(of),
        (None, None, Some(given), false) => Value::Given(given),
        (None, None, None, true) => Value::Triangles,
        _ => {
            let error = table.error("a column shows one thing");
            return Err(error.hint(
                "give `of` for a rate, `of` and `over` for a ratio, `given` for a number of the scene, or `triangles = true`",
            ));
        }
    };
    table.finish()?;
    let of_value = || match &value {
        Value::Rate(of) | Value::Given(of) => of.clone(),
        Value::Ratio(ratio) => format!("{} against {}", ratio.of, ratio.over.join(", ")),
        Value::Triangles => "triangles".into(),
    };
    Ok(Column {
        head: head.unwrap_or_else(of_value),
        value,
        is_bold: is_bold.unwrap_or(false),
    })
}
