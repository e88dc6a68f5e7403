"""Questions about materials and scenes: check, emit, cost, eval, sample, inspect, explain."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Union, overload

from . import _impasto
from ._errors import Diagnostics, diagnostics_of
from ._material import Bsdf, Material, Samples, Scattering
from ._plan import _table
from ._render import _count, _scene_of
from ._scene import Scene

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

#: A material, or the path of a file of one.
Subject = Union[Material, str, "os.PathLike[str]"]


class _Text(str):
    """The text of a material, where others are paths."""


def _file(subject: Subject) -> tuple[str, dict[str, str], str | None, list[tuple[str, str, Any]]]:
    """File, texts, material and parameters of what may not even compile."""
    if isinstance(subject, Material):
        return subject._file, subject._texts(), subject._name, subject._params()
    if isinstance(subject, _Text):
        return "<python>", {"<python>": str(subject)}, None, []
    return os.fspath(subject), {}, None, []


def check(subject: Subject | Scene | None = None, *, source: str | None = None) -> Diagnostics:
    """Every problem of a material file, a text, or a scene with all that it names. Nothing is raised for problems.

    Args:
        subject: The path of a material or scene, a `Material`, or a `Scene`.
        source: The text of a material, in place of these.

    Raises:
        FileError: There is no such file.
    """
    if (subject is None) == (source is None):
        raise TypeError("check a `subject`, or a text `source`: give one of the two")
    if source is not None:
        found, text = _impasto.check("<python>", {"<python>": source}, None)
    elif isinstance(subject, Scene):
        found, text = _impasto.check("", {}, subject._scene)
    elif isinstance(subject, Material) or _is_material(subject):
        found, text = _impasto.check(*_file(subject)[:2], None)  # type: ignore[arg-type]
    else:
        from ._errors import SceneError

        try:
            found, text = _impasto.check("", {}, _scene_of(subject)._scene)  # type: ignore[arg-type]
        except SceneError as error:
            return error.diagnostics
    return Diagnostics(diagnostics_of(found), text)


def _is_material(subject: Any) -> bool:
    path: str = os.fspath(subject)
    return path.startswith("std::") or path.endswith((".impasto", ".mtlx"))


def emit(
    subject: Subject | None = None,
    what: str = "wgsl",
    *,
    source: str | None = None,
    material: str | None = None,
    target: str = "native",
    table: bool = False,
) -> str:
    """A stage of the compilation of a material file.

    Args:
        subject: The file, or a material; ``source`` is the text of one, in its place.
        what: ``tokens``, ``ast``, ``ir``, ``wgsl``, ``docs`` or ``params`` (the last two are JSON).
        material: Which material of the file; all by default.
        target: Of ``wgsl``: ``native``, or ``webgpu`` for a module for browsers.
        table: Whether values of parameters are read from a table.

    Raises:
        SourceError: It has errors.
        ValueError: There is no such stage or target.
    """
    if (subject is None) == (source is None):
        raise TypeError("emit a `subject`, or a text `source`: give one of the two")
    if source is not None:
        subject = _Text(source)
    assert subject is not None
    file, texts, name, params = _file(subject)
    name = material if material is not None else name
    if what == "params":
        found = [entry for entry in json.loads(_impasto.interface(file, texts)) if name in (None, entry["name"])]
        return json.dumps(found, indent=2) + "\n"
    return _impasto.emit(file, texts, what, name, target, table, params)


class Costs(Sequence[Mapping[str, Any]]):
    """What evaluating materials costs: for each the fields of docs/cost.md. A table in notebooks."""

    def __init__(self, costs: list[dict[str, Any]]) -> None:
        self._all = costs

    @overload
    def __getitem__(self, index: int) -> Mapping[str, Any]: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Mapping[str, Any]]: ...
    @overload
    def __getitem__(self, index: str) -> Mapping[str, Any]: ...
    def __getitem__(self, index: int | slice | str) -> Any:
        if isinstance(index, str):
            for cost in self._all:
                if cost["name"] == index:
                    return cost
            raise KeyError(f"there is no material {index!r}: there are {', '.join(c['name'] for c in self._all)}")
        return self._all[index]

    def __iter__(self) -> Iterator[Mapping[str, Any]]:
        return iter(self._all)

    def __len__(self) -> int:
        return len(self._all)

    def _rows(self) -> list[tuple[str, str, str, str, str]]:
        def row(entry: Mapping[str, Any]) -> tuple[str, str, str, str, str]:
            cost = entry["cost"]
            if cost is None:
                return (entry["name"], "-", "-", "-", str(entry["lobes"]))
            mean = cost["operations"]["mean"]
            return (entry["name"], f"{mean:.0f}", str(cost["live"]), str(cost["code"]), str(entry["lobes"]))

        return [row(entry) for entry in self._all]

    _TITLES = ("material", "operations", "live numbers", "code", "lobes")

    def __repr__(self) -> str:
        rows = [self._TITLES, *self._rows()]
        widths = [max(len(row[column]) for row in rows) for column in range(len(self._TITLES))]
        return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in rows)

    def _repr_html_(self) -> str:
        return _table(self._TITLES, self._rows())


def cost(subject: Subject | Scene, *, samples: int = 1024) -> Costs:
    """What evaluating the materials of a file costs, or those of a scene on its surfaces.

    Args:
        samples: At how many points each is evaluated.

    Raises:
        Error: The material or scene has errors.
    """
    samples = _count("samples", samples)
    if isinstance(subject, Scene) or not (isinstance(subject, Material) or _is_material(subject)):
        return Costs(json.loads(_scene_of(subject)._scene.cost(samples)))
    file, texts, name, params = _file(subject)
    return Costs(json.loads(_impasto.cost_of_file(file, texts, name, samples, params)))


def _bsdf(material: Bsdf | str | os.PathLike[str]) -> Bsdf:
    return material if isinstance(material, Bsdf) else Material(material)


def eval(material: Bsdf | str | os.PathLike[str], wo: ArrayLike, wi: ArrayLike, **at: Any) -> Scattering:
    """What a material scatters from ``wi`` to ``wo``, for arrays: see `Bsdf.eval`."""
    return _bsdf(material).eval(wo, wi, **at)


def sample(material: Bsdf | str | os.PathLike[str], wo: ArrayLike, u: ArrayLike, **at: Any) -> Samples:
    """The directions that a material samples, for arrays: see `Bsdf.sample`."""
    return _bsdf(material).sample(wo, u, **at)


def inspect(
    subject: Subject, *, item: str | None = None, at: str = "", params: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """A material, closure or function at one point, by the interpreter in double and in single precision, with its lobes and
    patterns: the JSON of docs/eval.md.

    Args:
        item: Which definition of the file.
        at: The point, as ``impasto eval --at`` takes it.
        params: Arguments as source text.

    Raises:
        SourceError: It, or an argument, has errors.
        ValueError: ``at`` is no point.
    """
    file, texts, name, given = _file(subject)
    values = [(key, value if kind == "text" else _text(value)) for key, kind, value in given]
    values += list((params or {}).items())
    found: dict[str, Any] = json.loads(_impasto.inspect(file, texts, item or name, values, at))
    return found


def _text(value: Any) -> str:
    """A value as source text."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list):
        return f"{ {2: 'vec2', 3: 'color'}.get(len(value), 'vec4') }({', '.join(map(repr, value))})"
    return json.dumps(value) if isinstance(value, str) else repr(value)


def explain(code: str) -> str:
    """What a diagnostic such as ``E0201`` means.

    Raises:
        KeyError: There is no such code.
    """
    found = _impasto.explain(code)
    if found is None:
        raise KeyError(f"there is no diagnostic {code!r}")
    return f"{found[0]}: {found[1]}\n\n{found[2]}"
