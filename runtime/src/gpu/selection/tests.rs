//! Machines that are lists: what is chosen on each, and what is said where nothing can be.

use super::*;

const H200: &str = "NVIDIA H200";

fn pci(text: &str) -> Option<PciAddress> {
    Some(PciAddress::parse(text).expect("an address"))
}

fn nvidia(name: &str, address: &str, minor: u32) -> Described {
    Described {
        name: name.into(),
        backend: "vulkan".into(),
        rank: 0,
        is_nvidia: true,
        pci: pci(address),
        minor: Some(minor),
        uuid: Some(format!("{minor}932f937-d72c")),
    }
}

fn llvmpipe() -> Described {
    Described {
        name: "llvmpipe (LLVM 19.1.7, 256 bits)".into(),
        backend: "vulkan".into(),
        rank: Described::SOFTWARE,
        ..Described::default()
    }
}

fn amd() -> Described {
    Described {
        name: "AMD Radeon PRO W7900".into(),
        backend: "vulkan".into(),
        pci: pci("0000:c1:00.0"),
        ..Described::default()
    }
}

/// Four of a kind, whose device files are numbered otherwise than their places, and software.
fn node() -> Vec<Described> {
    vec![
        nvidia(H200, "0000:00:07.0", 0),
        nvidia(H200, "0000:00:06.0", 1),
        nvidia(H200, "0000:00:08.0", 2),
        nvidia(H200, "0000:00:09.0", 3),
        llvmpipe(),
    ]
}

fn chosen(selector: &str, adapters: &[Described]) -> Result<usize, String> {
    let selector: Selector = selector.parse()?;
    let chosen = select(Some(&selector), &Environment::default(), adapters);
    chosen.map(|c| c.adapters[0]).map_err(|e| e.to_string())
}

fn environment(variables: &[(&str, &str)]) -> Environment {
    let get = |name: &str| {
        let found = variables.iter().find(|(n, _)| *n == name);
        found.map(|(_, value)| (*value).to_owned())
    };
    Environment::new(get)
}

/// What is chosen where nothing is asked for: places, and all notes as one text.
fn left(
    variables: &[(&str, &str)],
    adapters: &[Described],
) -> Result<(Vec<usize>, String), String> {
    let chosen = select_all(&Several::All, &environment(variables), adapters);
    let all = chosen.map_err(|e| e.to_string())?;
    let one = select(None, &environment(variables), adapters).map_err(|e| e.to_string())?;
    if !adapters.iter().all(Described::is_software) {
        assert_eq!(one.adapters.first(), all.adapters.first());
    }
    Ok((all.adapters, one.notes.join("\n")))
}

#[test]
fn every_form_chooses_one_of_four_of_a_kind() {
    let node = node();
    for (selector, place) in [
        ("pci:0000:00:06.0", 1),
        ("00:09.0", 3),
        ("uuid:GPU-2932", 2),
        ("minor:3", 3),
        ("0", 1),
        ("1", 0),
        ("4", 4),
        ("llvm", 4),
        ("LLVMPIPE (llvm 19.1.7, 256 BITS)", 4),
    ] {
        assert_eq!(chosen(selector, &node), Ok(place), "{selector}");
    }
}

#[test]
fn what_fits_several_or_none_names_those_that_there_are() {
    let node = node();
    let error = chosen("h200", &node).expect_err("four fit");
    for part in [
        "`--gpu h200` fits 4 GPUs",
        "NVIDIA H200 (`pci:0000:00:06.0`)",
        "pci:0000:00:09.0",
        "hint",
    ] {
        assert!(error.contains(part), "{error}");
    }
    assert!(!error.contains("llvmpipe"), "{error}");
    for (selector, part) in [
        ("pci:0000:00:0a.0", "has the PCI address `0000:00:0a.0`"),
        ("uuid:ff", "has a UUID that begins with `GPU-ff`"),
        ("minor:4", "has the minor number 4 (/dev/nvidia4)"),
        ("5", "has the index 5"),
        ("Voodoo 2", "is called `Voodoo 2`"),
        ("\u{1f3a8}", "is called `\u{1f3a8}`"),
    ] {
        let error = chosen(selector, &node).expect_err("none fits");
        assert!(error.contains(&format!("no GPU {part}")), "{error}");
        assert!(
            error.contains("llvmpipe (LLVM 19.1.7, 256 bits) (`4`)"),
            "{error}"
        );
    }
    let error = chosen("0", &[]).expect_err("there is none");
    assert!(error.contains("no GPU was found"), "{error}");
}

