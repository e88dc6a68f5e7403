#!/usr/bin/env python3
"""Impasto beside Mitsuba 3 (README.md says how to run it).

`compare` renders scenes of plain BSDFs with both and asks whether the pictures are the same but for
noise. `race` renders scenes with both on one GPU and writes how fast they are, and how long they
take to equal error.
"""

import argparse
import json
import sys
import tempfile
import time
from dataclasses import asdict
from pathlib import Path

import mitsuba as mi
import numpy as np

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    comparing = commands.add_parser("compare", help="are the pictures the same but for noise?")
    comparing.add_argument("scenes", nargs="*", type=Path, help="scene files [all in tests/peers/scenes]")
    comparing.add_argument("--size", type=int, default=128, help="pixels along each side")
    comparing.add_argument("--spp", type=int, default=256, help="samples of each of two halves")
    comparing.add_argument("--keep", type=Path, help="folder to keep the pictures in")
    racing = commands.add_parser("race", help="paths a second and time to equal error")
    racing.add_argument("scenes", nargs="+", type=Path)
    racing.add_argument("--size", type=size, help="as in 640x480; the scene's own otherwise")
    racing.add_argument("--spp", type=int, default=64, help="samples of a picture")
    racing.add_argument("--pictures", type=int, default=6, help="pictures with seeds of their own")
    racing.add_argument("--option", action="append", default=[], help="for `impasto render`, repeatable")
    racing.add_argument("--out", type=Path, default=Path("peers"), help="writes OUT.json and OUT.md")
    for command in (comparing, racing):
        command.add_argument("--impasto", default=str(ROOT / "target/release/impasto"), help="the command")
        command.add_argument("--variant", help="of Mitsuba [compare: llvm_ad_rgb, race: cuda_ad_rgb]")
    args = parser.parse_args()
    mi.set_variant(args.variant or ("llvm_ad_rgb" if args.command == "compare" else "cuda_ad_rgb"))
    return compare(args) if args.command == "compare" else race(args)


def size(text: str) -> tuple[int, int]:
    width, height = text.split("x")
    return int(width), int(height)


# ---- Pictures ------------------------------------------------------------------------------------


def compare(args: argparse.Namespace) -> int:
    from impasto import Impasto, load_scene
    from measure import compare as compare_pictures
    from measure import read
    from translate import load, translate

    impasto = Impasto(args.impasto)
    scenes = args.scenes or sorted((HERE / "scenes").glob("*.toml"))
    if not scenes:
        raise SystemExit("there are no scenes to compare")
    disagree = 0
    with tempfile.TemporaryDirectory() as temporary:
        folder = args.keep or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        print(f"{'scene':16} {'relMSE':>9} {'noise':>9} {'bias':>9} {'allowed':>9}  mean ratio")
        for path in scenes:
            peer = load(translate(load_scene(path), impasto, (args.size, args.size)))
            ours, theirs = [], []
            for seed in (1, 2):
                out = folder / f"{path.stem}-impasto-{seed}.exr"
                options = ["--size", f"{args.size}x{args.size}", "--spp", str(args.spp), "--seed", str(seed)]
                impasto.render(path, out, *options)
                ours.append(read(out))
                picture = mi.render(peer, spp=args.spp, seed=seed)
                mi.Bitmap(picture).write(str(folder / f"{path.stem}-mitsuba-{seed}.exr"))
                mi.util.write_bitmap(str(folder / f"{path.stem}-mitsuba-{seed}.png"), picture, write_async=False)
                theirs.append(np.array(picture, dtype=np.float64))
            v = compare_pictures(ours, theirs)
            word = "agrees" if v.agrees else "DIFFERS"
            print(
                f"{path.stem:16} {v.difference:9.2e} {v.noise:9.2e} {v.bias:9.2e} {v.allowed:9.2e}  "
                f"{v.mean_ratio:.4f} {word}",
                flush=True,
            )
            disagree += not v.agrees
    return 1 if disagree else 0


# ---- Speed ---------------------------------------------------------------------------------------

EQUAL_ERROR = 0.01
"""relMSE to which times are reported."""


