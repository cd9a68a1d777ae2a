"""The environment: Gymnasium's checks, the very numbers of the Rust episode, settings and what is refused."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
import swath
from gymnasium.utils.env_checker import check_env
from gymnasium.utils.env_match import check_environments_match

ROOT = Path(__file__).parents[2]
EPISODES = json.loads((ROOT / "sim/tests/it/episodes.json").read_text())


def make(**settings: Any) -> swath.StripImagingEnv:
    env = gymnasium.make("Swath/StripImaging-v0", **settings).unwrapped
    assert isinstance(env, swath.StripImagingEnv)
    return env


@pytest.mark.parametrize("observation", ["table1", "table1-momentum", "dynamics", "resources"])
def test_gymnasium_finds_nothing_to_say(observation: str, short: dict[str, Any]) -> None:
    env = make(observation=observation, render_mode="rgb_array", **short)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env)


def test_two_environments_are_the_same(short: dict[str, Any]) -> None:
    check_environments_match(make(**short), make(**short), num_steps=60, seed=3)


class Digest:
    """FNV-1a over 32-bit words."""

    def __init__(self) -> None:
        self.state = 0xCBF29CE484222325

    def add(self, array: np.ndarray[Any, Any]) -> None:
        for word in np.ascontiguousarray(array).view(np.uint32).ravel().tolist():
            self.state = (self.state ^ word) * 0x100000001B3 % 2**64


@pytest.mark.parametrize("kept", EPISODES, ids=lambda kept: str(kept["seed"]))
def test_episodes_are_those_of_rust_bit_by_bit(kept: dict[str, Any]) -> None:
    scenario = {"count": [kept["strips"]] * 2}
    episode = {"orbits": kept["orbits"], "arrivals": kept["arrivals"], "scenario": scenario}
    simulation = {} if kept["resources"] is None else {"resources": kept["resources"]}
    env = make(observation=kept["observation"], episode=episode, simulation=simulation)
    digest = Digest()

    def see(observation: Any, info: dict[str, Any]) -> int:
        digest.add(observation)
        digest.add(info["action_mask"].astype(np.uint32))
        return int(info["action_mask"].sum())

    offered = see(*env.reset(seed=kept["seed"]))
    steps, total = 0, 0.0
    over = False
    while not over:
        action = (steps * 7 % offered, steps * 3 % 11 / 10)
        observation, reward, terminated, truncated, info = env.step(action)  # type: ignore[arg-type]
        offered = see(observation, info)
        digest.add(np.array([reward, info["duration_s"]]))
        steps, total, over = steps + 1, total + float(reward), terminated or truncated
    assert (steps, total, "terminated" if terminated else "truncated") == (kept["steps"], kept["reward"], kept["ended"])
    assert f"{digest.state:016x}" == kept["digest"]


def in_reach(env: swath.StripImagingEnv, parameter: float) -> np.int64:
    """The first strip whose window is open after a transition."""
    context = env.context
    start_s = context.now_s + parameter * context.t_pre_max_s
    open_then = (context.window_open_s <= start_s) & (start_s <= context.window_close_s)
    chosen: np.int64 = np.int64(open_then.argmax())
    return chosen


def test_steps_tell_what_came_of_them() -> None:
    env = make(episode={"orbits": 1.0, "scenario": {"count": [1500, 1500]}})
    _, info = env.reset(seed=5)
    failures = set()
    for _ in range(40):
        before = info["time_s"]
        chosen = in_reach(env, 0.6)
        identity = int(env.context.strip[chosen])
        _, reward, terminated, truncated, info = env.step((chosen, np.array([0.6])))
        assert info["strip"] == identity
        assert info["time_s"] - before == pytest.approx(info["duration_s"])
        assert info["success"] == (info["failure"] == swath.Failure.NONE) == (float(reward) > 0)
        failures.add(swath.Failure(info["failure"]))
        if terminated or truncated:
            break
    assert swath.Failure.NONE in failures and len(failures) > 1


def test_masks_keep_samples_to_what_is_offered() -> None:
    env = make(episode={"orbits": 1.0, "scenario": {"count": [30, 30]}})
    _, info = env.reset(seed=11)
    assert 0 < info["action_mask"].sum() < 40
    env.action_space.seed(2)
    over = False
    while not over:
        assert (info["action_mask"] == env.action_masks()).all()
        action = env.action_space.sample(mask=(info["action_mask"], None))
        _, _, terminated, truncated, info = env.step(action)
        over = terminated or truncated


def test_what_is_wrong_is_named_with_value_and_limit(short: dict[str, Any]) -> None:
    def refused(text: str, **settings: Any) -> None:
        with pytest.raises(ValueError, match=text):
            swath.StripImagingEnv(**settings)

    refused("orbit.altitude_km is 90, outside 150 to 2000", simulation={"orbit": {"altitude_km": 90}})
    refused("orbit.altitude_km is NaN", simulation={"orbit": {"altitude_km": float("nan")}})
    refused("unknown field `altitude`", simulation={"orbit": {"altitude": 520}})
    refused("unknown variant `table2`", observation="table2")
    refused("orbits is 0, outside 0.01 to 10000", episode={"orbits": 0})
    refused("scenario.count runs from 5 down to 3", episode={"scenario": {"count": [5, 3]}})
    refused("plant.planning_delay_s is 90, outside 0 to 60", plant={"planning_delay_s": 90})
    refused("`nois` is no error of the plant", plant="nois")
    refused("render_mode is 'human'", render_mode="human")
    refused("settings nowhere.toml: No such file", config="nowhere.toml")

    env = make(**short)
    with pytest.raises(RuntimeError, match="no episode has begun"):
        env.context
    with pytest.raises(ValueError, match="seed is -1, outside 0 to 18446744073709551615"):
        env.reset(seed=-1)
    env.reset(seed=0)
    for action, text in [
        ((40, [0.5]), "strip 40 was chosen, outside 0 to 39: 40 strips are offered"),
        ((-1, [0.5]), "strip -1 was chosen"),
        ((0, [1.5]), "the transition is 1.5, outside 0 to 1"),
        ((0, [float("nan")]), "the transition is NaN, outside 0 to 1"),
    ]:
        before = env.time_s
        with pytest.raises(ValueError, match=text):
            env.step(action)  # type: ignore[arg-type]
        assert env.time_s == before
    with pytest.raises(ValueError, match="episode of seed 4 asks for 0 strips"):
        make(episode={"scenario": {"count": [0, 0]}}).reset(seed=4)


def test_settings_come_from_files_and_keywords_win(tmp_path: Path) -> None:
    run = ROOT / "training/configs/compact/hop_ppo.toml"
    assert swath.StripImagingEnv(config=run).settings.to_dict()["observation"] == "table1"
    file = tmp_path / "mine.toml"
    file.write_text('observation = "dynamics"\n[episode]\norbits = 2.0\narrivals = 0.25\n')
    settings = swath.StripImagingEnv(config=file, episode={"orbits": 3}).settings.to_dict()
    assert settings["observation"] == "dynamics"
    assert settings["episode"] == {**settings["episode"], "orbits": 3.0, "arrivals": 0.25}
    again = swath.Settings(settings)
    assert again.to_dict() == settings
    assert swath.StripImagingEnv(config=again).observation_space.shape == (40, 22)
    toy = tmp_path / "toy.toml"
    toy.write_text('[environment]\nkind = "toy"\n')
    with pytest.raises(ValueError, match='not "strips"'):
        swath.Settings(file=toy)


def test_plants_that_differ_fly_differently(short: dict[str, Any]) -> None:
    def rewards(**more: Any) -> list[float]:
        env = make(**short, **more)
        env.reset(seed=3)
        return [float(env.step((np.int64(k % 40), np.array([0.6])))[1]) for k in range(25)]

    assert rewards() == rewards(plant={"torque_limit_scale": 1.0}) != rewards(plant="torque-10%,noise,delay")


def test_observations_stay_inside_their_space() -> None:
    episode = {"orbits": 1.0, "scenario": {"count": [800, 800]}}
    for plant, simulation in [
        ("none", {}),
        ("torque+10%,inertia-10%,noise", {}),
        ("noise", {"resources": {"reward": "delivered"}}),
        ("none", {"resources": {"profile": "bsk"}}),
    ]:
        env = make(episode=episode, observation="resources", plant=plant, simulation=simulation)
        env.action_space.seed(8)
        observation, info = env.reset(seed=8)
        over = False
        while not over:
            assert env.observation_space.contains(observation)
            action = env.action_space.sample(mask=(info["action_mask"], None))
            observation, _, terminated, truncated, info = env.step(action)
            over = terminated or truncated
        assert env.observation_space.contains(observation)


def test_the_picture_shows_strips_and_track(short: dict[str, Any]) -> None:
    env = make(render_mode="rgb_array", **short)
    env.reset(seed=2)
    first = env.render()
    assert first is not None and first.shape == (360, 720, 3) and first.dtype == np.uint8
    for _ in range(10):
        env.step((in_reach(env, 1.0), np.array([1.0])))
    then = env.render()
    assert then is not None

    def count(picture: Any, colour: tuple[int, int, int]) -> int:
        return int((picture == colour).all(axis=-1).sum())

    imaged, past = (70, 200, 120), (110, 130, 170)
    assert count(first, imaged) == 0 and count(then, imaged) > 20
    assert count(then, past) > count(first, past)
    assert make(**short).render() is None
