//! Devices: which there are, how options choose one, and what is said where the only one is the processor.

use serde_json::Value;

use crate::cli::common::{Run, SCENE, command, folder, impasto, names};

/// The strategy of this processor, unless another is asked for.
fn strategy() -> &'static str {
    let cpu = impasto::Cpu::new(&impasto::CpuOptions::default()).expect("a processor");
    if cpu.is_wide() { "own" } else { "mega" }
}

/// Runs the command where there is no driver of a GPU.
#[cfg(target_os = "linux")]
fn without_gpu(args: &[&str]) -> Run {
    let mut command = command(args);
    command.env("VK_DRIVER_FILES", "/nonexistent");
    command.env("VK_ICD_FILENAMES", "/nonexistent");
    command.output().expect("the command starts").into()
}

fn name(json: &Value) -> &str {
    let name = json["name"].as_str().unwrap_or_default();
    assert!(!name.is_empty(), "{json}");
    name
}

#[test]
fn info_names_the_device_and_the_others() {
    for device in ["gpu", "cpu"] {
        let json = impasto(&["info", "--device", device, "--format", "json"])
            .exits(0)
            .json();
        let text = impasto(&["info", "--device", device]).exits(0).stdout;
        assert!(text.starts_with(name(&json)), "{text}");
        assert_eq!(json["kind"] == "processor", device == "cpu", "{json}");
        let others = json["others"].as_array().expect("a list");
        assert!(!others.is_empty(), "{json}");
        // What chooses each of the others does.
        for other in others {
            let options = other["options"].as_str().expect("options").replace('"', "");
            let (option, value) = options.split_once(' ').expect("an option with a value");
            let args = ["info", option, value, "--format", "json"];
            assert_eq!(name(&impasto(&args).exits(0).json()), name(other));
            assert!(text.contains(name(other)) && text.contains(value), "{text}");
        }
        let kinds = others.iter().filter(|o| o["kind"] == "processor").count();
        assert_eq!(kinds == 1, device == "gpu", "{json}");
    }
}

/// Every id that is listed chooses the device, and what chooses none is refused before anything is rendered.
#[test]
fn gpus_are_chosen_by_what_info_lists_of_them() {
    let info = ["info", "--device", "gpu", "--format", "json"];
    let json = impasto(&info).exits(0).json();
    let ids = json["ids"].as_object().expect("ids");
    let of = |form: &str| ids.get(form).map(ToString::to_string);
    let forms = [
        of("index"),
        of("pci").map(|id| format!("pci:{id}")),
        of("minor").map(|id| format!("minor:{id}")),
        of("uuid").map(|id| format!("uuid:{id}")),
        of("selector"),
    ];
    for form in forms.into_iter().flatten() {
        let chosen = impasto(&["info", "--format", "json", "--gpu", &form.replace('"', "")]);
        assert_eq!(chosen.exits(0).json()["ids"], json["ids"], "{form}");
    }
    let text = impasto(&["info", "--device", "gpu"]).exits(0).stdout;
    assert!(text.contains("\n  ids      "), "{text}");
    assert!(text.contains("\n  driver   "), "{text}");
    let refused = |selector: &str, code: i32| {
        let args = ["render", SCENE, "--out", "p.exr", "--gpu", selector];
        impasto(&args).exits(code).prints_nothing()
    };
    for selector in [
        "",
        " ",
        "-1",
        "+1",
        "pci:",
        "pci:1",
        "pci:0000:00:20.0",
        "uuid:",
        "uuid:x",
        "minor:",
        "minor:-1",
        "99999999999",
    ] {
        refused(selector, 2).says("--gpu").says("expected");
    }
    refused("uuid:MIG-1", 2).says("MIG");
    for (selector, said) in [
        ("4294967295", "has the index 4294967295"),
        ("pci:ffff:ff:1f.7", "has the PCI address `ffff:ff:1f.7`"),
        ("minor:4294967295", "has the minor number"),
        ("uuid:GPU-00000000-ffff", "has a UUID that begins with"),
        (
            "r\u{f6}ntgen \u{1f3a8}",
            "is called `r\u{f6}ntgen \u{1f3a8}`",
        ),
    ] {
        // Another machine may have it.
        refused(selector, 75)
            .says(&format!("no GPU {said}"))
            .says("there are: ")
            .says("hint");
    }
}

