"""Scenes: those of files, materials on built-in sets, and scenes that are built of arrays."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from . import _impasto
from ._arrays import finite, floats, indices, rows
from ._material import Bsdf, Material
from ._parameters import Parameter, converted

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class Binding(Bsdf):
    """A material as a scene binds it. Its parameters are attributes: setting one changes the scene."""

    def __init__(self, scene: _impasto.Scene, entry: tuple[Any, ...]) -> None:
        name, _, found, text, item, given = entry
        self._scene = scene
        self._name = name
        self._evaluators = {}
        texts = {} if text is None else {found: text}
        materials = json.loads(_impasto.interface(found, texts))
        chosen = [m for m in materials if item is None or m["name"] == item]
        params = chosen[0]["params"] if chosen else []
        self._parameters = {entry["name"]: Parameter.of(entry) for entry in params}
        self._values = {name: _value_of(text) for name, text in given}

    def _set(self, parameter: Parameter, value: Any) -> None:
        kind, given = converted(parameter, value)
        self._scene.give(self._name, parameter.name, kind, given)
        self._values[parameter.name] = value
        self._changed()

    def _reset(self, parameter: Parameter) -> None:
        self._scene.take_back(self._name, parameter.name)
        self._values.pop(parameter.name, None)
        self._changed()

    def _evaluator(self, device: tuple[str | None, int | None]) -> _impasto.Evaluator:
        return _impasto.Evaluator.of_binding(self._scene, self._name, device)

    def _title(self) -> str:
        return f"material {self.__dict__.get('_name', '')}"

    def __repr__(self) -> str:
        return f"<{self._title()} of a scene>"


def _value_of(text: str) -> Any:
    """What a scene gives a parameter, as a value of Python where it is one."""
    head, _, rest = text.partition("(")
    try:
        if head in ("vec2", "color", "vec4"):
            return tuple(float(part) for part in rest.rstrip(")").split(","))
        return {"true": True, "false": False}[text] if text in ("true", "false") else float(text)
    except ValueError:
        return text


class Bindings(Mapping[str, Binding]):
    """The materials that a scene binds, by name."""

    def __init__(self, scene: _impasto.Scene) -> None:
        self._scene = scene
        self._known: dict[str, Binding] = {}

    def _entries(self) -> dict[str, tuple[Any, ...]]:
        return {entry[0]: entry for entry in self._scene.bindings()}

    def __getitem__(self, name: str) -> Binding:
        if name not in self._known:
            entries = self._entries()
            if name not in entries:
                raise KeyError(f"the scene has no material {name!r}; it has {', '.join(entries)}")
            self._known[name] = Binding(self._scene, entries[name])
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries())

    def __len__(self) -> int:
        return len(self._entries())

    def __repr__(self) -> str:
        return f"<materials {', '.join(self)}>"


class Scene:
    """A scene that was loaded (`load`), built (`SceneBuilder`), or made of a material (`Scene.of`).

    Several threads may use one. A render takes what the scene is when it begins: changes and deletion come too late
    for it.
    """

    def __init__(self, scene: _impasto.Scene) -> None:
        self._scene = scene
        self._bindings = Bindings(scene)

    @staticmethod
    def of(material: Material | str | os.PathLike[str], on: str = "ball") -> Scene:
        """A material on a built-in set: ``ball``, ``cloth`` or ``plane``. Its binding is called ``sample``.

        Raises:
            ValueError: There is no such set.
            Error: The material cannot be read.
        """
        if not isinstance(material, Material):
            material = Material(material)
        made = _impasto.Scene.of_material(material._file, material._source, material._name, on)
        for name, kind, value in material._params():
            made.give("sample", name, kind, value)
        return Scene(made)

    @property
    def name(self) -> str:
        """The scene's name."""
        return self._scene.name()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of pictures, in pixels; it can be set."""
        return self._scene.size()

    @size.setter
    def size(self, size: tuple[int, int] | None) -> None:
        if size is None:
            self._scene.resize(None)
            return
        try:
            width, height = (int(side) for side in size)
        except (TypeError, ValueError):
            raise TypeError(f"`size` is {size!r}: expected width and height in pixels") from None
        if not (1 <= width <= 65536 and 1 <= height <= 65536):
            raise ValueError(f"`size` is {size!r}: expected sides from 1 to 65536")
        self._scene.resize((width, height))

    @property
    def materials(self) -> Bindings:
        """The materials that it binds, by name, with their parameters as attributes."""
        return self._bindings

    @property
    def warnings(self) -> list[str]:
        """Oddities that do not keep it from being rendered."""
        return self._scene.warnings()

    @property
    def triangles(self) -> int:
        """How many triangles are stored."""
        return self._scene.triangles()

    def __repr__(self) -> str:
        width, height = self.size
        return f"<scene {self.name}: {width}x{height}, {self.triangles} triangles, {len(self.materials)} materials>"


def load(path: str | os.PathLike[str]) -> Scene:
    """Reads a scene: a TOML file, or a glTF or USD file with the scene in it.

    Raises:
        SceneError: It, or a file that it names, cannot be used; the diagnostic has the place.
    """
    return Scene(_impasto.Scene.load(os.fspath(path)))


class SceneBuilder:
    """Builds a scene of arrays. Its methods return the builder, so that calls can be chained.

    Whatever a scene file can say can be said here by the same keys (docs/scenes.md); lengths are in metres.

    >>> builder = impasto.SceneBuilder(width=320, height=240)
    >>> builder.camera(position=(0, 1, 4), look_at=(0, 1, 0), fov=40)
    >>> builder.material("clay", impasto.Material("clay.impasto", roughness=0.4))
    >>> builder.mesh("floor", vertices, triangles, material="clay")
    >>> builder.environment(color=(0.5, 0.6, 0.7))
    >>> scene = builder.build()

    Args:
        width, height: Of the picture, in pixels.
        max_depth: How many surfaces a path meets at most.
        name: The scene's name.
        base: The folder that paths of files and pictures are relative to; the working directory by default.
    """

    def __init__(
        self,
        width: int = 640,
        height: int = 480,
        *,
        max_depth: int = 8,
        name: str = "scene",
        base: str | os.PathLike[str] = "",
    ) -> None:
        self._base = os.fspath(base)
        self._top: dict[str, Any] = {"name": name}
        self._tables: dict[str, dict[str, Any]] = {
            "film": {"width": width, "height": height},
            "integrator": {"max_depth": max_depth},
        }
        self._lists: dict[str, list[dict[str, Any]]] = {"geometry": [], "lights": []}
        self._materials: dict[str, dict[str, Any]] = {}
        self._meshes: dict[str, tuple[Any, ...]] = {}
        self._texts: dict[str, str] = {}

    def camera(self, **keys: Any) -> SceneBuilder:
        """Where it is seen from: the keys of ``[camera]``, such as ``position``, ``look_at`` and ``fov`` in degrees."""
        self._tables["camera"] = keys
        return self

    def material(self, name: str, material: Material | str | os.PathLike[str], **params: Any) -> SceneBuilder:
        """Binds a material to a name that meshes use; ``*`` is for all names that are not bound."""
        if not isinstance(material, Material):
            material = Material(material, **params)
            params = {}
        for key, value in params.items():
            converted(material._find(key), value)
        file = material._file
        if material._source is not None:
            file = f"{name}.impasto"
            self._texts[file] = material._source
        elif not file.startswith("std::"):
            # It was found from the working directory, and the scene's files are found from `base`.
            file = os.path.abspath(file) if self._base else file
        values = {**material._values, **params}
        given = {key: converted(material._parameters[key], value)[1] for key, value in values.items()}
        self._materials[name] = {"file": file, "material": material._name, **({"params": given} if given else {})}
        return self

    def mesh(
        self,
        name: str,
        vertices: ArrayLike,
        triangles: ArrayLike,
        *,
        normals: ArrayLike | None = None,
        uvs: ArrayLike | None = None,
        material: str | None = None,
        **keys: Any,
    ) -> SceneBuilder:
        """Adds triangles.

        Args:
            name: The object's name, in outputs such as ``object_id``.
            vertices: Places in metres, shape (N, 3).
            triangles: Indices of vertices, counter-clockwise seen from outside, integers of shape (M, 3).
            normals: Shading normals of the vertices, shape (N, 3).
            uvs: Texture coordinates of the vertices, shape (N, 2), v up.
            material: The name of the material; needed unless ``*`` is bound.
            **keys: Further keys of ``[[geometry]]``, such as ``transform``.

        Raises:
            TypeError: An array holds no numbers of that kind.
            ValueError: An array has another shape, numbers that are not finite, or indices without a vertex.
        """
        import numpy as np

        points = rows("vertices", vertices, 3, np.float64)
        corners = indices("triangles", triangles, 3)
        if corners.size and int(corners.max()) >= len(points):
            row = int(np.argmax((corners >= len(points)).any(axis=1)))
            raise ValueError(
                f"mesh `{name}`: triangle {row} is {corners[row].tolist()}, and there are {len(points)} vertices, counted from 0"
            )
        if len(corners) == 0:
            raise ValueError(f"mesh `{name}` has no triangle")
        others = []
        for what, given, width in (("normals", normals, 3), ("uvs", uvs, 2)):
            array = None if given is None else rows(what, given, width)
            if array is not None and len(array) != len(points):
                raise ValueError(f"mesh `{name}`: `{what}` has {len(array)} rows for {len(points)} vertices")
            others.append(array)
        file = f"{name}.arrays"
        if file in self._meshes:
            raise ValueError(f"there is a mesh `{name}` already")
        self._meshes[file] = (file, points, corners, *others)
        entry = {"file": file, **keys}
        if material is not None:
            entry["material"] = material
        self._lists["geometry"].append(entry)
        return self

    def geometry(self, file: str | os.PathLike[str], **keys: Any) -> SceneBuilder:
        """Adds a geometry file: the keys of ``[[geometry]]``."""
        self._lists["geometry"].append({"file": os.fspath(file), **keys})
        return self

    def light(self, kind: str, **keys: Any) -> SceneBuilder:
        """Adds a light: the keys of ``[[lights]]`` for this kind, such as ``quad``, ``sphere`` or ``distant``."""
        self._lists["lights"].append({"kind": kind, **keys})
        return self

    def environment(self, **keys: Any) -> SceneBuilder:
        """Light from infinitely far away: the keys of ``[environment]``, such as ``color`` or ``file``."""
        self._tables["environment"] = keys
        return self

    def to_toml(self) -> str:
        """The scene as the text of a scene file. Meshes are named in it, not held."""
        parts = [_lines(self._top)]
        parts += [f"[{name}]\n{_lines(table)}" for name, table in self._tables.items()]
        parts += [f"[materials.{json.dumps(name)}]\n{_lines(table)}" for name, table in self._materials.items()]
        parts += [f"[[{name}]]\n{_lines(table)}" for name, tables in self._lists.items() for table in tables]
        return "\n".join(parts)

    def build(self) -> Scene:
        """The scene.

        Raises:
            SceneError: Something of it cannot be. Places are those of `to_toml`.
        """
        path = os.path.join(self._base, "scene built in Python")
        made = _impasto.Scene.of_text(path, self.to_toml(), list(self._meshes.values()), self._texts)
        return Scene(made)


def _lines(table: Mapping[str, Any]) -> str:
    return "".join(f"{_key(name)} = {_value(name, value)}\n" for name, value in table.items())


def _key(name: str) -> str:
    return name if name.replace("_", "").isalnum() and name.isascii() else json.dumps(name)


def _value(name: str, value: Any) -> str:
    """A value of TOML.

    Raises:
        TypeError: It has no such value.
        ValueError: It is a number that is not finite.
    """
    if isinstance(value, bool) or type(value).__name__ == "bool_":
        return "true" if value else "false"
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, int):
        return str(value)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(key)} = {_value(key, item)}" for key, item in value.items()) + " }"
    if isinstance(value, (list, tuple)) and any(isinstance(item, (str, Mapping, list, tuple)) for item in value):
        return "[" + ", ".join(_value(name, item) for item in value) + "]"
    import numpy as np

    array = finite(name, floats(name, value, np.float64))
    if array.ndim == 0:
        whole = isinstance(value, np.integer)
        return str(int(value)) if whole else repr(float(array))
    return json.dumps(array.tolist())
