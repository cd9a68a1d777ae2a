"""A CycloneDDS peer of the bench: `cyclone.py write DOMAIN COUNT` or `cyclone.py read DOMAIN COUNT`.

Writes a thousand messages each 20 ms, or reads with depth 10 until the last message has come. Prints one JSON object.
"""

import json
import sys
import time
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

BURST = 1000
PERIOD_S = 0.02
# As ROS 2 has it by default.
QOS = Qos(
    Policy.Reliability.Reliable(duration(seconds=10)),
    Policy.History.KeepLast(10),
    Policy.Durability.Volatile,
)


@dataclass
class String_(IdlStruct, typename="std_msgs::msg::dds_::String_"):
    data: str


def write(topic, count):
    writer = DataWriter(topic.participant, topic, qos=QOS)
    while not writer.get_matched_subscriptions():
        time.sleep(0.02)
    time.sleep(0.5)
    messages = [String_((f"{i:08} " * 33)[:291]) for i in range(BURST)]
    start = time.monotonic()
    for burst in range(count // BURST):
        time.sleep(max(0.0, start + burst * PERIOD_S - time.monotonic()))
        for message in messages:
            writer.write(message)
    seconds = time.monotonic() - start
    # Until the reader has all that it asks for again.
    time.sleep(2)
    return {"seconds": seconds}


def read(topic, count):
    reader = DataReader(topic.participant, topic, qos=QOS)
    taken, first, last = 0, None, time.monotonic()
    while first is None or (time.monotonic() - last < 3 and taken < count):
        samples = reader.take(N=100)
        now = time.monotonic()
        if samples:
            first, last = first or now, now
            taken += len(samples)
        else:
            time.sleep(0.0005)
    return {"taken": taken, "seconds": last - first}


def main():
    role, domain, count = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    topic = Topic(DomainParticipant(domain), "rt/bench", String_, qos=QOS)
    print(json.dumps({"write": write, "read": read}[role](topic, count)))


main()
