//! Which of a machine's GPUs render: what `--gpu` asks for, or else what Slurm and CUDA's variables say.
//!
//! Nothing here opens a GPU or asks a driver. Adapters are described, so that any machine can be a test, and what comes
//! of it is a place in the list of them, or an error that names those that there are by what would choose each.
//!
//! A driver may show one GPU several times, and several drivers may show the same. Those adapters are one device,
//! with one index: asking for it is not ambiguous, and the first of them that fits is taken.

mod environment;
mod selector;

use std::str::FromStr;

use crate::error::RuntimeError;

pub use environment::Environment;
pub use selector::{FORMS, PciAddress, Selector};

/// An adapter, as far as choosing one goes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Described {
    /// What its driver calls it.
    pub name: String,
    /// The interface that it is reached through.
    pub backend: String,
    /// How capable its kind is: 0 is the best, and [`Described::SOFTWARE`] a driver in software.
    pub rank: u8,
    /// Is it of NVIDIA's?
    pub is_nvidia: bool,
    /// Where it is on the PCI bus.
    pub pci: Option<PciAddress>,
    /// The number of its device file.
    pub minor: Option<u32>,
    /// Its UUID as [`Selector::Uuid`] has it.
    pub uuid: Option<String>,
}

impl Described {
    /// The rank of drivers in software.
    pub const SOFTWARE: u8 = 4;

    fn is_software(&self) -> bool {
        self.rank >= Self::SOFTWARE
    }
}

/// A device: the adapters by which it can be reached, best first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Device {
    /// Its number in the order of PCI addresses.
    pub(super) index: usize,
    /// Places in the list of adapters.
    pub(super) adapters: Vec<usize>,
}

impl Device {
    /// Its first adapter.
    fn of<'a>(&self, adapters: &'a [Described]) -> &'a Described {
        &adapters[self.adapters[0]]
    }

    /// Its name, and what chooses it alone, for people.
    fn said(&self, adapters: &[Described]) -> String {
        format!("{} (`{}`)", self.of(adapters).name, self.id(adapters))
    }

    /// What chooses it and no other: its PCI address where it has one, which stays the same whatever else is
    /// plugged in, or else its index.
    fn id(&self, adapters: &[Described]) -> Selector {
        let members = || self.adapters.iter().map(|at| &adapters[*at]);
        let pci = members().find_map(|a| a.pci);
        pci.map_or(Selector::Index(self.index as u32), Selector::Pci)
    }
}

/// The devices that adapters are of, by their index.
pub(super) fn devices(adapters: &[Described]) -> Vec<Device> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (at, adapter) in adapters.iter().enumerate() {
        let is_same = |group: &&mut Vec<usize>| {
            let ids = group
                .iter()
                .find_map(|other| by_ids(adapter, &adapters[*other]));
            ids.unwrap_or_else(|| by_name(adapter, group, adapters))
        };
        match groups.iter_mut().find(is_same) {
            Some(group) => group.push(at),
            None => groups.push(vec![at]),
        }
    }
    let pci = |group: &[usize]| group.iter().find_map(|at| adapters[*at].pci);
    groups.sort_by_key(|group| (pci(group).is_none(), pci(group)));
    let numbered = groups.into_iter().enumerate();
    numbered
        .map(|(index, adapters)| Device { index, adapters })
        .collect()
}

/// Whether two adapters are of one device, if what both tell decides it.
fn by_ids(a: &Described, b: &Described) -> Option<bool> {
    let pci = a.pci.zip(b.pci).map(|(a, b)| a == b);
    let uuid = || Some(a.uuid.as_ref()? == b.uuid.as_ref()?);
    pci.or_else(uuid)
}

/// Whether an adapter that tells too little is of a device, by its name: software is one device however often its
/// driver is listed, and through each interface the first of a name is the same device, and so is the second.
fn by_name(adapter: &Described, group: &[usize], adapters: &[Described]) -> bool {
    let mut members = group.iter().map(|at| &adapters[*at]);
    let is_called_so = members
        .clone()
        .any(|other| other.name.eq_ignore_ascii_case(&adapter.name));
    is_called_so && (adapter.is_software() || members.all(|other| other.backend != adapter.backend))
}

