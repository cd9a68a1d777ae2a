"""Where a flying mission's satellite is going to be, from what its console's log tells."""

import json
import math
import time
import urllib.request

EARTH_RAD_S = 7.292115e-5


def log(base, after=0):
    """All facts after a number."""
    facts = []
    while True:
        with urllib.request.urlopen(f"{base}/api/log?after={after + len(facts)}", timeout=60) as answer:
            page = json.load(answer)
        if not page:
            return facts
        facts += page


def points(base):
    """The last two points under the satellite; waits for them."""
    for _ in range(120):
        found = [fact for fact in log(base) if fact["kind"] == "point"]
        if len(found) >= 2:
            return found[-2:]
        time.sleep(0.5)
    raise AssertionError("the satellite does not tell where it is")


def turned(fact):
    """The direction of a point in a frame that does not turn with the Earth."""
    lon = math.radians(fact["lon"]) + EARTH_RAD_S * fact["t"] / 1000
    lat = math.radians(fact["lat"])
    return [math.cos(lat) * math.cos(lon), math.cos(lat) * math.sin(lon), math.sin(lat)]


def place(base, seconds):
    """Longitude and latitude [deg] under the satellite, so many seconds of simulated time after its last point."""
    before, last = points(base)
    a, b = turned(before), turned(last)
    angle = math.acos(sum(x * y for x, y in zip(a, b)))
    rate = angle / ((last["t"] - before["t"]) / 1000)
    # Along the great circle through both: b, and the direction in which it is left.
    along = [(y - math.cos(angle) * x) / math.sin(angle) for x, y in zip(a, b)]
    turn = angle + rate * seconds
    x, y, z = (math.cos(turn) * p + math.sin(turn) * q for p, q in zip(a, along))
    lon = math.degrees(math.atan2(y, x) - EARTH_RAD_S * (last["t"] / 1000 + seconds))
    return (lon + 180) % 360 - 180, math.degrees(math.asin(z))


def strip(base, seconds, length_deg=1.0):
    """Ends of a strip to the north, longitude and latitude each, that the satellite passes in so many seconds."""
    lon, lat = place(base, seconds)
    return [lon, lat], [lon, lat - length_deg if lat > 0 else lat + length_deg]
