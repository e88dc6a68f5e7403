//! How much is composed into a prim. A reference to what has two references to what has two again doubles with each, in a
//! file of a few lines, and whoever composes such a prim does not come to an end: so all references of all layers are
//! counted before.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::rc::Rc;

use openusd::ar::{ResolvedPath, Resolver};
use openusd::sdf::{
    FileFormat, LayerData, LayerRegistry, ListOp, Path, Payload, Reference, SpecType, Value,
};

use super::binary;
use super::resolver::Files;

/// Most sites whose opinions one prim has, and most layers.
const MOST_SITES: u64 = 20_000;
const MOST_LAYERS: usize = 2_000;

/// References in a row.
const LONGEST: usize = 100;

/// A place in a layer: its number there, and a path without variants.
type Site = (usize, String);

/// All layers that a file leads to.
pub(super) struct Arcs {
    layers: Vec<Known>,
    known: HashMap<Site, u64>,
}

/// What a layer says of others.
#[derive(Default)]
struct Known {
    /// Its sublayers and theirs, and itself.
    stack: Rc<BTreeSet<usize>>,
    sublayers: Vec<usize>,
    arcs: BTreeMap<String, Vec<Site>>,
    default_prim: String,
}

impl Arcs {
    /// Reads all layers from the root on.
    ///
    /// # Errors
    /// A layer cannot be read, or they are too many.
    pub(super) fn read(files: &Files, root: &str) -> Result<Self, String> {
        let mut numbers: HashMap<String, usize> = HashMap::from([(root.to_owned(), 0)]);
        let mut waiting = vec![root.to_owned()];
        let mut layers: Vec<Known> = Vec::new();
        let mut written: Vec<Vec<(String, Option<String>, String)>> = Vec::new();
        while let Some(identifier) = waiting.get(layers.len()).cloned() {
            let mut layer = Known::default();
            let mut arcs = Vec::new();
            if let Some((resolved, data)) = open(files, &identifier, layers.is_empty())? {
                let anchored = |asset: &str| files.create_identifier(asset, Some(&resolved));
                arcs = own(&data, &anchored, &mut layer)?;
                let sublayers = match field(&data, &Path::abs_root(), "subLayers")? {
                    Some(Value::StringVec(all)) => all.iter().map(|path| anchored(path)).collect(),
                    Some(Value::AssetPathVec(all)) => {
                        all.iter().map(|path| anchored(path)).collect()
                    }
                    _ => Vec::new(),
                };
                let number = |identifier: String| -> usize {
                    *numbers.entry(identifier.clone()).or_insert_with(|| {
                        waiting.push(identifier);
                        waiting.len() - 1
                    })
                };
                let mut number = number;
                layer.sublayers = sublayers.into_iter().map(&mut number).collect();
                for (_, target, _) in &arcs {
                    if let Some(target) = target {
                        number(target.clone());
                    }
                }
            }
            layers.push(layer);
            written.push(arcs);
            if waiting.len() > MOST_LAYERS {
                return Err(format!("it leads to more than {MOST_LAYERS} layers"));
            }
        }
        for (own, arcs) in written.into_iter().enumerate() {
            for (at, target, path) in arcs {
                let target = target.and_then(|t| numbers.get(&t).copied()).unwrap_or(own);
                let path = if path.is_empty() {
                    layers[target].default_prim.clone()
                } else {
                    path
                };
                layers[own].arcs.entry(at).or_default().push((target, path));
            }
        }
        for number in 0..layers.len() {
            let mut stack = BTreeSet::from([number]);
            let mut open = vec![number];
            while let Some(layer) = open.pop() {
                open.extend(layers[layer].sublayers.iter().filter(|s| stack.insert(**s)));
            }
            layers[number].stack = Rc::new(stack);
        }
        Ok(Self {
            layers,
            known: HashMap::new(),
        })
    }

    /// Fails if too much is composed into the prim at this path of the root.
    pub(super) fn check(&mut self, path: &str) -> Result<(), String> {
        let sites = self.sites(&(0, path.to_owned()), &mut Vec::new());
        if sites > MOST_SITES {
            return Err(format!(
                "`{path}` is composed of more than {MOST_SITES} opinions of references"
            ));
        }
        Ok(())
    }

