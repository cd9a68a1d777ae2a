"""An outside ROS 2 peer over CycloneDDS: receives states, submits strips, sees one of them imaged, and acknowledges an
alarm.

Prints one JSON object; exits with 1 when something does not come in time.
"""

import json
import sys
import time
from dataclasses import dataclass

import cyclonedds.idl.annotations as ann
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float64, int64, sequence, uint8, uint16, uint32, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from std_msgs import Header, Time

COMPLETED = 6
TIMEOUT_S = 60.0


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


@dataclass
@ann.final
class Strip(IdlStruct, typename="swath_msgs::msg::dds_::Strip_"):
    id: uint64
    name: str
    start_latitude_deg: float64
    start_longitude_deg: float64
    end_latitude_deg: float64
    end_longitude_deg: float64
    priority: float64
    acquisition_speed: float64


@dataclass
@ann.final
class StripStatus(IdlStruct, typename="swath_msgs::msg::dds_::StripStatus_"):
    header: Header
    strip: Strip
    client_ref: str
    submitter: str
    state: uint8
    reason_code: uint16
    reason: str
    actor: str
    tick: uint64
    created_tick: uint64
    attempts: uint32
    reward: float64
    window_open: Time
    window_close: Time
    imaging: Time
    linked_to: uint64
    supersedes: uint64
    superseded_by: uint64
    order_id: uint64
    order_ref: str
    part: uint32
    parts: uint32
    share: float64
    served_by: uint64


@dataclass
@ann.final
class StripRequest(IdlStruct, typename="swath_msgs::msg::dds_::StripRequest_"):
    client_ref: str
    submitter: str
    name: str
    start_latitude_deg: float64
    start_longitude_deg: float64
    end_latitude_deg: float64
    end_longitude_deg: float64
    priority: float64
    acquisition_speed: float64
    bidirectional: bool
    valid_from: Time
    valid_until: Time
    hold_for_approval: bool
    max_attempts: uint32
    order_ref: str
    part: uint32
    parts: uint32
    share: float64


@dataclass
@ann.final
class SubmitResult(IdlStruct, typename="swath_msgs::msg::dds_::SubmitResult_"):
    accepted: bool
    id: uint64
    reason_code: uint16
    reason: str
    known: bool
    state: uint8


@dataclass
@ann.final
class SubmitRequest(IdlStruct, typename="swath_msgs::srv::dds_::SubmitStrips_Request_"):
    client: uint64
    number: int64
    requests: sequence[StripRequest]


@dataclass
@ann.final
class SubmitResponse(IdlStruct, typename="swath_msgs::srv::dds_::SubmitStrips_Response_"):
    client: uint64
    number: int64
    results: sequence[SubmitResult]
    reason_code: uint16
    reason: str


@dataclass
@ann.final
class CancelRequest(IdlStruct, typename="swath_msgs::srv::dds_::CancelStrips_Request_"):
    client: uint64
    number: int64
    ids: sequence[uint64]
    actor: str
    reason: str


@dataclass
@ann.final
class CancelResponse(IdlStruct, typename="swath_msgs::srv::dds_::CancelStrips_Response_"):
    client: uint64
    number: int64
    results: sequence[SubmitResult]
    reason_code: uint16
    reason: str


@dataclass
@ann.final
class Opportunity(IdlStruct, typename="swath_msgs::msg::dds_::Opportunity_"):
    window_open_tick: uint64
    window_close_tick: uint64
    window_open: Time
    window_close: Time
    t_acq_ticks: uint32
    t_acq_s: float64
    min_elevation: float64
    transition_found: bool
    transition_ticks: uint32
    transition_s: float64
    conflicts: uint32
    conflict_ids: sequence[uint64, 16]


@dataclass
@ann.final
class PreviewRequest(IdlStruct, typename="swath_msgs::srv::dds_::PreviewStrip_Request_"):
    client: uint64
    number: int64
    id: uint64
    request: StripRequest
    horizon_s: float64


