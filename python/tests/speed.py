"""Prints what docs/python.md says of speed: `target/python/bin/python python/tests/speed.py` after `cargo xtask python`."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import impasto

ROOT = Path(__file__).parents[2]
SCENE = str(ROOT / "examples/cornell/scene.toml")
SIZE, SAMPLES = (320, 240), 16


def importing() -> float:
    code = "import time; begin = time.perf_counter(); import impasto; print(time.perf_counter() - begin)"
    return min(float(subprocess.check_output([sys.executable, "-c", code])) for _ in range(5))


def evaluating(module: str) -> tuple[float, float]:
    """Seconds of the processor for a million values, and for a million samples, on one core."""
    material, rng = impasto.Material(module), np.random.default_rng(0)
    wi = rng.normal(size=(1_000_000, 3)).astype(np.float32)
    wi[:, 2] = np.abs(wi[:, 2]) + 1e-3
    u = rng.random((1_000_000, 4), dtype=np.float32)
    material.eval((0, 0, 1), wi[:8], threads=1), material.sample((0, 0, 1), u[:8], threads=1)
    seconds = []
    for ask in (lambda: material.eval((0, 0, 1), wi, threads=1), lambda: material.sample((0, 0, 1), u, threads=1)):
        begin = time.process_time()
        ask()
        seconds.append(time.process_time() - begin)
    return (seconds[0], seconds[1])


def cpu_seconds(command: list[str]) -> float:
    """Seconds of the processor that a process takes: less is up to other processes than of the clock."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def rendering() -> tuple[float, float]:
    """The same of a render by the command, and by Python: the least of three each, by turns."""
    with tempfile.TemporaryDirectory() as folder:
        out, size = f"{folder}/a.png", f"{SIZE[0]}x{SIZE[1]}"
        command = [sys.executable, "-m", "impasto", "render", SCENE, "--size", size, "--spp", str(SAMPLES)]
        command += ["--threads", "1", "--out", out, "--quiet"]
        code = f"import impasto; impasto.render({SCENE!r}, size={SIZE}, samples={SAMPLES}, threads=1).save({out!r})"
        pairs = [(cpu_seconds(command), cpu_seconds([sys.executable, "-c", code])) for _ in range(3)]
    return (min(pair[0] for pair in pairs), min(pair[1] for pair in pairs))


def main() -> None:
    print(f"importing: {1e3 * importing():.0f} ms")
    for module in ("std::surface::open_pbr", "std::surface::disney_principled"):
        values, samples = evaluating(module)
        print(f"{module}, a million on one core: eval {values:.2f} s, sample {samples:.2f} s")
    command, python = rendering()
    print(f"a render: the command {command:.2f} s of the processor, Python {python:.2f} s ({100 * (python / command - 1):+.1f} %)")
    print(json.dumps({"processor": impasto.devices()[-1]["name"]}))


if __name__ == "__main__":
    main()
