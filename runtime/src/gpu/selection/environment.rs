//! What the environment says of GPUs: Slurm gives a job some by the numbers of their device files, and
//! `CUDA_VISIBLE_DEVICES` shows some of NVIDIA's, which Vulkan knows nothing of.

use super::selector::{number, uuid};
use super::{Described, Device, devices};
use crate::error::RuntimeError;

/// The variables by which Slurm says what a step or a job has, the narrower one first. The numbers are of the whole
/// machine, also where the job sees less of it.
const SLURM: [&str; 2] = ["SLURM_STEP_GPUS", "SLURM_JOB_GPUS"];
/// The variable by which programs of NVIDIA's GPUs are told which of them there are.
const CUDA: &str = "CUDA_VISIBLE_DEVICES";
/// What the order of its indices depends on.
const CUDA_ORDER: &str = "CUDA_DEVICE_ORDER";

/// Variables that say which GPUs a process may use; by default they say nothing.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Environment {
    /// The first of Slurm's variables that has a value, and the value.
    slurm: Option<(&'static str, String)>,
    cuda: Option<String>,
    /// Are indices those of PCI addresses, whatever the GPUs?
    pci_order: bool,
}

/// The devices that may render unless one is asked for by `--gpu`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Allowed {
    /// Those that are no software, in the order in which they are to be taken.
    pub(super) devices: Vec<Device>,
    /// The variable that lists them.
    pub(super) by: Option<&'static str>,
    /// What the user should know of the variables.
    pub(super) notes: Vec<String>,
}

impl Environment {
    /// That of this process.
    pub fn of_process() -> Self {
        Self::new(|name| Some(std::env::var_os(name)?.to_string_lossy().into_owned()))
    }

    /// One whose variables have the values that `get` gives.
    pub fn new(get: impl Fn(&str) -> Option<String>) -> Self {
        let set =
            |name: &'static str| Some((name, get(name)?)).filter(|(_, v)| !v.trim().is_empty());
        Self {
            slurm: SLURM.into_iter().find_map(set),
            cuda: get(CUDA),
            pci_order: get(CUDA_ORDER).is_some_and(|order| order.trim() == "PCI_BUS_ID"),
        }
    }

    /// Which devices may render.
    ///
    /// # Errors
    /// If those that are listed are not among several that there are: rendering on one of the others would take what
    /// is somebody else's.
    pub(super) fn allowed(&self, adapters: &[Described]) -> Result<Allowed, RuntimeError> {
        let all = devices(adapters);
        let hardware: Vec<Device> = all
            .into_iter()
            .filter(|d| !d.of(adapters).is_software())
            .collect();
        let mut notes = Vec::new();
        let of_slurm = self.of_slurm(adapters, &hardware, &mut notes)?;
        let of_cuda = self.of_cuda(adapters, &hardware, of_slurm.is_some(), &mut notes)?;
        let (devices, by) = match (of_slurm, of_cuda) {
            (None, None) => (best_first(hardware), None),
            (Some((name, slurm)), None) => (slurm, Some(name)),
            (None, Some(cuda)) => (cuda, Some(CUDA)),
            // A task of a job may be shown less than the job has.
            (Some((name, slurm)), Some(cuda)) => {
                let both: Vec<Device> =
                    cuda.iter().filter(|d| slurm.contains(d)).cloned().collect();
                if both.is_empty() && !cuda.is_empty() {
                    notes.push(format!(
                        "note: `{CUDA}` shows none of the GPUs that `{name}` gives, and is ignored"
                    ));
                    (slurm, Some(name))
                } else {
                    (both, Some(CUDA))
                }
            }
        };
        Ok(Allowed { devices, by, notes })
    }

    /// What Slurm gives, in its order; `None` if it says nothing that can be followed.
    fn of_slurm(
        &self,
        adapters: &[Described],
        hardware: &[Device],
        notes: &mut Vec<String>,
    ) -> Result<Option<(&'static str, Vec<Device>)>, RuntimeError> {
        let Some((name, value)) = &self.slurm else {
            return Ok(None);
        };
        let Some(minors) = minors(value) else {
            notes.push(format!(
                "note: `{name}` is `{value}`, where numbers of devices were expected, as in `0,1`; it is ignored"
            ));
            return Ok(None);
        };
        if hardware.is_empty() {
            notes.push(format!(
                "warning: `{name}` gives GPUs (`{value}`), and Vulkan shows none here"
            ));
            return Ok(None);
        }
        let of_minor = |minor: &u32| {
            let is_it = |d: &&Device| d.of(adapters).minor == Some(*minor);
            hardware.iter().find(is_it).cloned()
        };
        let given: Vec<Device> = minors.iter().filter_map(of_minor).collect();
        if !given.is_empty() {
            return Ok(Some((name, given)));
        }
        if hardware.iter().all(|d| d.of(adapters).minor.is_none()) {
            if hardware.len() > 1 {
                notes.push(format!(
                    "note: `{name}` is `{value}`, and no driver here tells the numbers of its devices; it is ignored"
                ));
            }
            return Ok(None);
        }
        if let [only] = hardware {
            let only = only.said(adapters);
            notes.push(format!(
                "note: `{name}` is `{value}`, and the only GPU that is visible is {only}"
            ));
            return Ok(None);
        }
        Err(not_here(name, value, adapters, hardware))
    }

