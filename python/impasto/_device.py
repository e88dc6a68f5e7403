"""Which device is asked for, checked before it reaches the extension module."""

from __future__ import annotations

import os
import tempfile

if os.name == "posix":
    # Mesa's drivers print an error where there is none, though rendering needs no such folder.
    os.environ.setdefault("XDG_RUNTIME_DIR", tempfile.gettempdir())


def wanted(device: str | None, threads: int | None) -> tuple[str | None, int | None]:
    """Device and threads as the extension module takes them.

    Raises:
        TypeError: They are no text and no number.
        ValueError: There are not so many threads.
    """
    if device is not None and not isinstance(device, str):
        raise TypeError(f"`device` is {device!r}: expected None, 'cpu', 'gpu', or what `--gpu` takes")
    if threads is None:
        return (device, None)
    try:
        count = threads.__index__()
    except AttributeError:
        raise TypeError(f"`threads` is {threads!r}: expected an integer") from None
    if not 1 <= count <= 1024:
        raise ValueError(f"`threads` is {count}: expected 1 to 1024")
    return (device, int(count))
