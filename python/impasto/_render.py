"""Renders: pictures, the outputs beside them, and their reports."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from . import _impasto
from ._device import wanted
from ._material import Material
from ._plan import Plan, Profile
from ._scene import Scene, load

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

#: Called while something takes its time, with the share that is done (0 to 1) and what is done now. Returning ``False`` ends
#: it, and what is done by then is the result.
Progress = Callable[[float, str], Any]


class Picture:
    """A picture with the outputs beside it. It shows itself in notebooks."""

    def __init__(self, rendering: _impasto.Rendering) -> None:
        self._rendering = rendering
        self._layers = {entry[0]: entry for entry in rendering.layers()}
        self._arrays: dict[str, NDArray[np.float32]] = {}
        self._report: dict[str, Any] | None = None

    @property
    def pixels(self) -> NDArray[np.float32]:
        """Mean radiance, linear RGB (Rec. 709): float32 of shape (height, width, 3), the top row first."""
        return self["radiance"]

    @property
    def outputs(self) -> list[str]:
        """The names of what it holds: ``radiance``, ``samples``, and the outputs that were asked for."""
        return ["radiance", "samples", *(name for name in self._layers if name != "samples")]

    def channels(self, output: str) -> list[str]:
        """The names of the channels of an output, as an OpenEXR file has them."""
        known = {"radiance": ["R", "G", "B"], "samples": ["samples"]}
        return known[output] if output in known else list(self._layer(output)[2])

    def names(self, output: str) -> list[str]:
        """What the ids of an output stand for, such as the names of materials; nothing of other outputs."""
        return [] if output in ("radiance", "samples") else list(self._layer(output)[3])

    def _layer(self, name: str) -> tuple[Any, ...]:
        if name not in self._layers:
            raise KeyError(f"there is no output {name!r}: it has {', '.join(self.outputs)}")
        return self._layers[name]

    def __getitem__(self, output: str) -> NDArray[np.float32]:
        """An output: float32 of shape (height, width, channels), the top row first.

        Of ids (``material``, ``object``), channels are pairs of an index into `names` (-1 for none) and the share of
        the pixel's samples, the most frequent first.
        """
        if output not in self._arrays:
            if output == "radiance":
                self._arrays[output] = self._rendering.radiance()
            elif output == "samples":
                self._arrays[output] = self._rendering.samples()
            else:
                self._layer(output)
                found = self._rendering.layer(output)
                assert found is not None
                self._arrays[output] = found
        return self._arrays[output]

    def __iter__(self) -> Any:
        return iter(self.outputs)

    @property
    def report(self) -> dict[str, Any]:
        """What the render took: the fields of docs/report.md."""
        if self._report is None:
            self._report = json.loads(self._rendering.report())
        return self._report

    def save(self, path: str | os.PathLike[str], exposure: float = 0.0) -> None:
        """Writes ``.exr`` (linear, with all outputs), ``.png`` (``exposure`` stops brighter) or ``.film`` (for ``impasto merge``).

        Raises:
            FileError: It cannot be written; an older file is as it was.
            ValueError: The name has another ending.
        """
        self._rendering.save(os.fspath(path), float(exposure))

    def png(self, exposure: float = 0.0) -> bytes:
        """A PNG file of what a screen shows, ``exposure`` stops brighter."""
        return self._rendering.png(float(exposure))

    def _repr_png_(self) -> bytes:
        return self.png()

    def __repr__(self) -> str:
        height, width, _ = self.pixels.shape
        report = self.report
        return f"<picture of {width}x{height} pixels, {report['paths'] / (width * height):.0f} samples a pixel, {', '.join(self.outputs)}>"


def render(
    scene: Scene | Material | str | os.PathLike[str],
    *,
    samples: int | None = None,
    size: tuple[int, int] | None = None,
    outputs: Sequence[str] = (),
    seed: int = 0,
    first_sample: int = 0,
    relmse: float | None = None,
    rmse: float | None = None,
    seconds: float | None = None,
    plan: Plan | None = None,
    strategy: str | None = None,
    partition: str | None = None,
    profile: Profile | None = None,
    device: str | None = None,
    threads: int | None = None,
    pool: int | None = None,
    on: str = "ball",
    progress: Progress | None = None,
) -> Picture:
    """Renders a scene, or a material on a built-in set.

    Other threads of Python run meanwhile. Ctrl-C ends it and raises ``KeyboardInterrupt``, as soon as the samples that were
    begun are done.

    Args:
        scene: A scene, the path of one, a material, or the path of one.
        samples: Samples a pixel; 64 by default, and a limit if the render ends by a goal.
        size: Width and height in pixels, for this picture only.
        outputs: Outputs beside the picture, such as ``albedo``, ``normal`` and ``depth``; `impasto.outputs` lists them.
        seed: Equal seeds give equal pictures.
        first_sample: The index of the first sample: disjoint ranges can be merged.
        relmse, rmse, seconds: Goals: an estimated error that is small enough, or a time. The first one that is reached
            ends the render.
        plan: Which materials share a kernel.
        strategy, partition: The same as of ``impasto render``, in place of a plan.
        profile: The device profile of the automatic plan.
        device: ``None`` for the best device, ``"cpu"``, ``"gpu"``, or what ``--gpu`` takes.
        threads: Threads of the processor.
        pool: Paths in flight.
        on: The set for a material: ``ball``, ``cloth`` or ``plane``.
        progress: Called with the share that is done and a line for people. If it returns ``False``, the picture has the
            samples that were done by then. What it raises ends the render and comes through.

    Raises:
        Error: The scene, a material, the plan or the device; with diagnostics.
        ValueError, TypeError: An argument.
    """
    scene = _scene_of(scene, on)
    options = {
        "samples": None if samples is None else _count("samples", samples),
        "first_sample": _count("first_sample", first_sample, 0),
        "seed": _count("seed", seed, 0),
        "pool": None if pool is None else _count("pool", pool),
        "outputs": _strings("outputs", outputs),
        "relmse": relmse,
        "rmse": rmse,
        "seconds": seconds,
        "strategy": strategy,
        "partition": partition,
        "device": wanted(device, threads),
        "size": None if size is None else (_count("size", size[0]), _count("size", size[1])),
    }
    if sum(given is not None for given in (plan, strategy, partition)) > 1:
        raise TypeError("give one of `plan`, `strategy` and `partition`")
    if progress is not None and not callable(progress):
        raise TypeError(f"`progress` is {progress!r}: expected a function of a share and a text")
    return Picture(
        _impasto.render(scene._scene, options, _inner(plan, Plan, "plan"), _inner(profile, Profile, "profile"), progress)
    )


def _inner(value: Any, kind: type, name: str) -> Any:
    if value is None:
        return None
    if not isinstance(value, kind):
        raise TypeError(f"`{name}` is {value!r}: expected an impasto.{kind.__name__}")
    return getattr(value, "_inner")


def _strings(name: str, value: Sequence[str]) -> list[str]:
    if isinstance(value, str):
        raise TypeError(f"`{name}` is {value!r}: expected a list of names")
    return [str(item) for item in value]


def _count(name: str, value: Any, least: int = 1) -> int:
    try:
        number = value.__index__()
    except AttributeError:
        raise TypeError(f"`{name}` is {value!r}: expected an integer") from None
    if not least <= number < 2**32:
        raise ValueError(f"`{name}` is {number}: expected an integer from {least} to {2**32 - 1}")
    return int(number)


def _scene_of(given: Scene | Material | str | os.PathLike[str], on: str = "ball") -> Scene:
    """A scene, whatever it is given as."""
    if isinstance(given, Scene):
        return given
    if isinstance(given, Material):
        return Scene.of(given, on)
    if not isinstance(given, (str, os.PathLike)):
        raise TypeError(f"`scene` is {given!r}: expected a scene, a material, or the path of one")
    path = os.fspath(given)
    if path.startswith("std::") or path.endswith((".impasto", ".mtlx")):
        return Scene.of(path, on)
    return load(path)


def outputs() -> dict[str, str]:
    """The outputs that `render` takes beside the picture, each with what it is (docs/outputs.md)."""
    return dict(_impasto.outputs())


def devices() -> list[dict[str, Any]]:
    """Every device that can render: GPUs, the best first, and the processor (docs/devices.md)."""
    found: list[dict[str, Any]] = json.loads(_impasto.devices())
    return found
