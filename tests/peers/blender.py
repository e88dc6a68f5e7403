"""An Impasto scene as a job for `cycles_render.py`, which Blender's Python runs, and the times that it
gives. What differs is named by `NEAREST`."""

import json
import subprocess
from pathlib import Path

import numpy as np

import exr
from geometry import Mesh
from impasto import GLOSSY, TRANSMISSIVE, Impasto, alpha, arguments, colour, meshes, picture_file, principled, share
from measure import Efficiency, efficiency

RENDER = Path(__file__).resolve().parent / "cycles_render.py"

NEAREST = """Each material becomes its lobes at one point, seen from 37 degrees. A gloss over a diffuse
lobe, as OpenPBR has it, becomes one Principled BSDF, and so do metals; other lobes become nodes of one
BSDF each, mixed by their shares. Patterns, noise and flakes become constants; a picture on a diffuse lobe
stays."""

MODES = {
    "plain": {},
    "spatial_splits": {"debug_use_spatial_splits": True},
    "late_roulette": {"min_light_bounces": "roulette_start"},
    "light_tree": {"use_light_tree": True},
}
"""What may make Cycles faster or less noisy and keeps it unbiased: properties of `scene.cycles`, or what of the job says them.
Cycles plays roulette from the start; in `late_roulette` it begins with Impasto and Mitsuba."""


def time_cycles(job: dict, folder: Path, mode: str, args) -> tuple[Efficiency, dict]:
    """Renders a job from `translate`; gives the efficiency, and what Blender says of itself."""
    job = job | {
        "samples": args.spp,
        "pictures": args.pictures,
        "device": args.cycles_device,
        "options": {name: job.get(value, value) for name, value in MODES[mode].items()},
        "folder": str(folder),
    }
    path = folder / "job.json"
    path.write_text(json.dumps(job))
    with (folder / "log.txt").open("w") as log:
        done = subprocess.run([args.cycles, str(RENDER), str(path)], stdout=log, stderr=log, check=False)
    answer = folder / "answer.json"
    if done.returncode != 0 or not answer.is_file():
        last = (folder / "log.txt").read_text(errors="replace").strip().splitlines()[-1:]
        raise RuntimeError(f"Blender gave up ({done.returncode}): {' '.join(last)}")
    facts = json.loads(answer.read_text())
    answer.unlink()
    pictures = [folder / f"{number}.exr" for number in range(args.pictures)]
    seconds = net_seconds(facts["times"], args.spp)
    for picture in pictures:
        check_samples(picture, args.spp)
    found = efficiency([exr.read(picture) for picture in pictures], [seconds], args.spp)
    return found, {"version": facts["version"], "devices": facts["devices"], "times": facts["times"]}


def net_seconds(times: list[list[float]], samples: int) -> float:
    """Seconds of a picture of so many samples, without what every render takes however few they are: what Blender
    hands over to Cycles, and the picture back. `times` has rows of samples and seconds, for three numbers of samples.

    Times that do not grow evenly are refused. A render whose scene counts as unchanged keeps the number of samples of
    the one before, whatever is asked for.
    """
    by_count: dict[int, list[float]] = {}
    for count, seconds in times:
        by_count.setdefault(int(count), []).append(seconds)
    low, middle, high = sorted(by_count)
    median = {count: float(np.median(seconds)) for count, seconds in by_count.items()}
    slope = (median[high] - median[low]) / (high - low)
    expected = median[low] + slope * (middle - low)
    if slope <= 0 or abs(median[middle] - expected) > 0.15 * expected:
        raise RuntimeError(f"times do not grow with samples: {median}")
    return slope * samples


def check_samples(path: Path, samples: int) -> None:
    """Cycles writes into a picture how many samples it has."""
    attributes, _ = exr.header(path.read_bytes())
    said = [value for name, value in attributes.items() if name.startswith("cycles.") and name.endswith(".samples")]
    if [int(value) for value in said] != [samples]:
        raise RuntimeError(f"a picture of {samples} samples has {said}")


