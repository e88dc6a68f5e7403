"""An Impasto scene as a dictionary that Mitsuba loads. What differs is named by `NEAREST`."""

import tempfile
from pathlib import Path

import mitsuba as mi
import numpy as np

from geometry import write_ply
from impasto import GLOSSY, TRANSMISSIVE, Impasto, alpha, arguments, colour, meshes, picture_file, principled, share

NEAREST = """Each material becomes its lobes at one point, seen from 37 degrees: patterns, noise and
flakes become constants; a picture on a diffuse lobe stays. A gloss over a diffuse lobe, as OpenPBR has it,
becomes `principled`. Other layered lobes become a `blendbsdf` weighted by their shares. Blinn-Phong lobes
become rough conductors of the same width."""


def translate(scene: dict, impasto: Impasto, size: tuple[int, int] | None = None) -> dict:
    """The dictionary of a scene from `impasto.load_scene`; meshes are written to a temporary
    folder that lives as long as the dictionary."""
    folder = tempfile.TemporaryDirectory(prefix="impasto-peer-")
    width, height = size or (scene["film"]["width"], scene["film"]["height"])
    out = {
        "type": "scene",
        "integrator": {
            "type": "path",
            "max_depth": scene["integrator"]["max_depth"],
            "rr_depth": scene["integrator"]["roulette_start"],
        },
        "sensor": camera(scene["camera"], width, height),
    }
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for number, (mesh, material) in enumerate(meshes(scene, impasto)):
        low = np.minimum(low, mesh.positions.min(axis=(0, 1)))
        high = np.maximum(high, mesh.positions.max(axis=(0, 1)))
        path = Path(folder.name) / f"{number}.ply"
        write_ply(mesh, path)
        shape = {"type": "ply", "filename": str(path), "face_normals": mesh.normals is None}
        shape["bsdf"] = bsdf(material, scene)
        if material["emission"] is not None and max(material["emission"]) > 0:
            shape["emitter"] = {"type": "area", "radiance": rgb(material["emission"])}
        out[f"mesh_{number}"] = shape
    reach = float(np.linalg.norm(high - low))
    for number, light in enumerate(scene.get("lights", [])):
        out |= {f"light_{number}_{i}": s for i, s in enumerate(lights(light, 0.5 * (low + high), reach))}
    if "environment" in scene:
        out["environment"] = environment(scene["environment"], scene["base"])
    # Mitsuba reads the files when the dictionary is loaded.
    out["_folder"] = folder
    return out


def load(dictionary: dict) -> "mi.Scene":
    """The scene of a dictionary from `translate`."""
    return mi.load_dict({k: v for k, v in dictionary.items() if not k.startswith("_")})


def rgb(value) -> dict:
    return {"type": "rgb", "value": [float(x) for x in value]}


# ---- Camera and lights -----------------------------------------------------------------------


