"""Plans: strategies of the table, and time models, searches and strategies that are written here."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import impasto

SCENE = "examples/swatches/scene.toml"


@pytest.fixture(scope="module")
def known() -> impasto.Materials:
    from conftest import CORNERS, DIFFUSE, QUAD

    builder = impasto.SceneBuilder(16, 16, name="swatches").camera(position=(0, 3, 4), look_at=(0, 0, 0), fov=60)
    for number in range(4):
        glossy = impasto.Material("std::surface::open_pbr", specular_roughness=0.1 + 0.2 * number)
        plain = impasto.Material(source=DIFFUSE.replace("wall", f"wall{number}"))
        builder.material(f"m{number}", glossy if number == 0 else plain)
        builder.mesh(f"q{number}", QUAD + [3.0 * number, 0, 0], CORNERS, material=f"m{number}")
    return impasto.materials(builder.environment(color=(1, 1, 1)).build(), samples=64)


@pytest.fixture(scope="module")
def hits(known: impasto.Materials) -> impasto.Workload:
    one = {"on_surface": True, "share": 0.2, "present": 0.6, "loads": 100.0, "stores": 60.0}
    fields = {
        "pool": 1 << 20,
        "materials": [{"material": name, **one} for name in known.names],
        "logic_seconds": 1e-4,
        "other_seconds": 1e-3,
    }
    return impasto.Workload.parse(json.dumps(fields), known)


class Flat:
    """Every kernel takes its start and its members."""

    def __init__(self, start: float) -> None:
        self.start, self.asked = start, 0

    def seconds(self, form: str, members: list[int]) -> float:
        self.asked += 1
        return (5.0 if form == "inline" else self.start) + len(members)


def test_strategies_of_the_table(known: impasto.Materials, hits: impasto.Workload) -> None:
    own = impasto.plan(known, "own")
    assert [form for _, form, _ in own.kernels] == ["own"] * len(known.names)
    auto = impasto.plan(known, workload=hits, profile="h200")
    found = auto.explain()
    assert found is not None and found["seconds"] > 0 and auto.strategy == "auto"
    assert "material_" in auto._repr_html_() and "kernel" in str(auto)
    with pytest.raises(impasto.PlanError, match="did you mean `auto`"):
        impasto.plan(known, "aut")
    with pytest.raises(TypeError, match="workload"):
        impasto.plan(known, "auto")


def test_a_model_of_python_decides(known: impasto.Materials) -> None:
    dear = impasto.plan(known, model=Flat(10.0))
    cheap = impasto.plan(known, model=Flat(0.0))
    assert len(dear.kernels) == 1 and dear.kernels[0][1] == "inline"
    assert all(form != "inline" for _, form, _ in cheap.kernels)
    model = Flat(1.0)
    impasto.plan(known, model=model, search=impasto.Exact())
    impasto.plan(known, model=model, search=impasto.Heuristic())
    assert model.asked > 10


def test_a_search_of_python_uses_our_model(known: impasto.Materials, hits: impasto.Workload) -> None:
    class Together:
        def search(self, problem: impasto.Problem, model: impasto.TimeModel) -> list[tuple[str, list[int]]]:
            assert problem.materials == list(range(4)) and model.seconds("mixed", problem.materials) > 0
            return [("mixed", problem.materials)]

    plan = impasto.plan(known, search=Together(), workload=hits, profile=impasto.profile("h200"))
    assert [(form, members) for _, form, members in plan.kernels] == [("mixed", known.names)]
    calibrated = impasto.Calibrated(known, hits, impasto.profile("h200"))
    parts = calibrated.predict("mixed", [0, 1])
    assert np.isclose(parts["total"], calibrated.seconds("mixed", [0, 1]))


def test_a_strategy_of_python_makes_a_plan_that_renders(root: Path) -> None:
    def pairs(request: impasto.Request) -> list[tuple[str, list[int]]]:
        placed = request.problem.materials
        return [("mixed" if len(placed[at : at + 2]) > 1 else "own", placed[at : at + 2]) for at in range(0, len(placed), 2)]

    scene = impasto.load(root / "examples/cornell/scene.toml")
    plan = impasto.plan(scene, pairs, samples=16)
    assert plan.strategy == "pairs" and all(len(members) <= 2 for _, _, members in plan.kernels)
    own = impasto.render(scene, size=(12, 12), samples=1, device="cpu")
    assert np.array_equal(impasto.render(scene, size=(12, 12), samples=1, plan=plan, device="cpu").pixels, own.pixels)


def test_nonsense_is_refused(known: impasto.Materials) -> None:
    def giving(answer: object) -> object:
        class Model:
            def seconds(self, form: str, members: list[int]) -> object:
                return answer

        return Model()

    for answer, error in [
        (float("nan"), ValueError),
        (float("inf"), ValueError),
        (-1.0, ValueError),
        ("fast", TypeError),
        (None, TypeError),
    ]:
        with pytest.raises(error, match="the time model gave"):
            impasto.plan(known, model=giving(answer))
    for groups, error, said in [
        ([("own", [0])], impasto.PlanError, "no kernel for"),
        ([("mixed", [0, 1, 2, 3]), ("own", [1])], impasto.PlanError, "each material has one place"),
        ([("own", [0, 1, 2, 3])], impasto.PlanError, "is own and has 4 materials"),
        ([("mixed", [0, 1, 2, 3, 4])], impasto.PlanError, "has material 4"),
        ([("inline", [0, 1]), ("inline", [2, 3])], impasto.PlanError, "several inline"),
        ([("owned", [0])], ValueError, "there is no form `owned`"),
        ([("mixed", [-1])], ValueError, "below 0"),
        (None, TypeError, "expected kernels"),
        ([("mixed", 3)], TypeError, "expected kernels"),
        ("mixed", TypeError, "expected kernels"),
    ]:
        with pytest.raises(error, match=said):
            impasto.plan(known, lambda request, groups=groups: groups)
    with pytest.raises(TypeError, match="a method `seconds"):
        impasto.plan(known, model=3)
    with pytest.raises(TypeError, match="give one of"):
        impasto.plan(known, "own", model=Flat(1))


def test_what_a_model_raises_comes_through_as_it_is(known: impasto.Materials) -> None:
    class Mine(Exception):
        pass

    class Raising:
        asked = 0

        def seconds(self, form: str, members: list[int]) -> float:
            self.asked += 1
            if self.asked == 3:
                raise Mine("the third")
            return 1.0

    model = Raising()
    with pytest.raises(Mine, match="the third"):
        impasto.plan(known, model=model)
    assert model.asked == 3
    with pytest.raises(Mine):
        impasto.plan(known, lambda request: (_ for _ in ()).throw(Mine()))


def test_ctrl_c_ends_a_model_that_never_returns(run) -> None:
    done = run(
        """
