"""Renders: values, channels, progress, Ctrl-C, threads, forks."""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import impasto
from conftest import CORNERS, DIFFUSE, QUAD, floor_scene


def test_a_white_floor_below_white_light_is_half_of_it(floor: impasto.Scene) -> None:
    picture = impasto.render(floor, samples=64, device="cpu")
    assert picture.pixels.shape == (12, 16, 3) and picture.pixels.dtype == np.float32
    # The floor scatters half of the light's radiance of 2; no horizon is seen in the lower rows.
    assert np.allclose(picture.pixels[6:].mean(), 1.0, rtol=0.02)
    assert picture.report["samples_per_pixel"] == 64 and "16x12" in repr(picture)
    assert (picture["samples"] == 64).all()
    assert picture.png().startswith(b"\x89PNG") and picture._repr_png_() == picture.png()
    assert picture.png(-1.0) != picture.png()


def test_every_output_is_an_array(floor: impasto.Scene) -> None:
    names = [name for name in impasto.outputs() if name != "light_groups"]
    possible = []
    for name in names:
        try:
            impasto.render(floor, samples=1, outputs=[name], device="cpu")
            possible.append(name)
        except (ValueError, impasto.Error):
            # Such as groups of lights, whose names are the scene's.
            continue
    picture = impasto.render(floor, samples=4, outputs=possible, device="cpu")
    assert {"albedo", "normal", "geometric_normal", "depth", "alpha", "position", "uv", "variance", "material", "object"} <= set(picture.outputs)
    for name in picture.outputs:
        assert picture[name].shape == (12, 16, len(picture.channels(name))), name
        assert picture[name].dtype == np.float32 and np.isfinite(picture[name]).all(), name
    assert np.allclose(picture["albedo"][-1], 0.5, atol=1e-3)
    assert np.allclose(picture["normal"][-1], [0, 1, 0], atol=1e-3)
    ids = [name for name in picture.outputs if picture.names(name)]
    assert ids, picture.outputs
    for name in ids:
        first = picture[name][-1, 0, 0]
        assert picture.names(name)[int(first)] in ("wall", "floor"), picture.names(name)
    with pytest.raises(KeyError, match="there is no output"):
        picture["beauty"]
    with pytest.raises(ValueError, match="albdo"):
        impasto.render(floor, outputs=["albdo"], device="cpu")


def test_equal_seeds_give_equal_bits_as_the_command_does(root: Path, tmp_path: Path) -> None:
    scene = impasto.load(root / "examples/cornell/scene.toml")
    one = impasto.render(scene, size=(24, 18), samples=2, threads=1)
    two = impasto.render(scene, size=(24, 18), samples=2, threads=2)
    assert np.array_equal(one.pixels, two.pixels)
    assert scene.size != (24, 18)
    import subprocess

    out = tmp_path / "cornell.png"
    command = [sys.executable, "-m", "impasto", "render", str(root / "examples/cornell/scene.toml")]
    command += ["--size", "24x18", "--spp", "2", "--device", "cpu", "--out", str(out), "--quiet"]
    subprocess.run(command, check=True)
    assert out.read_bytes() == one.png()


def test_parameters_of_bindings_are_attributes(floor: impasto.Scene) -> None:
    assert list(floor.materials) == ["wall"]
    wall = floor.materials["wall"]
    before = impasto.render(floor, samples=4, device="cpu").pixels[6:].mean()
    wall.share = 1.0
    after = impasto.render(floor, samples=4, device="cpu").pixels[6:].mean()
    assert np.isclose(after, 2 * before, rtol=0.02)
    assert np.allclose(wall.albedo((0, 0, 1), device="cpu"), 1)
    with pytest.raises(AttributeError):
        wall.sahre = 0.1
    with pytest.raises(KeyError, match="no material 'walls'"):
        floor.materials["walls"]


def test_a_material_is_rendered_on_a_set(wall: impasto.Material) -> None:
    picture = impasto.render(wall, on="plane", size=(32, 24), samples=2, device="cpu")
    assert picture.pixels.shape == (24, 32, 3) and picture.pixels.max() > 0
    with pytest.raises(ValueError, match="the sets are ball, cloth, plane"):
        impasto.render(wall, on="cube")


