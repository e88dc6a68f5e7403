"""The package itself: how soon it is there, the program in it, its types and its docs."""

from __future__ import annotations

import inspect
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import impasto


def test_importing_takes_a_moment() -> None:
    # The goal is 100 ms for the package without the start of Python; the best of some tries, since machines are shared.
    code = "import time; begin = time.perf_counter(); import impasto; print(time.perf_counter() - begin)"
    tries = [float(subprocess.check_output([sys.executable, "-c", code])) for _ in range(5)]
    assert min(tries) < 0.3, tries


def test_importing_starts_nothing() -> None:
    code = "import impasto, sys, threading; print('numpy' in sys.modules, threading.active_count())"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).split() == ["False", "1"]


def command(*args: str, **keys: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "impasto", *args], capture_output=True, text=True, **keys)


def test_the_program_is_in_the_package(tmp_path: Path) -> None:
    done = command("--version")
    assert done.returncode == 0 and done.stdout.split() == ["impasto", impasto.__version__]
    assert command("explain", "E0201").returncode == 0
    assert command("no-such-command").returncode == 2
    (tmp_path / "broken.impasto").write_text("material {")
    assert command("check", str(tmp_path / "broken.impasto")).returncode == 1
    script = Path(sys.executable).parent / "impasto"
    if script.exists():
        assert subprocess.check_output([str(script), "--version"], text=True) == done.stdout


@pytest.mark.skipif(os.name != "posix", reason="signals are sent as on Unix")
def test_ctrl_c_ends_the_program_as_it_ends_the_command(root: Path, tmp_path: Path) -> None:
    scene = str(root / "examples/cornell/scene.toml")
    args = ["render", scene, "--spp", "1000000", "--size", "64x48", "--device", "cpu", "--out", str(tmp_path / "a.png")]
    process = subprocess.Popen([sys.executable, "-m", "impasto", *args], stderr=subprocess.PIPE, text=True)
    time.sleep(4)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130, said
    assert "stopping" in said
    # A command that does nothing at Ctrl-C is ended by it.
    process = subprocess.Popen([sys.executable, "-m", "impasto", "lsp"], stdin=subprocess.PIPE)
    time.sleep(1)
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=30) == -signal.SIGINT


def test_everything_public_has_a_docstring() -> None:
    missing = []
    for name in impasto.__all__:
        public = getattr(impasto, name)
        if name.startswith("__"):
            continue
        if not inspect.getdoc(public):
            missing.append(name)
        if inspect.isclass(public) and not issubclass(public, tuple):
            members = vars(public).items()
            own = [(key, value) for key, value in members if not key.startswith("_")]
            functions = [(key, value) for key, value in own if callable(value) or isinstance(value, (property, staticmethod))]
            missing += [f"{name}.{key}" for key, value in functions if not inspect.getdoc(value)]
    assert not missing


def test_types_are_those_of_the_code() -> None:
    if shutil.which("mypy") is None and not _has_mypy():
        pytest.skip("mypy is not here")
    folder = Path(impasto.__file__).parent
    assert (folder / "py.typed").exists()
    options = ["--strict", "--cache-dir", os.devnull]
    done = subprocess.run([sys.executable, "-m", "mypy", *options, "-p", "impasto"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
    done = subprocess.run(
        [sys.executable, "-m", "mypy.stubtest", "impasto._impasto", "--ignore-missing-stub", "--ignore-disjoint-bases"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout


def _has_mypy() -> bool:
    try:
        import mypy  # noqa: F401
    except ImportError:
        return False
    return True
