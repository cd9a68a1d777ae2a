"""A mission's bag as pandas frames: its tasks with their results.

    pip install pandas mcap-ros2-support
    python bag_frames.py BAG_FOLDER
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pandas
from mcap_ros2.reader import read_ros2_messages


def frame(bag: Path, topic: str) -> pandas.DataFrame:
    """Every message of a topic, one row each, by the time at which it was sent."""
    rows: list[dict[str, Any]] = []
    for file in sorted(bag.glob("*.mcap")):
        for message in read_ros2_messages(str(file), topics=[topic]):
            fields = message.ros_msg.__slots__
            values = {name: getattr(message.ros_msg, name) for name in fields if not name.startswith("_")}
            rows.append({"time": message.log_time, **values})
    return pandas.DataFrame(rows).set_index("time").sort_index()


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    results = frame(folder, "/swath/requests/results")
    tasks = frame(folder, "/swath/planner/task")
    print(tasks.tail())
    print(results.tail())
    print(f"{len(tasks)} tasks, reward {results['reward'].sum():.2f}")
