"""An outside ROS 2 peer over CycloneDDS on the radio's topics: whatever is sent there it sends again, twice, later, in
another order, with bits turned and with other ticks, until it is interrupted.

Prints one JSON object with how much it heard and sent.
"""

import json
import random
import signal
import sys
import time
from dataclasses import dataclass, replace

import cyclonedds.idl.annotations as ann
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import sequence, uint8, uint32, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from std_msgs import Header


@dataclass
@ann.final
class RadioFrame(IdlStruct, typename="swath_msgs::msg::dds_::RadioFrame_"):
    data: sequence[uint8]
    air_ticks: uint64


@dataclass
@ann.final
class RadioSent(IdlStruct, typename="swath_msgs::msg::dds_::RadioSent_"):
    header: Header
    tick: uint64
    frames: sequence[RadioFrame]


@dataclass
@ann.final
class RadioTurn(IdlStruct, typename="swath_msgs::msg::dds_::RadioTurn_"):
    header: Header
    tick: uint64
    next: uint64
    open: bool
    frames: sequence[RadioFrame]


@dataclass
@ann.final
class CatalogueHeard(IdlStruct, typename="swath_msgs::msg::dds_::CatalogueHeard_"):
    header: Header
    through: uint64
    abort: bool
    abort_task: uint64
    reason: str
    hold: bool
    hold_task: uint64


@dataclass
@ann.final
class GuidanceReached(IdlStruct, typename="swath_msgs::msg::dds_::GuidanceReached_"):
    header: Header
    tick: uint64
    task: uint64
    has_strip: bool
    strip_id: uint64
    start_tick: uint64
    t_pre_ticks: uint32
    t_acq_ticks: uint32


TOPICS = [
    ("link/up", RadioTurn),
    ("link/down", RadioTurn),
    ("catalogue/sent", RadioSent),
    ("requests/sent", RadioSent),
    ("catalogue/heard", CatalogueHeard),
    ("guidance/reached", GuidanceReached),
]


def disturbed(message, rng):
    """The same message with another tick, or with a frame that is damaged."""
    if isinstance(message, CatalogueHeard):
        return replace(message, through=message.through + rng.randrange(1, 9), abort=True, hold=True)
    if isinstance(message, GuidanceReached) or not message.frames or rng.random() < 0.5:
        return replace(message, tick=message.tick + rng.choice([-1, 1, 2, 100]) if message.tick else 1)
    frames = [RadioFrame(list(frame.data), frame.air_ticks) for frame in message.frames]
    frame = rng.choice(frames)
    if frame.data:
        frame.data[rng.randrange(len(frame.data))] ^= 1 << rng.randrange(8)
    rng.shuffle(frames)
    return replace(message, frames=frames)


def main():
    kinds = tuple(kind for _, kind in TOPICS)
    participant = DomainParticipant(int(sys.argv[1]))
    reliable = Qos(Policy.Reliability.Reliable(duration(milliseconds=10)), Policy.History.KeepLast(1000))
    ends = []
    for name, kind in TOPICS:
        topic = Topic(participant, f"rt/swath/{name}", kind)
        ends.append((name, DataReader(participant, topic, reliable), DataWriter(participant, topic, reliable), []))
    ended = []
    signal.signal(signal.SIGINT, lambda *_: ended.append(True))
    rng = random.Random(1)
    heard, sent, own = {name: 0 for name, _ in TOPICS}, 0, set()
    while not ended:
        for name, reader, writer, held in ends:
            for message in reader.take(100):
                # Among them are notes that a writer has gone, and what it hears of itself, which is not sent once more.
                if not isinstance(message, kinds) or repr(message) in own:
                    continue
                heard[name] += 1
                held.append(message)
                again = [message, held.pop(rng.randrange(len(held))), disturbed(message, rng)]
                rng.shuffle(again)
                for copy in again:
                    own.add(repr(copy))
                    writer.write(copy)
                    sent += 1
                del held[:-50]
        time.sleep(0.001)
    print(json.dumps({"heard": heard, "sent": sent}))


main()
