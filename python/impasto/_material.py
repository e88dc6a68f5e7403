"""Materials: their parameters, and what they scatter."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any, NamedTuple

from . import _impasto
from ._arrays import items
from ._device import wanted
from ._parameters import HasParameters, Parameter, converted

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray


class Scattering(NamedTuple):
    """What a material scatters from ``wi`` to ``wo``, for items of a shape S."""

    #: f |cos|, discrete lobes left out, 1/sr: float32 of shape (\\*S, 3).
    value: NDArray[np.float32]
    #: The density with which ``wi`` would be sampled, 1/sr: float32 of shape S.
    pdf: NDArray[np.float32]


class Samples(NamedTuple):
    """Directions that a material samples, for items of a shape S."""

    #: The directions: float32 of shape (\\*S, 3); zero where there is none.
    wi: NDArray[np.float32]
    #: Their densities, 1/sr, 0 where a direction is discrete: float32 of shape S.
    pdf: NDArray[np.float32]
    #: f |cos| / pdf: float32 of shape (\\*S, 3).
    throughput: NDArray[np.float32]
    #: Whether the path goes into another medium: bool of shape S.
    transmitted: NDArray[np.bool_]


class Bsdf(HasParameters):
    """What can be asked of a material at arrays of points. `Material` and `Binding` are such.

    The arrays of all methods broadcast as in numpy, their last axis apart: a call has items of the common shape S of
    all leading axes. ``wo`` and ``wi`` have shape (..., 3), point toward the viewer and the light, and are made unit
    vectors. ``u`` has shape (..., 4), in [0, 1): the first number chooses a lobe, the others its direction.

    ``at`` gives the surface point: ``position``, ``normal``, ``geometric_normal``, ``tangent``, ``object_position`` and
    ``vertex_color`` (..., 3); ``uv`` and ``uv1`` (..., 2); ``exterior_ior``, ``footprint`` and ``instance_id`` (...,).
    What is left out has the values that ``impasto eval`` shows: the normal is +z, the tangent +x.

    ``device`` is where it is computed: ``None`` for the best device, ``"cpu"``, ``"gpu"`` or what ``--gpu`` takes; ``threads``
    are those of the processor.

    Raises (all methods):
        TypeError: An array holds no real numbers, or there is no such input.
        ValueError: Shapes do not go together, or a number is not finite or outside of its range.
        SourceError: The material, or a value of a parameter, has errors.
        DeviceError: The device cannot do it.
    """

    _evaluators: dict[Any, Any]

    def _evaluator(self, device: tuple[str | None, int | None]) -> _impasto.Evaluator:
        raise NotImplementedError

    def _changed(self) -> None:
        self._evaluators = {}

    def _ask(
        self, what: str, device: str | None, threads: int | None, given: dict[str, Any]
    ) -> tuple[tuple[int, ...], NDArray[np.float32]]:
        import math

        shape, rows = items(given, _fields())
        asked = wanted(device, threads)
        evaluators = self._evaluators
        if asked not in evaluators:
            evaluators[asked] = self._evaluator(asked)
        found = evaluators[asked].run(what, math.prod(shape), rows)
        return shape, found.reshape((*shape, -1) if math.prod(shape) else (*shape, _WIDTHS[what]))

    def eval(
        self,
        wo: ArrayLike,
        wi: ArrayLike,
        *,
        device: str | None = None,
        threads: int | None = None,
        **at: ArrayLike,
    ) -> Scattering:
        """What is scattered from ``wi`` to ``wo``: f |cos| without discrete lobes, and the density of ``wi``."""
        _, found = self._ask("scattering", device, threads, {"wo": wo, "wi": wi, **at})
        return Scattering(found[..., :3], found[..., 3])

    def sample(
        self,
        wo: ArrayLike,
        u: ArrayLike,
        *,
        device: str | None = None,
        threads: int | None = None,
        **at: ArrayLike,
    ) -> Samples:
        """The directions that ``u`` chooses, seen from ``wo``."""
        _, found = self._ask("sample", device, threads, {"wo": wo, "u": u, **at})
        return Samples(found[..., :3], found[..., 3], found[..., 4:7], found[..., 7] > 0.5)

    def albedo(
        self, wo: ArrayLike, *, device: str | None = None, threads: int | None = None, **at: ArrayLike
    ) -> NDArray[np.float32]:
        """The share of light that is scattered, seen from ``wo``: float32 of shape (\\*S, 3)."""
        return self._ask("albedo", device, threads, {"wo": wo, **at})[1]

    def emission(
        self, wo: ArrayLike, *, device: str | None = None, threads: int | None = None, **at: ArrayLike
    ) -> NDArray[np.float32]:
        """The radiance toward ``wo``, W/(m^2 sr): float32 of shape (\\*S, 3)."""
        return self._ask("emission", device, threads, {"wo": wo, **at})[1]


_WIDTHS = {"scattering": 4, "sample": 8, "albedo": 3, "emission": 3}

_FIELDS: dict[str, int] = {}


def _fields() -> dict[str, int]:
    if not _FIELDS:
        _FIELDS.update(_impasto.fields())
    return _FIELDS


class Material(Bsdf):
    """A material of a file, of a module of the library, or of a text, with values of its parameters.

    >>> clay = impasto.Material("std::surface::open_pbr", base_color=(0.6, 0.3, 0.2))
    >>> clay.specular_roughness = 0.5

    Args:
        file: A ``.impasto`` file, a MaterialX document, or a module such as ``std::surface::open_pbr``.
        name: Which material of the file; its only one by default.
        source: The text of the material, in place of a file.
        **params: Values of parameters, which are attributes from then on.

    Raises:
        FileError: The file cannot be read.
        SourceError: It has errors, or no such material.
        AttributeError: There is no parameter of a name.
        ValueError: A value is outside of its parameter's range.
    """

    _file: str
    _source: str | None
    _name: str

    def __init__(
        self,
        file: str | os.PathLike[str] | None = None,
        name: str | None = None,
        *,
        source: str | None = None,
        **params: Any,
    ) -> None:
        if (file is None) == (source is None):
            raise TypeError("a material is of a `file` or of a text `source`: give one of the two")
        self._file = "<python>" if file is None else os.fspath(file)
        self._source = source
        self._values = {}
        self._evaluators = {}
        found = json.loads(_impasto.interface(self._file, self._texts()))
        self._parameters = {}
        chosen = _chosen(self, found, name)
        self._name = chosen["name"]
        self.__dict__["__doc__"] = chosen["docs"]
        self._parameters = {entry["name"]: Parameter.of(entry) for entry in chosen["params"]}
        for key, value in params.items():
            setattr(self, key, value)

    def _texts(self) -> dict[str, str]:
        return {} if self._source is None else {self._file: self._source}

    def _params(self) -> list[tuple[str, str, Any]]:
        return [(name, *converted(self._parameters[name], value)) for name, value in self._values.items()]

    def _set(self, parameter: Parameter, value: Any) -> None:
        converted(parameter, value)
        self._values[parameter.name] = value
        self._changed()

    def _reset(self, parameter: Parameter) -> None:
        self._values.pop(parameter.name, None)
        self._changed()

    def _evaluator(self, device: tuple[str | None, int | None]) -> _impasto.Evaluator:
        return _impasto.Evaluator.of_material(self._file, self._texts(), self._name, self._params(), device)

    def _title(self) -> str:
        return f"material {self.__dict__.get('_name', '')}"

    def __repr__(self) -> str:
        given = "".join(f", {name}={value!r}" for name, value in self._values.items())
        return f"impasto.Material({self._file!r}, {self._name!r}{given})"


def _chosen(material: Material, found: list[dict[str, Any]], name: str | None) -> dict[str, Any]:
    """The material that is meant; the compiler says what is wrong where there is none."""
    named = [entry for entry in found if name is None or entry["name"] == name]
    if len(named) == 1:
        return named[0]
    if name is None and len(found) > 1:
        names = ", ".join(f"`{entry['name']}`" for entry in found)
        raise ValueError(f"`{material._file}` has the materials {names}: say which, as `name`")
    _impasto.emit(material._file, material._texts(), "wgsl", name, "native", False, [])
    raise ValueError(f"`{material._file}` has no material `{name}`")
