"""Messages that others are made of, for peers over CycloneDDS."""

from dataclasses import dataclass

import cyclonedds.idl.annotations as ann
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import int32, uint32


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
