"""Plans: which materials share a kernel. Time models, searches and strategies can be written in Python."""

from __future__ import annotations

import html
import json
import os
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, Protocol, Union

from . import _impasto
from ._device import wanted

if TYPE_CHECKING:
    from ._material import Material
    from ._scene import Scene

#: Kernels: the form of each (``own``, ``mixed``, ``binned`` or ``inline``) and the indices of its materials, ascending.
Groups = Sequence["tuple[str, Sequence[int]]"]

#: The forms that kernels can have.
FORMS = ("own", "mixed", "binned", "inline")


class TimeModel(Protocol):
    """What kernels take. Any object with this method is one."""

    def seconds(self, form: str, members: Sequence[int], /) -> float:
        """Seconds of an iteration that a kernel of a form over some materials (indices, ascending) takes; of inline
        materials, by how much they make the logic kernel slower. A finite number of at least 0."""
        ...


class Search(Protocol):
    """A way to find a good partition. Any object with this method is one."""

    def search(self, problem: Problem, model: TimeModel, /) -> Groups:
        """Kernels that hold each of the problem's materials once, with at most one inline."""
        ...


class Problem:
    """What to find a partition of."""

    def __init__(self, materials: Iterable[int], names: Sequence[str], forms: Sequence[str] = FORMS) -> None:
        #: The materials to be placed: indices, ascending.
        self.materials: list[int] = list(materials)
        #: The names of all materials, by index.
        self.names: list[str] = list(names)
        #: The forms that kernels may have.
        self.forms: list[str] = list(forms)

    def __repr__(self) -> str:
        return f"<problem of {len(self.materials)} materials>"


class Calibrated:
    """The model of this project: costs of materials weighed by a device profile (docs/plan.md)."""

    def __init__(self, materials: Materials, workload: Workload, profile: Profile) -> None:
        self._inner = _impasto.Model.calibrated(materials._inner, workload._inner, profile._inner)

    def seconds(self, form: str, members: Sequence[int]) -> float:
        """What a search compares: the prediction, and what it may be short of."""
        return self._inner.seconds(form, list(members))

    def predict(self, form: str, members: Sequence[int]) -> dict[str, float]:
        """The prediction in parts: launch, latency, issue, memory, logic, total; in seconds."""
        parts: dict[str, float] = json.loads(self._inner.predict(form, list(members)) or "{}")
        return parts


class _OurSearch:
    _name: str

    def search(self, problem: Problem, model: TimeModel) -> Groups:
        """Kernels that hold each of the problem's materials once. What the model raises comes through."""
        inner = model._inner if isinstance(model, Calibrated) else _impasto.Model.of_python(model.seconds)
        return _impasto.search(self._name, list(problem.materials), list(problem.forms), inner)


class Automatic(_OurSearch):
    """Exact up to ten materials, heuristic beyond."""

    _name = "automatic"


class Exact(_OurSearch):
    """Every partition; for few materials."""

    _name = "exact"


class Heuristic(_OurSearch):
    """Local moves from several starts; for many materials."""

    _name = "heuristic"


class Materials:
    """What is known of a scene's materials without rendering it."""

    def __init__(self, inner: _impasto.Materials) -> None:
        self._inner = inner
        #: Their names, in the order of indices.
        self.names: list[str] = inner.names()
        #: The indices of those that no surface binds.
        self.unused: list[int] = inner.unused()
        #: What each costs, by index: the fields of docs/cost.md; ``None`` of what is on no surface.
        self.costs: list[dict[str, Any] | None] = json.loads(inner.costs())

    def problem(self) -> Problem:
        """The materials that are on some surface, to be placed in kernels of any form."""
        return Problem((m for m in range(len(self.names)) if m not in self.unused), self.names)

    def __repr__(self) -> str:
        return f"<materials {', '.join(self.names)}>"