#[test]
fn a_whole_name_comes_before_names_that_contain_it() {
    let adapters = [
        nvidia("NVIDIA H100 NVL", "0000:00:01.0", 0),
        nvidia("NVIDIA H100", "0000:00:02.0", 1),
    ];
    assert_eq!(chosen("nvidia h100", &adapters), Ok(1));
    assert_eq!(chosen("nvl", &adapters), Ok(0));
    assert!(chosen("h100", &adapters).is_err());
}

/// A number that no index can be is a word of a name, as it was before there were indices.
#[test]
fn numbers_of_names_are_found() {
    let adapters = [
        nvidia("NVIDIA GeForce RTX 4090", "0000:01:00.0", 0),
        nvidia("NVIDIA GeForce RTX 3090", "0000:02:00.0", 1),
    ];
    assert_eq!(chosen("4090", &adapters), Ok(0));
    assert_eq!(chosen("1", &adapters), Ok(1));
    assert_eq!(chosen("3090", &adapters), Ok(1));
    // Nor is any digit in a name what was meant.
    for number in ["90", "9", "409", "5090"] {
        assert!(chosen(number, &adapters).is_err_and(|e| e.contains("has the index")));
    }
}

#[test]
fn one_gpu_of_several_backends_is_no_ambiguity() {
    let through = |mut adapter: Described, backend: &str| {
        adapter.backend = backend.into();
        adapter
    };
    let without_pci = |adapter: Described| Described {
        pci: None,
        minor: None,
        uuid: None,
        ..adapter
    };
    // By its address, also where drivers give it several names.
    let named = Described {
        name: "AMD Radeon PRO W7900 (RADV NAVI31)".into(),
        ..amd()
    };
    let two = [amd(), named];
    assert_eq!(chosen("w7900", &two), Ok(0));
    assert_eq!(chosen("radv", &two), Ok(1));
    assert!(chosen("1", &two).is_err());
    // By its name, where an interface does not tell the address.
    let both = |n: u32| nvidia(H200, &format!("0000:00:0{n}.0"), n);
    let mut adapters = vec![
        both(1),
        both(2),
        through(without_pci(both(1)), "dx12"),
        through(without_pci(both(2)), "dx12"),
    ];
    assert_eq!(devices(&adapters).len(), 2);
    assert!(chosen("h200", &adapters).is_err_and(|e| e.contains("fits 2")));
    assert_eq!(chosen("1", &adapters), Ok(1));
    // Software is one however often it is listed.
    adapters = vec![llvmpipe(), llvmpipe(), through(llvmpipe(), "dx12")];
    assert_eq!(chosen("llvmpipe", &adapters), Ok(0));
    // Two of a name without addresses are two.
    adapters = vec![without_pci(both(1)), without_pci(both(2))];
    let error = chosen("h200", &adapters).expect_err("two fit");
    assert!(
        error.contains("(`0`)") && error.contains("(`1`)"),
        "{error}"
    );
}