/// Whatever schedulers leave in the environment: it is followed, said, or of no consequence, and never the end.
#[test]
fn variables_of_schedulers_are_no_end_of_a_command() {
    for (name, value) in [
        ("SLURM_JOB_GPUS", "0"),
        ("SLURM_JOB_GPUS", "rubbish"),
        ("SLURM_JOB_GPUS", ""),
        ("SLURM_JOB_GPUS", "-1"),
        ("SLURM_STEP_GPUS", "0,\u{661}"),
        ("CUDA_VISIBLE_DEVICES", ""),
        ("CUDA_VISIBLE_DEVICES", "NoDevFiles"),
        ("CUDA_VISIBLE_DEVICES", "-1"),
        ("CUDA_VISIBLE_DEVICES", "0,1,rubbish"),
        ("CUDA_VISIBLE_DEVICES", "GPU-"),
    ] {
        for device in [&[][..], &["--device", "cpu"]] {
            let mut command = command(&["info"]);
            command.args(device).env(name, value);
            let run: Run = command.output().expect("the command starts").into();
            assert!(!run.stderr.contains("panicked"), "{run:?}");
            // On a machine of several GPUs, a list of others is an error.
            assert!(run.code == 0 || run.stderr.contains(name), "{run:?}");
            if device == ["--device", "cpu"] {
                assert_eq!((run.code, run.stderr.as_str()), (0, ""), "{name}={value}");
            }
        }
    }
}

#[test]
fn options_that_contradict_each_other_are_refused() {
    let refused = |options: &[&str]| {
        impasto(&[&["info"], options].concat())
            .exits(2)
            .prints_nothing()
    };
    refused(&["--device", "cpu", "--gpu", "llvmpipe"])
        .says("`--gpu` chooses a GPU, but `--device cpu`");
    refused(&["--device", "gpu", "--threads", "2"]).says("but `--device gpu` chooses a GPU");
    refused(&["--gpu", "llvmpipe", "--threads", "2"]).says("cannot be used with '--threads <N>'");
    for threads in ["0", "1025", "100000", "-1", "many"] {
        refused(&[&format!("--threads={threads}")]).says("--threads");
    }
    refused(&["--threads=100000"]).says("100000 is not in 1..=1024");
    refused(&["--device", "tpu"]).says("[possible values: gpu, cpu]");
    // Before anything is read.
    let several = ["render", "none.toml", "--out", "p.exr", "--gpus"];
    let several = |more: &[&str]| impasto(&[&several[..], more].concat()).exits(2);
    several(&["all", "--device=cpu"]).says("`--gpus` chooses GPUs, but `--device cpu`");
    several(&["all", "--gpu=x"]).says("cannot be used with '--gpu <GPU>'");
    several(&["all", "--threads=2"]).says("cannot be used with '--threads <N>'");
    several(&["0"]).says("expected how many GPUs, from 1");
    several(&["0,"]).says("--gpus");
    impasto(&[
        "render",
        "none.toml",
        "--out",
        "p.exr",
        "--device=cpu",
        "--gpu=x",
    ])
    .exits(2)
    .says("leave out one of the two");
}

/// What several devices do together is tested in the runtime; here there may be but one.
#[test]
fn several_gpus_are_chosen_as_one_is() {
    let folder = folder();
    let render = |out: &str, options: &[&str]| {
        let [out, report] = [out, "r.json"].map(|n| folder.path().join(n).display().to_string());
        let args = [
            "render", SCENE, "--size", "6x4", "--spp", "3", "--out", &out, "--report", &report,
        ];
        let run = impasto(&[&args, options].concat());
        (run, out, report)
    };
    let (run, all, report) = render("all.exr", &["--gpus", "all"]);
    run.exits(0);
    let json: Value =
        serde_json::from_slice(&std::fs::read(report).expect("a report")).expect("it");
    let devices = json["devices"].as_array().map_or(1, Vec::len);
    let (run, one, _) = render("one.exr", &["--device", "gpu"]);
    run.exits(0);
    let bytes = |path: &str| std::fs::read(path).expect("a picture");
    assert_eq!(bytes(&all), bytes(&one));
    let (run, _, _) = render("x.exr", &["--gpus", &(devices + 1).to_string()]);
    run.exits(75).says(&format!(
        "no GPU is left after {devices} of the {} asked for",
        devices + 1
    ));
    let (run, _, _) = render("x.exr", &["--gpus", "0,0"]);
    run.exits(2).says("each GPU once, and `0` is listed before");
    assert!(!names(folder.path()).contains(&"x.exr".to_string()));
}

