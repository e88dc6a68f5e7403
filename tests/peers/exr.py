"""EXR pictures as both renderers write them: scan lines, not compressed or by ZIP, halves or floats.

A reader of our own, since neither renderer's module can be counted on: Mitsuba is absent where Cycles
races, and `bpy` runs in a process of its own.
"""

import struct
import zlib
from pathlib import Path

import numpy as np

LINES = {0: 1, 2: 1, 3: 16}
"""Scan lines of a chunk by the number of the compression: none, ZIPS, ZIP."""

TYPES = {0: np.dtype("<u4"), 1: np.dtype("<f2"), 2: np.dtype("<f4")}


def header(data: bytes) -> tuple[dict[str, bytes], int]:
    """The attributes of a file, and where they end."""
    if data[:4] != b"v/1\x01":
        raise ValueError("no EXR file")
    found, at = {}, 8
    while data[at]:
        name, at = _text(data, at)
        _, at = _text(data, at)
        (size,) = struct.unpack_from("<i", data, at)
        found[name] = data[at + 4 : at + 4 + size]
        at += 4 + size
    return found, at + 1


def read(path: Path) -> np.ndarray:
    """The linear RGB values of a picture: height x width x 3."""
    data = path.read_bytes()
    attributes, at = header(data)
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    compression = attributes["compression"][0]
    if compression not in LINES:
        raise ValueError(f"{path}: compression {compression} is not read")
    channels = _channels(attributes["channels"])
    row = sum(kind.itemsize for _, kind in channels) * width
    planes = {name: np.zeros((height, width), np.float64) for name, _ in channels}
    count = -(-height // LINES[compression])
    for offset in struct.unpack_from(f"<{count}Q", data, at):
        top, size = struct.unpack_from("<ii", data, offset)
        top -= y0
        lines = min(LINES[compression], height - top)
        chunk = data[offset + 8 : offset + 8 + size]
        if size < lines * row:
            chunk = _unzipped(chunk)
        for line in range(lines):
            place = line * row
            for name, kind in channels:
                planes[name][top + line] = np.frombuffer(chunk, kind, width, place)
                place += kind.itemsize * width
    return np.stack([_plane(planes, letter) for letter in "RGB"], axis=-1)


def _text(data: bytes, at: int) -> tuple[str, int]:
    end = data.index(0, at)
    return data[at:end].decode(), end + 1


def _channels(value: bytes) -> list[tuple[str, np.dtype]]:
    """Names and types, in the order in which scan lines have them."""
    found, at = [], 0
    while value[at]:
        name, at = _text(value, at)
        found.append((name, TYPES[struct.unpack_from("<i", value, at)[0]]))
        at += 16
    return found


def _unzipped(chunk: bytes) -> bytes:
    """Undoes ZIP, the differences between neighbours, and the parting of even and odd bytes."""
    steps = np.frombuffer(zlib.decompress(chunk), np.uint8).astype(np.int64)
    steps[1:] -= 128
    values = np.cumsum(steps).astype(np.uint8)
    half = (len(values) + 1) // 2
    out = np.empty_like(values)
    out[0::2], out[1::2] = values[:half], values[half:]
    return out.tobytes()


def _plane(planes: dict[str, np.ndarray], letter: str) -> np.ndarray:
    """A channel of the picture itself, or of the first layer that has one."""
    if letter in planes:
        return planes[letter]
    return next(plane for name, plane in planes.items() if name.split(".")[-1] == letter)
