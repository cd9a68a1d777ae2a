"""Missions flown by planners, of the simulation and of one's own; strips from and to GeoJSON."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import swath
from swath.missions import AnyPlanner

ROOT = Path(__file__).parents[2]


class Greedy:
    """The paper's heuristic in Python: the greatest priority per second after a fixed transition."""

    def __init__(self, t_pre_s: float) -> None:
        self.t_pre_s = t_pre_s

    def decide(self, context: swath.Context) -> swath.Image | swath.Wait:
        start = context.now_s + self.t_pre_s
        open_now = (context.window_open_s <= start) & (start <= context.window_close_s)
        if not open_now.any():
            ahead = context.window_open_s - self.t_pre_s - context.now_s
            ahead = ahead[ahead > 0]
            return swath.Wait(float(np.clip(ahead.min(), 0.5, 60.0)) if len(ahead) else 60.0)
        paid = np.where(open_now, context.priority / (self.t_pre_s + context.t_acq_s), -1.0)
        return swath.Image(int(paid.argmax()), self.t_pre_s)


def test_the_heuristic_in_python_flies_as_the_one_in_rust(short: dict[str, Any]) -> None:
    own = swath.fly(Greedy(80.0), seed=6, **short)
    named = swath.fly("heuristic:80", seed=6, **short)
    assert own == named
    assert named.score["attempts_per_orbit"] > 20
    rewards = sum(task["reward"] for task in named.tasks)
    assert named.score["reward_per_orbit"] == pytest.approx(rewards / 0.3)
    assert {task["failure"] for task in named.tasks} <= {None, "attitude", "elevation", "interrupted"}


def test_functions_plan_too_and_what_they_raise_is_passed_on(short: dict[str, Any]) -> None:
    waiting = swath.fly(lambda context: swath.Wait(30.0), **short)
    assert waiting.score["success_rate"] is None and waiting.score["wait_s_per_orbit"] > 5000

    def fails(context: swath.Context) -> swath.Image:
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        swath.fly(fails, **short)
    for decided, kind, text in [
        (swath.Image(40, 10.0), ValueError, "candidate 40 was chosen of 40"),
        (swath.Image(0, 121.0), ValueError, "t_pre_s is 121, outside 0 to 120"),
        (swath.Wait(float("nan")), ValueError, "duration_s is NaN, outside 0.5 to 86400"),
        (None, TypeError, "decided a NoneType, not swath.Image, swath.Wait or swath.Serve"),
    ]:
        with pytest.raises(kind, match=text):
            swath.fly(lambda context, decided=decided: decided, **short)  # type: ignore[misc]
    with pytest.raises(ValueError, match="`clever` is no planner"):
        swath.fly("clever", **short)
    with pytest.raises(ValueError, match="`hop-ppo` is a trained policy"):
        swath.fly("hop-ppo", **short)
    with pytest.raises(TypeError, match="a int is no planner"):
        swath.fly(3, **short)  # type: ignore[arg-type]


def test_contexts_tell_what_is_known(short: dict[str, Any]) -> None:
    seen: list[swath.Context] = []

    def planner(context: swath.Context) -> swath.Image:
        seen.append(context)
        features, mask = context.observe("dynamics")
        assert features.shape == (40, 22) and mask.sum() == len(context)
        return swath.Image(0, 100.0)

    flight = swath.fly(planner, seed=1, **short)
    assert seen[0].previous is None
    assert seen[1].previous == {key: value for key, value in flight.tasks[0].items() if key != "reward"}
    assert np.linalg.norm(seen[0].r_BN_N) == pytest.approx(6_898_136.6)
    assert np.linalg.norm(seen[0].sigma_BN) <= 1.0
    assert (seen[0].window_close_s >= seen[0].window_open_s).all()
    track = seen[0].ground_track([0.0, 60.0])
    assert abs(track[:, 0]).max() <= 45.1 and np.ptp(track[:, 0]) < 4.0


def test_planners_by_repair_fly_too(short: dict[str, Any]) -> None:
    for name in ["repair", "aspen"]:
        assert swath.fly(name, seed=2, **short).score["attempts_per_orbit"] > 10


def test_planners_of_ones_own_charge_and_see_how_power_stands() -> None:
    brief: dict[str, Any] = {"episode": {"orbits": 1.0, "scenario": {"count": [300, 300]}}}
    levels: list[float] = []

    def charges(context: swath.Context) -> swath.Serve:
        stands = context.resources
        assert stands is not None and stands["capacity_wh"] == 120.0 and stands["stored_bits"] == 0
        levels.append(stands["charge_wh"])
        return swath.Serve("charge", 60.0)

    poor = {"resources": {"profile": "bsk", "battery_initial": 0.2, "shield": False}}
    swath.fly(charges, simulation=poor, **brief)
    assert max(levels) > levels[0] == pytest.approx(24.0)
    assert swath.Serve("downlink", 2.0) == swath.Serve("downlink", 2.0) != swath.Serve("charge", 2.0)
    with pytest.raises(ValueError, match="unknown variant `sleep`"):
        swath.Serve("sleep", 1.0)
    with pytest.raises(ValueError, match="Charge was chosen, but the mission has no"):
        swath.fly(lambda context: swath.Serve("charge", 60.0), **brief)


