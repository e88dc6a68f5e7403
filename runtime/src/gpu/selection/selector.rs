//! What one GPU is called: the forms that `--gpu` takes, and what each of them fits.

use std::fmt;
use std::str::FromStr;

use super::Described;

/// What a GPU is asked for by.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Selector {
    /// Its place on the PCI bus: `pci:0000:00:06.0`.
    Pci(PciAddress),
    /// The beginning of its UUID, in small letters and without `GPU-`: `uuid:GPU-8932f937`.
    Uuid(String),
    /// The number of its device file: `minor:0` is `/dev/nvidia0`.
    Minor(u32),
    /// Its number in the order of PCI addresses, as `impasto info` tells it; from 100 on a word of its name.
    Index(u32),
    /// Part of its name, in any case of letters; the whole name comes before names that contain it.
    Name(String),
}

/// Where a device is on the PCI bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PciAddress {
    domain: u32,
    bus: u8,
    device: u8,
    function: u8,
}

/// The forms, for errors and help.
pub const FORMS: &str =
    "pci:0000:00:06.0, uuid:GPU-..., minor:N, an index from 0, or part of a name";

impl FromStr for Selector {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let expected = |what: &str| Err(format!("expected {what}"));
        if text.is_empty() {
            return expected(FORMS);
        }
        let (form, rest) = match text.split_once(':') {
            Some((form, rest)) => (form.trim().to_ascii_lowercase(), rest.trim()),
            None => (String::new(), text),
        };
        match form.as_str() {
            "pci" => match PciAddress::parse(rest) {
                Some(address) => Ok(Selector::Pci(address)),
                None => expected("a PCI address, as in pci:0000:00:06.0"),
            },
            "uuid" => uuid(rest).map(Selector::Uuid),
            "minor" => match number(rest) {
                Some(minor) => Ok(Selector::Minor(minor)),
                None => expected("the number of a device file, as in minor:0 for /dev/nvidia0"),
            },
            _ => bare(text),
        }
    }
}

/// What is said without its form: a number, what `nvidia-smi -L` and `lspci` print, or else a name.
fn bare(text: &str) -> Result<Selector, String> {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    if is_number(text) {
        let index = number(text).ok_or("expected an index of at most 4294967295")?;
        return Ok(Selector::Index(index));
    }
    if text
        .strip_prefix(['-', '+', '\u{2212}'])
        .is_some_and(is_number)
    {
        return Err("expected an index from 0, without a sign".into());
    }
    if let Some(address) = PciAddress::parse(text) {
        return Ok(Selector::Pci(address));
    }
    if is_uuid_prefixed(text) {
        return uuid(text).map(Selector::Uuid);
    }
    Ok(Selector::Name(text.to_owned()))
}

/// Digits alone, which Rust's own parser follows signs into.
pub(super) fn number(text: &str) -> Option<u32> {
    let digits = text.bytes().all(|b| b.is_ascii_digit());
    digits.then(|| text.parse().ok()).flatten()
}

const UUID_PREFIX: &str = "GPU-";

fn is_uuid_prefixed(text: &str) -> bool {
    let prefix = text.get(..UUID_PREFIX.len());
    prefix.is_some_and(|prefix| prefix.eq_ignore_ascii_case(UUID_PREFIX))
}

/// A UUID or the beginning of one, with or without `GPU-` before it, as it is compared.
pub(super) fn uuid(text: &str) -> Result<String, String> {
    if text.to_ascii_uppercase().starts_with("MIG-") {
        return Err(
            "instances of a partitioned GPU (MIG) cannot render, since Vulkan does not show them; \
             name the GPU itself"
                .into(),
        );
    }
    let rest = if is_uuid_prefixed(text) {
        &text[UUID_PREFIX.len()..]
    } else {
        text
    };
    let is_part = rest.bytes().all(|b| b.is_ascii_hexdigit() || b == b'-');
    if !is_part || !rest.bytes().any(|b| b.is_ascii_hexdigit()) {
        return Err("expected a UUID or its beginning, as in uuid:GPU-8932f937".into());
    }
    Ok(rest.to_ascii_lowercase())
}

impl PciAddress {
    /// `0000:00:06.0`; the domain may have more digits or be missing, and so may the function.
    pub fn parse(text: &str) -> Option<Self> {
        let hex = |text: &str, most: usize| {
            let digits = (1..=most).contains(&text.len());
            let digits = digits && text.bytes().all(|b| b.is_ascii_hexdigit());
            digits.then(|| u32::from_str_radix(text, 16).ok()).flatten()
        };
        let (place, function) = text.split_once('.').unwrap_or((text, "0"));
        let parts: Vec<&str> = place.split(':').collect();
        let (domain, bus, device) = match parts[..] {
            [domain, bus, device] => (hex(domain, 8)?, hex(bus, 2)?, hex(device, 2)?),
            [bus, device] => (0, hex(bus, 2)?, hex(device, 2)?),
            _ => return None,
        };
        let function = hex(function, 1)?;
        let is_place = device < 32 && function < 8;
        is_place.then_some(Self {
            domain,
            bus: bus as u8,
            device: device as u8,
            function: function as u8,
        })
    }
}

