//! Kernels that were built before, on disk: the module that naga wrote of a text, and what the driver made of it. What is
//! started again has neither to be validated and translated nor compiled.
//!
//! Each kernel is a file of its own, so that processes may share a folder: a file is written whole or not at all, and two
//! that build the same kernel write the same. A file is named by the text, the device with its driver, and the version of
//! this program. What is in a file is checked before it is used: it tells accidents apart, not forgeries; whoever can
//! write into the cache of a user can also replace the programs of that user.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::SystemTime;

use crate::fingerprint::Fingerprint;
use crate::input::reason;

/// Where kernels that were built are kept.
#[derive(Clone, Debug)]
pub struct KernelFolder {
    /// The folder; it is made when it is needed.
    pub path: PathBuf,
    /// Told once if nothing can be kept there, and once if a file of it is damaged.
    pub warn: fn(&str),
}

/// The most bytes of a folder; the oldest files go first.
const MOST_BYTES: u64 = 512 << 20;

/// What decides on the module that is written of a text, beside the version of naga.
const WRITERS: [&str; 4] = [
    env!("CARGO_PKG_VERSION"),
    include_str!("spirv.rs"),
    include_str!("shader.rs"),
    include_str!("../world/bvh/text.rs"),
];

/// What files begin with.
const MAGIC: [u8; 8] = *b"impasto\x01";

/// Words of eight bytes before the module: the magic, two fingerprints, three sizes of a workgroup, words of the module.
const HEAD: usize = 7 * 8;

/// A folder of kernels of one device.
#[derive(Debug)]
pub(super) struct Kept {
    folder: KernelFolder,
    /// What the names of files depend on beside the text.
    device: u64,
    /// Was it seen to that the folder is not too large? Only who adds to it has to.
    tidied: AtomicBool,
    warned_of_damage: AtomicBool,
    warned_of_folder: AtomicBool,
}

/// A kernel as it was built.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Built {
    /// Invocations of a workgroup by axis.
    pub workgroup: [u32; 3],
    /// The module, SPIR-V.
    pub module: Vec<u32>,
    /// What the driver made of it; empty where it tells nothing.
    pub binary: Vec<u8>,
}

/// By what a kernel is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Key {
    name: u64,
    /// Another fingerprint of the same, so that two texts by one name are told apart.
    check: u64,
}

impl Kept {
    pub fn new(folder: KernelFolder, info: &wgpu::AdapterInfo) -> Self {
        let mut device = Fingerprint::new();
        WRITERS.iter().for_each(|text| device.add(text.as_bytes()));
        device.add(&info.vendor.to_le_bytes());
        device.add(&info.device.to_le_bytes());
        for text in [&info.name, &info.driver, &info.driver_info] {
            device.add(text.as_bytes());
        }
        Self {
            folder,
            device: device.finish(),
            tidied: AtomicBool::new(false),
            warned_of_damage: AtomicBool::new(false),
            warned_of_folder: AtomicBool::new(false),
        }
    }

    /// The key of a text that is written in one of several ways.
    pub fn key(&self, wgsl: &str, way: u8) -> Key {
        let of = |salt: u8| {
            let mut fingerprint = Fingerprint::new();
            fingerprint.add(&[salt, way]);
            fingerprint.add(&self.device.to_le_bytes());
            fingerprint.add(wgsl.as_bytes());
            fingerprint.finish()
        };
        Key {
            name: of(0),
            check: of(1),
        }
    }

    /// What was built of a text. A file that cannot be read as such is as good as none.
    pub fn load(&self, key: Key) -> Option<Built> {
        let path = self.path(key);
        let bytes = std::fs::read(&path).ok()?;
        let built = read(&bytes, key);
        if built.is_none() && !self.warned_of_damage.swap(true, Relaxed) {
            let path = path.display();
            (self.folder.warn)(&format!(
                "warning: `{path}` is damaged: the kernel is built anew"
            ));
        }
        built
    }

    /// Keeps what was built, if it can.
    pub fn store(&self, key: Key, built: &Built) {
        if !self.tidied.swap(true, Relaxed) {
            self.tidy();
        }
        let replaced = self.replace(&self.path(key), &written(built, key));
        if let Err(why) = replaced
            && !self.warned_of_folder.swap(true, Relaxed)
        {
            let (folder, why) = (self.folder.path.display(), reason(&why));
            (self.folder.warn)(&format!(
                "warning: kernels are not kept for the next start in `{folder}`: {why}"
            ));
        }
    }

    /// Writes a file whole. That it outlives a power cut is not worth the wait: then it is damaged, and written anew.
    fn replace(&self, path: &Path, bytes: &[u8]) -> std::io::Result<()> {
        let folder = &self.folder.path;
        std::fs::create_dir_all(folder)?;
        // By its ending, one that a process left behind that was killed is tidied away like others.
        let mut file = tempfile::Builder::new()
            .suffix(".kernel")
            .tempfile_in(folder)?;
        file.write_all(bytes)?;
        file.persist(path).map_err(|why| why.error)?;
        Ok(())
    }

    fn path(&self, key: Key) -> PathBuf {
        self.folder.path.join(format!("{:016x}.kernel", key.name))
    }

