"""Many environments at once: episodes flown side by side on threads of native code."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from swath import _render
from swath._settings import Strips, checked_seed, settings_of
from swath._swath import Context, Episodes, Settings
from swath.environment import Order, spaces_of

#: What agents see: environments × N × features.
Observations = NDArray[np.float32]
#: Strips chosen, and transitions over the longest one, one row for each environment.
Actions = tuple[NDArray[np.int64], NDArray[np.floating[Any]]]
Flags = NDArray[np.bool_]


class StripImagingVectorEnv(gymnasium.vector.VectorEnv[Observations, Actions, Any]):
    """``num_envs`` environments, stepped on ``threads`` threads while Python's lock is released.

    It does what ``SyncVectorEnv`` of as many :class:`swath.StripImagingEnv` does, number for number: environment i of
    ``reset(seed=s)`` begins the episode of s + i. Arrays are written by the native code and belong to the caller; no
    later step changes them.

    Args:
        num_envs: How many.
        threads: Threads that fly; by default one for each processor.
        autoreset_mode: When an environment that is over begins its next episode: in the step after (``NextStep``), in
            the same step, with ``infos["final_obs"]`` and ``infos["final_info"]`` (``SameStep``), or by
            ``reset(options={"reset_mask": …})`` (``Disabled``).

    The other arguments, and what raises ``ValueError``, are those of :class:`swath.StripImagingEnv`.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 4, "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        num_envs: int = 1,
        *,
        threads: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
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
        self._episodes = Episodes(self.settings, num_envs, len(os.sched_getaffinity(0)) if threads is None else threads)
        self.num_envs = num_envs
        self.render_mode = render_mode
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self.single_observation_space, self.single_action_space = spaces_of(self.settings)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._generators: list[np.random.Generator | None] = [None] * num_envs
        self._over: Flags = np.zeros(num_envs, np.bool_)
        self._seeds = np.zeros(num_envs, np.uint64)
        self._no_tokens = np.zeros(num_envs, np.int64)
        self._no_parameters = np.zeros(num_envs, np.float64)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Begins an episode in every environment, or in those that ``options["reset_mask"]`` names.

        Raises:
            ValueError: Seeds of the wrong number or outside 0 to 2⁶⁴ - 1; an episode without a strip to reach.
        """
        which = self._reset_mask(options)
        seeds: Sequence[int | None]
        if seed is None:
            seeds = [None] * self.num_envs
        elif isinstance(seed, (int, np.integer)):
            seeds = [int(seed) + number for number in range(self.num_envs)]
        else:
            seeds = seed
        if len(seeds) != self.num_envs:
            raise ValueError(f"{len(seeds)} seeds were given for {self.num_envs} environments")
        checked = [None if each is None else checked_seed(each) for each in seeds]
        for number in np.flatnonzero(which):
            own = checked[number]
            if own is None:
                self._draw_seed(int(number))
            else:
                self._generators[number] = seeding.np_random(own)[0]
                self._seeds[number] = own
        orders = np.where(which, np.uint8(Order.RESET), np.uint8(Order.LOOK))
        features, mask, *_ = self._advance(orders)
        self._over[which] = False
        infos: dict[str, Any] = {}
        self._add(infos, which, action_mask=mask, time_s=self._episodes.times_s())
        return features, infos

    def step(self, actions: Actions) -> tuple[Observations, Any, Any, Any, dict[str, Any]]:
        """Flies one task in every environment; one that is over begins its next episode instead (``NextStep``).

        Raises:
            ValueError: A strip that is not offered, a transition outside 0 to 1: nothing is flown then.
            RuntimeError: Before the first :meth:`reset`; an environment that is over, when none begins by itself.
        """
        tokens = np.ascontiguousarray(actions[0], np.int64).reshape(-1)
        parameters = np.ascontiguousarray(actions[1], np.float64).reshape(-1)
        begins = self._over
        if begins.any():
            if self.autoreset_mode is not AutoresetMode.NEXT_STEP:
                raise RuntimeError(f"environments {np.flatnonzero(begins).tolist()} are over: reset them")
            for number in np.flatnonzero(begins):
                self._draw_seed(int(number))
        orders = np.where(begins, np.uint8(Order.RESET), np.uint8(Order.STEP))
        features, mask, reward, terminated, truncated, *rest = self._advance(orders, tokens, parameters)
        over = terminated | truncated
        times_s = self._episodes.times_s()
        infos: dict[str, Any] = {}
        names = ("duration_s", "success", "failure", "strip")
        details = dict(zip(names, rest, strict=True))
        if self.autoreset_mode is AutoresetMode.SAME_STEP and over.any():
            features, mask, times_s = self._begin_next(over, features, mask, times_s, details, infos)
            self._add(infos, ~over, **details)
            over = np.zeros(self.num_envs, np.bool_)
        else:
            self._add(infos, ~begins, **details)
        self._over = over
        self._add(infos, np.ones(self.num_envs, np.bool_), action_mask=mask, time_s=times_s)
        return features, reward, terminated, truncated, infos

    def context(self, number: int) -> Context:
        """What the next decision of one of the environments rests on."""
        return self._episodes.context(number)

    def render(self) -> tuple[Any, ...] | None:
        """A map of each environment, rows × columns × RGB."""
        if self.render_mode is None:
            return None
        each = range(self.num_envs)
        return tuple(
            _render.picture(self.context(number), self._episodes.strips(number), self.settings.orbit_s)
            for number in each
        )

    def _begin_next(
        self,
        over: Flags,
        features: Observations,
        mask: NDArray[np.int8],
        times_s: NDArray[np.float64],
        details: dict[str, Any],
        infos: dict[str, Any],
    ) -> tuple[Observations, NDArray[np.int8], NDArray[np.float64]]:
        """Tells how the environments that are over ended, and begins their next episodes."""
        final: dict[str, Any] = {}
        self._add(final, over, action_mask=mask, time_s=times_s, **details)
        final_obs = np.full(self.num_envs, None, object)
        for number in np.flatnonzero(over):
            final_obs[number] = features[number].copy()
            self._draw_seed(int(number))
        infos.update(final_obs=final_obs, _final_obs=over.copy(), final_info=final, _final_info=over.copy())
        features, mask, *_ = self._advance(np.where(over, np.uint8(Order.RESET), np.uint8(Order.LOOK)))
        return features, mask, self._episodes.times_s()

    def _advance(
        self,
        orders: NDArray[np.uint8],
        tokens: NDArray[np.int64] | None = None,
        parameters: NDArray[np.float64] | None = None,
    ) -> Any:
        tokens = self._no_tokens if tokens is None else tokens
        parameters = self._no_parameters if parameters is None else parameters
        return self._episodes.advance(orders, tokens, parameters, self._seeds)

    def _draw_seed(self, number: int) -> None:
        """The seed of an environment's next episode, from the environment's own generator."""
        generator = self._generators[number]
        if generator is None:
            generator = self._generators[number] = seeding.np_random()[0]
        self._seeds[number] = generator.integers(2**63)

    def _reset_mask(self, options: dict[str, Any] | None) -> Flags:
        if options is None or "reset_mask" not in options:
            return np.ones(self.num_envs, np.bool_)
        which = np.asarray(options["reset_mask"])
        if which.shape != (self.num_envs,) or which.dtype != np.bool_ or not which.any():
            raise ValueError(
                f"reset_mask must be {self.num_envs} booleans of which one is true, got {which.dtype}{list(which.shape)}"
            )
        return which

    @staticmethod
    def _add(infos: dict[str, Any], which: Flags, **columns: Any) -> None:
        """Adds columns to ``infos``, zero and marked as missing where ``which`` is not."""
        if not which.any():
            return
        for name, column in columns.items():
            if not which.all():
                column = np.where(which.reshape((-1,) + (1,) * (column.ndim - 1)), column, np.zeros((), column.dtype))
            infos[name] = column
            infos[f"_{name}"] = which.copy()