@dataclass
@ann.final
class PreviewResponse(IdlStruct, typename="swath_msgs::srv::dds_::PreviewStrip_Response_"):
    client: uint64
    number: int64
    opportunities: sequence[Opportunity]
    now: Time
    reason_code: uint16
    reason: str


@dataclass
@ann.final
class KeyValue(IdlStruct, typename="diagnostic_msgs::msg::dds_::KeyValue_"):
    key: str
    value: str


@dataclass
@ann.final
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticStatus_"):
    level: uint8
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@dataclass
@ann.final
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticArray_"):
    header: Header
    status: sequence[DiagnosticStatus]


@dataclass
@ann.final
class Alarm(IdlStruct, typename="swath_msgs::msg::dds_::Alarm_"):
    node: str
    name: str
    severity: uint8
    state: uint8
    beneath: uint8
    text: str
    sequence: uint64
    raised_tick: uint64
    raised: Time
    shelved_until_tick: uint64
    shelved_until: Time


@dataclass
@ann.final
class StandingAlarms(IdlStruct, typename="swath_msgs::msg::dds_::StandingAlarms_"):
    header: Header
    tick: uint64
    alarms: sequence[Alarm]


@dataclass
@ann.final
class AcknowledgeRequest(IdlStruct, typename="swath_msgs::srv::dds_::AcknowledgeAlarm_Request_"):
    client: uint64
    number: int64
    node: str
    name: str
    actor: str
    comment: str


@dataclass
@ann.final
class AcknowledgeResponse(IdlStruct, typename="swath_msgs::srv::dds_::AcknowledgeAlarm_Response_"):
    client: uint64
    number: int64
    accepted: bool
    reason: str


class Peer:
    def __init__(self, domain):
        participant = DomainParticipant(domain)
        reliable = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(1000))

        latched = Qos(
            Policy.Reliability.Reliable(duration(seconds=1)),
            Policy.Durability.TransientLocal,
            Policy.History.KeepLast(1),
        )

        def reader(name, kind, qos=reliable):
            return DataReader(participant, Topic(participant, name, kind), qos)

        def writer(name, kind):
            return DataWriter(participant, Topic(participant, name, kind), reliable)

        self.states = reader("rt/swath/spacecraft/state", SpacecraftState)
        self.events = reader("rt/swath/requests/events", StripStatus)
        self.plain = writer("rt/swath/requests/request", StripRequest)
        self.diagnostics = reader("rt/diagnostics", DiagnosticArray)
        self.health = {}
        self.alarms = reader("rt/swath/alarms/standing", StandingAlarms, latched)
        self.services = {
            name: (writer(f"rq/swath/{name}Request", request), reader(f"rr/swath/{name}Reply", response))
            for name, request, response in [
                ("requests/submit", SubmitRequest, SubmitResponse),
                ("requests/cancel", CancelRequest, CancelResponse),
                ("requests/preview", PreviewRequest, PreviewResponse),
                ("alarms/acknowledge", AcknowledgeRequest, AcknowledgeResponse),
            ]
        }
        self.number = 0

    def wait(self, what, look):
        deadline = time.monotonic() + TIMEOUT_S
        while time.monotonic() < deadline:
            found = look()
            if found is not None:
                return found
            time.sleep(0.01)
        sys.exit(f"{what} did not come within {TIMEOUT_S} s")

    def call(self, name, make):
        """Calls a service; asks again, because a request can be lost before both ends are matched."""
        requests, responses = self.services[name]
        for _ in range(20):
            self.number += 1
            requests.write(make(77, self.number))
            deadline = time.monotonic() + 1.0
            while time.monotonic() < deadline:
                for response in responses.take(10):
                    if response.client == 77:
                        return response
                time.sleep(0.01)
        sys.exit(f"nobody answers {name}")

    def submit(self, strips):
        return self.call("requests/submit", lambda client, number: SubmitRequest(client, number, strips)).results

    def cancel(self, ids):
        make = lambda client, number: CancelRequest(client, number, ids, "peer", "changed my mind")
        return self.call("requests/cancel", make).results

    def preview(self, strip, horizon_s):
        return self.call("requests/preview", lambda client, number: PreviewRequest(client, number, 0, strip, horizon_s))

    def acknowledge(self, node, name):
        make = lambda client, number: AcknowledgeRequest(client, number, node, name, "peer", "seen")
        return self.call("alarms/acknowledge", make)

    def healthy(self):
        """What each node tells of its own health, by its name, once all have told of a second in flight."""
        for array in self.diagnostics.take(100):
            for status in array.status:
                node, _, kind = status.name.partition(": ")
                values = {value.key: value.value for value in status.values}
                if kind == "health" and float(values["simulated_s_per_s"]) > 0.0:
                    self.health[node.removeprefix("/swath/")] = (status.level, values)
        return self.health if len(self.health) == 4 else None

    def alarm(self, name):
        """An alarm as it stands, told whenever one of them changes."""
        for standing in self.alarms.take(10):
            for alarm in standing.alarms:
                if alarm.name == name:
                    return alarm
        return None


