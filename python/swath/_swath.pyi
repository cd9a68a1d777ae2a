"""The native part of the package."""

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from swath.missions import Resources, Score, Task
from swath.strips import Strip

__all__ = [
    "Context",
    "Episodes",
    "Image",
    "Serve",
    "Settings",
    "Wait",
    "evaluate",
    "feature_collection",
    "fly",
    "random_strips",
    "read_strips",
]

@final
class Settings:
    """Settings that were checked: of a TOML file, changed by ``keys``, with ``strips`` instead of random ones.

    Raises:
        ValueError: A setting that is unknown or out of range, with its value and limits.
    """

    def __new__(
        cls,
        keys: Mapping[str, Any] | None = None,
        file: str | os.PathLike[str] | None = None,
        strips: Iterable[Strip] | None = None,
    ) -> Settings: ...
    def to_dict(self) -> dict[str, Any]:
        """All settings, those that were left out with their defaults."""

    @property
    def candidates(self) -> int:
        """Number N of strips offered at a decision."""

    @property
    def features(self) -> int:
        """Features of a strip."""

    @property
    def t_pre_max_s(self) -> float:
        """Longest transition [s]."""

    @property
    def orbit_s(self) -> float:
        """One orbit [s]."""

    @property
    def tick_s(self) -> float:
        """Length of a control tick [s]."""

    def bounds(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Least and greatest value of each feature of a strip."""

@final
class Episodes:
    """Episodes flown side by side on threads."""

    def __new__(cls, settings: Settings, count: int = 1, threads: int = 1) -> Episodes: ...
    def advance(
        self,
        orders: NDArray[np.uint8],
        tokens: NDArray[np.int64],
        parameters: NDArray[np.float64],
        seeds: NDArray[np.uint64],
    ) -> tuple[
        NDArray[np.float32],
        NDArray[np.int8],
        NDArray[np.float64],
        NDArray[np.bool_],
        NDArray[np.bool_],
        NDArray[np.float64],
        NDArray[np.bool_],
        NDArray[np.int64],
        NDArray[np.int64],
    ]:
        """Carries out an order for each episode: 0 looks, 1 flies, 2 begins the episode of a seed."""

    def times_s(self) -> NDArray[np.float64]:
        """Simulated time of each episode [s]; NaN of one that is still to begin."""

    def context(self, number: int = 0) -> Context:
        """What a decision rests on in one of the episodes."""

    def strips(self, number: int = 0) -> dict[str, Any]:
        """Every strip of one of the episodes, as columns."""

    def __len__(self) -> int: ...

@final
class Context:
    """What a decision rests on, as it stood when it was asked for. Frames: N inertial, B body."""

    @property
    def task(self) -> int:
        """Number of the task to decide, from 0."""

    @property
    def now_s(self) -> float:
        """Simulated time since the epoch [s]."""

    @property
    def t_pre_max_s(self) -> float:
        """Longest transition [s]."""

    def __len__(self) -> int: ...
    @property
    def strip(self) -> NDArray[np.uint64]:
        """Identity of each candidate in the mission."""

    @property
    def priority(self) -> NDArray[np.float64]:
        """Priority of each candidate, 0 to 1."""

    @property
    def t_acq_s(self) -> NDArray[np.float64]:
        """Time that imaging each candidate takes [s]."""

    @property
    def window_open_s(self) -> NDArray[np.float64]:
        """Simulated time at which imaging each candidate may begin at the earliest [s]."""

    @property
    def window_close_s(self) -> NDArray[np.float64]:
        """Simulated time at which imaging each candidate may begin at the latest [s]."""

    @property
    def r_BN_N(self) -> list[float]:
        """Position of the satellite in the inertial frame [m]."""

    @property
    def v_BN_N(self) -> list[float]:
        """Velocity of the satellite in the inertial frame [m/s]."""

    @property
    def sigma_BN(self) -> list[float]:
        """Attitude as modified Rodrigues parameters."""

    @property
    def omega_BN_B(self) -> list[float]:
        """Body rate in the body frame [rad/s]."""

    @property
    def wheel_speed_rad_s(self) -> list[float]:
        """Speed of each wheel [rad/s]."""

    @property
    def resources(self) -> Resources | None:
        """How power and data stand; nothing where they have no bounds."""

    @property
    def previous(self) -> dict[str, Any] | None:
        """How the task went that ended here; none at the first decision."""

    def observe(self, observation: str = "table1") -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """What a learned policy sees: features of N strips, and which of the N there are."""

    def ground_track(self, times_s: Sequence[float]) -> NDArray[np.float64]:
        """Points below the satellite as rows of latitude and longitude [deg], at times relative to now [s]."""

@final
class Image:
    """Decides to image a candidate after a transition of ``t_pre_s`` seconds, rounded up to whole ticks."""

    def __new__(cls, candidate: int, t_pre_s: float) -> Image: ...
    @property
    def candidate(self) -> int:
        """Index into the candidates."""

    @property
    def t_pre_s(self) -> float:
        """Transition time [s]."""

    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...

@final
class Wait:
    """Decides to hold the attitude for ``duration_s`` seconds, rounded up to whole ticks."""

    def __new__(cls, duration_s: float) -> Wait: ...
    @property
    def duration_s(self) -> float:
        """For how long [s]."""

    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...

@final
class Serve:
    """Decides to see to power, data or momentum, where those have bounds, for ``duration_s`` seconds.

    Raises:
        ValueError: A ``duty`` other than ``charge``, ``downlink`` and ``desaturate``.
    """

    def __new__(cls, duty: str, duration_s: float) -> Serve: ...
    @property
    def duty(self) -> str:
        """``charge``, ``downlink`` or ``desaturate``."""

    @property
    def duration_s(self) -> float:
        """For how long [s], rounded up to whole ticks."""

    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...

def fly(planner: Any, settings: Settings, seed: int) -> tuple[Score, list[Task]]:
    """Flies the mission of a seed to its end: its score, and a row for each task."""

def evaluate(
    planners: Sequence[str | Any | Callable[[Context], Image | Wait | Serve]],
    settings: Settings,
    seeds: Sequence[int],
    threads: int,
) -> list[list[Score]]:
    """Flies the mission of every seed with every planner: scores by planner, then by seed."""

def read_strips(path: str | os.PathLike[str], settings: Settings) -> list[Strip]:
    """Reads strips from a file."""

def feature_collection(strips: Iterable[Strip], settings: Settings) -> str:
    """Strips as a GeoJSON text."""

def random_strips(settings: Settings, seed: int) -> list[Strip]:
    """The random strips of a seed's episode."""