#[test]
fn slurm_gives_device_files_and_cuda_shows_places() {
    let node = node();
    let slurm = |list| left(&[("SLURM_JOB_GPUS", list)], &node).map(|(all, _)| all);
    assert_eq!(slurm("2"), Ok(vec![2]));
    assert_eq!(slurm("3,0-1"), Ok(vec![3, 0, 1]));
    assert_eq!(slurm("3,9"), Ok(vec![3]));
    let cuda = |list| left(&[("CUDA_VISIBLE_DEVICES", list)], &node).map(|(all, _)| all);
    assert_eq!(cuda("0"), Ok(vec![1]));
    assert_eq!(cuda(" 3 , 1"), Ok(vec![3, 0]));
    assert_eq!(cuda("GPU-2932f,0"), Ok(vec![2, 1]));
    // The rest after what is none of them does not count, as for CUDA.
    assert_eq!(cuda("1,7,0"), Ok(vec![0]));
    assert_eq!(cuda("1,-1,0"), Ok(vec![0]));
    assert_eq!(cuda("1,1"), Ok(vec![0]));
    // A step has less than its job, and a task may be shown less than both.
    let of = |variables: &[(&str, &str)]| left(variables, &node).map(|(all, _)| all);
    let job = ("SLURM_JOB_GPUS", "0-3");
    assert_eq!(of(&[job, ("SLURM_STEP_GPUS", "2,3")]), Ok(vec![2, 3]));
    assert_eq!(of(&[job, ("CUDA_VISIBLE_DEVICES", "2")]), Ok(vec![2]));
    assert_eq!(
        of(&[("SLURM_JOB_GPUS", "3"), ("CUDA_VISIBLE_DEVICES", "9")]),
        Ok(vec![3])
    );
    // What is asked for comes before all of them.
    let asked = select(Some(&Selector::Minor(1)), &environment(&[job]), &node);
    assert_eq!(asked.expect("chosen").adapters, [1]);
}

#[test]
fn the_first_of_several_is_taken_and_said() {
    let (_, notes) = left(&[("SLURM_JOB_GPUS", "2,3")], &node()).expect("chosen");
    assert!(notes.contains("`SLURM_JOB_GPUS` gives 2 GPUs"), "{notes}");
    assert!(notes.contains("pci:0000:00:08.0"), "{notes}");
    let (all, notes) = left(&[], &node()).expect("chosen");
    assert_eq!(all, [0, 1, 2, 3]);
    assert!(
        notes.contains("there are 4 GPUs, of which one renders"),
        "{notes}"
    );
    let (_, notes) = left(&[("SLURM_JOB_GPUS", "2")], &node()).expect("chosen");
    assert_eq!(notes, "");
    // One that is better than the rest needs no word.
    let unlike = [
        nvidia(H200, "0000:00:01.0", 0),
        Described { rank: 1, ..amd() },
    ];
    assert_eq!(left(&[], &unlike).expect("chosen").1, "");
}

#[test]
fn what_a_list_has_and_a_machine_has_not_is_an_error() {
    for (variables, part) in [
        (
            &[("SLURM_JOB_GPUS", "7")][..],
            "`SLURM_JOB_GPUS` lists (`7`)",
        ),
        (
            &[("CUDA_VISIBLE_DEVICES", "4")],
            "`CUDA_VISIBLE_DEVICES` lists (`4`)",
        ),
        (&[("CUDA_VISIBLE_DEVICES", "GPU-ffff")], "`GPU-ffff`"),
    ] {
        let error = left(variables, &node()).expect_err("refused");
        assert!(
            error.contains(part) && error.contains("--device cpu"),
            "{error}"
        );
        assert!(error.contains("pci:0000:00:06.0"), "{error}");
        // The only one there is, is taken whatever lists call it, as where a job sees nothing but its own.
        let (all, notes) = left(variables, &node()[..1]).expect("chosen");
        assert_eq!(all, [0]);
        assert!(
            notes.contains("the only GPU") && notes.contains(H200),
            "{notes}"
        );
    }
}