def test_files_are_written_whole(floor: impasto.Scene, tmp_path: Path) -> None:
    picture = impasto.render(floor, samples=1, outputs=["albedo"], device="cpu")
    for name in ("a.exr", "a.png", "a.film"):
        picture.save(tmp_path / name)
        assert (tmp_path / name).stat().st_size > 100
    assert sorted(os.listdir(tmp_path)) == ["a.exr", "a.film", "a.png"]
    with pytest.raises(ValueError, match=".exr or .png"):
        picture.save(tmp_path / "a.jpg")
    with pytest.raises(impasto.FileError):
        picture.save(tmp_path / "no folder" / "a.png")


def test_progress_is_told_and_ends_a_render() -> None:
    scene = floor_scene(200, 200)
    told: list[tuple[float, str]] = []
    impasto.render(scene, samples=64, device="cpu", progress=lambda share, what: told.append((share, what)))
    shares = [share for share, _ in told]
    assert shares == sorted(shares) and shares[-1] == 1.0
    picture = impasto.render(
        scene, samples=1 << 20, device="cpu", progress=lambda share, what: not what.endswith("samples a pixel")
    )
    assert 0 < picture["samples"].min() < 1 << 20


def test_what_progress_raises_comes_through() -> None:
    class Mine(Exception):
        pass

    def progress(share: float, what: str) -> None:
        raise Mine("enough")

    begin = time.perf_counter()
    with pytest.raises(Mine, match="enough"):
        impasto.render(floor_scene(200, 200), samples=1 << 20, device="cpu", progress=progress)
    assert time.perf_counter() - begin < 30


def test_a_goal_ends_a_render(floor: impasto.Scene) -> None:
    picture = impasto.render(floor, rmse=0.5, device="cpu")
    assert picture.report["ended_by"] == "rmse"
    with pytest.raises(ValueError, match="above 0"):
        impasto.render(floor, rmse=-1, device="cpu")


def test_arguments_are_checked(floor: impasto.Scene) -> None:
    for wrong in ({"samples": 0}, {"samples": -1}, {"size": (0, 5)}, {"seed": -1}, {"threads": 0}):
        with pytest.raises(ValueError):
            impasto.render(floor, **{"device": None, **wrong})
    for wrong in ({"samples": 1.5}, {"progress": 3}, {"plan": "own"}, {"outputs": "albedo"}):
        with pytest.raises(TypeError):
            impasto.render(floor, device="cpu", **wrong)
    with pytest.raises(TypeError, match="expected a scene"):
        impasto.render(3)
    with pytest.raises(impasto.DeviceError):
        impasto.render(floor, device="no such GPU anywhere")


def test_other_threads_run_meanwhile() -> None:
    scene, counted, done = floor_scene(200, 200), [0], threading.Event()

    def count() -> None:
        while not done.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    try:
        impasto.render(scene, samples=256, device="cpu")
    finally:
        done.set()
        thread.join()
    assert counted[0] > 10


def test_two_threads_render_one_scene(floor: impasto.Scene) -> None:
    found: list[np.ndarray] = []
    work = lambda: found.append(impasto.render(floor, samples=8, device="cpu").pixels)  # noqa: E731
    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 4 and all(np.array_equal(found[0], other) for other in found)


def test_a_scene_is_deleted_and_changed_under_a_render() -> None:
    scene = floor_scene(100, 100)
    expected = impasto.render(scene, samples=64, device="cpu").pixels
    wall, found = scene.materials["wall"], []
    begun = threading.Event()

    def progress(share: float, what: str) -> None:
        if what.endswith("samples a pixel"):
            begun.set()

    def work(scene: impasto.Scene) -> None:
        found.append(impasto.render(scene, samples=64, device="cpu", progress=progress).pixels)
        begun.set()

    thread = threading.Thread(target=work, args=(scene,))
    thread.start()
    begun.wait(60)
    wall.share = 0.1
    del scene, wall
    thread.join()
    assert np.array_equal(found[0], expected)