/// Kernels that an earlier start has built make the same picture, whatever became of their files.
#[test]
fn kernels_are_kept_for_the_next_start_and_never_make_it_fail() {
    let folder = folder();
    let cache = folder.path().join("cache");
    let kernels = cache.join("kernels");
    let start = |out: &str, cache: &std::path::Path| {
        let out = folder.path().join(out).display().to_string();
        let args = [
            "render", SCENE, "--device", "gpu", "--size", "6x4", "--spp", "3", "--out", &out,
        ];
        let mut command = command(&args);
        command.env("IMPASTO_CACHE", cache);
        (command, out)
    };
    let rendered = |out: &str, cache: &std::path::Path| {
        let (mut command, out) = start(out, cache);
        let run: Run = command.output().expect("it starts").into();
        (run.exits(0), std::fs::read(out).expect("a picture"))
    };
    let (_, fresh) = rendered("off.exr", "off".as_ref());
    // Two processes build into one folder.
    let both = ["a.exr", "b.exr"].map(|out| start(out, &cache));
    let both = both.map(|(mut command, out)| {
        let process = command.arg("--quiet").spawn();
        (process.expect("it starts"), out)
    });
    for (mut process, out) in both {
        assert!(process.wait().expect("it ends").success());
        assert_eq!(std::fs::read(out).expect("a picture"), fresh);
    }
    let kept = names(&kernels);
    assert!(
        kept.len() > 3 && kept.iter().all(|n| n.ends_with(".kernel")),
        "{kept:?}"
    );
    let whole = |name: &String| std::fs::read(kernels.join(name)).expect("a kernel");
    let before: Vec<Vec<u8>> = kept.iter().map(whole).collect();
    let (run, again) = rendered("again.exr", &cache);
    assert!(
        again == fresh && !run.stderr.contains("warning"),
        "{run:#?}"
    );
    // Cut short, empty, of another kernel, and with a bit turned over.
    for (i, name) in kept.iter().enumerate() {
        let mut bytes = before[i].clone();
        match i % 4 {
            0 => bytes.truncate(bytes.len() / 2),
            1 => bytes.clear(),
            2 => bytes.clone_from(&before[(i + 1) % before.len()]),
            _ => bytes[70] ^= 1,
        }
        std::fs::write(kernels.join(name), bytes).expect("written");
    }
    let (run, mended) = rendered("mended.exr", &cache);
    assert_eq!(run.stderr.matches("is damaged").count(), 1, "{run:#?}");
    assert_eq!(mended, fresh);
    let (run, _) = rendered("after.exr", &cache);
    assert!(!run.stderr.contains("warning"), "{run:#?}");
    // A folder that cannot be.
    let file = folder.path().join("file");
    std::fs::write(&file, "x").expect("written");
    let (run, nowhere) = rendered("nowhere.exr", &file);
    assert_eq!(
        run.stderr.matches("kernels are not kept").count(),
        1,
        "{run:#?}"
    );
    assert_eq!(nowhere, fresh);
}

#[test]
fn so_many_threads_are_there_as_asked_for() {
    for threads in [1u64, 3] {
        let asked = format!("--threads={threads}");
        let json = impasto(&["info", "--device=cpu", &asked, "--format=json"])
            .exits(0)
            .json();
        assert_eq!(json["limits"][0], serde_json::json!(["threads", threads]));
    }
}

/// A plan for a GPU, which the processor replaces, is in the report and a note.
#[test]
fn a_replaced_strategy_is_said() {
    let folder = folder();
    let [out, report] = ["p.exr", "r.json"].map(|n| folder.path().join(n).display().to_string());
    let render = |more: &[&str]| {
        let args = [
            "render", SCENE, "--device", "cpu", "--size", "6x4", "--spp", "1", "--out", &out,
            "--report", &report,
        ];
        let run = impasto(&[&args, more].concat());
        let text = std::fs::read_to_string(&report).unwrap_or_default();
        (run, serde_json::from_str(&text).unwrap_or(Value::Null))
    };
    let (run, json) = render(&[]);
    assert!(!run.exits(0).stderr.contains("in place of"));
    let chosen = strategy();
    assert_eq!(json["strategy"], chosen);
    assert!(json["replaced_strategy"].is_null());
    assert_eq!(json["adapter"]["backend"], "native");
    // With one path at a time there is one kernel.
    for (options, asked, has) in [
        (&["--strategy", "auto"][..], "auto", chosen),
        (&["--strategy", "binned"], "binned", chosen),
        (&["--partition", "binned:*"], "partition", chosen),
        (&["--strategy", "own", "--one-lane"], "own", "mega"),
    ] {
        let (run, json) = render(options);
        run.exits(0).says(&format!("`{has}` in place of `{asked}`"));
        assert_eq!(json["strategy"], has);
        assert_eq!(json["replaced_strategy"], asked);
        assert!(json["replanned"].is_null());
    }
    let (run, json) = render(&["--strategy", "mega"]);
    assert!(!run.exits(0).stderr.contains("in place of"));
    assert_eq!(
        (&json["strategy"], &json["plan"]),
        (&"mega".into(), &"mega".into())
    );
    // What is wrong with a plan is said all the same.
    render(&["--partition", "own:marble|*"])
        .0
        .exits(2)
        .says("marble");
    render(&["--strategy", "exhaustive"])
        .0
        .exits(2)
        .says("impasto plan");
}

