"""The vector environment against Gymnasium's own vector of single environments, number for number."""

from __future__ import annotations

import gc
import resource
from itertools import combinations
from typing import Any

import gymnasium
import numpy as np
import pytest
import swath
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.utils.passive_env_checker import data_shares_objects
from gymnasium.vector import AutoresetMode, SyncVectorEnv

MODES = [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP, AutoresetMode.DISABLED]
#: Episodes that end within a few dozen steps, with slots that empty.
BRIEF: dict[str, Any] = {"episode": {"orbits": 0.15, "scenario": {"count": [300, 600]}}}

MODEST: dict[str, Any] = {"episode": {"orbits": 1.0, "scenario": {"count": [300, 300]}}}


def choose(rng: np.random.Generator, mask: Any) -> tuple[Any, Any]:
    tokens = np.array([rng.choice(np.flatnonzero(row)) if row.any() else 0 for row in mask], np.int64)
    return tokens, rng.random((len(mask), 1)).astype(np.float32)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("threads", [1, 3])
def test_it_does_what_single_environments_do(mode: AutoresetMode, threads: int) -> None:
    count = 5
    ours = swath.StripImagingVectorEnv(count, threads=threads, autoreset_mode=mode, **BRIEF)
    theirs = SyncVectorEnv([lambda: swath.StripImagingEnv(**BRIEF)] * count, autoreset_mode=mode)
    assert ours.observation_space == theirs.observation_space and ours.action_space == theirs.action_space
    assert ours.metadata["autoreset_mode"] is mode
    rng = np.random.default_rng(4)
    mine, other = ours.reset(seed=20), theirs.reset(seed=20)
    assert data_equivalence(mine, other, exact=True)
    mask, over, ended = mine[1]["action_mask"], np.zeros(count, bool), 0
    for _ in range(120):
        if mode is AutoresetMode.DISABLED and over.any():
            mine = ours.reset(options={"reset_mask": over})
            other = theirs.reset(options={"reset_mask": over.copy()})
            for name in mine[1]:
                assert (mine[1][name] == other[1][name]).all(), name
            assert (mine[0] == other[0]).all()
            mask = np.where(over[:, None], mine[1]["action_mask"], mask)
        actions = choose(rng, mask)
        stepped, expected = ours.step(actions), theirs.step(actions)
        for one, two in zip(stepped[:4], expected[:4], strict=True):
            assert one.dtype == two.dtype and (one == two).all()
        same_infos(stepped[4], expected[4])
        over = stepped[2] | stepped[3]
        ended += int(over.sum())
        mask = stepped[4]["action_mask"]
    assert ended >= 8
    theirs.close()
    ours.close()


def same_infos(mine: dict[str, Any], other: dict[str, Any]) -> None:
    assert mine.keys() == other.keys()
    for name, value in mine.items():
        if isinstance(value, dict):
            same_infos(value, other[name])
        elif value.dtype == object:
            for one, two in zip(value, other[name], strict=True):
                assert (one is None) == (two is None) and (one is None or (one == two).all()), name
        else:
            assert (value == other[name]).all(), name


def test_gymnasium_makes_it_and_nothing_is_used_again(short: dict[str, Any]) -> None:
    envs = gymnasium.make_vec("Swath/StripImaging-v0", num_envs=3, vectorization_mode="vector_entry_point", **short)
    assert isinstance(envs.unwrapped, swath.StripImagingVectorEnv)
    rng = np.random.default_rng(2)
    seen = [envs.reset(seed=3)]
    for _ in range(3):
        observations, *_, infos = envs.step(choose(rng, seen[-1][1]["action_mask"]))
        seen.append((observations, infos))
    seen.append(envs.reset(seed=3))
    for one, two in combinations(seen, 2):
        assert not data_shares_objects(one[0], two[0]) and not data_shares_objects(one[1], two[1])
    assert data_equivalence(seen[0], seen[-1], exact=True)


def test_seeds_may_be_listed_and_are_counted(short: dict[str, Any]) -> None:
    envs = swath.StripImagingVectorEnv(3, **short)
    listed, _ = envs.reset(seed=[4, 5, 6])
    counted, _ = envs.reset(seed=4)
    assert (listed == counted).all()
    with pytest.raises(ValueError, match="2 seeds were given for 3 environments"):
        envs.reset(seed=[1, 2])
    with pytest.raises(ValueError, match="seed is 18446744073709551616, outside"):
        envs.reset(seed=2**64 - 2)


def test_one_wrong_action_flies_nothing_anywhere(short: dict[str, Any]) -> None:
    envs = swath.StripImagingVectorEnv(3, **short)
    with pytest.raises(ValueError, match="environment 0: no episode has begun"):
        envs.step((np.zeros(3, np.int64), np.zeros(3)))
    envs.reset(seed=1)
    before = [envs.context(number).now_s for number in range(3)]
    with pytest.raises(ValueError, match="environment 2: strip 77 was chosen, outside 0 to 39"):
        envs.step((np.array([0, 1, 77]), np.zeros((3, 1))))
    with pytest.raises(ValueError, match="2 strips were given for 3 environments"):
        envs.step((np.zeros(2, np.int64), np.zeros(3)))
    assert before == [envs.context(number).now_s for number in range(3)]
    for count, threads, text in [(0, 1, "num_envs is 0, outside 1 to 65536"), (2, 0, "threads is 0, outside 1 to 1024")]:
        with pytest.raises(ValueError, match=text):
            swath.StripImagingVectorEnv(count, threads=threads)


def test_environments_that_are_over_wait_for_their_reset() -> None:
    envs = swath.StripImagingVectorEnv(2, autoreset_mode="Disabled", **BRIEF)
    _, infos = envs.reset(seed=3)
    rng = np.random.default_rng(0)
    over = np.zeros(2, bool)
    while not over.any():
        _, _, terminated, truncated, infos = envs.step(choose(rng, infos["action_mask"]))
        over = terminated | truncated
    with pytest.raises(RuntimeError, match="are over: reset them"):
        envs.step(choose(rng, infos["action_mask"]))
    with pytest.raises(ValueError, match="reset_mask must be 2 booleans"):
        envs.reset(options={"reset_mask": np.array([1, 0])})


def test_memory_stays_what_it_is() -> None:
    envs = swath.StripImagingVectorEnv(8, threads=2, **MODEST)
    _, infos = envs.reset(seed=0)
    rng = np.random.default_rng(1)

    def steps(count: int) -> int:
        nonlocal infos
        for _ in range(count):
            infos = envs.step(choose(rng, infos["action_mask"]))[4]
        gc.collect()
        return resident_kb()

    steps(200)
    before = steps(200)
    # A hundred episodes and 8000 observations of 2 kB would show.
    assert steps(1000) - before < 4_000


def resident_kb() -> int:
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * resource.getpagesize() // 1024
