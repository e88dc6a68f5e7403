"""Studies: error against run time, by strategies of the command and of one's own."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Union

from . import _impasto
from ._device import wanted
from ._plan import Plan, Profile, Strategy, Workload, plan
from ._render import _count, _scene_of, _strings


class Study:
    """What a study found. Results, plots and a page are in its folder (docs/converge.md)."""

    def __init__(self, found: dict[str, Any], folder: str) -> None:
        self._found = found
        #: The folder of results.
        self.folder = folder

    @property
    def scene(self) -> dict[str, Any]:
        """All that was found of the scene: the fields of docs/converge.md."""
        return dict(self._found["scenes"][0])

    @property
    def page(self) -> str:
        """The page of plots and tables."""
        return os.path.join(self.folder, "index.html")

    @property
    def series(self) -> list[dict[str, Any]]:
        """Renders by one strategy and sampler: ``strategy``, ``sampler``, ``points``, ``fits``."""
        return list(self.scene["series"])

    def curve(self, strategy: str, metric: str = "rmse") -> list[tuple[int, float, float]]:
        """Of each number of samples a pixel: samples, mean seconds of the device, and the error of the renders: ``rmse`` (the
        root of the mean squared error), ``relmse`` or ``flip``.

        Raises:
            KeyError: There is no series of that strategy, or no such metric.
        """
        for series in self.series:
            if series["strategy"] == strategy:
                return [_point(point, metric) for point in series["points"]]
        raise KeyError(f"there is no series of {strategy!r}: there are {', '.join(s['strategy'] for s in self.series)}")

    def __repr__(self) -> str:
        return f"<study of {self.scene['name']}: {', '.join(series['strategy'] for series in self.series)}>"


def _point(point: dict[str, Any], metric: str) -> tuple[int, float, float]:
    runs = point["runs"]
    if metric not in ("rmse", "relmse", "flip"):
        raise KeyError(f"there is no metric {metric!r}: there are rmse, relmse, flip")
    if not runs:
        return (point["samples"], math.nan, math.nan)
    seconds = sum(run["gpu_seconds"] for run in runs) / len(runs)
    error = sum(run["errors"]["mse" if metric == "rmse" else metric] for run in runs) / len(runs)
    return (point["samples"], seconds, math.sqrt(error) if metric == "rmse" else error)


def study(
    scene: Any,
    out: str | os.PathLike[str],
    *,
    strategies: Sequence[Union[str, Strategy, Plan]] | Mapping[str, Plan] = ("auto",),
    samplers: Sequence[str] = ("sobol",),
    samples: Sequence[int] = (1, 4, 16, 64),
    seeds: int = 4,
    seed: int = 0,
    reference: str | os.PathLike[str] | None = None,
    reference_samples: int | None = None,
    seconds: float | None = None,
    fresh: bool = False,
    workload: Workload | None = None,
    profile: Profile | None = None,
    device: str | None = None,
    threads: int | None = None,
    pool: int | None = None,
    progress: Callable[[float, str], Any] | None = None,
) -> Study:
    """Measures error against run time, as ``impasto converge``.

    A strategy is a name, a `Plan`, or a function of a request as `plan` takes it, with ``workload`` and ``profile`` if it
    asks for them. After Ctrl-C, what was done stays in the folder, and the same call goes on from it.

    Args:
        scene: The scene.
        out: The folder of results.
        strategies: A series for each; with names in a mapping of plans.
        samplers: ``sobol``, ``owen``, ``independent``.
        samples: Samples a pixel, ascending.
        seeds, seed: How many renders of each number of samples, and their first seed.
        reference: A picture that is the truth; one is made by default.
        reference_samples: The most samples a pixel of a reference that is made.
        seconds: The time after which nothing new is begun.
        fresh: Whether other results in the folder are removed.
        device, threads, pool, progress: As of `render`.

    Raises:
        Error, ValueError, TypeError: As `render` and `plan`; and if the folder cannot be used.
    """
    scene = _scene_of(scene)
    names: list[str] = []
    plans: list[tuple[str, Any]] = []
    if isinstance(strategies, Mapping):
        plans = [(str(name), made._inner) for name, made in strategies.items()]
    else:
        if isinstance(strategies, str):
            raise TypeError(f"`strategies` is {strategies!r}: expected a list")
        for strategy in strategies:
            if isinstance(strategy, str):
                names.append(strategy)
                continue
            made = strategy if isinstance(strategy, Plan) else plan(scene, strategy, workload=workload, profile=profile)
            plans.append((made.strategy, made._inner))
    asked = {
        "name": scene.name,
        "out": os.fspath(out),
        "strategies": names,
        "samplers": _strings("samplers", samplers),
        "samples": [_count("samples", number) for number in samples],
        "seed": _count("seed", seed, 0),
        "seeds": _count("seeds", seeds),
        "pool": None if pool is None else _count("pool", pool),
        "reference": None if reference is None else os.fspath(reference),
        "reference_samples": reference_samples,
        "seconds": seconds,
        "fresh": bool(fresh),
        "device": wanted(device, threads),
    }
    return Study(json.loads(_impasto.study(scene._scene, asked, plans, progress)), os.fspath(out))