def test_evaluations_compare_planners_seed_by_seed(short: dict[str, Any]) -> None:
    planners: list[AnyPlanner] = ["heuristic:80", Greedy(80.0), "random", "beam"]
    scores = swath.evaluate(planners, seeds=range(3, 6), threads=2, **short)
    assert [[score["seed"] for score in own] for own in scores] == [[3, 4, 5]] * 4
    assert scores[0] == scores[1]
    assert scores[0] == [swath.fly("heuristic:80", seed=seed, **short).score for seed in range(3, 6)]
    mean = [np.mean([score["reward_per_orbit"] for score in own]) for own in scores]
    assert mean[3] > mean[0] > mean[2]
    with pytest.raises(ValueError, match="seed is -1"):
        swath.evaluate(["random"], seeds=[-1], **short)


def test_without_words_the_missions_are_those_of_the_evaluation() -> None:
    (own,) = swath.evaluate(["heuristic:80"], seeds=[0], threads=1)
    assert 2000 <= own[0]["requests"] <= 5000
    assert 20 < own[0]["reward_per_orbit"] < 33


def test_strips_survive_geojson(tmp_path: Path) -> None:
    settings = swath.Settings({"episode": {"scenario": {"count": [50, 50]}}})
    strips = swath.random_strips(9, settings)
    assert len(strips) == 50
    swath.write_strips(tmp_path / "strips.geojson", strips)
    assert swath.read_strips(tmp_path / "strips.geojson") == strips
    with pytest.raises(ValueError, match="strip 1: priority 2 is outside 0 to 1"):
        swath.write_strips(tmp_path / "no.geojson", [strips[0], {**strips[1], "priority": 2.0}])
    with pytest.raises(ValueError, match="cannot read requests"):
        swath.read_strips(tmp_path / "nowhere.geojson")


def test_strips_of_every_format_are_read_and_all_faults_are_told(tmp_path: Path) -> None:
    (tmp_path / "strips.csv").write_text("name,wkt\nPo,\"LINESTRING (8.1 45.1, 9.5 45.1)\"\n")
    (one,) = swath.read_strips(tmp_path / "strips.csv")
    assert (one["start_longitude_deg"], one["end_longitude_deg"], one["priority"]) == (8.1, 9.5, 0.5)
    shapes = ['{"type": "Point", "coordinates": [1, 2]}', '{"type": "LineString", "coordinates": [[0, 0], [0.001, 0]]}']
    features = [f'{{"type": "Feature", "properties": {{}}, "geometry": {shape}}}' for shape in shapes]
    (tmp_path / "no.geojson").write_text('{"type": "FeatureCollection", "features": [' + ",".join(features) + "]}")
    with pytest.raises(ValueError, match="(?s)feature 1: a Point is no strip.*no-2: length 0.11"):
        swath.read_strips(tmp_path / "no.geojson")
    (tmp_path / "held.geojson").write_text(
        '{"type": "Feature", "properties": {"hold_for_approval": true},'
        ' "geometry": {"type": "LineString", "coordinates": [[0, 0], [1, 0]]}}'
    )
    with pytest.warns(UserWarning, match="1 strips have conditions"):
        assert len(swath.read_strips(tmp_path / "held.geojson")) == 1


def test_strips_of_ones_own_are_flown(tmp_path: Path) -> None:
    rivers = ROOT / "examples/requests/rivers.geojson"
    strips = swath.read_strips(rivers)
    one = swath.fly("beam", seed=2, strips=rivers, episode={"orbits": 3})
    assert one.score["requests"] == len(strips)
    assert one.score["imaged_per_orbit"] > 0
    assert swath.fly("beam", seed=2, strips=strips, episode={"orbits": 3}) == one
    env = swath.StripImagingEnv(strips=strips, episode={"orbits": 3})
    _, info = env.reset(seed=2)
    assert 0 < info["action_mask"].sum() <= len(strips)
    random = swath.random_strips(4, swath.Settings({"episode": {"scenario": {"count": [700, 700]}}}))
    same = {"orbits": 0.3, "scenario": {"count": [700, 700]}}
    assert swath.fly("lookahead", seed=4, strips=random, episode=same) == swath.fly("lookahead", seed=4, episode=same)
