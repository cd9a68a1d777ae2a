"""The environment ``Swath/StripImaging-v0``: one step is one task, a slew to a strip and its imaging, flown in full."""

from __future__ import annotations

import os
from collections.abc import Mapping
from enum import IntEnum
from typing import Any, SupportsFloat

import gymnasium
import numpy as np
from numpy.typing import NDArray

from swath import _render
from swath._settings import Strips, checked_seed, settings_of
from swath._swath import Context, Episodes, Settings

#: What an agent sees: a row of features for each of N slots; slots without a strip are zero.
Observation = NDArray[np.float32]
#: Which strip, and the transition before it over the longest one.
Action = tuple[np.int64, NDArray[np.floating[Any]]]


class Failure(IntEnum):
    """Why an attempt brought no image."""

    #: It brought one.
    NONE = 0
    #: The attitude error exceeded its limit while imaging.
    ATTITUDE = 1
    #: The satellite was too low over the target's horizon while imaging.
    ELEVATION = 2


class Order(IntEnum):
    """What one of the episodes is to do in a step."""

    LOOK = 0
    STEP = 1
    RESET = 2


def spaces_of(settings: Settings) -> tuple[gymnasium.Space[Observation], gymnasium.Space[Action]]:
    """Observation space and action space of one environment."""
    low, high = (np.tile(bound, (settings.candidates, 1)) for bound in settings.bounds())
    parameter = gymnasium.spaces.Box(0.0, 1.0, (1,), np.float32)
    actions: gymnasium.Space[Any] = gymnasium.spaces.Tuple((gymnasium.spaces.Discrete(settings.candidates), parameter))
    observations: gymnasium.Space[Any] = gymnasium.spaces.Box(low, high, dtype=np.float32)
    return observations, actions


class StripImagingEnv(gymnasium.Env[Observation, Action]):
    """Strip imaging, one task a step.

    **Action** ``(strip, transition)``: which of the N strips that are offered, and how long the slew before it takes,
    as a share of ``planning.t_pre_max_s``. ``info["action_mask"]`` says which strips there are:
    ``env.action_space.sample(mask=(info["action_mask"], None))``. A strip that is not offered raises ``ValueError``.

    **Observation** N rows of features, float32: Table 1 of the paper, or more by ``observation=``.

    **Reward** the strip's priority when it was imaged, else 0, paid at the end of the step. Steps have different lengths:
    ``info["duration_s"]`` is what a discount per second needs.

    **End** ``truncated`` when the episode's length is reached (bootstrap), ``terminated`` when no strip is left,
    or when the satellite failed.

    **Seeds** ``reset(seed=s)`` begins the very episode that ``swath-train`` flies for ``s``; ``reset()`` draws the next
    seed from ``np_random``.

    Args:
        config: A TOML file with the keys below, or a run file of ``swath-train``.
        observation: ``table1``, ``table1-momentum``, ``dynamics`` or ``resources``.
        episode: ``orbits``, ``scenario`` (``count``, ``length_km``, ``speed_m_s``, ``priority``), ``arrivals``.
        simulation: ``orbit``, ``earth``, ``spacecraft``, ``control``, ``imaging``, ``planning``, ``requests``,
            ``resources``.
        plant: How the satellite differs from its model: a table, or a name such as ``torque-10%,noise``.
        strips: Strips of one's own instead of random ones: a list, or a file that :func:`swath.read_strips` reads.
        render_mode: ``rgb_array`` draws a map with the strips and the ground track.

    Raises:
        ValueError: A setting, a seed or an action that is out of range, with its value and limit.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 4}

    def __init__(
        self,
        *,
        config: str | os.PathLike[str] | Settings | None = None,
        observation: str | None = None,
        episode: Mapping[str, Any] | None = None,
        simulation: Mapping[str, Any] | None = None,
        plant: Mapping[str, Any] | str | None = None,
        strips: Strips | None = None,
        render_mode: str | None = None,
    ) -> None:
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            raise ValueError(f"render_mode is {render_mode!r}, expected None or one of {self.metadata['render_modes']}")
        self.settings = settings_of(config, observation, episode, simulation, plant, strips)
        self.render_mode = render_mode
        self.observation_space, self.action_space = spaces_of(self.settings)
        #: Seed of the present episode.
        self.episode_seed: int | None = None
        self._episodes = Episodes(self.settings)
        self._seed = np.zeros(1, np.uint64)
        self._token = np.zeros(1, np.int64)
        self._parameter = np.zeros(1, np.float64)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begins the episode of a seed, or of the next one that ``np_random`` draws.

        Raises:
            ValueError: A seed outside 0 to 2⁶⁴ - 1; an episode none of whose strips can be reached.
        """
        if seed is not None:
            seed = checked_seed(seed)
        super().reset(seed=seed)
        self.episode_seed = int(self.np_random.integers(2**63)) if seed is None else seed
        self._seed[0] = self.episode_seed
        features, mask, *_ = self._advance(Order.RESET)
        return features[0], {"action_mask": mask[0], "time_s": self.time_s}

    def step(self, action: Action) -> tuple[Observation, SupportsFloat, bool, bool, dict[str, Any]]:
        """Flies one task in full, and on to where there is a strip to choose.

        Raises:
            ValueError: A strip that is not offered; a transition outside 0 to 1. Nothing is flown then.
            RuntimeError: Before the first :meth:`reset`.
        """
        token, parameter = action
        self._token[0] = token
        self._parameter[0] = np.asarray(parameter).item()
        features, mask, reward, terminated, truncated, duration, success, failure, strip = self._advance(Order.STEP)
        info = {
            "action_mask": mask[0],
            "time_s": self.time_s,
            "duration_s": float(duration[0]),
            "success": bool(success[0]),
            "failure": int(failure[0]),
            "strip": int(strip[0]),
        }
        return features[0], float(reward[0]), bool(terminated[0]), bool(truncated[0]), info

    @property
    def time_s(self) -> float:
        """Simulated time since the epoch [s]."""
        return float(self._episodes.times_s()[0])

    @property
    def context(self) -> Context:
        """What the next decision rests on: what planners of one's own get."""
        return self._episodes.context()

    def action_masks(self) -> NDArray[np.bool_]:
        """Which strips there are to choose from."""
        mask = np.zeros(self.settings.candidates, np.bool_)
        mask[: len(self.context)] = True
        return mask

    def render(self) -> NDArray[np.uint8] | None:
        """A map with the strips and the ground track, rows × columns × RGB."""
        if self.render_mode is None:
            return None
        return _render.picture(self.context, self._episodes.strips(), self.settings.orbit_s)

    def _advance(self, order: Order) -> Any:
        return self._episodes.advance(np.full(1, order, np.uint8), self._token, self._parameter, self._seed)