impl fmt::Display for PciAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            domain,
            bus,
            device,
            function,
        } = self;
        write!(f, "{domain:04x}:{bus:02x}:{device:02x}.{function}")
    }
}

/// As `--gpu` takes it.
impl fmt::Display for Selector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Selector::Pci(address) => write!(f, "pci:{address}"),
            Selector::Uuid(uuid) => write!(f, "uuid:{UUID_PREFIX}{uuid}"),
            Selector::Minor(minor) => write!(f, "minor:{minor}"),
            Selector::Index(index) => write!(f, "{index}"),
            Selector::Name(name) => f.write_str(name),
        }
    }
}

impl Selector {
    /// What a GPU that fits it does: `is called ...`.
    pub(super) fn said(&self) -> String {
        match self {
            Selector::Pci(address) => format!("has the PCI address `{address}`"),
            Selector::Uuid(uuid) => {
                format!("has a UUID that begins with `{UUID_PREFIX}{uuid}`")
            }
            Selector::Minor(minor) => format!("has the minor number {minor} (/dev/nvidia{minor})"),
            Selector::Index(index) => format!("has the index {index}"),
            Selector::Name(name) => format!("is called `{name}`"),
        }
    }

    /// Does it fit an adapter of the device with this index, or part of its name where it is a name?
    pub(super) fn fits(&self, adapter: &Described, index: usize) -> bool {
        match self {
            Selector::Pci(address) => adapter.pci == Some(*address),
            Selector::Uuid(begin) => {
                let uuid = adapter.uuid.as_deref();
                uuid.is_some_and(|uuid| uuid.starts_with(begin.as_str()))
            }
            Selector::Minor(minor) => adapter.minor == Some(*minor),
            Selector::Index(wanted) => index == *wanted as usize,
            Selector::Name(part) => contains(&adapter.name, part),
        }
    }
}

/// In any case of letters.
fn contains(name: &str, part: &str) -> bool {
    name.to_lowercase().contains(&part.to_lowercase())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<Selector, String> {
        text.parse()
    }

    #[test]
    fn every_form_is_read_and_printed() {
        for (text, printed) in [
            ("pci:0000:00:06.0", "pci:0000:00:06.0"),
            ("PCI:00000000:8A:1F.7", "pci:0000:8a:1f.7"),
            ("pci:06:00", "pci:0000:06:00.0"),
            ("0001:02:03.0", "pci:0001:02:03.0"),
            ("uuid:GPU-8932F937-d72c", "uuid:GPU-8932f937-d72c"),
            ("uuid:8932", "uuid:GPU-8932"),
            ("gpu-8932", "uuid:GPU-8932"),
            ("minor:3", "minor:3"),
            (" 1 ", "1"),
            ("007", "7"),
            ("NVIDIA H200", "NVIDIA H200"),
            ("r\u{f6}ntgen", "r\u{f6}ntgen"),
            ("intel: arc", "intel: arc"),
        ] {
            let selector = parsed(text).unwrap_or_else(|e| panic!("{text}: {e}"));
            assert_eq!(selector.to_string(), printed);
            assert_eq!(parsed(printed).as_ref(), Ok(&selector));
        }
    }

    #[test]
    fn what_is_none_of_the_forms_is_refused_with_what_was_expected() {
        for (text, expected) in [
            ("", "minor:N"),
            ("  ", "minor:N"),
            ("pci:", "PCI address"),
            ("pci:0", "PCI address"),
            ("pci:0000:00:20.0", "PCI address"),
            ("pci:0000:00:06.8", "PCI address"),
            ("pci:0000:00:06.", "PCI address"),
            ("pci:0000:000:06.0", "PCI address"),
            ("pci:00:00:00:06.0", "PCI address"),
            ("pci:+000:00:06.0", "PCI address"),
            ("pci:\u{661}:00:06.0", "PCI address"),
            ("pci:123456789:00:06.0", "PCI address"),
            ("uuid:", "UUID"),
            ("uuid:GPU-", "UUID"),
            ("uuid:--", "UUID"),
            ("uuid:GPU-xyz", "UUID"),
            ("GPU-\u{fc}", "UUID"),
            ("uuid:MIG-8932", "MIG"),
            ("minor:", "device file"),
            ("minor:-1", "device file"),
            ("minor:+1", "device file"),
            ("minor:1.5", "device file"),
            ("minor:\u{661}", "device file"),
            ("minor:4294967296", "device file"),
            ("-1", "from 0"),
            ("+1", "from 0"),
            ("\u{2212}1", "from 0"),
            ("99999999999", "4294967295"),
        ] {
            let error = parsed(text).expect_err(text);
            assert!(error.contains(expected), "{text}: {error}");
        }
    }
}
