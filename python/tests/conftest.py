"""What all tests share: the repository's folders, and small scenes."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import impasto

ROOT = Path(__file__).parents[2]

DIFFUSE = """use std::bsdf::diffuse;

/// A plain wall.
material wall {
    /// Its color.
    param tint: color = srgb(0x808080);
    /// Its share of light.
    param share: float = 0.5 in 0 .. 1;
    surface = diffuse(share * tint);
}
"""

QUAD = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], dtype=np.float32)
CORNERS = np.array([[0, 2, 1], [0, 3, 2]])


@pytest.fixture(scope="session")
def root() -> Path:
    return ROOT


@pytest.fixture
def wall() -> impasto.Material:
    return impasto.Material(source=DIFFUSE)


def floor_scene(width: int = 16, height: int = 12, **material: object) -> impasto.Scene:
    """A white floor below light of one color from everywhere."""
    return (
        impasto.SceneBuilder(width, height, max_depth=2, name="floor")
        .camera(position=(0, 1, 2), look_at=(0, 0, 0), fov=40)
        .material("wall", impasto.Material(source=DIFFUSE, tint=(1, 1, 1), **material))
        .mesh("floor", 100 * QUAD, CORNERS, uvs=QUAD[:, ::2], material="wall")
        .environment(color=(2, 2, 2))
        .build()
    )


@pytest.fixture
def floor() -> impasto.Scene:
    return floor_scene()


@pytest.fixture
def run() -> Callable[..., subprocess.CompletedProcess[str]]:
    """Runs a text of Python in a process of its own."""

    def run(text: str, timeout: float = 120) -> subprocess.CompletedProcess[str]:
        here = str(Path(__file__).parent)
        command = [sys.executable, "-c", f"import sys; sys.path.insert(0, {here!r})\n{text}"]
        return subprocess.run(command, capture_output=True, text=True, timeout=timeout, cwd=ROOT)

    return run


@pytest.fixture
def gpu() -> str:
    """A GPU, which may be software."""
    if all(device["kind"] == "processor" for device in impasto.devices()):
        pytest.skip("there is no GPU, and no software Vulkan")
    return "gpu"