#[test]
fn rubbish_is_said_and_ignored_or_hides_as_it_does_for_cuda() {
    let node = node();
    for list in ["x", "0,x", "-1", "2-1", "GPU-0932", "\u{661}"] {
        let (all, notes) = left(&[("SLURM_JOB_GPUS", list)], &node).expect("chosen");
        assert_eq!(all, [0, 1, 2, 3]);
        assert!(notes.contains("is ignored"), "{notes}");
    }
    for list in ["", " "] {
        assert_eq!(
            left(&[("SLURM_JOB_GPUS", list)], &node)
                .expect("chosen")
                .0
                .len(),
            4
        );
    }
    for list in [
        "",
        " ",
        "-1",
        "NoDevFiles",
        "rubbish",
        ",0",
        "MIG-1932",
        "gpu-1932",
        "0x1",
    ] {
        let variables = [("CUDA_VISIBLE_DEVICES", list)];
        let notes = select(None, &environment(&variables), &node).expect("none");
        assert_eq!(notes.adapters, [0; 0], "{list}");
        assert!(
            notes.notes[0].contains("hides the GPUs of NVIDIA's"),
            "{notes:?}"
        );
        let all = select_all(&Several::All, &environment(&variables), &node);
        let error = all.expect_err("all are hidden").to_string();
        assert!(
            error.contains("left by what the environment says"),
            "{error}"
        );
        // It is no word on others, nor on software.
        let mixed = [nvidia(H200, "0000:00:01.0", 0), amd()];
        assert_eq!(left(&variables, &mixed).expect("chosen").0, [1]);
        assert_eq!(
            left(&variables, &[llvmpipe()]).expect("chosen"),
            (vec![0], String::new())
        );
    }
    let (_, notes) = left(&[("SLURM_JOB_GPUS", "0")], &[llvmpipe()]).expect("chosen");
    assert!(notes.contains("Vulkan shows none"), "{notes}");
    // No driver tells the numbers of AMD's devices.
    let two = [
        amd(),
        Described {
            pci: pci("0000:c2:00.0"),
            ..amd()
        },
    ];
    let (all, notes) = left(&[("SLURM_JOB_GPUS", "0")], &two).expect("chosen");
    assert_eq!(all, [0, 1]);
    assert!(notes.contains("is ignored"), "{notes}");
}

#[test]
fn places_of_unlike_gpus_depend_on_their_order() {
    let unlike = [
        nvidia("NVIDIA A2", "0000:00:02.0", 1),
        nvidia(H200, "0000:00:01.0", 0),
    ];
    let list = ("CUDA_VISIBLE_DEVICES", "0");
    let (all, notes) = left(&[list], &unlike).expect("chosen");
    assert_eq!(all, [1]);
    assert!(notes.contains("CUDA_DEVICE_ORDER"), "{notes}");
    let (_, notes) = left(&[list, ("CUDA_DEVICE_ORDER", "PCI_BUS_ID")], &unlike).expect("chosen");
    assert_eq!(notes, "");
}

#[test]
fn several_are_all_so_many_or_a_list() {
    let node = node();
    let all = |text: &str| -> Result<Vec<usize>, String> {
        let several: Several = text.parse()?;
        let chosen = select_all(&several, &Environment::default(), &node);
        chosen.map(|c| c.adapters).map_err(|e| e.to_string())
    };
    assert_eq!(all("ALL"), Ok(vec![0, 1, 2, 3]));
    assert_eq!(all("2"), Ok(vec![0, 1]));
    assert_eq!(all("minor:3,0, llvmpipe"), Ok(vec![3, 1, 4]));
    for (text, part) in [
        ("0", "from 1"),
        ("5", "after 4 of the 5"),
        ("99999999999999999999999", "from 1"),
        ("", "expected pci:"),
        ("0,", "expected pci:"),
        ("0,-1", "from 0"),
        ("0,9", "has the index 9"),
        ("0,h200", "fits 4"),
        ("0,pci:00:06.0", "listed before"),
    ] {
        let error = all(text).expect_err(text);
        assert!(error.contains(part), "{text}: {error}");
    }
    // Where there is nothing but software, that is all there is.
    let software = select_all(&Several::All, &Environment::default(), &[llvmpipe()]);
    assert_eq!(software.expect("chosen").adapters, [0]);
    assert!(select_all(&Several::All, &Environment::default(), &[]).is_err());
}

#[test]
fn every_device_has_ids_that_choose_it() {
    let mut adapters = node();
    adapters.push(amd());
    let ids = ids(&adapters);
    let selectors: Vec<&str> = ids.iter().map(|ids| ids.selector.as_str()).collect();
    assert_eq!(selectors[..2], ["pci:0000:00:07.0", "pci:0000:00:06.0"]);
    assert_eq!(
        selectors[4..],
        ["llvmpipe (LLVM 19.1.7, 256 bits)", "AMD Radeon PRO W7900"]
    );
    for (place, ids) in ids.iter().enumerate() {
        assert_eq!(chosen(&ids.selector, &adapters), Ok(place));
        assert_eq!(chosen(&ids.index.to_string(), &adapters), Ok(place));
        if let Some(uuid) = &ids.uuid {
            assert_eq!(chosen(uuid, &adapters), Ok(place));
        }
    }
}