/// What was chosen, and what the user should know of it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Chosen {
    /// Places in the list of adapters, each of another device.
    pub adapters: Vec<usize>,
    /// Lines for people.
    pub notes: Vec<String>,
}

/// The GPU that renders: the one that `selector` asks for, or else the best that the environment leaves, which may be
/// none; software is taken only if it is asked for.
///
/// # Errors
/// If no GPU fits, or several do.
pub fn select(
    selector: Option<&Selector>,
    environment: &Environment,
    adapters: &[Described],
) -> Result<Chosen, RuntimeError> {
    if let Some(selector) = selector {
        return Ok(Chosen {
            adapters: vec![one(selector, adapters)?],
            notes: Vec::new(),
        });
    }
    let mut allowed = environment.allowed(adapters)?;
    let best = allowed.devices.first().cloned();
    let rank = |device: &Device| device.of(adapters).rank;
    let as_good = |device: &&Device| best.as_ref().is_some_and(|b| rank(b) == rank(device));
    let as_many = allowed.devices.iter().filter(as_good).count();
    if let Some(best) = best.as_ref().filter(|_| as_many > 1) {
        let given = match allowed.by {
            Some(variable) => format!("`{variable}` gives {as_many} GPUs"),
            None => format!("there are {as_many} GPUs"),
        };
        let said = best.said(adapters);
        allowed.notes.push(format!(
            "note: {given}, of which one renders: {said}; `--gpu` chooses another"
        ));
    }
    Ok(Chosen {
        adapters: best.iter().map(|device| device.adapters[0]).collect(),
        notes: allowed.notes,
    })
}

/// Which GPUs are asked for, where one is not enough: `all`, so many, or a list of what each is called.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Several {
    /// All that the environment leaves.
    All,
    /// The first of them.
    Count(usize),
    /// These.
    Each(Vec<Selector>),
}

impl FromStr for Several {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        if text.eq_ignore_ascii_case("all") {
            return Ok(Several::All);
        }
        if !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit()) {
            return match text.parse() {
                Ok(count) if count > 0 => Ok(Several::Count(count)),
                _ => Err("expected how many GPUs, from 1".into()),
            };
        }
        let each: Result<Vec<Selector>, String> = text.split(',').map(str::parse).collect();
        each.map(Several::Each)
    }
}

/// The GPUs that render together, each of them once. Software counts only where nothing else is, or by its name.
///
/// # Errors
/// If one is not there, fits several, is listed twice, or if there are fewer than asked for.
pub fn select_all(
    several: &Several,
    environment: &Environment,
    adapters: &[Described],
) -> Result<Chosen, RuntimeError> {
    if let Several::Each(selectors) = several {
        return each(selectors, adapters);
    }
    let mut allowed = environment.allowed(adapters)?;
    if adapters.iter().all(Described::is_software) {
        allowed.devices = devices(adapters);
    }
    let found = allowed.devices.len();
    let count = match several {
        Several::Count(count) => *count,
        _ => found.max(1),
    };
    if count > found {
        let wanted = match found {
            0 => "is left by what the environment says".to_owned(),
            _ => format!("is left after {found} of the {count} asked for"),
        };
        return Err(not_found(Some(wanted), &devices(adapters), adapters));
    }
    let first = allowed.devices.iter().take(count);
    Ok(Chosen {
        adapters: first.map(|device| device.adapters[0]).collect(),
        notes: allowed.notes,
    })
}