def request(reference, latitude, longitude):
    return StripRequest(
        reference, "peer", reference, latitude, longitude, latitude + 1.0, longitude + 1.5, 0.9, 3000.0,
        False, Time(0, 0), Time(0, 0), False, 0, "", 0, 0, 0.0,
    )


def main():
    peer = Peer(int(sys.argv[1]))
    state = peer.wait("a spacecraft state", lambda: next(iter(peer.states.take(1)), None))
    grid = [(latitude, longitude) for latitude in range(-40, 45, 10) for longitude in range(-180, 180, 20)]
    results = peer.submit([request(f"peer-{i}", *place) for i, place in enumerate(grid)])
    refused = peer.submit([request("peer-nan", float("nan"), 0.0), request("peer-north", 90.5, 0.0)])
    peer.plain.write(request("peer-plain", 5.0, 10.0))
    preview = peer.preview(request("peer-preview", 5.0, 60.0), 0.0)
    no_preview = peer.preview(request("peer-preview", 85.0, 60.0), 0.0)
    # The strip that comes last has the most time to be taken back.
    last = peer.submit([request("peer-cancel", 7.0, 33.0)])[0].id
    cancelled = peer.cancel([last, 123456])
    health = peer.wait("the health of four nodes", peer.healthy)
    alarm = peer.wait("an alarm", lambda: peer.alarm("wheel y"))
    unknown = peer.acknowledge("guidance", "wheel q")
    known = peer.acknowledge("guidance", "wheel y")
    acknowledged = peer.wait("it acknowledged", lambda: peer.alarm("wheel y"))
    ids = {result.id for result in results if result.accepted}
    seen = set()

    def imaged():
        for event in peer.events.take(1000):
            seen.add(event.client_ref)
            if event.state == COMPLETED and event.strip.id in ids:
                return event
        return None

    event = peer.wait("an imaged strip", imaged)
    peer.wait("the plain topic's request", lambda: True if imaged() or "peer-plain" in seen else None)
    print(json.dumps({
        "first_tick": state.tick,
        "radius_m": (state.r_bn_n.x**2 + state.r_bn_n.y**2 + state.r_bn_n.z**2) ** 0.5,
        "accepted": len(ids),
        "refused": [result.reason_code for result in refused],
        "opportunities": len(preview.opportunities),
        "elevations": [opportunity.min_elevation for opportunity in preview.opportunities],
        "no_opportunity": no_preview.reason_code,
        "cancelled": [(result.accepted, result.reason_code) for result in cancelled],
        "levels": {node: level for node, (level, _) in health.items()},
        "restarts": [values["restarts"] for _, values in health.values()],
        "states_hz": float(health["guidance"][1]["/swath/spacecraft/state hz"]),
        "states_age_s": float(health["guidance"][1]["/swath/spacecraft/state age_s"]),
        "alarm": [alarm.node, alarm.severity, alarm.state, alarm.sequence],
        "unknown_alarm": [unknown.accepted, unknown.reason],
        "acknowledged": [known.accepted, acknowledged.state],
        "imaged": event.client_ref,
        "imaged_reward": event.reward,
    }))


main()
