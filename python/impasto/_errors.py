"""What goes wrong, with diagnostics: the same texts and places that the command prints."""

from __future__ import annotations

import html
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, overload


@dataclass(frozen=True)
class Label:
    """A further place that belongs to a diagnostic."""

    message: str
    file: str | None
    line: int | None
    column: int | None


@dataclass(frozen=True)
class Diagnostic:
    """One problem of a source or a scene.

    Lines and columns count from 1, columns in characters. A problem without a place has ``None`` for both. Scenes'
    problems have no ``code``; ``impasto.explain(code)`` explains the others.
    """

    code: str | None
    severity: str
    message: str
    file: str | None = None
    line: int | None = None
    column: int | None = None
    end_line: int | None = None
    end_column: int | None = None
    expected: str | None = None
    hint: str | None = None
    notes: tuple[str, ...] = ()
    labels: tuple[Label, ...] = field(default=())

    @property
    def is_error(self) -> bool:
        """Whether it keeps the source from being used; otherwise it is a warning."""
        return self.severity == "error"

    def __str__(self) -> str:
        place = ":".join(str(part) for part in (self.file, self.line, self.column) if part is not None)
        code = f"[{self.code}]" if self.code else ""
        lines = [f"{place + ': ' if place else ''}{self.severity}{code}: {self.message}"]
        lines += [f"  expected: {self.expected}"] if self.expected else []
        lines += [f"  hint: {self.hint}"] if self.hint else []
        return "\n".join(lines)


class Diagnostics(Sequence[Diagnostic]):
    """Diagnostics in the order of their places; ``str`` gives the text that a terminal shows."""

    def __init__(self, diagnostics: Sequence[Diagnostic], text: str) -> None:
        self._all = tuple(diagnostics)
        self._text = text.rstrip()

    @overload
    def __getitem__(self, index: int) -> Diagnostic: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Diagnostic]: ...
    def __getitem__(self, index: int | slice) -> Diagnostic | Sequence[Diagnostic]:
        return self._all[index]

    def __len__(self) -> int:
        return len(self._all)

    def __iter__(self) -> Iterator[Diagnostic]:
        return iter(self._all)

    @property
    def errors(self) -> list[Diagnostic]:
        """Those that are errors."""
        return [diagnostic for diagnostic in self._all if diagnostic.is_error]

    @property
    def warnings(self) -> list[Diagnostic]:
        """Those that are warnings."""
        return [diagnostic for diagnostic in self._all if not diagnostic.is_error]

    def __str__(self) -> str:
        return self._text or "no problems"

    def __repr__(self) -> str:
        errors, warnings = len(self.errors), len(self.warnings)
        return f"<{errors} error{'s' * (errors != 1)}, {warnings} warning{'s' * (warnings != 1)}>"

    def _repr_html_(self) -> str:
        color = "#b00020" if self.errors else "#8a6d00" if self._all else "#2e7d32"
        return f'<pre style="border-left: 3px solid {color}; padding-left: 8px">{html.escape(str(self))}</pre>'


class Error(Exception):
    """Anything that the library refuses or cannot do. ``str`` gives the text that the command prints, without colors."""

    #: What is wrong, with places, where that is known.
    diagnostics: Diagnostics
    #: Whether the same may work at another try or on another machine.
    transient: bool

    def __init__(self, message: str, diagnostics: Sequence[Diagnostic] = (), transient: bool = False) -> None:
        super().__init__(message)
        self.diagnostics = Diagnostics(diagnostics, message)
        self.transient = transient

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self), (str(self), tuple(self.diagnostics), self.transient))


class SourceError(Error):
    """A material's source has errors."""


class SceneError(Error):
    """A scene, or a file that it names, cannot be used."""


class PlanError(Error, ValueError):
    """A plan, a partition, a strategy, a workload or a device profile is not one for the materials at hand."""


class DeviceError(Error, RuntimeError):
    """There is no such device, or it failed."""


class FileError(Error, OSError):
    """A file cannot be read or written."""

    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""


_KINDS = {kind.__name__: kind for kind in (SourceError, SceneError, PlanError, DeviceError, FileError)}


def diagnostics_of(text: str) -> list[Diagnostic]:
    """Diagnostics of the JSON of docs/diagnostics.md."""
    return [_diagnostic(entry) for entry in json.loads(text)]


def _diagnostic(entry: dict[str, Any]) -> Diagnostic:
    keys = ("file", "line", "column", "end_line", "end_column", "expected", "hint")
    rest: dict[str, Any] = {key: entry.get(key) for key in keys}
    labels = entry.get("labels") or ()
    return Diagnostic(
        code=entry["code"],
        severity=entry["severity"],
        message=entry["message"],
        **rest,
        notes=tuple(entry.get("notes") or ()),
        labels=tuple(Label(la["message"], la.get("file"), la.get("line"), la.get("column")) for la in labels),
    )


def make(kind: str, message: str, diagnostics: str, transient: bool) -> Error:
    """The exception of a failure of the extension module."""
    return _KINDS.get(kind, Error)(message, diagnostics_of(diagnostics), transient)
