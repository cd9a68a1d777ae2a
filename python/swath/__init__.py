"""Swath: strip imaging by a super-agile satellite, for Gymnasium.

``import swath`` registers ``Swath/StripImaging-v0`` and is quick: Gymnasium and numpy are imported when something of
theirs is used.

>>> import gymnasium, swath
>>> env = gymnasium.make("Swath/StripImaging-v0", episode={"orbits": 1.0})
>>> observation, info = env.reset(seed=7)
>>> observation.shape
(40, 13)
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from swath import _registration
from swath._swath import Context, Image, Serve, Settings, Wait

if TYPE_CHECKING:
    from swath.environment import Failure, StripImagingEnv
    from swath.missions import Flight, Planner, Score, evaluate, fly
    from swath.strips import Strip, random_strips, read_strips, write_strips
    from swath.vector import StripImagingVectorEnv
    from swath.wrappers import DiscreteActions, FlatObservation, GridActions

__all__ = [
    "Context",
    "DiscreteActions",
    "Failure",
    "FlatObservation",
    "Flight",
    "GridActions",
    "Image",
    "Planner",
    "Score",
    "Serve",
    "Settings",
    "Strip",
    "StripImagingEnv",
    "StripImagingVectorEnv",
    "Wait",
    "evaluate",
    "fly",
    "random_strips",
    "read_strips",
    "write_strips",
]

_HOMES = {
    "DiscreteActions": "wrappers",
    "Failure": "environment",
    "FlatObservation": "wrappers",
    "Flight": "missions",
    "GridActions": "wrappers",
    "Planner": "missions",
    "Score": "missions",
    "Strip": "strips",
    "StripImagingEnv": "environment",
    "StripImagingVectorEnv": "vector",
    "evaluate": "missions",
    "fly": "missions",
    "random_strips": "strips",
    "read_strips": "strips",
    "write_strips": "strips",
}


def __getattr__(name: str) -> Any:
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module 'swath' has no attribute {name!r}")
    return getattr(importlib.import_module(f"swath.{home}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)


_registration.register_with_gymnasium()
