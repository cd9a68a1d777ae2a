"""Reads what `swath export` wrote with readers from outside, compares the files with each other, and prints JSON."""

import json
import math
import pathlib
import sys

import duckdb
import oem

folder = pathlib.Path(sys.argv[1])


def rows(query):
    return duckdb.sql(query).fetchall()


for name in ("tasks", "states", "decisions"):
    csv, parquet = (f"'{folder / name}.{kind}'" for kind in ("csv", "parquet"))
    columns = [column for column, *_ in rows(f"describe select * from {parquet}")]
    assert columns == [column for column, *_ in rows(f"describe select * from {csv}")], name
    for column in columns:
        same = f"""select count(*) from (select row_number() over () n, "{column}" v from {parquet}) a
                   join (select row_number() over () n, "{column}" v from {csv}) b using (n)
                   where cast(a.v as varchar) is distinct from cast(b.v as varchar)
                     and try_cast(a.v as double) is distinct from try_cast(b.v as double)"""
        assert rows(same)[0][0] == 0, f"{name}.{column} differs between CSV and Parquet"

tasks = f"'{folder / 'tasks.parquet'}'"
states = rows(f"""select time_s, r_bn_n_x_m, r_bn_n_y_m, r_bn_n_z_m, sigma_bn_1, sigma_bn_2, sigma_bn_3
                  from '{folder / 'states.parquet'}' order by tick""")
by_time = {time: (r, sigma) for time, *r_sigma in states for r, sigma in [(r_sigma[:3], r_sigma[3:])]}

czml = json.loads((folder / "mission.czml").read_text())
satellite = next(packet for packet in czml if packet["id"] == "satellite")
positions = satellite["position"]["cartesian"]
quaternions = satellite["orientation"]["unitQuaternion"]
track_file = json.loads((folder / "ground_track.geojson").read_text())["features"][0]["geometry"]
lines = track_file["coordinates"] if track_file["type"] == "MultiLineString" else [track_file["coordinates"]]
# The points on the antimeridian itself are those where the line was cut.
track = [place for line in lines for place in line if abs(place[0]) < 180]


def columns_of(q):
    """The rotation matrix of a quaternion x, y, z, w."""
    x, y, z, w = q
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]


def track_difference(i):
    x, y, z = positions[4 * i + 1 : 4 * i + 4]
    longitude, latitude = math.degrees(math.atan2(y, x)), math.degrees(math.asin(z / math.hypot(x, y, z)))
    return max(abs(longitude - track[i][0]), abs(latitude - track[i][1]))


def attitude_difference(i):
    """The third component is the same in both frames: the Earth turns about it."""
    r, sigma = by_time[quaternions[5 * i]]
    s2 = sum(s * s for s in sigma)
    q_bn = [2 * s / (1 + s2) for s in sigma] + [(1 - s2) / (1 + s2)]
    inertial, fixed = columns_of(q_bn)[2], columns_of(quaternions[5 * i + 1 : 5 * i + 5])[2]
    return max(*(abs(a - b) for a, b in zip(inertial, fixed)), abs(r[2] - positions[4 * i + 3]) / 7e6)


def of_ccsds():
    """Largest differences of the OEM from positions and from their change, and of the AEM from the attitudes."""
    (segment,) = oem.OrbitEphemerisMessage.open(folder / "orbit.oem").segments
    states = list(segment)
    assert segment.metadata["REF_FRAME"] == "ITRF2000" and segment.metadata["TIME_SYSTEM"] == "UTC"
    place = max(
        abs(value * 1000 - positions[4 * i + 1 + axis])
        for i, state in enumerate(states)
        for axis, value in enumerate(state.position)
    )
    # The velocity between two points ten seconds apart is about the mean of theirs.
    speed = max(
        abs((b.position[axis] - a.position[axis]) / 10 - (a.velocity[axis] + b.velocity[axis]) / 2)
        for a, b in zip(states[:-2], states[1:-1])
        for axis in range(3)
    )
    lines = (folder / "attitude.aem").read_text().split("DATA_START\n")[1].split("\nDATA_STOP")[0].splitlines()
    turn = max(
        abs(float(value) - quaternions[5 * i + 1 + axis])
        for i, line in enumerate(lines)
        for axis, value in enumerate(line.split()[1:])
    )
    assert len(states) == len(lines) == len(track)
    return {"place_m": place, "speed_km_s": speed, "turn": turn}


count = len(positions) // 4
assert count == len(quaternions) // 5 == len(track)
strips = json.loads((folder / "strips.geojson").read_text())["features"]
imaged, reward = rows(f"select count(*) filter (success and strip is not null), sum(reward) from {tasks}")[0]
print(json.dumps({
    "tasks": rows(f"select count(*) from {tasks}")[0][0],
    "imaged": imaged,
    "reward": reward,
    "states": len(states),
    "decisions": rows(f"select count(*) from '{folder / 'decisions.csv'}'")[0][0],
    "track_points": len(track),
    "strips": len(strips),
    "completed": sum(strip["properties"]["state"] == "completed" for strip in strips),
    "largest_track_difference_deg": max(map(track_difference, range(count))),
    "largest_attitude_difference": max(map(attitude_difference, range(count))),
    "ccsds": of_ccsds(),
}))