# ---- Scenes --------------------------------------------------------------------------------------


def translate(scene: dict, impasto: Impasto, size: tuple[int, int], folder: Path) -> dict:
    """The job of a scene from `impasto.load_scene`; meshes are written to `folder`."""
    spec = scene["camera"]
    distance = float(np.linalg.norm(np.subtract(spec["look_at"], spec["position"])))
    materials: dict[int, dict] = {}
    shapes = []
    for number, (mesh, material) in enumerate(meshes(scene, impasto)):
        materials.setdefault(id(material), shader(material, scene) | {"number": len(materials)})
        path = folder / f"{number}.mesh"
        shapes.append(write_mesh(mesh, path) | {"material": materials[id(material)]["number"]})
    return {
        "size": size,
        # Impasto counts the segments of a path, Cycles its bounces.
        "max_bounces": scene["integrator"]["max_depth"] - 2,
        # After as many bounces one fewer segments have ended.
        "roulette_start": scene["integrator"]["roulette_start"] - 1,
        "camera": {
            "position": spec["position"],
            "look_at": spec["look_at"],
            "up": spec.get("up", [0, 1, 0]),
            "fov": spec["fov"],
            "aperture": spec.get("aperture", 0.0),
            "focus": spec.get("focus", distance),
        },
        "materials": list(materials.values()),
        "meshes": shapes,
        "lights": [light for spec in scene.get("lights", []) for light in lights(spec)],
        "environment": environment(scene["environment"], scene["base"]) if "environment" in scene else None,
    }


def write_mesh(mesh: Mesh, path: Path) -> dict:
    """Writes floats and indices one after the other; gives how many of each there are."""
    corners = mesh.positions if mesh.normals is None else np.concatenate([mesh.positions, mesh.normals], axis=-1)
    corners = corners.reshape(-1, corners.shape[-1]).astype("<f4")
    # Corners that are equal in place and normal are one vertex.
    rows = np.ascontiguousarray(corners).view(f"V{corners.itemsize * corners.shape[1]}").ravel()
    _, first, index = np.unique(rows, return_index=True, return_inverse=True)
    vertices = corners[first]
    with path.open("wb") as file:
        file.write(np.ascontiguousarray(vertices[:, :3]).tobytes())
        if mesh.normals is not None:
            file.write(np.ascontiguousarray(vertices[:, 3:]).tobytes())
        file.write(index.astype("<i4").tobytes())
        if mesh.uvs is not None:
            file.write(mesh.uvs.astype("<f4").tobytes())
    return {
        "file": str(path),
        "vertices": len(vertices),
        "triangles": len(mesh.positions),
        "normals": mesh.normals is not None,
        "uvs": mesh.uvs is not None,
    }


GAP = 1e-4
"""Light goes through Blender's lamps, so a black rectangle stands where Impasto's lamp is, and the lamp so far before
it, as a share of its longer side."""


def lights(spec: dict) -> list[dict]:
    """Lamps whose axes are those of Blender's: they shine along -z."""
    if spec["kind"] == "distant":
        axis = np.array(spec["to_light"], float)
        return [
            {
                "kind": "SUN",
                "z": (axis / np.linalg.norm(axis)).tolist(),
                "irradiance": colour(spec["irradiance"]),
                "angle": spec.get("angle", 0.0),
            }
        ]
    u, v = np.array(spec["u"], float), np.array(spec["v"], float)
    width, height = np.linalg.norm(u), np.linalg.norm(v)
    if abs(u @ v) > 1e-6 * width * height:
        raise SystemExit("a lamp that is no rectangle is not taken over")
    normal = np.cross(u, v) / (width * height)
    center = np.array(spec["corner"], float) + 0.5 * (u + v)
    return [
        {
            "kind": "AREA",
            "x": (u / width).tolist(),
            "z": (-side * normal).tolist(),
            "center": center.tolist(),
            "size": [width, height],
            "radiance": colour(spec["radiance"]),
            "gap": GAP * max(width, height),
        }
        for side in ([1, -1] if spec.get("two_sided") else [1])
    ]


