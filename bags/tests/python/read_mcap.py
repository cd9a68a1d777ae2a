"""Reads every message of a bag's files with `mcap` and `mcap-ros2-support`; prints JSON facts."""

import json
import sys
from pathlib import Path

from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory

facts = {"topics": {}, "times": [], "states": [], "metadata": {}, "records": 0}
files = sorted(Path(sys.argv[1]).glob("*.mcap"), key=lambda f: int(f.stem.rsplit("_", 1)[1]))
for file in files:
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
        counts = summary.statistics.channel_message_counts
        for channel in summary.channels.values():
            topic = facts["topics"].setdefault(
                channel.topic,
                {
                    "type": summary.schemas[channel.schema_id].name,
                    "encoding": channel.message_encoding,
                    "hash": channel.metadata["topic_type_hash"],
                    "count": 0,
                },
            )
            topic["count"] += counts.get(channel.id, 0)
        for metadata in reader.iter_metadata():
            facts["metadata"][metadata.name] = metadata.metadata
        for _, channel, message, decoded in reader.iter_decoded_messages():
            facts["times"].append(message.log_time)
            if channel.topic.endswith("/state"):
                facts["states"].append([decoded.tick, decoded.sigma_bn[2], decoded.r_bn_n.x])
    with file.open("rb") as stream:
        for _ in StreamReader(stream, validate_crcs=True).records:
            facts["records"] += 1
print(json.dumps(facts))