    /// How many sites give opinions to what is here.
    fn sites(&mut self, site: &Site, above: &mut Vec<Site>) -> u64 {
        if let Some(known) = self.known.get(site) {
            return *known;
        }
        // The reader ends a circle, and a chain that is too long.
        if above.len() > LONGEST || above.contains(site) {
            return 1;
        }
        let (layer, path) = site;
        let mut targets = Vec::new();
        let stack = Rc::clone(&self.layers[*layer].stack);
        let ends = path.match_indices('/').skip(1).map(|(end, _)| end);
        for end in ends.chain([path.len()]) {
            for own in stack.iter() {
                let arcs = self.layers[*own].arcs.get(&path[..end]);
                for (target, root) in arcs.into_iter().flatten() {
                    // What inherits does so in its whole stack.
                    let target = if target == own { *layer } else { *target };
                    targets.push((target, format!("{root}{}", &path[end..])));
                }
            }
        }
        let mut sites = 1_u64;
        above.push(site.clone());
        for target in targets {
            if sites <= MOST_SITES {
                sites = sites.saturating_add(self.sites(&target, above));
            }
        }
        above.pop();
        self.known.insert(site.clone(), sites);
        sites
    }
}

fn field(data: &LayerData, path: &Path, name: &str) -> Result<Option<Value>, String> {
    let value = data.try_field(path, name).map_err(|e| e.to_string())?;
    Ok(value.map(|value| value.into_owned()))
}

/// A layer that is there; the root must be.
fn open(
    files: &Files,
    identifier: &str,
    is_root: bool,
) -> Result<Option<(ResolvedPath, LayerData)>, String> {
    let Some(resolved) = files.resolve(identifier) else {
        let why = files
            .refused()
            .unwrap_or_else(|| format!("`{identifier}` is not there"));
        return if is_root { Err(why) } else { Ok(None) };
    };
    let mut start = Vec::new();
    let opened = files.open_asset(&resolved).and_then(|asset| {
        start = crate::input::at_most(asset, binary::MAGIC.len() - 1)?;
        Ok(())
    });
    if opened.is_err() {
        return Err(files.refused().unwrap_or_default());
    }
    let id = if start.starts_with(binary::MAGIC) {
        "usdc"
    } else {
        "usda"
    };
    let format: &dyn FileFormat = LayerRegistry::find_by_id(id).ok_or("no such format")?;
    let data = format
        .read(files, &resolved)
        .map_err(|e| format!("`{}` cannot be read: {e:#}", resolved.display()))?;
    Ok(Some((resolved, data)))
}

/// The arcs that a layer has: where, to which layer if it is another, and to which path there.
fn own(
    data: &LayerData,
    anchored: &dyn Fn(&str) -> String,
    layer: &mut Known,
) -> Result<Vec<(String, Option<String>, String)>, String> {
    if let Some(Value::Token(name)) = field(data, &Path::abs_root(), "defaultPrim")? {
        layer.default_prim = format!("/{}", name.as_str().trim_start_matches('/'));
    }
    let mut arcs = Vec::new();
    for path in data.spec_paths() {
        if !matches!(
            data.spec_type(&path),
            Some(SpecType::Prim | SpecType::Variant)
        ) {
            continue;
        }
        let at = path.strip_all_variant_selections();
        let mut add = |asset: &str, target: &Path| {
            let layer = (!asset.is_empty()).then(|| anchored(asset));
            arcs.push((at.as_str().to_owned(), layer, target.as_str().to_owned()));
        };
        if let Some(Value::ReferenceListOp(list)) = field(data, &path, "references")? {
            items(&list).for_each(|r: &Reference| add(&r.asset_path, &r.prim_path));
        }
        match field(data, &path, "payload")? {
            Some(Value::PayloadListOp(list)) => {
                items(&list).for_each(|p: &Payload| add(&p.asset_path, &p.prim_path));
            }
            Some(Value::Payload(p)) => add(&p.asset_path, &p.prim_path),
            _ => {}
        }
        for name in ["inheritPaths", "specializes"] {
            if let Some(Value::PathListOp(list)) = field(data, &path, name)? {
                items(&list).for_each(|target: &Path| add("", &at.make_absolute(target)));
            }
        }
    }
    Ok(arcs)
}

fn items<T: Default + Clone + PartialEq>(list: &ListOp<T>) -> impl Iterator<Item = &T> {
    let lists = [
        &list.explicit_items,
        &list.added_items,
        &list.prepended_items,
        &list.appended_items,
    ];
    lists.into_iter().flatten()
}