fn each(selectors: &[Selector], adapters: &[Described]) -> Result<Chosen, RuntimeError> {
    let devices = devices(adapters);
    let device_of = |adapter: &usize| devices.iter().find(|d| d.adapters.contains(adapter));
    let mut chosen: Vec<usize> = Vec::new();
    for selector in selectors {
        let adapter = one(selector, adapters)?;
        let device = device_of(&adapter);
        if chosen.iter().any(|other| device_of(other) == device) {
            return Err(RuntimeError::Setting {
                setting: "the list of GPUs",
                value: format!(
                    "`{}`",
                    selectors
                        .iter()
                        .map(Selector::to_string)
                        .collect::<Vec<_>>()
                        .join(",")
                ),
                expected: format!("each GPU once, and `{selector}` is listed before"),
            });
        }
        chosen.push(adapter);
    }
    Ok(Chosen {
        adapters: chosen,
        notes: Vec::new(),
    })
}

/// The adapter that a selector asks for.
fn one(selector: &Selector, adapters: &[Described]) -> Result<usize, RuntimeError> {
    let all = devices(adapters);
    let fitting = fitting(selector, &all, adapters);
    match &fitting[..] {
        [] => Err(not_found(Some(selector.said()), &all, adapters)),
        [(_, adapter)] => Ok(*adapter),
        several => Err(RuntimeError::SeveralAdapters {
            wanted: selector.to_string(),
            found: several.iter().map(|(d, _)| d.said(adapters)).collect(),
        }),
    }
}

/// The devices that fit, each with its first adapter that does.
fn fitting<'d>(
    selector: &Selector,
    devices: &'d [Device],
    adapters: &[Described],
) -> Vec<(&'d Device, usize)> {
    let by = |fits: &dyn Fn(&Described, usize) -> bool| -> Vec<(&'d Device, usize)> {
        let adapter_of = |device: &'d Device| {
            let mut members = device.adapters.iter().copied();
            let adapter = members.find(|at| fits(&adapters[*at], device.index));
            adapter.map(|adapter| (device, adapter))
        };
        devices.iter().filter_map(adapter_of).collect()
    };
    let found = by(&|adapter, index| selector.fits(adapter, index));
    match selector {
        Selector::Name(name) => {
            let whole = by(&|adapter, _| adapter.name.to_lowercase() == name.to_lowercase());
            if whole.is_empty() { found } else { whole }
        }
        // No machine has so many, and names do have numbers.
        Selector::Index(index) if *index >= MOST_DEVICES => {
            let number = index.to_string();
            by(&|adapter, _| adapter.name.split_whitespace().any(|word| word == number))
        }
        _ => found,
    }
}

/// Indices are below this; a larger number is a word of a name, as in `RTX 4090`.
const MOST_DEVICES: u32 = 100;

fn not_found(wanted: Option<String>, found: &[Device], adapters: &[Described]) -> RuntimeError {
    RuntimeError::NoAdapter {
        wanted,
        found: found.iter().map(|device| device.said(adapters)).collect(),
        hint: "part of a name is enough, in any case of letters; `impasto info` lists what chooses each",
    }
}

/// The ids of every adapter: the index of its device, and what is known besides.
pub(super) fn ids(adapters: &[Described]) -> Vec<super::DeviceIds> {
    let mut ids: Vec<super::DeviceIds> = adapters
        .iter()
        .map(|adapter| super::DeviceIds {
            index: 0,
            pci: adapter.pci.map(|pci| pci.to_string()),
            minor: adapter.minor,
            uuid: adapter.uuid.as_ref().map(|uuid| format!("GPU-{uuid}")),
            selector: String::new(),
        })
        .collect();
    let devices = devices(adapters);
    for device in &devices {
        let id = device.id(adapters);
        for at in &device.adapters {
            // A name is what people remember, as long as it is of one device.
            let name = Selector::Name(adapters[*at].name.clone());
            let is_unique = fitting(&name, &devices, adapters).len() == 1;
            let is_name = name.to_string().parse() == Ok(name.clone());
            let selector = if is_unique && is_name { &name } else { &id };
            ids[*at].index = device.index;
            ids[*at].selector = selector.to_string();
        }
    }
    ids
}

#[cfg(test)]
mod tests;