class Request:
    """What a strategy is asked: a plan for ``materials``, for what is known of them.

    ``workload``, ``profile`` and ``model`` are ``None`` where nobody knows.
    """

    def __init__(
        self, materials: Materials, workload: Workload | None, profile: Profile | None, model: TimeModel | None
    ) -> None:
        self.materials = materials
        self.problem = materials.problem()
        self.workload = workload
        self.profile = profile
        self.model = model


#: A strategy of one's own: from a request to kernels.
Strategy = Callable[[Request], Groups]


class Workload:
    """How paths hit the materials of a scene: measured by `workload`, or read by `Workload.load`."""

    def __init__(self, inner: _impasto.Workload) -> None:
        self._inner = inner
        self._fields: dict[str, Any] = json.loads(inner.json())

    @staticmethod
    def load(path: str | os.PathLike[str], scene: Scene | str | os.PathLike[str], samples: int = 16) -> Workload:
        """Reads what ``impasto plan --save-workload`` wrote.

        Raises:
            OSError: The file cannot be read.
            PlanError: It is broken, or of another scene.
        """
        with open(path, encoding="utf-8") as file:
            return Workload.parse(file.read(), materials(scene, samples=samples))

    @staticmethod
    def parse(text: str, materials: Materials) -> Workload:
        """The workload of a JSON text, for some materials."""
        return Workload(_impasto.Workload.parse(text, materials._inner))

    @property
    def pool(self) -> int:
        """Paths in flight."""
        return int(self._fields["pool"])

    @property
    def hits(self) -> list[dict[str, Any]]:
        """Of each material ``share`` (hits in an iteration over slots), ``present``, ``loads`` and ``stores``."""
        return list(self._fields["materials"])

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes it as JSON."""
        with open(path, "w", encoding="utf-8") as file:
            file.write(json.dumps(self._fields, indent=2) + "\n")

    def __repr__(self) -> str:
        return f"<workload of {len(self.hits)} materials, {self.pool} paths in flight>"

    def _repr_html_(self) -> str:
        rows = [(hit["material"], f"{hit['share']:.4f}", f"{hit['present']:.4f}") for hit in self.hits]
        return _table(("material", "share of slots", "share of blocks"), rows)


class Profile:
    """What the operations of a GPU take; `profile` finds one."""

    def __init__(self, inner: _impasto.Profile) -> None:
        self._inner = inner
        self._fields: dict[str, Any] = json.loads(inner.json())
        #: Its name.
        self.name: str = inner.name()
        #: Whether it is that of the device, and not one scaled from another's.
        self.exact: bool = inner.exact()

    @property
    def device(self) -> str:
        """The GPU that it was fitted to."""
        return str(self._fields["device"])

    @property
    def weights(self) -> dict[str, float]:
        """The constants of the time model, in seconds (docs/calibrate.md)."""
        return dict(self._fields["weights"])

    def __repr__(self) -> str:
        return f"<profile {self.name} of {self.device}>"

    def _repr_html_(self) -> str:
        return _table(("weight", "value"), [(name, f"{value:.4g}") for name, value in self.weights.items()])


class Plan:
    """Which kernels a render runs. It was held to the rules of plans when it was made."""

    def __init__(
        self,
        inner: _impasto.Plan,
        materials: Materials | None = None,
        workload: Workload | None = None,
        profile: Profile | None = None,
    ) -> None:
        self._inner = inner
        self._known = (materials, workload, profile)

    @property
    def strategy(self) -> str:
        """The strategy that made it."""
        return self._inner.strategy()

    @property
    def kernels(self) -> list[tuple[str, str, list[str]]]:
        """Of each kernel its name, its form and the names of its materials."""
        return self._inner.kernels()

    @property
    def unused(self) -> list[str]:
        """Materials without a kernel, since no surface binds them."""
        return self._inner.unused()

    @property
    def partition(self) -> str:
        """The kernels as a string that ``--partition`` takes."""
        return self._inner.partition()

    def explain(self) -> dict[str, Any] | None:
        """Why it is as it is by the calibrated model (docs/plan.md); ``None`` without a workload and a profile."""
        explained = self._explained()
        return None if explained is None else json.loads(explained[1])

    def _explained(self) -> tuple[str, str] | None:
        materials, workload, profile = self._known
        if materials is None or workload is None or profile is None:
            return None
        return self._inner.explained(materials._inner, workload._inner, profile._inner)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes a plan file, which ``--plan`` takes."""
        self._inner.save(os.fspath(path))

    def __str__(self) -> str:
        explained = self._explained()
        return explained[0] if explained else self.partition

    def __repr__(self) -> str:
        return f"<plan by {self.strategy}: {self.partition}>"

    def _repr_html_(self) -> str:
        found = self.explain()
        predicted = {kernel["name"]: kernel["predicted"]["total"] for kernel in found["kernels"]} if found else {}
        titles = ["kernel", "form", "materials", *(["predicted"] if found else [])]
        rows = [
            (name, form, ", ".join(members), *([f"{1e6 * predicted[name]:.1f} us"] if found else []))
            for name, form, members in self.kernels
        ]
        return f"<b>plan by {html.escape(self.strategy)}</b>" + _table(titles, rows)


