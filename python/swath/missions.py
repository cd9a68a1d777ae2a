"""Whole missions: flown by a planner, and compared over planners and seeds."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, TypedDict

from swath import _swath
from swath._settings import Strips, checked_seed, settings_of
from swath._swath import Context, Image, Serve, Settings, Wait

#: What 15 orbits with 2000 to 5000 strips are called where planners are compared.
EVALUATION: Mapping[str, Any] = {"orbits": 15.0, "scenario": {"count": [2000, 5000]}}


class Planner(Protocol):
    """A planner of one's own: an object with this method, or a function that does the same."""

    def decide(self, context: Context, /) -> Image | Wait | Serve:
        """Decides what to do next."""


AnyPlanner = str | Planner | Callable[[Context], Image | Wait | Serve]


class Score(TypedDict):
    """What came of a mission. What no attempt, or no image, tells is ``None``."""

    #: Its seed.
    seed: int
    #: Strips asked for.
    requests: int
    #: Those of them that have a window in which they can be imaged.
    reachable: int
    #: Sum of the priorities of imaged strips, per orbit.
    reward_per_orbit: float
    #: Share of the attempts that succeeded.
    success_rate: float | None
    #: Attempts per orbit.
    attempts_per_orbit: float
    #: Strips imaged per orbit.
    imaged_per_orbit: float
    #: Mean transition time of attempts [s].
    t_pre_s: float | None
    #: Mean acquisition time of attempts [s].
    t_acq_s: float | None
    #: Mean priority of imaged strips.
    priority: float | None
    #: Time spent waiting, per orbit [s].
    wait_s_per_orbit: float
    #: Share of the attempts that failed for attitude.
    failed_attitude: float | None
    #: Share of the attempts that failed for elevation.
    failed_elevation: float | None


class Resources(TypedDict):
    """How power and data stand."""

    #: Charge of the battery [Wh].
    charge_wh: float
    #: Capacity of the battery [Wh].
    capacity_wh: float
    #: Share of the Sun's disc that is seen.
    illumination: float
    #: Power of the array [W].
    generated_w: float
    #: Power of all loads [W].
    load_w: float
    #: Bits stored.
    stored_bits: int
    #: Bits that wait to be sent.
    to_send_bits: int
    #: Bits that there is room for in all.
    storage_bits: int
    #: Whether a station hears the satellite.
    in_contact: bool
    #: Begin and end of the contact that is under way or comes next, simulated time [s].
    contact_s: tuple[float, float] | None


class Task(TypedDict):
    """A task as it was flown."""

    #: Number of the task, from 0.
    task: int
    #: Simulated time at which it began [s].
    start_s: float
    #: Simulated time at which it ended [s].
    end_s: float
    #: The strip, or ``None`` for a wait.
    strip: int | None
    #: Transition time [s]; 0 for a wait.
    t_pre_s: float
    #: Acquisition time [s]; 0 for a wait.
    t_acq_s: float
    #: Whether a strip was imaged.
    success: bool
    #: ``attitude``, ``elevation`` or ``interrupted``.
    failure: str | None
    #: Largest attitude error ‖σ_BR‖ while imaging.
    max_attitude_error: float
    #: Least elevation while imaging [deg].
    min_elevation_deg: float
    #: The strip's priority when this fulfilled it, else 0.
    reward: float


@dataclass(frozen=True)
class Flight:
    """A mission that was flown: its score and its tasks; ``pandas.DataFrame(flight.tasks)`` is a table of them."""

    score: Score
    tasks: list[Task]


def fly(
    planner: AnyPlanner,
    *,
    seed: int = 0,
    config: str | os.PathLike[str] | Settings | None = None,
    episode: Mapping[str, Any] | None = None,
    simulation: Mapping[str, Any] | None = None,
    plant: Mapping[str, Any] | str | None = None,
    strips: Strips | None = None,
) -> Flight:
    """Flies the mission of a seed to its end.

    Args:
        planner: ``beam``, ``lookahead``, ``repair``, ``aspen``, ``heuristic:SECONDS``, ``random``, or a planner of one's
            own, which gets a :class:`swath.Context` and returns a :class:`swath.Image`, a :class:`swath.Wait` or, where
            resources have bounds, a :class:`swath.Serve`.
        seed: Seed of the mission: initial state and random strips.

    The other arguments are those of :class:`swath.StripImagingEnv`.

    Raises:
        ValueError: A planner, a setting or a decision that is out of range. What a planner raises is passed on.
    """
    settings = settings_of(config, None, episode, simulation, plant, strips)
    score, tasks = _swath.fly(planner, settings, checked_seed(seed))
    return Flight(score, tasks)


def evaluate(
    planners: Iterable[AnyPlanner],
    *,
    seeds: Iterable[int] = range(100),
    threads: int | None = None,
    config: str | os.PathLike[str] | Settings | None = None,
    episode: Mapping[str, Any] | None = None,
    simulation: Mapping[str, Any] | None = None,
    plant: Mapping[str, Any] | str | None = None,
    strips: Strips | None = None,
) -> list[list[Score]]:
    """Flies the mission of every seed with every planner: scores by planner, then by seed.

    Without ``config`` and ``episode`` the missions are those of ``swath-train evaluate``: 15 orbits with 2000 to 5000
    strips. Planners by name fly on ``threads`` threads, those of one's own one mission after the other.

    Raises:
        ValueError: As :func:`fly`.
    """
    if config is None and episode is None:
        episode = EVALUATION
    settings = settings_of(config, None, episode, simulation, plant, strips)
    workers = len(os.sched_getaffinity(0)) if threads is None else threads
    return _swath.evaluate(list(planners), settings, [checked_seed(seed) for seed in seeds], workers)
