"""Reads every message of a bag with `rosbags`, which knows no type beforehand; prints JSON facts."""

import json
import sys
from pathlib import Path

from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

store = get_typestore(Stores.EMPTY)
facts = {"topics": {}, "times": [], "states": []}
with Reader(Path(sys.argv[1])) as bag:
    for connection in bag.connections:
        store.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
        qos = connection.ext.offered_qos_profiles[0]
        facts["topics"][connection.topic] = {
            "type": connection.msgtype,
            "count": connection.msgcount,
            "durability": qos.durability.name,
            "depth": qos.depth,
        }
    for connection, time, data in bag.messages():
        message = store.deserialize_cdr(data, connection.msgtype)
        facts["times"].append(time)
        if connection.topic.endswith("/state"):
            facts["states"].append([message.tick, message.sigma_bn[2], message.r_bn_n.x])
    facts["message_count"] = bag.message_count
    facts["start"] = bag.start_time
    facts["duration"] = bag.duration
print(json.dumps(facts))
