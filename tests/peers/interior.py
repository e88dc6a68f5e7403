#!/usr/bin/env python3
"""Writes race/generated/interior.obj: the room of examples/conference by day, `cargo scenes conference` first.

One long wall opens to the sky, and things that are alike there have materials of their own here, so
that there are 32 of them. race/interior.toml says what they are.
"""

from pathlib import Path

import numpy as np

from geometry import Mesh, load_obj

HERE = Path(__file__).resolve().parent
SOURCE = HERE.parent.parent / "examples/conference/generated/conference.obj"
TARGET = HERE / "race/generated/interior.obj"

WINDOWS = 4.0
"""z of the wall that has them."""


def main() -> None:
    parts, _ = load_obj(SOURCE)
    kept = parts["wall"].positions[..., 2].min(axis=1) < WINDOWS - 1e-3
    parts["wall"] = chosen(parts["wall"], kept)
    named = [piece for name, mesh in parts.items() for piece in split(name, mesh)]
    TARGET.parent.mkdir(exist_ok=True)
    write(named + window_wall(), TARGET)
    triangles = sum(len(mesh.positions) for _, mesh in named)
    print(f"{TARGET.relative_to(HERE)}: {triangles} triangles, {len({name for name, _ in named}) + 1} materials")


def chosen(mesh: Mesh, which: np.ndarray) -> Mesh:
    return Mesh(mesh.positions[which], mesh.normals[which], None)


def split(name: str, mesh: Mesh) -> list[tuple[str, Mesh]]:
    """Things of one material, by where they are."""
    x, y, z = mesh.positions.mean(axis=1).T
    on_table = (abs(x) < 3.0) & (abs(z) < 1.0)
    seat = np.round((x + 2.0) / 0.8).astype(int)
    if name == "chair":
        kind = np.where(abs(x) > 2.6, 6 + (x > 0), (seat + 3 * (z > 0)) % 6)
    elif name == "timber":
        slat = np.round((x + 5.9) / 0.094).astype(int)
        kind = np.where(z < -3.9, slat % 4, 4)
    elif name == "ceramic":
        kind = np.where(on_table, seat % 2, np.where((x > 5.5) & (abs(z) < 1.5), 2, 3))
    elif name == "glass":
        kind = np.where(abs(y - 0.735) < 0.02, 0, 1)
    else:
        return [(name, mesh)]
    return [(f"{name}_{k}", chosen(mesh, kind == k)) for k in np.unique(kind)]


def window_wall() -> list[tuple[str, Mesh]]:
    """Parapet, lintel and pillars, and bars between these."""
    front, back = WINDOWS - 0.12, WINDOWS
    walls = [box((-6.0, 0.0, front), (6.0, 0.45, back)), box((-6.0, 2.75, front), (6.0, 3.1, back))]
    walls += [box((x - 0.12, 0.45, front), (x + 0.12, 2.75, back)) for x in (-5.88, -3.0, 0.0, 3.0, 5.88)]
    bars = [box((x - 0.03, 0.45, front + 0.03), (x + 0.03, 2.75, back - 0.03)) for x in (-4.5, -1.5, 1.5, 4.5)]
    bars += [box((-6.0, y - 0.02, front + 0.03), (6.0, y + 0.02, back - 0.03)) for y in (0.48, 2.05, 2.72)]
    return [("wall", joined(walls)), ("frame", joined(bars))]


def box(low: tuple, high: tuple) -> Mesh:
    positions, normals = [], []
    for axis in range(3):
        for side, value in ((-1.0, low), (1.0, high)):
            b, c = (axis + 1) % 3, (axis + 2) % 3
            corners = np.empty((4, 3))
            corners[:, axis] = value[axis]
            corners[:, b] = [low[b], high[b], high[b], low[b]]
            corners[:, c] = [low[c], low[c], high[c], high[c]]
            if side < 0:
                corners = corners[::-1]
            normal = np.zeros(3)
            normal[axis] = side
            positions += [corners[[0, 1, 2]], corners[[0, 2, 3]]]
            normals += [np.tile(normal, (3, 1))] * 2
    return Mesh(np.array(positions), np.array(normals), None)


def joined(meshes: list[Mesh]) -> Mesh:
    return Mesh(*(np.concatenate([getattr(m, what) for m in meshes]) for what in ("positions", "normals")), None)


def write(named: list[tuple[str, Mesh]], path: Path) -> None:
    tables = []
    for letter, what in (("v", "positions"), ("vn", "normals")):
        rows = np.concatenate([getattr(mesh, what).reshape(-1, 3) for _, mesh in named])
        rows, index = np.unique(rows, axis=0, return_inverse=True)
        tables.append((letter, rows, index.reshape(-1) + 1))
    with path.open("w") as file:
        for letter, rows, _ in tables:
            file.writelines(f"{letter} {x:.5f} {y:.5f} {z:.5f}\n" for x, y, z in rows.tolist())
        corners = np.stack([index for *_, index in tables], axis=-1).reshape(-1, 6).tolist()
        at = 0
        for name, mesh in named:
            file.write(f"usemtl {name}\n")
            file.writelines("f {}//{} {}//{} {}//{}\n".format(*face) for face in corners[at : at + len(mesh.positions)])
            at += len(mesh.positions)


if __name__ == "__main__":
    main()
