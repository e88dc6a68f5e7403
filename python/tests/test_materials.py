"""Materials: parameters as attributes, check, emit, cost, and errors with diagnostics."""

from __future__ import annotations

import json
import pickle
from pathlib import Path

import numpy as np
import pytest

import impasto
from conftest import DIFFUSE

BROKEN = "use std::bsdf::diffuse;\nmaterial m {\n    surface = difuse(0.5);\n}\n"


def test_parameters_are_attributes(wall: impasto.Material) -> None:
    assert wall.share == 0.5 and wall.__doc__ == "A plain wall."
    wall.share = 0.25
    assert wall.share == 0.25 and "share" in dir(wall)
    del wall.share
    assert wall.share == 0.5
    declared = wall.parameters["share"]
    assert (declared.type, declared.hard, declared.docs) == ("float", (0.0, 1.0), "Its share of light.")
    with pytest.raises(AttributeError, match="did you mean `share`"):
        wall.shar = 0.1
    with pytest.raises(ValueError, match="expected 0 to 1"):
        wall.share = 1.5
    with pytest.raises(ValueError, match="finite"):
        wall.share = float("nan")
    with pytest.raises(TypeError, match="expected a color"):
        wall.tint = object()
    assert "share" in wall._repr_html_()


def test_values_reach_the_compiler(wall: impasto.Material) -> None:
    wall.tint = (1.0, 0.5, 0.25)
    wall.share = np.float32(0.5)
    assert np.allclose(wall.albedo((0, 0, 1), device="cpu"), [0.5, 0.25, 0.125], rtol=1e-6)
    wall.tint = "srgb(0xffffff)"
    assert np.allclose(wall.albedo((0, 0, 1), device="cpu"), 0.5, rtol=1e-6)
    wall.tint = "no_such_name"
    with pytest.raises(impasto.SourceError) as caught:
        wall.albedo((0, 0, 1), device="cpu")
    assert caught.value.diagnostics[0].code == "E0201"


def test_an_error_carries_diagnostics_as_a_terminal_shows_them() -> None:
    with pytest.raises(impasto.SourceError) as caught:
        impasto.emit(source=BROKEN)
    error = caught.value
    [found] = error.diagnostics.errors
    assert (found.code, found.line, found.column) == ("E0201", 3, 15)
    assert "diffuse" in (found.hint or "")
    assert "difuse" in str(error) and "3 │" in str(error) and "\x1b" not in str(error)
    assert isinstance(error, impasto.Error) and not error.transient
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) and list(again.diagnostics) == list(error.diagnostics)


def test_check_reports_and_raises_nothing(root: Path, tmp_path: Path) -> None:
    found = impasto.check(source=BROKEN)
    assert len(found.errors) == 1 and "difuse" in found._repr_html_()
    assert not impasto.check("std::surface::open_pbr")
    assert not impasto.check(root / "examples/cornell/scene.toml").errors
    scene = tmp_path / "scene.toml"
    scene.write_text("[camera]\npositon = [0, 0, 0]\n")
    [error] = impasto.check(scene)
    assert error.line == 2 and "position" in error.message + (error.hint or "")
    with pytest.raises(impasto.FileError):
        impasto.check(tmp_path / "nothing.impasto")
    with pytest.raises(impasto.SceneError) as caught:
        impasto.load(scene)
    assert caught.value.diagnostics[0].file == str(scene)


def test_stages_are_those_of_the_command(tmp_path: Path) -> None:
    file = tmp_path / "wall.impasto"
    file.write_text(DIFFUSE)
    assert "fn evaluate_wall(" in impasto.emit(file)
    assert impasto.emit(file, "ir") and impasto.emit(file, "ast") and impasto.emit(file, "tokens")
    [declared] = json.loads(impasto.emit(file, "params"))
    assert [p["name"] for p in declared["params"]] == ["tint", "share"]
    with pytest.raises(ValueError, match="there is no stage `wgls`"):
        impasto.emit(file, "wgls")
    with pytest.raises(ValueError, match="no target"):
        impasto.emit(file, target="metal")


def test_costs_count_operations(wall: impasto.Material, root: Path) -> None:
    costs = impasto.cost(wall, samples=64)
    mean = costs["wall"]["cost"]["operations"]["mean"]
    assert mean > 10 and "wall" in repr(costs) and "wall" in costs._repr_html_()
    glossy = impasto.cost("std::surface::open_pbr", samples=16)
    assert glossy[0]["cost"]["operations"]["mean"] > 2 * mean
    scene = impasto.cost(root / "examples/cornell/scene.toml", samples=16)
    assert len(scene) > 1


def test_one_point_is_told_in_full(wall: impasto.Material) -> None:
    [answer] = impasto.inspect(wall, at="wo=(0, 0, 1)")["answers"]
    surface = answer["results"][0]["surface"]
    assert [lobe["bsdf"] for lobe in surface["lobes"]] == ["diffuse"]
    with pytest.raises(ValueError, match="unknown key"):
        impasto.inspect(wall, at="w=(0, 0, 1)")


def test_a_diagnostic_is_explained() -> None:
    assert "unknown name" in impasto.explain("E0201")
    with pytest.raises(KeyError):
        impasto.explain("E9999")


def test_of_several_materials_one_is_named() -> None:
    two = DIFFUSE + DIFFUSE.split("\n", 1)[1].replace("material wall", "material other")
    with pytest.raises(ValueError, match="`wall`, `other`"):
        impasto.Material(source=two)
    assert impasto.Material(source=two, name="other").share == 0.5
    with pytest.raises(impasto.SourceError) as caught:
        impasto.Material(source=two, name="third")
    assert caught.value.diagnostics[0].code == "E0109"
