"""BSDFs at arrays: closed forms, the interpreter, shapes, and what is refused."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

import impasto
from conftest import floor_scene


def hemisphere(count: int, seed: int = 1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(count, 3))
    directions[:, 2] = np.abs(directions[:, 2]) + 1e-3
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def test_a_diffuse_surface_is_its_closed_form(wall: impasto.Material) -> None:
    wall.tint = (1, 1, 1)
    wi = hemisphere(1000)
    value, pdf = wall.eval((0, 0, 1), wi, device="cpu")
    assert value.shape == (1000, 3) and pdf.shape == (1000,) and value.dtype == np.float32
    assert np.allclose(value[:, 0], 0.5 * wi[:, 2] / np.pi, rtol=1e-5)
    assert np.allclose(pdf, wi[:, 2] / np.pi, rtol=1e-5)


def test_samples_have_the_density_that_eval_tells(wall: impasto.Material) -> None:
    u = np.random.default_rng(2).random((500, 4), dtype=np.float32)
    found = wall.sample((0.6, 0, 0.8), u, device="cpu")
    value, pdf = wall.eval((0.6, 0, 0.8), found.wi, device="cpu")
    assert np.allclose(found.pdf, pdf, rtol=1e-4)
    assert np.allclose(found.throughput, value / pdf[:, None], rtol=1e-3)
    assert not found.transmitted.any()
    assert np.allclose(np.linalg.norm(found.wi, axis=1), 1, atol=1e-5)


@pytest.mark.parametrize(
    "module", ["std::surface::open_pbr", "std::surface::disney_principled", "std::surface::gltf_pbr", "std::surface::standard_surface"]
)
def test_arrays_agree_with_the_interpreter(module: str) -> None:
    material = impasto.Material(module)
    wo, wi = hemisphere(4, 3), hemisphere(4, 4)
    value, pdf = material.eval(wo, wi, position=(0.3, 0.1, 0.2), device="cpu")
    u = np.full((4, 4), 0.3, dtype=np.float32)
    sampled = material.sample(wo, u, position=(0.3, 0.1, 0.2), device="cpu")
    for row in range(4):
        o, i = tuple(wo[row].tolist()), tuple(wi[row].tolist())
        at = f"position=(0.3, 0.1, 0.2), u=(0.3, 0.3, 0.3, 0.3), wo={o}, wi={i}"
        [answer] = impasto.inspect(material, at=at)["answers"]
        surface = next(r for r in answer["results"] if r["precision"] == "f32")["surface"]
        assert np.allclose(value[row], surface["toward"]["value"], rtol=2e-3, atol=1e-6)
        assert np.allclose(pdf[row], surface["toward"]["pdf"], rtol=2e-3, atol=1e-6)
        assert np.allclose(sampled.wi[row], surface["sampled"]["wi"], atol=2e-3)


def test_shapes_broadcast(wall: impasto.Material) -> None:
    wo, wi = hemisphere(3).reshape(3, 1, 3), hemisphere(5).reshape(1, 5, 3)
    value, pdf = wall.eval(wo, wi, device="cpu")
    assert value.shape == (3, 5, 3) and pdf.shape == (3, 5)
    one = wall.eval(wo[2, 0], wi[0, 4], device="cpu")
    assert np.array_equal(value[2, 4], one.value) and pdf[2, 4] == one.pdf
    assert wall.eval(np.zeros((0, 3)), (0, 0, 1), device="cpu").value.shape == (0, 3)
    assert wall.albedo(wo, device="cpu").shape == (3, 1, 3)
    assert (wall.emission(wo, device="cpu") == 0).all()
    ints = wall.eval([0, 0, 1], [0, 0, 2], device="cpu")
    assert np.allclose(ints.pdf, 1 / np.pi)


def test_the_surface_point_is_given(wall: impasto.Material) -> None:
    tilted = wall.eval((0, 1, 0), (0, 1, 0), normal=(0, 3, 0), device="cpu")
    assert np.allclose(tilted.pdf, 1 / np.pi, rtol=1e-5)
    rows = impasto.Material(
        source="use std::bsdf::diffuse;\nmaterial m { surface = diffuse(color(position.x, uv.y, 0)); }"
    )
    positions = np.stack([np.linspace(0, 1, 5), np.zeros(5), np.zeros(5)], axis=1)
    albedo = rows.albedo((0, 0, 1), position=positions, uv=(0, 0.75), device="cpu")
    assert np.allclose(albedo[:, 0], positions[:, 0], atol=1e-6) and np.allclose(albedo[:, 1], 0.75)


def test_a_picture_is_looked_up(tmp_path: Path) -> None:
    picture = impasto.render(floor_scene(), samples=4, device="cpu")
    picture.save(tmp_path / "floor.exr")
    source = (
        "use std::bsdf::diffuse;\n"
        'material m { param picture: texture = "none.png"; surface = diffuse(0.5 * image(picture, uv)); }'
    )
    textured = impasto.Material(source=source, picture=tmp_path / "floor.exr")
    height, width, _ = picture.pixels.shape
    rows, columns = np.indices((height, width))
    # The centres of texels, v up.
    uv = np.stack([(columns + 0.5) / width, 1 - (rows + 0.5) / height], axis=-1)
    albedo = textured.albedo((0, 0, 1), uv=uv, device="cpu")
    assert np.allclose(albedo, np.minimum(0.5 * picture.pixels, 1), atol=2e-3)


def test_wrong_arrays_are_refused(wall: impasto.Material) -> None:
    up = (0, 0, 1)
    for wrong, error, said in [
        ((0, 1), ValueError, r"`wi` has the shape \(2,\): expected \(\.\.\., 3\)"),
        (np.zeros((2, 2)), ValueError, "expected"),
        (("a", "b", "c"), TypeError, "expected real numbers"),
        (np.zeros(3, dtype=complex), TypeError, "dtype complex128"),
        (np.zeros(3, dtype=bool), TypeError, "dtype bool"),
        ([[0, 0, 1], [0, 1]], TypeError, "no array"),
        ((0, 0, np.nan), ValueError, "finite"),
        ((0, np.inf, 1), ValueError, "finite"),
        ((0, 0, 1e300), ValueError, "finite"),
        ((0, 0, 0), ValueError, "direction"),
    ]:
        with pytest.raises(error, match=said):
            wall.eval(up, wrong, device="cpu")
    with pytest.raises(ValueError, match="do not go together"):
        wall.eval(hemisphere(3), hemisphere(4), device="cpu")
    with pytest.raises(ValueError, match=r"\[0, 1\)"):
        wall.sample(up, (0, 0, 0, 1), device="cpu")
    with pytest.raises(TypeError, match="there is no input `colour`"):
        wall.eval(up, up, colour=(1, 1, 1), device="cpu")
    with pytest.raises(ValueError, match="row 1"):
        wall.eval(up, np.array([[0, 0, 1], [0, 0, 0], [0, 0, 1]]), device="cpu")


def test_a_million_take_a_second_on_a_core(wall: impasto.Material) -> None:
    wi = hemisphere(1_000_000).astype(np.float32)
    wall.eval((0, 0, 1), wi[:10], threads=1)
    begin = time.perf_counter()
    value, _ = wall.eval((0, 0, 1), wi, threads=1)
    seconds = time.perf_counter() - begin
    assert value.shape == (1_000_000, 3)
    # The goal is a second; a machine that does other things at the same time takes longer.
    assert seconds < 5, seconds


def test_a_gpu_gives_what_the_processor_gives(gpu: str) -> None:
    material = impasto.Material("std::surface::open_pbr", specular_roughness=0.4)
    # More than a portion, and no multiple of a workgroup.
    wi = hemisphere(300_001, 5)
    here, there = (material.eval((0.6, 0, 0.8), wi, device=device) for device in ("cpu", gpu))
    assert np.allclose(here.value, there.value, rtol=2e-2, atol=1e-4)
    assert np.allclose(here.pdf, there.pdf, rtol=2e-2, atol=1e-4)
    u = np.random.default_rng(6).random((1000, 4), dtype=np.float32)
    here, there = (material.sample((0.6, 0, 0.8), u, device=device) for device in ("cpu", gpu))
    # A number on the edge between two lobes may choose either.
    assert (np.abs(here.wi - there.wi).max(axis=1) < 1e-2).mean() > 0.99
