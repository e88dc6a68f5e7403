"""Impasto and a peer on one device: paths a second, error, and the time to equal error."""

import json
import sys
import tempfile
import time
from argparse import Namespace
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path

import numpy as np

import exr
from impasto import Impasto, load_scene
from measure import Efficiency, efficiency

EQUAL_ERROR = 0.01
"""relMSE to which times are reported."""


def race(args: Namespace) -> int:
    impasto = Impasto(args.impasto)
    peer = {"mitsuba": Mitsuba, "cycles": Cycles}[args.peer](args)
    if unknown := set(peer.modes) - set(peer.all_modes):
        raise SystemExit(f"modes are {', '.join(peer.all_modes)}, not {', '.join(unknown)}")
    results = kept_results(args)
    for path in args.scenes:
        scene = load_scene(path)
        film = scene["film"]
        size = args.size or (film["width"], film["height"])
        name = scene.get("name", path.parent.name)
        results = [entry for entry in results if entry["scene"] != name]
        print(f"{name}: impasto", file=sys.stderr, flush=True)
        ours, device = time_impasto(impasto, path, size, args)
        entry = {"scene": name, "width": size[0], "height": size[1], "device": device, "impasto": asdict(ours)}
        results.append(entry)
        for mode, timed in peer.timed(scene, impasto, size):
            print(f"{name}: {args.peer}, {words(mode)}", file=sys.stderr, flush=True)
            try:
                entry[f"{args.peer}_{mode}"] = timed()
            except RuntimeError as error:
                entry[f"{args.peer}_{mode}_error"] = str(error).splitlines()[0]
            write_results(args, peer, results)
    print(args.out.with_suffix(".md").read_text())
    return 0


def kept_results(args: Namespace) -> list[dict]:
    """The scenes of an earlier race, to which this one adds."""
    before = args.out.with_suffix(".json")
    return json.loads(before.read_text())["scenes"] if args.add and before.is_file() else []


def time_impasto(impasto: Impasto, path: Path, size: tuple[int, int], args: Namespace) -> tuple[Efficiency, str]:
    """Time is what the GPU was busy, without compiling and loading."""
    pictures, seconds, device = [], [], ""
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(args.pictures):
            out = Path(folder) / "picture.exr"
            options = ["--size", "x".join(map(str, size)), "--spp", str(args.spp), "--seed", str(seed)]
            report = impasto.render(path, out, *options, *args.option)
            pictures.append(exr.read(out))
            seconds.append(report["gpu_seconds"])
            device = report["adapter"]["name"]
    return efficiency(pictures, seconds, args.spp), device


# ---- Peers ---------------------------------------------------------------------------------------

Timed = Iterator[tuple[str, Callable[[], dict]]]
"""Ways of a peer to render a scene, by name."""


class Mitsuba:
    all_modes = ("megakernel", "wavefront")

    def __init__(self, args: Namespace):
        import mitsuba as mi

        from translate import NEAREST

        self.args, self.modes, self.nearest = args, args.mode or self.all_modes, NEAREST
        self.facts = {"mitsuba": mi.__version__, "variant": mi.variant()}
        self.title = f"Mitsuba {mi.__version__} (`{mi.variant()}`)"

    def timed(self, scene: dict, impasto: Impasto, size: tuple[int, int]) -> Timed:
        from translate import load, translate

        loaded = load(translate(scene, impasto, size))
        for mode in self.modes:
            yield mode, lambda mode=mode: asdict(time_mitsuba(loaded, mode, self.args))


class Cycles:
    def __init__(self, args: Namespace):
        from blender import MODES, NEAREST

        self.all_modes = tuple(MODES)
        self.args, self.modes, self.nearest = args, args.mode or self.all_modes, NEAREST
        self.facts = {"cycles_device": args.cycles_device}

    @property
    def title(self) -> str:
        return f"Cycles of Blender {self.facts.get('blender', '')} (`{self.args.cycles_device}`)"

    def timed(self, scene: dict, impasto: Impasto, size: tuple[int, int]) -> Timed:
        from blender import time_cycles, translate

        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(temporary)
            job = translate(scene, impasto, size, folder)

            def one(mode: str) -> dict:
                found, facts = time_cycles(job, folder, mode, self.args)
                self.facts["blender"] = facts["version"]
                return asdict(found) | {"devices": facts["devices"], "times": facts["times"]}

            for mode in self.modes:
                yield mode, lambda mode=mode: one(mode)


def time_mitsuba(scene, mode: str, args: Namespace) -> Efficiency:
    """Time is of a picture that was rendered before, so that kernels are compiled, from the call until
    the device is idle. A wavefront evaluates its loops step by step, a megakernel records them."""
    import drjit as dr
    import mitsuba as mi

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


# ---- Results -------------------------------------------------------------------------------------


def write_results(args: Namespace, peer: Mitsuba | Cycles, results: list[dict]) -> None:
    facts = peer.facts | {"spp": args.spp, "options": args.option}
    text = json.dumps(facts | {"equal_error": EQUAL_ERROR, "scenes": results}, indent=2)
    args.out.with_suffix(".json").write_text(text + "\n")
    label = args.peer.capitalize()
    lines = [
        f"Impasto and {peer.title} on {results[0]['device']}, {args.spp} samples a pixel.",
        "",
        " ".join(peer.nearest.split()),
        "",
        f"| scene | renderer | Mpaths/s | against the peer's best | MSE of a sample | relMSE "
        f"| s to relMSE {EQUAL_ERROR} | MSE x s | mean |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for entry in results:
        rows = {"Impasto": entry["impasto"]}
        rows |= {f"{label}, {words(m)}": entry[f"{args.peer}_{m}"] for m in peer.modes if f"{args.peer}_{m}" in entry}
        best = max((row["mpaths_per_second"] for row in list(rows.values())[1:]), default=float("nan"))
        for name, row in rows.items():
            lines.append(f"| {entry['scene']} | {name} | {cells(row, best, entry['impasto']['mean'])} |")
        for mode in peer.modes:
            if f"{args.peer}_{mode}_error" in entry:
                error = entry[f"{args.peer}_{mode}_error"]
                lines.append(f"| {entry['scene']} | {label}, {words(mode)} | failed: {error} | | | | | | |")
    args.out.with_suffix(".md").write_text("\n".join(lines) + "\n")


def words(mode: str) -> str:
    return mode.replace("_", " ")


def cells(row: dict, best: float, mean: float) -> str:
    """What a table says of one renderer; `mean` is that of Impasto's pictures."""
    rate, seconds = row["mpaths_per_second"], row["seconds"]
    to_error = seconds * row["relative_mse"] / EQUAL_ERROR
    return " | ".join(
        [
            f"{rate:.4g}",
            f"{rate / best:.2f}",
            f"{row['mse'] * row['samples']:.3g}",
            f"{row['relative_mse']:.3g}",
            f"{to_error:.3g}",
            f"{row['mse'] * seconds:.3g}",
            f"{row['mean']:.4g} ({row['mean'] / mean - 1:+.1%})",
        ]
    )
