"""Settings from the keywords that environments, missions and evaluations take."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

from swath._swath import Settings
from swath.strips import Strip, read_strips

#: A file of strips, or the strips.
Strips = str | os.PathLike[str] | Sequence[Strip]

SEED_MAX = 2**64 - 1


def settings_of(
    config: str | os.PathLike[str] | Settings | None,
    observation: str | None,
    episode: Mapping[str, Any] | None,
    simulation: Mapping[str, Any] | None,
    plant: Mapping[str, Any] | str | None,
    strips: Strips | None,
) -> Settings:
    """Settings of a file, with the keywords over what it says."""
    keys = {"observation": observation, "episode": episode, "simulation": simulation, "plant": plant}
    given = {key: value for key, value in keys.items() if value is not None}
    if isinstance(config, Settings):
        if given or strips is not None:
            raise ValueError("settings that are made already take no further keywords")
        return config
    file = None if config is None else os.fspath(config)
    if isinstance(strips, (str, os.PathLike)):
        strips = read_strips(strips, Settings(given, file))
    return Settings(given, file, strips)


def checked_seed(seed: int) -> int:
    """The seed of an episode.

    Raises:
        ValueError: It is outside 0 to 2⁶⁴ - 1.
    """
    seed = int(seed)
    if not 0 <= seed <= SEED_MAX:
        raise ValueError(f"seed is {seed}, outside 0 to {SEED_MAX}")
    return seed