    /// What CUDA's variable shows, and the GPUs that it does not speak of; `None` if it says nothing that can be
    /// followed.
    fn of_cuda(
        &self,
        adapters: &[Described],
        hardware: &[Device],
        slurm: bool,
        notes: &mut Vec<String>,
    ) -> Result<Option<Vec<Device>>, RuntimeError> {
        let (nvidia, others): (Vec<Device>, Vec<Device>) = hardware
            .iter()
            .cloned()
            .partition(|d| d.of(adapters).is_nvidia);
        let Some(value) = self.cuda.as_ref().filter(|_| !nvidia.is_empty()) else {
            return Ok(None);
        };
        let mut shown: Vec<Device> = Vec::new();
        let mut by_index = false;
        let mut first_is_unknown = false;
        for entry in value.split(',') {
            let found = match Entry::of(entry) {
                Some(Entry::Index(index)) => {
                    by_index = true;
                    nvidia.get(index as usize)
                }
                Some(Entry::Uuid(begin)) => {
                    let fits = |d: &&Device| {
                        let uuid = d.of(adapters).uuid.as_deref();
                        uuid.is_some_and(|uuid| uuid.starts_with(&begin))
                    };
                    let mut fitting = nvidia.iter().filter(fits);
                    fitting.next().filter(|_| fitting.next().is_none())
                }
                // What follows an entry that is none does not count, as for CUDA itself.
                None => break,
            };
            let Some(found) = found else {
                first_is_unknown = shown.is_empty();
                break;
            };
            if !shown.contains(found) {
                shown.push(found.clone());
            }
        }
        if first_is_unknown {
            return match &nvidia[..] {
                _ if slurm => Ok(None),
                [only] => {
                    let only = only.said(adapters);
                    notes.push(format!(
                        "note: `{CUDA}` is `{value}`, and the only GPU of NVIDIA's that is visible is {only}"
                    ));
                    Ok(None)
                }
                several if several.iter().all(|d| d.of(adapters).uuid.is_none()) && !by_index => {
                    notes.push(format!(
                        "note: `{CUDA}` is `{value}`, and no driver here tells UUIDs; it is ignored"
                    ));
                    Ok(None)
                }
                several => Err(not_here(CUDA, value, adapters, several)),
            };
        }
        if shown.is_empty() {
            notes.push(format!(
                "note: `{CUDA}` is `{value}`, which hides the GPUs of NVIDIA's; `--gpu` chooses one all the same"
            ));
        }
        let name = |d: &Device| d.of(adapters).name.as_str();
        let differ = nvidia.iter().any(|d| name(d) != name(&nvidia[0]));
        if by_index && differ && !self.pci_order {
            notes.push(format!(
                "note: the indices of `{CUDA}` are taken in the order of PCI addresses; CUDA orders unlike GPUs by \
                 speed unless `{CUDA_ORDER}` is `PCI_BUS_ID`"
            ));
        }
        shown.extend(best_first(others));
        Ok(Some(shown))
    }
}

/// An entry of CUDA's list.
enum Entry {
    Index(u32),
    Uuid(String),
}

impl Entry {
    fn of(text: &str) -> Option<Self> {
        let text = text.trim();
        if let Some(index) = number(text).filter(|_| !text.is_empty()) {
            return Some(Entry::Index(index));
        }
        // CUDA wants the prefix in capitals; a bare UUID is none of its entries.
        let is_uuid = text.starts_with("GPU-");
        is_uuid.then(|| uuid(text).ok().map(Entry::Uuid)).flatten()
    }
}

/// The most numbers that a list may come to.
const MOST_MINORS: usize = 4096;

/// The numbers of a list as Slurm writes them: `0,2-3`.
fn minors(list: &str) -> Option<Vec<u32>> {
    let mut all = Vec::new();
    for entry in list.split(',') {
        let (first, last) = entry.split_once('-').unwrap_or((entry, entry));
        let strictly = |text: &str| number(text.trim()).filter(|_| !text.trim().is_empty());
        let (first, last) = (strictly(first)?, strictly(last)?);
        if first > last || (last - first) as usize >= MOST_MINORS - all.len().min(MOST_MINORS) {
            return None;
        }
        all.extend(first..=last);
    }
    Some(all)
}

/// As drivers and kinds of GPUs come, where nobody lists them.
fn best_first(mut devices: Vec<Device>) -> Vec<Device> {
    devices.sort_by_key(|device| device.adapters.first().copied());
    devices
}

fn not_here(name: &str, value: &str, adapters: &[Described], found: &[Device]) -> RuntimeError {
    RuntimeError::NoAdapter {
        wanted: Some(format!("is one of those that `{name}` lists (`{value}`)")),
        found: found.iter().map(|device| device.said(adapters)).collect(),
        hint: "choose one that you may use (`--gpu`), or render on the processor (`--device cpu`)",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_slurm_are_numbers_and_ranges() {
        assert_eq!(minors("0"), Some(vec![0]));
        assert_eq!(minors("3, 0-2,7"), Some(vec![3, 0, 1, 2, 7]));
        for list in [
            "",
            ",",
            "0,",
            "-1",
            "2-1",
            "x",
            "0-",
            "GPU-1",
            "1.5",
            "\u{661}",
            "0-4294967295",
            "99999999999",
        ] {
            assert_eq!(minors(list), None, "{list}");
        }
    }
}