@pytest.mark.skipif(os.name != "posix", reason="signals are sent as on Unix")
def test_ctrl_c_ends_a_render(run) -> None:
    done = run(
        """
import os, signal, threading, time, impasto
from conftest import floor_scene
scene = floor_scene(200, 200)
impasto.render(scene, samples=1, device="cpu")
threading.Timer(1.0, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
begin = time.perf_counter()
try:
    impasto.render(scene, samples=1 << 22, device="cpu")
except KeyboardInterrupt:
    print("ended after", round(time.perf_counter() - begin, 2))
    # And it goes on.
    print(impasto.render(scene, samples=1, device="cpu").pixels.shape)
"""
    )
    assert done.returncode == 0 and "ended after" in done.stdout and "(200, 200, 3)" in done.stdout, done
    assert float(done.stdout.split()[2]) < 20


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there are no forks here")
def test_a_fork_is_refused_in_words(run) -> None:
    done = run(
        """
import os, impasto
from conftest import floor_scene
scene = floor_scene()
pid = os.fork()
if pid == 0:
    try:
        impasto.render(scene, samples=1, device="cpu")
    except RuntimeError as error:
        print("refused:", error, flush=True)
    os._exit(0)
_, status = os.waitpid(pid, 0)
assert status == 0
print(impasto.render(scene, samples=1, device="cpu").pixels.shape)
"""
    )
    assert "refused:" in done.stdout and "forked" in done.stdout and "(12, 16, 3)" in done.stdout, done


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there are no forks here")
def test_children_alone_may_use_it(run) -> None:
    done = run(
        """
import os, impasto
from conftest import floor_scene
pid = os.fork()
if pid == 0:
    print(impasto.render(floor_scene(), samples=1, device="cpu").pixels.shape, flush=True)
    os._exit(0)
assert os.waitpid(pid, 0)[1] == 0
"""
    )
    assert "(12, 16, 3)" in done.stdout, done


def test_scenes_of_arrays_refuse_wrong_ones() -> None:
    def builder() -> impasto.SceneBuilder:
        return impasto.SceneBuilder(8, 8).material("wall", impasto.Material(source=DIFFUSE))

    bad = QUAD.copy()
    bad[1, 1] = np.nan
    for args, error, said in [
        ((QUAD[:, :2], CORNERS), ValueError, r"`vertices` has the shape \(4, 2\): expected \(any, 3\)"),
        ((bad, CORNERS), ValueError, "finite"),
        ((QUAD.astype(str), CORNERS), TypeError, "real numbers"),
        ((QUAD, CORNERS.astype(float)), TypeError, "expected integers"),
        ((QUAD, CORNERS + 3), ValueError, "there are 4 vertices"),
        ((QUAD, CORNERS - 1), ValueError, "expected indices from 0"),
        ((QUAD, np.zeros((0, 3), dtype=int)), ValueError, "no triangle"),
    ]:
        with pytest.raises(error, match=said):
            builder().mesh("quad", *args, material="wall")
    with pytest.raises(ValueError, match="`normals` has 2 rows for 4 vertices"):
        builder().mesh("quad", QUAD, CORNERS, normals=QUAD[:2], material="wall")
    with pytest.raises(impasto.SceneError) as caught:
        builder().camera(position=(0, 1, 0), look_at=(0, 0, 0), fov=400).mesh("q", QUAD, CORNERS, material="wall").build()
    assert "fov" in str(caught.value) and caught.value.diagnostics[0].line is not None
    with pytest.raises(impasto.SceneError, match="wal"):
        builder().camera(position=(0, 1, 0), look_at=(0, 0, 1), fov=40).mesh("q", QUAD, CORNERS, material="wal").build()


def test_normals_and_uvs_of_arrays_are_seen() -> None:
    source = "use std::bsdf::diffuse;\nmaterial m { surface = diffuse(color(uv.x, uv.y, 0)); }"
    uvs = np.array([[0.2, 0.6]] * 4)
    scene = (
        impasto.SceneBuilder(8, 8, max_depth=1)
        .camera(position=(0, 2, 0.01), look_at=(0, 0, 0), fov=20)
        .material("m", impasto.Material(source=source))
        .mesh("quad", QUAD, CORNERS, normals=[[0, 1, 0.5]] * 4, uvs=uvs, material="m")
        .light("distant", to_light=(0, 1, 0), irradiance=(1, 1, 1))
        .build()
    )
    picture = impasto.render(scene, samples=2, outputs=["albedo", "normal"], device="cpu")
    assert np.allclose(picture["albedo"][4, 4], [0.2, 0.6, 0], atol=1e-3)
    expected = np.array([0, 1, 0.5]) / np.hypot(1, 0.5)
    assert np.allclose(picture["normal"][4, 4], expected, atol=1e-3)


def test_the_report_is_that_of_the_command(floor: impasto.Scene) -> None:
    report = impasto.render(floor, samples=1, device="cpu").report
    json.dumps(report)
    assert {"paths", "wall_seconds", "adapter"} <= set(report)