def environment(spec: dict, base: Path) -> dict:
    out = {"scale": colour(spec.get("scale", 1.0)), "sample": spec.get("sample", True)}
    if "file" in spec:
        return out | {"file": str(base / spec["file"]), "rotate": spec.get("rotate", 0.0)}
    # What is the same all over needs no light samples: scattering finds it.
    return out | {"color": colour(spec["color"]), "sample": False}


# ---- Materials -----------------------------------------------------------------------------------


def shader(material: dict, scene: dict) -> dict:
    """Nodes of one BSDF each with their shares, and the radiance that is emitted."""
    emission = material["emission"]
    file = picture_file(material, scene)
    return {
        "nodes": nodes(material["lobes"]),
        "picture": file and str(file),
        "emission": emission if emission is not None and max(emission) > 0 else None,
    }


def nodes(lobes: list[dict]) -> list[dict]:
    """The nearest nodes of the lobes of `Impasto.material`."""
    clear = [lobe for lobe in lobes if lobe["bsdf"] in TRANSMISSIVE]
    if clear:
        return [plain(clear[0], np.ones(3))]
    if model := principled(lobes):
        inputs = {
            "Base Color": rgba(model["color"]),
            "Roughness": model["roughness"],
            "IOR": model["ior"],
            "Specular Tint": rgba(model["tint"]),
            "Diffuse Roughness": model["diffuse_roughness"],
        }
        return [{"node": "ShaderNodeBsdfPrincipled", "color": "Base Color", "inputs": inputs}]
    shares = [share(lobe) for lobe in lobes]
    total = sum(shares)
    return [
        plain(lobe, np.array(lobe["weight"]) * total / s) | {"share": s / total}
        for lobe, s in zip(lobes, shares, strict=True)
        if s > 1e-4
    ]


def plain(lobe: dict, weight: np.ndarray) -> dict:
    """One lobe, whose light is multiplied by `weight`."""
    kind, given = lobe["bsdf"], arguments(lobe)
    color = rgba(np.clip(weight * np.array(lobe["albedo"]), 0.0, 1.0))
    # Blender squares what it calls roughness.
    roughness = alpha(lobe) ** 0.5
    if kind in TRANSMISSIVE:
        inputs = {"Color": rgba(given.get("tint", [1.0] * 3)), "Roughness": roughness, "IOR": given["ior"]}
        return {"node": "ShaderNodeBsdfGlass", "color": None, "inputs": inputs}
    if kind == "generalized_schlick":
        inputs = {
            "Base Color": rgba(weight * np.array(given["color0"])),
            "Specular Tint": rgba(given["color82"]),
            "Roughness": roughness,
            "Metallic": 1.0,
        }
        return {"node": "ShaderNodeBsdfPrincipled", "color": None, "inputs": inputs}
    if kind in ("conductor", "single_conductor"):
        inputs = {"IOR": given["ior"], "Extinction": given["extinction"], "Roughness": roughness}
        kept = "GGX" if kind == "single_conductor" else "MULTI_GGX"
        settings = {"fresnel_type": "PHYSICAL_CONDUCTOR", "distribution": kept}
        return {"node": "ShaderNodeBsdfMetallic", "color": None, "inputs": inputs, "settings": settings}
    if kind in GLOSSY or kind in ("specular", "mirror", "smooth_conductor"):
        inputs = {"Color": color, "Roughness": roughness}
        settings = {"distribution": "BECKMANN" if kind == "blinn_phong" else "MULTI_GGX"}
        return {"node": "ShaderNodeBsdfAnisotropic", "color": None, "inputs": inputs, "settings": settings}
    return {"node": "ShaderNodeBsdfDiffuse", "color": "Color", "inputs": {"Color": color}}


def rgba(color) -> list[float]:
    return [float(x) for x in color] + [1.0]