import os, signal, threading, impasto
from conftest import floor_scene
class Endless:
    def seconds(self, form, members):
        while True:
            pass
known = impasto.materials(floor_scene(), samples=4)
threading.Timer(1.0, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
try:
    impasto.plan(known, model=Endless())
except KeyboardInterrupt:
    print("ended")
""",
        timeout=60,
    )
    assert "ended" in done.stdout, done


def test_plans_are_kept_in_files(known: impasto.Materials, tmp_path: Path) -> None:
    plan = impasto.plan(known, partition=f"mixed:{known.names[0]},{known.names[1]}|own:*")
    assert plan.partition.startswith("mixed:")
    plan.save(tmp_path / "plan.json")
    assert json.loads((tmp_path / "plan.json").read_text())["strategy"] == "partition"
    with pytest.raises(impasto.PlanError, match="leaves out"):
        impasto.plan(known, partition=f"own:{known.names[0]}")


def test_workloads_and_profiles_are_read(known: impasto.Materials, hits: impasto.Workload, tmp_path: Path) -> None:
    assert hits.pool == 1 << 20 and len(hits.hits) == len(known.names) and known.names[0] in hits._repr_html_()
    with pytest.raises(impasto.PlanError):
        impasto.Workload.parse("{}", known)
    h200 = impasto.profile("h200")
    assert h200.exact and "H200" in h200.device and h200.weights["launch"] > 0 and "launch" in h200._repr_html_()
    with pytest.raises(ValueError, match="the program has h200, h100, llvmpipe"):
        impasto.profile("h90")
    (tmp_path / "broken.json").write_text("{}")
    with pytest.raises(impasto.PlanError):
        impasto.profile(tmp_path / "broken.json")


def test_a_study_takes_strategies_of_python(root: Path, tmp_path: Path) -> None:
    scene = impasto.load(root / "examples/cornell/scene.toml")
    scene.size = (24, 18)

    def together(request: impasto.Request) -> list[tuple[str, list[int]]]:
        return [("inline", request.problem.materials)]

    found = impasto.study(
        scene,
        tmp_path / "study",
        strategies=["own", together],
        samples=[1, 4],
        seeds=2,
        reference_samples=64,
        device="cpu",
    )
    assert [series["strategy"] for series in found.series] == ["own", "together"]
    curve = found.curve("together")
    assert [samples for samples, _, _ in curve] == [1, 4] and curve[0][2] > curve[1][2] > 0, curve
    assert Path(found.page).exists()
    with pytest.raises(KeyError):
        found.curve("auto")


def test_a_workload_is_measured_and_planned_for(gpu: str, root: Path, tmp_path: Path) -> None:
    scene = impasto.load(root / "examples/cornell/scene.toml")
    scene.size = (32, 24)
    told: list[str] = []
    found = impasto.workload(scene, pool=4096, progress=lambda share, what: told.append(what))
    assert found.pool == 4096 and 0 < sum(hit["share"] for hit in found.hits) <= 1 and told
    found.save(tmp_path / "workload.json")
    again = impasto.Workload.load(tmp_path / "workload.json", scene, samples=4)
    assert again.hits == found.hits
    plan = impasto.plan(scene, workload=found, profile=impasto.profile(), samples=16)
    picture = impasto.render(scene, samples=1, plan=plan, device=gpu)
    assert picture.report["strategy"] == "auto" and picture.pixels.max() > 0