#[test]
fn the_plan_of_the_processor_has_a_reason() {
    let folder = folder();
    let saved = folder.path().join("plan.json").display().to_string();
    let one = ["plan", SCENE, "--device", "cpu", "--one-lane"];
    let text = impasto(&one).exits(0).stdout;
    for part in [
        "plan `mega`: 1 kernel of materials",
        "checker_tiles",
        "why:",
        "--device gpu",
    ] {
        assert!(text.contains(part), "`{part}` is not in\n{text}");
    }
    let plan = ["plan", SCENE, "--device", "cpu"];
    let more = ["--strategy", "auto", "--format", "json", "--save", &saved];
    let json = impasto(&[&plan[..], &more].concat()).exits(0).json();
    assert_eq!(
        (&json["strategy"], &json["replaced_strategy"]),
        (&strategy().into(), &"auto".into())
    );
    let kernels = json["kernels"].as_array().expect("kernels");
    assert_eq!(kernels.len(), if strategy() == "own" { 5 } else { 1 });
    let reason = if strategy() == "own" {
        "eight paths"
    } else {
        "memory"
    };
    assert!(json["why"].as_str().is_some_and(|why| why.contains(reason)));
    let out = folder.path().join("p.exr").display().to_string();
    let render = [
        "render",
        SCENE,
        "--size=4x4",
        "--spp=1",
        "--plan",
        &saved,
        "--out",
        &out,
    ];
    impasto(&render).exits(0);
    for option in [
        "--profile=h200",
        "--workload=tests/plans/cornell.workload.json",
        "--strategy=exhaustive",
    ] {
        impasto(&[&plan[..], &[option]].concat())
            .exits(2)
            .prints_nothing()
            .says("needs a GPU, which the processor is not");
    }
}

/// The processor renders where there is no GPU; what measures kernels says that it needs one.
#[cfg(target_os = "linux")]
#[test]
fn without_a_gpu_the_processor_renders_and_measurements_say_what_they_need() {
    let folder = folder();
    let out = folder.path().join("p.exr").display().to_string();
    let json = without_gpu(&["info", "--format", "json"]).exits(0).json();
    assert_eq!(json["kind"], "processor");
    assert_eq!(json["others"], serde_json::json!([]));
    let text = without_gpu(&["info"]).exits(0).stdout;
    assert!(!text.contains("other devices"), "{text}");
    without_gpu(&["plan", SCENE]).exits(0);
    for args in [
        &["info", "--device", "gpu"][..],
        &["render", SCENE, "--device", "gpu", "--out", &out],
        &["calibrate", "--quick"],
        &["rays", SCENE],
        &["plan", SCENE, "--strategy", "exhaustive"],
        &["plan", SCENE, "--profile", "h200"],
    ] {
        let run = without_gpu(args).exits(75).prints_nothing();
        run.says("no GPU was found")
            .says("mesa-vulkan-drivers")
            .says("--device cpu");
    }
    without_gpu(&["calibrate", "--quick"])
        .exits(75)
        .says("`impasto calibrate` needs a GPU");
    without_gpu(&["rays", SCENE])
        .exits(75)
        .says("`impasto rays` needs a GPU");
    assert_eq!(names(folder.path()), [""; 0]);
    without_gpu(&[
        "render", SCENE, "--size", "6x4", "--spp", "1", "--out", &out,
    ])
    .exits(0);
    assert_eq!(names(folder.path()), ["p.exr", "p.png"]);
}

/// More memory than there is would end the process.
#[cfg(target_os = "linux")]
#[test]
fn a_picture_that_fits_no_memory_is_refused() {
    let folder = folder();
    let out = folder.path().join("p.exr").display().to_string();
    let layers = "albedo,normal,position,depth,uv,variance,alpha,material,object,lights";
    let known = std::fs::read_to_string("/proc/meminfo").expect("Linux tells");
    let kilobytes = known
        .split_whitespace()
        .nth(1)
        .and_then(|n| n.parse::<u64>().ok());
    if kilobytes.is_none_or(|n| n > 64 << 20) {
        return; // the largest picture with all layers fits
    }
    let size = ["--size", "20000x20000", "--spp", "1", "--aov", layers];
    let args = ["render", SCENE, "--device", "cpu", "--out", &out];
    impasto(&[&args[..], &size].concat())
        .exits(2)
        .says("the film")
        .says("`memory`");
}

/// Mesa prints an error that looks like ours where the environment names no runtime folder.
#[test]
fn drivers_have_a_runtime_folder() {
    let mut command = command(&["info", "--device", "gpu"]);
    command.env_remove("XDG_RUNTIME_DIR");
    let run: Run = command.output().expect("the command starts").into();
    let run = run.exits(0);
    assert!(!run.stderr.contains("XDG"), "{}", run.stderr);
}