def race(args: argparse.Namespace) -> int:
    from impasto import Impasto, load_scene
    from translate import NEAREST, load, translate

    impasto = Impasto(args.impasto)
    results = []
    for path in args.scenes:
        scene = load_scene(path)
        film = scene["film"]
        width, height = args.size or (film["width"], film["height"])
        name = scene.get("name", path.parent.name)
        print(f"{name}: impasto", file=sys.stderr, flush=True)
        ours, device = time_impasto(impasto, path, (width, height), args)
        entry = {"scene": name, "width": width, "height": height, "device": device, "impasto": asdict(ours)}
        peer = load(translate(scene, impasto, (width, height)))
        for mode in ("megakernel", "wavefront"):
            print(f"{name}: mitsuba, {mode}", file=sys.stderr, flush=True)
            try:
                entry[f"mitsuba_{mode}"] = asdict(time_mitsuba(peer, mode, args))
            except RuntimeError as error:
                entry[f"mitsuba_{mode}_error"] = str(error).splitlines()[0]
        results.append(entry)
        write_results(args, results, NEAREST)
    print(args.out.with_suffix(".md").read_text())
    return 0


def time_impasto(impasto, path: Path, resolution: tuple[int, int], args: argparse.Namespace):
    """Time is what the GPU was busy, without compiling and loading."""
    from measure import efficiency, read

    pictures, seconds, device = [], [], ""
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(args.pictures):
            out = Path(folder) / "picture.exr"
            options = ["--size", "x".join(map(str, resolution)), "--spp", str(args.spp), "--seed", str(seed)]
            report = impasto.render(path, out, *options, *args.option)
            pictures.append(read(out))
            seconds.append(report["gpu_seconds"])
            device = report["adapter"]["name"]
    return efficiency(pictures, seconds, args.spp), device


def time_mitsuba(scene, mode: str, args: argparse.Namespace):
    """Time is of a picture that was rendered before, so that kernels are compiled, from the call until
    the device is idle. A wavefront evaluates its loops step by step, a megakernel records them."""
    import drjit as dr

    from measure import efficiency

    dr.set_flag(dr.JitFlag.SymbolicLoops, mode == "megakernel")
    dr.set_flag(dr.JitFlag.OptimizeLoops, mode == "megakernel")
    pictures, seconds = [], []
    # As many samples at once as memory surely holds; a wavefront keeps the state of them all.
    pixels = int(np.prod(scene.sensors()[0].film().size()))
    at_once = max(1, min(args.spp, (1 << (27 if mode == "megakernel" else 24)) // pixels))
    while args.spp % at_once:
        at_once -= 1
    passes = args.spp // at_once
    # The first picture compiles the kernels and is not counted.
    for picture in range(args.pictures + 1):
        dr.sync_thread()
        start = time.perf_counter()
        total = None
        for part in range(passes):
            image = mi.render(scene, spp=at_once, seed=1000 + picture * passes + part)
            total = image if total is None else total + image
            dr.eval(total)
        dr.sync_thread()
        taken = time.perf_counter() - start
        if picture > 0:
            seconds.append(taken)
            pictures.append(total.numpy().astype(np.float64) / passes)
    return efficiency(pictures, seconds, args.spp)


def write_results(args: argparse.Namespace, results: list[dict], nearest: str) -> None:
    facts = {"mitsuba": mi.__version__, "variant": mi.variant(), "spp": args.spp, "options": args.option}
    text = json.dumps(facts | {"equal_error": EQUAL_ERROR, "scenes": results}, indent=2)
    args.out.with_suffix(".json").write_text(text + "\n")
    lines = [
        f"Impasto and Mitsuba {mi.__version__} (`{mi.variant()}`) on {results[0]['device']}, "
        f"{args.spp} samples a pixel.",
        "",
        " ".join(nearest.split()),
        "",
        f"| scene | renderer | Mpaths/s | against Mitsuba's best | relMSE | s to relMSE {EQUAL_ERROR} | MSE x s |",
        "|---|---|---|---|---|---|---|",
    ]
    for entry in results:
        rows = [("Impasto", entry["impasto"])]
        rows += [
            (f"Mitsuba, {m}", entry[f"mitsuba_{m}"]) for m in ("megakernel", "wavefront") if f"mitsuba_{m}" in entry
        ]
        best = max((row["mpaths_per_second"] for _, row in rows[1:]), default=float("nan"))
        for label, row in rows:
            to_error = row["seconds"] * row["relative_mse"] / EQUAL_ERROR
            rate = row["mpaths_per_second"]
            lines.append(
                f"| {entry['scene']} | {label} | {rate:.3g} | {rate / best:.2f} | {row['relative_mse']:.3g} "
                f"| {to_error:.3g} | {row['mse'] * row['seconds']:.3g} |"
            )
        for mode in ("megakernel", "wavefront"):
            if f"mitsuba_{mode}_error" in entry:
                lines.append(
                    f"| {entry['scene']} | Mitsuba, {mode} | failed: {entry[f'mitsuba_{mode}_error']} | | | | |"
                )
    args.out.with_suffix(".md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    sys.exit(main())
