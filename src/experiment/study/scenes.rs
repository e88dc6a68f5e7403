//! The scenes of a study file: `[[scenes]]`, `[[mix]]` for mixes by name, and `[[mixes]]` for mixes by lot.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::Path;

use impasto_runtime::error::SceneError;
use impasto_runtime::scene::{Table, Value};
use impasto_scenes::mixes::{Class, Draw, Hits, MOST, Mix, Shares, draw, is_generated, kinds};

use super::read::{joined, list, name, one_of, optional};
use super::{Scene, Source};

/// The most mixes of a draw.
const MOST_MIXES: u32 = 10_000;

/// Every scene, those of mixes last.
pub(super) fn read(table: &mut Table<'_>, folder: &Path) -> Result<Vec<Scene>, SceneError> {
    let mut all: Vec<Scene> = Vec::new();
    let mut add = |scene: Scene, at: &dyn Fn(String) -> SceneError| {
        if all.iter().any(|known| known.name == scene.name) {
            return Err(at(format!("there are two scenes `{}`", scene.name))
                .hint("give one of them another `name`"));
        }
        all.push(scene);
        Ok(())
    };
    for mut entry in tables(table, "scenes")? {
        let scene = file(&mut entry, folder)?;
        add(scene, &|message| entry.error(message))?;
        entry.finish()?;
    }
    for mut entry in tables(table, "mix")? {
        let scene = named(&mut entry, folder)?;
        add(scene, &|message| entry.error(message))?;
        entry.finish()?;
    }
    for mut entry in tables(table, "mixes")? {
        let called = optional(&mut entry, "name", |v| name(v, "mixes"))?;
        let (of, samples) = drawn(&mut entry)?;
        for mut mix in draw(&of) {
            if let Some(called) = &called {
                let number = mix.name.rsplit_once('_').map_or("", |(_, number)| number);
                mix.name = format!("{called}_{number}");
            }
            add(of_mix(mix, samples), &|message| entry.error(message))?;
        }
        entry.finish()?;
    }
    Ok(all)
}

fn tables<'d>(table: &mut Table<'d>, key: &'static str) -> Result<Vec<Table<'d>>, SceneError> {
    let value = table.get(key);
    value.map_or_else(|| Ok(Vec::new()), |value| value.tables(key))
}

/// A scene file.
fn file(entry: &mut Table<'_>, folder: &Path) -> Result<Scene, SceneError> {
    let value = entry.require("file")?;
    let path = joined(folder, &value)?;
    let named = optional(entry, "name", |v| name(v, "a scene"))?;
    let of_file = || match path.file_stem().unwrap_or_default().to_string_lossy() {
        stem if stem == "scene" => {
            let folder = path.parent().and_then(Path::file_name).unwrap_or_default();
            folder.to_string_lossy().into_owned()
        }
        stem => stem.into_owned(),
    };
    let name = named.unwrap_or_else(of_file);
    let title = optional(entry, "title", |v| Ok(v.string()?.to_owned()))?;
    let family = optional(entry, "family", |v| Ok(v.string()?.to_owned()))?;
    let number = match &family {
        Some(_) => entry.require("number")?.integer(0..=u32::MAX)?,
        None => 0,
    };
    Ok(Scene {
        title: title.unwrap_or_else(|| name.clone()),
        name,
        about: about(entry)?,
        source: Source::File(path),
        samples: samples(entry)?,
        family: family.map(|family| (family, number)),
        given: optional(entry, "given", given)?.unwrap_or_default(),
        needs: optional(entry, "needs", |v| joined(folder, v))?,
    })
}

fn given(value: &Value<'_>) -> Result<BTreeMap<String, Vec<f64>>, SceneError> {
    let entries = value.table("`given`")?.named();
    let numbers = |(name, value): (&str, Value<'_>)| {
        let numbers = value.numbers();
        let numbers = numbers.ok_or_else(|| value.mismatch("a number or a list of numbers"))?;
        Ok((name.to_owned(), numbers))
    };
    entries.into_iter().map(numbers).collect()
}

fn about(entry: &mut Table<'_>) -> Result<String, SceneError> {
    let about = optional(entry, "about", |v| Ok(v.string()?.to_owned()))?;
    Ok(about.unwrap_or_default())
}

fn samples(entry: &mut Table<'_>) -> Result<Option<u32>, SceneError> {
    optional(entry, "samples", |v| v.integer(1..=1 << 24))
}

