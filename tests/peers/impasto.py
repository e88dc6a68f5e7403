"""Impasto's side: scene files, what materials are made of, and pictures by the command."""

import json
import subprocess
import tomllib
from dataclasses import dataclass, field
from pathlib import Path


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
    scene["integrator"] = {"max_depth": 16, "roulette_start": 8} | scene.get("integrator", {})
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
    return impasto.material(scene["base"] / binding["file"], binding.get("material"), texts)