def _table(titles: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    head = "".join(f"<th>{html.escape(title)}</th>" for title in titles)
    cells = ["".join(f'<td style="text-align: left">{html.escape(str(cell))}</td>' for cell in row) for row in rows]
    return f"<table><tr>{head}</tr>" + "".join(f"<tr>{row}</tr>" for row in cells) + "</table>"


def materials(scene: Any, *, samples: int = 1024, progress: Callable[[float, str], Any] | None = None) -> Materials:
    """What is known of a scene's materials, each evaluated at ``samples`` points of its surfaces.

    Raises:
        Error: The scene or a material has errors.
    """
    from ._render import _count, _scene_of

    samples = _count("samples", samples)
    return Materials(_impasto.Materials.of_scene(_scene_of(scene)._scene, samples, progress))


def workload(
    scene: Any,
    *,
    device: str | None = "gpu",
    pool: int | None = None,
    progress: Callable[[float, str], Any] | None = None,
) -> Workload:
    """How paths hit the materials of a scene, from a few iterations of rendering it on a GPU.

    Raises:
        DeviceError: There is no GPU. (Mesa's software Vulkan will do.)
        Error: The scene or a material has errors.
    """
    from ._render import _scene_of

    return Workload(_impasto.workload(_scene_of(scene)._scene, wanted(device, None), pool, progress))


def profile(name: str | os.PathLike[str] | None = None, *, device: str | None = "gpu") -> Profile:
    """A device profile: one that is part of the program (``h200``, ``llvmpipe``), a file of ``impasto calibrate``, or without a
    name the one that fits a device best.

    Raises:
        ValueError: There is no profile of that name.
        PlanError: The file is no profile.
        DeviceError: There is no such device.
    """
    if name is None:
        return Profile(_impasto.Profile.of_device(wanted(device, None)))
    path = os.fspath(name)
    if os.path.exists(path):
        with open(path, encoding="utf-8") as file:
            return Profile(_impasto.Profile.parse(file.read()))
    return Profile(_impasto.Profile.named(path))


def plan(
    scene: Scene | Material | Materials | str | os.PathLike[str],
    strategy: Union[str, Strategy, None] = None,
    *,
    model: TimeModel | None = None,
    search: Search | None = None,
    partition: str | None = None,
    workload: Workload | None = None,
    profile: Profile | str | os.PathLike[str] | None = None,
    samples: int = 1024,
    progress: Callable[[float, str], Any] | None = None,
) -> Plan:
    """Decides which materials share a kernel.

    A ``strategy`` is a name as of ``impasto plan --strategy``, or a function from a `Request` to kernels. Without one, the
    ``search`` (`Automatic` by default) finds what the ``model`` (`Calibrated` by default) likes best. Any of the three can
    be written in Python. A model may be slow, raise or be ended by Ctrl-C: what it raises comes through as it is.

    The calibrated model needs a workload and a profile. They are measured and found for the GPU where they are needed and
    not given; give both where there is no GPU.

    Args:
        scene: The scene, or what is known of its materials (`materials`), which is then not computed again.
        strategy, model, search: As above.
        partition: The plan as a string, such as ``"own:paint|binned:wood,marble|inline:*"``, in place of these.
        workload: How paths hit materials.
        profile: A profile, or the name or file of one.
        samples: At how many points each material is evaluated.
        progress: As of `render`.

    Raises:
        PlanError: The strategy must know more, or what came out is no plan for these materials.
        TypeError, ValueError: A model or a strategy of Python gave what is no time or no kernels.
        Error: The scene or a material has errors.
    """
    from ._render import _scene_of

    if sum(given is not None for given in (strategy, search or model, partition)) > 1:
        raise TypeError("give one of `strategy`, `partition`, and `model` with `search`")
    known_scene = None if isinstance(scene, Materials) else _scene_of(scene)
    known = scene if isinstance(scene, Materials) else materials(known_scene, samples=samples, progress=progress)
    if isinstance(profile, (str, os.PathLike)):
        profile = _profile_named(profile)

    def needed() -> tuple[Workload, Profile]:
        nonlocal workload, profile
        if workload is None:
            if known_scene is None:
                raise TypeError("give the `workload` of these materials")
            workload = _workload_of(known_scene, progress)
        if profile is None:
            profile = _profile_named(None)
        assert isinstance(profile, Profile)
        return workload, profile

    def made(inner: _impasto.Plan) -> Plan:
        return Plan(inner, known, workload, profile if isinstance(profile, Profile) else None)

    if partition is not None:
        return made(_impasto.Plan.of_text(partition, known._inner))
    if isinstance(strategy, str) or (strategy is None and model is None and search is None):
        name = strategy if isinstance(strategy, str) else "auto"
        if _impasto.Plan.requires(name) == "workload":
            needed()
        inner_workload = workload._inner if workload else None
        inner_profile = profile._inner if isinstance(profile, Profile) else None
        return made(_impasto.plan_of_strategy(name, known._inner, inner_workload, inner_profile))
    if strategy is not None:
        if not callable(strategy):
            raise TypeError(f"`strategy` is {strategy!r}: expected a name, or a function of a request")
        known_model = model
        if model is None and workload is not None and isinstance(profile, Profile):
            known_model = Calibrated(known, workload, profile)
        request = Request(known, workload, profile if isinstance(profile, Profile) else None, known_model)
        title = getattr(strategy, "__name__", type(strategy).__name__)
        return made(_of_groups(title, strategy(request), known, "the strategy"))
    if model is None:
        model = Calibrated(known, *needed())
    if not callable(getattr(model, "seconds", None)):
        raise TypeError(f"`model` is {model!r}: expected an object with a method `seconds(form, members)`")
    search = search or Automatic()
    if not callable(getattr(search, "search", None)):
        raise TypeError(f"`search` is {search!r}: expected an object with a method `search(problem, model)`")
    groups = search.search(known.problem(), model)
    return made(_of_groups(type(search).__name__.lower(), groups, known, "the search"))


def _of_groups(title: str, groups: Any, known: Materials, who: str) -> _impasto.Plan:
    """The plan of kernels that code of Python gave, in the form that plans have."""
    try:
        plain = [(str(form), sorted(int(member.__index__()) for member in members)) for form, members in groups]
    except (TypeError, ValueError, AttributeError):
        shown = repr(groups)
        shown = shown if len(shown) <= 200 else shown[:200] + "..."
        raise TypeError(f"{who} gave {shown}: expected kernels, each a form and indices of materials") from None
    if any(member < 0 for _, members in plain for member in members):
        raise ValueError(f"{who} gave an index below 0: materials count from 0")
    return _impasto.Plan.of_groups(title, plain, known._inner)


def _workload_of(scene: Scene, progress: Callable[[float, str], Any] | None) -> Workload:
    return workload(scene, progress=progress)


def _profile_named(name: str | os.PathLike[str] | None) -> Profile:
    return profile(name)
