"""Reads every message of a bag with readers from outside; prints how many messages each saw of each topic, as JSON."""

import collections
import json
import pathlib
import sys

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore


def with_mcap(bag):
    counts = collections.Counter()
    for path in sorted(bag.glob("*.mcap")):
        with path.open("rb") as file:
            reader = make_reader(file, decoder_factories=[DecoderFactory()])
            for _, channel, _, message in reader.iter_decoded_messages():
                assert message is not None
                counts[channel.topic] += 1
    return counts


def with_rosbags(bag):
    counts = collections.Counter()
    store = get_typestore(Stores.EMPTY)
    with Reader(bag) as reader:
        for connection in reader.connections:
            store.register({
                name: definition
                for name, definition in get_types_from_msg(connection.msgdef.data, connection.msgtype).items()
                if name not in store.fielddefs
            })
        for connection, _, data in reader.messages():
            store.deserialize_cdr(data, connection.msgtype)
            counts[connection.topic] += 1
    return counts


bag = pathlib.Path(sys.argv[1])
print(json.dumps({"mcap": with_mcap(bag), "rosbags": with_rosbags(bag)}))
