"""Triangles of OBJ files by material, as Impasto reads them, and PLY files as Mitsuba does."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass
class Mesh:
    """The triangles of one material: rows of three corners."""

    positions: np.ndarray
    """(n, 3, 3), metres."""
    normals: np.ndarray | None
    """(n, 3, 3), unit; None where the surface is flat."""
    uvs: np.ndarray | None
    """(n, 3, 2), v up."""


def load_obj(path: Path) -> tuple[dict[str, Mesh], list[Path]]:
    """The meshes of an OBJ file by the names after `usemtl`, and the MTL files it names."""
    vectors: dict[str, list[str]] = {"v": [], "vt": [], "vn": []}
    faces: dict[str, list[str]] = {}
    libraries = []
    current = ""
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        key, _, rest = line.strip().partition(" ")
        if key in vectors:
            vectors[key].append(rest)
        elif key == "f":
            faces.setdefault(current, []).append(rest)
        elif key == "usemtl":
            current = rest.strip()
        elif key == "mtllib":
            libraries.append(path.parent / rest.strip())
    tables = {
        "v": _table(vectors["v"], 3),
        "vt": _table(vectors["vt"], 2),
        "vn": _table(vectors["vn"], 3),
    }
    meshes = {}
    for name, lines in faces.items():
        # Faces that say the same about their corners are read together.
        by_form: dict[tuple[int, str], list[str]] = {}
        for line in lines:
            corners = line.split()
            by_form.setdefault((len(corners), _form(corners[0])), []).append(line)
        parts = [_faces(lines, *form, tables) for form, lines in by_form.items()]
        for index, part in enumerate(parts):
            meshes[name if index == 0 else f"{name}\0{index}"] = part
    return meshes, libraries


def _table(lines: list[str], width: int) -> np.ndarray:
    if not lines:
        return np.zeros((0, width))
    numbers = np.array(" ".join(lines).split(), dtype=np.float64)
    return numbers.reshape(len(lines), -1)[:, :width]


def _form(corner: str) -> str:
    """Which of position, texture coordinates and normal a corner has: `v`, `vt`, `vn`, `vtn`."""
    parts = corner.split("/")
    has_uv = len(parts) > 1 and parts[1] != ""
    return "v" + ("t" if has_uv else "") + ("n" if len(parts) > 2 else "")


def _faces(lines: list[str], corners: int, form: str, tables: dict[str, np.ndarray]) -> Mesh:
    text = " ".join(lines).replace("//", " ").replace("/", " ")
    numbers = np.array(text.split(), dtype=np.int64).reshape(len(lines), corners, len(form))
    # A fan of triangles.
    fan = [numbers[:, [0, i, i + 1]] for i in range(1, corners - 1)]
    numbers = np.concatenate(fan)

    def column(letter: str, table: str) -> np.ndarray | None:
        if letter not in form:
            return None
        index = numbers[:, :, form.index(letter)]
        values = tables[table]
        return values[np.where(index > 0, index - 1, len(values) + index)]

    positions = column("v", "v")
    normals, uvs = column("n", "vn"), column("t", "vt")
    across = np.cross(positions[:, 1] - positions[:, 0], positions[:, 2] - positions[:, 0])
    keep = np.linalg.norm(across, axis=1) > 0
    positions, across = positions[keep], across[keep]
    normals = None if normals is None else normals[keep]
    uvs = None if uvs is None else uvs[keep]
    if normals is not None:
        # The outside is where the normals of the corners say.
        behind = np.einsum("ij,ij->i", across, normals.sum(axis=1)) < 0
        for table in (positions, normals, uvs):
            if table is not None:
                table[behind] = table[behind][:, [0, 2, 1]]
    return Mesh(positions, normals, uvs)


def transformed(mesh: Mesh, spec: dict) -> Mesh:
    """A mesh under `scale`, `rotate` and `translate` of a `[[geometry]]` entry or a placement."""
    rotation = np.eye(3)
    for axis, degrees in enumerate(spec.get("rotate", [0, 0, 0])):
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(3)
        turn[i, i], turn[i, j], turn[j, i], turn[j, j] = c, -s, s, c
        rotation = turn @ rotation
    scale = np.broadcast_to(np.array(spec.get("scale", 1.0), dtype=float), 3)
    if (scale <= 0).any():
        raise SystemExit("mirrored geometry is not taken over")
    positions = (mesh.positions * scale) @ rotation.T + np.array(spec.get("translate", [0, 0, 0]))
    normals = mesh.normals
    if normals is not None:
        normals = (normals / scale) @ rotation.T
        normals = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
    return Mesh(positions, normals, mesh.uvs)


def write_ply(mesh: Mesh, path: Path) -> None:
    """Writes a binary PLY file. Mitsuba has v down, so v is turned over."""
    columns = [mesh.positions]
    names = ["x", "y", "z"]
    if mesh.normals is not None:
        columns.append(mesh.normals)
        names += ["nx", "ny", "nz"]
    if mesh.uvs is not None:
        columns.append(np.stack([mesh.uvs[..., 0], 1.0 - mesh.uvs[..., 1]], axis=-1))
        names += ["u", "v"]
    corners = np.concatenate(columns, axis=-1).astype("<f4")
    corners = corners.reshape(-1, corners.shape[-1])
    # Corners that are equal in everything are one vertex.
    rows = np.ascontiguousarray(corners).view(f"V{corners.itemsize * corners.shape[1]}").ravel()
    _, first, index = np.unique(rows, return_index=True, return_inverse=True)
    vertices = corners[first]
    faces = np.empty(len(index) // 3, dtype=[("count", "u1"), ("index", "<i4", (3,))])
    faces["count"] = 3
    faces["index"] = index.reshape(-1, 3)
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    header += [f"property float {name}" for name in names]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    with path.open("wb") as file:
        file.write(("\n".join(header) + "\n").encode())
        file.write(vertices.tobytes())
        file.write(faces.tobytes())
