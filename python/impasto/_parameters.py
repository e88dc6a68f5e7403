"""Parameters of materials as attributes, and their values as the compiler takes them."""

from __future__ import annotations

import difflib
import html
import math
import numbers
import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Union

#: A value of a parameter: a bool, a number, two to four components, the path of a picture, or source text such as
#: ``"0.6 mm"`` or ``"srgb(0xb5552f)"``.
Value = Union[bool, int, float, str, "os.PathLike[str]", "tuple[float, ...]"]


@dataclass(frozen=True)
class Parameter:
    """What a material declares of a parameter. Lengths are in metres, angles in radians."""

    name: str
    type: str
    label: str
    group: str | None
    docs: str
    settable: bool
    default: Any
    default_text: str
    hard: tuple[float, float] | None
    soft: tuple[float, float] | None
    unit: str | None

    @staticmethod
    def of(entry: Mapping[str, Any]) -> Parameter:
        """A parameter of the JSON of docs/params.md."""
        default = entry["default"]
        unit = entry.get("unit")
        return Parameter(
            name=entry["name"],
            type=entry["type"],
            label=entry["label"],
            group=entry.get("group"),
            docs=entry["docs"],
            settable=entry["settable"],
            default=tuple(default) if isinstance(default, list) else default,
            default_text=entry["default_text"],
            hard=tuple(entry["hard"]) if entry.get("hard") else None,
            soft=tuple(entry["soft"]) if entry.get("soft") else None,
            unit=unit["name"] if unit else None,
        )


def converted(parameter: Parameter, value: Any) -> tuple[str, Any]:
    """The kind and the value that the extension module takes.

    Raises:
        TypeError: It is no value of any parameter.
        ValueError: It is a number that the parameter cannot have.
    """
    name = parameter.name
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if isinstance(value, str):
        return ("texture" if parameter.type == "texture" else "text", value)
    if isinstance(value, bool) or type(value).__name__ == "bool_":
        return ("bool", bool(value))
    if isinstance(value, numbers.Integral):
        whole = int(value)
        if parameter.type in ("int", "uint"):
            if not -(2**31) <= whole < 2**32:
                raise ValueError(f"`{name}` is {whole}: expected an integer of 32 bits")
            return ("int", whole)
        return ("float", _number(parameter, float(whole)))
    if isinstance(value, numbers.Real):
        return ("float", _number(parameter, float(value)))
    try:
        components = [float(component) for component in value]
    except TypeError:
        raise TypeError(
            f"`{name}` is {value!r}: expected a {parameter.type}, as a number, components, or source text"
        ) from None
    if not 2 <= len(components) <= 4:
        raise ValueError(f"`{name}` has {len(components)} components: expected 2 to 4")
    return ("floats", [_number(parameter, component) for component in components])


def _number(parameter: Parameter, value: float) -> float:
    name, hard = parameter.name, parameter.hard
    if not math.isfinite(value):
        raise ValueError(f"`{name}` is {value}: expected a finite number")
    # Ranges are in single precision.
    slack = 1e-6 * max(abs(limit) for limit in hard) if hard else 0.0
    if hard and not hard[0] - slack <= value <= hard[1] + slack:
        raise ValueError(f"`{name}` is {value}: expected {hard[0]:g} to {hard[1]:g}")
    return value


class HasParameters:
    """Something whose parameters are attributes: setting one changes it, deleting one restores its default."""

    _parameters: dict[str, Parameter]
    _values: dict[str, Any]

    def _set(self, parameter: Parameter, value: Any) -> None:
        """Takes a value over."""
        raise NotImplementedError

    def _reset(self, parameter: Parameter) -> None:
        """Takes the default back."""
        raise NotImplementedError

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """What is declared of each parameter, by name."""
        return dict(self._parameters)

    def _find(self, name: str) -> Parameter:
        known = object.__getattribute__(self, "__dict__").get("_parameters", {})
        if name in known:
            found: Parameter = known[name]
            return found
        near = difflib.get_close_matches(name, known, 1)
        hint = f"did you mean `{near[0]}`?" if near else f"its parameters are {', '.join(known) or 'none'}"
        raise AttributeError(f"{self._title()} has no parameter `{name}`; {hint}")

    def _title(self) -> str:
        return "the material"

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        parameter = self._find(name)
        return self._values.get(name, parameter.default)

    def __setattr__(self, name: str, value: Any) -> None:
        if name.startswith("_"):
            object.__setattr__(self, name, value)
            return
        parameter = self._find(name)
        if not parameter.settable:
            raise AttributeError(f"`{name}` is {parameter.default}, which only other materials can give")
        self._set(parameter, value)

    def __delattr__(self, name: str) -> None:
        self._reset(self._find(name))

    def __getitem__(self, name: str) -> Any:
        """The value of a parameter, whatever else is called so."""
        return self._values.get(name, self._find(name).default)

    def __setitem__(self, name: str, value: Any) -> None:
        setattr(self, name, value)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._parameters]

    def _repr_html_(self) -> str:
        def row(p: Parameter) -> str:
            value = self._values.get(p.name, p.default_text)
            limits = f"{p.hard[0]:g} .. {p.hard[1]:g}" if p.hard else ""
            cells = (p.name, p.type, value, limits, p.docs)
            return "<tr>" + "".join(f'<td style="text-align: left">{html.escape(str(c))}</td>' for c in cells) + "</tr>"

        head = "".join(f"<th>{title}</th>" for title in ("parameter", "type", "value", "range", ""))
        body = "".join(row(p) for p in self._parameters.values() if p.settable)
        return f"<b>{html.escape(self._title())}</b><table><tr>{head}</tr>{body}</table>"
