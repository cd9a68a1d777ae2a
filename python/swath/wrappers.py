"""Wrappers for learners that know no hybrid actions, or no observations with rows."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from swath.environment import Action, Observation, StripImagingEnv


def _imaging(env: gymnasium.Env[Any, Any]) -> StripImagingEnv:
    base = env.unwrapped
    if not isinstance(base, StripImagingEnv):
        raise TypeError(f"expected a StripImagingEnv, got a {type(base).__name__}")
    return base


def _transitions(count: int) -> NDArray[np.float32]:
    """``count`` transitions over the longest one: 1/count, 2/count, … 1."""
    if not 1 <= count <= 10_000:
        raise ValueError(f"transitions is {count}, outside 1 to 10000")
    return (np.arange(1, count + 1) / count).astype(np.float32)


class DiscreteActions(gymnasium.ActionWrapper[Observation, np.int64, Action], RecordConstructorArgs):
    """One number for strip and transition: ``strip * transitions + k`` stands for ``(k + 1) / transitions``.

    ``action_masks()`` is what ``MaskablePPO`` of sb3-contrib asks for, and is ``info["action_mask"]`` too.
    """

    def __init__(self, env: gymnasium.Env[Observation, Action], transitions: int = 12) -> None:
        RecordConstructorArgs.__init__(self, transitions=transitions)
        gymnasium.ActionWrapper.__init__(self, env)
        self._parameters = _transitions(transitions)
        self._base = _imaging(env)
        count = self._base.settings.candidates * transitions
        self.action_space = gymnasium.spaces.Discrete(count)

    def action(self, action: np.int64) -> Action:
        """The hybrid action of a number."""
        strip, transition = divmod(int(action), len(self._parameters))
        return np.int64(strip), self._parameters[transition : transition + 1]

    def action_masks(self) -> NDArray[np.bool_]:
        """Which numbers there are."""
        return np.repeat(self._base.action_masks(), len(self._parameters))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """As the environment's, with the mask of the numbers."""
        observation, info = self.env.reset(seed=seed, options=options)
        return observation, {**info, "action_mask": self.action_masks().astype(np.int8)}

    def step(self, action: np.int64) -> tuple[Observation, Any, bool, bool, dict[str, Any]]:
        """As the environment's, with the mask of the numbers."""
        observation, reward, terminated, truncated, info = super().step(action)
        info = {**info, "action_mask": self.action_masks().astype(np.int8)}
        return observation, reward, terminated, truncated, info


class GridActions(gymnasium.ActionWrapper[Observation, NDArray[np.int64], Action], RecordConstructorArgs):
    """Strip and one of ``transitions`` transitions as ``MultiDiscrete([N, transitions])``.

    ``action_masks()`` is what ``MaskablePPO`` of sb3-contrib asks for: N + transitions booleans.
    """

    def __init__(self, env: gymnasium.Env[Observation, Action], transitions: int = 12) -> None:
        RecordConstructorArgs.__init__(self, transitions=transitions)
        gymnasium.ActionWrapper.__init__(self, env)
        self._parameters = _transitions(transitions)
        self._base = _imaging(env)
        self.action_space = gymnasium.spaces.MultiDiscrete([self._base.settings.candidates, transitions])

    def action(self, action: NDArray[np.int64]) -> Action:
        """The hybrid action of a pair of numbers."""
        strip, transition = (int(number) for number in action)
        return np.int64(strip), self._parameters[transition : transition + 1]

    def action_masks(self) -> NDArray[np.bool_]:
        """Which strips and which transitions there are, one after the other."""
        return np.concatenate([self._base.action_masks(), np.ones(len(self._parameters), np.bool_)])


class FlatObservation(gymnasium.ObservationWrapper[NDArray[np.float32], Any, Observation], RecordConstructorArgs):
    """The rows of the observation one after the other, as one vector of N × features numbers."""

    def __init__(self, env: gymnasium.Env[Observation, Any]) -> None:
        RecordConstructorArgs.__init__(self)
        gymnasium.ObservationWrapper.__init__(self, env)
        space = env.observation_space
        if not isinstance(space, gymnasium.spaces.Box):
            raise TypeError(f"expected a Box as observation space, got a {type(space).__name__}")
        self.observation_space = gymnasium.spaces.Box(space.low.ravel(), space.high.ravel(), dtype=np.float32)

    def observation(self, observation: Observation) -> NDArray[np.float32]:
        """The vector of an observation."""
        return observation.reshape(-1)
