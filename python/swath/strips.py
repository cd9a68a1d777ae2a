"""Strips, from files of many formats, and to GeoJSON."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TypedDict

from swath import _swath
from swath._swath import Settings


class Strip(TypedDict):
    """A ground strip that is asked for, from its start to its end along the great circle."""

    #: Geocentric latitude of the start [deg].
    start_latitude_deg: float
    #: Longitude of the start, east positive [deg].
    start_longitude_deg: float
    #: Geocentric latitude of the end [deg].
    end_latitude_deg: float
    #: Longitude of the end, east positive [deg].
    end_longitude_deg: float
    #: Priority, 0 to 1.
    priority: float
    #: Speed of the target along the ground [m/s].
    acquisition_speed_m_s: float
    #: Whether it may as well be imaged from its end to its start.
    bidirectional: bool


def read_strips(path: str | os.PathLike[str], settings: Settings | None = None) -> list[Strip]:
    """Reads strips from a file: GeoJSON, lines or a text sequence of it, KML, GPX, WKT or CSV; ``-`` is standard input.

    A line becomes the fewest strips that follow it, a polygon parallel strips that cover it. Properties: ``priority``,
    ``acquisition_speed_m_s``, ``bidirectional``. Conditions of an order that episodes do not know, such as
    ``valid_until``, are left out with a ``UserWarning``.

    Raises:
        ValueError: The file cannot be read, or holds something that is no strip; all of it is named.
    """
    return _swath.read_strips(os.fspath(path), settings or Settings())


def write_strips(path: str | os.PathLike[str], strips: Sequence[Strip], settings: Settings | None = None) -> None:
    """Writes strips to a GeoJSON file that :func:`read_strips` gives back as they are.

    Raises:
        ValueError: A strip that the satellite may not be asked for.
    """
    text = _swath.feature_collection(strips, settings or Settings())
    Path(path).write_text(text, encoding="utf-8")


def random_strips(seed: int, settings: Settings | None = None) -> list[Strip]:
    """The random strips that the episode of a seed asks for."""
    return _swath.random_strips(settings or Settings(), seed)