/// A mix by name.
fn named(entry: &mut Table<'_>, folder: &Path) -> Result<Scene, SceneError> {
    let name = name(&entry.require("name")?, "a mix")?;
    let value = entry.require("materials")?;
    let materials = list(&value, "a list of materials", |item| material(item, folder))?.concat();
    if materials.is_empty() || materials.len() > MOST {
        let count = materials.len();
        return Err(value.error(format!(
            "a mix has 1 to {MOST} materials, and this one {count}"
        )));
    }
    if let Some(twice) = (1..materials.len()).find(|i| materials[..*i].contains(&materials[*i])) {
        return Err(value.error(format!("the mix has `{}` twice", materials[twice])));
    }
    let hits = optional(entry, "hits", |v| {
        one_of(v, &Hits::ALL.map(|h| (h.name(), h)))
    })?;
    let shares = optional(entry, "shares", |v| {
        one_of(v, &Shares::ALL.map(|s| (s.name(), s)))
    })?;
    let mix = Mix {
        name,
        about: about(entry)?,
        hits: hits.unwrap_or(Hits::Random),
        shares: shares.unwrap_or(Shares::Even),
        materials,
    };
    Ok(of_mix(mix, samples(entry)?))
}

/// Generated materials, or the path of a file, as scenes in any folder can name it.
fn material(item: &Value<'_>, folder: &Path) -> Result<Vec<String>, SceneError> {
    let text = item.string()?;
    if let Some(count) = text.strip_prefix("kinds ") {
        let count = count.parse().ok().filter(|n| (1..=64).contains(n));
        return count
            .map(kinds)
            .ok_or_else(|| item.mismatch("`kinds N` with N from 1 to 64"));
    }
    if is_generated(text) {
        return Ok(vec![text.to_owned()]);
    }
    if !text.ends_with(".impasto") {
        return Err(item
            .error(format!("there is no generated material `{text}`"))
            .hint("generated are mtl, dots, weave, cells, lacquer, alloy, velvet, fbm_N, kind_N, spectral_N, hashes_N, wide_N, julia_N, march_N, newton_N and collatz_N; or name a file that ends in `.impasto`"));
    }
    let path = joined(folder, item)?;
    let path = std::path::absolute(&path).unwrap_or(path);
    Ok(vec![path.to_string_lossy().into_owned()])
}

/// What to draw, and the samples of renders.
fn drawn(entry: &mut Table<'_>) -> Result<(Draw, Option<u32>), SceneError> {
    let usual = Draw::default();
    let count = entry.require("count")?.integer(1..=MOST_MIXES)?;
    let draw = Draw {
        count: count as usize,
        seed: optional(entry, "seed", |v| v.integer(0..=u32::MAX))?.map_or(0, u64::from),
        materials: optional(entry, "materials", range)?.unwrap_or(usual.materials),
        hits: some(entry, "hits", Hits::ALL.map(|h| (h.name(), h)))?.unwrap_or(usual.hits),
        shares: some(entry, "shares", Shares::ALL.map(|s| (s.name(), s)))?.unwrap_or(usual.shares),
        classes: some(entry, "classes", Class::ALL.map(|c| (c.name(), c)))?
            .unwrap_or(usual.classes),
    };
    Ok((draw, samples(entry)?))
}

/// Two numbers of materials.
fn range(value: &Value<'_>) -> Result<RangeInclusive<usize>, SceneError> {
    let expected = format!("two whole numbers from 1 to {MOST}, the smaller one first");
    let numbers = value.numbers().filter(|all| all.len() == 2);
    let numbers = numbers.filter(|all| all.iter().all(|n| (1.0..=MOST as f64).contains(n)));
    let numbers = numbers.filter(|all| all[0] <= all[1] && all.iter().all(|n| n.fract() == 0.0));
    let numbers = numbers.ok_or_else(|| value.mismatch(&expected))?;
    Ok(numbers[0] as usize..=numbers[1] as usize)
}

/// A list of some of `known`.
fn some<T: Copy, const N: usize>(
    entry: &mut Table<'_>,
    key: &'static str,
    known: [(&str, T); N],
) -> Result<Option<Vec<T>>, SceneError> {
    optional(entry, key, |value| {
        let all = list(value, "a list of names", |item| one_of(item, &known))?;
        if all.is_empty() {
            return Err(value.mismatch("a list of at least one name"));
        }
        Ok(all)
    })
}

fn of_mix(mix: Mix, samples: Option<u32>) -> Scene {
    let usual = if mix.materials.len() > 8 { 24 } else { 48 };
    Scene {
        name: mix.name.clone(),
        title: mix.name.clone(),
        about: mix.about.clone(),
        samples: Some(samples.unwrap_or(usual)),
        source: Source::Mix(mix),
        family: None,
        given: BTreeMap::new(),
        needs: None,
    }
}
