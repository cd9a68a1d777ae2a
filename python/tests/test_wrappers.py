"""Wrappers for learners that know no hybrid actions."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
import swath
from gymnasium.utils.env_checker import check_env


def base(**settings: Any) -> gymnasium.Env[Any, Any]:
    return gymnasium.make("Swath/StripImaging-v0", disable_env_checker=True, **settings)


def test_numbers_stand_for_strip_and_transition(short: dict[str, Any]) -> None:
    wrapped = swath.DiscreteActions(base(**short), transitions=6)
    assert wrapped.action_space == gymnasium.spaces.Discrete(240)
    assert wrapped.action(np.int64(0))[1].tolist() == [float(np.float32(1 / 6))]
    strip, transition = wrapped.action(np.int64(6 * 12 + 5))
    assert int(strip) == 12 and transition.tolist() == [1.0]
    _, info = wrapped.reset(seed=1)
    assert info["action_mask"].shape == (240,)
    env = base(**short)
    env.reset(seed=1)
    mine, other = wrapped.step(np.int64(77)), env.step((np.int64(12), np.array([1.0])))
    assert (mine[0] == other[0]).all() and mine[1:4] == other[1:4]


def test_masks_name_the_actions_that_there_are() -> None:
    few = {"episode": {"orbits": 1.0, "scenario": {"count": [40, 40]}}}
    discrete, grid = swath.DiscreteActions(base(**few)), swath.GridActions(base(**few), transitions=5)
    _, info = discrete.reset(seed=3)
    _, plain = grid.reset(seed=3)
    offered = int(plain["action_mask"].sum())
    assert 0 < offered < 40
    assert discrete.action_masks().sum() == info["action_mask"].sum() == offered * 12
    masks = grid.action_masks()
    assert masks.shape == (45,) and masks[:40].sum() == offered and masks[40:].all()
    assert grid.action_space == gymnasium.spaces.MultiDiscrete([40, 5])
    grid.step(np.array([offered - 1, 4]))
    with pytest.raises(ValueError, match="was chosen, outside 0 to"):
        grid.step(np.array([39, 4]))


@pytest.mark.parametrize("wrapper", [swath.DiscreteActions, swath.GridActions])
@pytest.mark.filterwarnings("ignore:.*is different from the unwrapped version")
def test_gymnasium_finds_nothing_to_say(wrapper: Any, short: dict[str, Any]) -> None:
    check_env(swath.FlatObservation(wrapper(base(**short))), skip_render_check=True)


def test_flat_observations_are_the_rows_one_after_the_other(short: dict[str, Any]) -> None:
    flat, rows = swath.FlatObservation(base(**short)), base(**short)
    mine, other = flat.reset(seed=2)[0], rows.reset(seed=2)[0]
    assert flat.observation_space.shape == (520,) and (mine == other.ravel()).all()


def test_only_strip_imaging_is_wrapped() -> None:
    with pytest.raises(TypeError, match="expected a StripImagingEnv, got a CartPoleEnv"):
        swath.DiscreteActions(gymnasium.make("CartPole-v1"))
    for count in [0, 10_001]:
        with pytest.raises(ValueError, match=f"transitions is {count}, outside 1 to 10000"):
            swath.GridActions(base(), transitions=count)
