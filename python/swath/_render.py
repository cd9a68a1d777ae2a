"""A map of the Earth with strips and ground track, drawn into an array."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from swath._swath import Context

HEIGHT, WIDTH = 360, 720
_SEA = (16, 24, 40)
_GRID = (38, 50, 72)
_TRACK_PAST = (110, 130, 170)
_TRACK_AHEAD = (230, 236, 250)
_SATELLITE = (255, 255, 255)
_STATES = {
    "expired": (84, 60, 60),
    "removed": (84, 60, 60),
    "held": (120, 120, 60),
    "pending": (226, 176, 60),
    "fulfilled": (70, 200, 120),
    "fulfilled_by_link": (70, 200, 120),
}
#: Points of a strip: 500 km are nine pixels.
_STRIP_POINTS = 16
_TRACK_STEP_S = 5.0
_OFFERED_WIDTH = 1


def picture(context: Context, strips: dict[str, Any], orbit_s: float) -> NDArray[np.uint8]:
    """The map, rows × columns × RGB, north up, from 180° west to 180° east.

    Strips are yellow while they are pending, and bolder where they are offered; green when they are imaged, dark red when
    their last window has closed. The track is that of half an orbit before and after now.
    """
    image = np.empty((HEIGHT, WIDTH, 3), np.uint8)
    image[:] = _SEA
    image[:: HEIGHT // 6, :] = _GRID
    image[:, :: WIDTH // 12] = _GRID
    points = _along(strips["start_deg"], strips["end_deg"])
    states = np.asarray(strips["state"], dtype=str)
    offered = np.isin(strips["strip"], context.strip)
    for state, colour in _STATES.items():
        _dots(image, points[(states == state) & ~offered], colour, 0)
    _dots(image, points[offered], _STATES["pending"], _OFFERED_WIDTH)
    half = np.arange(0.0, orbit_s / 2, _TRACK_STEP_S)
    # Nothing was flown before the epoch.
    _dots(image, context.ground_track(list(-half[half <= context.now_s])), _TRACK_PAST, 0)
    _dots(image, context.ground_track(list(half)), _TRACK_AHEAD, 0)
    _dots(image, context.ground_track([0.0]), _SATELLITE, 3)
    return image


def _along(start_deg: NDArray[np.float64], end_deg: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points on the chords from starts to ends, which at 500 km do not differ from the great circles by a pixel."""
    start, end = _direction(start_deg), _direction(end_deg)
    share = np.linspace(0.0, 1.0, _STRIP_POINTS)[None, :, None]
    along = start[:, None, :] * (1.0 - share) + end[:, None, :] * share
    latitude = np.degrees(np.arctan2(along[..., 2], np.hypot(along[..., 0], along[..., 1])))
    longitude = np.degrees(np.arctan2(along[..., 1], along[..., 0]))
    return np.stack([latitude, longitude], axis=-1)


def _direction(latitude_longitude_deg: NDArray[np.float64]) -> NDArray[np.float64]:
    latitude, longitude = np.radians(latitude_longitude_deg).T
    return np.stack([np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)], -1)


def _dots(image: NDArray[np.uint8], points_deg: NDArray[np.float64], colour: tuple[int, int, int], grow: int) -> None:
    latitude, longitude = points_deg[..., 0].ravel(), points_deg[..., 1].ravel()
    rows = ((90.0 - latitude) / 180.0 * HEIGHT).astype(int)
    columns = ((longitude + 180.0) / 360.0 * WIDTH).astype(int)
    for down in range(-grow, grow + 1):
        for right in range(-grow, grow + 1):
            image[np.clip(rows + down, 0, HEIGHT - 1), (columns + right) % WIDTH] = colour
