//! What NVIDIA's driver tells of its GPUs in files, and Vulkan does not: which device file each is, and its UUID.

use std::fs::{self, File};
use std::io::Read;
use std::path::Path;

use super::selection::PciAddress;

/// Where the driver keeps a folder for each GPU.
pub(super) const ROOT: &str = "/proc/driver/nvidia/gpus";

/// A GPU that the driver knows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Card {
    /// Where it is on the PCI bus.
    pub(super) pci: PciAddress,
    /// The number of its device file.
    pub(super) minor: Option<u32>,
    /// Its UUID, in small letters and without `GPU-`.
    pub(super) uuid: Option<String>,
}

/// The GPUs below a folder such as [`ROOT`], by their PCI address. What cannot be read tells nothing.
pub(super) fn cards(root: &Path) -> Vec<Card> {
    let entries = fs::read_dir(root).into_iter().flatten().flatten();
    let card = |entry: fs::DirEntry| {
        let text = head(&entry.path().join("information"));
        card(entry.file_name().to_str()?, &text)
    };
    let mut cards: Vec<Card> = entries.filter_map(card).collect();
    cards.sort_by_key(|card| card.pci);
    cards
}

/// The longest file that is read; the driver's are shorter than 1 KiB.
const MOST_BYTES: u64 = 64 << 10;

fn head(path: &Path) -> String {
    let mut bytes = Vec::new();
    if let Ok(file) = File::open(path) {
        // What was read before an error may tell enough.
        let _ = file.take(MOST_BYTES).read_to_end(&mut bytes);
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// A GPU by the name of its folder and the text in it.
fn card(folder: &str, text: &str) -> Option<Card> {
    let value = |key: &str| {
        let mut fields = text.lines().filter_map(|line| line.split_once(':'));
        let (_, value) = fields.find(|(name, _)| name.trim() == key)?;
        Some(value.trim())
    };
    let location = value("Bus Location").and_then(PciAddress::parse);
    let uuid = value("GPU UUID").filter(|uuid| !uuid.contains('?'));
    Some(Card {
        pci: location.or_else(|| PciAddress::parse(folder))?,
        minor: value("Device Minor").and_then(|minor| minor.parse().ok()),
        uuid: uuid
            .and_then(|uuid| uuid.strip_prefix("GPU-"))
            .map(str::to_ascii_lowercase),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As the driver 570 writes it.
    const TEXT: &str = "Model: \t\t NVIDIA H200\nIRQ:   \t\t 40\nGPU UUID: \t GPU-8932F937-d72c-4106-c12f-20bd9faed9f6\n\
        Video BIOS: \t 96.00.bc.00.01\nBus Type: \t PCIe\nDMA Size: \t 52 bits\nBus Location: \t 0000:00:06.0\n\
        Device Minor: \t 3\nGPU Firmware: \t 570.195.03\nGPU Excluded:\t No\n";

    #[test]
    fn a_tree_of_the_driver_is_read() {
        let root = tempfile::tempdir().expect("a folder");
        let gpu = |name: &str, text: &str| {
            fs::create_dir(root.path().join(name)).expect("a folder");
            fs::write(root.path().join(name).join("information"), text).expect("written");
        };
        gpu("0000:00:06.0", TEXT);
        // A GPU that nobody has opened yet has no UUID; the folder is its address.
        gpu(
            "0000:00:05.0",
            "GPU UUID: GPU-????????-????-????-????-????????????\nDevice Minor: x\n",
        );
        gpu("0000:00:04.0", "");
        gpu("rubbish", "\u{0}\u{1}");
        fs::create_dir(root.path().join("0000:00:03.0")).expect("a folder without a file");
        let pci = |text: &str| PciAddress::parse(text).expect("an address");
        let found = cards(root.path());
        let bare = |address: &str| Card {
            pci: pci(address),
            minor: None,
            uuid: None,
        };
        assert_eq!(
            found,
            [
                bare("0000:00:03.0"),
                bare("0000:00:04.0"),
                bare("0000:00:05.0"),
                Card {
                    pci: pci("0000:00:06.0"),
                    minor: Some(3),
                    uuid: Some("8932f937-d72c-4106-c12f-20bd9faed9f6".into()),
                },
            ]
        );
        assert_eq!(cards(&root.path().join("missing")), []);
    }
}
