"""Compares the messages of an MCAP file with those of a bag made from it, read by `mcap` and by `rosbags`; prints JSON."""

import json
import sys
from pathlib import Path

from mcap.reader import make_reader
from rosbags.rosbag2 import Reader
from rosbags.rosbag2.errors import ReaderError


def read_mcap(file):
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        return sorted((c.topic, m.log_time, bytes(m.data)) for _, c, m in reader.iter_messages())


original = read_mcap(Path(sys.argv[1]))
made = Path(sys.argv[2])
by_mcap = sorted(message for file in made.glob("*.mcap") for message in read_mcap(file))
facts = {"messages": len(original), "mcap": by_mcap == original}
try:
    with Reader(made) as bag:
        by_rosbags = sorted((connection.topic, time, bytes(data)) for connection, time, data in bag.messages())
        facts["rosbags"] = by_rosbags == original
except ReaderError as error:
    facts["rosbags"] = str(error)
print(json.dumps(facts))