def camera(spec: dict, width: int, height: int) -> dict:
    transform = mi.ScalarTransform4f().look_at(
        origin=spec["position"], target=spec["look_at"], up=spec.get("up", [0, 1, 0])
    )
    distance = float(np.linalg.norm(np.subtract(spec["look_at"], spec["position"])))
    out = {
        "type": "perspective",
        "fov": spec["fov"],
        "fov_axis": "y",
        "to_world": transform,
        "near_clip": 1e-4 * distance,
        "far_clip": 1e5 * distance,
        "film": {
            "type": "hdrfilm",
            "width": width,
            "height": height,
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": "independent"},
    }
    if spec.get("aperture", 0) > 0:
        out["type"] = "thinlens"
        out["aperture_radius"] = 0.5 * spec["aperture"]
        out["focus_distance"] = spec.get("focus", distance)
    return out


def lights(spec: dict, center: np.ndarray, reach: float) -> list[dict]:
    """The shapes and emitters of a light; `center` and `reach` are of the geometry."""
    if spec["kind"] == "quad":
        u, v = np.array(spec["u"], float), np.array(spec["v"], float)
        corner = np.array(spec["corner"], float)
        radiance = colour(spec["radiance"])
        if not spec.get("two_sided"):
            return [rectangle(corner, u, v, radiance)]
        # Mitsuba's rectangles emit from one side. Two in the same place would be hit from behind as often as from
        # the front, and be black there, so each lies a little before the other's back.
        gap = 1e-4 * max(np.linalg.norm(u), np.linalg.norm(v))
        normal = np.cross(u, v) / np.linalg.norm(np.cross(u, v))
        return [
            rectangle(corner + side * gap * normal, *edges, radiance) for side, edges in [(1, (u, v)), (-1, (v, u))]
        ]
    to_light = np.array(spec["to_light"], float)
    to_light /= np.linalg.norm(to_light)
    irradiance = np.array(colour(spec["irradiance"]))
    angle = np.radians(spec.get("angle", 0.0))
    if angle == 0:
        return [{"type": "directional", "direction": (-to_light).tolist(), "irradiance": rgb(irradiance)}]
    # A disc of the same size, so far away that its rays are all but parallel.
    distance = 1000.0 * reach
    place = center + distance * to_light
    up = [1, 0, 0] if abs(to_light[1]) > 0.9 else [0, 1, 0]
    transform = mi.ScalarTransform4f().look_at(origin=place.tolist(), target=center.tolist(), up=up)
    transform = transform @ mi.ScalarTransform4f().scale(float(distance * np.tan(0.5 * angle)))
    radiance = irradiance / (np.pi * np.sin(0.5 * angle) ** 2)
    return [
        {
            "type": "disk",
            "to_world": transform,
            "bsdf": {"type": "diffuse", "reflectance": rgb([0, 0, 0])},
            "emitter": {"type": "area", "radiance": rgb(radiance)},
        }
    ]


def rectangle(corner: np.ndarray, u: np.ndarray, v: np.ndarray, radiance: list[float]) -> dict:
    """A lamp that emits to the side of u x v."""
    matrix = np.eye(4)
    normal = np.cross(u, v)
    matrix[:3, 0], matrix[:3, 1] = 0.5 * u, 0.5 * v
    matrix[:3, 2], matrix[:3, 3] = normal / np.linalg.norm(normal), corner + 0.5 * (u + v)
    return {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f(matrix.tolist()),
        "bsdf": {"type": "diffuse", "reflectance": rgb([0, 0, 0])},
        "emitter": {"type": "area", "radiance": rgb(radiance)},
    }


def environment(spec: dict, base: Path) -> dict:
    scale = np.array(colour(spec.get("scale", 1.0)))
    if "file" not in spec:
        return {"type": "constant", "radiance": rgb(np.array(colour(spec["color"])) * scale)}
    bitmap = mi.Bitmap(str(base / spec["file"]))
    bitmap = bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
    texels = resampled(np.array(bitmap) * scale)
    # Mitsuba's left edge, and Impasto's middle, is -z.
    turn = mi.ScalarTransform4f().rotate([0, 1, 0], 180.0 + spec.get("rotate", 0.0))
    return {"type": "envmap", "bitmap": mi.Bitmap(texels.astype(np.float32)), "to_world": turn}


def resampled(texels: np.ndarray) -> np.ndarray:
    """A lat-long picture with texels where Mitsuba has them: at whole steps from the left edge, and
    from pole to pole. Small pictures get more of them, so that bilinear lookups agree."""
    height, width = texels.shape[:2]
    factor = max(1, 1024 // width)
    rows = np.arange(factor * height + 1) / factor - 0.5
    columns = np.arange(factor * width) / factor - 0.5
    top, left = np.floor(rows).astype(int), np.floor(columns).astype(int)
    a, b = (rows - top)[:, None, None], (columns - left)[None, :, None]
    y0, y1 = np.clip(top, 0, height - 1)[:, None], np.clip(top + 1, 0, height - 1)[:, None]
    x0, x1 = (left % width)[None], ((left + 1) % width)[None]
    upper = texels[y0, x0] * (1 - b) + texels[y0, x1] * b
    lower = texels[y1, x0] * (1 - b) + texels[y1, x1] * b
    return upper * (1 - a) + lower * a


# ---- Materials -------------------------------------------------------------------------------


def bsdf(material: dict, scene: dict) -> dict:
    """The nearest BSDF of a material from `Impasto.material`."""
    lobes = [(lobe, share(lobe)) for lobe in material["lobes"]]
    lobes = [(lobe, s) for lobe, s in lobes if s > 1e-4]
    if not lobes:
        return {"type": "diffuse", "reflectance": rgb([0, 0, 0])}
    for lobe, _ in lobes:
        if lobe["bsdf"] in TRANSMISSIVE:
            return plain(lobe, np.ones(3), material, scene)
    if model := principled(material["lobes"]):
        color = picture(material, scene) or rgb(model["color"])
        nested = {"type": "principled", "base_color": color, "roughness": model["roughness"], "eta": model["ior"]}
        return {"type": "twosided", "nested": nested}
    total = sum(s for _, s in lobes)
    result, covered = None, 0.0
    for lobe, s in lobes:
        color = np.array(lobe["weight"]) * np.array(lobe["albedo"]) * total / s
        color = color / np.maximum(np.array(lobe["albedo"]), 1e-6)
        one = plain(lobe, color, material, scene)
        if one["type"] == "conductor" and len(lobes) > 1:
            # Blends with a discrete part are biased in Mitsuba 3.9: README.md has the numbers.
            one |= {"type": "roughconductor", "distribution": "ggx", "alpha": NEARLY_SMOOTH}
        covered += s
        if result is None:
            result = one
        else:
            result = {"type": "blendbsdf", "weight": s / covered, "bsdf_0": result, "bsdf_1": one}
    return {"type": "twosided", "nested": result}


NEARLY_SMOOTH = 0.01
"""The alpha of mirrors that are part of a blend."""


def plain(lobe: dict, color: np.ndarray, material: dict, scene: dict) -> dict:
    """One lobe, whose light is multiplied by `color`."""
    kind = lobe["bsdf"]
    given = arguments(lobe)
    if kind in ("smooth_dielectric", "dielectric"):
        out = {"type": "dielectric", "int_ior": given["ior"], "ext_ior": 1.0}
        if "tint" in given:
            out["specular_transmittance"] = rgb(given["tint"])
        if kind == "dielectric" and given["roughness"] > 0:
            out |= {"type": "roughdielectric", "distribution": "ggx", "alpha": alpha(lobe)}
        return out
    if kind in ("conductor", "single_conductor"):
        return {
            "type": "roughconductor",
            "distribution": "ggx",
            "alpha": alpha(lobe),
            "eta": rgb(given["ior"]),
            "k": rgb(given["extinction"]),
            "specular_reflectance": rgb(np.minimum(color, 1.0)),
        }
    albedo = np.minimum(color * np.array(lobe["albedo"]), 1.0)
    if kind in ("specular", "mirror", "smooth_conductor"):
        return {"type": "conductor", "material": "none", "specular_reflectance": rgb(albedo)}
    if kind in GLOSSY:
        return {
            "type": "roughconductor",
            "distribution": "beckmann" if kind == "blinn_phong" else "ggx",
            "material": "none",
            "alpha": max(alpha(lobe), 1e-3),
            "specular_reflectance": rgb(albedo),
        }
    return {"type": "diffuse", "reflectance": picture(material, scene) or rgb(albedo)}


def picture(material: dict, scene: dict) -> dict | None:
    path = picture_file(material, scene)
    return path and {"type": "bitmap", "filename": str(path), "wrap_mode": "repeat"}
