"""Reads spacecraft states reliably with CycloneDDS: DOMAIN TOPIC TICK [RATE].

Ends when it has seen that tick, or a later one. With a rate it keeps every message, has room for a hundred, and takes so
many a second.
"""

import sys
import time
from dataclasses import dataclass

import cyclonedds.idl.annotations as ann
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float64, int32, uint32, uint64
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration


@dataclass
@ann.final
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
@ann.final
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
@ann.final
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
@ann.final
class SpacecraftState(IdlStruct, typename="swath_msgs::msg::dds_::SpacecraftState_"):
    header: Header
    tick: uint64
    r_bn_n: Vector3
    v_bn_n: Vector3
    sigma_bn: array[float64, 3]
    omega_bn_b: Vector3
    wheel_speed: array[float64, 3]
    wheel_torque: array[float64, 3]


def main():
    domain, topic, last = int(sys.argv[1]), sys.argv[2], int(sys.argv[3])
    rate = float(sys.argv[4]) if len(sys.argv) > 4 else None
    participant = DomainParticipant(domain)
    reliable, history = Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(20000)
    qos = Qos(reliable, history)
    if rate:
        qos = Qos(reliable, Policy.History.KeepAll, Policy.ResourceLimits(max_samples=100))
    reader = DataReader(participant, Topic(participant, "rt" + topic, SpacecraftState), qos)
    print("ready")
    received, quiet, tick = 0, time.monotonic(), None
    # What has been seen is told when nothing more comes.
    while tick is None or tick < last or time.monotonic() - quiet < 0.5:
        for sample in reader.take(1 if rate else 1000):
            # The writer has gone.
            if not sample.sample_info.valid_data:
                continue
            if received == 0:
                print("reading")
            received, quiet, tick = received + 1, time.monotonic(), sample.tick
        time.sleep(1 / rate if rate else 0.001)
    print(f"{received} received, the last is {tick}")


main()