    /// Removes what is oldest where there is too much.
    fn tidy(&self) {
        let Ok(entries) = std::fs::read_dir(&self.folder.path) else {
            return;
        };
        let of = |entry: std::fs::DirEntry| {
            let about = entry.metadata().ok()?;
            Some((about.modified().ok()?, about.len(), entry.path()))
        };
        let mut all: Vec<(SystemTime, u64, PathBuf)> = entries.flatten().filter_map(of).collect();
        let mut bytes: u64 = all.iter().map(|(_, bytes, _)| bytes).sum();
        if bytes <= MOST_BYTES {
            return;
        }
        all.sort();
        for (_, size, path) in all {
            if bytes <= MOST_BYTES / 2 {
                return;
            }
            if is_kernel(&path) && std::fs::remove_file(&path).is_ok() {
                bytes -= size;
            }
        }
    }
}

fn is_kernel(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "kernel")
}

/// A kernel as a file.
fn written(built: &Built, key: Key) -> Vec<u8> {
    let mut rest: Vec<u8> = Vec::with_capacity(4 * built.module.len() + built.binary.len());
    rest.extend_from_slice(bytemuck::cast_slice(&built.module));
    rest.extend_from_slice(&built.binary);
    let [x, y, z] = built.workgroup.map(u64::from);
    let sizes = [x, y, z, built.module.len() as u64];
    let magic = u64::from_le_bytes(MAGIC);
    let head = [magic, key.check, sum(sizes, &rest)]
        .into_iter()
        .chain(sizes);
    let mut bytes = Vec::with_capacity(HEAD + rest.len());
    head.for_each(|word| bytes.extend(word.to_le_bytes()));
    bytes.append(&mut rest);
    bytes
}

/// A fingerprint of all that is in a file behind it.
fn sum(sizes: [u64; 4], rest: &[u8]) -> u64 {
    let mut sum = Fingerprint::new();
    sum.add(bytemuck::cast_slice(&sizes.map(u64::to_le)));
    sum.add(rest);
    sum.finish()
}

/// A kernel of a file; none if it is not whole, or another one.
fn read(bytes: &[u8], key: Key) -> Option<Built> {
    let (head, rest) = bytes.split_at_checked(HEAD)?;
    let (words, _) = head.as_chunks::<8>();
    let word = |at: usize| words.get(at).map(|word| u64::from_le_bytes(*word));
    let sizes = [word(3)?, word(4)?, word(5)?, word(6)?];
    let is_whole = word(0)?.to_le_bytes() == MAGIC && word(2)? == sum(sizes, rest);
    if !is_whole || word(1)? != key.check {
        return None;
    }
    let [x, y, z] = [0, 1, 2].map(|axis| sizes[axis] as u32);
    let length = usize::try_from(sizes[3]).ok()?.checked_mul(4)?;
    let (module, binary) = rest.split_at_checked(length)?;
    let (module, _) = module.as_chunks::<4>();
    Some(Built {
        workgroup: [x, y, z],
        module: module
            .iter()
            .map(|word| u32::from_le_bytes(*word))
            .collect(),
        binary: binary.to_vec(),
    })
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicUsize;

    use super::*;

    static WARNED: AtomicUsize = AtomicUsize::new(0);

    fn kept(path: &Path, driver: &str) -> Kept {
        let warn: fn(&str) = |_| {
            WARNED.fetch_add(1, Relaxed);
        };
        let path = path.to_owned();
        let info = wgpu::AdapterInfo {
            driver_info: driver.into(),
            ..info()
        };
        Kept::new(KernelFolder { path, warn }, &info)
    }

    fn info() -> wgpu::AdapterInfo {
        wgpu::AdapterInfo::new(wgpu::DeviceType::Other, wgpu::Backend::Vulkan)
    }

    fn built() -> Built {
        Built {
            workgroup: [256, 1, 1],
            module: vec![0x0723_0203, 7, 9],
            binary: vec![1, 2, 3],
        }
    }

    #[test]
    fn what_is_kept_is_found_by_the_same_text_device_and_way_alone() {
        let folder = tempfile::tempdir().expect("a folder");
        let here = folder.path().join("deep/kernels");
        let first = kept(&here, "1.0");
        let key = first.key("text", 0);
        assert_eq!(first.load(key), None);
        first.store(key, &built());
        let again = kept(&here, "1.0");
        assert_eq!(again.load(again.key("text", 0)), Some(built()));
        let others = [("1.0", "text", 1), ("1.0", "texts", 0), ("1.1", "text", 0)];
        for (driver, text, way) in others {
            let other = kept(&here, driver);
            assert_eq!(
                other.load(other.key(text, way)),
                None,
                "{driver} {text} {way}"
            );
        }
    }

    #[test]
    fn files_that_are_damaged_are_no_kernels_and_folders_that_cannot_be_written_no_errors() {
        let folder = tempfile::tempdir().expect("a folder");
        let whole = kept(folder.path(), "1.0");
        let key = whole.key("text", 0);
        whole.store(key, &built());
        let path = whole.path(key);
        let good = std::fs::read(&path).expect("a file");
        for at in 0..good.len() {
            let mut bad = good.clone();
            bad[at] ^= 4;
            assert_eq!(read(&bad, key), None, "byte {at}");
            assert_eq!(read(&good[..at], key), None, "{at} bytes");
        }
        let before = WARNED.load(Relaxed);
        std::fs::write(&path, &good[..40]).expect("written");
        assert_eq!((whole.load(key), whole.load(key)), (None, None));
        assert!(WARNED.load(Relaxed) > before);
        let file = folder.path().join("file");
        std::fs::write(&file, "x").expect("written");
        let nowhere = kept(&file, "1.0");
        nowhere.store(key, &built());
        assert_eq!(nowhere.load(key), None);
    }
}
