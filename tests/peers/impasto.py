"""Impasto's side: scene files, what materials are made of, and pictures by the command."""

import json
import subprocess
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from geometry import load_obj, transformed


@dataclass
class Impasto:
    """The `impasto` command."""

    path: str
    known: dict = field(default_factory=dict)

    def run(self, *arguments: str) -> str:
        done = subprocess.run([self.path, *arguments], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise SystemExit(f"{' '.join([self.path, *arguments])}\n{done.stderr}")
        return done.stdout

    def render(self, scene: Path, out: Path, *options: str) -> dict:
        """Renders an EXR picture; gives the report."""
        report = out.with_suffix(".json")
        self.run("render", str(scene), "--out", str(out), "--report", str(report), "--quiet", *options)
        return json.loads(report.read_text())

    def material(self, file: Path, name: str | None, params: dict[str, str]) -> dict:
        """A material at one point of its surface: `parameters`, `lobes` and `emission`."""
        key = (str(file), name, tuple(params.items()))
        if key not in self.known:
            options = ["--material", name] if name else []
            for entry in params.items():
                options += ["--param", "=".join(entry)]
            answer = json.loads(self.run("eval", str(file), "--format", "json", *options))["answers"][0]
            result = answer["results"][0]
            self.known[key] = {
                "file": file,
                "parameters": {p["name"]: p["value"] for p in answer.get("parameters", [])},
                "lobes": result.get("surface", {}).get("lobes", []),
                "emission": result.get("emission"),
            }
        return self.known[key]


def load_scene(path: Path) -> dict:
    """A scene file with the defaults that matter here."""
    scene = tomllib.loads(path.read_text())
    scene.setdefault("film", {})
    scene["film"] = {"width": 1024, "height": 768} | scene["film"]
    scene["integrator"] = {"max_depth": 16, "roulette_start": 4} | scene.get("integrator", {})
    scene["base"] = path.resolve().parent
    return scene


def load_mtl(path: Path) -> dict[str, dict]:
    """The values of an MTL file that bindings may ask for, by material."""
    found: dict[str, dict] = {}
    current: dict = {}
    if not path.is_file():
        return found
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        key, _, rest = line.strip().partition(" ")
        if key == "newmtl":
            current = found.setdefault(rest.strip(), {})
        elif key in ("Kd", "Ks", "Ke"):
            current[key] = [float(x) for x in rest.split()[:3]]
        elif key in ("Ns", "Ni", "d"):
            current[key] = float(rest.split()[0])
        elif key == "map_Kd":
            current[key] = str(path.parent / rest.strip())
    return found


MTL_DEFAULTS = {"Kd": [0.8] * 3, "Ks": [0.0] * 3, "Ke": [0.0] * 3, "Ns": 10.0, "Ni": 1.5, "d": 1.0}


def source_text(value, mtl: dict) -> str | None:
    """A value of `params` as Impasto source; None keeps the parameter's default."""
    if isinstance(value, str) and value.startswith("$"):
        value = mtl.get(value[1:], MTL_DEFAULTS.get(value[1:]))
        if value is None:
            return None
        if isinstance(value, str):
            return f'"{value}"'
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list):
        kind = {2: "vec2", 3: "color", 4: "vec4"}[len(value)]
        return f"{kind}({', '.join(repr(float(x)) for x in value)})"
    return value if isinstance(value, str) else repr(value)


def bound_material(scene: dict, name: str, mtl: dict, impasto: Impasto) -> dict:
    """What the scene binds to the name of a material in an OBJ file."""
    bindings = scene.get("materials", {})
    binding = bindings.get(name, bindings.get("*"))
    if binding is None:
        raise SystemExit(f"nothing is bound to `{name}`")
    texts = {k: source_text(v, mtl.get(name, {})) for k, v in binding.get("params", {}).items()}
    texts = {k: v for k, v in texts.items() if v is not None}
    file = binding["file"]
    # A module of the library is no file.
    file = Path(file) if file.startswith("std::") else scene["base"] / file
    return impasto.material(file, binding.get("material"), texts)


def meshes(scene: dict, impasto: Impasto):
    """Every mesh of a scene: triangles in world space, and the material that is bound to them."""
    loaded: dict[Path, tuple] = {}
    for spec in scene["geometry"]:
        path = scene["base"] / spec["obj"]
        if path not in loaded:
            parts, libraries = load_obj(path)
            mtl = {}
            for library in libraries:
                mtl |= load_mtl(library)
            loaded[path] = (parts, mtl)
        parts, mtl = loaded[path]
        places = spec.get("placements", [{}])
        if isinstance(places, str) or "matrix" in spec or any("matrix" in place for place in places):
            raise SystemExit(f"{path}: files of placements and matrices are not taken over")
        for place in places:
            for part, mesh in parts.items():
                name = place.get("material", spec.get("material", part.split("\0")[0]))
                placed = transformed(transformed(mesh, spec), place)
                yield placed, bound_material(scene, name, mtl, impasto)


def colour(value) -> list[float]:
    """A color of a scene file, which may be one number."""
    return [float(value)] * 3 if isinstance(value, (int, float)) else [float(x) for x in value]


TRANSMISSIVE = {"smooth_dielectric", "dielectric"}

GLOSSY = {"blinn_phong", "metal", "generalized_schlick", "coating"}
"""Lobes of rough facets whose color is their own."""


def alpha(lobe: dict) -> float:
    """The roughness of a lobe as renderers' facets have it. Blinn-Phong's lobes are as wide as Beckmann's."""
    given = arguments(lobe)
    if lobe["bsdf"] == "blinn_phong":
        return float(np.sqrt(2.0 / (given["exponent"] + 2.0)))
    return given.get("roughness", 0.0) ** 2


def arguments(lobe: dict) -> dict:
    return {a["name"]: a["value"] for a in lobe["arguments"]}


def share(lobe: dict) -> float:
    """How much of white light a lobe sends back."""
    return float(np.max(np.array(lobe["weight"]) * np.array(lobe["albedo"])))


def principled(lobes: list[dict]) -> dict | None:
    """The inputs of a principled model, where lobes are a gloss over a diffuse one as OpenPBR has them. `color` is what
    the diffuse lobe has where the gloss lets all light through."""
    if [lobe["bsdf"] for lobe in lobes] not in (["coating", "oren_nayar_diffuse"], ["coating", "diffuse"]):
        return None
    gloss, ground = lobes
    passed = 1.0 - np.array(gloss["weight"]) * np.array(gloss["albedo"])
    above = arguments(gloss)
    return {
        "color": np.array(ground["weight"]) * np.array(ground["albedo"]) / passed,
        "roughness": above["roughness"],
        "ior": above["ior"],
        "tint": above["tint"],
        "diffuse_roughness": arguments(ground).get("roughness", 0.0),
    }


def picture_file(material: dict, scene: dict) -> Path | None:
    """The picture of a material that reads exactly one."""
    paths = [v for v in material["parameters"].values() if isinstance(v, str)]
    if len(paths) != 1:
        return None
    for base in (scene["base"], Path(material["file"]).parent):
        if (base / paths[0]).is_file():
            return base / paths[0]
    return None
